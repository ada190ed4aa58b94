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
//! A drive may begin and end, and change its amplitude, many times between two frames. From the frame to the last
//! change n is the mean over the time, with 0 while the drive is off; from then on it is that of the present drive.
//!
//! The noise is that of full drive times `p = n(a) / n(1)`, in mode C its root, and at least 0.02. At amplitudes of
//! 0.3, 0.5 and 0.7 of mode B the angle of a drawn motor wanders by 0.02, 0.14 and 0.56 of what it does at full drive,
//! that of one that tilts by up to 0.05, 0.8 and 1; p is 0.07, 0.33 and 0.6.
//!
//! After the drive m is zero. The rotor bounces on for some time; then it is quiet, and the rate wanders for 25 ms
//! while it may slide. For 50 ms after another change of the mode, or of on and off, friction brings the rate to the
//! new mean, which takes as long in both modes: with T of mode B, and five times the noise of the larger of both
//! drives. Frames teach once that is over: an innovation on the way tells of the way, and learnt as a mean it takes the
//! rotor for one that turns the other way.

use motor_model::{DriveCommand, DriveMode, Real, Time, math};

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
const TRANSITION_S: f32 = 0.05;

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

/// Part of the process noise that is left of a drive that does not turn the rotor.
const LEAST_NOISE: f32 = 0.02;

/// The mean rates, and whether the drive has been on in one mode since the last frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanRates<T> {
    /// Factors of the nominal rates in modes B and C.
    factors: [T; 2],
    /// The newest command, and when it began.
    command: DriveCommand,
    changed_at: Time,
    /// The mode of the newest drive, and its part `n(a) / n(1)`: 0 while the drive is off.
    mode: DriveMode,
    part: f32,
    /// Mean parts of modes B and C between the newest frame, or the change to that mode, and the last change.
    means: [f32; 2],
    /// Begin of the mean of the newest mode.
    mean_from: Time,
    /// The last two times at which the drive was switched on or off, or to the other mode.
    switched_at: Time,
    switched_before: Time,
    /// Part of the rate at full drive that the rotor had at most when that drive began.
    left_part: f32,
    /// The mode in force since the frame exposed at the time beside it.
    driven: Option<(DriveMode, Time)>,
}

/// That of `mode`, of a pair of modes B and C.
fn of<V: Copy>([b, c]: [V; 2], mode: DriveMode) -> V {
    if mode == DriveMode::C { c } else { b }
}

/// Its place.
fn place<V>([b, c]: &mut [V; 2], mode: DriveMode) -> &mut V {
    if mode == DriveMode::C { c } else { b }
}

/// The part `n(a) / n(1)` of the nominal rate at full drive that `mode` has at `amplitude`.
fn part_of(mode: DriveMode, amplitude: f32) -> f32 {
    let least = of(LEAST_AMPLITUDE, mode);
    let above = larger((amplitude - least) / (1.0 - least), 0.0);
    if mode == DriveMode::C { above * above } else { above }
}

/// Process noise of a drive of `mode` with this part, per that of full drive.
fn noise_of(mode: DriveMode, part: f32) -> f32 {
    larger(if mode == DriveMode::C { math::sqrt_f32(part) } else { part }, LEAST_NOISE)
}

