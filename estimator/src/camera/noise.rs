//! The noise of the frames, learnt while the rotor is quiet.
//!
//! The second difference of three frames at equal times is free of angle and rate, and needs no filter:
//!
//! ```text
//! d = z_n - 2 z_(n-1) + z_(n-2),    E d^2 = 6 R,    ratio = mean of d^2 / 6 R, over the last 1,024
//! ```
//!
//! The variance R in use becomes the assumed one times the ratio when that differs from 1 by half, and by six standard
//! errors `2 / sqrt(n)` (second differences overlap: white noise correlates them over two frames). Within that, the
//! camera counts as described. Noise counts as a quarter to four times the assumed one.
//!
//! What a quantiser of step Delta makes of the noise depends on the place in a cell, so a ratio is no proof of more
//! noise until it exceeds that of codes at the edge of a cell, `Delta^2 / 4`, and the variance in use is never that of
//! noise below 0.4 steps.
//!
//! The floor ([`CameraDescription::quantisation_floor_rad2`]) follows without that limit: where the codes change less
//! than assumed, an average of them is worse than assumed. It is that of the least noise that is certain: two standard
//! errors less than shown, and less by what codes at the edge of a cell change more than those elsewhere; or 0.7 times
//! the noise shown, whichever is more.
//!
//! A coarse camera, of steps beyond 2.5 times the noise, shows a resting rotor one code or two. Its floor is the
//! quantisation's variance when the codes change less than half as often as those in the middle of a cell would
//! ([`CameraDescription::dither_rad2`]), where they change least, and else the described one.

use core::f64::consts::PI;

use motor_model::{Angle, Real, Time, math};

use crate::camera::track_tuning::{COARSE, TrackTuning};
use crate::instruments::{CameraDescription, bias_part};
use crate::measurement::CameraFrame;

/// Most frames that the mean is taken over.
const FRAMES_MAX: f64 = 1024.0;
/// Least number of second differences from which another noise is used.
const FRAMES_MIN: f64 = 24.0;
/// Standard errors of the mean, and least difference from the ratio in use.
const STANDARD_ERRORS: f64 = 6.0;
const DIFFERS: f64 = 0.5;
/// Least difference from a ratio that was learnt.
const DIFFERS_AGAIN: f64 = 0.2;
/// Most that one second difference counts, per the variance in use, so that an outlier is little evidence: three
/// standard deviations. One frame in a hundred that is wrong spoils three differences, which count 0.27 in the mean.
const SQUARE_MAX: f64 = 9.0;
/// Largest factor of the noise, either way.
const FACTOR_MAX: f64 = 4.0;
/// Noise per that of codes at one place of a cell, where it is less than assumed: between the middle of the cell, where
/// it is 1, and the edge.
const EDGE: f64 = 0.7;
/// Standard errors of the mean by which the noise may be less than shown, for the floor.
const CERTAIN_ERRORS: f64 = 2.0;
/// Frames between two changes of the floor.
const FLOOR_FRAMES: u8 = 64;
/// Variance of the codes at the edge of a cell, `Delta^2 / 4`, per that of a uniform error: no evidence of noise.
const EDGE_STEPS: f64 = 3.0;
/// Part of the changes of the code in the middle of a cell below which a coarse camera has less noise than assumed.
const UNDITHERED: f64 = 0.5;
/// Changes to be expected before that is judged, in second differences per those of independent errors: of thirty
/// changes half are missing by chance once in a thousand times.
const CHANGES_MIN: f64 = 30.0;

/// The last two frames, and the mean square of the second differences.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CameraNoise<T> {
    last: Option<(Time, Angle)>,
    before: Option<(Time, Angle)>,
    frames: T,
    ratio: T,
    /// The ratio that was last adopted, and that of the variance in use.
    adopted: T,
    used: T,
    /// Variances of noise and quantisation as assumed, in m^2.
    noise_m2: T,
    steps_m2: T,
    /// Frames since the floor was last set by what was learnt.
    since_floor: u8,
}

/// `x`, but not beyond these bounds; the upper one for NaN.
fn within<T: Real>(x: T, least: T, most: T) -> T {
    let x = if x < most { x } else { most };
    if x > least { x } else { least }
}

impl<T: Real> CameraNoise<T> {
    pub(crate) fn new(camera: &CameraDescription) -> Self {
        Self {
            ratio: T::one(),
            adopted: T::one(),
            used: T::one(),
            noise_m2: T::from_f64(camera.noise_m * camera.noise_m),
            steps_m2: T::from_f64(camera.resolution_m * camera.resolution_m / 12.0),
            ..Self::default()
        }
    }

