//! The figures over all calibrations.

use serde::Serialize;

use super::Calibrations;
use super::outcome::CalibrationOutcome;
use analysis::gyroscope_fit::CAUSES;
use simulation::math::count::real;
use simulation::math::statistics::{binomial_bounds, root_mean_square};

/// Figures over all runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationSummary {
    /// Calibrations.
    pub runs: usize,
    /// Motors.
    pub motors: u64,
    /// Root mean square error of the scale factor.
    pub scale_factor_rms_ppm: f64,
    /// The same, as the fits state it.
    pub scale_factor_stated_ppm: f64,
    /// The largest error.
    pub scale_factor_worst_ppm: f64,
    /// Mean of what coning makes of the error.
    pub scale_factor_coning_ppm: f64,
    /// Root mean square of the same.
    pub scale_factor_coning_rms_ppm: f64,
    /// Root mean square of what the error of the reference makes of it.
    pub scale_factor_reference_ppm: f64,
    /// Root mean square of what the gyroscope's misalignment makes of it.
    pub scale_factor_misalignment_ppm: f64,
    /// Root mean square of what its non-linearity makes of it.
    pub scale_factor_nonlinearity_ppm: f64,
    /// Root mean square of what its temperature makes of it.
    pub scale_factor_temperature_ppm: f64,
    /// Root mean square of what its noise makes of it.
    pub scale_factor_noise_ppm: f64,
    /// Root mean squares of the standard deviations that the fits state by cause, in the order of the budget's lines.
    pub scale_factor_budget_ppm: [f64; CAUSES.len()],
    /// Runs whose scale factor is off by more than five of its standard deviations.
    pub scale_factor_beyond_5_sigma: usize,
    /// The largest error of a scale factor in its standard deviations.
    pub scale_factor_worst_sigmas: f64,
    /// The same, as random walk alone allows at these rates.
    pub scale_factor_walk_ppm: f64,
    /// Runs within 10 ppm of the truth.
    pub scale_factor_within_10_ppm: usize,
    /// Runs whose 95 % interval of the scale factor holds the truth.
    pub scale_factor_covered: usize,
    /// Root mean square error of the bias.
    pub bias_rms_deg_h: f64,
    /// The same, as the fits state it.
    pub bias_stated_deg_h: f64,
    /// The largest error.
    pub bias_worst_deg_h: f64,
    /// Mean of what coning makes of the bias's error.
    pub bias_coning_deg_h: f64,
    /// Root mean square of what the error of the reference makes of it.
    pub bias_reference_deg_h: f64,
    /// Root mean square of what the gyroscope's noise makes of it.
    pub bias_noise_deg_h: f64,
    /// Root mean square error of the bias per what random walk allows in the time.
    pub bias_over_walk: f64,
    /// Runs whose 95 % interval of the bias holds the truth.
    pub bias_covered: usize,
    /// Root mean square error of the non-linearity.
    pub nonlinearity_rms_ppm: f64,
    /// The same, as the fits state it.
    pub nonlinearity_stated_ppm: f64,
    /// Runs whose 95 % interval of the non-linearity holds the truth.
    pub nonlinearity_covered: usize,
    /// Of the 95 % intervals of misalignment, two a run, those that hold the truth.
    pub misalignment_covered: usize,
    /// Two-sided 95 % bounds of that count.
    pub misalignment_covered_bounds: (u32, u32),
    /// Runs whose 95 % ellipse of both holds the truth.
    pub pair_covered: usize,
    /// Two-sided 95 % bounds of these counts if each interval holds the truth with a probability of 95 %.
    pub covered_bounds: (u32, u32),
    /// Means of the factors on the reference's variances, clockwise and counter-clockwise.
    pub reference_factors: [f64; 2],
    /// Share of the intervals that are left out for saturation.
    pub saturated: f64,
    /// Root mean square error of the reference.
    pub reference_rms_mdeg: f64,
    /// Share of the ends of the intervals at which it is off by more than three standard deviations that the filter
    /// states.
    pub reference_beyond_3_sigma: f64,
    /// Runs with an end at which it is called good and is off by more than five.
    pub reference_good_beyond_5_sigma: usize,
    /// The largest error of these.
    pub reference_good_beyond_5_sigma_worst_mdeg: f64,
}

