//! Faults: what goes wrong with instruments, drive and motor, from when, and until when.
//!
//! A scene sets faults by words (`faults = ["camera:lost@1.0..2.0"]`, `--fault drive:weak:0.7@0.05..`), as many as it
//! likes, or one of each kind by keys (`camera.fault`, `fault.drive_gain`). Both give the same [`Fault`].
//!
//! ```text
//! word = thing ":" what [":" value] ["@" time]            camera:offset:10@0.5..1
//! time = from | from ".." | ".." until | from ".." until  in s; without a time the whole run
//! ```

mod by_keys;
mod parse;
mod words;

use std::fmt;

use motor_model::{DriveMode, Time};

pub use parse::FaultWordError;
pub use words::{FaultValue, FaultWord, WORDS};

/// The key of the faults that are set by words.
pub(super) const KEY: &str = "faults";

/// A fault of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// When it begins.
    pub from: Time,
    /// When it has ended; [`Fault::NEVER`] if it stays.
    pub until: Time,
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// With the camera.
    Camera(CameraFault),
    /// With a mark that the camera tracks, by its number from 1.
    Mark(u8, MarkFault),
    /// With the vibrometer.
    Vibrometer(VibrometerFault),
    /// With the amplifier or its wires.
    Drive(DriveFault),
    /// The resonances of modes B and C drift to this change in percent, reached when the fault ends.
    Drift(f64),
    /// The rotor is jolted: change of its rate in rad/s, when the fault begins.
    Jolt(f64),
    /// The rotor sticks: it does not turn, whatever turns it.
    Stuck,
    /// The hub of a rotor that shifts on its pin rubs with this coefficient of friction.
    Rub(f64),
}

/// What a faulty camera shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraFault {
    /// No frames.
    Lost,
    /// The last picture before the fault.
    Stuck,
    /// Tracking finds nothing: angle zero.
    Zeros,
    /// Tracking follows another feature, this many degrees away.
    Offset(f64),
    /// Each frame is lost with this probability.
    Intermittent(f64),
    /// Each frame is an outlier, as large as `camera.outlier_m` says, with this probability.
    Outliers(f64),
    /// Frames arrive this much later, in s.
    Delayed(f64),
}

/// What is wrong with a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MarkFault {
    /// It is not found.
    Lost,
    /// Tracking stays where it was in the picture before the fault.
    Stuck,
    /// Tracking follows something on the rotor that is this much further round, in m, clockwise positive.
    False(f64),
    /// The mark and its next one counter-clockwise are taken for each other.
    Exchanged,
}

/// What a faulty vibrometer delivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VibrometerFault {
    /// No samples.
    Lost,
    /// The last value before the fault.
    Stuck,
    /// Zeros.
    Zeros,
    /// The velocity's negative.
    Inverted,
    /// No numbers.
    NotANumber,
    /// Each sample is lost with this probability.
    Intermittent(f64),
    /// Each sample is an outlier, as large as `ldv.outlier_m_s` says, with this probability.
    Outliers(f64),
    /// This much more, in m/s.
    Offset(f64),
}

/// What is wrong with the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveFault {
    /// Amplitude that reaches the coil, per amplitude that the amplifier reports.
    Weak(f64),
    /// Nothing reaches the coil, of one mode or of both.
    Dead(Option<DriveMode>),
    /// The coil is driven in the other mode than the amplifier reports.
    Swapped,
}

impl Fault {
    /// The end of a fault that stays.
    pub const NEVER: Time = Time::from_nanos(u64::MAX);

    /// Whether `now` is within the fault; its end is not.
    #[must_use]
    pub fn covers(&self, now: Time) -> bool {
        self.from <= now && now < self.until
    }
}

/// A time in s, with as many digits as it needs.
fn seconds(time: Time) -> String {
    let nanos = time.nanos_since(Time::ZERO);
    let (whole, part) = (nanos / 1_000_000_000, nanos % 1_000_000_000);
    let text = format!("{whole}.{part:09}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The fault as its word; the word gives the fault again.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (thing, what, value) = words::spelled(self.kind);
        write!(f, "{thing}:{what}")?;
        if let Some(value) = value {
            write!(f, ":{value}")?;
        }
        let is_instant = matches!(self.kind, FaultKind::Jolt(_));
        match (self.from, self.until) {
            (Time::ZERO, Self::NEVER) => Ok(()),
            (from, _) if is_instant => write!(f, "@{}", seconds(from)),
            (from, Self::NEVER) => write!(f, "@{}..", seconds(from)),
            (from, until) => write!(f, "@{}..{}", seconds(from), seconds(until)),
        }
    }
}

#[cfg(test)]
mod tests;
