//! The mean rate of a drive, to which the rate of a driven rotor returns between the frames of a slow camera (F23).
//!
//! A random walk would lose the turn there: in 0.1 s it adds 18 rad/s. In truth the rate returns to its mean with its
//! correlation time T, 12 ms in mode B and 2 ms in mode C. So the rate and its error decay by `exp(-h / T)` after each
//! step h of the random walk, at most T / 3 long, or a sixteenth of the time to the next frame.
//!
//! ```text
//! rate' = (m - rate) / T + white noise of intensity q
//!
//! m = f n(a)                              n: mean rate of the nominal motor at the amplitude a of the drive
//! f <- f + w n / (n^2 + e^2) innovation / t
//!                                         t: time between two frames between which the drive was on in one mode
//! ```
//!
//! with w = 0.3 and e = 1 rad/s: a weak drive tells little of the factor f of its mode. The model gives, within 0.44
//! rad/s in mode B and 0.054 rad/s in mode C,
//!
//! ```text
//! mode B   n = 16 (a - 0.25) / 0.75 rad/s          mode C   n = -1.7 ((a - 0.4) / 0.6)^2 rad/s         0 below
//! ```
//!
//! The rate is carried piece by piece, since a drive may begin and end between two frames
//! ([`crate::vibrometer::motion_history`]). After the drive m is zero. The rotor bounces on for some time; then it is
//! quiet, and the rate wanders for 25 ms while it may slide. For 50 ms after another change friction brings the rate to
//! the new mean, which takes as long in both modes: with T of mode B, and five times the noise. Frames teach once that
//! is over: an innovation on the way tells of the way, and learnt as a mean it takes the rotor for one that turns the
//! other way.

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::camera::process::{ReturnToMean, Wandering};
use crate::innovation::{Innovation, Verdict};
use crate::vibrometer::motion::{Motion, STOPPING_NANOS};
use crate::vibrometer::motion_history::{MotionPiece, NEVER};

/// Correlation time of the rate in modes B and C, in s.
const CORRELATION_B_S: f64 = 12e-3;
const CORRELATION_C_S: f64 = 2e-3;
/// A third of it, in ns.
const THIRD_B_NANOS: u64 = 4_000_000;
const THIRD_C_NANOS: u64 = 666_666;
/// Factor of the process noise while the rate goes to another mean: in mode B a standard deviation of 10 rad/s.
const TRANSITION: f64 = 5.0;
/// Time after a change of the motion until the rate is at its mean, in ns: four correlation times of mode B.
const TRANSITION_NANOS: u64 = 50_000_000;

/// Mean rate of the nominal motor at full drive in rad/s, modes B and C.
const NOMINAL_RAD_S: [f64; 2] = [16.0, -1.7];
/// Amplitude up to which a drive does not turn it.
const LEAST_AMPLITUDE: [f32; 2] = [0.25, 0.4];
/// Weight of a frame.
const WEIGHT: f64 = 0.3;
/// Rate of a drive that tells half as much of the factor as a fast one, in rad/s.
const TELLING_RAD_S: f64 = 1.0;
/// Largest factor: 60 rad/s in mode B.
const MOST: f64 = 3.75;

/// The mean rates, and whether the drive has been on in one mode since the last frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanRates<T> {
    /// Factors of the nominal rates in modes B and C.
    factors: [T; 2],
    /// Of the newest drive in modes B and C.
    amplitudes: [f32; 2],
    /// When the drive was last switched off, and on after it.
    off_at: Time,
    on_at: Time,
    /// The mode in force since the frame exposed at the time beside it.
    driven: Option<(DriveMode, Time)>,
}

impl<T: Real> MeanRates<T> {
    pub(super) fn new() -> Self {
        Self {
            factors: [T::one(); 2],
            amplitudes: [1.0; 2],
            off_at: Time::ZERO,
            on_at: Time::ZERO,
            driven: None,
        }
    }

    /// In modes B and C, each at the amplitude of its newest drive, in rad/s.
    pub(super) fn rad_s(&self) -> [T; 2] {
        let [of_b, of_c] = self.nominal_rad_s();
        let [b, c] = self.factors;
        [b * of_b, c * of_c]
    }

    /// Of the nominal motor.
    fn nominal_rad_s(&self) -> [T; 2] {
        let [b, c] = self.amplitudes;
        let above = |amplitude: f32, least: f32| {
            let part = (amplitude - least) / (1.0 - least);
            T::from_f64(part.max(0.0).into())
        };
        let ([full_b, full_c], [least_b, least_c]) = (NOMINAL_RAD_S.map(T::from_f64), LEAST_AMPLITUDE);
        let (b, c) = (above(b, least_b), above(c, least_c));
        [full_b * b, full_c * c * c]
    }

