//! Long moves of the averaged motor, after its identification from the full motor of the same scene.

use std::fmt;
use std::time::Instant;

use motor_model::{AveragedMotor, AveragedState, ImpactRule};
use serde::Serialize;

use super::{IdentifiedMotion, SpinUpCampaign};
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::{Accumulator, Spread};
use simulation::runs::RunError;
use simulation::runs::simulate::{OpenLoopRun, drive_name};
use simulation::scene::SceneError;

/// Step of the full motor in s: with located impacts its mean rate is that of far smaller steps.
const SPIN_UP_STEP_S: f64 = 10e-6;
/// Moves from rest, which differ in their random numbers.
const MOVES: u32 = 1000;
/// Longest step of the averaged motor in s: a shorter move is one step.
const STEP_MAX_S: f64 = 1e3;

/// The result of many moves with the settings that made them; JSON by its field names. Clockwise is positive.
#[derive(Clone, Debug, Serialize)]
pub struct AveragedReport {
    model: &'static str,
    drive: &'static str,
    amplitude: f32,
    duration_s: f64,
    seed: u64,
    /// Spin-ups of the full motor, their time in all, and its step.
    spin_ups: u32,
    spin_ups_s: f64,
    spin_up_step_s: f64,
    identified: IdentifiedMotion,
    moves: u32,
    /// Over moves: the rate at the end, and the angle turned.
    rotor_rate_rad_s: Spread,
    angle_deg: Spread,
    /// Steps of all moves, and the time that they took on this machine.
    steps: u32,
    wall_s: f64,
}

/// Identifies the motor of `run` under its drive, and makes moves of the run's duration with the averaged motor.
///
/// # Errors
/// When the full motor does not turn steadily under the drive, so that it has no mean motion.
pub fn long_moves(run: &OpenLoopRun) -> Result<AveragedReport, RunError> {
    let campaign = SpinUpCampaign::default();
    if run.drive.amplitude() <= 0.0 {
        return Err(no_mean_motion("the drive is off"));
    }
    let setup = OpenLoopRun { step_s: SPIN_UP_STEP_S, impact_rule: ImpactRule::Located, ..*run }.setup();
    let identified = campaign.identify(&run.params, &setup, run.drive, run.seed)?;
    let IdentifiedMotion { rate_rad_s, rate_error_rad_s, time_constant_s, time_constant_error_s, .. } =
        identified;
    // Four standard errors; and the settling time must be long against the time constant.
    let is_lag = time_constant_s > -4.0 * time_constant_error_s && time_constant_s < 0.25 * campaign.settle_s;
    let is_steady = rate_rad_s.abs() > 4.0 * rate_error_rad_s && is_lag;
    if !is_steady {
        return Err(no_mean_motion(&format!(
            "the full motor turns at {rate_rad_s:.1e} +- {rate_error_rad_s:.1e} rad/s, with a time constant of \
             {time_constant_s:.1e} +- {time_constant_error_s:.1e} s"
        )));
    }

    let start = Instant::now();
    let per_move = (1..=1000).find(|&steps| run.duration_s <= STEP_MAX_S * f64::from(steps)).unwrap_or(1);
    let motor = AveragedMotor::try_new(&identified.motion(), run.duration_s / f64::from(per_move))?;
    let mut rng = stream(run.seed, RandomSource::AveragedMotion);
    let (mut rate_rad_s, mut angle_deg) = (Accumulator::default(), Accumulator::default());
    for _ in 0..MOVES {
        let mut state = AveragedState::default();
        (0..per_move).for_each(|_| motor.step(&mut state, &mut rng));
        rate_rad_s.add(state.rate_rad_s);
        angle_deg.add(state.angle.angle().degrees());
    }
    Ok(AveragedReport {
        model: "averaged",
        drive: drive_name(run.drive),
        amplitude: run.drive.amplitude(),
        duration_s: run.duration_s,
        seed: run.seed,
        spin_ups: campaign.runs,
        spin_ups_s: f64::from(campaign.runs)
            * (campaign.settle_s + f64::from(campaign.blocks) * campaign.block_s),
        spin_up_step_s: SPIN_UP_STEP_S,
        identified,
        moves: MOVES,
        rotor_rate_rad_s: rate_rad_s.spread(),
        angle_deg: angle_deg.spread(),
        steps: MOVES * per_move,
        wall_s: start.elapsed().as_secs_f64(),
    })
}

fn no_mean_motion(why: &str) -> RunError {
    let conflict = format!("simulate.model = averaged has no mean motion: {why}");
    SceneError::Conflict { conflict, hint: "a stronger drive, or simulate.model=motor".to_owned() }.into()
}

impl fmt::Display for AveragedReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { drive, amplitude, seed, duration_s, moves, identified, steps, wall_s, .. } = self;
        writeln!(f, "averaged motor, drive {drive}, amplitude {amplitude}, seed {seed}\n")?;
        let (spin_ups, time_s, step_us) = (self.spin_ups, self.spin_ups_s, 1e6 * self.spin_up_step_s);
        writeln!(f, "from {spin_ups} spin-ups of the full motor, {time_s:.1} s in steps of {step_us} us:")?;
        let (rate, error) = (identified.rate_rad_s, identified.rate_error_rad_s);
        writeln!(f, "mean rate       {rate:+.4} +- {error:.4} rad/s, clockwise positive")?;
        let (lag_ms, error_ms) = (1e3 * identified.time_constant_s, 1e3 * identified.time_constant_error_s);
        writeln!(f, "time constant   {lag_ms:.2} +- {error_ms:.2} ms")?;
        let (diffusion, error) = (identified.diffusion_rad2_s, identified.diffusion_error_rad2_s);
        writeln!(f, "diffusion       {diffusion:.3e} +- {error:.1e} rad^2/s\n")?;
        writeln!(f, "{moves} moves of {duration_s} s from rest, +- the standard deviation over moves:")?;
        let Self { rotor_rate_rad_s: rate, angle_deg: turned, .. } = self;
        writeln!(f, "rate at the end {:+.4} +- {:.4} rad/s", rate.mean, rate.sd)?;
        writeln!(f, "turned          {:+.3} +- {:.3} deg\n", turned.mean, turned.sd)?;
        let nanoseconds = 1e9 * wall_s / f64::from(*steps);
        writeln!(f, "{steps} steps in {wall_s:.6} s: {nanoseconds:.1} ns a step")
    }
}
