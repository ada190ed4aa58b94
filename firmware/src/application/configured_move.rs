//! The move that the host has configured: what it is made of, and the memory that it takes.
//!
//! The host describes its bench first, instruments, motor and map, and then configures the move on it.

use controller::{Limits, Positioning, PositioningTuning, ResponseMap, Target};
use estimator::Instruments;
use link::{Configuration, MapFault, MotorParameterRecord};
use motor_model::{MotorParams, OutOfBounds, Parameter, Time};

use super::map_memory::MapMemory;
use crate::filter::SelectedFilter;

/// Index of the last parameter of the motor.
#[expect(clippy::cast_possible_truncation, reason = "a few dozen")]
const PARAMETER_INDEX_MAX: u8 = (Parameter::ALL.len() - 1) as u8;

/// Longest deadline of a move, in ns, and its key: a day.
const DEADLINE_MAX_S: f64 = 86_400.0;
const DEADLINE_KEY: &str = "position.deadline_s";

/// Motor and instruments of the bench, as the host has described them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bench {
    pub(super) design: MotorParams,
    pub(super) instruments: Instruments,
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
}

/// A configuration that was checked. Its filter has a place of its own in [`MoveMemory`].
///
/// Construction of the filter computes in double precision and takes longer than a tick. It happens here, before
/// arming.
#[derive(Debug)]
pub(super) struct Move {
    pub(super) configuration: Configuration,
    pub(super) target: Target,
    pub(super) tuning: PositioningTuning,
    /// The move begins at arming.
    pub(super) positioning: Positioning,
}

/// Why a configuration is refused.
#[derive(Clone, Copy, Debug)]
pub(super) enum MoveError {
    Setting(OutOfBounds),
    Map(MapFault),
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
    let map = map.map()?;
    if *map.design() != bench.design {
        return Err(MapFault::OtherDesign.into());
    }
    let Configuration { target_deg, tolerance_deg, deadline_nanos, .. } = *asked;
    let target = Target::try_new(target_deg, tolerance_deg)?;
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    OutOfBounds::check(DEADLINE_KEY, deadline_nanos as f64 * 1e-9, 0.0, DEADLINE_MAX_S, "s")?;
    Ok((map, target, Limits { deadline_nanos, ..Limits::default() }))
}

impl Move {
    /// Builds the move in `memory`, by the map there, or leaves `memory` unchanged.
    pub(super) fn build(
        memory: &mut MoveMemory,
        configuration: Configuration,
        bench: &Bench,
    ) -> Result<(), MoveError> {
        let (map, target, limits) = asked(&memory.map, &configuration, bench)?;
        let tuning = PositioningTuning { limits, ..PositioningTuning::new(&bench.instruments) };
        SelectedFilter::build(&mut memory.filter, configuration.filter, &bench.design, &bench.instruments)?;
        let positioning = Positioning::new(map, target, tuning, Time::ZERO);
        memory.configured = Some(Self { configuration, target, tuning, positioning });
        Ok(())
    }
}

/// Memory of the configured move and of the host's response map. A filter is too large for the stack, so on a board
/// this is a static.
#[derive(Debug, Default)]
pub struct MoveMemory {
    pub(super) configured: Option<Move>,
    pub(super) filter: Option<SelectedFilter>,
    pub(super) map: MapMemory,
}

impl MoveMemory {
    /// No move, and the map of Table 1.
    pub const fn new() -> Self {
        Self { configured: None, filter: None, map: MapMemory::new() }
    }
}
