//! What a motor does that the authors of the prior map did not foresee, each told by a test.
//!
//! Ten tests are made of a motor, five of each mode. Each is false with a probability of at most [`FALSE_EACH`] in a
//! motor that has nothing of the kind, so that of 100 such motors at most one is told anything (Bonferroni).
//!
//! | told | when, of cruises that turn every motor of the prior map (of all cruises: fastest below full drive) |
//! |---|---|
//! | slow | the upper limit of the rate of the strongest one is below [`SLOW_PART`] of the map's |
//! | dead | the same, and no more windows go forwards, less those backwards, than [`ODD_PART`] of all explains |
//! | turns the other way | the upper limit of that rate is below zero |
//! | none of these three | a weaker one, of all cruises, turns the rotor for certain and is not slow |
//! | fastest below full drive | a weaker one is faster than the strongest, by Student's t over all weaker ones |
//! | turns back | more windows go backwards than [`ODD_PART`] of all explains, by the binomial law over all rows |
//! | sticks | the same of windows without a turn, where none goes backwards |
//! | is lost | the same of cruises that turn the rotor and end with the loss of the estimate |
//!
//! The test of lost cruises is not among the ten: of the motors of the prior map none loses the estimate.
//!
//! Windows of 50 ms of one run are correlated in mode B; they count as half as many ([`super::map_factors`]).

use motor_model::{DriveMode, math};

use super::evidence::CommissioningEvidence;
use super::map_factors::{WINDOWS_PER_INDEPENDENT, rate_variance};
use super::quantiles;
use super::repeats::EXPECTED_REPEATS;
use crate::response_map::{Cruise, ResponseMap, direction};

/// Probability of a false finding in a motor that has none.
pub const FALSE_OF_A_MOTOR: f32 = 0.01;
/// The same of one test.
const FALSE_EACH: f32 = FALSE_OF_A_MOTOR / 10.0;
/// Part of the map's rate below which a mode counts as slow, or as dead if it does not turn the rotor for certain. An
/// assumption.
const SLOW_PART: f32 = 0.02;
/// Windows from which on a rate is judged: those of one run.
const WINDOWS_MIN: u16 = 8;
/// Part of the windows that may be odd in a motor that neither turns back nor sticks. An assumption: impacts are
/// chaotic.
const ODD_PART: f64 = 0.02;

/// Something unforeseen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FindingKind {
    /// The mode does not turn the rotor.
    Dead,
    /// The mode turns the rotor, but hardly.
    Slow {
        /// Rate of its strongest drive, per rate of the map's.
        part: f32,
    },
    /// The mode turns the rotor in the direction of the other.
    OtherWay,
    /// A weaker drive turns the rotor faster than the strongest.
    FastestBelowFull {
        /// The amplitude of the fastest drive that was measured.
        amplitude: f32,
    },
    /// The rotor turns back at times.
    TurnsBack {
        /// Amplitude of the drive in which it does so most.
        amplitude: f32,
        /// Part of its windows in which it does, 0 to 1.
        part: f32,
    },
    /// The rotor stands still at times.
    Sticks {
        /// Amplitude of the drive in which it does so most.
        amplitude: f32,
        /// Part of its windows in which it does, 0 to 1.
        part: f32,
    },
    /// The estimate is lost while the mode drives: the rotor sticks or jumps, or turns as no model foresees.
    Lost {
        /// Part of its cruises that end so, 0 to 1.
        part: f32,
    },
}

/// Something unforeseen of a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The mode.
    pub mode: DriveMode,
    /// What.
    pub kind: FindingKind,
}

/// What was found of a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Findings {
    of: [[Option<Finding>; 4]; 2],
}

impl Findings {
    /// All, mode B first.
    pub fn iter(&self) -> impl Iterator<Item = &Finding> {
        self.of.iter().flatten().flatten()
    }

