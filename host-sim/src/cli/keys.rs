//! `keys`: the keys that a scene can set, and which commands read them.

use clap::Args;
use clap::builder::PossibleValuesParser;
use motor_model::Parameter;
use motor_model::params::{Origin, Tolerance};

use super::readers::{READERS, Reader, readers_of};
use crate::cli::CommandError;
use crate::math::plain_number::plain;
use crate::report::files;
use crate::report::table::Table;
use crate::scene::{Kind, Setting, registry};

#[derive(Debug, Args)]
pub(super) struct KeysArgs {
    /// List only the keys that this command reads
    #[arg(value_name = "COMMAND", value_parser = PossibleValuesParser::new(READERS.map(|reader| reader.command)))]
    command: Option<String>,
}

impl KeysArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let text = match &self.command {
            Some(command) => {
                let reader = Reader::named(command);
                table(registry().filter(|setting| reader.reads(setting.key)))
            }
            None => table(registry()),
        };
        Ok(files::print(&text)?)
    }
}

/// The settings as a table in columns.
fn table(settings: impl Iterator<Item = Setting>) -> String {
    let header = ["key", "default", "unit", "bounds", "tolerance", "origin", "read by", "meaning"];
    let mut table = Table::new(&header);
    for setting in settings {
        let (default, bounds) = default_and_bounds(setting.kind);
        let parameter = Parameter::from_key(setting.key).map(Parameter::spec);
        let tolerance = parameter.map_or_else(String::new, |spec| tolerance(spec.tolerance));
        let origin = parameter.map_or("", |spec| origin(spec.origin)).to_owned();
        let [key, unit, meaning] = [setting.key, setting.unit, setting.meaning].map(str::to_owned);
        table.push(vec![key, default, unit, bounds, tolerance, origin, read_by(setting.key), meaning]);
    }
    table.text()
}

/// The value when nothing sets it, and the values that it takes.
fn default_and_bounds(kind: Kind) -> (String, String) {
    match kind {
        Kind::Number { default, min, max } => (plain(default), format!("{} to {}", plain(min), plain(max))),
        Kind::Integer { default, min, max } => (default.to_string(), format!("{min} to {max}")),
        Kind::Choice { default, of } => (default.to_owned(), of.join("|")),
        Kind::As { key } => (format!("as {key}"), default_and_bounds(kind.resolved()).1),
    }
}

/// How far a motor's parameter may be off its nominal value.
fn tolerance(tolerance: Tolerance) -> String {
    match tolerance {
        Tolerance::Normal(within) => format!("+-{}", plain(within)),
        Tolerance::Uniform(low, high) => format!("{} to {}", plain(low), plain(high)),
        Tolerance::Exact => "exact".to_owned(),
    }
}

/// Where the nominal value of a motor's parameter comes from.
fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::Measured => "measured",
        Origin::FiniteElement => "finite elements",
        Origin::Calculated => "calculated",
        Origin::Literature => "literature",
        Origin::Tuned => "tuned",
        Origin::Assumed => "assumed",
    }
}

/// The commands that read `key`; or the few that do not, where most do.
fn read_by(key: &str) -> String {
    let readers: Vec<&str> = readers_of(key).collect();
    let others: Vec<&str> =
        READERS.iter().map(|reader| reader.command).filter(|command| !readers.contains(command)).collect();
    if others.is_empty() {
        "all".to_owned()
    } else if others.len() < readers.len() {
        format!("all but {}", others.join(", "))
    } else {
        readers.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_every_key_has_a_line_with_its_default() {
        let table = table(registry());
        assert_eq!(
            table.lines().count(),
            registry().count() + 2,
            "a header, a rule, and a line for each key"
        );
        let line = table.lines().find(|line| line.starts_with("motor.stator_mass_kg ")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[1..8], ["1.07e-5", "kg", "1e-9", "to", "1", "+-1e-6", "calculated"]);
        let line = table.lines().find(|line| line.starts_with("estimator.assumed.camera.noise_m ")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[1..7], ["as", "camera.noise_m", "m", "0", "to", "0.001"]);
    }
}
