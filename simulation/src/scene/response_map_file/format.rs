//! The two formats of a map's file: how each is read and written, and where in its text a value stands.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use motor_model::Parameter;
use serde::Serialize;
use serde_json::value::RawValue;
use toml::de::{DeTable, DeValue};

use super::super::toml_text::line_and_column;
use super::{BurstLine, CruiseLine, FactorLine, LearntTable, MapFile, ResonanceLine};

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MapFormat {
    Toml,
    Json,
}

/// A step on the way from the whole file to a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step<'a> {
    /// Into the value of that key.
    Key(&'a str),
    /// Into that row, from 0.
    Row(usize),
}

impl MapFormat {
    /// That of the file at `path`, by its ending.
    pub(super) fn of(path: &Path) -> Self {
        let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        if is_json { Self::Json } else { Self::Toml }
    }

    /// The file that `text` is.
    ///
    /// # Errors
    /// When it has not this form: line and column, and what is wrong.
    pub(super) fn parse(self, text: &str) -> Result<MapFile, ((usize, usize), String)> {
        match self {
            Self::Toml => toml::from_str(text).map_err(|error| {
                let offset = error.span().map_or(text.len(), |span| span.start);
                (line_and_column(text, offset), error.message().to_owned())
            }),
            Self::Json => serde_json::from_str(text).map_err(|error| {
                let place = (error.line().max(1), error.column().max(1));
                let message = error.to_string();
                // The place follows the message, and stands before it in ours.
                let end = message.rfind(" at line ").unwrap_or(message.len());
                (place, message[..end].to_owned())
            }),
        }
    }

    /// Where the value at `place` begins in `text`, which is of this format; `None` if there is none.
    pub(super) fn offset(self, text: &str, place: &[Step]) -> Option<usize> {
        match self {
            Self::Toml => {
                let whole = DeTable::parse(text).ok()?;
                let (Step::Key(first), rest) = place.split_first()? else { return None };
                let start = whole.get_ref().get(*first)?;
                let value = rest.iter().try_fold(start, |value, step| match (step, value.get_ref()) {
                    (Step::Key(key), DeValue::Table(table)) => table.get(*key),
                    (Step::Row(row), DeValue::Array(rows)) => rows.get(*row),
                    _ => None,
                })?;
                Some(value.span().start)
            }
            Self::Json => {
                let whole: &RawValue = serde_json::from_str(text).ok()?;
                let value = place.iter().try_fold(whole, |value, step| match step {
                    Step::Key(key) => {
                        serde_json::from_str::<BTreeMap<String, &RawValue>>(value.get()).ok()?.remove(*key)
                    }
                    Step::Row(row) => {
                        serde_json::from_str::<Vec<&RawValue>>(value.get()).ok()?.get(*row).copied()
                    }
                })?;
                value.get().as_ptr().addr().checked_sub(text.as_ptr().addr())
            }
        }
    }

    /// The text of `file`, each row on a line of its own.
    pub(super) fn text(self, file: &MapFile) -> String {
        let cruises = [("b", &file.cruises.b), ("c", &file.cruises.c)];
        let bursts = &file.bursts;
        let bursts = [
            ("step", &bursts.step),
            ("walk", &bursts.walk),
            ("stride", &bursts.stride),
            ("nudge", &bursts.nudge),
            ("throw", &bursts.throw),
        ];
        match self {
            Self::Toml => {
                let of = match &file.learnt {
                    None => "motors drawn around a design: `host-sim response-map --out FILE.toml`",
                    Some(_) => {
                        "one motor, with what its moves have learnt: `host-sim position --map FILE --learn`"
                    }
                };
                let mut text = format!(
                    "# The response map of {of}.\nstep_walk_correlation = {:?}\n\n[design]\n",
                    file.step_walk_correlation
                );
                for (key, value) in in_order(file) {
                    // Writing to a string cannot fail.
                    let _ = writeln!(text, "{key:?} = {value:?}");
                }
                let tables =
                    [("cruises", cruises.map(|(name, rows)| toml_rows(name, rows, cruise)).concat())];
                let bursts = ("bursts", bursts.map(|(name, rows)| toml_rows(name, rows, burst)).concat());
                for (name, rows) in tables.into_iter().chain([bursts]) {
                    let _ = write!(text, "\n[{name}]\n{rows}");
                }
                if let Some(learnt) = &file.learnt {
                    text.push_str(&toml_learnt(learnt));
                }
                text
            }
            Self::Json => {
                let design: Vec<String> =
                    in_order(file).map(|(key, value)| format!("    {key:?}: {value:?}")).collect();
                format!(
                    "{{\n  \"step_walk_correlation\": {:?},\n  \"design\": {{\n{}\n  }},\n  \"cruises\": {{\n{}\n  \
                     }},\n  \"bursts\": {{\n{}\n  }}{}\n}}\n",
                    file.step_walk_correlation,
                    design.join(",\n"),
                    cruises.map(|(name, rows)| json_rows(name, rows)).join(",\n"),
                    bursts.map(|(name, rows)| json_rows(name, rows)).join(",\n"),
                    file.learnt.as_ref().map(json_learnt).unwrap_or_default()
                )
            }
        }
    }
}

