//! What to measure next: where it pays for positioning, and nowhere else.
//!
//! 1. The resonances of both modes, where there is a vibrometer.
//! 2. A few rows of each table, each twice or three times: what the tests of [`super::findings`] and of the map's shape
//!    need ([`super::row_factors`]). Of cruises the strongest, and those nearest to a half and to three quarters of it;
//!    of bursts those at a quarter and a half of the family's rows, then of fine ones that at three quarters, of others
//!    the longest, whose shape differs most where the drive needs time to spoil the motion.
//! 3. All rows of a table whose level or shape is not the prior's, each [`CONTRADICTING_RUNS`] times.
//! 4. The row whose next repeat shortens the expected time of [`MOVES_DEG`] most, as long as that is more than
//!    [`GAIN_MIN_S`] in the mean of the moves.
//!
//! Nothing more is measured of a mode that is dead or turns the other way at all of its first drives, nor of a row
//! that loses the estimate most of the time. Bursts that are too short to be measured,
//! even [`TRAIN_MAX`] of them, are left to the factor of their family.

use motor_model::DriveMode;

use super::commissioned_map::commissioned_map;
use super::evidence::{CommissioningEvidence, MapRow};
use super::experiment::{TRAIN_MAX, WINDOWS};
use super::findings::Findings;
use super::map_factors::{MapFactors, Measured, is_fine};
use crate::move_forecast::MoveForecast;
use crate::response_map::{Burst, Family, RAD_PER_MDEG, ResponseMap, direction};
use crate::target::Limits;
use estimator::Instruments;

/// Moves in degrees whose expected time counts: far, near and fine, both ways. An assumption.
const MOVES_DEG: [f32; 8] = [90.0, -90.0, 5.0, -5.0, 0.3, -0.3, 0.02, -0.02];
/// Tolerance of these moves in milli-degrees, where the instruments allow it.
const TOLERANCE_MDEG: f32 = 0.5;
/// Time in s per move that another measurement must save. An assumption: a hundredth of a short move.
pub(super) const GAIN_MIN_S: f32 = 0.005;
/// Time in s that counts for a move that cannot be made: the deadline of a move.
const IMPOSSIBLE_S: f32 = 60.0;
/// Runs of each row of a table that contradicts the prior.
const CONTRADICTING_RUNS: u16 = 4;
/// Windows of a whole cruise.
#[expect(clippy::cast_possible_truncation, reason = "8")]
const WINDOWS_OF_RUN: u16 = WINDOWS as u16;
/// Runs of a row beyond which no more are made.
const REPEATS_MAX: u16 = 6;
/// Turn of a train in mdeg: a hundred times what a third of a second of measuring leaves.
const TRAIN_MDEG: f32 = 20.0;
/// Turn in mdeg below which a train is not worth measuring: nine standard deviations.
const TRAIN_MIN_MDEG: f32 = 2.7;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Next {
    Sweep(DriveMode),
    Row(MapRow),
    Enough,
}

/// What is known by now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known<'a> {
    pub prior: &'a ResponseMap,
    pub evidence: &'a CommissioningEvidence,
    /// Whether each mode is still to be swept.
    pub unswept: [bool; 2],
    pub amplitude_max: f32,
    pub instruments: &'a Instruments,
}

/// How many bursts of `family` like `burst` are driven before the turn is measured. Coarse bursts differ from one to
/// the next, and those that follow one another differ alike: they are measured one by one.
pub(super) fn train(family: Family, burst: &Burst) -> u8 {
    let mut count = 1;
    while is_fine(family)
        && count < TRAIN_MAX
        && f32::from(count) * burst.turn_rad < TRAIN_MDEG * RAD_PER_MDEG
    {
        count += 1;
    }
    count
}

/// Runs of a row in the first pass.
fn runs(row: MapRow) -> u16 {
    match row {
        MapRow::Cruise(_) | MapRow::Burst(Family::Step | Family::Walk, _) => 2,
        MapRow::Burst(Family::Stride | Family::Nudge | Family::Throw, _) => 3,
    }
}

