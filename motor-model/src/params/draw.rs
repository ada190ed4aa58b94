//! A random motor within Table 1's tolerances.

use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

use crate::params::{MotorParams, Parameter, ParameterSpec, Tolerance};

impl MotorParams {
    /// Another motor of the design whose values these are: each parameter drawn within its [`Tolerance`], which scales
    /// with the design's value.
    ///
    /// ```text
    /// k = |design value / Table 1's value|
    /// normal:  design value +- k tolerance          uniform:  k low to k high
    /// ```
    ///
    /// A normal tolerance is redrawn until it falls within its cut-off (about one draw in twenty is). Values are
    /// limited to the parameter's bounds. Every parameter takes its draws in the order of [`Parameter::ALL`], so a seed
    /// names a motor.
    #[must_use]
    pub fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Self {
        self.draw_within(|_| None, rng)
    }

    /// The same, with the tolerances that `own` gives in the place of the table's: normal about the design's value with
    /// half of the tolerance as standard deviation, cut off at it.
    #[must_use]
    pub fn draw_within<R: Rng + ?Sized>(&self, own: impl Fn(Parameter) -> Option<f64>, rng: &mut R) -> Self {
        let mut drawn = *self;
        for parameter in Parameter::ALL {
            let value = drawn_value(&parameter.spec(), self.get(parameter), own(parameter), rng);
            if let Ok(changed) = drawn.with(parameter, value) {
                drawn = changed;
            }
        }
        drawn
    }
}

/// One draw of the parameter `spec` describes, in a motor of a design with the value `design`.
///
/// A tolerance of the table scales with the design's value, except about a nominal value of 0. One's `own` does not.
pub(super) fn drawn_value<R: Rng + ?Sized>(
    spec: &ParameterSpec,
    design: f64,
    own: Option<f64>,
    rng: &mut R,
) -> f64 {
    let scale = if spec.nominal.abs() > 0.0 { (design / spec.nominal).abs() } else { 1.0 };
    let value = match (own, spec.tolerance) {
        (Some(tolerance), _) => design + tolerance * half_normal_within_one(rng),
        (None, Tolerance::Exact) => design,
        (None, Tolerance::Normal(tolerance)) => design + scale * tolerance * half_normal_within_one(rng),
        (None, Tolerance::Uniform(low, high)) => match Uniform::new_inclusive(scale * low, scale * high) {
            Ok(uniform) => uniform.sample(rng),
            Err(_) => design,
        },
    };
    value.clamp(spec.min, spec.max)
}

/// A normal deviate of standard deviation 1/2, redrawn until within +-1.
///
/// Bounded: after 64 refusals (probability 1e-86) it gives 0.
fn half_normal_within_one<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    for _ in 0..64 {
        let standard: f64 = StandardNormal.sample(rng);
        if standard.abs() <= 2.0 {
            return 0.5 * standard;
        }
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;
    use rand_pcg::Pcg64;

    /// Mean and standard deviation of 4,000 draws of each parameter against those of its law.
    ///
    /// A normal of deviation s cut at 2 s has deviation 0.8796 s (1 - 2 * 2 phi(2) / (2 Phi(2) - 1), square root).
    #[test]
    fn law_draws_have_the_tolerance_s_mean_and_deviation() {
        check_draws(&MotorParams::nominal());
        // Another design: every toleranced value larger or smaller by another factor, within the parameters' bounds.
        let toleranced = Parameter::ALL.into_iter().zip([0.5, 1.25, 2.0].into_iter().cycle());
        let design = toleranced.fold(MotorParams::nominal(), |design, (parameter, factor)| {
            design.with(parameter, factor * parameter.spec().nominal).unwrap_or(design)
        });
        check_draws(&design);
    }

    fn check_draws(design: &MotorParams) {
        let mut rng = Pcg64::seed_from_u64(7);
        let n = 4000;
        let draws: [MotorParams; 4000] = core::array::from_fn(|_| design.draw(&mut rng));
        for parameter in Parameter::ALL {
            let spec = parameter.spec();
            let value = design.get(parameter);
            let scale = (value / spec.nominal).abs();
            let (low, high, mean, sigma) = match spec.tolerance {
                Tolerance::Exact => (value, value, value, 0.0),
                Tolerance::Normal(t) => {
                    let t = scale * t;
                    (value - t, value + t, value, 0.5 * 0.8796 * t)
                }
                Tolerance::Uniform(low, high) => {
                    let (low, high) = (scale * low, scale * high);
                    (low, high, 0.5 * (low + high), (high - low) / 12_f64.sqrt())
                }
            };
            let values = draws.iter().map(|draw| draw.get(parameter));
            let average = values.clone().sum::<f64>() / f64::from(n);
            let deviation = (values.clone().map(|x| (x - average) * (x - average)).sum::<f64>()
                / f64::from(n - 1))
            .sqrt();
            assert!(values.clone().all(|x| x >= low && x <= high), "{}", spec.key);
            // Four standard errors either way.
            assert!(
                (average - mean).abs() <= 4.0 * sigma / f64::from(n).sqrt() + 1e-12 * mean.abs(),
                "{}",
                spec.key
            );
            assert!(
                (deviation - sigma).abs() <= 0.06 * sigma + 1e-12 * mean.abs(),
                "{}: {deviation} {sigma}",
                spec.key
            );
        }
    }
}
