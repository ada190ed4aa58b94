//! A schedule of drives: what the coil is given, one part after the other.
//!
//! ```text
//! schedule = part {"," part}                                   b:1 for 0.5, off for 0.3, c:0.5@7440..7480 for 2
//! part     = drive "for" seconds [times]
//! drive    = "off" | mode ":" amplitude ["@" frequency]
//! mode     = "b" | "c"
//! frequency = hertz | hertz ".." hertz                         without it that of the design
//! times    = "x" count                                         of a part alone, or of parts in brackets
//! part     = "(" schedule ")" times                            (b:1 for 0.1, off for 0.05) x4
//! ```
//!
//! A frequency from one value to another is swept evenly in time.

mod parse;

use std::fmt;

use motor_model::DriveMode;

pub use parse::ScheduleError;

use crate::math::plain_number::plain;

/// Most parts of a schedule, those that are repeated counted each time.
pub const PARTS_MAX: usize = 10_000;
/// Longest part, and longest schedule, in s.
pub const DURATION_MAX_S: f64 = 1000.0;
/// Shortest part in s: a period of the loop.
pub const DURATION_MIN_S: f64 = 1e-5;

/// A schedule: at least one part.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    parts: Vec<SchedulePart>,
}

/// A part of a schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchedulePart {
    /// What the coil is given; `None` for nothing.
    pub drive: Option<ScheduledDrive>,
    /// How long.
    pub duration_s: f64,
}

/// A drive of a schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledDrive {
    /// The mode.
    pub mode: DriveMode,
    /// Amplitude, 0 to 1.
    pub amplitude: f64,
    /// Frequency at the beginning and at the end of the part; `None` for that of the design.
    pub frequency_hz: Option<[f64; 2]>,
}

impl Schedule {
    /// Its parts, in order, those that are repeated as often as they are.
    pub fn parts(&self) -> &[SchedulePart] {
        &self.parts
    }

    /// Length of all parts together.
    pub fn duration_s(&self) -> f64 {
        self.parts.iter().map(|part| part.duration_s).sum()
    }
}

impl fmt::Display for ScheduledDrive {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mode = if self.mode == DriveMode::B { "b" } else { "c" };
        write!(f, "{mode}:{}", plain(self.amplitude))?;
        match self.frequency_hz {
            None => Ok(()),
            Some([from, until]) if from.to_bits() == until.to_bits() => write!(f, "@{}", plain(from)),
            Some([from, until]) => write!(f, "@{}..{}", plain(from), plain(until)),
        }
    }
}

impl fmt::Display for SchedulePart {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.drive {
            Some(drive) => write!(f, "{drive} for {}", plain(self.duration_s)),
            None => write!(f, "off for {}", plain(self.duration_s)),
        }
    }
}

/// The schedule as text, equal parts in a row as one; the text gives the schedule again.
impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (number, same) in self.parts.chunk_by(|part, next| part == next).enumerate() {
            let Some(part) = same.first() else { continue };
            let comma = if number == 0 { "" } else { ", " };
            write!(f, "{comma}{part}")?;
            if same.len() > 1 {
                write!(f, " x{}", same.len())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
