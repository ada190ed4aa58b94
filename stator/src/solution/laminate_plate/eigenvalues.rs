//! The lowest eigenvalues of `K x = lambda M x`, both symmetric with a profile, by subspace iteration.

use nalgebra::DMatrix;

use super::grid::Unknowns;

/// The lower half of a symmetric matrix: of each row the entries from its first one to the diagonal.
#[derive(Clone)]
pub(super) struct Skyline {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Skyline {
    pub(super) fn new(unknowns: &Unknowns) -> Self {
        let first = unknowns.first.clone();
        let rows = first.iter().enumerate().map(|(row, first)| vec![0.0; row + 1 - first]).collect();
        Self { first, rows }
    }

    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column - self.first[row]] += value;
    }

    /// The factor L of `L L'`.
    fn factor(mut self) -> Self {
        for row in 0..self.rows.len() {
            let (done, rest) = self.rows.split_at_mut(row);
            let (own, begin) = (&mut rest[0], self.first[row]);
            for column in begin..row {
                let other = &done[column];
                let from = begin.max(self.first[column]);
                let (left, right) = (&own[from - begin..column - begin], &other[from - self.first[column]..]);
                let product: f64 = left.iter().zip(right).map(|(a, b)| a * b).sum();
                own[column - begin] = (own[column - begin] - product) / other[other.len() - 1];
            }
            let last = own.len() - 1;
            let square: f64 = own[..last].iter().map(|value| value * value).sum();
            assert!(own[last] > square, "stiffness is not positive at unknown {row}");
            own[last] = libm::sqrt(own[last] - square);
        }
        self
    }

    /// `x <- (L L')^-1 x`.
    fn solve(&self, x: &mut [f64]) {
        for (row, own) in self.rows.iter().enumerate() {
            let (last, begin) = (own.len() - 1, self.first[row]);
            let product: f64 = own[..last].iter().zip(&x[begin..row]).map(|(a, b)| a * b).sum();
            x[row] = (x[row] - product) / own[last];
        }
        for (row, own) in self.rows.iter().enumerate().rev() {
            let (last, begin) = (own.len() - 1, self.first[row]);
            x[row] /= own[last];
            let value = x[row];
            for (x, entry) in x[begin..row].iter_mut().zip(own) {
                *x -= entry * value;
            }
        }
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for (row, own) in self.rows.iter().enumerate() {
            let begin = self.first[row];
            for (column, entry) in (begin..=row).zip(own) {
                product[row] += entry * x[column];
                if column < row {
                    product[column] += entry * x[row];
                }
            }
        }
        product
    }
}

/// Vectors beyond those that are asked for, and rounds: the error of an eigenvalue falls by the square of its ratio to
/// the first one that is left out, each round.
const MORE: usize = 5;
const ROUNDS: usize = 12;

/// The lowest `count` eigenvalues, rising.
pub(super) fn lowest(stiffness: &Skyline, mass: &Skyline, count: usize) -> Vec<f64> {
    let (size, width) = (stiffness.first.len(), count + MORE);
    let factor = stiffness.clone().factor();
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 33).unwrap()) / f64::from(1_u32 << 31) - 0.5
    };
    let mut vectors: Vec<Vec<f64>> = (0..width).map(|_| (0..size).map(|_| random()).collect()).collect();
    let mut values = Vec::new();
    for _ in 0..ROUNDS {
        let forces: Vec<Vec<f64>> = vectors.iter().map(|vector| mass.times(vector)).collect();
        vectors.clone_from(&forces);
        for vector in &mut vectors {
            factor.solve(vector);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let carried: Vec<Vec<f64>> = vectors.iter().map(|vector| mass.times(vector)).collect();
        let small_stiffness = DMatrix::from_fn(width, width, |i, j| dot(&vectors[i], &forces[j]));
        let small_mass = DMatrix::from_fn(width, width, |i, j| dot(&vectors[i], &carried[j]));
        // With K = L L' the small problem is that of L^-1 M L'^-1, whose eigenvalues are the inverse ones.
        let half = (0.5 * (&small_stiffness + small_stiffness.transpose())).cholesky().unwrap().l();
        let inverse = half.try_inverse().unwrap();
        let eigen = (&inverse * small_mass * inverse.transpose()).symmetric_eigen();
        let mut order: Vec<usize> = (0..width).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        values = order.iter().map(|place| 1.0 / eigen.eigenvalues[*place]).collect();
        let mix = inverse.transpose() * &eigen.eigenvectors;
        let mixed = |place: &usize| {
            let mut vector = vec![0.0; size];
            for (of, share) in vectors.iter().zip(mix.column(*place).iter()) {
                vector.iter_mut().zip(of).for_each(|(sum, value)| *sum += share * value);
            }
            vector
        };
        vectors = order.iter().map(mixed).collect();
    }
    values.truncate(count);
    values
}