    /// Whether `mode` moves the rotor its own way.
    pub fn is_of_use(&self, mode: DriveMode) -> bool {
        !self.iter().any(|finding| {
            finding.mode == mode && matches!(finding.kind, FindingKind::Dead | FindingKind::OtherWay)
        })
    }

    /// Whether `mode` moves the rotor its own way, and no less than a fiftieth as fast as the map foresees.
    pub fn is_fast(&self, mode: DriveMode) -> bool {
        let is_slow = |kind| matches!(kind, FindingKind::Slow { .. });
        self.is_of_use(mode) && !self.iter().any(|finding| finding.mode == mode && is_slow(finding.kind))
    }

    /// A mode that seems dead, and of which cruises turned the rotor and lost the estimate: the windows that are left
    /// are those in which the rotor stuck.
    pub(crate) fn dead_by_losses(&self) -> Option<DriveMode> {
        let is_loss = |kind| matches!(kind, FindingKind::Lost { .. });
        let is_lost = |mode| self.iter().any(|finding| finding.mode == mode && is_loss(finding.kind));
        let dead = self.iter().find(|finding| finding.kind == FindingKind::Dead && is_lost(finding.mode));
        dead.map(|finding| finding.mode)
    }

    /// What `evidence`, in units of the rows of `prior`, shows.
    pub fn of(prior: &ResponseMap, evidence: &CommissioningEvidence) -> Self {
        Self {
            of: [DriveMode::B, DriveMode::C].map(|mode| {
                let rows = RowsOfMode { prior, evidence, mode };
                let strongest = rows.strongest_row();
                let is_of_use = !matches!(strongest, Some(FindingKind::Dead | FindingKind::OtherWay));
                let is_slow = matches!(strongest, Some(FindingKind::Slow { .. }));
                let fastest = if is_of_use { rows.fastest_below_full() } else { None };
                let odd = if is_of_use { rows.odd_windows(is_slow) } else { None };
                [strongest, fastest, odd, rows.lost()].map(|kind| kind.map(|kind| Finding { mode, kind }))
            }),
        }
    }
}

/// The cruises of a mode that turn every motor of the prior map, with what was measured.
struct RowsOfMode<'a> {
    prior: &'a ResponseMap,
    evidence: &'a CommissioningEvidence,
    mode: DriveMode,
}

/// The rate of a cruise, in its mode's direction.
#[derive(Clone, Copy)]
struct Rate {
    amplitude: f32,
    turns_every_motor: bool,
    mapped_rad_s: f32,
    mean_rad_s: f32,
    variance: f32,
    freedom: f32,
    windows: u16,
    forward: u16,
    backward: u16,
    still: u16,
}

impl Rate {
    /// Standard deviations of Student's t, times those of the mean.
    fn margin_rad_s(&self, outside: f32) -> f32 {
        quantiles::student(self.freedom, outside) * math::sqrt_f32(self.variance)
    }

    /// Probability by which `odd` windows of all are explained, where [`ODD_PART`] of them is. Two windows that follow
    /// one another may be odd for one reason.
    fn chance(&self, odd: u16) -> f64 {
        quantiles::binomial_tail(self.windows / 2, odd / 2, ODD_PART)
    }

    /// What fails of it.
    fn failure(&self) -> Option<FindingKind> {
        let slow_rad_s = SLOW_PART * self.mapped_rad_s;
        // The scatter of a rotor at rest is that of the measurement, which the ripple of a turning one exceeds.
        let all_still = self.still == self.windows && self.mean_rad_s < slow_rad_s;
        let upper_rad_s = self.mean_rad_s + self.margin_rad_s(FALSE_EACH);
        if upper_rad_s < 0.0 {
            Some(FindingKind::OtherWay)
        } else if !all_still && upper_rad_s >= slow_rad_s {
            None
        } else if self.turns_for_certain() {
            Some(FindingKind::Slow { part: self.mean_rad_s / self.mapped_rad_s })
        } else {
            Some(FindingKind::Dead)
        }
    }

