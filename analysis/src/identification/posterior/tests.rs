//! The posterior of motors whose statistics are normal and linear in a parameter.

use super::*;
use crate::identification::parameters::Prior;
use crate::identification::training::DrawnMotor;
use motor_model::math;
use simulation::math::statistics::Spread;

/// Motors with `unknowns` parameters, of which statistic j is parameter j and noise of standard deviation `noise`.
fn motors(count: u64, seed: u64, prior: &Unknown, unknowns: usize, noise: f64) -> Vec<DrawnMotor> {
    let mut rng = stream(seed, RandomSource::IdentificationDraw);
    let mut motor = || {
        let standard: Vec<f64> = (0..unknowns).map(|_| prior.standard(prior.prior.draw(&mut rng))).collect();
        let mut noisy = |value: &f64| {
            let error: f64 = StandardNormal.sample(&mut rng);
            if noise.is_finite() { value + noise * error } else { error }
        };
        let statistics = standard.iter().map(&mut noisy).collect();
        DrawnMotor { standard, statistics }
    };
    (0..count).map(|_| motor()).collect()
}

fn unknown() -> Unknown {
    let prior = Prior::Normal { mean: 5.0, sd: 2.0 };
    Unknown { key: "motor.friction", unit: "", meaning: "", prior }
}

/// The product of prior and likelihood, integrated numerically.
#[test]
fn dual_the_posterior_of_a_linear_motor_is_that_of_bayes() {
    let unknown = unknown();
    let emulator = Emulator::learn(&motors(4000, 1, &unknown, 1, 1.0)).unwrap();
    for measured in [-1.5, 0.0, 1.0] {
        let [low, high] = unknown.prior.bounds();
        let cells = (0..2000).map(|cell| low + (f64::from(cell) + 0.5) * (high - low) / 2000.0);
        let weighted: Vec<(f64, f64)> = cells
            .map(|value| {
                let (standard, off) = (unknown.standard(value), unknown.standard(value) - measured);
                (standard, unknown.prior.density(value) * math::exp(-0.5 * off * off))
            })
            .collect();
        let sum = |of: &dyn Fn(f64) -> f64| weighted.iter().map(|(at, weight)| of(*at) * weight).sum::<f64>();
        let mean = sum(&|at| at) / sum(&|_| 1.0);
        let sd = math::sqrt(sum(&|at| (at - mean) * (at - mean)) / sum(&|_| 1.0));
        let found: Spread =
            posterior(&emulator, &[unknown], &[measured], 1).into_iter().map(|told| told[0]).collect();
        // 4000 motors tell the size of an error to 1 % and where a statistic lies to 2 % of its noise. The chain has
        // 64 members over 800 sweeps, of which some 30 are alike: 1700 independent values, a mean to 2.4 % of the
        // standard deviation and that to 1.7 %. Errors are taken to have the tails of a t distribution, by which a
        // few per cent more remain. Three standard errors, and these.
        assert!((found.mean - mean).abs() < 0.12 * sd, "{measured}: {found:?} {mean} {sd}");
        assert!((found.sd / sd - 1.0).abs() < 0.12, "{measured}: {found:?} {mean} {sd}");
    }
}

/// Statistics that have nothing to do with any parameter tell none, however few motors there are.
#[test]
fn law_noise_tells_nothing() {
    for seed in 0..20 {
        let drawn = motors(100, seed, &unknown(), 33, f64::INFINITY);
        assert!(Emulator::learn(&drawn).is_none(), "seed {seed}");
    }
}
