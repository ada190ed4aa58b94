//! What follows from the noise of the frames, computed beforehand for variances that double from level to level: a tick
//! computes no exponential.

use motor_model::{Real, math};

use crate::camera::noise::COARSE;
use crate::camera::rest_test::resting_frames;
use crate::instruments::CameraDescription;

/// Levels of the variance, each twice the one before: from 1/64 to 16 times the larger of assumed noise and steps.
const LEVELS: usize = 11;
/// The first level.
const FIRST: f64 = 1.0 / 64.0;

/// The camera's description in m^2, and what follows from each level of the noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoiseLevels<T> {
    /// Variance of the noise as assumed.
    pub(crate) assumed_m2: T,
    /// Variance of the quantisation.
    pub(crate) steps_m2: T,
    /// Variance of the least noise of which the resolution does not count as coarse.
    pub(crate) dithered_m2: T,
    first_m2: T,
    floors_rad2: [T; LEVELS],
    resting_frames: [u16; LEVELS],
}

impl<T: Real> NoiseLevels<T> {
    /// Those of `camera`.
    #[inline(never)]
    pub(crate) fn new(camera: &CameraDescription) -> Self {
        let steps_m2 = camera.resolution_m * camera.resolution_m / 12.0;
        let assumed_m2 = camera.noise_m * camera.noise_m;
        let first_m2 = FIRST * assumed_m2.max(steps_m2);
        let dithered_m = camera.resolution_m / COARSE;
        let mut levels = Self {
            assumed_m2: T::from_f64(assumed_m2),
            steps_m2: T::from_f64(steps_m2),
            dithered_m2: T::from_f64(dithered_m * dithered_m),
            first_m2: T::from_f64(first_m2),
            floors_rad2: [T::zero(); LEVELS],
            resting_frames: [0; LEVELS],
        };
        let mut noise_m2 = first_m2;
        for (floor_rad2, frames) in levels.floors_rad2.iter_mut().zip(&mut levels.resting_frames) {
            let other = CameraDescription { noise_m: math::sqrt(noise_m2), ..*camera };
            *floor_rad2 = T::from_f64(other.floor_rad2());
            *frames = resting_frames(other.variance_rad2(), camera.period_s());
            noise_m2 *= 2.0;
        }
        levels
    }

    /// The floor at the level just below `noise_m2`, which is not less than that at it; `None` below all levels.
    pub(crate) fn floor_rad2(&self, noise_m2: T) -> Option<T> {
        let (mut level_m2, mut found) = (self.first_m2, None);
        for &floor_rad2 in &self.floors_rad2 {
            if level_m2 > noise_m2 {
                break;
            }
            found = Some(floor_rad2);
            level_m2 += level_m2;
        }
        found
    }

    /// Frames that conclude rest, at the level just above `noise_m2`; at the last one beyond all levels.
    pub(crate) fn resting_frames(&self, noise_m2: T) -> u16 {
        let (mut level_m2, mut found) = (self.first_m2, 0);
        for &frames in &self.resting_frames {
            found = frames;
            if level_m2 >= noise_m2 {
                break;
            }
            level_m2 += level_m2;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The floor of a level is never less than that of the noise asked for, and at most that of half its variance; the
    /// frames are never fewer, and at most those of twice its variance.
    #[test]
    fn law_levels_bound_what_they_stand_for() {
        let camera = CameraDescription::default();
        let levels = NoiseLevels::<f64>::new(&camera);
        for factor in [0.031, 0.1, 0.5, 0.9, 1.0, 1.7, 5.0, 15.9] {
            let of =
                |factor: f64| CameraDescription { noise_m: camera.noise_m * math::sqrt(factor), ..camera };
            let floor_rad2 = levels.floor_rad2(factor * 1e-12 * (1.0 + 1e-9)).unwrap();
            let (least, most) = (of(factor).floor_rad2(), of(0.5 * factor).floor_rad2());
            assert!(
                (0.999 * least..=1.001 * most).contains(&floor_rad2),
                "{factor}: {floor_rad2:e} {least:e} {most:e}"
            );
            let frames = |factor| resting_frames(of(factor).variance_rad2(), camera.period_s());
            let found = levels.resting_frames(factor * 1e-12);
            assert!((frames(factor)..=frames(2.0 * factor)).contains(&found), "{factor}: {found}");
        }
        assert_eq!(levels.floor_rad2(0.0), None);
    }
}