/// The larger of two numbers. For `f32::max` the microcontroller calls a function.
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl<T: Real> MeanRates<T> {
    pub(super) fn new() -> Self {
        Self {
            factors: [T::one(); 2],
            command: DriveCommand::full(DriveMode::B),
            changed_at: Time::ZERO,
            mode: DriveMode::B,
            part: 1.0,
            means: [1.0; 2],
            mean_from: Time::ZERO,
            switched_at: Time::ZERO,
            switched_before: Time::ZERO,
            left_part: 0.0,
            driven: None,
        }
    }

    /// Mean rate of the drive of `mode` that has `part` of the rate at full drive, in rad/s.
    pub(super) fn rad_s(&self, mode: DriveMode, part: f32) -> T {
        of(self.factors, mode) * T::from_f64(of(NOMINAL_RAD_S, mode)) * T::from_f32(part)
    }

    /// How the rate returns right after `at` in `piece`, as far as the camera alone shows. `walk` is that piece of its
    /// random walk.
    #[cold]
    pub(super) fn returning(&self, piece: &MotionPiece, at: Time, mut walk: Wandering<T>) -> ReturnToMean<T> {
        let Motion::Impacted(mode) = piece.motion else { return Self::quiet(piece, at, walk) };
        let mean = of(self.means, mode);
        let is_newest = mode == self.mode;
        let (part, end, switched_at) = if !is_newest {
            (mean, NEVER, Time::ZERO)
        } else if at >= self.changed_at {
            (self.part, NEVER, self.switched_at)
        } else if self.changed_at > self.switched_at {
            (mean, self.changed_at, self.switched_at)
        } else {
            (mean, self.changed_at, self.switched_before)
        };
        walk.until = piece.until.min(end);
        let settled_at = switched_at.max(piece.begun).plus_nanos(TRANSITION_NANOS);
        let is_on_its_way = at < settled_at;
        // A rotor that the drive has left goes on as it was driven.
        let is_left = is_newest && (is_on_its_way || part <= 0.0) && self.left_part > part;
        walk.intensity_rad2_s3 *= T::from_f32(noise_of(mode, if is_left { self.left_part } else { part }));
        let of_b = (T::from_f64(1.0 / CORRELATION_B_S), THIRD_B_NANOS);
        let of_c = (T::from_f64(1.0 / CORRELATION_C_S), THIRD_C_NANOS);
        let (per_s, third_nanos) = if is_on_its_way {
            // The mean of the mode before, of the next one, or between them: not known to some ten rad/s.
            walk.intensity_rad2_s3 *= T::from_f64(TRANSITION);
            walk.until = walk.until.min(settled_at);
            of_b
        } else {
            piece.motion.of(of_b, of_c, of_b)
        };
        ReturnToMean { walk, mean_rad_s: self.rad_s(mode, part), per_s, third_nanos }
    }

    /// A quiet rotor wanders while it may slide, and then returns to rest.
    fn quiet(piece: &MotionPiece, at: Time, walk: Wandering<T>) -> ReturnToMean<T> {
        let stopped_at = piece.begun.plus_nanos(STOPPING_NANOS);
        let (until, per_s, third_nanos) = if at < stopped_at {
            (piece.until.min(stopped_at), T::zero(), STOPPING_NANOS)
        } else {
            (piece.until, T::from_f64(1.0 / CORRELATION_B_S), THIRD_B_NANOS)
        };
        ReturnToMean { walk: Wandering { until, ..walk }, mean_rad_s: T::zero(), per_s, third_nanos }
    }

    /// The drive is `command` from `at` on.
    #[inline(never)]
    pub(super) fn note_drive(&mut self, at: Time, command: DriveCommand) {
        if command == self.command {
            return;
        }
        let (was_on, is_on) = (self.command.mode().is_some(), command.mode().is_some());
        let mode = command.mode().unwrap_or(self.mode);
        let part = if is_on { part_of(mode, command.amplitude()) } else { 0.0 };
        let mean = self.mean_until(at);
        *place(&mut self.means, self.mode) = mean;
        if was_on != is_on || mode != self.mode {
            let gone_s: f32 = at.seconds_since(self.switched_at);
            let still_left = self.left_part * (1.0 - gone_s / TRANSITION_S);
            self.left_part = larger(larger(mean, self.part), still_left);
            (self.switched_before, self.switched_at) = (self.switched_at, at);
        }
        if mode != self.mode {
            *place(&mut self.means, mode) = part;
            self.mean_from = at;
        }
        (self.mode, self.part, self.command, self.changed_at) = (mode, part, command, at);
        self.driven = self.driven.filter(|(driven, _)| command.mode() == Some(*driven));
    }

    /// Mean part of the newest mode until `at`, from the newest frame or the change to the mode on.
    fn mean_until(&self, at: Time) -> f32 {
        let mean = of(self.means, self.mode);
        let (newest_s, all_s): (f32, f32) =
            (at.seconds_since(self.changed_at), at.seconds_since(self.mean_from));
        if newest_s < all_s { mean + (self.part - mean) * (newest_s / all_s) } else { self.part }
    }

    /// Learns from a frame, while `mode` is driven, under a motion that has begun at `begun`.
    pub(super) fn note_frame(&mut self, frame: &Innovation<T>, mode: Option<DriveMode>, begun: Time) {
        let driven = mode.filter(|_| frame.verdict != Verdict::Restarted).map(|mode| (mode, frame.taken_at));
        let since = core::mem::replace(&mut self.driven, driven);
        if let (Some((driven, from)), Verdict::Used) = (since, frame.verdict)
            && from >= begun.max(self.switched_at).plus_nanos(TRANSITION_NANOS)
        {
            self.learn(frame, driven, from);
        }
        self.begin_mean(frame.taken_at);
    }

    /// Learns the factor of the mode `driven` from the frame after that exposed at `from`.
    fn learn(&mut self, frame: &Innovation<T>, driven: DriveMode, from: Time) {
        let seconds: T = frame.taken_at.seconds_since(from);
        let part = T::from_f32(self.mean_until(frame.taken_at));
        let nominal = T::from_f64(of(NOMINAL_RAD_S, driven)) * part;
        let factor = place(&mut self.factors, driven);
        let telling_rad2_s2 = nominal * nominal + T::from_f64(TELLING_RAD_S * TELLING_RAD_S);
        let learnt =
            *factor + T::from_f64(WEIGHT) * nominal * frame.innovation_rad / (seconds * telling_rad2_s2);
        // Written so that NaN is not learnt, nor what no time has shown.
        if learnt.abs() < T::from_f64(MOST) && seconds > T::zero() {
            *factor = learnt;
        }
    }

    /// The mean of the drive begins at a frame exposed at `at`. Where the drive has changed since, the mean until then
    /// stands for the time in between.
    fn begin_mean(&mut self, at: Time) {
        if at < self.mean_from {
            return;
        }
        self.mean_from = at;
        if self.changed_at <= at {
            *place(&mut self.means, self.mode) = self.part;
        }
    }
}

#[cfg(test)]
mod tests;
