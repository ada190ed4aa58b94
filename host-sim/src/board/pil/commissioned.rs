//! A motor that is commissioned by experiments on the microcontroller, each beside the host's.

use std::fmt;

use link::{
    BoardMessage, ExperimentRecord, ExperimentsConfiguration, HostMessage, ResponseRecord, ShownRecord,
};
use motor_model::Time;
use serde::Serialize;

use super::frames::unexpected;
use super::{Difference, Processor, compared, description, filter_kind, verdict};
use crate::board::BoardError;
use simulation::runs::commission::{CommissioningRun, Planned};
use simulation::runs::limits::{self, Told};
use simulation::scene::Scene;

/// Time in ns within which a motor is commissioned.
const TIME_MAX_NANOS: u64 = 60_000_000_000;

/// A motor that host and microcontroller commissioned both. It ends at the first difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedCommissioning {
    /// Whether both computed the same bits in every tick and in every response.
    pub identical: bool,
    /// Ticks compared.
    pub steps: u64,
    /// Responses compared.
    pub responses: u16,
    /// The first difference.
    pub difference: Option<Difference>,
    /// Whether the motor is fit for use; `null` after a difference.
    pub is_fit: Option<bool>,
}

impl ComparedCommissioning {
    /// The same as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for ComparedCommissioning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self.is_fit {
            Some(true) => "fit for use",
            Some(false) => "not fit for use",
            None => "not known",
        };
        writeln!(f, "experiments        {}", self.responses)?;
        writeln!(f, "motor              {word}")?;
        writeln!(f, "{}", verdict(self.identical, self.steps))
    }
}

/// What the microcontroller is told before it is armed for experiments on the motor of `scene`: the bench as for a
/// move, and the experiments.
///
/// # Errors
/// When the scene's map is for another design, or its motor may not be driven fully.
pub(crate) fn commission_preparation(scene: &Scene) -> Result<Vec<HostMessage>, BoardError> {
    limits::check_experiments(scene)?;
    let Told { travel_deg, amplitude_max, .. } = Told::of_experiments(scene);
    let mut messages = description(scene)?;
    messages.push(HostMessage::ConfigureExperiments(ExperimentsConfiguration {
        filter: filter_kind(scene),
        time_max_nanos: TIME_MAX_NANOS,
        travel_deg,
        amplitude_max,
    }));
    Ok(messages)
}

/// Commissions the motor of `scene`; the commands of `processor` drive it, and the host orders.
///
/// # Errors
/// When the scene is refused, or the processor fails. A difference is no error here.
pub fn commission(
    scene: &Scene,
    processor: &mut impl Processor,
) -> Result<ComparedCommissioning, BoardError> {
    processor.arm(&commission_preparation(scene)?)?;
    let mut run = CommissioningRun::new(scene)?;
    let mut found =
        ComparedCommissioning { identical: true, steps: 0, responses: 0, difference: None, is_fit: None };
    loop {
        let moment = run.next_tick();
        found.steps += 1;
        let seed = scene.seed();
        let mut difference = compared(processor, run.driver_mut(), &moment, found.steps, seed)?;
        if let Some((number, response)) = run.response().filter(|_| difference.is_none()) {
            let ours = ResponseRecord { number, shown: ShownRecord::from(response) };
            let theirs = response_of(processor)?;
            found.responses = number;
            if ours != theirs {
                let [host, board] = [&ours, &theirs].map(|record| format!("{record:?}"));
                difference = Some(Difference { step: found.steps, field: "response", host, board, seed });
            }
        }
        if difference.is_some() {
            (found.identical, found.difference) = (false, difference);
            return Ok(found);
        }
        match run.plan() {
            Planned::Nothing => {}
            Planned::Ordered(experiment) => {
                let number = found.responses + 1;
                let order = HostMessage::Experiment(ExperimentRecord::new(number, &experiment));
                let taken = processor.tell(&order)?;
                if taken != (BoardMessage::ExperimentTaken { number }) {
                    return Err(unexpected(&taken));
                }
            }
            Planned::Ended(end) => {
                let motor = run.finish(scene, end, moment.at.seconds_since(Time::ZERO));
                found.is_fit = Some(motor.commissioned.map.is_ok());
                return Ok(found);
            }
        }
    }
}

fn response_of(processor: &mut impl Processor) -> Result<ResponseRecord, BoardError> {
    match processor.tell(&HostMessage::Response)? {
        BoardMessage::Response(record) => Ok(record),
        other => Err(unexpected(&other)),
    }
}
