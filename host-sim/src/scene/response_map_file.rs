//! A response map as a TOML file: what it was made for, and its rows.
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
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise, Family, MapError, MapPlace};
use motor_model::{DriveMode, MotorParams, Parameter};
use serde::Deserialize;
use toml::Spanned;

use super::SceneError;
use super::file::{self, line_and_column};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    step_walk_correlation: Spanned<f32>,
    design: Spanned<BTreeMap<String, Spanned<f64>>>,
    cruises: CruiseTables,
    bursts: BurstTables,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CruiseTables {
    b: Vec<Spanned<CruiseLine>>,
    c: Vec<Spanned<CruiseLine>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BurstTables {
    step: Vec<Spanned<BurstLine>>,
    walk: Vec<Spanned<BurstLine>>,
    stride: Vec<Spanned<BurstLine>>,
    nudge: Vec<Spanned<BurstLine>>,
    throw: Vec<Spanned<BurstLine>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CruiseLine {
    amplitude: f32,
    rate_rad_s: f32,
    rate_sd_rad_s: f32,
    coast_s: f32,
    coast_sd_rad: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BurstLine {
    amplitude: f32,
    ticks: u32,
    turn_rad: f32,
    motors_sd_rad: f32,
    repeat_sd_rad: f32,
}

impl CruiseLine {
    fn of(&self, mode: DriveMode) -> Cruise {
        let Self { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad } = *self;
        Cruise { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad }
    }
}

impl BurstLine {
    fn burst(&self) -> Burst {
        let Self { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = *self;
        Burst { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad }
    }
}

/// Reads the map in the file at `path`.
///
/// # Errors
/// When it cannot be read, is no TOML of this form, lacks a parameter of the design, or breaks a rule of
/// [`ResponseMap::try_new`].
pub fn read_response_map(path: &Path) -> Result<ResponseMap, SceneError> {
    let text = file::read(path).map_err(|source| SceneError::Unreadable { path: path.to_owned(), source })?;
    parse_response_map(&text, path)
}

/// The map that `text` is; `path` is for messages.
///
/// # Errors
/// As [`read_response_map`], but for the file.
pub fn parse_response_map(text: &str, path: &Path) -> Result<ResponseMap, SceneError> {
    let malformed = |offset: usize, message: &str| {
        let (line, column) = line_and_column(text, offset);
        SceneError::Malformed { path: path.to_owned(), line, column, message: message.to_owned() }
    };
    let file: MapFile = toml::from_str(text)
        .map_err(|error| malformed(error.span().map_or(text.len(), |span| span.start), error.message()))?;
    let design = design(&file.design, &malformed)?;
    let CruiseTables { b, c } = &file.cruises;
    let modes = [(b, DriveMode::B), (c, DriveMode::C)];
    let cruises: Vec<Cruise> =
        modes.iter().flat_map(|(rows, mode)| rows.iter().map(|row| row.get_ref().of(*mode))).collect();
    let BurstTables { step, walk, stride, nudge, throw } = &file.bursts;
    let families = [step, walk, stride, nudge, throw];
    let bursts = families.map(|rows| rows.iter().map(|row| row.get_ref().burst()).collect::<Vec<_>>());
    let slices = bursts.each_ref().map(Vec::as_slice);
    ResponseMap::try_new(design, &cruises, slices, *file.step_walk_correlation.get_ref()).map_err(|source| {
        let cruise = |row: usize| b.iter().chain(c).nth(row).map(Spanned::span);
        let burst = |family: Family, row: usize| families[family as usize].get(row).map(Spanned::span);
        let of = |place, row: usize| match place {
            MapPlace::Cruises => cruise(row - 1),
            MapPlace::Bursts(family) => burst(family, row - 1),
        };
        let span = match source {
            MapError::TooMany { place, max, .. } => of(place, max + 1),
            MapError::OutOfBounds { place, row, .. } | MapError::Unordered { place, row, .. } => {
                of(place, row)
            }
            MapError::ModesMixed { row } => cruise(row - 1),
            MapError::Correlation { .. } => Some(file.step_walk_correlation.span()),
        };
        let (line, _) = line_and_column(text, span.map_or(text.len(), |span| span.start));
        SceneError::ResponseMap { path: path.to_owned(), line, source }
    })
}

/// The design, which names every parameter.
fn design(
    values: &Spanned<BTreeMap<String, Spanned<f64>>>,
    malformed: &impl Fn(usize, &str) -> SceneError,
) -> Result<MotorParams, SceneError> {
    if let Some((key, value)) = values.get_ref().iter().find(|(key, _)| Parameter::from_key(key).is_none()) {
        return Err(malformed(value.span().start, &format!("{key} is no parameter of the motor")));
    }
    Parameter::ALL.into_iter().try_fold(MotorParams::nominal(), |design, parameter| {
        let key = parameter.spec().key;
        let Some(value) = values.get_ref().get(key) else {
            return Err(malformed(values.span().start, &format!("the design lacks {key}")));
        };
        design
            .with(parameter, *value.get_ref())
            .map_err(|error| malformed(value.span().start, &SceneError::from(error).to_string()))
    })
}

/// The text of the file of `map`.
pub fn response_map_text(map: &ResponseMap) -> String {
    let mut text = format!(
        "# The response map of motors drawn around a design: `host-sim response-map --out FILE.toml`.\n\
         step_walk_correlation = {:?}\n\n[design]\n",
        map.step_walk_correlation()
    );
    // Writing to a string cannot fail.
    for parameter in Parameter::ALL {
        let _ = writeln!(text, "{:?} = {:?}", parameter.spec().key, map.design().get(parameter));
    }
    text.push_str("\n[cruises]\n");
    for (name, mode) in [("b", DriveMode::B), ("c", DriveMode::C)] {
        let _ = writeln!(text, "{name} = [");
        for cruise in map.cruises().iter().filter(|cruise| cruise.mode == mode) {
            let Cruise { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad, .. } = cruise;
            let _ = writeln!(
                text,
                "    {{ amplitude = {amplitude:?}, rate_rad_s = {rate_rad_s:?}, rate_sd_rad_s = {rate_sd_rad_s:?}, \
                 coast_s = {coast_s:?}, coast_sd_rad = {coast_sd_rad:?} }},"
            );
        }
        text.push_str("]\n");
    }
    text.push_str("\n[bursts]\n");
    for family in Family::ALL {
        let _ = writeln!(text, "{} = [", family.name());
        for burst in map.bursts(family) {
            let Burst { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = burst;
            let _ = writeln!(
                text,
                "    {{ amplitude = {amplitude:?}, ticks = {ticks}, turn_rad = {turn_rad:?}, \
                 motors_sd_rad = {motors_sd_rad:?}, repeat_sd_rad = {repeat_sd_rad:?} }},"
            );
        }
        text.push_str("]\n");
    }
    text
}

#[cfg(test)]
mod tests;
