//! A response map from rows that somebody else wrote: every rule by which it is refused.

use core::fmt;

use estimator::ResonanceOffset;
use motor_model::{DriveMode, MotorParams};

use crate::map_correction::LearntField;

use super::{
    BURSTS_MAX, Burst, CRUISES_MAX, Cruise, Family, PerFamily, ResponseMap, burst_rows, clockwise,
    cruise_rows, direction, half_widths_hz,
};

/// Longest burst of a map in ticks: ten seconds.
const TICKS_MAX: u32 = 1_000_000;
/// Largest turn of a burst, in rad, and largest coast: keeps the arithmetic finite.
const TURN_MAX_RAD: f32 = 1e3;
/// Largest rate of a cruise in rad/s, for the same reason.
const RATE_MAX_RAD_S: f32 = 1e4;
/// Longest coast per rate in s, for the same reason.
const COAST_MAX_S: f32 = 100.0;

/// A table of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapPlace {
    /// The cruises.
    Cruises,
    /// The bursts of a family.
    Bursts(Family),
}

/// A number of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapField {
    /// Drive amplitude.
    Amplitude,
    /// Ticks of a burst.
    Ticks,
    /// Turn of a burst.
    Turn,
    /// Its spread over motors.
    MotorsSd,
    /// Its spread from burst to burst.
    RepeatSd,
    /// Rate of a cruise.
    Rate,
    /// Its spread over motors.
    RateSd,
    /// Coast per rate.
    Coast,
    /// Spread of the coast.
    CoastSd,
}

impl MapField {
    /// Its name in a map's file, with its unit.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Amplitude => "amplitude",
            Self::Ticks => "ticks",
            Self::Turn => "turn_rad",
            Self::MotorsSd => "motors_sd_rad",
            Self::RepeatSd => "repeat_sd_rad",
            Self::Rate => "rate_rad_s",
            Self::RateSd => "rate_sd_rad_s",
            Self::Coast => "coast_s",
            Self::CoastSd => "coast_sd_rad",
        }
    }
}

/// Why rows are no response map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapError {
    /// More rows than there is room for.
    TooMany {
        /// The table.
        place: MapPlace,
        /// Its rows.
        count: usize,
        /// Most rows allowed.
        max: usize,
    },
    /// A number that is outside of its bounds, or not finite.
    OutOfBounds {
        /// The table.
        place: MapPlace,
        /// The row, from 1.
        row: usize,
        /// The number.
        field: MapField,
        /// Its value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// A number that does not rise (turn, rate), or that falls (amplitude, ticks), from the row before it.
    Unordered {
        /// The table.
        place: MapPlace,
        /// The row, from 1.
        row: usize,
        /// The number.
        field: MapField,
        /// Its magnitude in the row before.
        before: f32,
        /// Its magnitude in this row.
        value: f32,
    },
    /// A cruise of mode B after one of mode C.
    ModesMixed {
        /// The row, from 1.
        row: usize,
    },
    /// The correlation of steps and walks is outside of -1 to 1.
    Correlation {
        /// The value.
        value: f32,
    },
    /// What was learnt of the motor is outside of its bounds, or not finite.
    Learnt {
        /// The factor, or the covariance.
        field: LearntField,
        /// Its value, or its variance.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
}

impl fmt::Display for MapPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cruises => "cruises",
            Self::Bursts(family) => family.name(),
        })
    }
}

impl fmt::Display for MapField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooMany { place, count, max } => write!(f, "{place} has {count} rows, at most {max}"),
            Self::OutOfBounds { place, row, field, value, min, max } => {
                let field = field.name();
                write!(f, "{place} row {row}: {field} = {value} is outside its bounds {min} to {max}")
            }
            Self::Unordered { place, row, field, before, value } => {
                let field = field.name();
                write!(
                    f,
                    "{place} row {row}: {field} = {value} after {before} in row {}: the rows rise",
                    row - 1
                )
            }
            Self::ModesMixed { row } => {
                write!(f, "cruises row {row}: mode B after mode C: the cruises of mode B come first")
            }
            Self::Correlation { value } => {
                write!(f, "step_walk_correlation = {value} is outside its bounds -1 to 1")
            }
            Self::Learnt { field, value, min, max } => {
                let field = field.name();
                write!(f, "learnt {field} = {value} is outside its bounds {min} to {max}")
            }
        }
    }
}

