//! The rates by which the amplitude of a rotor that is behind is searched ([`crate::amplitude_search`]).
//!
//! By the map a rotor that is behind is driven harder, and one that tilts then turns more slowly, or back. So its rate
//! is compared over the amplitudes of the map, as [`crate::resonance_tracker`] compares it over frequencies.
//!
//! ```text
//! row:     the weakest cruise of the map whose rate is the one asked for
//! begin:   for 50 ms and half a window the drive was that of the next stronger row at least, and in the half window
//!          the rotor turned at less than half of the rate asked for; or it sticks or turns back after these 50 ms
//! search:  from that row on, each row for 50 ms and two windows
//! end:     at a row that is faster than the rate asked for by a tenth, or at the fastest
//! again:   the rotor was behind for six windows, or as many as that search asks for, and slower than asked for by
//!          their mean; or it sticks or turns back at the fastest
//! ```
//!
//! A row at which the rotor sticks or turns back is one of no rate, if the rotor has turned at another row of the
//! search, or at the drive before it; otherwise the hold ends.
//!
//! No drive is stronger than the amplitude that is tried, or found. Where the map promises the rate asked for at its
//! strongest cruise alone, or not at all, nothing is searched: a weaker drive gives less. A map that commissioning made
//! ends at the fastest amplitude itself.

use estimator::Estimate;
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use crate::amplitude_search::{AmplitudeSearch, Candidates, RowTrial, SLOW_PART, Stage};
use crate::response_map::{Cruise, ResponseMap, direction};

/// Time in ns from a change of the amplitude until the rate is measured: the rotor reaches it.
const SPIN_UP_NANOS: u64 = 50_000_000;
/// Rate, per that asked for, at which the search ends: the tenth catches up.
const ENOUGH: f32 = 1.1;
/// Windows by which a row is compared with others. An assumption: by the mean of one the rate of a rotor that tilts is
/// known to some 20 %.
const TRIAL_WINDOWS: u64 = 2;

/// Part of the rate asked for at which a rotor has turned, or turned back. An assumption: twice what counts as
/// following, since a rate over half a window is known half as well.
const TURNED_PART: f32 = 0.04;

/// A rate that is being measured.
#[derive(Clone, Copy, Debug)]
struct Measured {
    mode: DriveMode,
    /// When the rotor has its speed.
    from: Time,
    /// The begin of the window under way, and where the rotor was.
    begun: Option<(Time, Angle)>,
}

impl Measured {
    /// What is driven otherwise from `now` on.
    fn anew(mode: DriveMode, now: Time) -> Self {
        Self { mode, from: now.plus_nanos(SPIN_UP_NANOS), begun: None }
    }
}

/// The amplitudes of both modes, and the rate that is being measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RateSearch {
    amplitudes: AmplitudeSearch,
    measured: Option<Measured>,
    /// Whether the rotor has turned at an amplitude of the search under way, or at the one before it: in modes B and C.
    has_turned: [bool; 2],
}

/// What a rate is measured of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven<'a> {
    pub map: &'a ResponseMap,
    pub command: DriveCommand,
    /// The rate asked for, clockwise positive, not 0.
    pub rate_rad_s: f32,
    /// Strongest drive that is allowed.
    pub amplitude_max: f32,
    /// Length of a window in ns.
    pub window_nanos: u64,
}

impl Driven<'_> {
    fn mode(&self) -> DriveMode {
        if self.rate_rad_s > 0.0 { DriveMode::B } else { DriveMode::C }
    }

    fn asked_rad_s(&self) -> f32 {
        direction(self.mode()) * self.rate_rad_s
    }

    fn candidates(&self) -> Candidates<'_> {
        Candidates {
            cruises: self.map.cruises_of(self.mode()),
            amplitude_max: self.amplitude_max,
            of_every_motor: false,
            enough_rad_s: ENOUGH * self.asked_rad_s(),
        }
    }

    fn row(&self, row: u8) -> Option<&Cruise> {
        self.candidates().row(row)
    }

    /// The weakest row that the map promises the rate asked for at, if there is a stronger one.
    fn weakest_row(&self) -> Option<u8> {
        let along = direction(self.mode());
        let rows = self.map.cruises_of(self.mode()).iter();
        let row = rows.take_while(|cruise| along * cruise.rate_rad_s < self.asked_rad_s()).count();
        let row = u8::try_from(row).ok()?;
        self.row(row + 1).map(|_| row)
    }
}

impl RateSearch {
    /// The strongest amplitude of `mode` by `map` that is driven now, where `amplitude_max` is allowed.
    pub fn strongest(&self, map: &ResponseMap, mode: DriveMode, amplitude_max: f32) -> f32 {
        self.amplitudes.strongest(map, mode, amplitude_max)
    }

