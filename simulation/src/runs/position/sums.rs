//! The sums of a move over its ticks. They give the outcome of the controller's moves, of the microcontroller's and of
//! the baselines' of a study.

use controller::{MoveForecast, PositionLoop, PositioningPhase, Target, TickReport};
use estimator::{Estimate, Health};
use motor_model::{Angle, DriveCommand, Time};

use super::waits::Waits;
use super::{MoveOutcome, plan};
use crate::math::statistics::MeanSquare;
use crate::runs::closed_loop::PositioningMoment;
use crate::runs::filter;
use crate::runs::rotor_tilt::TiltFigureSums;
use crate::runs::stated_errors::StatedErrorCounts;
use crate::scene::Scene;
use crate::world::pose::RotorTilt;

/// The values of a tick that are summed.
pub struct MoveTick {
    /// End of the tick.
    pub at: Time,
    /// The rotor's true angle.
    pub angle: Angle,
    /// Its true rate in rad/s.
    pub rate_rad_s: f64,
    /// Tilt, shift and height of a rotor that tilts.
    pub tilt: Option<RotorTilt>,
    /// The estimate; `None` before the first frame.
    pub estimate: Option<Estimate<f32>>,
    /// The drive that is applied from the end on.
    pub applied: DriveCommand,
    /// Whether the target is held.
    pub holding: bool,
    /// Phase and health of a loop that has them.
    pub loop_state: Option<(PositioningPhase, Health)>,
}

impl MoveTick {
    pub(super) fn of(moment: &PositioningMoment) -> Self {
        let TickReport { estimate, applied, phase, health, .. } = moment.report;
        let holding = phase == PositioningPhase::Holding;
        Self {
            at: moment.at,
            angle: moment.angle,
            rate_rad_s: moment.rate_rad_s,
            tilt: moment.tilt,
            estimate,
            applied,
            holding,
            loop_state: Some((phase, health)),
        }
    }

    /// The same where no decision of the move acts yet.
    pub(super) fn undecided(self) -> Self {
        Self { holding: false, loop_state: None, ..self }
    }
}

/// The sums of a move.
pub struct MoveSums {
    target: Target,
    begun_at: Time,
    begun_from: Angle,
    last_command: DriveCommand,
    holding_since: Option<Time>,
    drive_switches: u32,
    driven_ticks: u64,
    square_mdeg2: MeanSquare,
    square_moving_mdeg2: MeanSquare,
    stated: StatedErrorCounts,
    tilt: TiltFigureSums,
    overshoot_deg: f64,
    waits: Waits,
}

impl MoveSums {
    /// Sums of a move to `target` that begins with the run, before its first tick, at 0 degrees.
    pub fn new(target: Target) -> Self {
        Self::begun(target, Time::ZERO, Angle::ZERO)
    }

    /// The same of a move that begins at `begun_at`, with the rotor at `begun_from`: its times count from then on.
    pub fn begun(target: Target, begun_at: Time, begun_from: Angle) -> Self {
        Self {
            target,
            begun_at,
            begun_from,
            last_command: DriveCommand::OFF,
            holding_since: None,
            drive_switches: 0,
            driven_ticks: 0,
            square_mdeg2: MeanSquare::default(),
            square_moving_mdeg2: MeanSquare::default(),
            stated: StatedErrorCounts::default(),
            tilt: TiltFigureSums::default(),
            overshoot_deg: 0.0,
            waits: Waits::default(),
        }
    }

    /// Adds a tick.
    pub fn add(&mut self, tick: &MoveTick) {
        let applied = tick.applied;
        self.tilt.add(tick.tilt.as_ref());
        if let Some((phase, health)) = tick.loop_state {
            self.waits.add(phase, health);
        }
        self.drive_switches += u32::from(applied.mode() != self.last_command.mode());
        self.driven_ticks += u64::from(applied.mode().is_some());
        self.last_command = applied;
        self.holding_since = if tick.holding { self.holding_since.or(Some(tick.at)) } else { None };
        if let Some(estimate) = &tick.estimate {
            if let Some((_, health)) = tick.loop_state {
                self.stated.add(estimate, health, tick.angle);
            }
            let error = 1e3 * estimate.angle.minus(tick.angle).degrees();
            self.square_mdeg2.add(error);
            if tick.rate_rad_s.abs() > 1e-3 {
                self.square_moving_mdeg2.add(error);
            }
        }
        let way_deg = self.target.angle().minus(self.begun_from).degrees();
        let beyond = tick.angle.minus(self.target.angle()).degrees() * way_deg.signum();
        self.overshoot_deg = self.overshoot_deg.max(beyond);
    }

    /// Time since the move began, in ns.
    pub fn elapsed_nanos(&self, now: Time) -> u64 {
        now.nanos_since(self.begun_at)
    }

    /// Time for which the target has been held, in ns.
    pub fn held_nanos(&self, now: Time) -> u64 {
        self.holding_since.map_or(0, |since| now.nanos_since(since))
    }

    /// What was expected before the move, for the way from where it began.
    fn forecast(&self, scene: &Scene) -> Option<MoveForecast> {
        let way_deg = scene.number("position.to_deg") - self.begun_from.degrees();
        plan::forecast_of_way(scene, way_deg).ok()?.ok()
    }

    /// The outcome after the `last` tick.
    pub fn outcome(&self, last: &MoveTick, scene: &Scene) -> MoveOutcome {
        let error_deg = last.angle.minus(self.target.angle()).degrees();
        let tolerance_deg = scene.number("position.tolerance_deg");
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let drive_on_s = (self.driven_ticks * PositionLoop::TICK_NANOS) as f64 * 1e-9;
        let forecast = self.forecast(scene);
        MoveOutcome {
            target_deg: scene.number("position.to_deg"),
            tolerance_deg,
            final_angle_true_deg: last.angle.degrees(),
            final_error_mdeg: 1e3 * error_deg,
            settle_time_s: self.holding_since.map(|since| since.seconds_since(self.begun_at)),
            duration_s: last.at.seconds_since(self.begun_at),
            drive_switches: self.drive_switches,
            drive_on_s,
            rms_estimate_error_mdeg: self.square_mdeg2.root_of_some(),
            rms_estimate_error_moving_mdeg: self.square_moving_mdeg2.root_of_some(),
            stated: self.stated.figures(),
            tilt: self.tilt.figures(),
            overshoot_deg: self.overshoot_deg,
            filter: filter::chosen(scene),
            stopped: None,
            reason: None,
            expected_s: forecast.map(|forecast| forecast.time_s.into()),
            expected_sd_s: forecast.map(|forecast| forecast.time_sd_s.into()),
            hint: None,
            waited_s: self.waits.waited_s(),
            health: self.waits.health_shares(),
            frames: None,
            marks: None,
            ok: self.holding_since.is_some() && error_deg.abs() <= tolerance_deg,
            seed: scene.seed(),
        }
    }
}