    /// Whether the rotor turns, however slowly: by the windows in which it is seen to.
    fn turns_for_certain(&self) -> bool {
        self.mean_rad_s > 0.0 && self.chance(self.forward.saturating_sub(self.backward)) < FALSE_EACH.into()
    }
}

impl RowsOfMode<'_> {
    /// Of the cruises that turn every motor of the prior map.
    fn rates(&self) -> impl Iterator<Item = Rate> + '_ {
        self.all_rates().filter(|rate| rate.turns_every_motor)
    }

    fn all_rates(&self) -> impl Iterator<Item = Rate> + '_ {
        let of_mode = |(_, cruise): &(usize, &Cruise)| cruise.mode == self.mode;
        self.prior.cruises().iter().enumerate().filter(of_mode).filter_map(|(index, cruise)| {
            let found = self.evidence.cruise(index);
            let mapped_rad_s = direction(self.mode) * cruise.rate_rad_s;
            let variance = rate_variance(&found.windows)?;
            Some(Rate {
                amplitude: cruise.amplitude,
                turns_every_motor: cruise.turns_every_motor(),
                mapped_rad_s,
                mean_rad_s: mapped_rad_s * found.windows.mean(),
                variance: variance * mapped_rad_s * mapped_rad_s,
                freedom: found.windows.freedom() / WINDOWS_PER_INDEPENDENT + EXPECTED_REPEATS,
                windows: found.windows.count(),
                forward: found.forward,
                backward: found.backward,
                still: found.still,
            })
        })
    }

    fn strongest(&self) -> Option<Rate> {
        self.rates().last().filter(|rate| rate.windows >= WINDOWS_MIN)
    }

    /// What fails of the strongest drive, unless a weaker one turns the rotor well.
    fn strongest_row(&self) -> Option<FindingKind> {
        let strongest = self.strongest()?;
        let turns_well = |rate: &Rate| rate.failure().is_none() && rate.turns_for_certain();
        let mut weaker = self.weaker_than(&strongest);
        strongest.failure().filter(|_| !weaker.any(|rate| turns_well(&rate)))
    }

    /// The cruises below `strongest` of which there are windows enough.
    fn weaker_than(&self, strongest: &Rate) -> impl Iterator<Item = Rate> + '_ {
        let below = strongest.amplitude;
        self.all_rates().filter(move |rate| rate.windows >= WINDOWS_MIN && rate.amplitude < below)
    }

    fn fastest_below_full(&self) -> Option<FindingKind> {
        let strongest = self.strongest()?;
        let weaker = || self.weaker_than(&strongest);
        let tests = u16::try_from(weaker().count()).unwrap_or(u16::MAX).max(1);
        let faster = |rate: &Rate| {
            let difference = Rate {
                variance: rate.variance + strongest.variance,
                freedom: rate.freedom.min(strongest.freedom),
                ..*rate
            };
            rate.mean_rad_s - strongest.mean_rad_s > difference.margin_rad_s(FALSE_EACH / f32::from(tests))
        };
        let fastest = weaker()
            .filter(faster)
            .reduce(|best, rate| if rate.mean_rad_s > best.mean_rad_s { rate } else { best })?;
        Some(FindingKind::FastestBelowFull { amplitude: fastest.amplitude })
    }

    /// Whether the estimate is lost in more cruises, of all drives of the mode, than is explained.
    fn lost(&self) -> Option<FindingKind> {
        let of_mode = self.prior.cruises().iter().enumerate().filter(|(_, cruise)| cruise.mode == self.mode);
        let (runs, lost) = of_mode.fold((0_u16, 0_u16), |(runs, lost), (index, _)| {
            let found = self.evidence.cruise(index);
            let [runs, lost] = [runs, lost].map(|sum| sum.saturating_add(found.unseen));
            (runs.saturating_add(found.runs), lost.saturating_add(found.lost))
        });
        let part = || f32::from(lost) / f32::from(runs);
        let is_odd = lost > 0 && quantiles::binomial_tail(runs, lost, ODD_PART) < FALSE_EACH.into();
        is_odd.then(|| FindingKind::Lost { part: part() })
    }

    /// The windows of a slow mode are all still in units of the map: that it sticks is not told.
    fn odd_windows(&self, is_slow: bool) -> Option<FindingKind> {
        let rows = u16::try_from(self.rates().count()).unwrap_or(u16::MAX).max(1);
        let odd = |of: fn(&Rate) -> u16| {
            let is_odd = |rate: &Rate| rate.chance(of(rate)) < f64::from(FALSE_EACH) / f64::from(rows);
            let part = |rate: Rate| (rate.amplitude, f32::from(of(&rate)) / f32::from(rate.windows));
            self.rates().filter(is_odd).map(part).reduce(|most, row| if row.1 > most.1 { row } else { most })
        };
        let backward = odd(|rate| rate.backward);
        let backward = backward.map(|(amplitude, part)| FindingKind::TurnsBack { amplitude, part });
        let still = || if is_slow { None } else { odd(|rate| rate.still) };
        backward.or_else(|| still().map(|(amplitude, part)| FindingKind::Sticks { amplitude, part }))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn map() -> &'static ResponseMap {
        ResponseMap::table_1()
    }

    /// Windows of 50 ms of the cruises of `mode` at full, half and three quarters of the drive, with a turn per that of
    /// the map that `of` gives for the amplitude and the window's number.
    fn found(mode: DriveMode, windows: u16, of: impl Fn(f32, u16) -> f32) -> Vec<FindingKind> {
        found_with_noise(1e-9, mode, windows, of)
    }

    /// The same under a camera that leaves the variance `noise_rad2` of each turn.
    fn found_with_noise(
        noise_rad2: f32,
        mode: DriveMode,
        windows: u16,
        of: impl Fn(f32, u16) -> f32,
    ) -> Vec<FindingKind> {
        let mut evidence = CommissioningEvidence::default();
        for (index, cruise) in map().cruises().iter().enumerate().filter(|(_, cruise)| cruise.mode == mode) {
            if [0.5, 0.7, 0.8, 1.0].iter().any(|at| (cruise.amplitude - at).abs() < 1e-3) {
                let mapped_rad = direction(mode) * cruise.rate_rad_s * 0.05;
                for window in 0..windows {
                    let turned_rad = mapped_rad * of(cruise.amplitude, window);
                    evidence.add_window(index, cruise, turned_rad, noise_rad2, 0.05);
                }
            }
        }
        Findings::of(map(), &evidence).iter().map(|finding| finding.kind).collect()
    }

    /// A ripple of 20 % from window to window.
    fn ripple(window: u16) -> f32 {
        0.2 * [1.0, -1.0, 0.5, -0.5][usize::from(window % 4)]
    }

    #[test]
    fn law_a_motor_of_the_map_has_no_findings() {
        for mode in [DriveMode::B, DriveMode::C] {
            for level in [0.6, 1.0, 1.4] {
                assert_eq!(found(mode, 16, |_, window| level + ripple(window)), [], "{mode:?} {level}");
            }
        }
    }

    #[test]
    fn exact_each_finding() {
        let mode = DriveMode::B;
        assert_eq!(found(mode, 16, |_, _| 0.0), [FindingKind::Dead]);
        assert_eq!(found(mode, 16, |_, window| -0.8 + ripple(window)), [FindingKind::OtherWay]);
        let slow = found(mode, 16, |_, window| 0.007 * (1.0 + ripple(window)));
        assert!(
            matches!(slow[..], [FindingKind::Slow { part }] if (0.006..0.008).contains(&part)),
            "{slow:?}"
        );
        // A third of the rate at full drive, and the whole at half drive: 5.0 and 5.6 rad/s.
        let half = |amplitude: f32, window| if amplitude > 0.9 { 0.2 } else { 1.0 } * (1.0 + ripple(window));
        assert!(matches!(found(mode, 16, half)[..], [FindingKind::FastestBelowFull { .. }]));
        let back = |_, window| if window % 3 == 0 { -0.3 } else { 1.0 + ripple(window) };
        assert!(matches!(found(mode, 32, back)[..], [FindingKind::TurnsBack { part, .. }] if part > 0.3));
        let sticks = |_, window| if window % 4 == 0 { 0.0 } else { 1.0 + ripple(window) };
        assert!(matches!(found(mode, 32, sticks)[..], [FindingKind::Sticks { part, .. }] if part > 0.2));
    }

    /// Full drive turns the rotor back, and weaker ones turn it as they should: the mode is of use, below full drive.
    #[test]
    fn exact_a_mode_that_turns_back_at_full_drive_is_of_use_below_it() {
        let full_back =
            |amplitude: f32, window| if amplitude > 0.9 { -0.1 } else { 1.0 } * (1.0 + ripple(window));
        let kinds = found(DriveMode::B, 16, full_back);
        assert!(kinds.iter().any(|kind| matches!(kind, FindingKind::FastestBelowFull { .. })), "{kinds:?}");
        let fails = |kind: &FindingKind| matches!(kind, FindingKind::OtherWay | FindingKind::Dead);
        assert!(!kinds.iter().any(fails), "{kinds:?}");
        // One window in eight forwards is no turn.
        let stuck = |amplitude: f32, window: u16| {
            if amplitude > 0.9 {
                -0.1 * (1.0 + ripple(window))
            } else {
                f32::from(u16::from(window.is_multiple_of(8)))
            }
        };
        assert!(found(DriveMode::B, 16, stuck).contains(&FindingKind::OtherWay));
    }

    /// A camera of 0.03 rad, 5 % of the map's turn in mode B: the upper limit of the rate of a rotor at rest exceeds
    /// that of a dead mode, but no window shows a turn.
    #[test]
    fn exact_a_dead_mode_is_told_by_a_noisy_camera() {
        let still = |_, window: u16| 0.01 * (f32::from(window % 3) - 1.0);
        assert_eq!(found_with_noise(9e-4, DriveMode::B, 8, still), [FindingKind::Dead]);
    }

    /// Neighbouring windows are odd for one reason: five of 16 in a row count as two of eight, which come by chance
    /// once in a hundred times. Ten are told.
    #[test]
    fn exact_neighbouring_odd_windows_count_half() {
        let back = |last| move |_, window| if window < last { -0.5 } else { 1.0 + ripple(window) };
        assert_eq!(found(DriveMode::B, 16, back(5)), []);
        assert!(matches!(found(DriveMode::B, 16, back(10))[..], [FindingKind::TurnsBack { .. }, ..]));
    }

    /// Cruises that end with the loss of the estimate: one of six happens to one motor in nine, three to one in 6,000.
    #[test]
    fn exact_cruises_that_lose_the_estimate_are_told() {
        for (lost, unseen, is_told) in
            [(0, 0, false), (1, 0, false), (0, 1, false), (3, 0, true), (1, 2, true)]
        {
            let mut evidence = CommissioningEvidence::default();
            let found = evidence.cruise_mut(7).unwrap();
            (found.runs, found.lost, found.unseen) = (6 - unseen, lost, unseen);
            let of = Findings::of(map(), &evidence);
            let told = of.iter().next().map(|finding| finding.kind);
            let expected = is_told.then_some(FindingKind::Lost { part: 0.5 });
            assert_eq!(told, expected, "{lost} {unseen}");
        }
    }

    /// One odd window of 16, at any place, is told of no motor.
    #[test]
    fn law_a_single_odd_window_tells_nothing() {
        for odd in [-0.5, 0.0] {
            let of = |_, window| if window == 3 { odd } else { 1.0 + ripple(window) };
            assert_eq!(found(DriveMode::C, 16, of), []);
        }
    }
}
