//! The report on moves during which something went wrong.

use super::tables::ABOUT;
use super::{FaultCampaign, FaultSummary};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;

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
        let mut figures = of_runs("all", &self.summary());
        let scenes = self.by(|run| &run.scene);
        for summary in self.by(|run| &run.filter).iter().chain(scenes.iter().filter(|_| scenes.len() > 1)) {
            figures.extend(of_runs(&summary.of.replace('_', " "), summary));
        }
        figures
    }
}

fn of_runs(of: &str, summary: &FaultSummary) -> Vec<KeyFigure> {
    let count = |name, value| KeyFigure::count(name, value, summary.runs).of(of).lower_is_better();
    vec![
        KeyFigure::count("moves on target", summary.reached, summary.runs).of(of).higher_is_better(),
        count("moves held as on target, but off it", summary.wrong),
        count("moves ended by the deadline", summary.timed_out),
        count("runs with an estimate called good that was wrong", summary.false_valid),
        count("rotors that ran away", summary.runaways),
    ]
}
