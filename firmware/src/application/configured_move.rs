//! The task that the host has configured, a move, a rate or experiments: what it is made of, and the memory that it
//! takes.
//!
//! The host describes its bench first, instruments, motor and map, and then configures the task on it.

use controller::commissioning::ExperimentReport;
use controller::resonance_tracker::ResonanceTracker;
use controller::{
    DECISION_TICKS_MAX, Drive, InFlight, LATENCY_TICKS_MAX, Limits, LoopTiming, Positioning,
    PositioningTuning, RateReport, ResponseMap, Sense, Target, TickReport, tick_by,
};
use estimator::Instruments;
use link::{
    Configuration, ExperimentsConfiguration, FilterKind, MapFault, MotorParameterRecord, RateConfiguration,
};
use motor_model::{Angle, MotorParams, OutOfBounds, Parameter, Time};

use super::configured_experiments::Experiments;
use super::configured_rate::Rate;
use super::map_memory::MapMemory;
use crate::filter::SelectedFilter;
use crate::loop_report::LoopReport;

/// Index of the last parameter of the motor.
#[expect(clippy::cast_possible_truncation, reason = "a few dozen")]
const PARAMETER_INDEX_MAX: u8 = (Parameter::ALL.len() - 1) as u8;

/// Keys of the timing.
const LATENCY_KEY: &str = "board.latency_ticks";
const DECISION_KEY: &str = "board.decision_ticks";

/// Motor, instruments and timing of the bench, as the host has described them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bench {
    pub(super) design: MotorParams,
    pub(super) instruments: Instruments,
    /// When the loop decides, and when that acts.
    pub(super) timing: LoopTiming,
}

impl Bench {
    /// Sets a parameter of the motor.
    pub(super) fn set(
        &mut self,
        MotorParameterRecord { index, value }: MotorParameterRecord,
    ) -> Result<(), OutOfBounds> {
        let parameter = Parameter::ALL.get(usize::from(index)).ok_or(OutOfBounds {
            key: "motor",
            value: f64::from(index),
            min: 0.0,
            max: f64::from(PARAMETER_INDEX_MAX),
            unit: "",
        })?;
        self.design = self.design.with(*parameter, value)?;
        Ok(())
    }

    /// Sets the timing.
    pub(super) fn set_timing(&mut self, timing: LoopTiming) -> Result<(), OutOfBounds> {
        let LoopTiming { latency_ticks, decision_ticks } = timing;
        #[expect(clippy::cast_precision_loss, reason = "a few dozen")]
        let [latency_max, decision_max] = [LATENCY_TICKS_MAX, DECISION_TICKS_MAX].map(|max| max as f64);
        OutOfBounds::check(LATENCY_KEY, latency_ticks.into(), 0.0, latency_max, "")?;
        OutOfBounds::check(DECISION_KEY, decision_ticks.into(), 1.0, decision_max, "")?;
        self.timing = timing;
        Ok(())
    }

    /// The map in `memory`.
    ///
    /// # Errors
    /// When it is incomplete, or for another motor.
    pub(super) fn check_map<'m>(&self, memory: &'m MapMemory) -> Result<&'m ResponseMap, MapFault> {
        let map = memory.map()?;
        if *map.design() == self.design { Ok(map) } else { Err(MapFault::OtherDesign) }
    }
}

/// What the host asks for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked {
    Move(Configuration),
    Rate(RateConfiguration),
    Experiments(ExperimentsConfiguration),
}

impl Asked {
    fn filter(&self) -> FilterKind {
        match self {
            Self::Move(configuration) => configuration.filter,
            Self::Rate(configuration) => configuration.filter,
            Self::Experiments(configuration) => configuration.filter,
        }
    }
}

