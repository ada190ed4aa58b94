//! One scalar measurement taken in (Bierman's update).

use motor_model::Real;
use nalgebra::SVector;

use super::{UdCovariance, is_finite, reach, reciprocal, stops_at_diagonal};

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
        let sums = p.f.iter_mut().zip(&mut p.g).zip(&mut p.sums);
        for ((j, column), ((&weight, &h_j), ((f, g), a))) in
            self.unit.iter().enumerate().zip(self.weights.iter().zip(row).zip(sums))
        {
            *f = if stops_at_diagonal::<N>() { h_j } else { T::zero() };
            for (&u, &h) in column.iter().zip(row).take(reach::<N>(j)) {
                *f += u * h;
            }
            *g = weight * *f;
            sum += *f * *g;
            *a = sum;
        }
        for (per, &a) in p.per_sum.iter_mut().zip(&p.sums) {
            *per = reciprocal(a);
        }
        p
    }

    /// The factors after the measurement; returns `b = P h`.
    #[inline]
    fn sweep(&mut self, p: &Projection<T, N>, noise: T) -> SVector<T, N> {
        let mut b = [T::zero(); N];
        let (mut before, mut per_before) = (noise, None);
        let entries = p.f.iter().zip(&p.g).zip(p.sums.iter().zip(&p.per_sum));
        for ((j, (column, weight)), ((&f, &g), (&sum, &per_sum))) in
            self.unit.iter_mut().zip(&mut self.weights).enumerate().zip(entries)
        {
            // While the sum is zero so is b, and nothing is learnt.
            let slope = per_before.map_or(T::zero(), |per: T| f * per);
            *weight *= per_sum.map_or(T::one(), |per| before * per);
            for (u, b) in column.iter_mut().zip(&mut b).take(reach::<N>(j)) {
                let old = *u;
                *u -= slope * *b;
                *b += g * old;
            }
            if stops_at_diagonal::<N>() && let Some(b_j) = b.get_mut(j) {
                *b_j = g;
            }
            (before, per_before) = (sum, per_sum);
        }
        b.into()
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
