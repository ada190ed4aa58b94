//! The amplitude at which a rotor turns fastest, searched over the cruises of a map.
//!
//! A rotor that tilts is fastest below full drive, and at full drive it may turn back. The map of a motor that only
//! rises and falls does not say so. So the rates of the rotor itself are compared, from one row of the map to the next:
//!
//! ```text
//! down:    from the first row to weaker ones, while each is faster
//! up:      where the first row is faster than the next weaker one, or if the search begins upwards: to stronger ones,
//!          while each is faster, or has more than twice the part of the map's rate that the strong one has below
//!          which the search began
//! end:     at a row that is fast enough, or at the fastest
//! again:   from that row on, down first, where it is too slow by the mean of six windows; each time after twice as
//!          many, at most 96
//! ```
//!
//! Until a search begins any amplitude is driven; after that none above the row that is tried, or found. Rate control
//! begins one where the rotor is behind, and positioning where a cruise turns it slowly or back.

use motor_model::DriveMode;

use crate::response_map::{Cruise, ResponseMap};

/// Part of the map's rate, or of the rate asked for, below which a rotor is slow, so that other amplitudes are tried.
/// An assumption: motors of the design are slower than the map by a third at most.
pub(crate) const SLOW_PART: f32 = 0.5;
/// Windows in a row by whose mean the fastest row may be too slow, and how often their number is doubled at most.
const WINDOWS: u8 = 6;
const DOUBLINGS: u8 = 4;
/// A row has so many times the part of the map's rate that a stronger one has, for rows between them to be tried. An
/// assumption: by a window the rate of a rotor that tilts is known to some 30 %.
const PROMISING: f32 = 2.0;

/// What is known of a mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Stage {
    /// Nothing: any amplitude is driven.
    #[default]
    Open,
    /// A row is tried.
    Trying(RowTrial),
    /// The fastest row.
    Found(u8),
}

/// A row of a mode in the map, and how fast the rotor was at it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tried {
    row: u8,
    rate_rad_s: f32,
}

/// A row that is tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowTrial {
    pub row: u8,
    /// Whether rows are tried from weak to strong.
    is_upwards: bool,
    /// The row that the search began with.
    first: u8,
    /// Rows from this one on are not tried.
    end: u8,
    /// The fastest row of this search; `None` before the first.
    best: Option<Tried>,
}

/// The rows among which is searched, and what ends the search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidates<'a> {
    /// Those of the mode, weakest first.
    pub cruises: &'a [Cruise],
    /// Strongest drive that is allowed.
    pub amplitude_max: f32,
    /// Whether rows are left out that do not turn nearly every motor.
    pub of_every_motor: bool,
    /// Rate in the direction of the mode, in rad/s, from which a row is fast enough.
    pub enough_rad_s: f32,
}

impl<'a> Candidates<'a> {
    /// A row, if it is allowed.
    pub fn row(&self, row: u8) -> Option<&'a Cruise> {
        self.cruises.get(usize::from(row)).filter(|cruise| self.includes(cruise))
    }

    fn includes(&self, cruise: &Cruise) -> bool {
        cruise.amplitude <= self.amplitude_max && (!self.of_every_motor || cruise.turns_every_motor())
    }

    /// The next weaker row.
    fn below(&self, row: u8) -> Option<u8> {
        let weaker = self.cruises.get(..usize::from(row))?;
        u8::try_from(weaker.iter().rposition(|cruise| self.includes(cruise))?).ok()
    }

    /// The next stronger row.
    fn above(&self, row: u8) -> Option<u8> {
        let first = usize::from(row) + 1;
        let beyond = self.cruises.get(first..)?.iter().position(|cruise| self.includes(cruise))?;
        u8::try_from(first + beyond).ok()
    }

    /// Whether rows above `here` may be faster than `best`, a stronger one: `here` the rotor has more than
    /// [`PROMISING`] times the part of the map's rate that it has there.
    fn promise_more(&self, here: Tried, best: Tried) -> bool {
        let (Some(weak), Some(strong)) = (self.row(here.row), self.cruises.get(usize::from(best.row))) else {
            return false;
        };
        let [weak, strong] = [weak, strong].map(|cruise| cruise.rate_rad_s.abs());
        here.row < best.row && here.rate_rad_s * strong > PROMISING * best.rate_rad_s * weak
    }

    fn number(&self, is_wanted: impl FnMut(&Cruise) -> bool) -> Option<u8> {
        u8::try_from(self.cruises.iter().position(is_wanted)?).ok()
    }
}

impl RowTrial {
    /// The first of a search that goes down first.
    pub fn at(row: u8) -> Self {
        Self { row, is_upwards: false, first: row, end: u8::MAX, best: None }
    }

    /// The first of a search that goes up: the weakest row that is faster, by the map, than the rotor turns at
    /// `amplitude`, in either direction; `rate_rad_s` is its rate there in that of the mode. `None` if there is none
    /// below `amplitude`.
    pub fn below(amplitude: f32, rate_rad_s: f32, candidates: Candidates) -> Option<Self> {
        let here = candidates.number(|cruise| cruise.amplitude >= amplitude)?;
        let row = candidates
            .number(|cruise| candidates.includes(cruise) && cruise.rate_rad_s.abs() > rate_rad_s.abs())
            .filter(|row| *row < here)?;
        let best = Some(Tried { row: here, rate_rad_s });
        Some(Self { row, is_upwards: true, first: row, end: here, best })
    }