    fn has_turned(&mut self, mode: DriveMode) -> &mut bool {
        let [clockwise, counter_clockwise] = &mut self.has_turned;
        match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        }
    }

    /// Nothing is measured without an estimate or a rate.
    pub fn pause(&mut self) {
        self.measured = None;
        self.amplitudes.forget_recent();
    }

    /// Measures the rate of a rotor that is `driven` until `now`. Returns whether the rotor, which has turned back, is
    /// driven at another amplitude from now on.
    #[cold]
    #[inline(never)]
    pub fn watch(&mut self, driven: &Driven, now: Time, estimate: &Estimate<f32>) -> bool {
        let mode = driven.mode();
        let amplitude = self.measured_from(driven).filter(|amplitude| {
            driven.command.mode() == Some(mode) && driven.command.amplitude() >= *amplitude
        });
        if amplitude.is_none() {
            self.pause();
            return false;
        }
        let measured =
            self.measured.filter(|measured| measured.mode == mode).unwrap_or(Measured::anew(mode, now));
        self.measured = Some(measured);
        if now < measured.from {
            return false;
        }
        let next = Some(Measured { begun: Some((now, estimate.angle)), ..measured });
        let Some((at, angle)) = measured.begun else {
            self.measured = next;
            return false;
        };
        let window_nanos = match self.amplitudes.stage(mode) {
            Stage::Open => driven.window_nanos / 2,
            Stage::Trying(_) => TRIAL_WINDOWS * driven.window_nanos,
            Stage::Found(_) => driven.window_nanos,
        };
        if now.nanos_since(at) < window_nanos {
            return false;
        }
        let turned_rad: f32 = direction(mode) * estimate.angle.radians_since::<f32>(angle);
        self.measured = next;
        let rate_rad_s = turned_rad / now.seconds_since::<f32>(at);
        self.take(driven, rate_rad_s, now) && rate_rad_s < -TURNED_PART * driven.asked_rad_s()
    }

    /// The amplitude from which on the rate is measured: of a rotor that is behind.
    fn measured_from(&self, driven: &Driven) -> Option<f32> {
        match self.amplitudes.stage(driven.mode()) {
            Stage::Open => driven.weakest_row().and_then(|row| driven.row(row + 1)),
            Stage::Trying(RowTrial { row, .. }) | Stage::Found(row) => driven.row(*row),
        }
        .map(|cruise| cruise.amplitude)
    }

    /// Takes the rate of a window that ends at `now`. Returns whether another amplitude follows.
    fn take(&mut self, driven: &Driven, rate_rad_s: f32, now: Time) -> bool {
        let (mode, asked_rad_s) = (driven.mode(), driven.asked_rad_s());
        let stage = *self.amplitudes.stage(mode);
        let has_turned = self.has_turned(mode);
        *has_turned &= matches!(stage, Stage::Trying(_));
        *has_turned |= rate_rad_s > TURNED_PART * asked_rad_s;
        let next = match stage {
            Stage::Open if rate_rad_s < SLOW_PART * asked_rad_s => first_trial(driven),
            Stage::Open => return false,
            Stage::Trying(trial) => trial.after(driven.candidates(), rate_rad_s),
            Stage::Found(row) => {
                let Some(next) =
                    self.amplitudes.again((mode, row), driven.candidates(), rate_rad_s, asked_rad_s)
                else {
                    return false;
                };
                next
            }
        };
        *self.amplitudes.stage_mut(mode) = next;
        self.measured = Some(Measured::anew(mode, now));
        true
    }

    /// The rotor sticks or turns back. Whether another amplitude is tried for it: a weaker one, since this one is
    /// stronger than the map asks for, and has been for long enough; the next of a search in which it has turned at
    /// another; or, from the fastest on, those of a new search.
    pub fn tries_another(&mut self, driven: &Driven, now: Time) -> bool {
        let mode = driven.mode();
        let is_measured = self.measured.is_some_and(|measured| measured.mode == mode && now >= measured.from);
        let stage = *self.amplitudes.stage(mode);
        let next = match stage {
            Stage::Open if is_measured => first_trial(driven),
            Stage::Trying(trial) if *self.has_turned(mode) => trial.after(driven.candidates(), 0.0),
            Stage::Found(row) => RowTrial::at(row).after(driven.candidates(), 0.0),
            Stage::Open | Stage::Trying(_) => stage,
        };
        if next == stage {
            return false;
        }
        *self.has_turned(mode) &= matches!(stage, Stage::Trying(_));
        *self.amplitudes.stage_mut(mode) = next;
        self.measured = Some(Measured::anew(mode, now));
        true
    }
}

/// The first row that is tried.
fn first_trial(driven: &Driven) -> Stage {
    driven.weakest_row().map_or(Stage::Open, |row| Stage::Trying(RowTrial::at(row)))
}

#[cfg(test)]
mod tests;
