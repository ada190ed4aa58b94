//! Where the points of a sweep lie: a grid, random numbers, or a Sobol sequence. Each point follows from its number.
//!
//! Point `n` of the Sobol sequence in dimension `j` is the exclusive or of direction numbers `v_ji` (Joe and Kuo, SIAM
//! Journal on Scientific Computing 30 (2008) 2635-2654), one for each bit `i` of the Gray code of `n`, and of a random
//! number `s_j`, the same for all points:
//!
//! ```text
//! x_j = (v_j1 g_1 ^ v_j2 g_2 ^ ... ^ s_j) / 2^64          g = n ^ (n >> 1)
//! ```
//!
//! This shift, which the seed names, keeps the points as even as they are (Owen, "Quasi-Monte Carlo sampling", 2003).

use rand_core::Rng as _;
use rand_pcg::Pcg64;
use serde::Serialize;
use sobol::Sobol;
use sobol::params::JoeKuoD6;

use simulation::math::count::real;
use simulation::math::random_streams::{RandomSource, stream};

/// Bits of a place: those of an `f64`.
const BITS: usize = 53;

/// Dimensions of the sequence at most: those of the smallest table of direction numbers.
pub(super) const SOBOL_DIMENSIONS: usize = 100;

/// How the points of a sweep are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Every value of each axis with every value of the others.
    Grid,
    /// So many points, independent and uniform.
    Random(u64),
    /// So many points of a Sobol sequence.
    Sobol(u64),
    /// So many base points of Sobol's indices, each of which takes two points and one for each key: see
    /// [`super::indices`].
    Indices(u64),
}

/// Places of points in the unit cube.
#[derive(Clone, Debug)]
pub(super) enum Places {
    Random(Pcg64),
    /// Direction numbers of each dimension, and its shift.
    Sobol(Vec<(Vec<u64>, u64)>),
}

impl Places {
    /// Independent uniform places that `seed` names.
    pub(super) fn random(seed: u64) -> Self {
        Self::Random(stream(seed, RandomSource::SweepPoints))
    }

    /// A Sobol sequence of at most [`SOBOL_DIMENSIONS`] dimensions, shifted as `seed` says.
    pub(super) fn sobol(seed: u64, dimensions: usize) -> Self {
        let mut shifts = stream(seed, RandomSource::SweepPoints);
        let directions = Sobol::<f64>::init_direction_vals(dimensions, BITS, &JoeKuoD6::minimal());
        Self::Sobol(directions.into_iter().map(|of_one| (of_one, shifts.next_u64())).collect())
    }

    /// The place of point `number`, each coordinate within 0 to 1 without the 1.
    pub(super) fn of(&self, number: u64, dimensions: usize) -> Vec<f64> {
        match self {
            Self::Random(first) => {
                let mut stream = first.clone();
                stream.advance(u128::from(number) * dimensions as u128);
                (0..dimensions).map(|_| unit(stream.next_u64())).collect()
            }
            Self::Sobol(axes) => {
                let gray = number ^ (number >> 1);
                let one = |(directions, shift): &(Vec<u64>, u64)| {
                    let set = directions.iter().enumerate().filter(|(bit, _)| gray >> bit & 1 == 1);
                    unit(set.fold(*shift, |place, (_, direction)| place ^ direction))
                };
                axes.iter().map(one).collect()
            }
        }
    }
}

/// The first 53 bits as a number of 0 to 1.
fn unit(bits: u64) -> f64 {
    real(bits >> (64 - BITS)) / real(1_u64 << BITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without its shift it is the sequence that the crate's own generator gives; with it, the first 2^k points have
    /// one in each of the 2^k slices of every axis.
    #[test]
    fn exact_any_point_of_the_sequence_follows_from_its_number() {
        let Places::Sobol(axes) = Places::sobol(7, 5) else { panic!() };
        let plain = Places::Sobol(axes.iter().map(|(directions, _)| (directions.clone(), 0)).collect());
        for (number, expected) in (0..1000).zip(Sobol::<f64>::new(5, &JoeKuoD6::minimal())) {
            assert_eq!(plain.of(number, 5), expected, "{number}");
        }
        let shifted = Places::sobol(7, 5);
        assert_ne!(shifted.of(0, 5), Places::sobol(8, 5).of(0, 5), "another seed");
        for axis in 0..5 {
            let mut slices: Vec<u32> = (0..256)
                .map(|number| {
                    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 256")]
                    let slice = (shifted.of(number, 5)[axis] * 256.0) as u32;
                    slice
                })
                .collect();
            slices.sort_unstable();
            assert_eq!(slices, (0..256).collect::<Vec<_>>(), "axis {axis}");
        }
    }

    /// Point by point the random places are one stream.
    #[test]
    fn exact_random_points_are_one_stream() {
        let mut stream = stream(3, RandomSource::SweepPoints);
        let places = Places::random(3);
        for number in 0..50 {
            let expected: Vec<f64> = (0..3).map(|_| unit(stream.next_u64())).collect();
            assert_eq!(places.of(number, 3), expected);
        }
    }
}
