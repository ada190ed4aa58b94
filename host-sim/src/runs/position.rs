//! `host-sim position`: one move in closed loop, what became of it, and its picture.

mod picture;
mod trace;

use std::convert::Infallible;
use std::fmt;
use std::ops::ControlFlow;

use controller::{Limits, PositionLoop, PositioningPhase, PositioningTuning, Target, TickReport};
use estimator::Estimate;
use motor_model::{Angle, DriveCommand, Time, math};
use serde::Serialize;

use crate::runs::RunError;
use crate::runs::closed_loop::{self, ClosedLoop, PositioningMoment};
use crate::scene::Scene;
pub use picture::svg;
pub use trace::Trace;

/// What became of a move.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Target angle.
    pub target_deg: f64,
    /// Tolerance asked for.
    pub tolerance_deg: f64,
    /// True angle at the end.
    pub final_angle_true_deg: f64,
    /// True angle at the end less the target.
    pub final_error_mdeg: f64,
    /// When the controller found itself at the target and stayed; `null` if it never did.
    pub settle_time_s: Option<f64>,
    /// Simulated time.
    pub duration_s: f64,
    /// How often the drive changed between off, mode B and mode C.
    pub drive_switches: u32,
    /// Time with the drive on.
    pub drive_on_s: f64,
    /// Root mean square of estimated less true angle over the whole run.
    pub rms_estimate_error_mdeg: f64,
    /// The same while the rotor moved.
    pub rms_estimate_error_moving_mdeg: f64,
    /// Farthest that the rotor went beyond the target, 0 if it did not.
    pub overshoot_deg: f64,
    /// Why the controller gave up; `null` if it did not.
    pub stopped: Option<String>,
    /// Whether the controller reached the target and the rotor truly lies within the tolerance.
    pub ok: bool,
    /// The seed of the run.
    pub seed: u64,
}

impl Outcome {
    /// The outcome as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match (&self.stopped, self.ok) {
            (Some(why), _) => format!("gave up, {why}"),
            (None, true) => "on target".to_owned(),
            (None, false) => "believed on target, but is not".to_owned(),
        };
        writeln!(
            f,
            "target             {:+.4} deg, tolerance {} deg, seed {}",
            self.target_deg, self.tolerance_deg, self.seed
        )?;
        writeln!(f, "true final angle   {:+.5} deg", self.final_angle_true_deg)?;
        writeln!(f, "error              {:+.3} mdeg: {verdict}", self.final_error_mdeg)?;
        match self.settle_time_s {
            Some(settle_time_s) => writeln!(
                f,
                "time taken         {settle_time_s:.4} s, watched until {:.4} s",
                self.duration_s
            )?,
            None => writeln!(f, "time taken         {:.4} s", self.duration_s)?,
        }
        writeln!(f, "drive              {} switches, {:.4} s on", self.drive_switches, self.drive_on_s)?;
        writeln!(f, "overshoot          {:.4} deg", self.overshoot_deg)?;
        writeln!(
            f,
            "estimator error    {:.2} mdeg rms, {:.2} while moving",
            self.rms_estimate_error_mdeg, self.rms_estimate_error_moving_mdeg
        )
    }
}

/// Runs the move of `scene`, showing every tick to `observe`.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mut observe: impl FnMut(&PositioningMoment)) -> Result<Outcome, RunError> {
    let ControlFlow::Continue(outcome) = run_with(scene, |_, moment| {
        observe(moment);
        ControlFlow::<Infallible>::Continue(())
    })?;
    Ok(outcome)
}

/// The same, and `intervene` may change the loop after every tick, or end the run with a value of its own.
///
/// # Errors
/// When the scene is refused.
pub fn run_with<B>(
    scene: &Scene,
    intervene: impl FnMut(&mut ClosedLoop, &PositioningMoment) -> ControlFlow<B>,
) -> Result<ControlFlow<B, Outcome>, RunError> {
    let limits = Limits { deadline_nanos: nanos(scene, "position.deadline_s"), ..Limits::default() };
    run_tuned(scene, PositioningTuning { limits, ..PositioningTuning::default() }, intervene)
}

