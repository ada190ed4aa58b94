//! The report on moves under other instruments.

use super::{CHOSEN, GridMove, GridOutcome, InstrumentGrid};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;

impl InstrumentGrid {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let benches = self.benches().iter().filter(|(_, filter)| *filter == CHOSEN).count();
        let motor_s = self.moves.iter().map(|made| made.time_s).sum();
        StudyReport {
            title: "Moves under other instruments".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("benches", benches.to_string()),
                ("moves", self.moves.len().to_string()),
                ("tolerance of a move", "the finest that was promised before it".to_owned()),
            ],
            pictures: vec![("instruments.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.key_figures(),
            sure: vec![
                "Each bench has the same motors and targets. The truth is known because this is a \
                 simulation."
                    .to_owned(),
            ],
            motor_s: Some(motor_s),
        }
    }

    /// Over all benches, and of each: the moves that were held as on target while off it, and those on target.
    fn key_figures(&self) -> Vec<KeyFigure> {
        let chosen = || self.moves.iter().filter(|made| made.filter == CHOSEN);
        let mut figures = of_moves("all benches", &chosen().collect::<Vec<_>>()).to_vec();
        for (bench, _) in self.benches().into_iter().filter(|(_, filter)| *filter == CHOSEN) {
            let moves: Vec<&GridMove> = chosen().filter(|made| made.bench == bench).collect();
            figures.extend(of_moves(bench, &moves));
        }
        figures
    }
}

fn of_moves(bench: &str, moves: &[&GridMove]) -> [KeyFigure; 2] {
    let count = |name, outcome| KeyFigure::count(name, moves.iter().map(|made| made.outcome == outcome));
    [
        count("moves on target", GridOutcome::Reached).higher_is_better(),
        count("moves held as on target, but off it", GridOutcome::Wrong).lower_is_better(),
    ]
    .map(|figure| figure.of(bench).of_runs(moves.iter().map(|made| made.number)))
}
