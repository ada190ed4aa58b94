//! A response map as a file, TOML or JSON by its ending: what it was made for, and its rows.
//!
//! ```toml
//! step_walk_correlation = 0.87
//!
//! [design]            # every parameter of the motor
//! "motor.mode_b.frequency_hz" = 6300.0
//!
//! [cruises]           # of modes B and C, weakest first
//! b = [{ amplitude = 0.3, rate_rad_s = 0.99, rate_sd_rad_s = 0.89, coast_s = 0.0027, coast_sd_rad = 0.0016 }]
//! c = []
//!
//! [bursts]            # of each family, shortest first; the turn without its sign
//! step = [{ amplitude = 0.05, ticks = 27, turn_rad = 2.5e-6, motors_sd_rad = 6.8e-7, repeat_sd_rad = 3.5e-9 }]
//!
//! [learnt]            # of the map of one motor: what its moves have learnt (controller::map_correction), all or none
//! step = { value = 1.12, variance = 4.1e-4 }
//! step_walk_covariance = 3.2e-4
//! resonance_b = { offset_hz = 58.0, variance_hz2 = 49.0 }   # from the design's frequency; 0 where it is missing
//! ```
//!
//! JSON has the same names in the same tables. Either is checked by the same rules, and a refusal names the line.

mod format;

use std::collections::BTreeMap;
use std::path::Path;