impl core::error::Error for MapError {}

impl ResponseMap {
    /// A map for motors drawn around `design`. A family, or a mode's cruises, may be empty: it is then not driven.
    ///
    /// Per table at most [`CRUISES_MAX`] and [`BURSTS_MAX`] rows. The cruises are those of mode B and then those of
    /// mode C. Rates rise in magnitude within a mode and have its direction, turns rise within a family, amplitudes and
    /// ticks do not fall.
    ///
    /// # Errors
    /// When a number is not finite or outside of its bounds, or the rows are too many or out of order.
    pub fn try_new(
        design: MotorParams,
        cruises: &[Cruise],
        bursts: [&[Burst]; Family::ALL.len()],
        step_walk_correlation: f32,
    ) -> Result<Self, MapError> {
        let mut map = Self::without_rows(design);
        map.append_cruises(cruises)?;
        for (family, rows) in Family::ALL.into_iter().zip(bursts) {
            map.append_bursts(family, rows)?;
        }
        map.complete(step_walk_correlation)?;
        Ok(map)
    }

    /// A map for motors drawn around `design` that has no rows yet, for a program that gets them in parts. Each part is
    /// checked with the rows that came before it; [`Self::complete`] ends the map.
    pub const fn without_rows(design: MotorParams) -> Self {
        Self {
            design,
            cruises: cruise_rows(&[]),
            clockwise_cruises: 0,
            bursts: PerFamily::of([const { burst_rows(&[]) }; Family::ALL.len()]),
            step_walk_correlation: 0.0,
            cruise_from_rad: [f32::INFINITY; 2],
            stride_from_rad: f32::INFINITY,
            correction: None,
            resonances: [ResonanceOffset::NONE; 2],
            half_widths_hz: half_widths_hz(&design),
        }
    }

    /// Appends `rows` to the cruises.
    ///
    /// # Errors
    /// As [`Self::try_new`]; the map is then as before.
    pub fn append_cruises(&mut self, rows: &[Cruise]) -> Result<(), MapError> {
        let before = self.cruises.as_slice().len();
        if !self.cruises.append(rows) {
            let (place, count) = (MapPlace::Cruises, before + rows.len());
            return Err(MapError::TooMany { place, count, max: CRUISES_MAX });
        }
        check_cruises(self.cruises.as_slice()).inspect_err(|_| self.cruises.truncate(before))?;
        self.clockwise_cruises = clockwise(self.cruises.as_slice());
        Ok(())
    }

    /// Appends `rows` to the bursts of `family`.
    ///
    /// # Errors
    /// As [`Self::try_new`]; the map is then as before.
    pub fn append_bursts(&mut self, family: Family, rows: &[Burst]) -> Result<(), MapError> {
        let bursts = self.bursts.get_mut(family);
        let before = bursts.as_slice().len();
        if !bursts.append(rows) {
            let (place, count) = (MapPlace::Bursts(family), before + rows.len());
            return Err(MapError::TooMany { place, count, max: BURSTS_MAX });
        }
        check_bursts(family, bursts.as_slice()).inspect_err(|_| bursts.truncate(before))
    }

    /// Ends a map that has all its rows. Until then it has no distances from which it is driven by cruises and strides.
    ///
    /// # Errors
    /// When the correlation is outside of -1 to 1, or not finite; the map is then as before.
    pub fn complete(&mut self, step_walk_correlation: f32) -> Result<(), MapError> {
        if !(-1.0..=1.0).contains(&step_walk_correlation) {
            return Err(MapError::Correlation { value: step_walk_correlation });
        }
        self.step_walk_correlation = step_walk_correlation;
        self.find_distances();
        Ok(())
    }
}