    /// How the rate returns right after `at` in `piece`, as far as the camera alone shows. `walk` is that piece of its
    /// random walk.
    #[cold]
    pub(super) fn returning(&self, piece: &MotionPiece, at: Time, mut walk: Wandering<T>) -> ReturnToMean<T> {
        let stopped_at = piece.begun.plus_nanos(STOPPING_NANOS);
        walk.until = piece.until;
        if piece.motion == Motion::Quiet && at < stopped_at {
            walk.until = piece.until.min(stopped_at);
            return ReturnToMean {
                walk,
                mean_rad_s: T::zero(),
                per_s: T::zero(),
                third_nanos: STOPPING_NANOS,
            };
        }
        let [mean_b, mean_c] = self.rad_s();
        let driven_rad_s = piece.motion.of(mean_b, mean_c, T::zero());
        let (begun, end, mean_rad_s) = if at < self.off_at {
            (piece.begun, self.off_at, driven_rad_s)
        } else if at < self.on_at {
            (self.off_at, self.on_at, T::zero())
        } else {
            (self.on_at, NEVER, driven_rad_s)
        };
        walk.until = piece.until.min(end);
        let of_b = (T::from_f64(1.0 / CORRELATION_B_S), THIRD_B_NANOS);
        let of_c = (T::from_f64(1.0 / CORRELATION_C_S), THIRD_C_NANOS);
        let settled_at = begun.max(piece.begun).plus_nanos(TRANSITION_NANOS);
        let (per_s, third_nanos) = if at < settled_at && piece.motion != Motion::Quiet {
            // The mean of the mode before, of the next one, or between them: not known to some ten rad/s.
            walk.intensity_rad2_s3 *= T::from_f64(TRANSITION);
            walk.until = walk.until.min(settled_at);
            of_b
        } else {
            piece.motion.of(of_b, of_c, of_b)
        };
        ReturnToMean { walk, mean_rad_s, per_s, third_nanos }
    }

    /// The drive is `command` from `at` on.
    pub(super) fn note_drive(&mut self, at: Time, command: DriveCommand) {
        let mode = command.mode();
        let was_on = self.on_at < NEVER;
        if mode.is_some() != was_on {
            (self.off_at, self.on_at) = if was_on { (at, NEVER) } else { (self.off_at, at) };
        }
        let [b, c] = &mut self.amplitudes;
        match mode {
            Some(DriveMode::B) => *b = command.amplitude(),
            Some(DriveMode::C) => *c = command.amplitude(),
            None => (),
        }
        self.driven = self.driven.filter(|(driven, _)| mode == Some(*driven));
    }