use controller::ResponseMap;
use controller::map_correction::{LearntFactor, LearntFactors};
use controller::response_map::{Burst, Cruise, Family, MapError, MapPlace};
use estimator::ResonanceOffset;
use motor_model::{DriveMode, MotorParams, Parameter};
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::toml_text::line_and_column;
use format::{MapFormat, Step};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    step_walk_correlation: f32,
    design: BTreeMap<String, f64>,
    cruises: CruiseTables,
    bursts: BurstTables,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learnt: Option<LearntTable>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LearntTable {
    step: FactorLine,
    walk: FactorLine,
    stride: FactorLine,
    nudge: FactorLine,
    throw: FactorLine,
    rate_b: FactorLine,
    rate_c: FactorLine,
    step_walk_covariance: f32,
    #[serde(default)]
    resonance_b: ResonanceLine,
    #[serde(default)]
    resonance_c: ResonanceLine,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FactorLine {
    value: f32,
    variance: f32,
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ResonanceLine {
    offset_hz: f32,
    variance_hz2: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CruiseTables {
    b: Vec<CruiseLine>,
    c: Vec<CruiseLine>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BurstTables {
    step: Vec<BurstLine>,
    walk: Vec<BurstLine>,
    stride: Vec<BurstLine>,
    nudge: Vec<BurstLine>,
    throw: Vec<BurstLine>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CruiseLine {
    amplitude: f32,
    rate_rad_s: f32,
    rate_sd_rad_s: f32,
    coast_s: f32,
    coast_sd_rad: f32,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BurstLine {
    amplitude: f32,
    ticks: u32,
    turn_rad: f32,
    motors_sd_rad: f32,
    repeat_sd_rad: f32,
}

impl From<FactorLine> for LearntFactor {
    fn from(FactorLine { value, variance }: FactorLine) -> Self {
        Self { value, variance }
    }
}

impl From<LearntFactor> for FactorLine {
    fn from(LearntFactor { value, variance }: LearntFactor) -> Self {
        Self { value, variance }
    }
}

impl From<ResonanceLine> for ResonanceOffset<f32> {
    fn from(ResonanceLine { offset_hz, variance_hz2 }: ResonanceLine) -> Self {
        Self { hz: offset_hz, hz2: variance_hz2 }
    }
}

impl From<ResonanceOffset<f32>> for ResonanceLine {
    fn from(ResonanceOffset { hz, hz2 }: ResonanceOffset<f32>) -> Self {
        Self { offset_hz: hz, variance_hz2: hz2 }
    }
}

impl From<LearntTable> for LearntFactors {
    fn from(table: LearntTable) -> Self {
        let LearntTable { step, walk, stride, nudge, throw, rate_b, rate_c, .. } = table;
        Self {
            bursts: [step, walk, stride, nudge, throw].map(Into::into),
            step_walk_covariance: table.step_walk_covariance,
            rates: [rate_b, rate_c].map(Into::into),
            resonances: [table.resonance_b, table.resonance_c].map(Into::into),
        }
    }
}

impl From<LearntFactors> for LearntTable {
    fn from(factors: LearntFactors) -> Self {
        let LearntFactors { bursts, step_walk_covariance, rates, resonances } = factors;
        let ([step, walk, stride, nudge, throw], [rate_b, rate_c]) =
            (bursts.map(Into::into), rates.map(Into::into));
        let [resonance_b, resonance_c] = resonances.map(Into::into);
        Self {
            step,
            walk,
            stride,
            nudge,
            throw,
            rate_b,
            rate_c,
            step_walk_covariance,
            resonance_b,
            resonance_c,
        }
    }
}

impl CruiseLine {
    fn of(self, mode: DriveMode) -> Cruise {
        let Self { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad } = self;
        Cruise { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad }
    }
}

impl From<&Cruise> for CruiseLine {
    fn from(cruise: &Cruise) -> Self {
        let Cruise { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad, .. } = *cruise;
        Self { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad }
    }
}

impl From<BurstLine> for Burst {
    fn from(line: BurstLine) -> Self {
        let BurstLine { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = line;
        Self { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad }
    }
}

impl From<&Burst> for BurstLine {
    fn from(burst: &Burst) -> Self {
        let Burst { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = *burst;
        Self { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad }
    }
}

/// The map that `text` is; `path` is for its ending and for messages.
///
/// # Errors
/// When it has not this form, lacks a parameter of the design, or breaks a rule of [`ResponseMap::try_new`].
pub fn parse_response_map(text: &str, path: &Path) -> Result<ResponseMap, SceneError> {
    let format = MapFormat::of(path);
    let malformed = |(line, column): (usize, usize), message: String| SceneError::Malformed {
        path: path.to_owned(),
        line,
        column,
        message,
    };
    let at = |place: &[Step]| line_and_column(text, format.offset(text, place).unwrap_or(text.len()));
    let file: MapFile = format.parse(text).map_err(|(place, message)| malformed(place, message))?;
    let design = design(&file.design)
        .map_err(|(key, message)| malformed(at(&design_place(key.as_deref())), message))?;
    let CruiseTables { b, c } = &file.cruises;
    let of = |lines: &[CruiseLine], mode| lines.iter().map(|line| line.of(mode)).collect::<Vec<_>>();
    let cruises = [of(b, DriveMode::B), of(c, DriveMode::C)].concat();
    let BurstTables { step, walk, stride, nudge, throw } = file.bursts;
    let bursts = [step, walk, stride, nudge, throw]
        .map(|lines| lines.into_iter().map(Burst::from).collect::<Vec<_>>());
    let slices = bursts.each_ref().map(Vec::as_slice);
    let map = ResponseMap::try_new(design, &cruises, slices, file.step_walk_correlation);
    let learnt = file.learnt.map(LearntFactors::from);
    map.and_then(|map| learnt.map_or(Ok(map), |learnt| map.with_learnt(learnt))).map_err(|source| {
        let row_of = |place, row: usize| match place {
            MapPlace::Cruises if row < b.len() => vec![Step::Key("cruises"), Step::Key("b"), Step::Row(row)],
            MapPlace::Cruises => vec![Step::Key("cruises"), Step::Key("c"), Step::Row(row - b.len())],
            MapPlace::Bursts(family) => {
                vec![Step::Key("bursts"), Step::Key(family.name()), Step::Row(row)]
            }
        };
        let place = match source {
            MapError::TooMany { place, max, .. } => row_of(place, max),
            MapError::OutOfBounds { place, row, .. } | MapError::Unordered { place, row, .. } => {
                row_of(place, row - 1)
            }
            MapError::ModesMixed { row } => row_of(MapPlace::Cruises, row - 1),
            MapError::Correlation { .. } => vec![Step::Key("step_walk_correlation")],
            MapError::Learnt { field, .. } => vec![Step::Key("learnt"), Step::Key(field.name())],
        };
        SceneError::ResponseMap { path: path.to_owned(), line: at(&place).0, source }
    })
}

/// Where `key` stands in the design; without a key the design itself.
fn design_place(key: Option<&str>) -> Vec<Step<'_>> {
    std::iter::once("design").chain(key).map(Step::Key).collect()
}

/// The design, which names every parameter. An error names the key, if it has one, and what is wrong.
fn design(values: &BTreeMap<String, f64>) -> Result<MotorParams, (Option<String>, String)> {
    if let Some(key) = values.keys().find(|key| Parameter::from_key(key).is_none()) {
        return Err((Some(key.clone()), format!("{key} is no parameter of the motor")));
    }
    Parameter::ALL.into_iter().try_fold(MotorParams::nominal(), |design, parameter| {
        let key = parameter.spec().key;
        let value = values.get(key).ok_or_else(|| (None, format!("the design lacks {key}")))?;
        design
            .with(parameter, *value)
            .map_err(|error| (Some(key.to_owned()), SceneError::from(error).to_string()))
    })
}

/// The text of the file of `map` at `path`: JSON if it ends in `.json`, TOML otherwise.
pub fn response_map_text(map: &ResponseMap, path: &Path) -> String {
    let of = |mode| map.cruises_of(mode).iter().map(Into::into).collect();
    let rows = |family| map.bursts(family).iter().map(Into::into).collect();
    let [step, walk, stride, nudge, throw] = Family::ALL.map(rows);
    let file = MapFile {
        step_walk_correlation: map.step_walk_correlation(),
        design: Parameter::ALL
            .map(|parameter| (parameter.spec().key.to_owned(), map.design().get(parameter)))
            .into(),
        cruises: CruiseTables { b: of(DriveMode::B), c: of(DriveMode::C) },
        bursts: BurstTables { step, walk, stride, nudge, throw },
        learnt: map.learnt().map(LearntTable::from),
    };
    MapFormat::of(path).text(&file)
}

#[cfg(test)]
mod tests;
