//! A curve through points by least squares, with the standard deviations of its parameters.
//!
//! Levenberg and Marquardt's algorithm finds the parameters; derivatives are given in closed form. The covariance is
//! that of independent errors of equal size, which the residuals show:
//!
//! ```text
//! covariance = s^2 (J^T J)^-1,      s^2 = sum of squared residuals / (points - parameters)
//! ```

use motor_model::math;
use rmpfit::{MPConfig, MPFitter, MPPar, MPResult, MPSide};

/// A fitted curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted<const N: usize> {
    /// The parameters.
    pub values: [f64; N],
    /// Their standard deviations; infinite where the points do not tell them.
    pub sd: [f64; N],
    /// Standard deviation of the residuals.
    pub residual_sd: f64,
}

struct Curve<'a, F, const N: usize> {
    x: &'a [f64],
    y: &'a [f64],
    law: F,
    config: MPConfig,
    parameters: [MPPar; N],
}

impl<F: Fn(f64, &[f64; N]) -> (f64, [f64; N]), const N: usize> Curve<'_, F, N> {
    /// Values less points, and the derivatives, one row a point.
    fn rows<'a>(&'a self, parameters: &[f64]) -> impl Iterator<Item = (f64, [f64; N])> + 'a {
        let mut values = [0.0; N];
        values.copy_from_slice(parameters);
        self.x.iter().zip(self.y).map(move |(x, y)| {
            let (value, row) = (self.law)(*x, &values);
            (value - y, row)
        })
    }
}

impl<F: Fn(f64, &[f64; N]) -> (f64, [f64; N]), const N: usize> MPFitter for Curve<'_, F, N> {
    fn eval(&mut self, parameters: &[f64], residuals: &mut [f64]) -> MPResult<()> {
        for (residual, (error, _)) in residuals.iter_mut().zip(self.rows(parameters)) {
            *residual = error;
        }
        Ok(())
    }

    fn jacobian(
        &mut self,
        parameters: &[f64],
        residuals: &mut [f64],
        columns: &mut [Option<Vec<f64>>],
    ) -> MPResult<()> {
        for (number, (residual, (error, row))) in residuals.iter_mut().zip(self.rows(parameters)).enumerate()
        {
            *residual = error;
            for (column, derivative) in columns.iter_mut().flatten().zip(row) {
                column[number] = derivative;
            }
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.x.len()
    }

    fn config(&self) -> &MPConfig {
        &self.config
    }

    fn parameters(&self) -> &[MPPar] {
        &self.parameters
    }
}

