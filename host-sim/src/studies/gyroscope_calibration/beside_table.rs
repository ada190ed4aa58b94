//! Calibrations on several scenes side by side: errors and their parts, intervals that miss, and what a run costs.

use super::Calibrations;
use crate::report::table::Table;
use crate::studies::beside::{SideBySide, side_by_side, worst_of};

/// What the figures of the table mean.
const ABOUT: &str = "Error of the scale factor, root mean square, beside the standard deviation that the fit states; \
    its parts by cause, each root mean square, of coning the mean too. Missed: calibrations whose 95 % interval of the \
    scale factor does not hold the truth; needed: motor time after which, by the pilot of the first motor, 95 % of its \
    scale factors would be within 10 ppm; beyond 5 sigma: whose error exceeds five stated standard deviations, and the \
    largest error in these. Bias missed, both (the ellipse of scale factor and bias), its missed (non-linearity) and \
    misalignment (two intervals a run): intervals of these that do not hold the truth. Reference: error of the \
    filter's angle, root mean square; beyond 3 sigma: share of the angles used that are off by more than three \
    standard deviations that the filter states; good, beyond 5 sigma: calibrations with an angle that is called good \
    and is off by more than five, and the largest error of these. Time: seconds of this machine for a second of motor \
    time, filter and controller included, of the motor that takes least.";

impl Calibrations {
    /// Every scene, the first under the name `first`.
    pub(super) fn side_by_side(&self, first: &str) -> SideBySide {
        let mut table = Table::new(&[
            "scene",
            "runs",
            "motors",
            "scale factor ppm",
            "stated",
            "coning mean",
            "coning rms",
            "reference",
            "gyroscope",
            "missed",
            "within 10 ppm",
            "needed s",
            "beyond 5 sigma",
            "worst, sigmas",
            "bias deg/h",
            "stated",
            "bias missed",
            "both",
            "non-lin. ppm",
            "stated",
            "its missed",
            "misalignment",
            "reference mdeg",
            "beyond 3 sigma",
            "good, beyond 5 sigma",
            "worst mdeg",
            "time s/s",
        ]);
        for (name, calibrations) in side_by_side(first, self, &self.beside) {
            table.push(cells(name, calibrations));
        }
        SideBySide {
            tables: table.cut(1, &["missed", "bias deg/h", "reference mdeg"]),
            about: ABOUT.to_owned(),
        }
    }
}

fn cells(scene: &str, calibrations: &Calibrations) -> Vec<String> {
    let (summary, time_s_per_s) = (calibrations.summary(), calibrations.time_s_per_s);
    let needed_s = calibrations.turn_plan.and_then(|plan| plan.needed_s);
    let missed = |covered: usize| (summary.runs - covered).to_string();
    let good_beyond_5_sigma = summary.reference_good_beyond_5_sigma;
    let worst_mdeg = || format!("{:.1}", summary.reference_good_beyond_5_sigma_worst_mdeg);
    vec![
        scene.to_owned(),
        summary.runs.to_string(),
        summary.motors.to_string(),
        format!("{:.2}", summary.scale_factor_rms_ppm),
        format!("{:.2}", summary.scale_factor_stated_ppm),
        format!("{:+.2}", summary.scale_factor_coning_ppm),
        format!("{:.2}", summary.scale_factor_coning_rms_ppm),
        format!("{:.2}", summary.scale_factor_reference_ppm),
        format!("{:.2}", summary.scale_factor_noise_ppm),
        missed(summary.scale_factor_covered),
        summary.scale_factor_within_10_ppm.to_string(),
        needed_s.map_or_else(|| "-".to_owned(), |needed_s| format!("{needed_s:.0}")),
        summary.scale_factor_beyond_5_sigma.to_string(),
        format!("{:.1}", summary.scale_factor_worst_sigmas),
        format!("{:.2}", summary.bias_rms_deg_h),
        format!("{:.2}", summary.bias_stated_deg_h),
        missed(summary.bias_covered),
        missed(summary.pair_covered),
        format!("{:.1}", summary.nonlinearity_rms_ppm),
        format!("{:.1}", summary.nonlinearity_stated_ppm),
        missed(summary.nonlinearity_covered),
        (2 * summary.runs - summary.misalignment_covered).to_string(),
        format!("{:.1}", summary.reference_rms_mdeg),
        format!("{:.2} %", 100.0 * summary.reference_beyond_3_sigma),
        good_beyond_5_sigma.to_string(),
        worst_of(good_beyond_5_sigma > 0, worst_mdeg),
        format!("~{time_s_per_s:.2}"),
    ]
}