    /// Learns from a frame, while `mode` is driven, under a motion that has begun at `begun`.
    pub(super) fn note_frame(&mut self, frame: &Innovation<T>, mode: Option<DriveMode>, begun: Time) {
        let driven = mode.filter(|_| frame.verdict != Verdict::Restarted).map(|mode| (mode, frame.taken_at));
        let since = core::mem::replace(&mut self.driven, driven);
        let (Some((driven, from)), Verdict::Used) = (since, frame.verdict) else { return };
        let seconds: T = frame.taken_at.seconds_since(from);
        let ([nominal_b, nominal_c], [b, c]) = (self.nominal_rad_s(), &mut self.factors);
        let (factor, nominal) = if driven == DriveMode::B { (b, nominal_b) } else { (c, nominal_c) };
        if seconds > T::zero() && from >= begun.max(self.on_at).plus_nanos(TRANSITION_NANOS) {
            let telling_rad2_s2 = nominal * nominal + T::from_f64(TELLING_RAD_S * TELLING_RAD_S);
            let learnt =
                *factor + T::from_f64(WEIGHT) * nominal * frame.innovation_rad / (seconds * telling_rad2_s2);
            // Written so that NaN is not learnt.
            if learnt.abs() < T::from_f64(MOST) {
                *factor = learnt;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraDescription;
    use crate::filters::constant_rate::RandomWalkTuning;
    use crate::innovation::Source;

    fn used(millis: u64, innovation_rad: f64) -> Innovation<f64> {
        Innovation {
            source: Source::Camera,
            taken_at: Time::from_micros(1000 * millis),
            innovation_rad,
            variance_rad2: 1.0,
            verdict: Verdict::Used,
        }
    }

    /// A frame that is 10 mrad ahead after 20 ms shows a rate of 0.5 rad/s above the mean. Of that a part of 0.3 is
    /// learnt, of that mode: all of it where the drive is fast, and less where it is weak. A frame over a change of
    /// the drive teaches nothing, and so does one that would make the mean faster than any rotor's, and one of a rate
    /// that is on its way to the mean.
    #[test]
    fn exact_a_frame_teaches_a_part_of_what_it_is_ahead_by() {
        let [b, c] = [DriveMode::B, DriveMode::C];
        let learnt =
            |mode: DriveMode, amplitude: f32, ahead_rad: f64, between: DriveCommand, begun_millis: u64| {
                let begun = Time::from_micros(1000 * begun_millis);
                let mut means = MeanRates::<f64>::new();
                means.note_drive(Time::ZERO, DriveCommand::saturating(mode, amplitude));
                let before = means.rad_s();
                means.note_frame(&used(100, 0.0), Some(mode), begun);
                means.note_drive(Time::from_micros(110_000), between);
                means.note_drive(Time::ZERO, DriveCommand::saturating(mode, amplitude));
                means.note_frame(&used(120, ahead_rad), Some(mode), begun);
                let after = means.rad_s();
                [after[0] - before[0], after[1] - before[1]]
            };
        let same = |mode, amplitude| DriveCommand::saturating(mode, amplitude);
        let told = |rate_rad_s: f64| 0.15 * rate_rad_s * rate_rad_s / (rate_rad_s * rate_rad_s + 1.0);
        for (mode, amplitude, ahead_rad, between, begun_millis, expected) in [
            (b, 1.0, 0.01, same(b, 1.0), 50, told(16.0)),
            (b, 0.3, 0.01, same(b, 0.3), 50, told(16.0 * 0.05 / 0.75)),
            (c, 1.0, 0.01, same(c, 1.0), 50, told(1.7)),
            (c, 1.0, -0.01, same(c, 1.0), 50, -told(1.7)),
            (c, 1.0, 0.01, same(c, 1.0), 51, 0.0),
            (c, 1.0, 0.01, DriveCommand::OFF, 0, 0.0),
            (c, 1.0, 0.01, same(b, 1.0), 0, 0.0),
            (b, 1.0, 5.0, same(b, 1.0), 0, 0.0),
        ] {
            let learnt = learnt(mode, amplitude, ahead_rad, between, begun_millis);
            let [own, other] = if mode == b { learnt } else { [learnt[1], learnt[0]] };
            assert!(
                other.to_bits() == 0 && (own - expected).abs() < 1e-6,
                "{mode:?} {amplitude} {ahead_rad} {between:?}: {learnt:?}, not {expected}"
            );
        }
    }

    /// The means of the prior are those that the nominal motor has, by the map of its cruises, in mode B within the
    /// ripple of a tenth of 4.4 rad/s, in mode C of 0.54 rad/s; half as much is turned by a motor of half the factor.
    #[test]
    fn exact_a_weak_drive_has_a_slow_mean() {
        let mut means = MeanRates::<f64>::new();
        for (mode, amplitude, cruise_rad_s) in [
            (DriveMode::B, 0.2, 0.0),
            (DriveMode::B, 0.3, 0.99),
            (DriveMode::B, 0.5, 5.57),
            (DriveMode::B, 0.8, 11.53),
            (DriveMode::C, 0.3, -0.026),
            (DriveMode::C, 0.6, -0.2),
            (DriveMode::C, 0.8, -0.79),
        ] {
            means.note_drive(Time::ZERO, DriveCommand::saturating(mode, amplitude));
            let [of_b, of_c] = means.rad_s();
            let (own, within) = if mode == DriveMode::B { (of_b, 0.44) } else { (of_c, 0.054) };
            assert!((own - cruise_rad_s).abs() < within, "{mode:?} {amplitude}: {own}");
        }
    }

    /// The drive is off from 100 to 130 ms: there the mean is zero, and each change is followed by 50 ms of transition.
    /// A quiet rotor wanders for 25 ms before its rate returns to zero.
    #[test]
    fn exact_the_mean_is_zero_after_the_drive() {
        let millis = |millis: u64| Time::from_micros(1000 * millis);
        let camera = CameraDescription { period_nanos: 20_000_000, ..CameraDescription::default() };
        let tuning = RandomWalkTuning::<f64>::new(&camera);
        let mode = DriveMode::B;
        let mut means = MeanRates::<f64>::new();
        means.note_drive(millis(100), DriveCommand::OFF);
        means.note_drive(millis(105), DriveCommand::OFF);
        means.note_drive(millis(130), DriveCommand::full(mode));
        means.note_drive(millis(140), DriveCommand::full(mode));
        let motion = Motion::Impacted(mode);
        let piece = MotionPiece { motion, rested: false, begun: Time::ZERO, until: NEVER };
        let [settled, transition] = [1.0, TRANSITION].map(|factor| factor * tuning.impacted_b_rad2_s3);
        for (at, until, mean_rad_s, intensity_rad2_s3) in [
            (millis(20), millis(50), 16.0, transition),
            (millis(60), millis(100), 16.0, settled),
            (millis(100), millis(130), 0.0, transition),
            (millis(129), millis(130), 0.0, transition),
            (millis(130), millis(180), 16.0, transition),
            (millis(180), NEVER, 16.0, settled),
        ] {
            let own = means.returning(&piece, at, tuning.wandering(&piece, at, false));
            let found = (own.walk.until, own.mean_rad_s, own.walk.intensity_rad2_s3);
            assert_eq!(found, (until, mean_rad_s, intensity_rad2_s3), "{at:?}");
        }
        let quiet = MotionPiece { motion: Motion::Quiet, begun: millis(200), ..piece };
        for (at, until, per_s) in [(200, millis(225), 0.0), (225, NEVER, 1.0 / CORRELATION_B_S)] {
            let own = means.returning(&quiet, millis(at), tuning.wandering(&quiet, millis(at), false));
            let found = (own.walk.until, own.mean_rad_s, own.per_s, own.walk.intensity_rad2_s3);
            assert_eq!(found, (until, 0.0, per_s, tuning.sliding_rad2_s3), "{at}");
        }
    }
}
