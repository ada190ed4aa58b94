//! Identification of the averaged motor ([`motor_model::AveragedMotor`]) from the full one.
//!
//! `n` spin-ups of length `T` start from rest, each at its own phase of the drive. The settling time `t_s` is long
//! against `tau`:
//!
//! ```text
//! w   = mean of (angle(T) - angle(t_s)) / (T - t_s)
//! tau = t_s - mean of angle(t_s) / w                     the lag of a first-order rise, at its end
//! D   = var(angle over a block) / (2 length of a block)  blocks long against tau
//! ```

mod long_moves;

use motor_model::{
    DriveCommand, MeanMotion, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Phase, math,
};
use rand_core::Rng;
use rayon::prelude::*;
use serde::Serialize;

use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::{Accumulator, Spread};
use simulation::runs::simulate::steps_in;

pub use long_moves::{AveragedReport, long_moves};

/// The spin-ups from which the averaged motor is identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinUpCampaign {
    /// Number of spin-ups, at least 2.
    pub runs: u32,
    /// Settling time `t_s` in s.
    pub settle_s: f64,
    /// Length of a block in s, long against `tau`.
    pub block_s: f64,
    /// Number of blocks of a spin-up, at least 2.
    pub blocks: u32,
}

impl Default for SpinUpCampaign {
    /// About 200 s of simulated time.
    fn default() -> Self {
        Self { runs: 64, settle_s: 0.2, block_s: 0.1, blocks: 30 }
    }
}

/// The parameters of the averaged motor, each with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IdentifiedMotion {
    /// Mean rate in rad/s.
    pub rate_rad_s: f64,
    /// Its standard error.
    pub rate_error_rad_s: f64,
    /// Time constant in s.
    pub time_constant_s: f64,
    /// Its standard error.
    pub time_constant_error_s: f64,
    /// Diffusion of the angle in rad^2/s.
    pub diffusion_rad2_s: f64,
    /// Its standard error, for normal displacements.
    pub diffusion_error_rad2_s: f64,
}

impl IdentifiedMotion {
    /// The parameters for [`motor_model::AveragedMotor`]. A lag that noise has made negative counts as none.
    pub fn motion(&self) -> MeanMotion {
        let Self { rate_rad_s, time_constant_s, diffusion_rad2_s, .. } = *self;
        MeanMotion { rate_rad_s, time_constant_s: time_constant_s.max(1e-6), diffusion_rad2_s }
    }
}

/// One spin-up: the angle turned in the settling time, and in each block, in rad.
struct SpinUp {
    settled_rad: f64,
    blocks_rad: Vec<f64>,
}

impl SpinUpCampaign {
    /// Identifies the motor of `params` and `setup` under `command`.
    ///
    /// # Errors
    /// When the motor's set-up is out of its bounds.
    pub fn identify(
        &self,
        params: &MotorParams,
        setup: &MotorSetup,
        command: DriveCommand,
        seed: u64,
    ) -> Result<IdentifiedMotion, OutOfBounds> {
        Ok(self.summary(&self.spin_ups(params, setup, command, seed)?))
    }

    /// Mean and spread over the spin-ups of the angle turned in the settling time, in rad.
    ///
    /// # Errors
    /// As [`Self::identify`].
    pub fn settled_rad(
        &self,
        params: &MotorParams,
        setup: &MotorSetup,
        command: DriveCommand,
        seed: u64,
    ) -> Result<Spread, OutOfBounds> {
        Ok(self.spin_ups(params, setup, command, seed)?.iter().map(|up| up.settled_rad).collect())
    }

    fn spin_ups(
        &self,
        params: &MotorParams,
        setup: &MotorSetup,
        command: DriveCommand,
        seed: u64,
    ) -> Result<Vec<SpinUp>, OutOfBounds> {
        let motor = Motor::<f64>::try_new(params, setup)?;
        let run = |run: u32| self.spin_up(&motor, command, seed.wrapping_add(u64::from(run)));
        Ok((0..self.runs).into_par_iter().map(run).collect())
    }

    fn spin_up(&self, motor: &Motor<f64>, command: DriveCommand, seed: u64) -> SpinUp {
        let phase = Phase::from_units(stream(seed, RandomSource::StartPhase).next_u64());
        let mut state = MotorState { phase, ..MotorState::default() };
        let mut turn = |time_s: f64| {
            let before = state.rotor.angle.angle();
            for _ in 0..steps_in(time_s, motor.step_s()) {
                motor.step(&mut state, command);
            }
            state.rotor.angle.angle().minus(before).degrees().to_radians()
        };
        SpinUp {
            settled_rad: turn(self.settle_s),
            blocks_rad: (0..self.blocks).map(|_| turn(self.block_s)).collect(),
        }
    }

