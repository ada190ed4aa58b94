//! What is known of the rotor's motion beside the camera: the drive, and what the vibrometer hears.
//!
//! # Which samples are heard
//!
//! A vibrometer that has lost its light, or whose range is exceeded, may say nothing of it and deliver zeros or the same value again and again. Noise of 0.2 mm/s makes two
//! equal neighbours in `f32` one in 10^5, and an exact zero rarer still, so neither is heard: a lost sample costs nothing, a dead vibrometer is silent.
//! A sample from more than a millisecond after the clock bears a wrong time and is not heard. Neither is one no newer than the last - unless
//! [`MotionWatch::OLD_SAMPLES_MAX`] of those come in a row: then it was the last that was wrong, and the vibrometer is heard anew.

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::measurement::{CLOCK_TOLERANCE_NANOS, LdvSample};
use crate::vibrometer::rest::{RestDetector, RestTuning};

/// What moves the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Struck by teeth in this mode, or in flight after it.
    Impacted(DriveMode),
    /// Lying on the teeth, perhaps still sliding to a stop.
    Quiet,
}

/// Tells the motion from the drive really applied and the vibrometer's samples, and keeps the clock.
#[derive(Clone, Copy, Debug)]
pub struct MotionWatch<T> {
    rest: RestDetector<T>,
    applied: DriveCommand,
    impact_mode: DriveMode,
    /// Until when the motion that mode B left goes on under another drive.
    mode_b_until: Time,
    /// The latest time that the drive has told.
    drive_told_at: Time,
    /// The last value that came, heard or not.
    last_value_m_s: f32,
    /// Samples in a row no newer than that.
    old_samples: u8,
}

impl<T: Real> MotionWatch<T> {
    /// After so many samples in a row that are no newer than the last one heard the vibrometer is heard anew: 1 ms at 200 kHz.
    pub const OLD_SAMPLES_MAX: u8 = 200;

    /// How long the rotor's motion remains that of mode B when C follows it, in ns: high flights and a rate ten times that of C die out in 20 to 30 ms.
    const MODE_B_NANOS: u64 = 25_000_000;

    /// A watch that has seen nothing: until the rotor is seen to be quiet it may be moving in the wilder mode, B.
    pub fn new(tuning: &RestTuning<T>) -> Self {
        Self {
            rest: RestDetector::new(tuning),
            applied: DriveCommand::OFF,
            impact_mode: DriveMode::B,
            mode_b_until: Time::ZERO,
            drive_told_at: Time::ZERO,
            last_value_m_s: 0.0,
            old_samples: 0,
        }
    }

    /// The drive that is really applied from `at` on.
    #[inline]
    pub fn drive(&mut self, at: Time, command: DriveCommand) {
        self.drive_told_at = self.drive_told_at.max(at);
        if self.applied.mode() == Some(DriveMode::B) {
            self.mode_b_until = at.plus_nanos(Self::MODE_B_NANOS);
        }
        self.applied = command;
        self.impact_mode = command.mode().unwrap_or(self.impact_mode);
    }

    /// The latest time that drive or vibrometer have told.
    #[inline]
    pub fn clock(&self) -> Time {
        self.rest.newest().map_or(self.drive_told_at, |newest| newest.max(self.drive_told_at))
    }

    /// Takes a sample in; whether it was heard.
    #[inline]
    pub fn observe(&mut self, sample: &LdvSample) -> bool {
        let value = sample.velocity_m_s;
        let lifeless = value.to_bits() == self.last_value_m_s.to_bits() || value.to_bits() << 1 == 0;
        self.last_value_m_s = value;
        if lifeless {
            return false;
        }
        if let Some(newest) = self.rest.newest() {
            // As a rule it is a little newer than the last, which the clock is not behind.
            let timely = sample.taken_at.nanos_soon_after(newest, CLOCK_TOLERANCE_NANOS).is_some();
            if !timely && self.mistimed(sample.taken_at, newest) {
                return false;
            }
        }
        self.old_samples = 0;
        self.rest.take(sample)
    }

    /// Whether a sample that is no newer than the last one, or much newer, is not to be heard.
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

    /// The motion at `now`: that of the drive that is on, or still that of mode B soon after it; without a drive what the vibrometer hears.
    #[inline]
    pub fn motion(&self, now: Time) -> Motion {
        match self.applied.mode() {
            Some(DriveMode::C) if now < self.mode_b_until => Motion::Impacted(DriveMode::B),
            Some(mode) => Motion::Impacted(mode),
            None if self.rest.quiet_since(now).is_some() => Motion::Quiet,
            None => Motion::Impacted(self.impact_mode),
        }
    }

    /// Whether the vibrometer has been silent for a millisecond before `now`.
    #[inline]
    pub fn silent(&self, now: Time) -> bool {
        self.rest.silent(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// C after B is as wild as B for 25 ms, C after rest is not; B is B from its first instant.
    #[test]
    fn exact_what_mode_b_left_goes_on_under_c() {
        let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        watch.drive(Time::ZERO, c);
        assert_eq!(watch.motion(Time::from_micros(1)), Motion::Impacted(DriveMode::C));
        watch.drive(Time::from_micros(1000), b);
        assert_eq!(watch.motion(Time::from_micros(1000)), Motion::Impacted(DriveMode::B));
        // Told at every tick or only of changes: the same.
        watch.drive(Time::from_micros(3000), b);
        watch.drive(Time::from_micros(5000), c);
        watch.drive(Time::from_micros(5010), c);
        for (micros, expected) in [(5000, DriveMode::B), (29_999, DriveMode::B), (30_000, DriveMode::C)] {
            assert_eq!(watch.motion(Time::from_micros(micros)), Motion::Impacted(expected), "{micros}");
        }
    }
}
