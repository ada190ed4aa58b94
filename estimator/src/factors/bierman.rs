//! One scalar measurement taken in (Bierman's update).

use motor_model::Real;
use nalgebra::SVector;

use super::{UdCovariance, for_columns, is_finite, reciprocal};

/// What a measurement did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<T, const N: usize> {
    /// Variance predicted for the innovation, `h'P h + R`.
    pub variance: T,
    /// Kalman gain: correction of each state per innovation.
    pub gain: SVector<T, N>,
    /// Innovation squared over its variance (NIS): 1 on average in a consistent filter.
    pub normalised_squared: T,
}

/// Why a measurement was refused. State and covariance are then as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The noise variance is negative or NaN.
    Noise,
    /// The innovation variance is zero or too small for its reciprocal: the measurement is exact, and so was the prediction.
    Certain,
    /// The innovation variance is infinite or NaN.
    Uncertain,
    /// The innovation is infinite, NaN, or so large that its normalised square overflows.
    Innovation,
}

/// `f = U'h`, `g = D f` and the sums `a_j = R + f_1 g_1 + ... + f_j g_j` with their reciprocals.
struct Projection<T, const N: usize> {
    f: [T; N],
    g: [T; N],
    sums: [T; N],
    per_sum: [Option<T>; N],
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// Variance of the innovation of `z = h'x + noise`, `h'P h + R`.
    #[inline]
    pub fn innovation_variance(&self, row: &SVector<T, N>, noise: T) -> T {
        self.project(row, noise).variance(noise)
    }

    /// Takes in a scalar measurement `z = h'x + noise` of variance `noise`, zero or more, whose innovation is `z - h'x`.
    ///
    /// Measurements with independent noises are taken in one after the other, each innovation against the state that the one before has left.
    ///
    /// # Errors
    /// When the measurement cannot be used; nothing has changed then.
    #[inline]
    pub fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        let projection = self.project(row, noise);
        let correction = projection.judge(noise, innovation)?;
        let (per_variance, normalised_squared) = correction;
        let gain = self.sweep(&projection, noise) * per_variance;
        *state += gain * innovation;
        Ok(Correction { variance: projection.variance(noise), gain, normalised_squared })
    }

    #[inline]
    fn project(&self, row: &SVector<T, N>, noise: T) -> Projection<T, N> {
        let [row] = &row.data.0;
        let mut p =
            Projection { f: [T::zero(); N], g: [T::zero(); N], sums: [T::zero(); N], per_sum: [None; N] };
        let mut sum = noise;
        for_columns!(up to N, |j| self.project_on_column(j, row, &mut p, &mut sum));
        for (per, &a) in p.per_sum.iter_mut().zip(&p.sums) {
            *per = reciprocal(a);
        }
        p
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn project_on_column(&self, j: usize, row: &[T; N], p: &mut Projection<T, N>, sum: &mut T) {
        let (Some(column), Some(&weight), Some(&h)) = (self.unit.get(j), self.weights.get(j), row.get(j)) else {
            return;
        };
        let (Some(f), Some(g), Some(a)) = (p.f.get_mut(j), p.g.get_mut(j), p.sums.get_mut(j)) else { return };
        *f = h;
        for (&u, &h) in column.iter().zip(row).take(j) {
            *f += u * h;
        }
        *g = weight * *f;
        *sum += *f * *g;
        *a = *sum;
    }

    /// The factors after the measurement; returns `b = P h`.
    #[inline]
    fn sweep(&mut self, p: &Projection<T, N>, noise: T) -> SVector<T, N> {
        let mut b = [T::zero(); N];
        let mut before = (noise, None);
        for_columns!(up to N, |j| self.sweep_column(j, p, &mut b, &mut before));
        b.into()
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn sweep_column(&mut self, j: usize, p: &Projection<T, N>, b: &mut [T; N], before: &mut (T, Option<T>)) {
        let (Some(column), Some(weight)) = (self.unit.get_mut(j), self.weights.get_mut(j)) else { return };
        let (Some(&f), Some(&g), Some(&sum), Some(&per_sum)) =
            (p.f.get(j), p.g.get(j), p.sums.get(j), p.per_sum.get(j))
        else {
            return;
        };
        // While the sum is zero so is b, and nothing is learnt.
        let slope = before.1.map_or(T::zero(), |per| f * per);
        *weight *= per_sum.map_or(T::one(), |per| before.0 * per);
        for (u, b) in column.iter_mut().zip(b.iter_mut()).take(j) {
            let old = *u;
            *u -= slope * *b;
            *b += g * old;
        }
        if let Some(b_j) = b.get_mut(j) {
            *b_j = g;
        }
        *before = (sum, per_sum);
    }
}

impl<T: Real, const N: usize> Projection<T, N> {
    #[inline]
    fn variance(&self, noise: T) -> T {
        self.sums.last().copied().unwrap_or(noise)
    }

    /// Reciprocal of the innovation variance, and the normalised innovation squared.
    ///
    /// A finite one bounds the correction too: `(K_i innovation)^2 <= P_ii NIS`.
    #[inline]
    fn judge(&self, noise: T, innovation: T) -> Result<(T, T), Refusal> {
        if !(noise >= T::zero()) {
            return Err(Refusal::Noise);
        }
        let variance = self.variance(noise);
        if !is_finite(variance) {
            return Err(Refusal::Uncertain);
        }
        let per_variance = reciprocal(variance).ok_or(Refusal::Certain)?;
        let normalised_squared = innovation * per_variance * innovation;
        if is_finite(normalised_squared) { Ok((per_variance, normalised_squared)) } else { Err(Refusal::Innovation) }
    }
}