    /// Takes in a frame of a quiet rotor, and corrects the tuning when the noise differs from what it says; returns
    /// whether it has.
    #[inline(never)]
    pub(crate) fn take(&mut self, frame: &CameraFrame, tuning: &mut TrackTuning<T>) -> bool {
        if !tuning.has_all_marks(frame) {
            (self.before, self.last) = (None, None);
            return false;
        }
        let (before, last) = (self.before, self.last);
        (self.before, self.last) = (last, Some((frame.exposed_at, frame.angle)));
        let (Some((at_2, angle_2)), Some((at_1, angle_1))) = (before, last) else { return false };
        let (span_2, span_1) = (at_1.nanos_since(at_2), frame.exposed_at.nanos_since(at_1));
        // Late, lost or repeated frames are not evenly spaced. After a long time the rotor may have been driven.
        if span_1 == 0 || span_1.abs_diff(span_2) > span_1 / 8 || span_1 > 3 * tuning.camera.period_nanos {
            return false;
        }
        let step_rad =
            |later: Angle, earlier: Angle| -> T { later.minus(earlier).wrapped().radians_since(Angle::ZERO) };
        let second_rad = step_rad(frame.angle, angle_1) - step_rad(angle_1, angle_2);
        let assumed_rad2 = tuning.camera_rad2 / self.used;
        let square = second_rad * second_rad / (T::from_f64(6.0) * assumed_rad2);
        let square = within(square, T::zero(), T::from_f64(SQUARE_MAX) * self.used);
        if self.frames < T::from_f64(FRAMES_MAX) {
            self.frames += T::one();
        }
        self.ratio += (square - self.ratio) / self.frames;
        let differs = self.differs();
        if differs {
            self.adopt(assumed_rad2, tuning);
        }
        self.since_floor += 1;
        if differs || self.since_floor >= FLOOR_FRAMES {
            self.since_floor = 0;
            self.set_floor(tuning);
        }
        differs
    }

    /// Variance of the frames' angle in rad^2 by what differs from frame to frame: at least that in use.
    pub(crate) fn white_rad2(&self, tuning: &TrackTuning<T>) -> T {
        let shown = if self.ratio > self.used { self.ratio / self.used } else { T::one() };
        tuning.camera_rad2 * shown
    }

    fn differs(&self) -> bool {
        if self.frames < T::from_f64(FRAMES_MIN) {
            return false;
        }
        let as_assumed = self.adopted == T::one();
        let least = T::from_f64(if as_assumed { DIFFERS } else { DIFFERS_AGAIN });
        let off = self.ratio - self.adopted;
        let error2 = T::from_f64(4.0) * self.adopted * self.adopted / self.frames;
        let noticeable = off > least * self.adopted || -off > least * self.ratio;
        noticeable && off * off > T::from_f64(STANDARD_ERRORS * STANDARD_ERRORS) * error2
    }

    /// Adopts the ratio for the variance, as far as the camera's resolution lets the noise be known.
    #[cold]
    fn adopt(&mut self, assumed_rad2: T, tuning: &mut TrackTuning<T>) {
        let (noise_m2, steps_m2, factor2) =
            (self.noise_m2, self.steps_m2, T::from_f64(FACTOR_MAX * FACTOR_MAX));
        let all_m2 = noise_m2 + steps_m2;
        // Written so that what is not finite is not adopted.
        let usable = self.ratio * T::zero() == T::zero() && all_m2 > T::zero();
        if !usable {
            return;
        }
        self.adopted = self.ratio;
        let shown_m2 = self.ratio * all_m2;
        let used_m2 = if self.ratio > T::one() {
            let largest_m2 = factor2 * if noise_m2 > steps_m2 { noise_m2 } else { steps_m2 };
            within(shown_m2 - T::from_f64(EDGE_STEPS) * steps_m2, noise_m2, largest_m2)
        } else {
            let dithered_m2 = steps_m2 * T::from_f64(12.0 / (COARSE * COARSE));
            let least_m2 = within(dithered_m2, noise_m2 / factor2, noise_m2);
            within(shown_m2 - steps_m2, least_m2, noise_m2)
        };
        self.used = (used_m2 + steps_m2) / all_m2;
        tuning.camera_rad2 = assumed_rad2 * self.used;
    }