/// A row of a table.
struct Row {
    place: MapPlace,
    row: usize,
}

impl Row {
    fn within(&self, field: MapField, value: f32, min: f32, max: f32) -> Result<(), MapError> {
        let Self { place, row } = *self;
        if value >= min && value <= max {
            Ok(())
        } else {
            Err(MapError::OutOfBounds { place, row, field, value, min, max })
        }
    }

    /// From zero to `max`.
    fn positive(&self, field: MapField, value: f32, max: f32) -> Result<(), MapError> {
        self.within(field, value, f32::MIN_POSITIVE, max)
    }

    fn ordered(&self, is: bool, field: MapField, before: f32, value: f32) -> Result<(), MapError> {
        let Self { place, row } = *self;
        if is { Ok(()) } else { Err(MapError::Unordered { place, row, field, before, value }) }
    }
}

fn check_cruises(cruises: &[Cruise]) -> Result<(), MapError> {
    let place = MapPlace::Cruises;
    let mut before: Option<&Cruise> = None;
    for (row, cruise) in (1..).zip(cruises) {
        let at = Row { place, row };
        let rate = direction(cruise.mode) * cruise.rate_rad_s;
        at.positive(MapField::Amplitude, cruise.amplitude, 1.0)?;
        at.positive(MapField::Rate, rate, RATE_MAX_RAD_S)?;
        at.within(MapField::RateSd, cruise.rate_sd_rad_s, 0.0, RATE_MAX_RAD_S)?;
        at.within(MapField::Coast, cruise.coast_s, 0.0, COAST_MAX_S)?;
        at.within(MapField::CoastSd, cruise.coast_sd_rad, 0.0, TURN_MAX_RAD)?;
        if let Some(before) = before {
            if cruise.mode == before.mode {
                let slower = direction(before.mode) * before.rate_rad_s;
                at.ordered(slower < rate, MapField::Rate, slower, rate)?;
                let weaker = before.amplitude;
                at.ordered(weaker < cruise.amplitude, MapField::Amplitude, weaker, cruise.amplitude)?;
            } else if cruise.mode == DriveMode::B {
                return Err(MapError::ModesMixed { row });
            }
        }
        before = Some(cruise);
    }
    Ok(())
}

fn check_bursts(family: Family, bursts: &[Burst]) -> Result<(), MapError> {
    let place = MapPlace::Bursts(family);
    let mut before: Option<&Burst> = None;
    for (row, burst) in (1..).zip(bursts) {
        let at = Row { place, row };
        #[expect(clippy::cast_precision_loss, reason = "for a bound and a message")]
        let ticks = |burst: &Burst| burst.ticks as f32;
        at.positive(MapField::Amplitude, burst.amplitude, 1.0)?;
        #[expect(clippy::cast_precision_loss, reason = "exact")]
        at.within(MapField::Ticks, ticks(burst), 1.0, TICKS_MAX as f32)?;
        at.positive(MapField::Turn, burst.turn_rad, TURN_MAX_RAD)?;
        at.within(MapField::MotorsSd, burst.motors_sd_rad, 0.0, TURN_MAX_RAD)?;
        at.within(MapField::RepeatSd, burst.repeat_sd_rad, 0.0, TURN_MAX_RAD)?;
        if let Some(before) = before {
            let shorter = before.turn_rad;
            at.ordered(shorter < burst.turn_rad, MapField::Turn, shorter, burst.turn_rad)?;
            let weaker = before.amplitude;
            at.ordered(weaker <= burst.amplitude, MapField::Amplitude, weaker, burst.amplitude)?;
            at.ordered(before.ticks <= burst.ticks, MapField::Ticks, ticks(before), ticks(burst))?;
        }
        before = Some(burst);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
