//! Commissioning: the response map of the motor in front of the controller, measured within a minute.
//!
//! The prior is a map of motors drawn around the design ([`crate::ResponseMap::table_1`]). Each of its rows keeps its
//! shape, and gets a factor by Bayes' rule from what this motor does.
//!
//! ```text
//!   Commissioning: on a host, between two ticks        Experimenter: in the loop, on a board as in the simulation
//!  +------------------------------------------+         +------------------------------------------+
//!  | what pays most: a sweep, a cruise or     |  order  | drives, waits for rest, measures turn,   |
//!  | a burst; 60 s over, or nothing pays: the | ------> | rate, coast, time to rest, or the powers |
//!  | map, or why there is none                | <------ | that the vibrometer shows                |
//!  +------------------------------------------+ response+------------------------------------------+
//! ```
//!
//! | module | what it is |
//! |---|---|
//! | [`experiment`] | an experiment and its response, as data |
//! | [`experimenter`] | the state machine in the loop: drives, waits for rest, measures |
//! | [`sweep`], [`resonance`] | the drive's frequency in steps, and the curve through the powers |
//! | this one | the plan: takes responses, and orders what comes next |
//! | [`order`] | what to measure next |
//! | [`limits`] | the travel and the strongest drive |
//! | [`evidence`], [`repeats`], [`coasts`] | what was measured of each row |
//! | [`row_factors`], [`map_factors`] | the factors by Bayes' rule, and where the prior does not hold |
//! | [`commissioned_map`] | the map that follows |
//! | [`findings`] | what the prior's authors did not foresee, by tests |
//! | [`result`] | what commissioning gives out, and when a motor is not fit for use |
//! | [`quantiles`] | of the normal, Student's, chi-square and binomial laws |
//!
//! Nothing allocates or panics. A tick of the loop takes little and bounded time; the search of [`order`] takes longer
//! than a tick of a small processor, and is made elsewhere, while the drive is off and the rotor at rest.

pub mod coasts;
pub mod commissioned_map;
pub mod evidence;
pub mod experiment;
pub mod experimenter;
pub mod findings;
mod limits;
pub mod map_factors;
mod order;
mod quantiles;
pub mod repeats;
pub mod resonance;
pub mod result;
pub mod row_factors;
mod run_out;
pub mod sweep;
mod tick;

use core::slice;

use estimator::{Instruments, ResonanceOffset};
use heapless::Vec;
use motor_model::{DriveCommand, DriveMode};

use crate::response_map::{Cruise, ResponseMap};
use evidence::{CommissioningEvidence, MapRow};
use experiment::{Experiment, Response, TurnWindow};
pub use experimenter::{ExperimentPhase, ExperimentTuning, Experimenter};
use order::{Known, Next};
use resonance::{Resonance, SWEEP_POINTS_MAX, SweepPoint};
pub use result::{Commissioned, CommissioningEnd, Unfit};
pub use tick::{ExperimentReport, tick_experiment};

/// The plan, and what was measured by now.
#[derive(Clone, Debug)]
pub struct Commissioning {
    instruments: Instruments,
    evidence: CommissioningEvidence,
    unswept: [bool; 2],
    resonances: [Option<Resonance>; 2],
    swept: [Vec<SweepPoint, SWEEP_POINTS_MAX>; 2],
    /// The experiment that is ordered, and the row of the map that it measures.
    ordered: Option<(Experiment, Option<MapRow>)>,
    /// Drives in a row of which nothing is known, since the estimate was lost, and the mode of the last.
    lost: (u8, DriveMode),
}

impl Commissioning {
    /// Commissioning under `instruments`, at full drive.
    pub fn new(instruments: &Instruments) -> Self {
        Self {
            instruments: *instruments,
            evidence: CommissioningEvidence::default(),
            unswept: [instruments.vibrometer.is_some(); 2],
            resonances: [None; 2],
            swept: [Vec::new(), Vec::new()],
            ordered: None,
            lost: (0, DriveMode::B),
        }
    }

    /// Strongest drive.
    const AMPLITUDE_MAX: f32 = DriveCommand::AMPLITUDE_MAX;

    /// What was measured by now.
    pub fn evidence(&self) -> &CommissioningEvidence {
        &self.evidence
    }

    /// The row of the map that is being measured; `None` in a sweep.
    pub fn row(&self) -> Option<MapRow> {
        self.ordered.and_then(|(_, row)| row)
    }

    /// The powers that the sweep of `mode` has shown.
    pub fn swept(&self, mode: DriveMode) -> &[SweepPoint] {
        map_factors::of_mode::<Vec<_, SWEEP_POINTS_MAX>>(&self.swept, mode)
    }

    /// Where the drive of `mode` is tuned to, from the design's frequency: to the resonance that the sweep has shown,
    /// where that is not the design's beyond doubt.
    pub fn resonance_offset(&self, mode: DriveMode) -> ResonanceOffset<f32> {
        let found = map_factors::of_mode::<Option<Resonance>>(&self.resonances, mode);
        found.as_ref().and_then(Resonance::beyond_doubt).unwrap_or_default()
    }

