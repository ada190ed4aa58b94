//! Commissioning in closed loop: the controller's own loop body, [`controller::commissioning::tick_commissioning`], on
//! the rig.
//!
//! The prior is the scene's response map. The scene's motor is known to the loop by its instruments alone.

use std::ops::ControlFlow;
use std::sync::Arc;

use controller::ResponseMap;
use controller::commissioning::resonance::SweepPoint;
use controller::commissioning::{
    Commissioned, Commissioning, CommissioningReport, CommissioningTick, CommissioningTuning,
    tick_commissioning,
};
use motor_model::{DriveMode, Parameter, Time};

use crate::runs::RunError;
use crate::runs::filter::AnyFilter;
use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::world::instruments::assumed;

/// A filter and the state machine.
struct CommissioningProgram {
    filter: AnyFilter,
    prior: Arc<ResponseMap>,
    commissioning: Commissioning,
}

impl TickProgram for CommissioningProgram {
    type Report = CommissioningReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> CommissioningReport {
        let Self { filter, prior, commissioning } = self;
        tick_commissioning(&mut CommissioningTick { prior, filter, commissioning }, now, ports)
    }
}

/// A motor that was commissioned, with the truth beside it.
#[derive(Clone, Debug)]
pub struct CommissionedMotor {
    /// What commissioning gives out.
    pub commissioned: Commissioned,
    /// The powers that the sweeps of modes B and C have shown.
    pub swept: [Vec<SweepPoint>; 2],
    /// The true motor's resonances in Hz, and those of the design, for modes B and C.
    pub true_resonances_hz: [f64; 2],
    /// The design's.
    pub design_resonances_hz: [f64; 2],
    /// The map that it began with.
    pub prior: Arc<ResponseMap>,
    /// Seed of the motor.
    pub seed: u64,
}

/// Commissions the motor of `scene`, and calls `passed` with the motor time in s every tenth of a second.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mut passed: impl FnMut(f64)) -> Result<CommissionedMotor, RunError> {
    let prior = scene.response_map()?;
    let tuning = CommissioningTuning::new(&assumed(scene).checked()?);
    let program = CommissioningProgram {
        filter: AnyFilter::of(scene)?,
        prior: prior.clone(),
        commissioning: Commissioning::new(tuning, Time::ZERO),
    };
    let mut driver = TickDriver::new(scene, program)?;
    let mut told = 0;
    let commissioned = driver.run(|driver, moment| {
        let tenths = moment.at.nanos() / 100_000_000;
        if tenths > told {
            told = tenths;
            passed(moment.seconds());
        }
        let CommissioningProgram { prior, commissioning, .. } = driver.program();
        commissioning.result(prior).map_or(ControlFlow::Continue(()), ControlFlow::Break)
    });
    let resonances = [Parameter::ModeBFrequency, Parameter::ModeCFrequency];
    let swept = |mode| driver.program().commissioning.swept(mode).to_vec();
    Ok(CommissionedMotor {
        commissioned,
        swept: [swept(DriveMode::B), swept(DriveMode::C)],
        true_resonances_hz: resonances.map(|parameter| driver.plant().params().get(parameter)),
        design_resonances_hz: resonances.map(|parameter| scene.motor_params().get(parameter)),
        prior,
        seed: scene.seed(),
    })
}