/// A configuration that was checked. Its filter has a place of its own in [`MoveMemory`].
#[derive(Debug)]
#[cfg_attr(
    not(feature = "commissioning"),
    expect(clippy::large_enum_variant, reason = "a program has one, and no heap")
)]
pub(super) enum Configured {
    Move(Move),
    Rate(Rate),
    Experiments(Experiments),
}

/// A move that was checked.
#[derive(Debug)]
pub(super) struct Move {
    configuration: Configuration,
    target: Target,
    pub(super) tuning: PositioningTuning,
    /// The move begins at arming.
    pub(super) positioning: Positioning,
}

/// Why a configuration is refused.
#[derive(Clone, Copy, Debug)]
pub(super) enum MoveError {
    Setting(OutOfBounds),
    Map(MapFault),
    /// The program was built without experiments.
    #[cfg(not(feature = "commissioning"))]
    NoExperiments,
}

impl From<OutOfBounds> for MoveError {
    fn from(error: OutOfBounds) -> Self {
        Self::Setting(error)
    }
}

impl From<MapFault> for MoveError {
    fn from(fault: MapFault) -> Self {
        Self::Map(fault)
    }
}

/// Map, target and limits of the move that is asked for.
pub(super) fn asked<'m>(
    map: &'m MapMemory,
    asked: &Configuration,
    bench: &Bench,
) -> Result<(&'m ResponseMap, Target, Limits), MoveError> {
    let map = bench.check_map(map)?;
    let (target, limits) = asked.checked()?;
    Ok((map, target, limits))
}

impl Configured {
    /// Builds what is asked for in `memory`, by the map there, or leaves `memory` unchanged.
    ///
    /// Construction of the filter computes in double precision and takes longer than a tick. It happens here, before
    /// arming.
    pub(super) fn build(memory: &mut MoveMemory, asked: Asked, bench: &Bench) -> Result<(), MoveError> {
        Self::check(&memory.map, asked, bench)?;
        SelectedFilter::build(&mut memory.filter, asked.filter(), &bench.design, &bench.instruments)?;
        memory.tracker = memory.map.map().ok().map(ResonanceTracker::of);
        Self::put(memory, asked, bench)
    }

    /// What is asked for, checked.
    fn of(map: &MapMemory, asked: Asked, bench: &Bench) -> Result<Self, MoveError> {
        Ok(match asked {
            Asked::Move(configuration) => Self::Move(Move::asked(map, configuration, bench)?),
            Asked::Rate(configuration) => Self::Rate(Rate::asked(map, configuration, bench)?),
            Asked::Experiments(configuration) => Self::Experiments(Experiments::asked(configuration, bench)?),
        })
    }

    /// Whether it is refused.
    // Never inlined: while the filter is constructed, which takes most of the stack, no task is on it.
    #[inline(never)]
    fn check(map: &MapMemory, asked: Asked, bench: &Bench) -> Result<(), MoveError> {
        Self::of(map, asked, bench).map(|_| ())
    }

    /// Puts it in its place.
    // Never inlined: as above.
    #[inline(never)]
    fn put(memory: &mut MoveMemory, asked: Asked, bench: &Bench) -> Result<(), MoveError> {
        memory.configured = Some(Self::of(&memory.map, asked, bench)?);
        Ok(())
    }

    /// What was asked for.
    pub(super) fn asked(&self) -> Asked {
        match self {
            Self::Move(Move { configuration, .. }) => Asked::Move(*configuration),
            Self::Rate(Rate { configuration, .. }) => Asked::Rate(*configuration),
            Self::Experiments(experiments) => Asked::Experiments(experiments.configuration()),
        }
    }

    /// Begins at `now`, by `map`. Target and travel count from `zero`.
    pub(super) fn begin(&mut self, map: &ResponseMap, zero: Angle, now: Time) {
        match self {
            Self::Move(Move { target, tuning, positioning, .. }) => {
                let limits = Limits { travel: tuning.limits.travel.from_zero(zero), ..tuning.limits };
                let tuning = PositioningTuning { limits, ..*tuning };
                *positioning = Positioning::new(map, target.from_zero(zero), tuning, now);
            }
            Self::Rate(rate) => rate.begin(zero, now),
            Self::Experiments(experiments) => experiments.begin(zero, now),
        }
    }

