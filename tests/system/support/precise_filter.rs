//! The textbook's Kalman filter in 200-bit arithmetic: a covariance matrix, no factors, nothing in common with the
//! filter under test.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use motor_model::Real;
use nalgebra::{SMatrix, SVector};
use ud_filter::NoiseSource;

/// Twice what an `f64` holds of the square of a number, so that a condition number of 1e24 leaves a hundred bits.
const BITS: usize = 200;

/// A number of [`BITS`] bits.
pub type Precise = FBig<HalfEven, 2>;

/// The same value, exactly.
pub fn precise(x: f64) -> Precise {
    Precise::try_from(x).expect("a finite number").with_precision(BITS).value()
}

/// Covariance of N states, and state.
#[derive(Clone, Debug)]
pub struct PreciseFilter<const N: usize> {
    covariance: Vec<Vec<Precise>>,
    state: Vec<Precise>,
}

impl<const N: usize> PreciseFilter<N> {
    /// A covariance given in full, and state 0.
    pub fn new(covariance: &SMatrix<f64, N, N>) -> Self {
        let covariance = (0..N).map(|i| (0..N).map(|j| precise(covariance[(i, j)])).collect()).collect();
        Self { covariance, state: vec![precise(0.0); N] }
    }

    /// `x <- F x`, `P <- F P F' + sum c a a'`.
    pub fn predict<T: Real, const M: usize>(&mut self, f: &SMatrix<T, N, N>, noise: &[NoiseSource<T, N>; M]) {
        let f = f.map(Real::to_f64);
        let columns: Vec<Vec<Precise>> = (0..N)
            .map(|j| product(&f, &self.covariance.iter().map(|row| row[j].clone()).collect::<Vec<_>>()))
            .collect();
        // Row i of F P is the i-th entry of every column; F P F' is F applied to each row of it.
        self.covariance = (0..N)
            .map(|i| product(&f, &columns.iter().map(|column| column[i].clone()).collect::<Vec<_>>()))
            .collect();
        self.state = product(&f, &self.state);
        for source in noise {
            let (gain, variance) = (source.gain.map(Real::to_f64), source.variance.to_f64());
            for (i, row) in self.covariance.iter_mut().enumerate().filter(|(i, _)| gain[*i] != 0.0) {
                for (j, entry) in row.iter_mut().enumerate().filter(|(j, _)| gain[*j] != 0.0) {
                    *entry += precise(variance) * precise(gain[i]) * precise(gain[j]);
                }
            }
        }
    }

    /// 2^`doublings` predictions by `f` without noise, in one: `f` squared so many times.
    ///
    /// Returns the map that this makes, rounded.
    pub fn predict_power_of_two(&mut self, f: &SMatrix<f64, N, N>, doublings: u32) -> SMatrix<f64, N, N> {
        let mut map: Vec<Vec<Precise>> =
            (0..N).map(|i| (0..N).map(|j| precise(f[(i, j)])).collect()).collect();
        for _ in 0..doublings {
            map = multiply(&map, &map);
        }
        let transposed: Vec<Vec<Precise>> =
            (0..N).map(|i| (0..N).map(|j| map[j][i].clone()).collect()).collect();
        self.covariance = multiply(&multiply(&map, &self.covariance), &transposed);
        SMatrix::from_fn(|i, j| to_f64(&map[i][j]))
    }

    /// Takes in `z = h'x + noise`; returns the gain and the innovation's variance.
    pub fn update<T: Real>(&mut self, row: &SVector<T, N>, noise: T, measured: T) -> (SVector<f64, N>, f64) {
        let row = row.map(Real::to_f64);
        let seen: Vec<usize> = (0..N).filter(|&i| row[i] != 0.0).collect();
        let along = |entries: &[Precise]| {
            seen.iter().fold(precise(0.0), |sum, &i| sum + precise(row[i]) * &entries[i])
        };
        let cross: Vec<Precise> = self.covariance.iter().map(|entries| along(entries)).collect();
        let variance = along(&cross) + precise(noise.to_f64());
        let gain: Vec<Precise> = cross.iter().map(|entry| entry / &variance).collect();
        let innovation = precise(measured.to_f64()) - along(&self.state);
        for (i, entries) in self.covariance.iter_mut().enumerate() {
            for (entry, other) in entries.iter_mut().zip(&cross) {
                *entry -= &gain[i] * other;
            }
            self.state[i] += &gain[i] * &innovation;
        }
        (SVector::from_fn(|i, _| to_f64(&gain[i])), to_f64(&variance))
    }

    /// P, rounded.
    pub fn covariance(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| to_f64(&self.covariance[i][j]))
    }

    /// x, rounded.
    pub fn state(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| to_f64(&self.state[i]))
    }

    /// Standard error of each state.
    pub fn sigma(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| motor_model::math::sqrt(to_f64(&self.covariance[i][i])))
    }
}

fn to_f64(x: &Precise) -> f64 {
    x.to_f64().value()
}

fn product<const N: usize>(f: &SMatrix<f64, N, N>, x: &[Precise]) -> Vec<Precise> {
    (0..N)
        .map(|i| {
            (0..N).filter(|&k| f[(i, k)] != 0.0).fold(precise(0.0), |sum, k| sum + precise(f[(i, k)]) * &x[k])
        })
        .collect()
}

fn multiply(a: &[Vec<Precise>], b: &[Vec<Precise>]) -> Vec<Vec<Precise>> {
    let entry = |row: &[Precise], j: usize| {
        row.iter().zip(b).fold(precise(0.0), |sum, (x, other)| sum + x * &other[j])
    };
    a.iter().map(|row| (0..b.len()).map(|j| entry(row, j)).collect()).collect()
}