    /// The next experiment, from rest; `None` when another one would save next to nothing.
    pub fn next(&mut self, prior: &ResponseMap) -> Option<Experiment> {
        let known = Known {
            prior,
            evidence: &self.evidence,
            unswept: self.unswept,
            amplitude_max: Self::AMPLITUDE_MAX,
            instruments: &self.instruments,
        };
        let (row, experiment) = match known.next() {
            Next::Sweep(mode) => (None, Experiment::Sweep { mode, amplitude: Self::AMPLITUDE_MAX }),
            Next::Row(row @ MapRow::Cruise(index)) => {
                let cruise = prior.cruises().get(index)?;
                let Cruise { mode, amplitude, .. } = *cruise;
                let offset_hz = self.resonance_offset(mode).hz;
                (Some(row), Experiment::Cruise { mode, amplitude, offset_hz })
            }
            Next::Row(row @ MapRow::Burst(family, index)) => {
                let burst = prior.bursts(family).get(index)?;
                let experiment = Experiment::Train {
                    mode: family.mode(),
                    amplitude: burst.amplitude,
                    offset_hz: self.resonance_offset(family.mode()).hz,
                    ticks: burst.ticks,
                    count: order::train(family, burst),
                };
                (Some(row), experiment)
            }
            Next::Enough => return None,
        };
        self.ordered = Some((experiment, row));
        Some(experiment)
    }

    /// Takes the response to the experiment of the last [`Self::next`]. A response of another kind counts as none.
    pub fn take(&mut self, prior: &ResponseMap, response: &Response) {
        let Some((experiment, row)) = self.ordered.take() else { return };
        let lost = if *response == Response::Lost { self.lost.0.saturating_add(1) } else { 0 };
        self.lost = (lost, experiment.mode());
        match (response, row) {
            (Response::Sweep { points }, None) => self.take_sweep(experiment.mode(), points),
            (Response::Cruise { windows, coast, to_rest_s }, Some(MapRow::Cruise(index))) => {
                self.take_windows(prior, index, windows);
                let is_whole = windows.is_full();
                if let Some(found) = self.evidence.cruise_mut(index) {
                    found.runs = found.runs.saturating_add(1);
                    found.lost = found.lost.saturating_add(u16::from(!is_whole));
                }
                let found = self.evidence.cruise_mut(index).filter(|_| is_whole);
                if let Some((found, cruise)) = found.zip(prior.cruises().get(index)) {
                    found.coasts.add(coast.rate_rad_s, coast.turned_rad, coast.noise_rad2(cruise.coast_s));
                    found.to_rest_s.add(*to_rest_s, 0.0);
                }
            }
            (Response::Lost, Some(MapRow::Cruise(index))) => {
                if let Some(found) = self.evidence.cruise_mut(index) {
                    found.unseen = found.unseen.saturating_add(1);
                }
            }
            (Response::Lost, Some(MapRow::Burst(family, index))) => {
                if let Some(found) = self.evidence.burst_mut(family, index) {
                    found.lost = found.lost.saturating_add(1);
                }
            }
            (Response::Unmoved { window }, Some(MapRow::Cruise(index))) => {
                self.take_windows(prior, index, slice::from_ref(window));
                if let Some(found) = self.evidence.cruise_mut(index) {
                    found.runs = found.runs.saturating_add(1);
                }
            }
            (
                &Response::Train { turned_rad, turned_rad2, independent, to_rest_s },
                Some(MapRow::Burst(family, index)),
            ) => {
                let found = self.evidence.burst_mut(family, index);
                let Some((found, burst)) = found.zip(prior.bursts(family).get(index)) else { return };
                let count = order::train(family, burst);
                let mapped_rad = f32::from(count) * burst.turn_rad;
                let mapped_rad2 = mapped_rad * mapped_rad;
                // An angle that is not independent of the one before would show too short a turn.
                let noise_rad2 = if independent { turned_rad2 } else { turned_rad2 + mapped_rad2 };
                found.train = count;
                found.turns.add(turned_rad / mapped_rad, noise_rad2 / mapped_rad2);
                found.to_rest_s.add(to_rest_s, 0.0);
            }
            _ => (),
        }
    }

    fn take_sweep(&mut self, mode: DriveMode, points: &Vec<SweepPoint, SWEEP_POINTS_MAX>) {
        let index = usize::from(mode == DriveMode::C);
        let place = self.unswept.get_mut(index).zip(self.resonances.get_mut(index));
        if let Some(((unswept, resonance), swept)) = place.zip(self.swept.get_mut(index)) {
            (*unswept, *resonance) = (false, Resonance::of(mode, points));
            swept.clone_from(points);
        }
    }

    fn take_windows(&mut self, prior: &ResponseMap, index: usize, windows: &[TurnWindow]) {
        let Some(cruise) = prior.cruises().get(index) else { return };
        for &TurnWindow { turned_rad, turned_rad2, time_s } in windows {
            self.evidence.add_window(index, cruise, turned_rad, turned_rad2, time_s);
        }
    }
}

#[cfg(test)]
mod tests;
