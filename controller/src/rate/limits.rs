//! What ends the holding of a rate: a rotor that does not turn or turns back, the end of the travel, too long a drive,
//! no estimate for too long.
//!
//! [`crate::progress_window`] tells from the turn of a window whether the rotor follows: it turns significantly, and by
//! at least [`FOLLOWS_PART`] of the rate asked for. The window's clock is the time for which the rotor was driven that
//! way: pulses with rests between them and an estimate that is lost now and then make it longer. Two windows in a row
//! without such a turn, or with one the wrong way, end the hold; a rotor that sticks for less than a window is driven
//! on. A turn the wrong way ends its window after a degree, until the rotor has turned the right way: one that tilts
//! turns back for some degrees now and then, and its windows are whole.
//!
//! The travel ends where the rotor would come to rest, were the drive cut now: `angle + rate * coast time` of the map.

use estimator::Estimate;
use motor_model::{DriveMode, Time};

use crate::positioning::PositioningTuning;
use crate::progress_window::{ProgressWindow, WindowOutcome};
use crate::response_map::{ResponseMap, direction};
use crate::target::Travel;

/// Windows in a row in which the rotor does not follow; the last one says how.
const WINDOWS: u8 = 2;

/// Part of the rate asked for below which a rotor counts as stuck. An assumption: the slowest mode that is known turns
/// at a fifteenth of its map, and the estimate of a rotor that is stuck and struck wanders by milli-degrees.
const FOLLOWS_PART: f32 = 0.02;

/// Limits of the holding of a rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateLimits {
    /// Angles between which the rotor may be driven.
    pub travel: Travel,
    /// Longest time with the drive on, in ns, added up; `None` for any.
    pub on_max_nanos: Option<u64>,
    /// Length in ns of the windows in which the rotor is seen to follow.
    pub progress_window_nanos: u64,
    /// Longest time without a usable estimate, in ns.
    pub blind_max_nanos: u64,
}

impl Default for RateLimits {
    /// Those for the default instruments.
    fn default() -> Self {
        Self::new(&PositioningTuning::default())
    }
}

impl RateLimits {
    /// Any angle and any time; windows, and the time without an estimate, are those of a move by `positioning`.
    pub(super) fn new(positioning: &PositioningTuning) -> Self {
        let &PositioningTuning { progress_window_nanos, blind_max_nanos, .. } = positioning;
        Self { travel: Travel::FREE, on_max_nanos: None, progress_window_nanos, blind_max_nanos }
    }
}

/// Why a rate is held no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RateStop {
    /// The drive does not turn the rotor.
    Stuck,
    /// The rotor turns against the direction asked for.
    WrongWay,
    /// The rotor would come to rest outside of the travel.
    EndOfTravel,
    /// The drive was on for as long as is allowed.
    DrivenTooLong,
    /// There was no usable estimate for longer than is allowed.
    NoEstimate,
}

/// What the holding of a rate asks of a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateState<'a> {
    /// Time since the last tick, ns, and the mode that was driven in it.
    pub last_nanos: u64,
    pub driven: Option<DriveMode>,
    pub estimate: &'a Estimate<f32>,
    /// The rate asked for, clockwise positive, not 0.
    pub rate_rad_s: f32,
}

impl RateState<'_> {
    /// The mode of the direction asked for.
    fn mode(&self) -> DriveMode {
        if self.rate_rad_s > 0.0 { DriveMode::B } else { DriveMode::C }
    }
}

/// What has been seen of a rotor that follows a rate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RateWatch {
    /// The window under way, and the mode it is about.
    window: Option<(DriveMode, ProgressWindow)>,
    /// Windows in a row in which the rotor did not follow.
    failed: u8,
    /// Whether a window has shown that the rotor turns the right way.
    has_turned: bool,
    /// Time with the drive on, in ns: the clock of the windows.
    on_nanos: u64,
    /// Time without a usable estimate, in ns, since the last one.
    blind_nanos: u64,
}

impl RateWatch {
    /// Whether there was no usable estimate for too long by now, a tick of `last_nanos` without one included.
    pub fn wait(&mut self, limits: &RateLimits, last_nanos: u64) -> Option<RateStop> {
        self.blind_nanos = self.blind_nanos.saturating_add(last_nanos);
        (self.blind_nanos > limits.blind_max_nanos).then_some(RateStop::NoEstimate)
    }

    /// The rotor is driven at another amplitude from now on: the windows in which it did not follow count no more, and
    /// the next ones are whole.
    pub fn begin_anew(&mut self) {
        (self.window, self.failed, self.has_turned) = (None, 0, true);
    }

    /// There is a usable estimate.
    pub fn sees(&mut self) {
        self.blind_nanos = 0;
    }

    /// Whether a limit is reached by now.
    pub fn check(&mut self, limits: &RateLimits, map: &ResponseMap, state: &RateState) -> Option<RateStop> {
        if state.driven.is_some() {
            self.on_nanos = self.on_nanos.saturating_add(state.last_nanos);
        }
        if limits.on_max_nanos.is_some_and(|max| self.on_nanos >= max) {
            return Some(RateStop::DrivenTooLong);
        }
        if limits.travel != Travel::FREE && leaves(limits.travel, map, state) {
            return Some(RateStop::EndOfTravel);
        }
        self.progress(limits, state)
    }

    fn progress(&mut self, limits: &RateLimits, state: &RateState) -> Option<RateStop> {
        let (mode, clock) = (state.mode(), Time::from_nanos(self.on_nanos));
        let begun = (mode, ProgressWindow::from(clock, state.estimate));
        let is_driven_back = state.driven.is_some_and(|driven| driven != mode);
        let window = match self.window {
            Some((of, window)) if of == mode && !is_driven_back => window,
            other => {
                self.has_turned = self.has_turned && other.is_none_or(|(of, _)| of == mode);
                self.window = Some(begun);
                return None;
            }
        };
        if self.has_turned && !window.is_over(limits.progress_window_nanos, clock) {
            return None;
        }
        let creep = FOLLOWS_PART * state.rate_rad_s.abs();
        let stop = match window.outcome(state.rate_rad_s, limits.progress_window_nanos, clock, state.estimate)
        {
            WindowOutcome::Open => return None,
            WindowOutcome::Turns(rate_rad_s) if rate_rad_s > creep => None,
            WindowOutcome::WrongWay(rate_rad_s) if rate_rad_s > creep => Some(RateStop::WrongWay),
            WindowOutcome::Turns(_) | WindowOutcome::WrongWay(_) | WindowOutcome::Stuck => {
                Some(RateStop::Stuck)
            }
        };
        self.window = Some(begun);
        self.has_turned = self.has_turned || stop.is_none();
        self.failed = if stop.is_some() { self.failed + 1 } else { 0 };
        stop.filter(|_| self.failed >= WINDOWS)
    }
}

/// Whether a rotor that is driven on leaves the travel.
fn leaves(travel: Travel, map: &ResponseMap, state: &RateState) -> bool {
    let mode = state.mode();
    let along = direction(mode);
    let rate_rad_s = along * state.estimate.rate_rad_s;
    // Not `f32::max`, for which the microcontroller calls a function.
    let coast_rad = map.coast_rad(mode, if rate_rad_s > 0.0 { rate_rad_s } else { 0.0 });
    coast_rad >= travel.room_rad(state.estimate.angle, along)
}