impl Known<'_> {
    fn made(&self, row: MapRow) -> u16 {
        match row {
            MapRow::Cruise(index) if self.evidence.cruise(index).is_lost() => u16::MAX,
            MapRow::Burst(family, index) if self.evidence.burst(family, index).is_lost() => u16::MAX,
            // In whole ones: a run that is cut short has fewer windows.
            MapRow::Cruise(index) => self.evidence.cruise(index).windows.count() / WINDOWS_OF_RUN,
            MapRow::Burst(family, index) => self.evidence.burst(family, index).turns.count(),
        }
    }

    /// Whether `row` is in the map, allowed and long enough to be measured.
    fn can_be_measured(&self, row: MapRow) -> bool {
        match row {
            MapRow::Cruise(index) => {
                self.prior.cruises().get(index).is_some_and(|cruise| cruise.amplitude <= self.amplitude_max)
            }
            MapRow::Burst(family, index) => self.prior.bursts(family).get(index).is_some_and(|burst| {
                let turn_rad = f32::from(train(family, burst)) * burst.turn_rad;
                burst.amplitude <= self.amplitude_max && turn_rad >= TRAIN_MIN_MDEG * RAD_PER_MDEG
            }),
        }
    }

    /// Rows of the cruises of `mode` in the first pass, the strongest first.
    fn first_cruises(&self, mode: DriveMode) -> [Option<MapRow>; 3] {
        let allowed = || {
            self.prior
                .cruises()
                .iter()
                .enumerate()
                .filter(move |(_, cruise)| cruise.mode == mode && cruise.amplitude <= self.amplitude_max)
        };
        let strongest = allowed().next_back().map(|(_, cruise)| cruise.amplitude);
        [1.0, 0.5, 0.75].map(|part| {
            let wanted = part * strongest?;
            let off = |amplitude: f32| (amplitude - wanted).abs();
            let nearest = allowed()
                .reduce(|best, row| if off(row.1.amplitude) < off(best.1.amplitude) { row } else { best })?;
            Some(MapRow::Cruise(nearest.0))
        })
    }

    /// Rows of the bursts of `family` in the first pass.
    fn first_bursts(&self, family: Family) -> [Option<MapRow>; 3] {
        let count = self.prior.bursts(family).len();
        let third = if is_fine(family) { 3 * count / 4 } else { count.saturating_sub(1) };
        [count / 2, count / 4, third].map(|index| Some(MapRow::Burst(family, index)))
    }

    fn is_due(&self, row: MapRow) -> bool {
        self.can_be_measured(row) && self.made(row) < runs(row)
    }

    /// What comes next.
    pub(super) fn next(&self) -> Next {
        let [clockwise, counter_clockwise] = self.unswept;
        if clockwise {
            return Next::Sweep(DriveMode::B);
        }
        if counter_clockwise {
            return Next::Sweep(DriveMode::C);
        }
        let findings = Findings::of(self.prior, self.evidence);
        let both = [DriveMode::B, DriveMode::C];
        let modes = || both.into_iter().filter(|mode| findings.is_of_use(*mode));
        let strongest_first =
            modes().filter_map(|mode| self.first_cruises(mode)[0]).find(|row| self.is_due(*row));
        // A rotor that full drive does not turn its way may be turned by a weaker one.
        let weaker_first = || {
            let others = both.into_iter().filter(|mode| !findings.is_of_use(*mode));
            let mut rows = others.flat_map(|mode| self.first_cruises(mode)).flatten();
            rows.find(|row| self.can_be_measured(*row) && self.made(*row) == 0)
        };
        let first = strongest_first.or_else(weaker_first).or_else(|| {
            let cruises = modes().flat_map(|mode| self.first_cruises(mode));
            let families = Family::ALL.into_iter().filter(|family| findings.is_of_use(family.mode()));
            let bursts = families.flat_map(|family| self.first_bursts(family));
            cruises.chain(bursts).flatten().find(|row| self.is_due(*row))
        });
        let next = first.or_else(|| {
            let factors = Measured { map: self.prior, evidence: self.evidence }.factors();
            let mut others = self.rows().filter(|row| self.contradicts_the_prior(&factors, *row));
            others.find(|row| {
                findings.is_of_use(self.mode(*row))
                    && self.can_be_measured(*row)
                    && self.made(*row) < CONTRADICTING_RUNS
            })
        });
        next.or_else(|| self.most_worth(&findings)).map_or(Next::Enough, Next::Row)
    }

    /// All rows of the map.
    fn rows(&self) -> impl Iterator<Item = MapRow> + '_ {
        let cruises = (0..self.prior.cruises().len()).map(MapRow::Cruise);
        let bursts = Family::ALL.into_iter().flat_map(|family| {
            (0..self.prior.bursts(family).len()).map(move |index| MapRow::Burst(family, index))
        });
        cruises.chain(bursts)
    }

    fn mode(&self, row: MapRow) -> DriveMode {
        match row {
            MapRow::Cruise(index) => {
                self.prior.cruises().get(index).map_or(DriveMode::B, |cruise| cruise.mode)
            }
            MapRow::Burst(family, _) => family.mode(),
        }
    }

    fn contradicts_the_prior(&self, factors: &MapFactors, row: MapRow) -> bool {
        match row {
            MapRow::Cruise(_) => factors.rates(self.mode(row)).contradicts_the_prior(),
            MapRow::Burst(family, _) => factors.turns(family).contradicts_the_prior(),
        }
    }

    /// The row whose next repeat saves most, if that is enough.
    fn most_worth(&self, findings: &Findings) -> Option<MapRow> {
        let now_s = self.expected_s(self.evidence);
        let mut best: Option<(MapRow, f32)> = None;
        for row in self.rows().filter(|row| self.can_be_measured(*row) && findings.is_of_use(self.mode(*row)))
        {
            if self.made(row) == 0 || self.made(row) >= REPEATS_MAX {
                continue;
            }
            let gain_s = now_s - self.expected_s(&self.with_another(row));
            if gain_s > best.map_or(GAIN_MIN_S, |(_, most_s)| most_s) {
                best = Some((row, gain_s));
            }
        }
        best.map(|(row, _)| row)
    }

    /// The evidence with one more run of `row` that shows what the runs before it did.
    fn with_another(&self, row: MapRow) -> CommissioningEvidence {
        let mut evidence = *self.evidence;
        match row {
            MapRow::Cruise(index) => {
                if let Some((found, cruise)) = evidence.cruise_mut(index).zip(self.prior.cruises().get(index))
                {
                    let windows = found.windows;
                    for _ in 0..windows.count() / found.runs.max(1) {
                        found.windows.add(windows.mean(), windows.noise());
                    }
                    let rate_rad_s = direction(cruise.mode) * cruise.rate_rad_s * windows.mean();
                    if let Some((coast_s, _)) = found.coasts.per_rate_s() {
                        found.coasts.add(rate_rad_s, coast_s * rate_rad_s, found.coasts.noise_rad2());
                    }
                }
            }
            MapRow::Burst(family, index) => {
                if let Some(found) = evidence.burst_mut(family, index) {
                    found.turns.add(found.turns.mean(), found.turns.noise());
                }
            }
        }
        evidence
    }

    /// Mean expected time in s of the moves, by the map that `evidence` makes.
    fn expected_s(&self, evidence: &CommissioningEvidence) -> f32 {
        let Ok(map) = commissioned_map(self.prior, evidence) else { return IMPOSSIBLE_S };
        let limits = Limits { amplitude_max: self.amplitude_max, ..Limits::default() };
        let tolerance_rad = TOLERANCE_MDEG * RAD_PER_MDEG;
        let of_move = |deg: f32| {
            let distance_rad = 1e3 * deg * RAD_PER_MDEG;
            MoveForecast::try_new(self.instruments, &map, &limits, distance_rad, tolerance_rad)
                .map_or(IMPOSSIBLE_S, |forecast| forecast.time_s)
        };
        MOVES_DEG.into_iter().map(of_move).sum::<f32>() / 8.0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn next(evidence: &CommissioningEvidence, unswept: [bool; 2]) -> Next {
        let instruments = Instruments::default();
        let prior = ResponseMap::table_1();
        Known { prior, evidence, unswept, amplitude_max: 1.0, instruments: &instruments }.next()
    }

    /// Measures what is asked for, with what the map says, until it is enough.
    fn measured(turn: impl Fn(MapRow, u16) -> f32) -> (CommissioningEvidence, Vec<MapRow>) {
        let map = ResponseMap::table_1();
        let (mut evidence, mut rows) = (CommissioningEvidence::default(), Vec::new());
        while let Next::Row(row) = next(&evidence, [false; 2]) {
            rows.push(row);
            assert!(rows.len() < 400, "it ends");
            match row {
                MapRow::Cruise(index) => {
                    let cruise = &map.cruises()[index];
                    let rate_rad_s = direction(cruise.mode) * cruise.rate_rad_s;
                    for window in 0..8 {
                        let turned_rad = 0.05 * rate_rad_s * turn(row, window);
                        evidence.add_window(index, cruise, turned_rad, 1e-8, 0.05);
                    }
                    let found = evidence.cruise_mut(index).unwrap();
                    found.runs += 1;
                    found.coasts.add(rate_rad_s, rate_rad_s * cruise.coast_s, 1e-9);
                }
                MapRow::Burst(family, index) => {
                    let found = evidence.burst_mut(family, index).unwrap();
                    found.train = train(family, &map.bursts(family)[index]);
                    found.turns.add(turn(row, 0), 1e-4);
                }
            }
        }
        (evidence, rows)
    }

    #[test]
    fn exact_the_resonances_come_first_and_then_the_strongest_drives() {
        let evidence = CommissioningEvidence::default();
        assert_eq!(next(&evidence, [true, true]), Next::Sweep(DriveMode::B));
        assert_eq!(next(&evidence, [false, true]), Next::Sweep(DriveMode::C));
        assert_eq!(next(&evidence, [false, false]), Next::Row(MapRow::Cruise(7)));
    }

    /// A motor like the map's is known after a few rows of each table; a mode that is dead costs its first drives
    /// alone.
    #[test]
    fn law_an_ordinary_motor_needs_little_and_a_dead_mode_next_to_nothing() {
        let ripple = |window: u16| 1.0 + 0.1 * [1.0, -1.0, 0.5, -0.5][usize::from(window % 4)];
        let (_, rows) = measured(|_, window| ripple(window));
        assert!((30..70).contains(&rows.len()), "{}", rows.len());
        let is_b = |row: &MapRow| match row {
            MapRow::Cruise(index) => *index < 8,
            MapRow::Burst(family, _) => family.mode() == DriveMode::B,
        };
        let (_, rows) = measured(|row, window| if is_b(&row) { 0.0 } else { ripple(window) });
        assert_eq!(rows.iter().filter(|row| is_b(row)).count(), 3, "{rows:?}");
    }

    /// Rates of another shape in mode B: all of its cruises are measured.
    #[test]
    fn law_another_shape_is_measured_row_by_row() {
        let half = |row, window: u16| {
            let ripple = 0.1 * [1.0, -1.0, 0.5, -0.5][usize::from(window % 4)];
            match row {
                MapRow::Cruise(index) if index < 8 => {
                    [2.5, 0.8, 0.5, 0.3, 0.2, 0.1, 0.08, 0.06][index] * (1.0 + ripple)
                }
                _ => 1.0 + ripple,
            }
        };
        let (evidence, _) = measured(half);
        let runs: [u16; 8] = core::array::from_fn(|index| evidence.cruise(index).runs);
        assert!(runs.iter().all(|runs| *runs >= 2), "{runs:?}");
    }

    /// A rotor that mode B turns at a twentieth of the map's rate, fastest at 0.4 of full drive and now and then back
    /// above it, as one drawn about set G does. By three rows, whose windows lie far apart, no test of the shape tells:
    /// the level does. All of its cruises are measured, and the strongest of its map is the fastest.
    #[test]
    fn law_a_level_that_is_not_the_prior_s_is_measured_row_by_row() {
        let level = [1.92, 1.16, 0.32, 0.13, 0.013, 0.024, 0.023, 0.028];
        let scatter = |window: u16| [1.0, -1.0, 0.5, -0.5][usize::from(window % 4)];
        let turn = |row, window: u16| match row {
            MapRow::Cruise(index) if index < 8 => level[index] + 0.3 * scatter(window),
            _ => 1.0 + 0.1 * scatter(window),
        };
        let (evidence, _) = measured(turn);
        let runs: [u16; 8] = core::array::from_fn(|index| evidence.cruise(index).runs);
        assert!(runs.iter().all(|runs| *runs >= CONTRADICTING_RUNS), "{runs:?}");
        let map = commissioned_map(ResponseMap::table_1(), &evidence).unwrap();
        let fastest = map.strongest_cruise(DriveMode::B, 1.0).unwrap();
        assert!((fastest.amplitude - 0.4).abs() < 1e-6, "{fastest:?}");
    }

    /// Two runs of the strongest cruise that lose the estimate are enough: the next drive is another, and the map is
    /// without its row.
    #[test]
    fn exact_a_cruise_that_loses_the_estimate_is_given_up() {
        let mut evidence = CommissioningEvidence::default();
        evidence.cruise_mut(7).unwrap().unseen = 1;
        assert_eq!(next(&evidence, [false; 2]), Next::Row(MapRow::Cruise(7)));
        evidence.cruise_mut(7).unwrap().unseen = 2;
        assert_ne!(next(&evidence, [false; 2]), Next::Row(MapRow::Cruise(7)));
        let map = commissioned_map(ResponseMap::table_1(), &evidence).unwrap();
        assert_eq!(map.cruises_of(DriveMode::B).len(), 7);
    }

    #[test]
    fn exact_fine_bursts_come_in_trains() {
        let steps = ResponseMap::table_1().bursts(Family::Step);
        assert_eq!([0, 7, 9, 12].map(|index| train(Family::Step, &steps[index])), [8, 8, 7, 4]);
        assert_eq!(train(Family::Nudge, &ResponseMap::table_1().bursts(Family::Nudge)[0]), 1);
    }
}