    /// No decision of a task of this kind.
    pub(super) fn no_decisions(&self) -> Decisions {
        match self {
            Self::Move(_) => Decisions::Move(InFlight::new()),
            Self::Rate(_) => Decisions::Rate(InFlight::new()),
            Self::Experiments(_) => Decisions::Experiments(InFlight::new()),
        }
    }
}

/// The decisions of a task that do not act yet.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has one, and no heap")]
pub(super) enum Decisions {
    Move(InFlight<TickReport>),
    Rate(InFlight<RateReport>),
    Experiments(InFlight<ExperimentReport>),
}

impl Default for Decisions {
    fn default() -> Self {
        Self::NONE
    }
}

impl Decisions {
    const NONE: Self = Self::Move(InFlight::new());

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        match self {
            Self::Move(in_flight) => in_flight.clear(),
            Self::Rate(in_flight) => in_flight.clear(),
            Self::Experiments(in_flight) => in_flight.clear(),
        }
    }
}

impl Move {
    fn asked(map: &MapMemory, configuration: Configuration, bench: &Bench) -> Result<Self, MoveError> {
        let (map, target, limits) = asked(map, &configuration, bench)?;
        let tuning = PositioningTuning { limits, ..PositioningTuning::new(&bench.instruments) };
        let positioning = Positioning::new(map, target, tuning, Time::ZERO);
        Ok(Self { configuration, target, tuning, positioning })
    }
}

/// Memory of the configured task, of its decisions that do not act yet, and of the host's response map. A filter is too
/// large for the stack, so on a board this is a static.
#[derive(Debug, Default)]
pub struct MoveMemory {
    pub(super) configured: Option<Configured>,
    pub(super) filter: Option<SelectedFilter>,
    pub(super) map: MapMemory,
    /// Of the motor that the map describes.
    pub(super) tracker: Option<ResonanceTracker>,
    pub(super) in_flight: Decisions,
}

impl MoveMemory {
    /// No task, and the map of Table 1.
    pub const fn new() -> Self {
        Self {
            configured: None,
            filter: None,
            map: MapMemory::new(),
            tracker: None,
            in_flight: Decisions::NONE,
        }
    }

    /// Whether the loop of the configured task has nothing to do at `now`.
    #[inline]
    pub(super) fn is_waiting(&self, now: Time) -> bool {
        match &self.in_flight {
            Decisions::Move(in_flight) => in_flight.is_waiting(now),
            Decisions::Rate(in_flight) => in_flight.is_waiting(now),
            Decisions::Experiments(in_flight) => in_flight.is_waiting(now),
        }
    }

    /// A tick of the loop of the configured task; nothing without one.
    #[inline]
    pub(super) fn tick(&mut self, now: Time, ports: &mut (impl Sense + Drive)) -> Option<LoopReport<'_>> {
        let Self { configured, filter, map, tracker, in_flight } = self;
        let (configured, filter, map) = (configured.as_mut()?, filter.as_mut()?, map.map().ok()?);
        let tracker = tracker.as_mut()?;
        Some(match (configured, in_flight) {
            (Configured::Move(Move { positioning, .. }), Decisions::Move(in_flight)) => {
                LoopReport::Move(tick_by(map, filter, positioning, tracker, in_flight, now, ports))
            }
            (Configured::Rate(rate), Decisions::Rate(in_flight)) => {
                rate.tick(map, filter, tracker, in_flight, now, ports)
            }
            (Configured::Experiments(experiments), Decisions::Experiments(in_flight)) => {
                experiments.tick(filter, in_flight, now, ports)
            }
            // Not armed so.
            _ => return None,
        })
    }
}
