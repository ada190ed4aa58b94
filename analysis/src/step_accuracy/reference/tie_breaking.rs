//! Ties within rounding: events that follow each other without an advance in time.
//!
//! A normal force and a slip, or a gap and its derivatives, may be zero at the same instant to within rounding: at
//! rest, without gravity, or at the limit of sticking. Then no order of the events is the right one, and each decision
//! reverses the one before. After a few such events, events are ignored for a millionth of a step (2e-11 s), and the
//! motion continues as decided last. This breaks the tie: an acceleration that is wrong by its rounding of 1e-9 m/s^2
//! for that time leaves an error of 1e-20 m/s. If the tie remains, the time is doubled. At a hundredth of a step the
//! integration stops with an error.

use simulation::runs::RunError;

/// Largest part of a step that is no advance: 2e-18 s, below any flight of chattering.
const NO_ADVANCE: f64 = 1e-13;
/// Number of events without an advance in time after which events are ignored.
const AT_ONCE_MAX: u32 = 10;
/// First part of a step over which events are ignored.
const FIRST_PART: f64 = 1e-6;
/// Part of a step at which the integration stops with an error.
const LAST_PART: f64 = 1e-2;

/// Counts the events without an advance in time.
#[derive(Clone, Copy, Debug)]
pub struct TieBreaker {
    at_once: u32,
    part: f64,
}

impl Default for TieBreaker {
    fn default() -> Self {
        Self { at_once: 0, part: FIRST_PART }
    }
}

impl TieBreaker {
    /// Part of the next step over which events are ignored; `None` while they are not.
    pub fn ignored_part(&self) -> Option<f64> {
        (self.at_once > AT_ONCE_MAX).then_some(self.part)
    }

    /// Records an advance by `part` of a step.
    ///
    /// # Errors
    /// When events still follow each other after they were ignored.
    pub fn record_advance(&mut self, part: f64) -> Result<(), RunError> {
        if self.ignored_part().is_some() {
            self.at_once = 0;
            self.part *= 2.0;
            if self.part > LAST_PART {
                return Err(RunError::Stalled);
            }
        } else if part > NO_ADVANCE {
            self.at_once = 0;
            if part > self.part {
                self.part = FIRST_PART;
            }
        } else {
            self.at_once += 1;
        }
        Ok(())
    }
}
