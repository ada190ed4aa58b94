//! The problems as plain numbers, from which every filter is built.

use std::hint::black_box;

use benches::matrix_covariance::{CovarianceForm, Joseph};
use motor_model::{Real, math};
use nalgebra::{Matrix2, SMatrix, SVector};
use ud_filter::{Dense, NoiseSource, Transition};

/// A linear model with independent measurements of variance 1.
#[derive(Clone, Copy)]
pub struct Problem<T, const N: usize, const M: usize> {
    /// F.
    pub transition: SMatrix<T, N, N>,
    /// Gains of the noise sources, one in a column. Columns that are not used are 0.
    pub noise_gain: SMatrix<T, N, N>,
    /// Their variances.
    pub noise_variance: SVector<T, N>,
    /// H, by rows.
    pub rows: SMatrix<T, M, N>,
    /// Variance of every state at the start.
    pub start_variance: T,
}

/// A filter that is timed.
pub trait Filter<T: Real, const N: usize, const M: usize> {
    /// A filter whose state is 0.
    fn new(problem: &Problem<T, N, M>) -> Self;
    /// A prediction, and M measurements.
    fn step(&mut self, measured: &[T; M]);
    /// The present state.
    fn state(&self) -> [T; N];
}

impl<T: Real> Problem<T, 2, 1> {
    /// States angle and rate; the rate is a random walk, and the angle is measured.
    pub fn constant_rate() -> Self {
        let dt = 0.1;
        let rounded = |x: f64| black_box(T::from_f64(x));
        Self {
            transition: Matrix2::new(1.0, dt, 0.0, 1.0).map(rounded),
            noise_gain: Matrix2::new(1.0, dt / 2.0, 0.0, 1.0).map(rounded),
            noise_variance: SVector::from([dt * dt * dt / 12.0, dt]).map(rounded),
            rows: SMatrix::<f64, 1, 2>::new(1.0, 0.0).map(rounded),
            start_variance: rounded(10.0),
        }
    }
}

impl<T: Real, const N: usize, const M: usize> Problem<T, N, M> {
    /// Lightly damped modes `(g, v / w)`, each driven by noise of its own. M combinations of their displacements are
    /// measured.
    pub fn modal() -> Self {
        let rounded = |x: f64| black_box(T::from_f64(x));
        let mut transition = SMatrix::<f64, N, N>::zeros();
        let mut noise_gain = SMatrix::<f64, N, N>::zeros();
        let mut noise_variance = SVector::<f64, N>::zeros();
        for (b, index) in (0..N).step_by(2).zip(0_u32..) {
            let (angle, zeta) = (0.1 + 0.07 * f64::from(index), 0.01);
            let (sin, cos) = math::sin_cos(angle);
            let free = Matrix2::new(cos + zeta * sin, sin, -sin, cos - zeta * sin) * math::exp(-zeta * angle);
            transition.fixed_view_mut::<2, 2>(b, b).copy_from(&free);
            noise_gain[(b + 1, b / 2)] = 1.0;
            noise_variance[b / 2] = 1e-3;
        }
        let rows = SMatrix::<f64, M, N>::from_fn(|m, i| match (i % 2, m % 2) {
            (0, 0) => 1.0,
            (0, _) => {
                if i % 4 == 0 {
                    1.0
                } else {
                    -0.5
                }
            }
            _ => 0.0,
        });
        Self {
            transition: transition.map(rounded),
            noise_gain: noise_gain.map(rounded),
            noise_variance: noise_variance.map(rounded),
            rows: rows.map(rounded),
            start_variance: rounded(10.0),
        }
    }

    /// The same problem with the two states of each block exchanged, so that the state that noise drives is first.
    pub fn noise_driven_first(&self) -> Self {
        let mut exchanged = *self;
        for b in (0..N).step_by(2) {
            exchanged.transition.swap_rows(b, b + 1);
            exchanged.transition.swap_columns(b, b + 1);
            exchanged.noise_gain.swap_rows(b, b + 1);
            exchanged.rows.swap_columns(b, b + 1);
        }
        exchanged
    }

    /// The first S noise sources.
    pub fn sources<const S: usize>(&self) -> [NoiseSource<T, N>; S] {
        std::array::from_fn(|s| NoiseSource {
            gain: self.noise_gain.column(s).into_owned(),
            variance: self.noise_variance[s],
        })
    }

    /// Q in full.
    pub fn noise(&self) -> SMatrix<T, N, N> {
        self.noise_gain * SMatrix::from_diagonal(&self.noise_variance) * self.noise_gain.transpose()
    }

    /// Final state by Joseph's form in `f64`.
    pub fn reference(&self, measured: &[[T; M]]) -> SVector<f64, N> {
        let transition = Dense(self.transition.map(Real::to_f64));
        let noise: [NoiseSource<f64, N>; N] = self.sources::<N>().map(|source| NoiseSource {
            gain: source.gain.map(Real::to_f64),
            variance: source.variance.to_f64(),
        });
        let start = SVector::repeat(self.start_variance.to_f64());
        let (mut covariance, mut state) = (Joseph::from_diagonal(&start), SVector::<f64, N>::zeros());
        for z in measured {
            state = transition.carry(&state);
            covariance.predict(&transition, &noise);
            for (m, z) in z.iter().enumerate() {
                let row = self.rows.row(m).transpose().map(Real::to_f64);
                let innovation = z.to_f64() - row.dot(&state);
                assert!(covariance.take_in(&row, 1.0, innovation, &mut state), "a plain measurement");
            }
        }
        state
    }
}

/// A sum of two sines of the step, a slow one and a fast one.
pub fn measurements<T: Real, const M: usize>(steps: u32) -> Vec<[T; M]> {
    let two_sines = |step: u32, m: usize| {
        let (slow, _) = math::sin_cos(0.011 * f64::from(step) + if m == 0 { 0.0 } else { 1.0 });
        let (fast, _) = math::sin_cos(0.37 * f64::from(step));
        T::from_f64(slow + 0.5 * fast)
    };
    (0..steps).map(|step| std::array::from_fn(|m| two_sines(step, m))).collect()
}
