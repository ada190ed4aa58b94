//! The part of a frame's error that the frames after it share, as the marks show it.
//!
//! Averaging over frames removes tracking noise. It does not remove what all frames of some milliseconds have in
//! common: a tilt of the rotor, which shortens the picture of the pattern, or the errors of single marks. Both move the
//! marks against each other, so the residuals of a rigid motion show them. Their mean square above that of the noise is
//!
//! ```text
//! v = mean (sum |residual|^2) / (2 n - 3) - sigma^2         per coordinate; n marks at the radius rho
//!
//! angle's variance       v / (n rho^2)             errors of single marks, n > 2
//!                        v / (6 rho^2)             tilt, n = 2
//! ```
//!
//! Two opposite marks on a rotor that tilts by `eta`, about an axis at the angle `psi / 2` to the line between them,
//! come nearer by the part `s = (eta^2 / 4) (1 + cos psi)` and turn by `e = (eta^2 / 4) sin psi`. Over all `psi` the
//! mean of `e^2` is a third of that of `s^2`, and `v = 2 rho^2 s^2`. More marks turn by nothing under a tilt, but
//! single marks may be wrong.
//!
//! This error is not one of the filter's states: its variance is added to that of the angle ("considered"). A filter
//! whose memory is longer than the error's would average some of it, so the sum is an upper bound. A rotor at rest lies
//! level; what its single marks are off then is in [`crate::CameraDescription::floor_rad2`].

use motor_model::Real;

use crate::camera::track_tuning::TrackTuning;
use crate::measurement::CameraFrame;

/// Mean square residual per that of the noise from which it counts: four standard errors of a mean of 256 squares of
/// one degree of freedom above 1.
const SIGNIFICANT: f64 = 1.35;

/// Mean square of the residuals of a moving rotor's frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PersistentError<T> {
    /// As the variance of an angle from all marks, in rad^2; `None` before the first frame.
    mean_rad2: Option<T>,
    /// Variance of the angle that follows, in rad^2.
    rad2: T,
}

impl<T: Real> PersistentError<T> {
    /// Without frames.
    pub(crate) fn new() -> Self {
        Self { mean_rad2: None, rad2: T::zero() }
    }

    /// Takes in the residual of a frame.
    #[inline]
    pub(crate) fn take(&mut self, frame: &CameraFrame, tuning: &TrackTuning<T>) {
        if frame.residual == 0 || !tuning.has_all_marks(frame) {
            return;
        }
        let steps = T::from_i32(frame.residual.into());
        let rad2 = steps * steps * tuning.residual_step_rad2;
        let mean_rad2 = self.mean_rad2.get_or_insert(tuning.camera_rad2);
        *mean_rad2 += (rad2 - *mean_rad2) * tuning.per_residual_frames;
        let significant = *mean_rad2 > T::from_f64(SIGNIFICANT) * tuning.camera_rad2;
        let excess_rad2 = if significant { *mean_rad2 - tuning.camera_rad2 } else { T::zero() };
        self.rad2 = excess_rad2 * tuning.persistent_part;
    }

    /// Variance of the angle in rad^2.
    #[inline]
    pub(crate) fn rad2(&self) -> T {
        self.rad2
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use motor_model::{Angle, Time, math};
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;
    use crate::instruments::CameraDescription;

    fn camera(marks: u8) -> CameraDescription {
        CameraDescription { marks, ..CameraDescription::default() }
    }

    /// A frame whose residuals have this sum of squares, in m^2.
    fn frame(sum_m2: f64, marks: u8) -> CameraFrame {
        let residual = CameraFrame::residual_steps(math::sqrt(sum_m2 / f64::from(marks)));
        CameraFrame { residual, ..CameraFrame::new(Time::ZERO, Angle::ZERO) }
    }

    /// Variance after frames of marks with noise alone, and of a persistent variance of each coordinate beside.
    fn after(marks: u8, persistent_m2: f64, frames: u32, seed: u64) -> f64 {
        let (camera, mut rng) = (camera(marks), Pcg64::seed_from_u64(seed));
        let tuning = TrackTuning::<f64>::new(&camera);
        let mut error = PersistentError::new();
        let coordinate_m2 = 1e-12 + 4e-12 / 12.0 + persistent_m2;
        for _ in 0..frames {
            let squares = (0..2 * u32::from(marks) - 3).map(|_| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                normal * normal
            });
            error.take(&frame(coordinate_m2 * squares.sum::<f64>(), marks), &tuning);
        }
        error.rad2()
    }

    /// Noise alone is no persistent error, whatever the number of marks: not at any of 30,000 frames.
    #[test]
    fn law_noise_alone_is_not_told() {
        for marks in [2, 3, 8] {
            let told = (1..100).filter(|&seed| after(marks, 0.0, 300, seed) > 0.0).count();
            assert_eq!(told, 0, "{marks}");
        }
    }

    /// The mean of 512 squares of `2 n - 3` degrees of freedom, as the exponential window takes them, is known to
    /// `sqrt(2 / (2 n - 3) / 511)`: 6 % for two marks. The bounds are four times that.
    #[test]
    fn law_what_exceeds_the_noise_is_told() {
        let persistent_m2 = 4e-12;
        for (marks, part) in [(2_u8, 1.0 / 6.0), (3, 1.0 / 3.0), (8, 1.0 / 8.0)] {
            let expected = part * persistent_m2 / (3.9e-3 * 3.9e-3);
            let of_seeds = (1..=20).map(|seed| after(marks, persistent_m2, 2_000, seed)).sum::<f64>() / 20.0;
            assert!((of_seeds / expected - 1.0).abs() < 0.08, "{marks}: {of_seeds:e} {expected:e}");
        }
    }

    /// The line between two opposite marks of a rotor that tilts by `eta` about an axis in any direction: its turn, and
    /// the residual of the marks, by projection.
    #[test]
    fn exact_two_marks_turn_by_a_third_of_what_they_come_nearer() {
        let eta = 0.03_f64;
        let (mut turns, mut stretches) = (0.0, 0.0);
        for step in 0..360 {
            let direction = TAU * f64::from(step) / 360.0;
            // Along the axis of the tilt nothing changes; across it all lengths shrink by cos eta.
            let (across, along) = math::sin_cos(direction);
            let (x, y) = (along, across * (1.0 - 0.5 * eta * eta));
            let turn = math::atan2(y, x) - math::atan2(across, along);
            turns += turn * turn;
            stretches += (math::sqrt(x * x + y * y) - 1.0) * (math::sqrt(x * x + y * y) - 1.0);
        }
        assert!((3.0 * turns / stretches - 1.0).abs() < 2e-3, "{}", turns / stretches);
    }

    /// A camera that does not tell residuals, or one of which marks were left out, shows no persistent error.
    #[test]
    fn exact_frames_without_residual_change_nothing() {
        let tuning = TrackTuning::<f64>::new(&camera(3));
        let mut error = PersistentError::new();
        for _ in 0..10_000 {
            error.take(&CameraFrame { residual: 0, ..frame(1e-10, 3) }, &tuning);
            error.take(&CameraFrame { marks_used: 2, ..frame(1e-10, 3) }, &tuning);
        }
        assert!(error.rad2() == 0.0 && error.mean_rad2.is_none());
    }
}
