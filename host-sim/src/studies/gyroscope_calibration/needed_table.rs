//! Calibrations that are as long as their pilots say, judged by the truth.

use std::collections::BTreeMap;

use super::{CalibrationOutcome, Calibrations};
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::studies::beside::Beside;

/// Error of a scale factor that the plans are made for.
const WITHIN_PPM: f64 = super::plan::WANTED_PPM;

/// The table of scenes whose plans last until 95 % of scale factors are promised within [`WITHIN_PPM`], and
/// `longest_s` at most.
pub(crate) fn page_value(scenes: &[Beside<Calibrations>], longest_s: f64) -> PlacedValue {
    let mut table = Table::new(&[
        "scene",
        "runs",
        "motors",
        "time s",
        "cut short",
        "within 10 ppm",
        "least",
        "rms ppm",
        "stated",
        "worst",
        "sigmas",
    ]);
    for Beside { name, found } in scenes {
        table.push(cells(name, found, longest_s));
    }
    ("table_needed", table.markdown())
}

/// Of the motor with the fewest calibrations within [`WITHIN_PPM`]: how many they are, and of how many.
fn least_of_a_motor(outcomes: &[CalibrationOutcome]) -> (usize, usize) {
    let mut motors: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    for outcome in outcomes {
        let (within, all) = motors.entry(outcome.seed).or_default();
        *within += usize::from(outcome.scale_factor_error_ppm.abs() <= WITHIN_PPM);
        *all += 1;
    }
    motors.into_values().min_by_key(|(within, _)| *within).unwrap_or_default()
}

fn cells(scene: &str, calibrations: &Calibrations, longest_s: f64) -> Vec<String> {
    let summary = calibrations.summary();
    let (least_within, of_motor) = least_of_a_motor(&calibrations.outcomes);
    // Calibrations of one motor share its run.
    let times: BTreeMap<u64, f64> =
        calibrations.outcomes.iter().map(|of| (of.seed, of.motor_time_s)).collect();
    let (least_s, most_s) = times
        .values()
        .fold((f64::INFINITY, 0.0_f64), |(least, most), time_s| (least.min(*time_s), most.max(*time_s)));
    vec![
        scene.to_owned(),
        summary.runs.to_string(),
        summary.motors.to_string(),
        format!("{least_s:.0} to {most_s:.0}"),
        times.values().filter(|time_s| **time_s >= longest_s).count().to_string(),
        format!("{} of {}", summary.scale_factor_within_10_ppm, summary.runs),
        format!("{least_within} of {of_motor}"),
        format!("{:.2}", summary.scale_factor_rms_ppm),
        format!("{:.2}", summary.scale_factor_stated_ppm),
        format!("{:.1}", summary.scale_factor_worst_ppm),
        format!("{:.1}", summary.scale_factor_worst_sigmas),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three calibrations on one motor and two on another, which has fewer within the error wanted. An error of 10 ppm
    /// is within it, to either side.
    #[test]
    fn exact_the_motor_with_the_fewest_within() {
        let outcome = |seed, scale_factor_error_ppm| CalibrationOutcome {
            seed,
            scale_factor_error_ppm,
            ..CalibrationOutcome::default()
        };
        let outcomes =
            [outcome(1, 10.0), outcome(2, 10.1), outcome(1, -10.0), outcome(2, 3.0), outcome(1, -10.1)];
        assert_eq!(least_of_a_motor(&outcomes), (1, 2));
        assert_eq!(least_of_a_motor(&[]), (0, 0));
    }
}
