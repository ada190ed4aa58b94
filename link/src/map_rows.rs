//! The response map on the wire: its rows, a few in each frame, and why a board refuses them.
//!
//! ```text
//! MapBegin, MapRows, MapRows ..., MapLearnt, MapEnd    each is answered by Described, or by the fault Map
//! ```
//!
//! The rows of a table come in its order, and the tables in any order. The board checks all rows that it has with every
//! frame ([`ResponseMap::try_new`]), and takes the map at its end, where the number of rows tells whether one was lost.
//! What moves have learnt of the motor comes with the map of one motor alone; in the other direction it is the answer
//! to a question.

use controller::ResponseMap;
use controller::map_correction::{LearntFactor, LearntFactors};
use controller::response_map::{Burst, Cruise, Family, MapError, MapField, MapPlace};
use estimator::ResonanceOffset;
use motor_model::DriveMode;
use serde::{Deserialize, Serialize};

use crate::message::HostMessage;
use crate::numbering::Coded;

/// Most rows in a frame.
pub const MAP_ROWS_MAX: usize = 8;

/// Rows of one table of a response map, to be put after those that came before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MapRows {
    /// Rows of the cruises.
    Cruises(heapless::Vec<CruiseRecord, MAP_ROWS_MAX>),
    /// Rows of the bursts of a family.
    Bursts {
        /// The family.
        family: Coded<Family>,
        /// Its rows.
        rows: heapless::Vec<BurstRecord, MAP_ROWS_MAX>,
    },
}

/// The end of a response map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapEnd {
    /// Rows of all its tables together.
    pub rows: u8,
    /// Correlation over motors of the turns by a step and by a walk, -1 to 1.
    pub step_walk_correlation: f32,
}

/// [`Cruise`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CruiseRecord {
    /// The mode; off is none that a cruise has.
    pub mode: Coded<Option<DriveMode>>,
    /// Drive amplitude, 0 to 1.
    pub amplitude: f32,
    /// Mean rate in rad/s.
    pub rate_rad_s: f32,
    /// Standard deviation of the rate over motors, in rad/s.
    pub rate_sd_rad_s: f32,
    /// Coast per rate at the cut, in s.
    pub coast_s: f32,
    /// Standard deviation of the coast, in rad.
    pub coast_sd_rad: f32,
}

impl From<&Cruise> for CruiseRecord {
    fn from(cruise: &Cruise) -> Self {
        let Cruise { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad } = *cruise;
        Self { mode: Some(mode).into(), amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad }
    }
}

impl CruiseRecord {
    /// The cruise; `None` where the mode is no mode.
    pub fn cruise(&self) -> Option<Cruise> {
        let Self { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad } = *self;
        let mode = mode.value()??;
        Some(Cruise { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad })
    }
}

/// [`Burst`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BurstRecord {
    /// Drive amplitude, 0 to 1.
    pub amplitude: f32,
    /// Ticks of the loop for which the drive is on.
    pub ticks: u32,
    /// Magnitude of the mean turn over motors, in rad.
    pub turn_rad: f32,
    /// Standard deviation over motors of a motor's mean turn, in rad.
    pub motors_sd_rad: f32,
    /// Standard deviation from burst to burst of one motor, in rad.
    pub repeat_sd_rad: f32,
}

