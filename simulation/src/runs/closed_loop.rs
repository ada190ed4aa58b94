//! The closed loop: the controller's own loop bodies, [`controller::tick`] and [`controller::tick_rate`], on the rig.

use std::sync::Arc;

use controller::rate::RateHold;
use controller::{
    LATENCY_TICKS_MAX, PositionLoop, PositioningTuning, RateLoop, RateReport, ResponseMap, Target, TickReport,
};
use motor_model::Time;

use crate::runs::RunError;
use crate::runs::filter::AnyFilter;
use crate::runs::late_interrupts::LateInterrupts;
use crate::runs::limits;
use crate::runs::tick_driver::{Moment, RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::world::instruments::assumed;

impl TickProgram for PositionLoop<AnyFilter, Arc<ResponseMap>> {
    type Report = TickReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> TickReport {
        controller::tick(self, now, ports)
    }
}

impl TickProgram for RateLoop<AnyFilter, Arc<ResponseMap>> {
    type Report = RateReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> RateReport {
        controller::tick_rate(self, now, ports)
    }
}

/// Rig and positioning loop.
pub type ClosedLoop = TickDriver<PositionLoop<AnyFilter, Arc<ResponseMap>>>;

/// Rig and a loop that holds a rate.
pub type ClosedRateLoop = TickDriver<RateLoop<AnyFilter, Arc<ResponseMap>>>;

/// The end of a tick of a positioning loop.
pub type PositioningMoment = Moment<TickReport>;

/// The end of a tick of a loop that holds a rate.
pub type RateMoment = Moment<RateReport>;

/// The controller's tuning for the instruments and the limits of a scene.
pub fn tuning(scene: &Scene) -> PositioningTuning {
    PositioningTuning { limits: limits::of_move(scene), ..PositioningTuning::new(&assumed(scene)) }
}

/// Ticks from a decision of the loop of a scene until its command acts.
pub fn latency_ticks(scene: &Scene) -> usize {
    // At most `LATENCY_TICKS_MAX`.
    usize::try_from(scene.integer("board.latency_ticks")).unwrap_or(LATENCY_TICKS_MAX)
}

/// The rig of a scene, and a program on its board.
///
/// # Errors
/// As [`TickDriver::new`], and when the interrupts are late by less than a step of the plant.
pub(super) fn on_board<P: TickProgram>(scene: &Scene, program: P) -> Result<TickDriver<P>, RunError> {
    let driver = TickDriver::new(scene, program)?.with_latency(latency_ticks(scene));
    Ok(driver.with_interrupts(LateInterrupts::of(scene)?))
}

/// The positioning loop of a scene.
///
/// # Errors
/// When the model refuses the plant, the rig its instruments or the plant's step, or the response map is for another
/// design.
pub fn positioning(scene: &Scene, target: Target, tuning: PositioningTuning) -> Result<ClosedLoop, RunError> {
    let position_loop =
        PositionLoop::new(AnyFilter::of(scene)?, scene.response_map()?, target, tuning, Time::ZERO);
    on_board(scene, position_loop)
}

/// The loop of a scene that holds a rate.
///
/// # Errors
/// When the model refuses the plant, the rig its instruments or the plant's step, or the response map is for another
/// design.
pub fn rate(scene: &Scene, hold: RateHold) -> Result<ClosedRateLoop, RunError> {
    let rate_loop = RateLoop::new(AnyFilter::of(scene)?, scene.response_map()?, hold);
    on_board(scene, rate_loop)
}

impl PositioningMoment {
    /// Estimated less true angle in milli-degrees, if there is an estimate.
    pub fn estimate_error_mdeg(&self) -> Option<f64> {
        self.report.estimate.map(|estimate| 1e3 * estimate.angle.minus(self.angle).degrees())
    }
}
