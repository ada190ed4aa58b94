//! The report on cost and error of the filters.

use super::{DRIVES, FilterCosts, FilterCostsRow, SAMPLE_RATES_HZ};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;
use simulation::runs::filter::FILTERS;
use simulation::runs::simulate::Precision;

impl FilterCosts {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let motors = self.rows.first().map_or(0, |row| row.runs);
        StudyReport {
            title: "What each filter costs, and how far it is off".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("motors", format!("{motors}, each run in both modes")),
                ("vibrometer", "50, 100 and 200 thousand samples a second".to_owned()),
            ],
            pictures: vec![("filters.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.rows.iter().map(FilterCostsRow::key_figure).collect(),
            sure: vec![
                "The errors are of steady motion, over all motors together: `estimate` gives their spread over motors. \
                 Times are the least of several measurements on this machine, and differ from run to run. \
                 Instructions are counted in an emulator: they are exact, and no cycles."
                    .to_owned(),
            ],
            motor_s: None,
        }
    }

    /// What a tick costs with each filter in the microcontroller's arithmetic.
    fn verdict(&self) -> String {
        let most_ns = |filter: &str| {
            let of_filter = self.rows.iter().filter(|row| {
                row.filter == filter
                    && row.precision == Precision::F32
                    && row.ldv_sample_rate_hz >= SAMPLE_RATES_HZ[0]
            });
            of_filter.map(|row| row.ns.tick).fold(0.0, f64::max)
        };
        let costs =
            FILTERS.iter().map(|filter| format!("{} {:.0} ns", filter.replace('_', " "), most_ns(filter)));
        format!(
            "10 us of motor time take {} on this machine in f32, in the dearer of {} modes.",
            costs.collect::<Vec<_>>().join(", "),
            DRIVES.len()
        )
    }
}

impl FilterCostsRow {
    fn key_figure(&self) -> KeyFigure {
        let (filter, drive) = (self.filter.replace('_', " "), self.drive.to_uppercase());
        let (precision, khz) = (self.precision.name(), 1e-3 * self.ldv_sample_rate_hz);
        KeyFigure::single("error of the angle", "mdeg rms", self.rms_angle_mdeg)
            .of(format!("{filter}, {precision}, {khz:.0} kHz, mode {drive}"))
            .lower_is_better()
    }
}
