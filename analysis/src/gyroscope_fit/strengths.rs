//! How strong coning is, and by how much the reference is worse than the filter says: found from the residuals.
//!
//! Restricted maximum likelihood: of all strengths, those under which the residuals are the most likely, whatever the
//! unknowns are. With the information `M = A' V^-1 A + P` of the unknowns, `P` of what is known of them before,
//!
//! ```text
//! L = ln det V + ln det M + chi^2   is least
//!
//! level:   no coning
//! coning:  L + sum over the drives of (ln(W / law) / 0.5)^2 + the law's own prior,    see `coning_law`
//! ```
//!
//! Of both the likelier is taken. Of eight intervals under a drive the strength is known to half of itself. So a
//! drive's own strength counts as much as its intervals tell beside the law of all.
//!
//! At its lower end the factor on the reference is 1, as the filter says. Source: Patterson and Thompson, Biometrika 58
//! (1971) 545-554.

use motor_model::math;

use super::coning_law::{self, ConingLaw};
use super::coordinate_search::least;
use super::whitening::NoiseStrengths;
use super::{FitInterval, LeastSquares, Unknowns};
use simulation::world::instruments::gyroscope::GyroscopeNoise;

/// Standard deviation of the logarithm of a drive's strength about the law. An assumption: on four rotors of sets F and
/// G, led at seven rates each, drives lie within a third of it.
const LAW_SIGMA: f64 = 0.5;
/// Bounds of a drive's strength, per that of the law.
const PER_LAW: (f64, f64) = (1e-3, 1e3);

/// The strengths, the law of coning, and the least squares under the strengths.
pub(super) fn found(
    intervals: &[FitInterval],
    noise: &GyroscopeNoise,
    unknowns: &Unknowns,
) -> Option<(NoiseStrengths, ConingLaw, LeastSquares)> {
    let solve = |strengths: &NoiseStrengths| LeastSquares::solve(intervals, noise, unknowns, strengths);
    let criterion =
        |strengths: &NoiseStrengths| solve(strengths).map_or(f64::INFINITY, |solved| solved.criterion);
    let rates_deg_s = coning_law::mean_rates(intervals);
    let (level, at_level) = level(rates_deg_s.len(), &criterion)?;
    let (law, by_law) = ConingLaw::found(&rates_deg_s, &criterion)?;
    let strengths = if by_law < at_level { about(&law, &rates_deg_s, &criterion)? } else { level };
    let solved = solve(&strengths)?;
    Some((strengths, law, solved))
}

/// The strengths of a rotor that goes round no cone, and the criterion there.
fn level(drives: usize, criterion: &impl Fn(&NoiseStrengths) -> f64) -> Option<(NoiseStrengths, f64)> {
    let strengths =
        |values: &[f64]| NoiseStrengths { reference_factor: values[0], coning_deg2_s: vec![0.0; drives] };
    let (values, at_level) =
        least(vec![1.0], &[NoiseStrengths::REFERENCE_FACTORS], |values| criterion(&strengths(values)))?;
    Some((strengths(&values), at_level))
}

/// The strengths about a law.
fn about(
    law: &ConingLaw,
    rates_deg_s: &[f64],
    criterion: &impl Fn(&NoiseStrengths) -> f64,
) -> Option<NoiseStrengths> {
    // In the place of drive 0, which is rest, stands the factor on the reference: the law has nothing at rest.
    let strengths = |values: &[f64]| {
        let strength = |(per_law, rate_deg_s): (&f64, &f64)| per_law * law.strength_deg2_s(*rate_deg_s);
        let coning_deg2_s = values.iter().zip(rates_deg_s).map(strength).collect();
        NoiseStrengths { reference_factor: values[0], coning_deg2_s }
    };
    let off = |per_law: &f64| {
        let sigmas = math::ln(*per_law) / LAW_SIGMA;
        sigmas * sigmas
    };
    let mut bounds = vec![PER_LAW; rates_deg_s.len()];
    *bounds.first_mut()? = NoiseStrengths::REFERENCE_FACTORS;
    let (values, _) = least(vec![1.0; bounds.len()], &bounds, |values| {
        criterion(&strengths(values)) + values.iter().skip(1).map(off).sum::<f64>()
    })?;
    Some(strengths(&values))
}