    /// Sets the floor by what the codes show.
    #[cold]
    fn set_floor(&self, tuning: &mut TrackTuning<T>) {
        let all_m2 = self.noise_m2 + self.steps_m2;
        let step_m2 = T::from_f64(12.0) * self.steps_m2;
        // The variance of a code, in steps squared, is the share of codes beside the most frequent one.
        let changes = self.frames * tuning.least_dither * all_m2 / step_m2;
        let undithered = self.ratio < T::from_f64(UNDITHERED) * tuning.least_dither;
        tuning.floor_rad2 = if tuning.coarse && undithered && changes >= T::from_f64(CHANGES_MIN) {
            tuning.quantisation_rad2
        } else if !tuning.coarse && self.adopted < T::one() {
            let part = bias_part((self.certain_m2() / step_m2).to_f32());
            tuning.quantisation_rad2 * T::from_f32(part)
        } else {
            tuning.described_floor_rad2
        };
    }

    /// The noise that the codes have for certain, wherever in a cell the rotor lies.
    fn certain_m2(&self) -> T {
        let shown_m2 = self.ratio * (self.noise_m2 + self.steps_m2);
        let least_m2 = self.noise_m2 / T::from_f64(FACTOR_MAX * FACTOR_MAX);
        let mean_m2 = within(shown_m2 - self.steps_m2, least_m2, self.noise_m2);
        let error = T::from_f32(2.0 / math::sqrt_f32(self.frames.to_f32()));
        let certain_m2 = mean_m2 - self.place_m2(mean_m2) - T::from_f64(CERTAIN_ERRORS) * error * shown_m2;
        within(certain_m2, T::from_f64(EDGE * EDGE) * mean_m2, mean_m2)
    }

    /// By how much the variance of codes of this noise exceeds its mean at the edge of a cell, about: the first
    /// harmonic of its dependence on the place.
    fn place_m2(&self, noise_m2: T) -> T {
        let per_step2 = noise_m2 / (T::from_f64(12.0) * self.steps_m2);
        let kept = T::from_f32(math::exp_f32((per_step2 * T::from_f64(-2.0 * PI * PI)).to_f32()));
        T::from_f64(4.0) * (noise_m2 + self.steps_m2 * T::from_f64(3.0 / (PI * PI))) * kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// The default camera on one mark, on two, three and eight.
    fn cameras() -> [CameraDescription; 4] {
        [1, 2, 3, 8].map(|marks| CameraDescription { marks, ..CameraDescription::default() })
    }

    /// A variance of the angle as a deviation of each mark, in steps.
    fn in_steps(angle_rad2: f32, camera: &CameraDescription) -> f64 {
        (f64::from(angle_rad2) * f64::from(camera.marks)).sqrt() * camera.radius_m / camera.resolution_m
    }

    /// The tuning for a camera after 2,000 frames of a rotor at rest whose noise is `factor` times the assumed one.
    fn learnt(camera: &CameraDescription, factor: f64, seed: u64) -> TrackTuning<f32> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut tuning = TrackTuning::<f32>::new(camera);
        let mut noise = CameraNoise::new(camera);
        let step_m = camera.resolution_m;
        for n in 0..2000 {
            // Each mark has a place of its own in its cell.
            let code_m = |mark: u8| {
                let place_m = 1.3e-6 + 0.37 * f64::from(mark) * step_m;
                let normal: f64 = StandardNormal.sample(&mut rng);
                ((place_m + factor * camera.noise_m * normal) / step_m).round() * step_m - place_m
            };
            let mean_m = (0..camera.marks).map(code_m).sum::<f64>() / f64::from(camera.marks);
            let angle = Angle::from_degrees((mean_m / camera.radius_m).to_degrees());
            let exposed_at = Time::from_nanos(n * camera.period_nanos);
            noise.take(&CameraFrame::new(exposed_at, angle), &mut tuning);
        }
        tuning
    }

    /// Noise that is a fifth above the assumed one is within what counts as described, and is known all the same: its
    /// variance is never less by more than four standard errors of 1,024 frames, 6 % each. It may be half as much again
    /// where the first frames have adopted more. Less than in use is not known.
    #[test]
    fn law_what_differs_from_frame_to_frame_is_known_at_rest() {
        let camera = CameraDescription { resolution_m: 3e-7, ..CameraDescription::default() };
        for (factor, seed) in [(1.2, 1), (1.2, 2), (1.2, 3), (0.9, 1), (0.9, 2)] {
            let mut rng = Pcg64::seed_from_u64(seed);
            let mut tuning = TrackTuning::<f32>::new(&camera);
            let mut noise = CameraNoise::new(&camera);
            let truth = CameraDescription { noise_m: factor * camera.noise_m, ..camera }.variance_rad2();
            for n in 0..2000 {
                let normal: f64 = StandardNormal.sample(&mut rng);
                let angle = Angle::from_degrees((math::sqrt(truth) * normal).to_degrees());
                noise.take(&CameraFrame::new(Time::from_nanos(n * camera.period_nanos), angle), &mut tuning);
            }
            let expected = if factor > 1.0 { truth } else { camera.variance_rad2() };
            let off = f64::from(noise.white_rad2(&tuning)) / expected;
            assert!((0.76..1.5).contains(&off), "{factor} {seed}: {off}");
        }
    }

