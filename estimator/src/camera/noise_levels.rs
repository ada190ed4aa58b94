//! What follows from the noise of the frames, computed beforehand for variances that double from level to level: a tick
//! computes no exponential.

use motor_model::{Real, math};

use crate::camera::rest_test::resting_frames;
use crate::instruments::CameraDescription;

/// Resolution per noise beyond which a smaller noise is not learnt.
pub(crate) const COARSE: f64 = 2.5;
/// Levels of the variance, each twice the one before: from 1/64 to 16 times the larger of assumed noise and steps.
const LEVELS: usize = 11;
/// Halvings of the distance between two levels.
const HALVINGS: u8 = 3;
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
    /// Half of the spread of the codes' variance over the places in a cell, in m^2.
    places_m2: [T; LEVELS],
    resting_frames: [u16; LEVELS],
}

fn root<T: Real>(x: T) -> T {
    T::from_f32(math::sqrt_f32(x.to_f32()))
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
            places_m2: [T::zero(); LEVELS],
            resting_frames: [0; LEVELS],
        };
        let mut noise_m2 = first_m2;
        let radius_m2 = camera.radius_m * camera.radius_m;
        let of_levels =
            levels.floors_rad2.iter_mut().zip(&mut levels.places_m2).zip(&mut levels.resting_frames);
        for ((floor_rad2, place_m2), frames) in of_levels {
            let other = CameraDescription { noise_m: math::sqrt(noise_m2), ..*camera };
            *floor_rad2 = T::from_f64(other.quantisation_floor_rad2());
            *place_m2 = T::from_f64(radius_m2 * (other.variance_rad2() - other.dither_rad2()));
            *frames = resting_frames(other.variance_rad2(), camera.period_s());
            noise_m2 *= 2.0;
        }
        levels
    }

    /// The floor of noise `noise_m2`, or of an eighth of a level's distance less; `None` below all levels.
    pub(crate) fn floor_rad2(&self, noise_m2: T) -> Option<T> {
        self.at(&self.floors_rad2, noise_m2)
    }

    /// By how much noise `noise_m2` may be less than the variance of the codes says, because the rotor lies at the edge
    /// of a cell, where they change most: half of the spread over places. `None` below all levels.
    pub(crate) fn place_m2(&self, noise_m2: T) -> Option<T> {
        self.at(&self.places_m2, noise_m2)
    }

    /// The value of a falling table at `noise_m2`, or at an eighth of a level's distance less.
    ///
    /// Between two levels it is at most geometric: a sum of exponentials of the noise is convex in its logarithm. So
    /// half way between two variances it is at most the geometric mean of both.
    fn at(&self, table: &[T; LEVELS], noise_m2: T) -> Option<T> {
        let (mut level_m2, mut found) = (self.first_m2, None);
        for (index, &value) in table.iter().enumerate() {
            if level_m2 > noise_m2 {
                break;
            }
            found = Some((level_m2, value, table.get(index + 1).copied().unwrap_or(value)));
            level_m2 += level_m2;
        }
        let (mut below_m2, mut value, mut above) = found?;
        let mut half_m2 = below_m2;
        for _ in 0..HALVINGS {
            half_m2 *= T::from_f64(0.5);
            // Two roots: the product underflows in single precision.
            let middle = root(value) * root(above);
            if below_m2 + half_m2 <= noise_m2 {
                (below_m2, value) = (below_m2 + half_m2, middle);
            } else {
                above = middle;
            }
        }
        Some(value)
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

    /// The floor is never less than that of the noise asked for, and at most that of an eighth less variance, or of
    /// half of a small one; the frames are never fewer, and at most those of twice its variance.
    #[test]
    fn law_levels_bound_what_they_stand_for() {
        // The unit of an angle, 1.5e-9 rad, squared.
        const ROUNDING_RAD2: f64 = 2e-18;
        let camera = CameraDescription::default();
        let levels = NoiseLevels::<f64>::new(&camera);
        for factor in [0.031, 0.1, 0.5, 0.9, 1.0, 1.7, 5.0, 15.9] {
            let of =
                |factor: f64| CameraDescription { noise_m: camera.noise_m * math::sqrt(factor), ..camera };
            let floor_rad2 = levels.floor_rad2(factor * 1e-12 * (1.0 + 1e-9)).unwrap();
            // With noise of a third of a step and more, one exponential is nearly all of the floor.
            let part = if factor < 0.45 { 0.5 } else { 0.875 };
            let (least, most) = (
                of(factor).quantisation_floor_rad2() - ROUNDING_RAD2,
                of(part * factor).quantisation_floor_rad2(),
            );
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
