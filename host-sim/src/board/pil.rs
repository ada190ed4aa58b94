//! Processor in the loop: the firmware, on an emulated microcontroller, positions the simulated motor, or holds its
//! rate. The host computes every tick as well.
//!
//! ```text
//!                  +--> host: controller::tick -----------> report ----+
//! plant, 10 us --> measurements           or tick_rate                 | bit by bit
//!      ^           +--> microcontroller: controller::tick --> report --+
//!      |                                                        |
//!      +---------------- command of the microcontroller --------+
//! ```
//!
//! In lock step: the plant stands still until the microcontroller has answered. A run does not depend on the speed of
//! anything.
//!
//! | item | what it is |
//! |---|---|
//! | [`Processor`] | answers measurements with a report |
//! | [`LockStepBoard`] | a processor: QEMU, over the frames of the [`link`] crate, by semihosting or the serial line |
//! | [`FreeRunningBoard`] | no processor of a run: the whole program of a board, on its own timer, out of step |
//! | [`run`] | a move of a scene: a [`ComparedMove`], with the first [`Difference`] |
//! | [`hold_rate`] | a rate of a scene: a [`ComparedRate`] |
//! | [`commission`] | the motor of a scene by experiments: a [`ComparedCommissioning`] |

mod commissioned;
mod frames;
mod free_running_board;
mod held_rate;
mod lock_step_board;
#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::ControlFlow;

use controller::map_correction::LearntFactors;
use link::{
    BoardMessage, Configuration, FilterKind, HostMessage, MoveLimitsRecord, TickRecord, description_messages,
};
use serde::Serialize;

use crate::board::BoardError;
pub(crate) use commissioned::commission_preparation;
pub use commissioned::{ComparedCommissioning, commission};
pub use free_running_board::FreeRunningBoard;
pub(crate) use held_rate::rate_preparation;
pub use held_rate::{ComparedRate, hold_rate};
pub use lock_step_board::LockStepBoard;
use simulation::runs::closed_loop::{PositioningMoment, timing};
use simulation::runs::filter;
use simulation::runs::limits;
use simulation::runs::position::{self, MoveOutcome};
use simulation::runs::tick_driver::{Moment, TickDriver, TickMeasurements, TickProgram};
use simulation::scene::Scene;
use simulation::world::instruments::assumed;

/// A processor in the loop beside the host.
pub trait Processor {
    /// Prepares for a task.
    ///
    /// # Errors
    /// When it refuses what is asked or does not answer.
    fn arm(&mut self, preparation: &[HostMessage]) -> Result<(), BoardError>;

    /// Runs one tick on the measurements of the host's tick.
    ///
    /// # Errors
    /// When it does not answer with a report.
    fn tick(&mut self, measurements: &TickMeasurements) -> Result<TickRecord, BoardError>;

    /// Tells it something between two ticks; its answer.
    ///
    /// # Errors
    /// When it does not answer.
    fn tell(&mut self, message: &HostMessage) -> Result<BoardMessage, BoardError>;
}

/// Where the microcontroller first computed something else than the host.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("step {step} of seed {seed}: {field} is {board} on the microcontroller and {host} on the host")]
pub struct Difference {
    /// Tick of the loop, from 1.
    pub step: u64,
    /// Part of the report.
    pub field: &'static str,
    /// Its bits on the host in hexadecimal, with the meaning of a numbered field; `absent` where the report has no such
    /// part.
    pub host: String,
    /// Its bits on the microcontroller.
    pub board: String,
    /// Seed of the run.
    pub seed: u64,
}

/// A move that host and microcontroller computed both. It ends at the first difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedMove {
    /// Whether both computed the same bits in every tick, and have learnt the same of the motor.
    pub identical: bool,
    /// Ticks compared.
    pub steps: u64,
    /// True angle at the end less the target; `null` after a difference.
    pub final_error_mdeg: Option<f64>,
    /// The first difference.
    pub difference: Option<Difference>,
    /// The move, as the microcontroller drove it; `null` after a difference.
    pub outcome: Option<MoveOutcome>,
}