    fn summary(&self, spin_ups: &[SpinUp]) -> IdentifiedMotion {
        let runs = f64::from(self.runs);
        let of_runs: Spread = spin_ups
            .iter()
            .map(|up| up.blocks_rad.iter().sum::<f64>() / (f64::from(self.blocks) * self.block_s))
            .collect();
        let settled: Spread = spin_ups.iter().map(|up| up.settled_rad).collect();
        let rate = of_runs.mean;
        // The variance within each run: means that differ from run to run do not count as diffusion.
        let mut variance = Accumulator::default();
        for up in spin_ups {
            let blocks: Spread = up.blocks_rad.iter().copied().collect();
            variance.add(blocks.sd * blocks.sd);
        }
        let variance = variance.spread();
        let standard_error = |spread: Spread| spread.sd / math::sqrt(runs);
        IdentifiedMotion {
            rate_rad_s: rate,
            rate_error_rad_s: standard_error(of_runs),
            time_constant_s: self.settle_s - settled.mean / rate,
            time_constant_error_s: standard_error(settled) / rate.abs(),
            diffusion_rad2_s: variance.mean / (2.0 * self.block_s),
            diffusion_error_rad2_s: standard_error(variance) / (2.0 * self.block_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{AveragedMotor, AveragedState, DriveMode};

    /// The parameters of an averaged motor are identified within four standard errors.
    #[test]
    fn dual_an_averaged_motor_is_identified() {
        let truth = MeanMotion { rate_rad_s: -1.5, time_constant_s: 0.012, diffusion_rad2_s: 4e-4 };
        let campaign = SpinUpCampaign { runs: 200, ..SpinUpCampaign::default() };
        let motor = AveragedMotor::try_new(&truth, 1e-3).unwrap();
        let spin_up = |seed| {
            let (mut state, mut rng) = (AveragedState::default(), stream(seed, RandomSource::StartPhase));
            let mut turn = |steps: u32| {
                let before = state.angle.angle();
                (0..steps).for_each(|_| motor.step(&mut state, &mut rng));
                state.angle.angle().minus(before).degrees().to_radians()
            };
            SpinUp { settled_rad: turn(200), blocks_rad: (0..campaign.blocks).map(|_| turn(100)).collect() }
        };
        let spin_ups: Vec<SpinUp> = (0..u64::from(campaign.runs)).map(spin_up).collect();
        let found = campaign.summary(&spin_ups);
        assert!((found.rate_rad_s + 1.5).abs() < 4.0 * found.rate_error_rad_s, "{found:?}");
        assert!((found.time_constant_s - 0.012).abs() < 4.0 * found.time_constant_error_s, "{found:?}");
        // The noise of the rate is correlated over tau: a block of 0.1 s has 1 - tau / block of the diffusion.
        let expected = 4e-4 * (1.0 - 0.12);
        assert!((found.diffusion_rad2_s - expected).abs() < 4.0 * found.diffusion_error_rad2_s, "{found:?}");
        assert!(found.diffusion_error_rad2_s < 0.05 * found.diffusion_rad2_s, "{found:?}");
    }

    /// In 1 s the full motor and the identified one turn equally far, in mean and spread of 64 moves.
    #[test]
    fn dual_long_moves_go_as_far_as_the_full_motor() {
        let (params, setup) = (MotorParams::nominal(), MotorSetup::with_step(10e-6));
        for mode in [DriveMode::B, DriveMode::C] {
            let command = DriveCommand::full(mode);
            let found = SpinUpCampaign::default().identify(&params, &setup, command, 1).unwrap();
            // A second from rest, with seeds that the identification does not use.
            let check = SpinUpCampaign { runs: 64, settle_s: 1.0, block_s: 0.1, blocks: 0 };
            let full = check.settled_rad(&params, &setup, command, 1000).unwrap();
            let expected = found.rate_rad_s * (1.0 - found.time_constant_s);
            let sd = math::sqrt(2.0 * found.diffusion_rad2_s);
            assert!(
                (full.mean - expected).abs() < 4.0 * sd / 8.0 + 4.0 * found.rate_error_rad_s,
                "{mode:?} {full:?} {found:?}"
            );
            // The standard error of a standard deviation of 64 values is 9 %.
            assert!((full.sd / sd - 1.0).abs() < 0.4, "{mode:?} {full:?} {sd} {found:?}");
            assert!(found.time_constant_s > 0.0 && found.time_constant_s < 0.1, "{found:?}");
        }
    }
}