/// The same, with the controller tuned otherwise.
///
/// # Errors
/// When the scene is refused.
pub fn run_tuned<B>(
    scene: &Scene,
    tuning: PositioningTuning,
    mut intervene: impl FnMut(&mut ClosedLoop, &PositioningMoment) -> ControlFlow<B>,
) -> Result<ControlFlow<B, Outcome>, RunError> {
    let target = Target::try_new(scene.number("position.to_deg"), scene.number("position.tolerance_deg"))?;
    let hold_nanos = nanos(scene, "position.hold_s");
    let mut account = Account::new(target);
    let outcome = closed_loop::positioning(scene, target, tuning)?.run(|closed_loop, moment| {
        if let ControlFlow::Break(value) = intervene(closed_loop, &moment) {
            return ControlFlow::Break(ControlFlow::Break(value));
        }
        let step = Step::of(&moment);
        account.take(&step);
        match moment.report.phase {
            PositioningPhase::Stopped(why) => {
                let outcome = account.close(&step, scene);
                let stopped = Some(format!("{why:?}"));
                ControlFlow::Break(ControlFlow::Continue(Outcome { stopped, ..outcome }))
            }
            PositioningPhase::Holding if account.held_nanos(moment.at) >= hold_nanos => {
                ControlFlow::Break(ControlFlow::Continue(account.close(&step, scene)))
            }
            _ => ControlFlow::Continue(()),
        }
    });
    Ok(outcome)
}

/// A setting in s, in ns.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the setting")]
pub fn nanos(scene: &Scene, key: &'static str) -> u64 {
    (scene.number(key) * 1e9).round() as u64
}

/// What an account is kept of, every tick.
pub(crate) struct Step {
    pub(crate) at: Time,
    pub(crate) angle: Angle,
    pub(crate) rate_rad_s: f64,
    pub(crate) estimate: Option<Estimate<f32>>,
    pub(crate) applied: DriveCommand,
    pub(crate) holding: bool,
}

impl Step {
    fn of(moment: &PositioningMoment) -> Self {
        let TickReport { estimate, applied, phase, .. } = moment.report;
        let holding = phase == PositioningPhase::Holding;
        Self { at: moment.at, angle: moment.angle, rate_rad_s: moment.rate_rad_s, estimate, applied, holding }
    }
}

/// What a run adds up to, tick by tick.
pub(crate) struct Account {
    target: Target,
    last_command: DriveCommand,
    holding_since: Option<Time>,
    drive_switches: u32,
    driven_ticks: u64,
    square_mdeg2: Mean,
    square_moving_mdeg2: Mean,
    overshoot_deg: f64,
}

#[derive(Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.sum += x;
        self.count += 1.0;
    }

    fn root(&self) -> f64 {
        math::sqrt(self.sum / self.count.max(1.0))
    }
}

impl Account {
    pub(crate) fn new(target: Target) -> Self {
        Self {
            target,
            last_command: DriveCommand::OFF,
            holding_since: None,
            drive_switches: 0,
            driven_ticks: 0,
            square_mdeg2: Mean::default(),
            square_moving_mdeg2: Mean::default(),
            overshoot_deg: 0.0,
        }
    }

    pub(crate) fn take(&mut self, step: &Step) {
        let applied = step.applied;
        self.drive_switches += u32::from(applied.mode() != self.last_command.mode());
        self.driven_ticks += u64::from(applied.mode().is_some());
        self.last_command = applied;
        self.holding_since = if step.holding { self.holding_since.or(Some(step.at)) } else { None };
        if let Some(estimate) = step.estimate {
            let error = 1e3 * estimate.angle.minus(step.angle).degrees();
            self.square_mdeg2.add(error * error);
            if step.rate_rad_s.abs() > 1e-3 {
                self.square_moving_mdeg2.add(error * error);
            }
        }
        let beyond = step.angle.minus(self.target.angle()).degrees() * self.target.angle().degrees().signum();
        self.overshoot_deg = self.overshoot_deg.max(beyond);
    }

    pub(crate) fn held_nanos(&self, now: Time) -> u64 {
        self.holding_since.map_or(0, |since| now.nanos_since(since))
    }

    pub(crate) fn close(&self, last: &Step, scene: &Scene) -> Outcome {
        let error_deg = last.angle.minus(self.target.angle()).degrees();
        let tolerance_deg = scene.number("position.tolerance_deg");
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let drive_on_s = (self.driven_ticks * PositionLoop::TICK_NANOS) as f64 * 1e-9;
        Outcome {
            target_deg: scene.number("position.to_deg"),
            tolerance_deg,
            final_angle_true_deg: last.angle.degrees(),
            final_error_mdeg: 1e3 * error_deg,
            settle_time_s: self.holding_since.map(|since| since.seconds_since(Time::ZERO)),
            duration_s: last.at.seconds_since(Time::ZERO),
            drive_switches: self.drive_switches,
            drive_on_s,
            rms_estimate_error_mdeg: self.square_mdeg2.root(),
            rms_estimate_error_moving_mdeg: self.square_moving_mdeg2.root(),
            overshoot_deg: self.overshoot_deg,
            stopped: None,
            ok: self.holding_since.is_some() && error_deg.abs() <= tolerance_deg,
            seed: scene.seed(),
        }
    }
}
