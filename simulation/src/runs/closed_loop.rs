//! The closed loop: the controller's own loop bodies, [`controller::tick`] and [`controller::tick_rate`], on the rig.

use std::sync::Arc;

use controller::rate::RateHold;
use controller::{
    LoopTiming, PositionLoop, PositioningTuning, RateLoop, RateReport, ResponseMap, TICK_NANOS, Target,
    TickReport,
};
use motor_model::{OutOfBounds, Time};

use crate::math::count::real;
use crate::runs::RunError;
use crate::runs::filter::AnyFilter;
use crate::runs::late_interrupts::LateInterrupts;
use crate::runs::limits;
use crate::runs::tick_driver::{Moment, RigPorts, TickDriver, TickProgram};
use crate::scene::{Scene, SceneError};
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

/// When the loop of a scene decides, and when that acts.
pub fn timing(scene: &Scene) -> LoopTiming {
    // Both are within the bounds of their keys, which are less.
    let ticks = |key| u8::try_from(scene.integer(key)).unwrap_or(u8::MAX);
    LoopTiming { latency_ticks: ticks("board.latency_ticks"), decision_ticks: ticks("board.decision_ticks") }
}

/// Refuses a camera of which a decision, which takes in one frame, leaves more and more behind.
fn check_frames(scene: &Scene) -> Result<(), SceneError> {
    const RATE: &str = "camera.frame_rate_hz";
    let taken_hz = 1e9 / real(scene.integer("board.decision_ticks") * TICK_NANOS);
    OutOfBounds::check(RATE, scene.number(RATE), 0.0, taken_hz, "Hz")?;
    Ok(())
}

/// The rig of a scene, and a program on its board.
///
/// # Errors
/// As [`TickDriver::new`], when the interrupts are late by less than a step of the plant, and when the camera is faster
/// than the decisions.
pub(super) fn on_board<P: TickProgram>(scene: &Scene, program: P) -> Result<TickDriver<P>, RunError> {
    check_frames(scene)?;
    let driver = TickDriver::new(scene, program)?.with_timing(timing(scene));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_camera_faster_than_the_decisions_is_refused() {
        let checked = |rate_hz: &str| {
            let sets = ["board.decision_ticks=8".to_owned(), format!("camera.frame_rate_hz={rate_hz}")];
            check_frames(&Scene::of_sets(&sets).unwrap()).map_err(|error| error.one_line())
        };
        assert_eq!(checked("12500"), Ok(()));
        let refusal = checked("12501").unwrap_err();
        assert!(refusal.contains("camera.frame_rate_hz") && refusal.contains("12500"), "{refusal}");
    }
}