    /// Half the noise up to four times of it: the variance within 40 %, 1.2 of rounding in use and four standard errors
    /// of the mean (6 %).
    #[test]
    fn law_the_noise_is_learnt_within_a_factor_of_four() {
        for period_nanos in [10_000, 100_000, 100_000_000] {
            for camera in
                cameras().map(|camera| CameraDescription { period_nanos, resolution_m: 3e-7, ..camera })
            {
                for factor in [0.3, 0.5, 2.0, 3.0, 4.0] {
                    let truth =
                        CameraDescription { noise_m: factor * camera.noise_m, ..camera }.variance_rad2();
                    for seed in 0..5 {
                        let off = f64::from(learnt(&camera, factor, seed).camera_rad2) / truth;
                        assert!((0.71..1.41).contains(&off), "{camera:?} {factor} {off}");
                    }
                }
            }
        }
    }

    /// A camera that is as described is used as described, to the bit; a coarse one too, though it repeats its codes.
    #[test]
    fn exact_nothing_changes_where_the_description_is_right() {
        let coarse = cameras().map(|camera| CameraDescription { resolution_m: 1e-5, ..camera });
        for camera in cameras().into_iter().chain(coarse) {
            for seed in 0..20 {
                let tuning = learnt(&camera, 1.0, seed);
                assert_eq!(
                    tuning.camera_rad2.to_bits(),
                    TrackTuning::<f32>::new(&camera).camera_rad2.to_bits()
                );
            }
        }
    }

    /// Half the noise that was assumed, at steps of two: the codes of a rotor between the middle and the edge of a cell
    /// change too rarely, and the floor says so: at most 0.2 of a step's error, at least a twentieth.
    #[test]
    fn law_the_floor_follows_less_dither_than_assumed() {
        for camera in cameras() {
            for seed in 0..5 {
                let floor_steps = in_steps(learnt(&camera, 0.4, seed).floor_rad2, &camera);
                assert!((0.05..0.29).contains(&floor_steps), "{} {floor_steps}", camera.marks);
            }
        }
    }

    /// Noise of half a step, assumed to be twice to four times as much: the floor becomes the true one, 0.0016 steps,
    /// but for what is not known of the noise: two standard errors of 6 %, and the place in the cell.
    #[test]
    fn law_the_floor_of_a_camera_assumed_too_noisy_is_nearly_its_own() {
        for (truth, factor) in cameras().into_iter().flat_map(|truth| [(truth, 2.0), (truth, 4.0)]) {
            let assumed = CameraDescription { noise_m: factor * truth.noise_m, ..truth };
            for seed in 0..5 {
                let floor_steps = in_steps(learnt(&assumed, 1.0 / factor, seed).floor_rad2, &truth);
                // exp(-2 pi^2 (0.25 - 0.041 - 0.008)) / (pi sqrt 2), and a fifth of the noise for chance.
                assert!((0.0016..0.0107).contains(&floor_steps), "{} {factor} {floor_steps}", truth.marks);
            }
        }
    }

    /// One frame in a hundred is wrong by 20 degrees.
    #[test]
    fn exact_outliers_teach_nothing() {
        let camera = CameraDescription::default();
        let mut tuning = TrackTuning::<f32>::new(&camera);
        let mut noise = CameraNoise::new(&camera);
        let mut rng = Pcg64::seed_from_u64(3);
        for n in 0..2000_u64 {
            let outlier = if n % 100 == 50 { 20.0 } else { 0.0 };
            let normal: f64 = StandardNormal.sample(&mut rng);
            let angle = Angle::from_degrees((camera.variance_rad2().sqrt() * normal).to_degrees() + outlier);
            noise.take(&CameraFrame::new(Time::from_nanos(n * 100_000), angle), &mut tuning);
        }
        assert_eq!(tuning.camera_rad2.to_bits(), TrackTuning::<f32>::new(&camera).camera_rad2.to_bits());
    }
}
