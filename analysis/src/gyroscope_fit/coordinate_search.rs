//! The least of a criterion over positive numbers: each in turn by the golden section on a logarithmic scale, until
//! none moves any more.
//!
//! Source: Kiefer, Proc. Am. Math. Soc. 4 (1953) 502-506.

use motor_model::math;

/// Most rounds over all numbers.
const ROUNDS_MAX: u32 = 6;
/// Change of the criterion below which a round is the last: a ten-thousandth of what one standard deviation changes.
const SETTLED: f64 = 1e-4;
/// Width, as a ratio, within which a number is found.
const WITHIN: f64 = 1.002;

/// The values within positive bounds under which a criterion is least, and how much it is there. `None` where it is not
/// finite at the begin.
pub(super) fn least(
    mut values: Vec<f64>,
    bounds: &[(f64, f64)],
    criterion: impl Fn(&[f64]) -> f64,
) -> Option<(Vec<f64>, f64)> {
    let mut least = Some(criterion(&values)).filter(|begin| begin.is_finite())?;
    for _ in 0..ROUNDS_MAX {
        let before = least;
        for (place, bounds) in bounds.iter().enumerate() {
            let mut changed = values.clone();
            let mut with = |value: f64| {
                changed[place] = value;
                criterion(&changed)
            };
            let (inside, low) = (golden_section(*bounds, &mut with), (bounds.0, with(bounds.0)));
            let found = if low.1 <= inside.1 { low } else { inside };
            if found.1 < least {
                (values[place], least) = found;
            }
        }
        if before - least < SETTLED {
            break;
        }
    }
    Some((values, least))
}

/// Where `of` is least between positive bounds, and how much it is there.
fn golden_section((low, high): (f64, f64), mut of: impl FnMut(f64) -> f64) -> (f64, f64) {
    let part = 0.5 * (math::sqrt(5.0) - 1.0);
    let mut at = |x: f64| of(math::exp(x));
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

    /// `(ln x + 0.3 ln y - 1)^2 + (ln y)^2 / 2 + z` is least at `x = e, y = 1` and at the lower bound of `z`, to the
    /// last bit there. Each round leaves a seventh of the way.
    #[test]
    fn exact_numbers_that_depend_on_each_other() {
        let ln = |values: &[f64], place: usize| math::ln(values[place]);
        let criterion = |values: &[f64]| {
            let (across, along) = (ln(values, 0) + 0.3 * ln(values, 1) - 1.0, ln(values, 1));
            across * across + 0.5 * along * along + values[2]
        };
        let bounds = [(1e-3, 1e3), (1e-3, 1e3), (1.0, 5.0)];
        let (values, reached) = least(vec![1.0, 3.0, 2.0], &bounds, criterion).unwrap();
        assert!((ln(&values, 0) - 1.0).abs() < 0.02 && ln(&values, 1).abs() < 0.02, "{values:?}");
        assert!((reached - 1.0).abs() < 1e-3 && values[2].total_cmp(&1.0).is_eq(), "{reached} {values:?}");
        assert!(least(vec![1.0], &[(0.1, 1.0)], |_| f64::INFINITY).is_none());
    }
}
