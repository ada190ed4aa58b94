//! The part of a frame's error that the frames after it share, as the marks show it (F17).
//!
//! Averaging over frames does not remove what all frames of some milliseconds have in common. Described are the errors
//! of single marks and the shift of all of them ([`crate::CameraDescription::mark_bias_m`]). A tilt of the rotor, which
//! shortens the picture of the pattern, or marks that are worse than described move the marks against each other, so
//! the residuals of a rigid motion show them. Their mean square above that of the noise and of the described errors is
//!
//! ```text
//! v = mean (sum |residual|^2) / (2 n - 3) - sigma^2         per coordinate; n marks at the radius rho
//!
//! angle's variance       v / (n rho^2)             errors of single marks: n > 2, and at rest
//!                        v / (6 rho^2)             tilt: n = 2, in motion
//! ```
//!
//! Two opposite marks on a rotor that tilts by `eta`, about an axis at the angle `psi / 2` to the line between them,
//! come nearer by the part `s = (eta^2 / 4) (1 + cos psi)` and turn by `e = (eta^2 / 4) sin psi`. Over all `psi` the
//! mean of `e^2` is a third of that of `s^2`, and `v = 2 rho^2 s^2`. More marks turn by nothing under a tilt, but
//! single marks may be wrong.
//!
//! A rotor at rest lies level, and each of its marks at one place of a pixel. So residuals at rest have a mean of their
//! own, and tell of single marks only. There the noise of the frames is known too, by their differences
//! ([`crate::camera::noise`]): what exceeds it is the same from frame to frame. Of a coarse camera it is the
//! quantisation, which the floor holds already. Two marks have one residual, their distance, which may be right by
//! chance while the angle is off: then nothing tells. So it is with one mark, always.
//!
//! These errors are not among the filter's states: their variance p is added to that of the angle ("considered"). A
//! filter whose memory is longer than the error's averages some of it, so p is an upper bound. A steady filter of the
//! bandwidth w takes the error for a rate with the response `w^2 s / (s^2 + sqrt 2 w s + w^2)`, whose largest square is
//! `w^2 / 2`, `w^2 = P22 / P11`. So `p P22 / (2 P11)` is added to the variance of the rate.

use motor_model::Real;

use crate::camera::track_tuning::TrackTuning;
use crate::measurement::CameraFrame;

/// Mean square residual per that of the noise from which it counts: four standard errors of a mean of 256 squares of
/// one degree of freedom above 1.
const SIGNIFICANT: f64 = 1.35;

/// Mean square of residuals.
#[derive(Clone, Copy, Debug, Default)]
struct ResidualMean<T> {
    /// As the variance of an angle from all marks, in rad^2; `None` before the first frame.
    mean_rad2: Option<T>,
    /// By how much it exceeds what is expected, if that is significant, in rad^2.
    excess_rad2: T,
}

impl<T: Real> ResidualMean<T> {
    /// Takes in the residual of a frame, of which the mean square is `expected_rad2` without further errors.
    #[inline(never)]
    fn take(&mut self, frame: &CameraFrame, expected_rad2: T, tuning: &TrackTuning<T>) {
        if frame.residual == 0 || !tuning.has_all_marks(frame) {
            return;
        }
        let steps = T::from_i32(frame.residual.into());
        let rad2 = steps * steps * tuning.residual_step_rad2;
        let mean_rad2 = self.mean_rad2.get_or_insert(expected_rad2);
        *mean_rad2 += (rad2 - *mean_rad2) * tuning.per_residual_frames;
        let significant = *mean_rad2 > T::from_f64(SIGNIFICANT) * expected_rad2;
        self.excess_rad2 = if significant { *mean_rad2 - expected_rad2 } else { T::zero() };
    }
}

/// What residuals show of a moving rotor's frames, and of a resting one's.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PersistentError<T> {
    moving: ResidualMean<T>,
    resting: ResidualMean<T>,
}

impl<T: Real> PersistentError<T> {
    /// Takes in the residual of a moving rotor's frame.
    #[inline]
    pub(crate) fn take(&mut self, frame: &CameraFrame, tuning: &TrackTuning<T>) {
        self.moving.take(frame, tuning.camera_rad2 + tuning.mark_bias_rad2, tuning);
        self.resting = ResidualMean::default();
    }

    /// The same of a rotor at rest, whose frames differ by the variance `white_rad2`.
    pub(crate) fn take_at_rest(&mut self, frame: &CameraFrame, white_rad2: T, tuning: &TrackTuning<T>) {
        if !tuning.coarse {
            self.resting.take(frame, white_rad2 + tuning.mark_bias_rad2, tuning);
        }
    }