/// The curve through the points `x`, `y`, from a first guess. `curve` gives its value and its derivatives by the
/// parameters. Where there are no more points than parameters, or a value is no number, the guess comes back with
/// infinite standard deviations.
pub fn fit<const N: usize>(
    x: &[f64],
    y: &[f64],
    guess: [f64; N],
    curve: impl Fn(f64, &[f64; N]) -> (f64, [f64; N]),
) -> Fitted<N> {
    let untold = Fitted { values: guess, sd: [f64::INFINITY; N], residual_sd: f64::INFINITY };
    let count = x.len().min(y.len());
    if count <= N {
        return untold;
    }
    // As near to the least sum of squares as numbers of 53 bits tell.
    let tolerance = 30.0 * f64::EPSILON;
    let config = MPConfig { ftol: tolerance, xtol: tolerance, gtol: tolerance, ..MPConfig::new() };
    let parameters = std::array::from_fn(|_| MPPar { side: MPSide::User, ..MPPar::new() });
    let mut values = guess;
    let mut curve = Curve { x: &x[..count], y: &y[..count], law: curve, config, parameters };
    let Ok(found) = curve.mpfit(&mut values) else { return untold };
    let squares: f64 = found.resid.iter().map(|residual| residual * residual).sum();
    if !squares.is_finite() {
        return untold;
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let residual_sd = math::sqrt(squares / (count - N) as f64);
    // The library's are those of residuals with a standard deviation of 1, and 0 where the points tell nothing.
    let sd = |number: usize| match found.xerror[number] {
        0.0 => f64::INFINITY,
        unit => residual_sd * unit,
    };
    Fitted { values, sd: std::array::from_fn(sd), residual_sd }
}

/// Damped oscillation and its derivatives by frequency, decay, both amplitudes and offset. Frequency and decay are in
/// rad/s.
pub fn damped_oscillation(t: f64, [w, d, a, b, c]: &[f64; 5]) -> (f64, [f64; 5]) {
    let (sin, cos) = math::sin_cos(w * t);
    let decay = math::exp(-d * t);
    let (swing, quarter) = (decay * (a * cos + b * sin), decay * (b * cos - a * sin));
    (swing + c, [t * quarter, -t * swing, decay * cos, decay * sin, 1.0])
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use simulation::math::statistics::Spread;

    /// `v = exp(-d t) a cos(w t)`, sampled at `n` instants of distance `h` with white noise `s`, for `d n h` of
    /// several: the least variance that any unbiased estimate can have (Kay, Fundamentals of Statistical Signal
    /// Processing I, 1993, chapter 3) is, with sums as integrals and many periods,
    ///
    /// ```text
    /// var(d) = var(w) = 16 d^3 h s^2 / a^2
    /// ```
    ///
    /// The fit states it, and reaches it over 200 seeds: the mean square of its error over its stated variance is 1
    /// within four of its standard deviations, `sqrt(2 / 200)`.
    #[test]
    fn law_a_ring_down_is_fitted_as_well_as_can_be() {
        let (w, d, a, h, s): (f64, f64, f64, f64, f64) = (2000.0, 20.0, 1.0, 1e-4, 0.05);
        let damped = damped_oscillation;
        let bound = math::sqrt(16.0 * d * d * d * h * s * s / (a * a));
        let t: Vec<f64> = (0..4000).map(|number: u32| f64::from(number) * h).collect();
        let mut errors = [0.0; 2];
        for seed in 0..200 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let v: Vec<f64> = t
                .iter()
                .map(|t| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    damped(*t, &[w, d, a, 0.0, 0.3]).0 + s * noise
                })
                .collect();
            let found = fit(&t, &v, [w + 3.0, 0.8 * d, 0.9 * a, 0.1, 0.0], damped);
            assert!((found.residual_sd / s - 1.0).abs() < 4.0 / math::sqrt(8000.0), "{found:?}");
            for (number, truth) in [w, d].into_iter().enumerate() {
                // The sums of 4,000 instants are their integrals to the share of a step in the decay, 0.2 %.
                assert!((found.sd[number] / bound - 1.0).abs() < 0.06, "{} {bound}", found.sd[number]);
                let error = (found.values[number] - truth) / found.sd[number];
                errors[number] += error * error / 200.0;
            }
        }
        for error in errors {
            assert!((error - 1.0).abs() < 0.4, "{errors:?}");
        }
    }

    /// A straight line is fitted in closed form: slope and its standard deviation are those of the text-book.
    #[test]
    fn exact_a_line_has_the_standard_deviations_of_the_text_book() {
        let x: Vec<f64> = (0..20).map(f64::from).collect();
        let y: Vec<f64> =
            x.iter().map(|x| 3.0 - 0.5 * x + if x % 2.0 > 0.5 { 0.25 } else { -0.25 }).collect();
        let found = fit(&x, &y, [0.0, 0.0], |x, [a, b]| (a + b * x, [1.0, x]));
        let line = simulation::math::statistics::Line::through(
            &x.iter().copied().zip(y.iter().copied()).collect::<Vec<_>>(),
        );
        let line = line.unwrap();
        let residuals = x.iter().zip(&y).map(|(x, y)| y - line.intercept - line.slope * x);
        let variance = residuals.map(|residual| residual * residual).sum::<f64>() / 18.0;
        let spread: Spread = x.iter().copied().collect();
        let slope_sd = math::sqrt(variance / (19.0 * spread.sd * spread.sd));
        assert!(
            (found.values[1] - line.slope).abs() < 1e-9 && (found.values[0] - line.intercept).abs() < 1e-8
        );
        assert!((found.sd[1] / slope_sd - 1.0).abs() < 1e-6, "{found:?} {slope_sd}");
    }

    /// A parameter on which the curve does not depend, as many points as parameters, and a point that is no number.
    #[test]
    fn exact_what_points_do_not_tell_is_said() {
        let (x, y) = ([0.0, 1.0, 2.0, 3.0], [1.0, 1.5, 1.0, 1.5]);
        let level = |_: f64, [a, _]: &[f64; 2]| (*a, [1.0, 0.0]);
        let found = fit(&x, &y, [0.0, 7.0], level);
        assert!((found.values[0] - 1.25).abs() < 1e-12, "{found:?}");
        assert_eq!((found.values[1], found.sd[1]), (7.0, f64::INFINITY));
        // Squares of four residuals of 0.25 over two degrees of freedom; the mean has half their standard deviation.
        assert!((found.residual_sd - math::sqrt(0.125)).abs() < 1e-12, "{found:?}");
        assert!((found.sd[0] - 0.5 * math::sqrt(0.125)).abs() < 1e-12, "{found:?}");
        let untold = Fitted { values: [0.0, 7.0], sd: [f64::INFINITY; 2], residual_sd: f64::INFINITY };
        assert_eq!(fit(&x[..2], &y, [0.0, 7.0], level), untold);
        assert_eq!(fit(&x, &[1.0, f64::NAN, 1.0, 1.5], [0.0, 7.0], level), untold);
    }
}
