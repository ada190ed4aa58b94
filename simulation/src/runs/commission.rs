//! Commissioning in closed loop: experiments by the controller's own loop body,
//! [`controller::commissioning::tick_experiment`], on the rig, and the plan of them between the ticks.
//!
//! The prior is the scene's response map. The scene's motor is known to the loop by its instruments alone.

use std::sync::Arc;

use controller::commissioning::experiment::{Experiment, Response};
use controller::commissioning::resonance::SweepPoint;
use controller::commissioning::{
    Commissioned, Commissioning, CommissioningEnd, ExperimentPhase, ExperimentReport, Experimenter,
    tick_experiment,
};
use controller::{InFlight, ResponseMap};
use motor_model::{DriveMode, MotorParams, Parameter, Time};

use crate::runs::RunError;
use crate::runs::closed_loop;
use crate::runs::filter::AnyFilter;
use crate::runs::limits;
use crate::runs::tick_driver::{Moment, RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::world::instruments;

/// The experiments of a motor in the loop.
#[derive(Debug)]
pub struct ExperimentProgram {
    filter: AnyFilter,
    experimenter: Experimenter,
    in_flight: InFlight<ExperimentReport>,
}

impl TickProgram for ExperimentProgram {
    type Report = ExperimentReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> ExperimentReport {
        let Self { filter, experimenter, in_flight } = self;
        *tick_experiment(filter, experimenter, in_flight, now, ports)
    }
}

/// A motor that was commissioned, with the truth beside it.
#[derive(Clone, Debug)]
pub struct CommissionedMotor {
    /// What commissioning gives out.
    pub commissioned: Commissioned,
    /// The powers that the sweeps of modes B and C have shown.
    pub swept: [Vec<SweepPoint>; 2],
    /// The true motor's resonances in Hz, for modes B and C; `None` of a motor that is not simulated.
    pub true_resonances_hz: Option<[f64; 2]>,
    /// Those of the design.
    pub design_resonances_hz: [f64; 2],
    /// The map that it began with.
    pub prior: Arc<ResponseMap>,
    /// Seed of a motor that is simulated.
    pub seed: Option<u64>,
}

impl CommissionedMotor {
    /// A motor of the design of `scene`, of which `commissioning` has ended with `end` after `time_s` of its time.
    /// `true_params` are those of a motor that is simulated.
    pub fn new(
        scene: &Scene,
        prior: Arc<ResponseMap>,
        commissioning: &Commissioning,
        (end, time_s): (CommissioningEnd, f32),
        true_params: Option<&MotorParams>,
    ) -> Self {
        let hz = |params: &MotorParams| {
            [Parameter::ModeBFrequency, Parameter::ModeCFrequency].map(|parameter| params.get(parameter))
        };
        Self {
            commissioned: commissioning.result(&prior, end, time_s),
            swept: [DriveMode::B, DriveMode::C].map(|mode| commissioning.swept(mode).to_vec()),
            true_resonances_hz: true_params.map(hz),
            design_resonances_hz: hz(&scene.motor_params()),
            prior,
            seed: true_params.map(|_| scene.seed()),
        }
    }
}

/// What was planned between two ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Planned {
    /// The experiment under way goes on.
    Nothing,
    /// Another one is ordered.
    Ordered(Experiment),
    /// It is over.
    Ended(CommissioningEnd),
}

/// A motor that is being commissioned: the loop, and the plan.
#[derive(Debug)]
pub struct CommissioningRun {
    driver: TickDriver<ExperimentProgram>,
    prior: Arc<ResponseMap>,
    commissioning: Commissioning,
}

impl CommissioningRun {
    /// The motor of `scene`, at rest.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene) -> Result<Self, RunError> {
        limits::check_experiments(scene)?;
        let instruments = instruments::checked(scene)?;
        let program = ExperimentProgram {
            filter: AnyFilter::of(scene)?,
            experimenter: Experimenter::new(limits::experiment_tuning(scene, &instruments), Time::ZERO),
            in_flight: InFlight::new(),
        };
        Ok(Self {
            driver: closed_loop::on_board(scene, program)?,
            prior: scene.response_map()?,
            commissioning: Commissioning::new(&instruments),
        })
    }

    /// Runs the next tick.
    pub fn next_tick(&mut self) -> Moment<ExperimentReport> {
        self.driver.next_tick()
    }

    /// The driver, to look at it or to overrule its command.
    pub fn driver_mut(&mut self) -> &mut TickDriver<ExperimentProgram> {
        &mut self.driver
    }

    /// The response of the last experiment, and its number, once it is over.
    pub fn response(&self) -> Option<(u16, &Response)> {
        let experimenter = &self.driver.program().experimenter;
        experimenter.response().map(|response| (experimenter.number(), response))
    }

    /// Takes the response of the experiment that is over, and orders the next one.
    pub fn plan(&mut self) -> Planned {
        let Self { driver, prior, commissioning } = self;
        let experimenter = &mut driver.program_mut().experimenter;
        match experimenter.phase() {
            ExperimentPhase::Ended(end) => return Planned::Ended(end),
            ExperimentPhase::Ready => {}
            _ => return Planned::Nothing,
        }
        if let Some(response) = experimenter.response() {
            commissioning.take(prior, response);
        }
        match commissioning.next(prior) {
            Some(experiment) if experimenter.order(experiment) => Planned::Ordered(experiment),
            Some(_) => Planned::Nothing,
            None => Planned::Ended(CommissioningEnd::Enough),
        }
    }

    /// What has come of it, when it has ended with `end` after `time_s`.
    pub fn finish(self, scene: &Scene, end: CommissioningEnd, time_s: f32) -> CommissionedMotor {
        let params = *self.driver.plant().params();
        CommissionedMotor::new(scene, self.prior, &self.commissioning, (end, time_s), Some(&params))
    }
}

/// Commissions the motor of `scene`, and calls `passed` with the motor time in s every tenth of a second.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mut passed: impl FnMut(f64)) -> Result<CommissionedMotor, RunError> {
    let mut run = CommissioningRun::new(scene)?;
    let mut told = 0;
    loop {
        let moment = run.next_tick();
        let tenths = moment.at.nanos() / 100_000_000;
        if tenths > told {
            told = tenths;
            passed(moment.seconds());
        }
        if let Planned::Ended(end) = run.plan() {
            return Ok(run.finish(scene, end, moment.at.seconds_since(Time::ZERO)));
        }
    }
}
