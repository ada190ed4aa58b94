//! One move in closed loop: `host-sim position`.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the runner: it runs the loop until the move ends |
//! | `sums` | the sums of a move over its ticks, for any program that drives the motor |
//! | `waits` | what the controller waited for, and the health of the estimate, over the time of a move |
//! | `plan` | what a move will take, before it starts |
//! | `outcome` | what became of a move |
//! | `reason` | why a move was given up, and what to change |
//! | `reach` | what the response map allows of a move |

mod outcome;
mod plan;
mod reach;
mod reason;
mod sums;
mod waits;

use std::convert::Infallible;
use std::ops::ControlFlow;

use controller::{PositioningPhase, PositioningTuning, Target};

use crate::runs::RunError;
use crate::runs::closed_loop::{self, ClosedLoop, PositioningMoment};
use crate::scene::Scene;
use crate::world::instruments::assumed;
pub use outcome::{MoveEnding, MoveOutcome};
pub use plan::{MovePlan, forecast, plan, plan_of};
pub use reach::note;
pub use sums::{MoveSums, MoveTick};

/// Runs the move of `scene`, and calls `observe` after every tick.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mut observe: impl FnMut(&PositioningMoment)) -> Result<MoveOutcome, RunError> {
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
) -> Result<ControlFlow<B, MoveOutcome>, RunError> {
    run_tuned(scene, closed_loop::tuning(scene), intervene)
}

/// The same, with another tuning of the controller.
///
/// # Errors
/// When the scene is refused.
pub fn run_tuned<B>(
    scene: &Scene,
    tuning: PositioningTuning,
    mut intervene: impl FnMut(&mut ClosedLoop, &PositioningMoment) -> ControlFlow<B>,
) -> Result<ControlFlow<B, MoveOutcome>, RunError> {
    let (to_deg, tolerance_deg) = (scene.number("position.to_deg"), scene.number("position.tolerance_deg"));
    let target = Target::try_new(to_deg, tolerance_deg)?;
    let map = scene.response_map()?;
    reach::check(&assumed(scene).checked()?, &map, &tuning.limits, to_deg, tolerance_deg)?;
    let hold_nanos = scene.nanos("position.hold_s");
    let mut sums = MoveSums::new(target);
    let outcome = closed_loop::positioning(scene, target, tuning)?.run(|closed_loop, moment| {
        if let ControlFlow::Break(value) = intervene(closed_loop, &moment) {
            return ControlFlow::Break(ControlFlow::Break(value));
        }
        let tick = MoveTick::of(&moment);
        sums.add(&tick);
        let outcome = || MoveOutcome { marks: closed_loop.mark_counts(), ..sums.outcome(&tick, scene) };
        match moment.report.phase {
            PositioningPhase::Stopped(why) => {
                ControlFlow::Break(ControlFlow::Continue(outcome().stopped(why)))
            }
            PositioningPhase::Holding if sums.held_nanos(moment.at) >= hold_nanos => {
                ControlFlow::Break(ControlFlow::Continue(outcome()))
            }
            _ => ControlFlow::Continue(()),
        }
    });
    Ok(outcome)
}