    /// Variance of the angle in rad^2, beside what is described.
    pub(crate) fn rad2(&self, resting: bool, tuning: &TrackTuning<T>) -> T {
        if resting { self.resting.excess_rad2 } else { self.moving.excess_rad2 * tuning.persistent_part }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use core::f64::consts::TAU;
    use std::vec::Vec;

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
        let mut error = PersistentError::default();
        let coordinate_m2 = 1e-12 + 4e-12 / 12.0 + persistent_m2;
        for _ in 0..frames {
            let squares = (0..2 * u32::from(marks) - 3).map(|_| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                normal * normal
            });
            error.take(&frame(coordinate_m2 * squares.sum::<f64>(), marks), &tuning);
        }
        error.rad2(false, &tuning)
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

    /// Excess at rest after 2,000 frames of marks that are each off by `persistent_m2` in each coordinate, the same in
    /// all frames, as a part of the variance `persistent_m2 / (n rho^2)`. The noise is `louder` than described.
    fn at_rest(camera: &CameraDescription, persistent_m2: f64, louder: f64, seed: u64) -> f64 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let tuning = TrackTuning::<f64>::new(camera);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let freedom = 2 * usize::from(camera.marks) - 3;
        let same: Vec<f64> = (0..freedom).map(|_| math::sqrt(persistent_m2) * normal()).collect();
        let noise_m = math::sqrt(louder * (1e-12 + 4e-12 / 12.0));
        let mut error = PersistentError::default();
        for _ in 0..2_000 {
            let sum_m2 = same.iter().map(|off_m| off_m + noise_m * normal()).map(|off_m| off_m * off_m).sum();
            let shown = frame(sum_m2, camera.marks);
            error.take_at_rest(&shown, louder * tuning.camera_rad2, &tuning);
        }
        error.rad2(true, &tuning) * f64::from(camera.marks) * 3.9e-3 * 3.9e-3 / persistent_m2
    }

    /// Of eight marks 13 residuals: the mean square of what each is off is known to `sqrt(2 / 13)`, that of 100 rests
    /// to 4 %, and that of 100 rests of two marks, where little is not significant, to 14 %; four of each.
    #[test]
    fn law_residuals_at_rest_tell_of_single_marks() {
        for (marks, bound) in [(8, 0.16), (2, 0.57)] {
            let of = |seed| at_rest(&camera(marks), 16e-12, 1.0, seed);
            let mean = (1..=100).map(of).sum::<f64>() / 100.0;
            assert!((mean - 1.0).abs() < bound, "{marks}: {mean}");
        }
    }

    /// Noise that the differences of frames show, whatever its size, and the codes of a coarse camera are no persistent
    /// error.
    #[test]
    fn law_louder_noise_and_coarse_codes_are_not_told() {
        for (marks, louder) in [(2, 1.0), (2, 1.4), (8, 4.0)] {
            let told = (1..100).filter(|&seed| at_rest(&camera(marks), 1e-30, louder, seed) > 0.0).count();
            assert_eq!(told, 0, "{marks}");
        }
        let coarse = CameraDescription { resolution_m: 3e-6, ..camera(2) };
        assert!(at_rest(&coarse, 16e-12, 1.0, 3).abs() < f64::MIN_POSITIVE);
    }

    /// The described part of what the marks are off by is not told again, in motion and at rest; the next drive forgets
    /// what a rest showed.
    #[test]
    fn law_what_is_described_is_not_told_twice() {
        let described = CameraDescription { mark_bias_m: 4e-6, ..camera(8) };
        let tuning = TrackTuning::<f64>::new(&described);
        let coordinate_m2 = 1e-12 + 4e-12 / 12.0 + 16e-12;
        let mut error = PersistentError::default();
        for _ in 0..2_000 {
            error.take(&frame(13.0 * coordinate_m2, 8), &tuning);
            error.take_at_rest(&frame(13.0 * coordinate_m2, 8), tuning.camera_rad2, &tuning);
        }
        assert!(error.rad2(false, &tuning) + error.rad2(true, &tuning) < f64::MIN_POSITIVE);
        for _ in 0..2_000 {
            error.take_at_rest(&frame(26.0 * coordinate_m2, 8), tuning.camera_rad2, &tuning);
        }
        let expected = coordinate_m2 / (8.0 * 3.9e-3 * 3.9e-3);
        assert!(
            (error.rad2(true, &tuning) / expected - 1.0).abs() < 0.03,
            "{:e} {expected:e}",
            error.rad2(true, &tuning)
        );
        error.take(&frame(13.0 * coordinate_m2, 8), &tuning);
        assert!(error.rad2(true, &tuning) < f64::MIN_POSITIVE);
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
        let mut error = PersistentError::default();
        for _ in 0..10_000 {
            error.take(&CameraFrame { residual: 0, ..frame(1e-10, 3) }, &tuning);
            error.take(&CameraFrame { marks_used: 2, ..frame(1e-10, 3) }, &tuning);
        }
        assert!(error.rad2(false, &tuning) == 0.0 && error.moving.mean_rad2.is_none());
    }
}
