//! The loop body of commissioning: fuse what arrived, estimate, decide, drive.

use estimator::{AngleFilter, CameraFrame, Estimate, Health, LdvSample};
use motor_model::{DriveCommand, Time};

use super::{Commissioning, CommissioningStage};
use crate::ports::{Drive, Sense};
use crate::response_map::ResponseMap;
use crate::tick::{Fused, fuse};

/// The sensors, of which commissioning hears the vibrometer as well.
struct Heard<'a, P> {
    ports: &'a mut P,
    commissioning: &'a mut Commissioning,
}

impl<P: Sense> Sense for Heard<'_, P> {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.ports.camera_frame()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        let sample = self.ports.ldv_sample()?;
        self.commissioning.hear(&sample);
        Some(sample)
    }
}

/// What a tick of commissioning did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissioningReport {
    /// The estimate the decision was based on.
    pub estimate: Option<Estimate<f32>>,
    /// Whether it may be used.
    pub health: Health,
    /// The command that the amplifier applies.
    pub applied: DriveCommand,
    /// What commissioning is doing.
    pub stage: CommissioningStage,
}

/// The parts of a tick, each in a place of its own.
#[derive(Debug)]
pub struct CommissioningTick<'a, F> {
    /// The prior map.
    pub prior: &'a ResponseMap,
    /// The filter.
    pub filter: &'a mut F,
    /// The state machine.
    pub commissioning: &'a mut Commissioning,
}

/// One tick at `now`, to be called every [`crate::TICK_NANOS`], as [`crate::tick()`] is.
pub fn tick_commissioning<F: AngleFilter<f32>, P: Sense + Drive>(
    state: &mut CommissioningTick<'_, F>,
    now: Time,
    ports: &mut P,
) -> CommissioningReport {
    let CommissioningTick { prior, filter, commissioning } = state;
    let Fused { estimate, health, .. } = fuse(*filter, now, &mut Heard { ports: &mut *ports, commissioning });
    let command = commissioning.decide(prior, now, estimate.as_ref(), health);
    let applied = ports.drive(command);
    filter.drive(now, applied);
    CommissioningReport { estimate, health, applied, stage: commissioning.stage() }
}
