//! A curve through points by least squares, with the standard deviations of its parameters.
//!
//! Levenberg and Marquardt's algorithm finds the parameters; derivatives are given in closed form. The covariance is
//! that of independent errors of equal size, which the residuals show:
//!
//! ```text
//! covariance = s^2 (J^T J)^-1,      s^2 = sum of squared residuals / (points - parameters)
//! ```

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use motor_model::math;
use nalgebra::storage::Owned;
use nalgebra::{Const, DVector, Dyn, OMatrix, SMatrix, SVector};
use nalgebra_0_34 as nalgebra;

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
    values: SVector<f64, N>,
}

impl<F: Fn(f64, &[f64; N]) -> (f64, [f64; N]), const N: usize> Curve<'_, F, N> {
    fn at(&self, x: f64) -> (f64, [f64; N]) {
        (self.law)(x, &self.values.into())
    }
}

impl<F: Fn(f64, &[f64; N]) -> (f64, [f64; N]), const N: usize> LeastSquaresProblem<f64, Dyn, Const<N>>
    for Curve<'_, F, N>
{
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Const<N>>;
    type ParameterStorage = Owned<f64, Const<N>>;

    fn set_params(&mut self, values: &SVector<f64, N>) {
        self.values = *values;
    }

    fn params(&self) -> SVector<f64, N> {
        self.values
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let residuals = self.x.iter().zip(self.y).map(|(x, y)| self.at(*x).0 - y);
        Some(DVector::from_iterator(self.x.len(), residuals))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, Const<N>>> {
        let rows = self.x.iter().flat_map(|x| self.at(*x).1);
        Some(OMatrix::<f64, Dyn, Const<N>>::from_row_iterator(self.x.len(), rows))
    }
}

/// The curve through the points `x`, `y`, from a first guess. `curve` gives its value and its derivatives by the
/// parameters.
pub fn fit<const N: usize>(
    x: &[f64],
    y: &[f64],
    guess: [f64; N],
    curve: impl Fn(f64, &[f64; N]) -> (f64, [f64; N]),
) -> Fitted<N> {
    let count = x.len().min(y.len());
    let (x, y) = (&x[..count], &y[..count]);
    let curve = Curve { x, y, law: curve, values: guess.into() };
    if count <= N {
        return Fitted { values: guess, sd: [f64::INFINITY; N], residual_sd: f64::INFINITY };
    }
    let (curve, _) = LevenbergMarquardt::new().minimize(curve);
    let (mut normal, mut squares) = (SMatrix::<f64, N, N>::zeros(), 0.0);
    for (x, y) in x.iter().zip(y) {
        let (value, row) = curve.at(*x);
        squares += (value - y) * (value - y);
        let row = SVector::from(row);
        normal += row * row.transpose();
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let variance = squares / (count - N) as f64;
    let inverse = normal.try_inverse();
    let sd = |number: usize| {
        inverse
            .as_ref()
            .map_or(f64::INFINITY, |inverse| math::sqrt(variance * inverse[(number, number)].max(0.0)))
    };
    Fitted { values: curve.values.into(), sd: std::array::from_fn(sd), residual_sd: math::sqrt(variance) }
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
}