impl From<&Burst> for BurstRecord {
    fn from(burst: &Burst) -> Self {
        let Burst { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = *burst;
        Self { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad }
    }
}

impl From<&BurstRecord> for Burst {
    fn from(record: &BurstRecord) -> Self {
        let BurstRecord { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = *record;
        Self { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad }
    }
}

/// [`LearntFactors`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearntRecord {
    /// Value and variance of each factor: of the bursts in the order of [`Family::ALL`], of the rates in modes B and C.
    pub factors: [[f32; 2]; Family::ALL.len() + 2],
    /// Covariance of the factors of steps and walks.
    pub step_walk_covariance: f32,
    /// Offset in Hz and its variance in Hz^2 of the resonances of modes B and C.
    pub resonances: [[f32; 2]; 2],
}

impl From<LearntFactors> for LearntRecord {
    fn from(LearntFactors { bursts, step_walk_covariance, rates, resonances }: LearntFactors) -> Self {
        let pair = |LearntFactor { value, variance }| [value, variance];
        let ([step, walk, stride, nudge, throw], [b, c]) = (bursts.map(pair), rates.map(pair));
        let resonances = resonances.map(|ResonanceOffset { hz, hz2 }| [hz, hz2]);
        Self { factors: [step, walk, stride, nudge, throw, b, c], step_walk_covariance, resonances }
    }
}

impl From<LearntRecord> for LearntFactors {
    fn from(LearntRecord { factors, step_walk_covariance, resonances }: LearntRecord) -> Self {
        let [step, walk, stride, nudge, throw, b, c] =
            factors.map(|[value, variance]| LearntFactor { value, variance });
        let resonances = resonances.map(|[hz, hz2]| ResonanceOffset { hz, hz2 });
        Self { bursts: [step, walk, stride, nudge, throw], step_walk_covariance, rates: [b, c], resonances }
    }
}

/// The messages that bring `map` to a board, in their order. Its design goes by
/// [`HostMessage::MotorParameter`] before them.
pub fn map_messages(map: &ResponseMap) -> impl Iterator<Item = HostMessage> + '_ {
    let cruises = map.cruises().chunks(MAP_ROWS_MAX);
    let cruises = cruises.map(|rows| MapRows::Cruises(rows.iter().map(CruiseRecord::from).collect()));
    let bursts = Family::ALL.into_iter().flat_map(|family| {
        map.bursts(family).chunks(MAP_ROWS_MAX).map(move |rows| MapRows::Bursts {
            family: family.into(),
            rows: rows.iter().map(BurstRecord::from).collect(),
        })
    });
    let end = MapEnd { rows: rows_of(map), step_walk_correlation: map.step_walk_correlation() };
    let rows = cruises.chain(bursts).map(HostMessage::MapRows);
    let learnt = map.learnt().map(|learnt| HostMessage::MapLearnt(learnt.into()));
    let end = core::iter::once(HostMessage::MapEnd(end));
    core::iter::once(HostMessage::MapBegin).chain(rows).chain(learnt).chain(end)
}

/// Rows of all tables of `map` together.
#[expect(clippy::cast_possible_truncation, reason = "at most 16 in each of six tables")]
pub fn rows_of(map: &ResponseMap) -> u8 {
    let bursts: usize = Family::ALL.into_iter().map(|family| map.bursts(family).len()).sum();
    (map.cruises().len() + bursts) as u8
}

/// Why a response map is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum MapFault {
    /// More rows than the table has room for.
    #[error("{table} has more rows than there is room for")]
    TooMany {
        /// The table.
        table: Coded<MapPlace>,
    },
    /// A number that is outside of its bounds, or not finite.
    #[error("{table} row {row}: {field} is outside its bounds")]
    OutOfBounds {
        /// The table.
        table: Coded<MapPlace>,
        /// The row, from 1.
        row: u8,
        /// The number.
        field: Coded<MapField>,
    },
    /// A number that does not rise, or that falls, from the row before it.
    #[error("{table} row {row}: {field} after that of the row before it: the rows rise")]
    Unordered {
        /// The table.
        table: Coded<MapPlace>,
        /// The row, from 1.
        row: u8,
        /// The number.
        field: Coded<MapField>,
    },
    /// A cruise of mode B after one of mode C.
    #[error("cruises row {row}: mode B after mode C: the cruises of mode B come first")]
    ModesMixed {
        /// The row, from 1.
        row: u8,
    },
    /// The correlation of steps and walks is outside of -1 to 1.
    #[error("step_walk_correlation is outside its bounds -1 to 1")]
    Correlation,
    /// What was learnt of the motor is outside of its bounds, or not finite.
    #[error("what was learnt of the motor is outside its bounds")]
    Learnt,
    /// A family, or the mode of a cruise, whose number has no meaning.
    #[error("a row of no family, or of no mode")]
    Unknown,
    /// Rows without a begin, an end with another number of rows than came, or a configuration before the end.
    #[error("the response map is incomplete: the board has {rows} rows of it")]
    Incomplete {
        /// Rows that came.
        rows: u8,
    },
    /// A configuration for another design of the motor than that of the map. Without a map from the host that is
    /// Table 1.
    #[error("the response map is for another design of the motor")]
    OtherDesign,
}

impl From<MapError> for MapFault {
    fn from(error: MapError) -> Self {
        // A table has at most 24 rows here: those that it has room for and those of a frame.
        let place = |row: usize| u8::try_from(row).unwrap_or(u8::MAX);
        match error {
            MapError::TooMany { place: table, .. } => Self::TooMany { table: table.into() },
            MapError::OutOfBounds { place: table, row, field, .. } => {
                Self::OutOfBounds { table: table.into(), row: place(row), field: field.into() }
            }
            MapError::Unordered { place: table, row, field, .. } => {
                Self::Unordered { table: table.into(), row: place(row), field: field.into() }
            }
            MapError::ModesMixed { row } => Self::ModesMixed { row: place(row) },
            MapError::Correlation { .. } => Self::Correlation,
            MapError::Learnt { .. } => Self::Learnt,
        }
    }
}

#[cfg(test)]
mod tests;
