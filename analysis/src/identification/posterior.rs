//! The parameters after the recordings: a sample of their posterior.
//!
//! Goodman and Weare's ensemble sampler (Communications in Applied Mathematics and Computational Science 5 (2010)
//! 65-80) does not mind how narrow the posterior is in any direction, as long as the ensemble begins about as wide as
//! it is: at the most likely parameters, with the curvature there.

use hammer_and_sample::{MinChainLen, Model, Serial, Stretch, sample};
use nalgebra::{Cholesky, DMatrix, DVector};
use rand_core::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::emulator::Emulator;
use super::parameters::Unknown;
use simulation::math::random_streams::{RandomSource, stream};

/// Sweeps of the ensemble that are left out at the beginning.
const BURN_IN: usize = 400;
/// Sweeps that are kept.
const SWEEPS: usize = 800;
/// Every so many sweeps are kept, each with all members of the ensemble: neighbours of a chain are alike.
const THINNING: usize = 8;
/// Fewest members of the ensemble.
const WALKERS_MIN: usize = 64;

struct Posterior<'a> {
    emulator: &'a Emulator,
    unknowns: Vec<&'a Unknown>,
    summary: DVector<f64>,
}

impl Model for Posterior<'_> {
    type Params = Vec<f64>;

    fn log_prob(&self, told: &Vec<f64>) -> f64 {
        let prior: f64 = self
            .unknowns
            .iter()
            .zip(told)
            .map(|(unknown, standard)| unknown.prior.log_density(unknown.value(*standard)))
            .sum();
        if prior.is_finite() { prior + self.emulator.log_likelihood(&self.summary, told) } else { prior }
    }
}

impl Posterior<'_> {
    /// Smallest and largest value of a parameter, a little inside the prior's.
    fn bounds(&self, number: usize) -> [f64; 2] {
        let [low, high] =
            self.unknowns[number].prior.bounds().map(|bound| self.unknowns[number].standard(bound));
        let margin = 1e-3 * (high - low);
        [low + margin, high - margin]
    }

    fn inside(&self, told: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(told.len(), |number, _| {
            let [low, high] = self.bounds(number);
            told[number].clamp(low, high)
        })
    }

    /// Whitened errors and their derivatives.
    fn linearised(&self, told: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        const STEP: f64 = 1e-4;
        let error = |told: &DVector<f64>| {
            self.emulator.whitened(&(&self.summary - self.emulator.mean(told.as_slice())))
        };
        let here = error(told);
        let mut slopes = DMatrix::zeros(here.len(), told.len());
        for number in 0..told.len() {
            let mut moved = told.clone();
            moved[number] += STEP;
            slopes.set_column(number, &((error(&moved) - &here) / STEP));
        }
        (here, slopes)
    }

    /// The most likely parameters, and the factor of the inverse of the curvature there.
    fn mode(&self) -> (DVector<f64>, DMatrix<f64>) {
        let width = self.unknowns.len();
        let mut told = DVector::zeros(width);
        let mut precision = DMatrix::identity(width, width);
        for _ in 0..30 {
            let (error, slopes) = self.linearised(&told);
            // The prior has unit variance.
            precision = slopes.tr_mul(&slopes) + DMatrix::identity(width, width);
            let gradient = slopes.tr_mul(&error) + &told;
            let Some(factor) = Cholesky::new(precision.clone()) else { break };
            let next = self.inside(&(&told - factor.solve(&gradient)));
            let change = (&next - &told).norm();
            told = next;
            if change < 1e-9 {
                break;
            }
        }
        let spread = precision.try_inverse().and_then(Cholesky::new).map(|factor| factor.l());
        (told, spread.unwrap_or_else(|| DMatrix::identity(width, width)))
    }
}

/// A sample of the posterior of the told parameters, in standard deviations of the prior. `seed` names its random
/// numbers.
pub fn posterior(emulator: &Emulator, unknowns: &[Unknown], statistics: &[f64], seed: u64) -> Vec<Vec<f64>> {
    let posterior = Posterior {
        emulator,
        unknowns: emulator.told.iter().filter_map(|number| unknowns.get(*number)).collect(),
        summary: emulator.summary(statistics),
    };
    let (mode, spread) = posterior.mode();
    let walkers = (4 * mode.len()).max(WALKERS_MIN);
    let mut starts = stream(seed, RandomSource::IdentificationChain);
    let first = (0_u64..walkers as u64).map(|walker| {
        let normal = DVector::from_fn(mode.len(), |_, _| StandardNormal.sample(&mut starts));
        let start = posterior.inside(&(&mode + &spread * normal));
        let rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(walker));
        (start.as_slice().to_vec(), rng)
    });
    let first: Vec<_> = first.collect();
    let length = MinChainLen(walkers * (BURN_IN + SWEEPS));
    let (chain, _) = sample(&posterior, &Stretch::default(), first.into_iter(), length, Serial);
    chain.chunks(walkers).skip(BURN_IN).step_by(THINNING).flatten().cloned().collect()
}

#[cfg(test)]
mod tests;
