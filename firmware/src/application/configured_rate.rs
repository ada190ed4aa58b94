//! The rate that the host has configured. Its loop is [`controller::rate`]; its end is here: from then on the drive is
//! off, and the loop goes on estimating and reporting.

use controller::rate::{Dwell, RateHold, RateTuning};
use controller::resonance_tracker::ResonanceTracker;
use controller::{Drive, InFlight, RateReport, ResponseMap, Sense, tick_rate_by};
use link::{RateConfiguration, RatePhase};
use motor_model::{Angle, Time};

use super::configured_move::{Bench, MoveError};
use super::map_memory::MapMemory;
use crate::filter::SelectedFilter;
use crate::loop_report::LoopReport;

/// A configuration that was checked, as [`super::configured_move::Move`].
#[derive(Debug)]
pub(super) struct Rate {
    pub(super) configuration: RateConfiguration,
    profile: Dwell,
    tuning: RateTuning,
    armed_at: Time,
    /// The rate is held from arming on.
    hold: RateHold<Dwell>,
    is_over: bool,
}

impl Rate {
    /// The rate that is asked for on `bench`, which has `map`.
    ///
    /// # Errors
    /// When a value is out of bounds, or the map is incomplete or for another motor.
    pub(super) fn asked(
        map: &MapMemory,
        configuration: RateConfiguration,
        bench: &Bench,
    ) -> Result<Self, MoveError> {
        bench.check_map(map)?;
        let (profile, tuning) = configuration.checked(&bench.instruments)?;
        let hold = RateHold::new(profile, tuning, Time::ZERO);
        Ok(Self { configuration, profile, tuning, armed_at: Time::ZERO, hold, is_over: false })
    }

    /// Begins at `now`. The travel counts from `zero`.
    pub(super) fn begin(&mut self, zero: Angle, now: Time) {
        let Self { profile, mut tuning, .. } = *self;
        tuning.limits.travel = tuning.limits.travel.from_zero(zero);
        (self.armed_at, self.is_over) = (now, false);
        self.hold = RateHold::new(profile, tuning, now);
    }

    /// A tick of its loop.
    pub(super) fn tick<'d>(
        &mut self,
        map: &ResponseMap,
        filter: &mut SelectedFilter,
        tracker: &mut ResonanceTracker,
        in_flight: &'d mut InFlight<RateReport>,
        now: Time,
        ports: &mut (impl Sense + Drive),
    ) -> LoopReport<'d> {
        let held_nanos = now.nanos_since(self.armed_at);
        // A rate that was stopped stays so, and its reports say why.
        if held_nanos > self.configuration.duration_nanos && !self.is_over && self.hold.stopped().is_none() {
            self.is_over = true;
            self.hold = RateHold::new(Dwell::REST, self.tuning, now);
        }
        let report = tick_rate_by(map, filter, &mut self.hold, tracker, in_flight, now, ports);
        let phase = if self.is_over { RatePhase::Over } else { RatePhase::from(&*report) };
        LoopReport::Rate { report, phase }
    }
}
