//! A rate that host and microcontroller hold both.

use std::fmt;
use std::ops::ControlFlow;

use controller::rate::Profile;
use link::{HostMessage, RateConfiguration, RateLimitsRecord};
use serde::Serialize;

use super::{Difference, Processor, compared, description, filter_kind, verdict};
use crate::board::BoardError;
use simulation::runs::RunError;
use simulation::runs::limits::{self, Told};
use simulation::runs::rate::{self, RateOutcome};
use simulation::scene::Scene;

/// A rate that host and microcontroller held both. It ends at the first difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedRate {
    /// Whether both computed the same bits in every tick.
    pub identical: bool,
    /// Ticks compared.
    pub steps: u64,
    /// The first difference.
    pub difference: Option<Difference>,
    /// What became of the rate, as the microcontroller drove it; `null` after a difference.
    pub outcome: Option<RateOutcome>,
}

impl ComparedRate {
    /// The rate as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for ComparedRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(outcome) = &self.outcome {
            write!(f, "{outcome}")?;
        }
        writeln!(f, "{}", verdict(self.identical, self.steps))
    }
}

/// What the microcontroller is told before it is armed for the rate of `scene`: the bench as for a move, and the rate,
/// which it holds from the start.
///
/// # Errors
/// When the scene's map is for another design, its rate leaves the travel, or no drive is allowed for it.
pub(crate) fn rate_preparation(scene: &Scene) -> Result<Vec<HostMessage>, BoardError> {
    let dwell = Profile::dwell(scene.number("rate.deg_s")).map_err(RunError::from)?;
    limits::check_rate(scene, &dwell)?;
    let Told { travel_deg, on_max_nanos, amplitude_max } = Told::of_rate(scene);
    let mut messages = description(scene)?;
    messages.push(HostMessage::ConfigureRate(RateConfiguration {
        filter: filter_kind(scene),
        rate_deg_s: scene.number("rate.deg_s"),
        duration_nanos: scene.nanos("rate.duration_s"),
        limits: RateLimitsRecord { travel_deg, on_max_nanos, amplitude_max, ..RateLimitsRecord::default() },
    }));
    Ok(messages)
}

/// Holds the rate of `scene`, whose profile is a dwell; the commands of `processor` drive the motor.
///
/// # Errors
/// When the scene is refused, or the processor fails. A difference is no error here.
pub fn hold_rate(scene: &Scene, processor: &mut impl Processor) -> Result<ComparedRate, BoardError> {
    processor.arm(&rate_preparation(scene)?)?;
    let mut steps = 0;
    let ended = rate::run_with(
        scene,
        |_| (),
        |closed_loop, moment| {
            steps += 1;
            match compared(processor, closed_loop, moment, steps, scene.seed()) {
                Ok(None) => ControlFlow::Continue(()),
                Ok(Some(difference)) => ControlFlow::Break(Ok(difference)),
                Err(error) => ControlFlow::Break(Err(error)),
            }
        },
    )?;
    Ok(match ended {
        ControlFlow::Continue(outcome) => {
            ComparedRate { identical: true, steps, difference: None, outcome: Some(outcome) }
        }
        ControlFlow::Break(difference) => {
            ComparedRate { identical: false, steps, difference: Some(difference?), outcome: None }
        }
    })
}
