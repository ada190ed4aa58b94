//! One move in closed loop: `host-sim position`.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the runner: it runs the loop until the move ends |
//! | `move_run` | a move that is run tick by tick, by the runner or by a program of one's own |
//! | `sums` | the sums of a move over its ticks, for any program that drives the motor |
//! | `waits` | what the controller waited for, and the health of the estimate, over the time of a move |
//! | `plan` | what a move will take, before it starts |
//! | `outcome` | what became of a move |
//! | `reason` | why a move was given up, and what to change |
//! | `reach` | what the response map allows of a move |

mod move_run;
mod outcome;
mod plan;
mod reach;
mod reason;
mod sums;
mod waits;

use std::convert::Infallible;
use std::ops::ControlFlow;

use controller::PositioningTuning;

use crate::runs::RunError;
use crate::runs::closed_loop::{self, ClosedLoop, PositioningMoment};
use crate::scene::Scene;
pub use move_run::MoveRun;
pub use outcome::{FrameCounts, MoveEnding, MoveOutcome};
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
    let mut run = MoveRun::new(scene, tuning)?;
    loop {
        let moment = run.next_tick();
        if let ControlFlow::Break(value) = intervene(&mut run.closed_loop, &moment) {
            return Ok(ControlFlow::Break(value));
        }
        if let Some(outcome) = run.add(&moment) {
            return Ok(ControlFlow::Continue(outcome));
        }
    }
}
