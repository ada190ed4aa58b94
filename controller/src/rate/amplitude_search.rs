//! The strongest amplitude that a rotor is driven at, which is found by its rates.
//!
//! A rotor that tilts is fastest below full drive. The map of a motor that only rises and falls does not say so: by it
//! a rotor that is behind is driven harder, and one that tilts then turns more slowly, or back. So its rate is compared
//! over the amplitudes of the map, as [`crate::resonance_tracker`] compares it over frequencies.
//!
//! ```text
//! row:     the weakest cruise of the map whose rate is the one asked for
//! begin:   for 50 ms and half a window the drive was that of the next stronger row at least, and in the half window
//!          the rotor turned at less than half of the rate asked for; or it sticks or turns back after these 50 ms
//! search:  the row first, then the next weaker ones while each is faster, else the next stronger ones while each is
//!          faster; each for 50 ms and two windows
//! end:     at a row that is faster than the rate asked for by a tenth, or at the fastest
//! again:   the rotor was behind for six windows, and slower than asked for by their mean: from the present row on;
//!          each time after twice as many, at most 96
//! ```
//!
//! No drive is stronger than the amplitude that is tried, or found. Where the map promises the rate asked for at its
//! strongest cruise alone, or not at all, nothing is searched: a weaker drive gives less. A map that commissioning made
//! ends at the fastest amplitude itself.

use estimator::Estimate;
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use crate::response_map::{Cruise, ResponseMap, direction};

/// Time in ns from a change of the amplitude until the rate is measured: the rotor reaches it.
const SPIN_UP_NANOS: u64 = 50_000_000;
/// Part of the rate asked for below which a rotor that is driven more strongly than that asks for is tried at less. An
/// assumption: motors of the design are slower than the map by a third at most.
const SLOW_PART: f32 = 0.5;
/// Rate, per that asked for, at which the search ends: the tenth catches up.
const ENOUGH: f32 = 1.1;
/// Windows by which a row is compared with others. An assumption: by the mean of one the rate of a rotor that tilts is
/// known to some 20 %.
const TRIAL_WINDOWS: u64 = 2;
/// Windows in a row by whose mean the fastest row may be too slow, and how often their number is doubled at most.
const WINDOWS: u8 = 6;
const DOUBLINGS: u8 = 4;

/// What is known of a mode.
#[derive(Clone, Copy, Debug, Default)]
enum Stage {
    /// Nothing: any amplitude is driven.
    #[default]
    Open,
    /// A row is tried.
    Trying(Trial),
    /// The fastest row.
    Found(u8),
}

/// A row of a mode in the map, and how fast the rotor was at it.
#[derive(Clone, Copy, Debug)]
struct Tried {
    row: u8,
    rate_rad_s: f32,
}

/// A row that is tried.
#[derive(Clone, Copy, Debug)]
struct Trial {
    row: u8,
    /// Whether rows are tried from weak to strong: after those from strong to weak.
    is_upwards: bool,
    first: u8,
    /// The fastest row of this search; `None` before the first.
    best: Option<Tried>,
}

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
pub(super) struct AmplitudeSearch {
    clockwise: Stage,
    counter_clockwise: Stage,
    measured: Option<Measured>,
    /// Windows in a row at the fastest row, and the sum of their rates.
    recent: (u8, f32),
    /// How often their number was doubled.
    doublings: u8,
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

