//! The budget of the scale factor: what each cause makes of its variance, as the fit states it.
//!
//! The scale factor is `k' y`, `k` the gains of the fit. With `V` the sum of its parts and `A_p` what the unknown p, of
//! variance 1 before, makes of the intervals,
//!
//! ```text
//! variance = sum over the causes of k' V_cause k  +  sum over the unknowns of (k' A_p)^2
//! ```

use motor_model::math;

use super::unknowns::{CAMERA, NONLINEARITY, SCALE, WARM_UP};
use super::{CalibrationFit, FitInterval, Unknowns};
use simulation::world::instruments::gyroscope::GyroscopeNoise;

/// What the lines of a budget are called, in order.
pub const CAUSES: [&str; 7] = [
    "random walk",
    "drift of the bias",
    "reference",
    "tilt and coning",
    "non-linearity",
    "temperature",
    "camera's errors by angle",
];

/// Standard deviations of the scale factor by cause, in the order of [`CAUSES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedBudget(pub [f64; CAUSES.len()]);

impl CalibrationFit {
    /// The budget of this fit to `intervals`.
    pub fn budget(
        &self,
        intervals: &[FitInterval],
        noise: &GyroscopeNoise,
        unknowns: &Unknowns,
    ) -> StatedBudget {
        let gains = self.gains.row(SCALE);
        let weighed = |of: &dyn Fn(&FitInterval) -> f64| -> f64 {
            gains.iter().zip(intervals).map(|(gain, interval)| gain * gain * of(interval)).sum()
        };
        let walk = weighed(&|interval| noise.white_deg2_s() * interval.span.length_s());
        let coning = weighed(&|interval| self.strengths.coning_deg2(interval));
        let reference = self.reference_variance(intervals);
        let columns = unknowns.columns(intervals);
        let known_before = |those: &[usize]| -> f64 {
            let of = |unknown: &usize| (gains * columns.row(*unknown).transpose()).x;
            those.iter().map(|unknown| of(unknown) * of(unknown)).sum()
        };
        let (nonlinearity, warm_up, camera) =
            (known_before(&[NONLINEARITY]), known_before(&WARM_UP), known_before(&CAMERA));
        // The drift is what is left of the whole.
        let others = walk + coning + reference + nonlinearity + warm_up + camera;
        let drift = (self.covariance.m11 - others).max(0.0);
        StatedBudget([walk, drift, reference, coning, nonlinearity, warm_up, camera].map(math::sqrt))
    }

    /// Variance of the scale factor by the reference: an anchor between two intervals counts in both.
    fn reference_variance(&self, intervals: &[FitInterval]) -> f64 {
        let gains = self.gains.row(SCALE);
        let mut variance = 0.0;
        let mut before: Option<(f64, &FitInterval)> = None;
        for (&gain, interval) in gains.iter().zip(intervals) {
            let own = self.strengths.reference_deg2(interval).0 * gain * gain;
            variance += match before {
                None => own,
                Some((gain_before, before)) => {
                    let end_deg2 = self.strengths.reference_deg2(before).1;
                    if before.span.until_s.total_cmp(&interval.span.from_s).is_eq() {
                        end_deg2 * (gain - gain_before) * (gain - gain_before)
                    } else {
                        own + end_deg2 * gain_before * gain_before
                    }
                }
            };
            before = Some((gain, interval));
        }
        let last =
            before.map_or(0.0, |(gain, interval)| self.strengths.reference_deg2(interval).1 * gain * gain);
        variance + last
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use simulation::math::random_streams::{RandomSource, stream};

    use super::super::tests::{NOISE, intervals, unknowns};
    use super::super::unknowns::BIAS;
    use super::*;

    /// The parts of the variance, that of the drift from the closed form of its covariance, are the whole.
    #[test]
    fn dual_the_parts_are_the_whole_variance() {
        let noise = GyroscopeNoise { drift_deg_s: 1e-3, drift_time_s: 20.0, ..NOISE };
        let turned: Vec<f64> = (0..40_u32).map(|k| if k % 8 < 5 { 40.0 } else { -25.0 }).collect();
        let mut all = intervals(&turned, 2e-4, 1e-3, 25e-6);
        let mut steps = stream(1, RandomSource::GyroscopeWalk);
        for interval in &mut all {
            interval.drive = usize::from(interval.turned_deg > 0.0);
            // Coning of 0.02 deg/sqrt(s).
            let step: f64 = StandardNormal.sample(&mut steps);
            interval.shown_deg += 0.02 * step;
        }
        all.remove(7);
        let unknowns = unknowns();
        let fit = CalibrationFit::to(&all, &noise, &unknowns).unwrap();
        assert!(fit.strengths.coning_deg2_s[1] > 1e-4, "{:?}", fit.strengths);
        let StatedBudget(sigmas) = fit.budget(&all, &noise, &unknowns);
        let gains = fit.gains.row(SCALE);
        let drift_alone = GyroscopeNoise { walk_deg_rs: 0.0, ..noise };
        let drift: f64 = (0..all.len())
            .flat_map(|i| (0..all.len()).map(move |j| (i, j)))
            .map(|(i, j)| gains[i] * gains[j] * drift_alone.covariance_deg2(all[i].span, all[j].span))
            .sum();
        assert!((sigmas[1] * sigmas[1] / drift - 1.0).abs() < 1e-6, "{} {drift}", sigmas[1] * sigmas[1]);
        // k' A is 1 for the scale factor itself, and 0 for the bias.
        let columns = unknowns.columns(&all);
        let of = |unknown: usize| (gains * columns.row(unknown).transpose()).x;
        assert!((of(SCALE) - 1.0).abs() < 1e-9 && of(BIAS).abs() < 1e-9);
    }
}
