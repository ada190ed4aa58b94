//! The averaged motor beside the full one, on long moves. It has no single impacts.

use std::hint::black_box;
use std::time::Instant;

use motor_model::{AveragedMotor, AveragedState, MotorParams, MotorSetup, math};
use serde::Serialize;

use super::method::TARGET_STEP_S;
use super::steady_motion::{CONDITIONS, DriveCondition};
use super::step_cost::{StepCost, least_times_s};
use crate::averaged_motor::{IdentifiedMotion, SpinUpCampaign};
use simulation::math::random_streams::{RandomSource, stream};
use simulation::runs::RunError;

/// Step of the averaged motor.
pub const STEP_S: f64 = 0.1;
/// Length of a move in steps of the averaged motor.
const MOVE_STEPS: u32 = 10;
/// First seed of the moves. The identification does not use it nor the seeds after it.
const FIRST_MOVE_SEED: u64 = 1_000_000;

/// The averaged motor under one condition.
#[derive(Clone, Debug, Serialize)]
pub struct AveragedRow {
    /// Such as `B` or `C 0.3`.
    pub condition: String,
    /// The parameters that were identified from the full motor.
    pub identified: IdentifiedMotion,
    /// Error of the mean of moves of 1 s from rest, relative to the full motor's mean.
    pub move_relative: f64,
    /// Two standard errors of that error.
    pub move_half_width: f64,
    /// Standard deviation of such moves over that of the full motor's moves.
    pub spread_ratio: f64,
    /// Cost of a step of 0.1 s.
    pub cost: StepCost,
}

/// One row for each condition.
///
/// # Errors
/// Never, unless the bounds of the parameters are changed.
pub fn rows(campaign: &SpinUpCampaign, rounds: u32) -> Result<Vec<AveragedRow>, RunError> {
    CONDITIONS.iter().map(|&condition| row(condition, campaign, rounds)).collect()
}

fn row(condition: DriveCondition, campaign: &SpinUpCampaign, rounds: u32) -> Result<AveragedRow, RunError> {
    let (params, setup, command) =
        (MotorParams::nominal(), MotorSetup::with_step(TARGET_STEP_S), condition.command());
    let identified = campaign.identify(&params, &setup, command, 1)?;
    // Moves of the full motor, with seeds of their own.
    let moves = SpinUpCampaign { settle_s: STEP_S * f64::from(MOVE_STEPS), blocks: 0, ..*campaign };
    let full = moves.settled_rad(&params, &setup, command, FIRST_MOVE_SEED)?;
    let motion = identified.motion();
    let move_s = STEP_S * f64::from(MOVE_STEPS);
    let coast = -motion.time_constant_s * math::exp_m1(-move_s / motion.time_constant_s);
    let mean_rad = motion.rate_rad_s * (move_s - coast);
    let sd_rad = math::sqrt(2.0 * motion.diffusion_rad2_s * move_s);
    let identified_rad = identified.rate_error_rad_s * move_s;
    let known = math::sqrt(full.sd * full.sd / f64::from(campaign.runs) + identified_rad * identified_rad);
    Ok(AveragedRow {
        condition: condition.name(),
        identified,
        move_relative: (mean_rad - full.mean) / full.mean.abs(),
        move_half_width: 2.0 * known / full.mean.abs(),
        spread_ratio: sd_rad / full.sd,
        cost: cost(&AveragedMotor::try_new(&motion, STEP_S)?, rounds)?,
    })
}

fn cost(motor: &AveragedMotor, rounds: u32) -> Result<StepCost, RunError> {
    const STEPS: u32 = 100_000;
    let least = least_times_s(1, rounds, |_| {
        let (mut state, mut rng) = (AveragedState::default(), stream(1, RandomSource::StartPhase));
        let start = Instant::now();
        for _ in 0..STEPS {
            motor.step(&mut state, &mut rng);
        }
        let taken_s = start.elapsed().as_secs_f64();
        black_box(state);
        Ok::<f64, RunError>(taken_s)
    })?;
    Ok(StepCost::new(STEP_S, STEP_S * f64::from(STEPS), least.iter().sum()))
}