/// The design in the order of Table 1.
fn in_order(file: &MapFile) -> impl Iterator<Item = (&'static str, f64)> + '_ {
    Parameter::ALL.into_iter().filter_map(|parameter| {
        let key = parameter.spec().key;
        Some((key, *file.design.get(key)?))
    })
}

fn cruise(line: &CruiseLine) -> String {
    let CruiseLine { amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad } = line;
    format!(
        "amplitude = {amplitude:?}, rate_rad_s = {rate_rad_s:?}, rate_sd_rad_s = {rate_sd_rad_s:?}, \
         coast_s = {coast_s:?}, coast_sd_rad = {coast_sd_rad:?}"
    )
}

fn burst(line: &BurstLine) -> String {
    let BurstLine { amplitude, ticks, turn_rad, motors_sd_rad, repeat_sd_rad } = line;
    format!(
        "amplitude = {amplitude:?}, ticks = {ticks}, turn_rad = {turn_rad:?}, motors_sd_rad = {motors_sd_rad:?}, \
         repeat_sd_rad = {repeat_sd_rad:?}"
    )
}

/// The offsets of the resonances by their names.
fn resonances(learnt: &LearntTable) -> [(&'static str, ResonanceLine); 2] {
    [("resonance_b", learnt.resonance_b), ("resonance_c", learnt.resonance_c)]
}

/// The factors by their names, without the covariance.
fn factors(learnt: &LearntTable) -> [(&'static str, FactorLine); 7] {
    let LearntTable { step, walk, stride, nudge, throw, rate_b, rate_c, .. } = *learnt;
    [
        ("step", step),
        ("walk", walk),
        ("stride", stride),
        ("nudge", nudge),
        ("throw", throw),
        ("rate_b", rate_b),
        ("rate_c", rate_c),
    ]
}

fn toml_learnt(learnt: &LearntTable) -> String {
    let mut text =
        "\n# What was learnt of the motor: factors on the rows above, and offsets of its resonances.\n[learnt]\n"
            .to_owned();
    for (name, FactorLine { value, variance }) in factors(learnt) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name} = {{ value = {value:?}, variance = {variance:?} }}");
    }
    let _ = writeln!(text, "step_walk_covariance = {:?}", learnt.step_walk_covariance);
    for (name, ResonanceLine { offset_hz, variance_hz2 }) in resonances(learnt) {
        let _ = writeln!(text, "{name} = {{ offset_hz = {offset_hz:?}, variance_hz2 = {variance_hz2:?} }}");
    }
    text
}

/// With the comma after what stands before it.
fn json_learnt(learnt: &LearntTable) -> String {
    let rows = factors(learnt).map(|(name, FactorLine { value, variance })| {
        format!("    \"{name}\": {{\"value\": {value:?}, \"variance\": {variance:?}}},\n")
    });
    let offsets = resonances(learnt).map(|(name, ResonanceLine { offset_hz, variance_hz2 })| {
        format!("    \"{name}\": {{\"offset_hz\": {offset_hz:?}, \"variance_hz2\": {variance_hz2:?}}},\n")
    });
    format!(
        ",\n  \"learnt\": {{\n{}{}    \"step_walk_covariance\": {:?}\n  }}",
        rows.concat(),
        offsets.concat(),
        learnt.step_walk_covariance
    )
}

fn toml_rows<L>(name: &str, rows: &[L], of: fn(&L) -> String) -> String {
    let mut text = format!("{name} = [\n");
    for line in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "    {{ {} }},", of(line));
    }
    text.push_str("]\n");
    text
}

fn json_rows<L: Serialize>(name: &str, rows: &[L]) -> String {
    // A row has a key for each number: it cannot fail.
    let rows: Vec<String> = rows
        .iter()
        .map(|line| format!("      {}", serde_json::to_string(line).unwrap_or_default()))
        .collect();
    let (begin, end) = if rows.is_empty() { ("", "") } else { ("\n", "\n    ") };
    format!("    \"{name}\": [{begin}{}{end}]", rows.join(",\n"))
}