impl ComparedMove {
    /// The move as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for ComparedMove {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(outcome) = &self.outcome {
            write!(f, "{outcome}")?;
        }
        writeln!(f, "{}", verdict(self.identical, self.steps))
    }
}

/// How far host and microcontroller agree, in words.
fn verdict(identical: bool, steps: u64) -> String {
    let verdict = if identical { "every bit of every report is the host's" } else { "differs from the host" };
    format!("compared           {steps} ticks: {verdict}")
}

/// What the microcontroller is told before it is armed: the instruments, the timing, the parameters of the motor that
/// are not Table 1's, the response map, and the move.
///
/// # Errors
/// When the scene's map is for another design, or its target outside of its travel.
pub(crate) fn preparation(scene: &Scene) -> Result<Vec<HostMessage>, BoardError> {
    limits::check_target(scene)?;
    let mut messages = description(scene)?;
    messages.push(HostMessage::Configure(configuration(scene)));
    Ok(messages)
}

/// The instruments, the timing, the parameters of the motor that are not Table 1's, and the response map.
///
/// # Errors
/// When the scene's map is for another design.
pub(crate) fn description(scene: &Scene) -> Result<Vec<HostMessage>, BoardError> {
    // At most `LATENCY_TICKS_MAX`, which is less.
    let map = scene.response_map()?;
    Ok(description_messages(&scene.motor_params(), assumed(scene), timing(scene), Some(&map)).collect())
}

/// The board's answer to a message of [`preparation`], and to one that keeps it.
pub(crate) fn acknowledgement(message: &HostMessage) -> BoardMessage {
    match message {
        HostMessage::Configure(_) | HostMessage::ConfigureRate(_) | HostMessage::ConfigureExperiments(_) => {
            BoardMessage::Configured
        }
        HostMessage::Zero { angle_units: Some(angle_units) } => {
            BoardMessage::Zeroed { angle_units: *angle_units }
        }
        HostMessage::ReportPeriod { ticks } => BoardMessage::ReportPeriod { ticks: *ticks },
        HostMessage::Keep => BoardMessage::Kept,
        HostMessage::Forget => BoardMessage::Forgotten,
        _ => BoardMessage::Described,
    }
}

fn filter_kind(scene: &Scene) -> FilterKind {
    filter_named(filter::chosen(scene))
}

/// The filter of this name in a scene, the simplest for any other word.
pub(crate) fn filter_named(name: &str) -> FilterKind {
    match name {
        "impact_aided" => FilterKind::ImpactAided,
        "twin" => FilterKind::Twin,
        _ => FilterKind::ConstantRate,
    }
}

/// Its name in a scene.
pub(crate) fn filter_name(filter: FilterKind) -> &'static str {
    match filter {
        FilterKind::ConstantRate => "constant_rate",
        FilterKind::ImpactAided => "impact_aided",
        FilterKind::Twin => "twin",
    }
}

fn configuration(scene: &Scene) -> Configuration {
    let limits::Told { travel_deg, on_max_nanos, amplitude_max } = limits::Told::of_move(scene);
    Configuration {
        filter: filter_kind(scene),
        target_deg: scene.number("position.to_deg"),
        tolerance_deg: scene.number("position.tolerance_deg"),
        deadline_nanos: scene.nanos("position.deadline_s"),
        limits: MoveLimitsRecord { travel_deg, on_max_nanos, amplitude_max },
    }
}

/// Runs the move of `scene`; the commands of `processor` drive the motor.
///
/// # Errors
/// When the scene is refused, or the processor fails. A difference is no error here.
pub fn run(scene: &Scene, processor: &mut impl Processor) -> Result<ComparedMove, BoardError> {
    run_with(scene, processor, |_| Ok(()))
}

