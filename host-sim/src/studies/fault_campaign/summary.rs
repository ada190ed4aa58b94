//! The counts of some runs.

use serde::Serialize;

use super::{FaultCampaign, FaultRun};
use simulation::runs::position::MoveEnding;

/// A rotor has run away from so many degrees beside its way on: it coasts no further from 1000 deg/s, which takes some
/// 20 ms to fade.
pub(super) const RUNAWAY_DEG: f64 = 20.0;

/// Counts of some runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultSummary {
    /// Which runs.
    pub of: String,
    /// Runs.
    pub runs: usize,
    /// On target, rightly.
    pub reached: usize,
    /// Ended with a reason.
    pub gave_up: usize,
    /// Ended by the deadline.
    pub timed_out: usize,
    /// On target, wrongly.
    pub wrong: usize,
    /// With an estimate that was called good and was wrong, for longer and by more than [`super::run`] says.
    pub unaware: usize,
    /// The most time for which one was in a run, in s.
    pub unaware_s: f64,
    /// The largest error of one.
    pub unaware_mdeg: f64,
    /// With a rotor that ran away.
    pub runaways: usize,
}

impl FaultRun {
    /// Whether the rotor ran away.
    pub fn ran_away(&self) -> bool {
        self.excursion_deg > RUNAWAY_DEG
    }

    /// Whether an estimate was called good and was wrong.
    pub fn was_unaware(&self) -> bool {
        self.unaware_mdeg > 0.0
    }

    /// Whether the word of one of its faults begins with `word`, whatever the number of the mark.
    pub fn has(&self, word: &str) -> bool {
        self.faults.split(' ').map(unmarked).any(|fault| {
            fault.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with([':', '@']))
        })
    }
}

/// The word of a fault without the number of a mark.
pub(super) fn unmarked(fault: &str) -> String {
    match fault.strip_prefix("mark") {
        Some(rest) => format!("mark{}", rest.trim_start_matches(|c: char| c.is_ascii_digit())),
        None => fault.to_owned(),
    }
}

impl FaultSummary {
    /// The counts of `runs`.
    pub fn of<'a>(of: &str, runs: impl Iterator<Item = &'a FaultRun>) -> Self {
        let runs: Vec<&FaultRun> = runs.collect();
        let count = |is: &dyn Fn(&FaultRun) -> bool| runs.iter().filter(|run| is(run)).count();
        let ended = |ending| count(&|run| run.ending == ending);
        let largest = |of: fn(&FaultRun) -> f64| runs.iter().map(|run| of(run)).fold(0.0, f64::max);
        Self {
            of: of.to_owned(),
            runs: runs.len(),
            reached: ended(MoveEnding::Reached),
            gave_up: ended(MoveEnding::GaveUp),
            timed_out: ended(MoveEnding::TimedOut),
            wrong: ended(MoveEnding::Wrong),
            unaware: count(&FaultRun::was_unaware),
            unaware_s: largest(|run| run.unaware_s),
            unaware_mdeg: largest(|run| run.unaware_mdeg),
            runaways: count(&FaultRun::ran_away),
        }
    }
}

impl FaultCampaign {
    /// The counts of all runs.
    pub fn summary(&self) -> FaultSummary {
        FaultSummary::of("all", self.runs.iter())
    }

    /// The counts of the runs that each value of `of` shares, in the order in which the values come.
    pub(super) fn by(&self, of: impl Fn(&FaultRun) -> &str) -> Vec<FaultSummary> {
        let alike = self.alike(of).into_iter();
        alike.map(|(value, runs)| FaultSummary::of(value, runs.into_iter())).collect()
    }

    /// The runs that each value of `of` shares, in the order in which the values come.
    pub(super) fn alike(&self, of: impl Fn(&FaultRun) -> &str) -> Vec<(&str, Vec<&FaultRun>)> {
        let mut alike: Vec<(&str, Vec<&FaultRun>)> = Vec::new();
        for run in &self.runs {
            match alike.iter_mut().find(|(value, _)| *value == of(run)) {
                Some((_, runs)) => runs.push(run),
                None => alike.push((of(run), vec![run])),
            }
        }
        alike
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn run(faults: &str, ending: MoveEnding, unaware_mdeg: f64) -> FaultRun {
        FaultRun {
            number: 0,
            scene: "as asked".to_owned(),
            seed: 3,
            filter: "twin".to_owned(),
            target_deg: 90.0,
            faults: faults.to_owned(),
            ending,
            reason: String::new(),
            error_mdeg: 0.2,
            time_s: 1.0,
            unaware_s: 1e-5 * unaware_mdeg,
            unaware_mdeg,
            excursion_deg: 0.2 * unaware_mdeg,
        }
    }

    #[test]
    fn exact_counts_and_words() {
        let runs = [
            run("camera:lost@0.1..0.2", MoveEnding::Reached, 0.0),
            run("mark2:lost@0.1.. ldv:lost@0.2..", MoveEnding::Wrong, 200.0),
            run("ldv:lost", MoveEnding::GaveUp, 60.0),
            run("drive:weak:0.3@1", MoveEnding::TimedOut, 0.0),
        ];
        let summary = FaultSummary::of("all", runs.iter());
        let counts = [summary.runs, summary.reached, summary.wrong, summary.gave_up, summary.timed_out];
        assert_eq!(counts, [4, 1, 1, 1, 1]);
        assert_eq!((summary.unaware, summary.runaways), (2, 1));
        assert!((summary.unaware_mdeg - 200.0).abs() < 1e-9);
        let with = |word: &str| runs.iter().filter(|run| run.has(word)).count();
        let words = ["ldv:lost", "mark:lost", "camera:lost", "drive:weak", "camera:los", "mark2:lost"];
        assert_eq!(words.map(with), [2, 1, 1, 1, 0, 0]);
    }
}
