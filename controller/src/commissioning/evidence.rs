//! What commissioning has measured, row by row of the prior map.
//!
//! Rates, coasts and turns are kept in units of the prior row, so that 1 means as in the map.

use super::coasts::Coasts;
use super::repeats::Repeats;
use crate::response_map::{BURSTS_MAX, CRUISES_MAX, Cruise, Family, PerFamily, direction};

/// A row of a response map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapRow {
    /// The cruise of that index.
    Cruise(usize),
    /// The burst of that index in a family.
    Burst(Family, usize),
}

/// What a cruise did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CruiseEvidence {
    /// Runs of it that showed something.
    pub runs: u16,
    /// Further runs, which turned the rotor and ended with the loss of the estimate before a window was over.
    pub unseen: u16,
    /// Those of them that ended with the loss of the estimate, after a window or more, and turned the rotor.
    pub lost: u16,
    /// Mean rates of its windows, per rate of the prior row.
    pub windows: Repeats,
    /// Windows in which the rotor turned in the mode's direction, however little.
    pub forward: u16,
    /// Windows in which the rotor turned against the mode's direction.
    pub backward: u16,
    /// Windows in which it did not turn.
    pub still: u16,
    /// Coasts after it.
    pub coasts: Coasts,
    /// Times in s from the end of the drive until the estimate no longer says that the rotor moves.
    pub to_rest_s: Repeats,
}

/// Runs of a row that lose the estimate, from which on it is taken for one that does.
const LOST_RUNS: u16 = 2;

/// Whether the estimate is `lost` in most runs of a row, where others have `shown` something: nothing more is learnt of
/// it, and no move drives it.
fn is_lost(lost: u16, shown: u16) -> bool {
    lost >= LOST_RUNS && lost > shown
}

impl CruiseEvidence {
    /// Whether most of its runs lose the estimate before they have shown anything.
    pub fn is_lost(&self) -> bool {
        is_lost(self.unseen, self.runs)
    }
}

impl BurstEvidence {
    /// The same of its trains.
    pub fn is_lost(&self) -> bool {
        is_lost(self.lost, self.turns.count())
    }
}

/// What a burst did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BurstEvidence {
    /// Mean turns of trains, per turn of the prior row.
    pub turns: Repeats,
    /// Bursts in a train.
    pub train: u8,
    /// Trains that ended with the loss of the estimate, and turned the rotor.
    pub lost: u16,
    /// Times in s until rest.
    pub to_rest_s: Repeats,
}

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissioningEvidence {
    cruises: [CruiseEvidence; CRUISES_MAX],
    bursts: PerFamily<[BurstEvidence; BURSTS_MAX]>,
}

impl Default for CommissioningEvidence {
    /// Nothing yet.
    fn default() -> Self {
        let none = [BurstEvidence::default(); BURSTS_MAX];
        Self {
            cruises: [CruiseEvidence::default(); CRUISES_MAX],
            bursts: PerFamily::of([none; Family::ALL.len()]),
        }
    }
}

impl CommissioningEvidence {
    /// What the cruise of that index in the prior map did; nothing beyond its last.
    pub fn cruise(&self, index: usize) -> CruiseEvidence {
        self.cruises.get(index).copied().unwrap_or_default()
    }

    /// What the burst of that index in the prior map did; nothing beyond its last.
    pub fn burst(&self, family: Family, index: usize) -> BurstEvidence {
        self.bursts.get(family).get(index).copied().unwrap_or_default()
    }

    /// The same, to change it.
    pub fn cruise_mut(&mut self, index: usize) -> Option<&mut CruiseEvidence> {
        self.cruises.get_mut(index)
    }

    /// The same, to change it.
    pub fn burst_mut(&mut self, family: Family, index: usize) -> Option<&mut BurstEvidence> {
        self.bursts.get_mut(family).get_mut(index)
    }

