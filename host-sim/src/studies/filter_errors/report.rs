//! The report on the filters' errors: who is least off, and how sure that is.

use super::tables::{millidegrees, title};
use super::{DRIVES, FilterErrors, FilterErrorsRow};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;
use analysis::filter_errors::timeline::{self, TimelinePhase};
use simulation::math::count::real;
use simulation::runs::filter::FILTERS;

impl FilterErrors {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let motors = self.rows.first().map_or(0, |row| row.runs);
        let runs = real(motors) * real(DRIVES.len()) * real(1 + self.beside.len());
        StudyReport {
            title: "How far the filters are off the truth".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("motors", format!("{motors}, each run in both modes")),
                ("filters", FILTERS.join(", ").replace('_', " ")),
                ("beside", format!("{} other scenes", self.beside.len())),
            ],
            pictures: vec![("estimate.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.key_figures(),
            sure: vec![
                "The truth is known because this is a simulation. The intervals are of a motor drawn at random: a run \
                 of one motor is one value, however many estimates it has. An asterisk in the tables marks a filter \
                 whose variances do not fit its errors."
                    .to_owned(),
            ],
            motor_s: Some(runs * 1e-9 * real(timeline::end_nanos(TimelinePhase::Rest1S))),
        }
    }

    /// The least error in steady motion.
    fn verdict(&self) -> String {
        let best = DRIVES.iter().filter_map(|(_, drive)| {
            let rows = FILTERS.iter().filter_map(|filter| self.row(filter, drive, TimelinePhase::Steady));
            let best = rows.min_by(|a, b| a.rms_angle_mdeg.total_cmp(&b.rms_angle_mdeg))?;
            let (filter, drive) = (best.filter.replace('_', " "), drive.to_uppercase());
            let rms = millidegrees(best.rms_angle_mdeg);
            Some(format!("{filter} in mode {drive}, with {rms} milli-degrees rms"))
        });
        format!("In steady motion the least off is {}.", best.collect::<Vec<_>>().join(", and "))
    }

    /// Of every filter and phase: its error, and how often it was called good and was wrong.
    fn key_figures(&self) -> Vec<KeyFigure> {
        let of_motors = |found: &Self| found.own_key_figures();
        [of_motors(self), self.beside.iter().flat_map(|other| of_motors(&other.found)).collect()].concat()
    }

    fn own_key_figures(&self) -> Vec<KeyFigure> {
        let of_filter = |row: &&FilterErrorsRow| FILTERS.contains(&row.filter);
        let of_row = |row: &FilterErrorsRow| {
            let phase = TimelinePhase::ALL.into_iter().find(|phase| phase.name() == row.phase);
            let (filter, drive) = (row.filter.replace('_', " "), row.drive.to_uppercase());
            let of = format!("{filter}, mode {drive}, {}", phase.map_or(row.phase, title));
            let error =
                KeyFigure::root_mean_square("error of the angle", "mdeg rms", row.rms_of_runs_mdeg.clone())
                    .of(of)
                    .of_runs(self.numbers.iter().copied());
            match &row.beside {
                Some(scene) => error.beside(scene),
                None => error,
            }
            .lower_is_better()
        };
        self.rows.iter().filter(of_filter).map(of_row).collect()
    }
}
