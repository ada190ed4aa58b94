//! Averages of a motor in steady motion.

use motor_model::{AmplitudeVariation, DriveCommand, MotorParams, MotorSetup, Real};
use rand_core::SeedableRng;
use rand_pcg::Pcg64;

use crate::support::motors::{Bench, steps_in};

/// Averages over seeds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Steady {
    /// Mean rate; clockwise is positive.
    pub rate_rad_s: f64,
    /// Impacts that approach faster than 1 mm/s: slower ones, of chattering, depend on the step.
    pub impacts_per_s: f64,
}

impl Steady {
    /// Averages over `seeds` runs of `time_s` after `settle_s`; each seed draws its own variation between the tooth
    /// pairs.
    pub fn over<T: Real>(
        params: &MotorParams,
        setup: &MotorSetup,
        command: DriveCommand,
        seeds: u8,
        (settle_s, time_s): (f64, f64),
    ) -> Self {
        let mut average = Self::default();
        for seed in 0..seeds {
            let mut bench = Bench::<T>::new(params, &varied(params, setup, seed));
            bench.run(command, settle_s);
            let origin = bench.angle_rad();
            let mut count = 0_u32;
            for _ in 0..steps_in(time_s, setup.step_s) {
                for impact in &bench.motor.step(&mut bench.state, command) {
                    count += u32::from(impact.approach_m_s.to_f64() > 1e-3);
                }
            }
            average.rate_rad_s += (bench.angle_rad() - origin) / time_s / f64::from(seeds);
            average.impacts_per_s += f64::from(count) / time_s / f64::from(seeds);
        }
        average
    }
}

/// `setup` with the variation between the tooth pairs that `seed` draws.
pub fn varied(params: &MotorParams, setup: &MotorSetup, seed: u8) -> MotorSetup {
    let mut rng = Pcg64::seed_from_u64(u64::from(seed));
    MotorSetup { variation: AmplitudeVariation::draw(params, &mut rng), ..*setup }
}
