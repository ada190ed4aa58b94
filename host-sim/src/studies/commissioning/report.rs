//! The report on a commissioned motor.

use simulation::runs::commission::CommissionedMotor;

use super::{picture, rows, tables};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;

/// The report on one motor.
pub(crate) fn report(motor: &CommissionedMotor) -> StudyReport {
    let time_s = f64::from(motor.commissioned.time_s);
    let offsets = rows::resonances(motor).into_iter().filter_map(|row| {
        let off_hz = row.found_hz? - row.true_hz?;
        Some(KeyFigure::single(&format!("resonance of mode {}, off by", row.mode), "Hz", off_hz))
    });
    StudyReport {
        title: "Commissioning".to_owned(),
        verdict: tables::verdict(motor),
        asked: vec![("motor", format!("{}, through its instruments alone", super::name(motor)))],
        pictures: vec![("commissioning.svg".to_owned(), picture::figure(motor))],
        document: tables::document(motor),
        key_figures: std::iter::once(KeyFigure::single("motor time", "s", time_s)).chain(offsets).collect(),
        sure: vec![
            "Intervals are of the factors by Bayes' rule, with the map that it began with as the prior. The true \
             resonances are known because this is a simulation."
                .to_owned(),
        ],
        motor_s: Some(time_s),
    }
}
