//! The report on the cost and the error of a step.

use super::comparison::StepAccuracy;
use crate::report::key_figure::{KeyFigure, Measured};
use crate::studies::study_report::StudyReport;
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::steady_motion::{CONDITIONS, DriveCondition, SteadyErrors};

impl StepAccuracy {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let targets = self.target_results();
        let met = targets.iter().filter(|target| target.met).count();
        StudyReport {
            title: "What a simulated millisecond costs, and how far off it is".to_owned(),
            verdict: format!("{met} of {} targets for error and cost are met.", targets.len()),
            asked: vec![
                ("motor", "nominal, Coulomb friction".to_owned()),
                ("methods", format!("{} combinations of rule, precision and step", self.rows.len())),
                ("reference", "an event-driven integrator".to_owned()),
            ],
            pictures: vec![("accuracy.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.rows.iter().flat_map(key_figures).collect(),
            sure: vec![
                "Errors of steady motion are means over independent runs, with intervals of two standard errors. Times \
                 are the least of several batches on this machine, and differ from run to run."
                    .to_owned(),
            ],
            motor_s: None,
        }
    }
}

/// The error of the mean rate under each condition.
fn key_figures(row: &MethodRow) -> Vec<KeyFigure> {
    let method = format!(
        "{}, {}, {} us",
        row.method.impacts().replace('_', " "),
        row.method.precision.name(),
        (1e9 * row.method.step_s).round() / 1e3
    );
    let of = |(condition, errors): (String, &SteadyErrors)| {
        let deviation = errors.rate;
        let mut figure = KeyFigure::single("error of the mean rate", "%", 0.0);
        let ends = [-1.0, 1.0].map(|side| 100.0 * (deviation.relative + side * deviation.half_width));
        let (value, runs) = (100.0 * deviation.relative, errors.runs as u64);
        figure.measured = Measured::Interval { value, low: Some(ends[0]), high: Some(ends[1]), runs };
        figure.of(format!("{method}, {condition}"))
    };
    let conditions = CONDITIONS.into_iter().map(DriveCondition::name);
    conditions.zip(&row.steady).map(of).collect()
}
