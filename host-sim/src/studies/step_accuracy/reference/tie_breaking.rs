//! Ties within rounding: events that follow each other without an advance in time.
//!
//! A normal force and a slip, or a gap and its derivatives, may be zero at the same instant to within rounding - at rest,
//! without gravity, at
//! the very edge of slipping - and then no order of events is the right one: one decision recalls the next. After a few such
//! events the motion goes on as it was last decided for a millionth of a step (2e-11 s), events ignored, which breaks the
//! tie: an
//! acceleration wrong by its rounding of 1e-9 m/s^2 for that time leaves an error of 1e-20 m/s. If that does not help the
//! time is doubled, and at
//! a hundredth of a step the integration gives up.

/// The integration stands still: events follow each other without an advance in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the reference integrator stands still: events without end at one instant")]
pub struct Stalled;

/// Part of a step that is no advance: 2e-18 s, below any flight that chattering comes to.
const NO_ADVANCE: f64 = 1e-13;
/// Events without an advance in time before the motion goes on regardless.
const AT_ONCE_MAX: u32 = 10;
/// First part of a step over which events are ignored.
const FIRST_PART: f64 = 1e-6;
/// Part of a step that means giving up.
const LAST_PART: f64 = 1e-2;

/// Counts the events that come without an advance in time.
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
    /// Part of the next step over which events are to be ignored, if it has come to that.
    pub fn ignored_part(&self) -> Option<f64> {
        (self.at_once > AT_ONCE_MAX).then_some(self.part)
    }

    /// Takes note of an advance by `part` of a step.
    ///
    /// # Errors
    /// When ignoring events has not helped.
    pub fn record_advance(&mut self, part: f64) -> Result<(), Stalled> {
        if self.ignored_part().is_some() {
            self.at_once = 0;
            self.part *= 2.0;
            if self.part > LAST_PART {
                return Err(Stalled);
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
