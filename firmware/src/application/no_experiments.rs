//! The experiments of a program that was built without the feature `commissioning`: there are none. The compiler leaves
//! out what can only happen with one.

use controller::commissioning::ExperimentReport;
use controller::{Drive, InFlight, Sense};
use link::{BoardMessage, ExperimentRecord, ExperimentsConfiguration};
use motor_model::{Angle, OutOfBounds, Time};

use super::configured_move::{Bench, MoveError};
use crate::filter::SelectedFilter;
use crate::loop_report::LoopReport;

/// No value has this type.
#[derive(Debug)]
pub(super) enum Experiments {}

impl Experiments {
    pub(super) fn asked(_: ExperimentsConfiguration, _: &Bench) -> Result<Self, MoveError> {
        Err(MoveError::NoExperiments)
    }

    pub(super) fn configuration(&self) -> ExperimentsConfiguration {
        match *self {}
    }

    pub(super) fn begin(&mut self, _: Angle, _: Time) {
        match *self {}
    }

    pub(super) fn tick<'d>(
        &mut self,
        _: &mut SelectedFilter,
        _: &'d mut InFlight<ExperimentReport>,
        _: Time,
        _: &mut (impl Sense + Drive),
    ) -> LoopReport<'d> {
        match *self {}
    }

    pub(super) fn order(&mut self, _: &ExperimentRecord) -> Result<BoardMessage, OutOfBounds> {
        match *self {}
    }

    pub(super) fn response(&self) -> BoardMessage {
        match *self {}
    }
}
