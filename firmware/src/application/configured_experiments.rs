//! The experiments that the host orders one by one. Their loop is [`controller::commissioning`]; orders and responses
//! go between its ticks.

use controller::commissioning::{ExperimentReport, ExperimentTuning, Experimenter, tick_experiment};
use controller::{Drive, InFlight, Sense};
use link::{BoardFault, BoardMessage, ExperimentRecord, ExperimentsConfiguration, ResponseRecord};
use motor_model::{Angle, OutOfBounds, Time};

use super::configured_move::{Bench, MoveError};
use crate::filter::SelectedFilter;
use crate::loop_report::LoopReport;

/// A configuration that was checked, as [`super::configured_move::Move`].
#[derive(Debug)]
pub(super) struct Experiments {
    configuration: ExperimentsConfiguration,
    tuning: ExperimentTuning,
    /// They begin at arming.
    experimenter: Experimenter,
}

impl Experiments {
    /// The experiments that are asked for on `bench`. They need no map.
    ///
    /// # Errors
    /// When a value is out of bounds.
    pub(super) fn asked(configuration: ExperimentsConfiguration, bench: &Bench) -> Result<Self, MoveError> {
        let tuning = configuration.checked(&bench.instruments)?;
        Ok(Self { configuration, tuning, experimenter: Experimenter::new(tuning, Time::ZERO) })
    }

    /// What was asked for.
    pub(super) fn configuration(&self) -> ExperimentsConfiguration {
        self.configuration
    }

    /// Begins at `now`, with no order. The travel counts from `zero`.
    pub(super) fn begin(&mut self, zero: Angle, now: Time) {
        let (travel, amplitude_max) = (self.tuning.travel().from_zero(zero), self.tuning.amplitude_max());
        self.experimenter = Experimenter::new(self.tuning.with_limits(travel, amplitude_max), now);
    }

    /// A tick of their loop.
    pub(super) fn tick<'d>(
        &mut self,
        filter: &mut SelectedFilter,
        in_flight: &'d mut InFlight<ExperimentReport>,
        now: Time,
        ports: &mut (impl Sense + Drive),
    ) -> LoopReport<'d> {
        LoopReport::Experiment(tick_experiment(filter, &mut self.experimenter, in_flight, now, ports))
    }

    /// Takes an order.
    ///
    /// # Errors
    /// When a value is out of bounds.
    pub(super) fn order(&mut self, record: &ExperimentRecord) -> Result<BoardMessage, OutOfBounds> {
        let (experiment, number) = (record.checked()?, self.experimenter.number());
        self.experimenter.allows(&experiment)?;
        let is_next = record.number == number.wrapping_add(1);
        // The answer to the order under way was lost.
        let is_repeated = number > 0 && record.number == number;
        Ok(if is_repeated || is_next && self.experimenter.order(experiment) {
            BoardMessage::ExperimentTaken { number: record.number }
        } else {
            BoardMessage::Fault(BoardFault::NotInOrder)
        })
    }

    /// What the last experiment has shown.
    pub(super) fn response(&self) -> BoardMessage {
        match self.experimenter.response() {
            Some(response) => BoardMessage::Response(ResponseRecord {
                number: self.experimenter.number(),
                shown: response.into(),
            }),
            None => BoardMessage::Fault(BoardFault::NotInOrder),
        }
    }
}
