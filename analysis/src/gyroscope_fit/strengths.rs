//! How strong coning is, and by how much the reference is worse than the filter says: found from the residuals.
//!
//! Restricted maximum likelihood: of all strengths, those under which the residuals are the most likely, whatever the
//! unknowns are. With the information `M = A' V^-1 A + P` of the unknowns, `P` of what is known of them before,
//!
//! ```text
//! ln det V + ln det M + chi^2   is least
//! ```
//!
//! Each strength in turn is searched on a logarithmic scale by the golden section, until none moves any more. At its
//! lower end it is as the data sheets say: no coning, a factor of 1. Source: Patterson and Thompson, Biometrika 58
//! (1971) 545-554.

use motor_model::math;

use super::whitening::NoiseStrengths;
use super::{FitInterval, LeastSquares, Unknowns};
use simulation::math::count::real;
use simulation::world::instruments::gyroscope::GyroscopeNoise;

/// Most rounds over all strengths.
const ROUNDS_MAX: u32 = 6;
/// Change of the criterion below which a round is the last: a ten-thousandth of what one standard deviation changes.
const SETTLED: f64 = 1e-4;
/// Width, as a ratio, within which a strength is found.
const WITHIN: f64 = 1.002;
/// Largest factor on the reference's variances.
const REFERENCE_FACTOR_MAX: f64 = 1e6;
/// Weakest coning that is told from none, per variance of the noise in the same interval.
const CONING_MIN: f64 = 1e-3;
/// Strongest, per mean square of what the intervals show beside the reference.
const CONING_MAX: f64 = 10.0;

/// The strengths, and the least squares under them.
pub(super) fn found(
    intervals: &[FitInterval],
    noise: &GyroscopeNoise,
    unknowns: &Unknowns,
) -> Option<(NoiseStrengths, LeastSquares)> {
    let mut strengths = NoiseStrengths::of_data_sheets(intervals);
    let solve = |strengths: &NoiseStrengths| LeastSquares::solve(intervals, noise, unknowns, strengths);
    let criterion =
        |strengths: &NoiseStrengths| solve(strengths).map_or(f64::INFINITY, |solved| solved.criterion);
    let shown_deg2_s = mean_square_deg2_s(intervals);
    let mut least = solve(&strengths)?.criterion;
    for _ in 0..ROUNDS_MAX {
        let before = least;
        for place in 0..strengths.coning_deg2_s.len() {
            // Drive 0 is none: a rotor at rest goes round no cone.
            let (bounds, none) = if place == 0 {
                ((1.0, REFERENCE_FACTOR_MAX), 1.0)
            } else {
                let Some(own_deg2_s) = own_deg2_s(intervals, noise, place) else { continue };
                ((CONING_MIN * own_deg2_s, CONING_MAX * shown_deg2_s), 0.0)
            };
            let with = |value: f64| {
                let mut changed = strengths.clone();
                if place == 0 {
                    changed.reference_factor = value;
                } else {
                    changed.coning_deg2_s[place] = value;
                }
                changed
            };
            let (value, reached) = golden_section(bounds, |value| criterion(&with(value)));
            let at_none = criterion(&with(none));
            let (value, reached) = if at_none <= reached { (none, at_none) } else { (value, reached) };
            if reached < least {
                (strengths, least) = (with(value), reached);
            }
        }
        if before - least < SETTLED {
            break;
        }
    }
    let solved = solve(&strengths)?;
    Some((strengths, solved))
}

/// Variance per second of the intervals under a drive as the data sheets say, in deg^2/s; `None` if there is none.
fn own_deg2_s(intervals: &[FitInterval], noise: &GyroscopeNoise, drive: usize) -> Option<f64> {
    let of_drive = intervals.iter().filter(|interval| interval.drive == drive);
    let own = of_drive.map(|interval| {
        let (from, until) = interval.variances_deg2;
        noise.white_deg2_s() + (from + until) / interval.span.length_s()
    });
    let (sum, count) = own.fold((0.0, 0_u32), |(sum, count), own| (sum + own, count + 1));
    (count > 0 && sum > 0.0).then(|| sum / real(count))
}

/// Mean square of what is shown beside the reference, in deg^2 per s.
fn mean_square_deg2_s(intervals: &[FitInterval]) -> f64 {
    let off_deg = |interval: &FitInterval| interval.shown_deg - interval.turned_deg;
    let (sum, length_s) = intervals.iter().fold((0.0, 0.0), |(sum, length_s), interval| {
        (sum + off_deg(interval) * off_deg(interval), length_s + interval.span.length_s())
    });
    sum / length_s
}

/// Where `of` is least between positive bounds, and how much it is there.
fn golden_section((low, high): (f64, f64), of: impl Fn(f64) -> f64) -> (f64, f64) {
    let part = 0.5 * (math::sqrt(5.0) - 1.0);
    let at = |x: f64| of(math::exp(x));
    let (mut low, mut high) = (math::ln(low), math::ln(high).max(math::ln(low)));
    let (mut left, mut right) = (high - part * (high - low), low + part * (high - low));
    let (mut at_left, mut at_right) = (at(left), at(right));
    while high - low > math::ln(WITHIN) {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - part * (high - low);
            at_left = at(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + part * (high - low);
            at_right = at(right);
        }
    }
    if at_left <= at_right { (math::exp(left), at_left) } else { (math::exp(right), at_right) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least of `(ln x - 1)^2` is at e; of a falling function at the upper end.
    #[test]
    fn exact_golden_section() {
        let (at, least) = golden_section((1e-3, 1e6), |x| (math::ln(x) - 1.0) * (math::ln(x) - 1.0));
        assert!((math::ln(at) - 1.0).abs() < math::ln(WITHIN) && least < 1e-3, "{at} {least}");
        let (at, _) = golden_section((1.0, 100.0), |x| -x);
        assert!(at > 98.0 && at <= 100.0, "{at}");
    }
}
