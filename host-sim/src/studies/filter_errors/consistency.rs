//! Whether a filter's variances fit its errors: bounds of means over time, which account for how long errors are
//! correlated.
//!
//! The mean of `n` independent normalised squares is `chi^2_n / n` (Bar-Shalom, Li and Kirubarajan 2001, section 5.4).
//! Errors within a run are not independent: an error of one kick lasts for milliseconds, the angle of a rotor at rest
//! stays one number, and all kicks of a motor share its friction. The number of independent errors is measured by batch
//! means (Law and Kelton, "Simulation Modeling and Analysis", section 9.5.3). A batch is a run, since each run has a
//! motor and noise of its own:
//!
//! ```text
//! m_i: mean over run i of N,   m: their mean,   s: their standard deviation
//! n = 2 / (s / m)^2 N (z / t)^2
//! ```
//!
//! So `chi^2_n / n` has the variance of the mean (Satterthwaite 1946). `z` and `t` are the quantiles of the normal
//! distribution and of Student's, since `s` is known from N runs only; 1.96 and 2.20 for 95 % and twelve runs.
//!
//! What is tested is therefore a motor drawn at random, not each motor. The friction of one motor may be twice that of
//! another. No filter knows this beforehand, and it widens the bounds. The bounds of the correlation of neighbouring
//! innovations are `+- t s / sqrt N`.

use motor_model::math;

use analysis::filter_errors::timeline::TimelinePhase;
use simulation::math::count::real;
use simulation::math::statistics::{Spread, chi_square_mean_bounds, normal_quantile, student_quantile};

/// Mean and deviation of one value for each run, their number, and the quantile of Student's t beyond which `outside`
/// lies. Values that are not finite are left out.
fn of_runs(values: impl Iterator<Item = f64>, outside: f64) -> (Spread, f64, f64) {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let runs = real(finite.len());
    (finite.into_iter().collect(), runs, student_quantile(runs - 1.0, outside))
}

/// Two-sided bounds of the mean of normalised squares over all runs, from the mean of each run: a consistent filter is
/// outside with the probability `outside`. 0 and infinite for fewer than two runs.
pub fn mean_square_bounds(means: impl Iterator<Item = f64>, outside: f64) -> (f64, f64) {
    let (Spread { mean, sd }, runs, student) = of_runs(means, outside);
    if runs < 2.0 {
        return (0.0, f64::INFINITY);
    }
    let deviation = sd / mean / math::sqrt(runs) * student / normal_quantile(outside);
    chi_square_mean_bounds(2.0 / (deviation * deviation), outside)
}

/// Bound in both directions of the mean of a correlation over all runs if it is 0, from the value of each run: beyond
/// it with the probability `outside`.
pub fn correlation_bound(correlations: impl Iterator<Item = f64>, outside: f64) -> f64 {
    let (Spread { sd, .. }, runs, student) = of_runs(correlations, outside);
    if runs < 2.0 { f64::INFINITY } else { student * sd / math::sqrt(runs) }
}

/// The test of the errors in a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConsistencyTest {
    /// Angle and rate together are as far off as the filter says.
    Both,
    /// The angle is as far off as the filter says. The rate is exactly zero, so that any variance of it is too large.
    Angle,
    /// Angle and rate are not further off than the filter says. While the stator rings down, for some 30 ms, the
    /// filters assume that the rotor may creep. How much it creeps differs from motor to motor.
    AtMost,
}

impl ConsistencyTest {
    /// The test of a phase.
    pub(crate) const fn of(phase: TimelinePhase) -> Self {
        match phase {
            TimelinePhase::SpinUp | TimelinePhase::Steady | TimelinePhase::Reversal => Self::Both,
            TimelinePhase::Stop => Self::AtMost,
            TimelinePhase::Rest100Ms | TimelinePhase::Rest1S => Self::Angle,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;
    use simulation::math::statistics::{NORMAL_95, OUTSIDE_95};

    use super::*;

    const RUNS: u32 = 12;

    /// A run of 500 errors whose neighbours are correlated by `kept`: their mean square, scaled by `wrong`.
    fn run(normal: &mut impl FnMut() -> f64, kept: f64, wrong: f64) -> f64 {
        let mut error = normal();
        let squares = (0..500).map(|_| {
            error = kept * error + math::sqrt(1.0 - kept * kept) * normal();
            wrong * error * error
        });
        squares.sum::<f64>() / 500.0
    }

    /// How many of 1,000 experiments have their mean within the 95 % bounds.
    fn within(kept: f64, wrong: f64) -> u32 {
        let mut rng = Pcg64::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut count = 0;
        for _ in 0..1000 {
            let means: Vec<f64> = (0..RUNS).map(|_| run(&mut normal, kept, wrong)).collect();
            let (low, high) = mean_square_bounds(means.iter().copied(), OUTSIDE_95);
            let mean = means.iter().sum::<f64>() / f64::from(RUNS);
            count += u32::from((low..=high).contains(&mean));
        }
        count
    }

    /// 95 % are within, whether errors are independent or correlated over 20 or 100 of the 500 samples: 950 +- 7, and 2
    /// % more or less where the runs' means are as skew as chi-square itself. If the samples were taken for
    /// independent, the mean of 6,000 of them would be known to 3.6 %, and two of three experiments with correlated
    /// errors would be outside. Where neighbours are correlated by 0.8 the mean is known to 4 %, so that variances that
    /// are wrong by a factor of 1.25 are detected.
    #[test]
    fn law_the_bounds_hold_95_percent_however_long_errors_are_correlated() {
        for kept in [0.0, 0.95, 0.99] {
            let count = within(kept, 1.0);
            assert!((920..=975).contains(&count), "{kept}: {count}");
        }
        let if_independent = chi_square_mean_bounds(500.0 * f64::from(RUNS), OUTSIDE_95);
        let mut rng = Pcg64::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let experiments =
            (0..300).map(|_| (0..RUNS).map(|_| run(&mut normal, 0.95, 1.0)).sum::<f64>() / f64::from(RUNS));
        let accepted =
            experiments.filter(|mean| (if_independent.0..=if_independent.1).contains(mean)).count();
        assert!(accepted < 200, "{accepted}");
        assert!(within(0.8, 1.25) < 10 && within(0.8, 0.8) < 10);
    }

    /// Two runs of 0.9 and 1.1: `s^2 = 0.02`, t = 12.7.
    #[test]
    fn exact_two_runs_and_none() {
        let deviation = math::sqrt(0.01) * 12.706_2;
        assert!((correlation_bound([0.9, 1.1].into_iter(), OUTSIDE_95) - deviation).abs() < 1e-4);
        let ratio = deviation / NORMAL_95;
        let (low, high) = mean_square_bounds([0.9, f64::NAN, 1.1].into_iter(), OUTSIDE_95);
        let expected = chi_square_mean_bounds(2.0 / (ratio * ratio), OUTSIDE_95);
        assert!((low - expected.0).abs() < 1e-4 && (high - expected.1).abs() < 1e-4, "{low} {high}");
        assert_eq!(mean_square_bounds([1.0].into_iter(), OUTSIDE_95), (0.0, f64::INFINITY));
        assert!(correlation_bound([f64::NAN].into_iter(), OUTSIDE_95).is_infinite());
    }
}
