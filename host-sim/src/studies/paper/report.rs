//! The report on the paper's figures, simulated again, and on the rotors that tilt beside them.

use super::reproduction::{FigureRow, PaperReproduction};
use crate::report::chart::Figure;
use crate::report::document::Document;
use crate::report::key_figure::{KeyFigure, Measured};
use crate::studies::study_report::StudyReport;

impl PaperReproduction {
    /// The report: beside the paper's figures the document on the rotors that tilt, of which `drawn` were drawn, and
    /// the `pictures` of both.
    pub(crate) fn report(
        &self,
        (others, drawn): (Document, usize),
        pictures: Vec<(String, Figure)>,
    ) -> StudyReport {
        let paper = self.document();
        StudyReport {
            title: "The paper's figures, simulated again".to_owned(),
            verdict: self.summary(),
            asked: vec![
                ("runs of each motor", self.seeds.to_string()),
                ("rotors drawn over what was not measured", drawn.to_string()),
            ],
            pictures,
            document: Document { blocks: [paper.blocks, others.blocks].concat() },
            key_figures: self.rows.iter().map(|row| row.key_figure(self.seeds)).collect(),
            sure: vec![
                "Each +- in the tables is one standard deviation over the runs. The intervals are of the mean of our \
                 runs; the paper made five of each, and prints their mean and their deviation."
                    .to_owned(),
            ],
            motor_s: None,
        }
    }
}

impl FigureRow {
    fn key_figure(&self, runs: u64) -> KeyFigure {
        let mut figure = KeyFigure::single(&self.quantity.to_string(), self.unit, 0.0);
        let ours = self.comparison.ours;
        figure.measured = Measured::Mean { value: ours.mean, sd: ours.sd, runs };
        figure.of(format!("{}: {}", self.place, self.case))
    }
}