impl Calibrations {
    /// Figures over all runs.
    pub fn summary(&self) -> CalibrationSummary {
        let all = &self.outcomes;
        let count = real(all.len().max(1));
        let mean = |of: fn(&CalibrationOutcome) -> f64| all.iter().map(of).sum::<f64>() / count;
        let rms = |of: fn(&CalibrationOutcome) -> f64| root_mean_square(all.iter().map(of));
        let worst = |of: fn(&CalibrationOutcome) -> f64| all.iter().map(|o| of(o).abs()).fold(0.0, f64::max);
        let those = |of: fn(&CalibrationOutcome) -> bool| all.iter().filter(|o| of(o)).count();
        let bounds = |intervals: usize| binomial_bounds(u32::try_from(intervals).unwrap_or(u32::MAX), 0.95);
        let bias_rms_deg_h = rms(|o| o.bias_error_deg_h);
        let part =
            |o: &CalibrationOutcome| real(o.saturated_intervals) / real(o.intervals + o.saturated_intervals);
        CalibrationSummary {
            runs: all.len(),
            motors: self.motors,
            scale_factor_rms_ppm: rms(|o| o.scale_factor_error_ppm),
            scale_factor_stated_ppm: rms(|o| o.scale_factor_sigma_ppm),
            scale_factor_worst_ppm: worst(|o| o.scale_factor_error_ppm),
            scale_factor_coning_ppm: mean(|o| o.scale_factor_coning_ppm),
            scale_factor_coning_rms_ppm: rms(|o| o.scale_factor_coning_ppm),
            scale_factor_reference_ppm: rms(|o| o.scale_factor_reference_ppm),
            scale_factor_misalignment_ppm: rms(|o| o.scale_factor_misalignment_ppm),
            scale_factor_nonlinearity_ppm: rms(|o| o.scale_factor_nonlinearity_ppm),
            scale_factor_temperature_ppm: rms(|o| o.scale_factor_temperature_ppm),
            scale_factor_noise_ppm: rms(|o| o.scale_factor_noise_ppm),
            scale_factor_budget_ppm: std::array::from_fn(|cause| {
                root_mean_square(all.iter().map(|outcome| outcome.stated_ppm()[cause]))
            }),
            scale_factor_beyond_5_sigma: those(|o| o.scale_factor_sigmas() > 5.0),
            scale_factor_worst_sigmas: worst(CalibrationOutcome::scale_factor_sigmas),
            scale_factor_walk_ppm: rms(|o| o.walk_scale_factor_sigma_ppm),
            scale_factor_within_10_ppm: those(|o| o.scale_factor_error_ppm.abs() <= 10.0),
            scale_factor_covered: those(CalibrationOutcome::covers_scale_factor),
            bias_rms_deg_h,
            bias_stated_deg_h: rms(|o| o.bias_sigma_deg_h),
            bias_worst_deg_h: worst(|o| o.bias_error_deg_h),
            bias_coning_deg_h: mean(|o| o.bias_coning_deg_h),
            bias_reference_deg_h: rms(|o| o.bias_reference_deg_h),
            bias_noise_deg_h: rms(|o| o.bias_noise_deg_h),
            bias_over_walk: bias_rms_deg_h / mean(|o| o.walk_bias_sigma_deg_h),
            bias_covered: those(CalibrationOutcome::covers_bias),
            nonlinearity_rms_ppm: rms(|o| o.nonlinearity_error_ppm),
            nonlinearity_stated_ppm: rms(|o| o.nonlinearity_sigma_ppm),
            nonlinearity_covered: those(CalibrationOutcome::covers_nonlinearity),
            misalignment_covered: all.iter().map(CalibrationOutcome::misalignments_covered).sum(),
            misalignment_covered_bounds: bounds(2 * all.len()),
            pair_covered: those(CalibrationOutcome::covers_pair),
            covered_bounds: bounds(all.len()),
            reference_factors: [
                mean(|o| o.reference_factor_clockwise),
                mean(|o| o.reference_factor_counter_clockwise),
            ],
            saturated: all.iter().map(part).sum::<f64>() / count,
            reference_rms_mdeg: rms(|o| o.reference_rms_mdeg),
            reference_beyond_3_sigma: mean(|o| o.reference_beyond_3_sigma),
            reference_good_beyond_5_sigma: those(|o| o.reference_good_beyond_5_sigma > 0),
            reference_good_beyond_5_sigma_worst_mdeg: worst(|o| o.reference_good_beyond_5_sigma_worst_mdeg),
        }
    }
}
