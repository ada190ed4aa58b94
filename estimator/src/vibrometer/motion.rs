//! What moves the rotor, from the drive and the vibrometer; and the filter's clock.
//!
//! | drive | vibrometer | motion |
//! |---|---|---|
//! | B | any | `Impacted(B)` |
//! | C, within 25 ms of mode B | any | `Impacted(B)` |
//! | C, later | any | `Impacted(C)` |
//! | off | quiet | `Quiet` |
//! | off, for the motor's settling time | any | `Quiet` |
//! | off, shorter | not quiet, or silent | `Impacted` by the mode driven last; B before the first drive |
//!
//! A motor of known design lies quiet a known time after its drive is off ([`crate::settling`]); a vibrometer can only
//! shorten that time. Before the first drive it runs from the first call of [`MotionWatch::drive`]. Quiet is no rest: a
//! rotor may slide, or turn without friction. Rest is concluded from the frames ([`crate::camera::rest_test`]). At
//! rest, bias and noise of the vibrometer are learnt ([`crate::vibrometer::calibration`]).
//!
//! # Which samples are used
//!
//! A vibrometer that has lost its light, or whose range is exceeded, may deliver zeros or repeat one value without a
//! flag. Two equal neighbours of noise of 0.2 mm/s are one in 10^5 in `f32`, and an exact zero is rarer still. So
//! neither is used: a sample lost by chance costs nothing, and a dead vibrometer counts as silent. Where the
//! vibrometer's steps are wider than a tenth of its noise, equal neighbours are usual: there the driven rotor's samples
//! are dropped after a millisecond of equal ones, and those of a rotor without drive are used but do not show quiet.
//!
//! A sample from more than a millisecond after the clock has a wrong time and is not used. Neither is one no newer than
//! the last, unless [`MotionWatch::OLD_SAMPLES_MAX`] of those come in a row: then the last one's time was wrong, and
//! the watch starts again at the next sample.

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::measurement::{CLOCK_TOLERANCE_NANOS, LdvSample};
use crate::vibrometer::calibration::Calibration;
use crate::vibrometer::motion_history::{MotionHistory, Motions, NEVER};
use crate::vibrometer::rest::{RestDetector, RestTuning, quiet_m2_s2};

/// Time in which friction stops a quiet rotor, in ns: it slides by less than its rate times that, from 25 rad/s also
/// with half the nominal friction.
pub(crate) const STOPPING_NANOS: u64 = 25_000_000;

/// What moves the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Impacts act on the rotor, of teeth that move in this mode; or it is in flight after one.
    Impacted(DriveMode),
    /// The rotor lies on the teeth. It may still slide to a stop.
    Quiet,
}

impl Motion {
    /// What belongs to this motion: of impacts under mode B, under mode C, or of none.
    pub(crate) fn of<X>(self, b: X, c: X, quiet: X) -> X {
        match self {
            Self::Impacted(DriveMode::B) => b,
            Self::Impacted(DriveMode::C) => c,
            Self::Quiet => quiet,
        }
    }

    /// Of two motions the one that moves the rotor more.
    pub(crate) fn or_faster(self, other: Self) -> Self {
        match (self, other) {
            (Self::Quiet, motion) | (motion, Self::Quiet) => motion,
            (Self::Impacted(DriveMode::C), Self::Impacted(DriveMode::C)) => self,
            _ => Self::Impacted(DriveMode::B),
        }
    }
}

