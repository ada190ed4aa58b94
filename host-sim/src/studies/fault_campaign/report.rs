//! The report on moves during which something went wrong.

use super::tables::ABOUT;
use super::{FaultCampaign, FaultRun};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;
use simulation::runs::position::MoveEnding;

impl FaultCampaign {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        StudyReport {
            title: "Moves during which something goes wrong".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("moves", self.runs.len().to_string()),
                ("faults", "one or two in each, of random kind, time and severity".to_owned()),
            ],
            pictures: vec![("faults.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.key_figures(),
            sure: vec![
                "The intervals are of the moves that might have been drawn. Faults of other kinds, and three at once, \
                 are not drawn."
                    .to_owned(),
                ABOUT.to_owned(),
            ],
            motor_s: Some(self.runs.iter().map(|run| run.time_s).sum()),
        }
    }

    /// Over all runs, and of each filter and scene.
    fn key_figures(&self) -> Vec<KeyFigure> {
        let mut figures = of_runs("all", &self.runs.iter().collect::<Vec<_>>()).to_vec();
        let scenes = self.alike(|run| &run.scene);
        let filters = self.alike(|run| &run.filter);
        for (of, runs) in filters.iter().chain(scenes.iter().filter(|_| scenes.len() > 1)) {
            figures.extend(of_runs(&of.replace('_', " "), runs));
        }
        figures
    }
}

fn of_runs(of: &str, runs: &[&FaultRun]) -> [KeyFigure; 5] {
    let count = |name, holds: &dyn Fn(&FaultRun) -> bool| {
        KeyFigure::count(name, runs.iter().map(|run| holds(run))).lower_is_better()
    };
    let ended = |name, ending| count(name, &|run| run.ending == ending);
    [
        ended("moves on target", MoveEnding::Reached).higher_is_better(),
        ended("moves held as on target, but off it", MoveEnding::Wrong),
        ended("moves ended by the deadline", MoveEnding::TimedOut),
        count("runs with an estimate called good that was wrong for 10 ms in all", &FaultRun::was_unaware),
        count("rotors that ran away", &FaultRun::ran_away),
    ]
    .map(|figure| figure.of(of).of_runs(runs.iter().map(|run| run.number)))
}