    /// Adds a window of a cruise of the prior map that turned the rotor by `turned_rad` in the direction of its mode,
    /// with the variance `turned_rad2`, in `time_s`.
    pub fn add_window(
        &mut self,
        index: usize,
        cruise: &Cruise,
        turned_rad: f32,
        turned_rad2: f32,
        time_s: f32,
    ) {
        let Some(evidence) = self.cruises.get_mut(index) else { return };
        let expected_rad = direction(cruise.mode) * cruise.rate_rad_s * time_s;
        evidence.windows.add(turned_rad / expected_rad, turned_rad2 / (expected_rad * expected_rad));
        let significant = turned_rad * turned_rad > SIGNIFICANT_SIGMAS * SIGNIFICANT_SIGMAS * turned_rad2;
        if significant {
            let count = if turned_rad < 0.0 { &mut evidence.backward } else { &mut evidence.forward };
            *count = count.saturating_add(1);
        }
        // Of a late camera a window may be too uncertain to show any turn.
        let limit_rad2 = SIGNIFICANT_SIGMAS * SIGNIFICANT_SIGMAS * turned_rad2;
        let shows_a_turn = expected_rad * expected_rad > limit_rad2;
        if shows_a_turn && (!significant || turned_rad.abs() < STILL_PART * expected_rad) {
            evidence.still = evidence.still.saturating_add(1);
        }
    }

    /// How many rows were measured.
    pub fn rows_measured(&self) -> usize {
        let cruises = self.cruises.iter().filter(|cruise| cruise.runs > 0).count();
        let bursts = Family::ALL
            .into_iter()
            .flat_map(|family| self.bursts.get(family))
            .filter(|burst| burst.turns.count() > 0)
            .count();
        cruises + bursts
    }
}

/// Standard deviations beyond which a window's turn is significant: of 1,000 windows of a rotor at rest two thirds of
/// one exceed them backwards.
const SIGNIFICANT_SIGMAS: f32 = 3.2;
/// Part of the prior's turn below which a rotor counts as still. An assumption: a window in which it slipped for a
/// fiftieth of the time.
const STILL_PART: f32 = 0.02;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response_map::ResponseMap;

    #[test]
    fn exact_a_cruise_is_lost_when_most_of_its_runs_are() {
        for (runs, unseen, lost, is_lost) in [
            (0, 0, 0, false),
            (0, 1, 0, false),
            (1, 0, 1, false),
            (0, 2, 0, true),
            (1, 2, 1, true),
            (4, 0, 2, false),
            (3, 2, 0, false),
        ] {
            let found = CruiseEvidence { runs, unseen, lost, ..CruiseEvidence::default() };
            assert_eq!(found.is_lost(), is_lost, "{found:?}");
        }
    }

    /// In units of the row: the weakest cruise of mode C in 2 s. Its turn is 0.0516 rad, 3.2 standard deviations are
    /// 3.2 mrad.
    #[test]
    fn exact_windows_are_counted_by_what_they_show() {
        let map = ResponseMap::table_1();
        let (index, cruise) = map.cruises().iter().enumerate().nth(8).unwrap();
        let mut evidence = CommissioningEvidence::default();
        for (turned_rad, forward, backward, still) in [
            (0.0516, 1, 0, 0),
            (-0.0516, 1, 1, 0),
            (0.0031, 1, 1, 1),
            (-0.0033, 1, 2, 1),
            (0.0033, 2, 2, 1),
            (0.0, 2, 2, 2),
        ] {
            evidence.add_window(index, cruise, turned_rad, 1e-6, 2.0);
            let found = evidence.cruise(index);
            let counts = (found.forward, found.backward, found.still);
            assert_eq!(counts, (forward, backward, still), "{turned_rad}");
        }
        assert!((evidence.cruise(index).windows.mean() - 0.0031 / 0.0516 / 6.0).abs() < 1e-5);
        // Known to 17 mrad, the whole turn of the row would not show.
        evidence.add_window(index, cruise, 0.0, 2.8e-4, 2.0);
        assert_eq!((evidence.cruise(index).windows.count(), evidence.cruise(index).still), (7, 2));
        assert_eq!(evidence.cruise(99), CruiseEvidence::default());
    }
}
