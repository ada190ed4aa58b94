//! How strong coning is, and by how much the reference is worse than the filter says: found from the residuals.
//!
//! Restricted maximum likelihood: of all strengths, those under which the residuals are the most likely, whatever the
//! unknowns are. With the information `M = A' V^-1 A + P` of the unknowns, `P` of what is known of them before,
//!
//! ```text
//! L = ln det V + ln det M + chi^2   is least
//!
//! level:   no coning, L + (ln f_1)^2 + (ln f_2)^2
//! coning:  the same + sum over the drives of (ln(W / law) / 0.5)^2 + the law's own prior,    see `coning_law`
//! ```
//!
//! Of both the likelier is taken. Of eight intervals under a drive the strength is known to half of itself. So a
//! drive's own strength counts as much as its intervals tell beside the law of all.
//!
//! `f_1` and `f_2` are factors on the filter's variances of the reference, clockwise and the other way. These may be
//! too large as well as too small: those that are too large would hide coning. Source: Patterson and Thompson,
//! Biometrika 58 (1971) 545-554.

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
    let criterion = |strengths: &NoiseStrengths| {
        solve(strengths).map_or(f64::INFINITY, |solved| solved.criterion + strengths.reference_before())
    };
    let rates_deg_s = coning_law::mean_rates(intervals);
    let (level, at_level) = level(rates_deg_s.len(), &criterion)?;
    let (law, by_law) = ConingLaw::found(&rates_deg_s, &criterion)?;
    let strengths = if by_law < at_level { about(&law, &rates_deg_s, &criterion)? } else { level };
    let solved = solve(&strengths)?;
    Some((strengths, law, solved))
}

/// The strengths of a rotor that goes round no cone, and the criterion there.
fn level(drives: usize, criterion: &impl Fn(&NoiseStrengths) -> f64) -> Option<(NoiseStrengths, f64)> {
    let strengths = |values: &[f64]| NoiseStrengths {
        reference_factors: [values[0], values[1]],
        coning_deg2_s: vec![0.0; drives],
    };
    let bounds = [NoiseStrengths::REFERENCE_FACTORS; 2];
    let (values, at_level) = least(vec![1.0; 2], &bounds, |values| criterion(&strengths(values)))?;
    Some((strengths(&values), at_level))
}

/// The strengths about a law.
fn about(
    law: &ConingLaw,
    rates_deg_s: &[f64],
    criterion: &impl Fn(&NoiseStrengths) -> f64,
) -> Option<NoiseStrengths> {
    // The factors on the reference stand first, then each drive but drive 0, which is rest: the law has nothing there.
    let drives = rates_deg_s.get(1..)?;
    let strengths = |values: &[f64]| {
        let strength = |(per_law, rate_deg_s): (&f64, &f64)| per_law * law.strength_deg2_s(*rate_deg_s);
        let turning = values[2..].iter().zip(drives).map(strength);
        let coning_deg2_s = std::iter::once(0.0).chain(turning).collect();
        NoiseStrengths { reference_factors: [values[0], values[1]], coning_deg2_s }
    };
    let off = |per_law: &f64| {
        let sigmas = math::ln(*per_law) / LAW_SIGMA;
        sigmas * sigmas
    };
    let reference = [NoiseStrengths::REFERENCE_FACTORS; 2];
    let bounds: Vec<_> = reference.into_iter().chain(drives.iter().map(|_| PER_LAW)).collect();
    let (values, _) = least(vec![1.0; bounds.len()], &bounds, |values| {
        criterion(&strengths(values)) + values[2..].iter().map(off).sum::<f64>()
    })?;
    Some(strengths(&values))
}