/// The same; `observe` sees every tick after the processor has answered, also where the answer differs.
///
/// # Errors
/// When the scene is refused, or the processor or `observe` fails.
pub fn run_with(
    scene: &Scene,
    processor: &mut impl Processor,
    mut observe: impl FnMut(&PositioningMoment) -> Result<(), BoardError>,
) -> Result<ComparedMove, BoardError> {
    processor.arm(&preparation(scene)?)?;
    let (mut steps, mut learnt) = (0, None);
    let outcome = position::run_with(scene, |closed_loop, moment| {
        steps += 1;
        learnt = Some(closed_loop.program().learnt());
        let compared = compared(processor, closed_loop, moment, steps, scene.seed()).and_then(|found| {
            observe(moment)?;
            found.map_or(Ok(()), |difference| Err(difference.into()))
        });
        match compared {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => ControlFlow::Break(error),
        }
    })?;
    let outcome = match (outcome, learnt) {
        (ControlFlow::Continue(outcome), Some(learnt)) => match learnt_otherwise(processor, learnt)? {
            None => ControlFlow::Continue(outcome),
            Some((host, board)) => {
                let seed = scene.seed();
                ControlFlow::Break(Difference { step: steps, field: "learnt", host, board, seed }.into())
            }
        },
        (outcome, _) => outcome,
    };
    match outcome {
        ControlFlow::Continue(outcome) => Ok(ComparedMove {
            identical: true,
            steps,
            final_error_mdeg: Some(outcome.final_error_mdeg),
            difference: None,
            outcome: Some(outcome),
        }),
        ControlFlow::Break(BoardError::Difference(difference)) => Ok(ComparedMove {
            identical: false,
            steps,
            final_error_mdeg: None,
            difference: Some(difference),
            outcome: None,
        }),
        ControlFlow::Break(error) => Err(error),
    }
}

/// What the host and the processor have learnt of the motor, if that is not the same to the last bit.
fn learnt_otherwise(
    processor: &mut impl Processor,
    learnt: LearntFactors,
) -> Result<Option<(String, String)>, BoardError> {
    let ours = BoardMessage::Learnt(learnt.into());
    let theirs = processor.tell(&HostMessage::Learnt)?;
    Ok((theirs != ours).then(|| (format!("{ours:?}"), format!("{theirs:?}"))))
}

/// Compares one tick of processor and host, and applies the command of the processor where there is no difference.
fn compared<P: TickProgram>(
    processor: &mut impl Processor,
    closed_loop: &mut TickDriver<P>,
    moment: &Moment<P::Report>,
    step: u64,
    seed: u64,
) -> Result<Option<Difference>, BoardError>
where
    TickRecord: for<'a> From<&'a P::Report>,
{
    let ours = TickRecord::from(&moment.report);
    let theirs = processor.tick(closed_loop.measurements())?;
    if let Some((field, host, board)) = ours.difference(&theirs) {
        let host = with_meaning(&ours, field, host);
        let board = with_meaning(&theirs, field, board);
        return Ok(Some(Difference { step, field, host, board, seed }));
    }
    let command = theirs.applied.command();
    closed_loop.overrule(command.ok_or_else(|| BoardError::Board("commands what is no drive".to_owned()))?);
    Ok(None)
}

/// The bits of `field` of `record` in hexadecimal, and what they mean where they are the number of an enumeration.
fn with_meaning(record: &TickRecord, field: &str, bits: Option<u64>) -> String {
    let Some(bits) = bits else { return "absent".to_owned() };
    let meaning = match field {
        "health" => Some(format!("{:?}", record.health)),
        "phase" => Some(format!("{:?}", record.phase)),
        "camera.verdict" => record.camera.map(|camera| format!("{:?}", camera.verdict)),
        _ => None,
    };
    meaning.map_or_else(|| format!("{bits:#x}"), |meaning| format!("{bits:#x} ({meaning})"))
}