/// Finds the motion from the drive really applied and the vibrometer's samples, and keeps the clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionWatch<T> {
    tuning: RestTuning<T>,
    rest: RestDetector<T>,
    calibration: Calibration<T>,
    /// Equal samples in a row.
    equal_samples: u16,
    /// When the drive will have been off for the motor's settling time; never while it is on, and before the first call
    /// of [`Self::drive`].
    settled_at: Time,
    /// When the mode of the drive last changed; time zero before the first change.
    changed_at: Time,
    /// The motion until then.
    history: MotionHistory,
    /// Since when the frames show that the rotor rests; never while they do not.
    rested_since: Time,
    /// The drive that is really applied.
    pub(crate) applied: DriveCommand,
    impact_mode: DriveMode,
    /// Until when the motion counts as that of mode B under another drive.
    mode_b_until: Time,
    /// The latest time of a drive.
    drive_told_at: Time,
    /// The last value that arrived, used or not.
    last_value_m_s: f32,
    /// Samples in a row no newer than the last one used.
    old_samples: u8,
}

impl<T: Real> MotionWatch<T> {
    /// After so many samples in a row no newer than the last one used, the watch starts again: 1 ms at 200 kHz.
    /// A number, not a time: by samples of wrong times nothing can be timed.
    const OLD_SAMPLES_MAX: u8 = 200;

    /// How long the motion remains that of mode B when mode C follows, in ns: high flights and a rate ten times that of
    /// C decay in 20 to 30 ms.
    const MODE_B_NANOS: u64 = 25_000_000;

    /// A watch without measurements. Until the rotor is found quiet it may move as in mode B, the faster mode.
    pub(crate) fn new(tuning: &RestTuning<T>) -> Self {
        Self {
            tuning: *tuning,
            rest: RestDetector::new(tuning),
            calibration: Calibration::new(tuning.noise_m_s, tuning.gravity_m_s2),
            equal_samples: 0,
            settled_at: NEVER,
            changed_at: Time::ZERO,
            history: MotionHistory::none(),
            rested_since: NEVER,
            applied: DriveCommand::OFF,
            impact_mode: DriveMode::B,
            mode_b_until: Time::ZERO,
            drive_told_at: Time::ZERO,
            last_value_m_s: 0.0,
            old_samples: 0,
        }
    }

    /// The drive that is really applied from `at` on.
    pub(crate) fn drive(&mut self, at: Time, command: DriveCommand) {
        self.drive_told_at = self.drive_told_at.max(at);
        if self.applied.mode() != command.mode() {
            self.change_mode(at, command);
        }
        self.applied = command;
        if let Some(mode) = command.mode() {
            (self.impact_mode, self.settled_at) = (mode, NEVER);
        } else if self.settled_at == NEVER {
            let [of_b, of_c] = self.tuning.settling_nanos.map(|nanos| at.plus_nanos(nanos));
            // What mode B left goes on under mode C.
            self.settled_at =
                if self.impact_mode == DriveMode::C { of_c.max(of_b.min(self.mode_b_until)) } else { of_b };
        }
    }

    /// The drive changes its mode to that of `command` at `at`: keeps the motion until then.
    #[cold]
    fn change_mode(&mut self, at: Time, command: DriveCommand) {
        let (now, since) = self.motion_since(at);
        self.history.end(self.history.before, since);
        if now == Motion::Quiet && self.rested_since < at {
            self.history.end(now, self.rested_since);
            self.history.end_rest(at);
        } else {
            self.history.end(now, at);
        }
        self.rested_since = NEVER;
        // What mode B left goes on under mode C, and what a drive left goes on without it.
        let without_drive = command.mode().is_none();
        self.history.before = Motion::Impacted(if without_drive { self.impact_mode } else { DriveMode::B });
        self.changed_at = at;
        if self.applied.mode() == Some(DriveMode::B) {
            self.mode_b_until = at.plus_nanos(Self::MODE_B_NANOS);
        }
        self.calibration.interrupt();
        // The next frame that shows the end of the rest may come long after it.
        self.calibration.note_rest(false, at);
    }