    fn row(&self, row: u8) -> Option<&Cruise> {
        let cruise = self.map.cruises_of(self.mode()).get(usize::from(row))?;
        (cruise.amplitude <= self.amplitude_max).then_some(cruise)
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

impl AmplitudeSearch {
    fn stage(&mut self, mode: DriveMode) -> &mut Stage {
        match mode {
            DriveMode::B => &mut self.clockwise,
            DriveMode::C => &mut self.counter_clockwise,
        }
    }

    /// The strongest amplitude of `mode` by `map` that is driven now, where `amplitude_max` is allowed.
    pub fn strongest(&self, map: &ResponseMap, mode: DriveMode, amplitude_max: f32) -> f32 {
        let stage = match mode {
            DriveMode::B => &self.clockwise,
            DriveMode::C => &self.counter_clockwise,
        };
        let row = match stage {
            Stage::Open => return amplitude_max,
            Stage::Trying(Trial { row, .. }) | Stage::Found(row) => *row,
        };
        map.cruises_of(mode).get(usize::from(row)).map_or(amplitude_max, |cruise| cruise.amplitude)
    }

    /// Nothing is measured without an estimate or a rate.
    pub fn pause(&mut self) {
        self.measured = None;
        self.recent = (0, 0.0);
    }

    /// Measures the rate of a rotor that is `driven` until `now`.
    #[cold]
    #[inline(never)]
    pub fn watch(&mut self, driven: &Driven, now: Time, estimate: &Estimate<f32>) {
        let mode = driven.mode();
        let Some(amplitude) = self.measured_from(driven) else { return self.pause() };
        if driven.command.mode() != Some(mode) || driven.command.amplitude() < amplitude {
            return self.pause();
        }
        let measured =
            self.measured.filter(|measured| measured.mode == mode).unwrap_or(Measured::anew(mode, now));
        self.measured = Some(measured);
        if now < measured.from {
            return;
        }
        let next = Some(Measured { begun: Some((now, estimate.angle)), ..measured });
        let Some((at, angle)) = measured.begun else {
            self.measured = next;
            return;
        };
        let window_nanos = match self.stage(mode) {
            Stage::Open => driven.window_nanos / 2,
            Stage::Trying(_) => TRIAL_WINDOWS * driven.window_nanos,
            Stage::Found(_) => driven.window_nanos,
        };
        if now.nanos_since(at) < window_nanos {
            return;
        }
        let turned_rad: f32 = direction(mode) * estimate.angle.radians_since::<f32>(angle);
        self.measured = next;
        self.take(driven, turned_rad / now.seconds_since::<f32>(at), now);
    }

    /// The amplitude from which on the rate is measured: of a rotor that is behind.
    fn measured_from(&mut self, driven: &Driven) -> Option<f32> {
        match self.stage(driven.mode()) {
            Stage::Open => driven.weakest_row().and_then(|row| driven.row(row + 1)),
            Stage::Trying(Trial { row, .. }) | Stage::Found(row) => driven.row(*row),
        }
        .map(|cruise| cruise.amplitude)
    }

    /// Takes the rate of a window that ends at `now`.
    fn take(&mut self, driven: &Driven, rate_rad_s: f32, now: Time) {
        let (mode, asked_rad_s) = (driven.mode(), driven.asked_rad_s());
        let next = match *self.stage(mode) {
            Stage::Open if rate_rad_s < SLOW_PART * asked_rad_s => first_trial(driven),
            Stage::Open => return,
            Stage::Trying(trial) => trial.after(driven, rate_rad_s),
            Stage::Found(row) => {
                let (count, sum) = (self.recent.0 + 1, self.recent.1 + rate_rad_s);
                self.recent = (count, sum);
                let windows = WINDOWS << self.doublings;
                if count < windows {
                    return;
                }
                self.recent = (0, 0.0);
                let mean_rad_s = sum / f32::from(count);
                if mean_rad_s >= asked_rad_s {
                    return;
                }
                self.doublings += u8::from(self.doublings < DOUBLINGS);
                Trial::at(row).after(driven, mean_rad_s)
            }
        };
        *self.stage(mode) = next;
        self.measured = Some(Measured::anew(mode, now));
    }

    /// The rotor sticks or turns back. Whether a weaker drive is tried for it, since this one is stronger than the map
    /// asks for, and has been for long enough.
    pub fn tries_less(&mut self, driven: &Driven, now: Time) -> bool {
        let mode = driven.mode();
        let is_measured = self.measured.is_some_and(|measured| measured.mode == mode && now >= measured.from);
        if !is_measured || !matches!(self.stage(mode), Stage::Open) {
            return false;
        }
        *self.stage(mode) = first_trial(driven);
        self.measured = Some(Measured::anew(mode, now));
        !matches!(self.stage(mode), Stage::Open)
    }
}

/// The first row that is tried.
fn first_trial(driven: &Driven) -> Stage {
    driven.weakest_row().map_or(Stage::Open, |row| Stage::Trying(Trial::at(row)))
}

impl Trial {
    /// The first of a search.
    fn at(row: u8) -> Self {
        Self { row, is_upwards: false, first: row, best: None }
    }

    /// What follows once its row has given `rate_rad_s`.
    fn after(self, driven: &Driven, rate_rad_s: f32) -> Stage {
        let here = Tried { row: self.row, rate_rad_s };
        if rate_rad_s >= ENOUGH * driven.asked_rad_s() {
            return Stage::Found(self.row);
        }
        let best = self.best.filter(|best| best.rate_rad_s >= rate_rad_s).unwrap_or(here);
        let trial = Self { best: Some(best), ..self };
        let is_faster = best.row == self.row;
        if !self.is_upwards && is_faster && self.row > 0 {
            return Stage::Trying(Self { row: self.row - 1, ..trial });
        }
        let (is_first_side_over, stronger) = (!self.is_upwards && best.row == self.first, self.first + 1);
        let above = if is_first_side_over { stronger } else { self.row + 1 };
        if (is_first_side_over || self.is_upwards && is_faster) && driven.row(above).is_some() {
            return Stage::Trying(Self { row: above, is_upwards: true, ..trial });
        }
        Stage::Found(best.row)
    }
}

#[cfg(test)]
mod tests;