    /// What follows once its row has given `rate_rad_s` in the direction of the mode.
    pub fn after(self, candidates: Candidates, rate_rad_s: f32) -> Stage {
        let here = Tried { row: self.row, rate_rad_s };
        if rate_rad_s >= candidates.enough_rad_s {
            return Stage::Found(self.row);
        }
        let best = self.best.filter(|best| best.rate_rad_s >= rate_rad_s).unwrap_or(here);
        let trial = Self { best: Some(best), ..self };
        let is_faster = best.row == self.row;
        if let Some(row) = candidates.below(self.row).filter(|_| !self.is_upwards && is_faster) {
            return Stage::Trying(Self { row, ..trial });
        }
        let is_first_side_over = !self.is_upwards && best.row == self.first;
        let above = candidates.above(if is_first_side_over { self.first } else { self.row });
        above
            .filter(|above| *above < self.end)
            .filter(|_| {
                let goes_on = is_faster || candidates.promise_more(here, best);
                is_first_side_over || self.is_upwards && goes_on
            })
            .map_or(Stage::Found(best.row), |row| Stage::Trying(Self { row, is_upwards: true, ..trial }))
    }
}

/// What is known of both modes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AmplitudeSearch {
    clockwise: Stage,
    counter_clockwise: Stage,
    /// The mode of the last windows at a fastest row, how many there are in a row, and the sum of their rates.
    recent: Option<(DriveMode, u8, f32)>,
    /// How often their number was doubled.
    doublings: u8,
}

impl AmplitudeSearch {
    /// What is known of `mode`.
    pub fn stage(&self, mode: DriveMode) -> &Stage {
        match mode {
            DriveMode::B => &self.clockwise,
            DriveMode::C => &self.counter_clockwise,
        }
    }

    /// The same, to be changed.
    pub fn stage_mut(&mut self, mode: DriveMode) -> &mut Stage {
        match mode {
            DriveMode::B => &mut self.clockwise,
            DriveMode::C => &mut self.counter_clockwise,
        }
    }

    /// Forgets the windows at the fastest row: they are no longer in a row.
    pub fn forget_recent(&mut self) {
        self.recent = None;
    }

    /// What follows a window in which the fastest `row` of `mode` has given `rate_rad_s`, if the mean of enough of them
    /// is below `wanted_rad_s`, both in the direction of the mode: the search begins again at that row.
    pub fn again(
        &mut self,
        (mode, row): (DriveMode, u8),
        candidates: Candidates,
        rate_rad_s: f32,
        wanted_rad_s: f32,
    ) -> Option<Stage> {
        let recent = self.recent.filter(|(of, ..)| *of == mode);
        let (count, sum) = recent.map_or((1, rate_rad_s), |(_, count, sum)| (count + 1, sum + rate_rad_s));
        self.recent = Some((mode, count, sum));
        if count < WINDOWS << self.doublings {
            return None;
        }
        self.forget_recent();
        let mean_rad_s = sum / f32::from(count);
        if mean_rad_s >= wanted_rad_s {
            return None;
        }
        self.doublings += u8::from(self.doublings < DOUBLINGS);
        Some(RowTrial::at(row).after(candidates, mean_rad_s))
    }

    /// The strongest amplitude of `mode` by `map` that is driven now, where `amplitude_max` is allowed.
    pub fn strongest(&self, map: &ResponseMap, mode: DriveMode, amplitude_max: f32) -> f32 {
        let row = match self.stage(mode) {
            Stage::Open => return amplitude_max,
            Stage::Trying(RowTrial { row, .. }) | Stage::Found(row) => *row,
        };
        map.cruises_of(mode).get(usize::from(row)).map_or(amplitude_max, |cruise| cruise.amplitude)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates() -> Candidates<'static> {
        Candidates {
            cruises: ResponseMap::table_1().cruises_of(DriveMode::B),
            amplitude_max: 1.0,
            of_every_motor: true,
            enough_rad_s: f32::INFINITY,
        }
    }

    /// A search below a row ends at the next weaker one, however fast the rotor is there: that row has been driven.
    #[test]
    fn exact_a_search_below_a_row_does_not_try_it_again() {
        let mut stage = Stage::Trying(RowTrial::below(0.7, 1.0, candidates()).unwrap());
        for row in [1_u8, 2, 3] {
            let Stage::Trying(trial) = stage else { panic!("{row}: {stage:?}") };
            assert_eq!(trial.row, row);
            stage = trial.after(candidates(), 2.0 + f32::from(row));
        }
        assert_eq!(stage, Stage::Found(3));
    }

    /// By the mean of six windows in a row of one mode a row is too slow, and by that of twelve the next time.
    #[test]
    fn exact_a_row_that_is_too_slow_in_the_mean_is_compared_again() {
        let mut search = AmplitudeSearch::default();
        let mut window = |mode, rate_rad_s| search.again((mode, 4), candidates(), rate_rad_s, 2.0);
        for windows in [6, 12] {
            assert!((1..windows).all(|_| window(DriveMode::B, 1.9).is_none()), "{windows}");
            let stage = window(DriveMode::B, 1.9);
            assert!(matches!(stage, Some(Stage::Trying(RowTrial { row: 3, .. }))), "{windows}: {stage:?}");
        }
        assert!((0..48).all(|_| window(DriveMode::B, 2.1).is_none()), "fast enough");
        for mode in [DriveMode::B, DriveMode::C] {
            assert!((0..13).all(|_| window(mode, 1.9).is_none()), "of both modes together");
        }
    }
}