    /// What has moved the rotor until `now`.
    pub(crate) fn motions(&self, now: Time) -> Motions<'_> {
        let (now, since) = self.motion_since(now);
        Motions { history: &self.history, now, since }
    }

    /// Whether the rotor rests at `now`, by the camera's frames up to that of `exposed_at`: then bias and noise of the
    /// vibrometer are learnt.
    pub(crate) fn note_rest(&mut self, resting: bool, exposed_at: Time, now: Time) {
        let resting = resting && self.applied.mode().is_none();
        self.rested_since = if resting { self.rested_since.min(exposed_at) } else { NEVER };
        self.calibration.note_rest(resting, now);
    }

    /// The sample without the bias that was learnt.
    pub(crate) fn corrected(&self, sample: &LdvSample) -> LdvSample {
        LdvSample { velocity_m_s: sample.velocity_m_s - self.calibration.bias_m_s.to_f32(), ..*sample }
    }

    /// Standard deviation of a sample in m/s, as described or as learnt.
    pub(crate) fn noise_m_s(&self) -> T {
        self.calibration.noise_m_s
    }

    /// The latest time of drive or vibrometer.
    pub(crate) fn clock(&self) -> Time {
        self.rest.newest.map_or(self.drive_told_at, |newest| newest.max(self.drive_told_at))
    }

    /// Takes in a sample; whether it was used.
    pub(crate) fn observe(&mut self, sample: &LdvSample) -> bool {
        let value = sample.velocity_m_s;
        let equal = value.to_bits() == self.last_value_m_s.to_bits() || value.to_bits() << 1 == 0;
        self.last_value_m_s = value;
        if !equal {
            self.equal_samples = 0;
        } else if self.lifeless() {
            return false;
        }
        if let Some(newest) = self.rest.newest {
            // The usual case: a little newer than the last sample, which the clock is not behind.
            let timely = sample.taken_at.nanos_soon_after(newest, CLOCK_TOLERANCE_NANOS).is_some();
            if !timely && self.mistimed(sample.taken_at, newest) {
                return false;
            }
        }
        self.old_samples = 0;
        if self.calibration.learns(sample.taken_at) {
            self.learn(value);
        } else if self.applied.mode().is_some() {
            self.calibration.run(T::from_f32(value), sample.taken_at);
        }
        let used = self.rest.take(&self.corrected(sample));
        if !used {
            self.calibration.interrupt();
        }
        used
    }

    /// Counts one more equal sample; returns whether the vibrometer counts as lifeless.
    #[cold]
    fn lifeless(&mut self) -> bool {
        self.equal_samples = self.equal_samples.saturating_add(1);
        let lifeless = self.repeats() && (self.tuning.equal_samples == 1 || self.applied.mode().is_some());
        if lifeless {
            self.calibration.interrupt();
        }
        lifeless
    }

    /// Learns bias and noise from a sample of a rotor at rest.
    #[inline(never)]
    fn learn(&mut self, velocity_m_s: f32) {
        let velocity_m_s = T::from_f32(velocity_m_s);
        // Written so that NaN is not learnt from.
        if velocity_m_s.abs() < T::one() && self.calibration.learn(velocity_m_s) {
            let noise_m_s = self.calibration.noise_m_s;
            self.rest.quiet_m2_s2 = quiet_m2_s2(noise_m_s * noise_m_s);
        }
    }

    /// Whether a sample that is no newer than the last one, or much newer, is to be dropped.
    #[cold]
    fn mistimed(&mut self, taken_at: Time, newest: Time) -> bool {
        if taken_at <= newest {
            self.old_samples += 1;
            if self.old_samples < Self::OLD_SAMPLES_MAX {
                return true;
            }
            self.rest.reset();
        }
        taken_at > self.drive_told_at.plus_nanos(CLOCK_TOLERANCE_NANOS.into()) && self.drive_told_at > newest
    }

    /// The motion at `now`: that of the drive, or still that of mode B soon after it; with the drive off what the
    /// vibrometer shows.
    pub(crate) fn motion(&self, now: Time) -> Motion {
        self.motion_since(now).0
    }

    /// Whether the drive has been off at `now` for the time in which a motor of this design settles.
    pub(crate) fn settled(&self, now: Time) -> bool {
        now >= self.settled_at
    }

    fn motion_since(&self, now: Time) -> (Motion, Time) {
        match self.applied.mode() {
            Some(DriveMode::C) if now >= self.mode_b_until => {
                (Motion::Impacted(DriveMode::C), self.changed_at.max(self.mode_b_until))
            }
            Some(_) => (Motion::Impacted(DriveMode::B), self.changed_at),
            None => match self.quiet_since(now) {
                NEVER => (Motion::Impacted(self.impact_mode), self.changed_at),
                // A rotor that nothing has driven yet was quiet before it was found so.
                _ if self.changed_at == Time::ZERO => (Motion::Quiet, Time::ZERO),
                since => (Motion::Quiet, self.changed_at.max(since)),
            },
        }
    }

    /// Since when a rotor that is not driven lies quiet, by the vibrometer or by its design. There is one copy of it:
    /// its callers would take half a kilobyte of the smallest board's flash.
    #[inline(never)]
    fn quiet_since(&self, now: Time) -> Time {
        let settled = if self.settled(now) { self.settled_at } else { NEVER };
        self.rest.quiet_since(now).filter(|_| !self.repeats()).map_or(settled, |shown| shown.min(settled))
    }

    /// Whether the vibrometer shows a motion at `now`.
    pub(crate) fn disputes_quiet(&self, now: Time) -> bool {
        self.tuning.fitted && !self.rest.silent(now) && self.rest.shows_flight() && !self.repeats()
    }

    /// Whether the vibrometer repeats one value for so long that it shows nothing.
    fn repeats(&self) -> bool {
        self.equal_samples >= self.tuning.equal_samples
    }

    /// Whether the vibrometer has been silent for a millisecond before `now`; never, where there is none.
    pub(crate) fn silent(&self, now: Time) -> bool {
        self.tuning.fitted && self.rest.silent(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// C after B counts as B for 25 ms, C after rest does not; B counts as B from its first instant.
    #[test]
    fn exact_what_mode_b_left_goes_on_under_c() {
        let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        watch.drive(Time::ZERO, c);
        assert_eq!(watch.motion(Time::from_micros(1)), Motion::Impacted(DriveMode::C));
        watch.drive(Time::from_micros(1000), b);
        assert_eq!(watch.motion(Time::from_micros(1000)), Motion::Impacted(DriveMode::B));
        // Called at every tick or only at changes: the same.
        watch.drive(Time::from_micros(3000), b);
        watch.drive(Time::from_micros(5000), c);
        watch.drive(Time::from_micros(5010), c);
        for (micros, expected) in [(5000, DriveMode::B), (29_999, DriveMode::B), (30_000, DriveMode::C)] {
            assert_eq!(watch.motion(Time::from_micros(micros)), Motion::Impacted(expected), "{micros}");
        }
    }

    /// The frames show a rest from 40 ms on, and the drive begins at 100 ms: the rotor rested until then, and the
    /// samples since are none of a rotor at rest, although no frame has shown the end of it.
    #[test]
    fn exact_a_drive_ends_a_rest_at_once() {
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        watch.drive(Time::ZERO, DriveCommand::OFF);
        let (shown, driven) = (Time::from_micros(60_000), Time::from_micros(100_000));
        for (exposed_us, resting) in [(20_000, false), (40_000, true), (50_000, true)] {
            watch.note_rest(resting, Time::from_micros(exposed_us), shown);
        }
        let learns = |watch: &MotionWatch<f32>, micros| watch.calibration.learns(Time::from_micros(micros));
        assert!(!learns(&watch, 79_999) && learns(&watch, 80_000));
        watch.drive(driven, DriveCommand::full(DriveMode::B));
        assert!(!learns(&watch, 100_001));
        let motions = watch.motions(Time::from_micros(110_000));
        let rested = [39_999, 40_000, 99_999, 100_000].map(|us| motions.piece(Time::from_micros(us)).rested);
        assert_eq!(rested, [false, true, true, false]);
    }

    /// Long after the drive a rotor of this design lies quiet. One that still flies, at 24 mm/s, disputes that;
    /// noise, a silent vibrometer and one that repeats a value do not.
    #[test]
    fn exact_a_flight_after_the_settling_time_is_disputed() {
        let disputed = |velocity_m_s: fn(u64) -> f32, until_us: u64| {
            let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
            watch.drive(Time::ZERO, DriveCommand::full(DriveMode::C));
            watch.drive(Time::from_micros(1000), DriveCommand::OFF);
            for micros in (1005..until_us).step_by(5) {
                watch.drive(Time::from_micros(micros), DriveCommand::OFF);
                let (taken_at, n) = (Time::from_micros(micros), micros / 5);
                watch.observe(&LdvSample { taken_at, velocity_m_s: velocity_m_s(n) });
            }
            let now = Time::from_micros(200_000);
            watch.drive(now, DriveCommand::OFF);
            assert_eq!(watch.motion(now), Motion::Quiet);
            watch.disputes_quiet(now)
        };
        let noise = |n: u64| if n.is_multiple_of(2) { 2e-4 } else { -2e-4 } + 1e-7 * (n % 100) as f32;
        assert!(disputed(|n| 0.024 - 1e-6 * (n % 1000) as f32, 200_000));
        assert!(!disputed(noise, 200_000));
        assert!(!disputed(|n| 0.024 - 1e-6 * (n % 1000) as f32, 100_000), "silent");
        assert!(!disputed(|_| 0.024, 200_000), "repeats");
    }

    /// A sample of no newer time than the last one is dropped.
    #[test]
    fn law_old_samples_change_nothing() {
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        let mut used = |micros, velocity_m_s| {
            watch.observe(&LdvSample { taken_at: Time::from_micros(micros), velocity_m_s })
        };
        assert!(used(50, 1e-4));
        assert!(!used(50, 0.5), "a duplicate");
        assert!(!used(45, 0.4), "out of order");
        assert!(used(55, 2e-4));
        assert_eq!(watch.clock(), Time::from_micros(55));
    }

    /// Old samples between good ones do not set the clock back, however many come: only 200 in a row do.
    #[test]
    fn exact_the_clock_goes_back_by_two_hundred_old_samples_in_a_row() {
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        let mut used = |micros: u64, n: u64| {
            let velocity_m_s = 1e-4 + 1e-7 * n as f32;
            watch.observe(&LdvSample { taken_at: Time::from_micros(micros), velocity_m_s })
        };
        for n in 1..=300 {
            assert!(used(10_000 + 5 * n, 2 * n) && !used(9_000, 2 * n + 1), "{n}");
        }
        // The last of those was the first of a row.
        let back = (2..=400).find(|&n| used(9_000, 1000 + n));
        assert_eq!(back, Some(200));
    }

    /// The drive goes off 1 ms after C has followed B: what B left rings on until 25 ms after that change, longer than
    /// what C leaves. Long after B it is mode C's 21 ms alone.
    #[test]
    fn exact_what_mode_b_left_settles_too() {
        for (off_us, quiet_us) in [(1000, 25_000), (100_000, 100_000 + 21_343)] {
            let mut watch = MotionWatch::<f64>::new(&RestTuning::default());
            let [_, of_c_nanos] = watch.tuning.settling_nanos;
            assert_eq!(of_c_nanos / 1_000_000, 21);
            let begin_us = 1_000_000;
            watch.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
            watch.drive(Time::from_micros(begin_us), DriveCommand::full(DriveMode::C));
            watch.drive(Time::from_micros(begin_us + off_us), DriveCommand::OFF);
            let at = |micros: u64| watch.motion(Time::from_micros(begin_us + micros));
            let margin_us = 500;
            assert!(at(quiet_us - margin_us) != Motion::Quiet, "{off_us}");
            assert_eq!(at(quiet_us + margin_us), Motion::Quiet, "{off_us}");
        }
    }
}
