//! `keys`: the keys that a scene can set, and which commands read them.

use std::fmt::Write as _;

use clap::Args;
use clap::builder::PossibleValuesParser;
use motor_model::Parameter;
use motor_model::params::{Origin, Tolerance};

use super::readers::{READERS, Reader, readers_of};
use crate::cli::CommandError;
use crate::math::plain_number::plain;
use crate::report::files;
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
    let mut rows = vec![header.map(str::to_owned)];
    for setting in settings {
        let (default, bounds) = match setting.kind {
            Kind::Number { default, min, max } => {
                (plain(default), format!("{} to {}", plain(min), plain(max)))
            }
            Kind::Integer { default, min, max } => (default.to_string(), format!("{min} to {max}")),
            Kind::Choice { default, of } => (default.to_owned(), of.join("|")),
        };
        let known = Parameter::from_key(setting.key).map(Parameter::spec);
        let tolerance = known.map_or("", |_| "exact").to_owned();
        let tolerance = match known.map(|spec| spec.tolerance) {
            Some(Tolerance::Normal(within)) => format!("+-{}", plain(within)),
            Some(Tolerance::Uniform(low, high)) => format!("{} to {}", plain(low), plain(high)),
            _ => tolerance,
        };
        let origin = match known.map(|spec| spec.origin) {
            Some(Origin::Measured) => "measured",
            Some(Origin::FiniteElement) => "finite elements",
            Some(Origin::Calculated) => "calculated",
            Some(Origin::Literature) => "literature",
            Some(Origin::Tuned) => "tuned",
            Some(Origin::Assumed) => "assumed",
            None => "",
        };
        let [key, unit, meaning] = [setting.key, setting.unit, setting.meaning].map(str::to_owned);
        rows.push([key, default, unit, bounds, tolerance, origin.to_owned(), read_by(setting.key), meaning]);
    }
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 8] = std::array::from_fn(width);
    let mut text = String::new();
    for row in &rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(widths) {
            // Writing to a string cannot fail.
            let _ = write!(line, "{cell:width$}  ");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
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
        assert_eq!(table.lines().count(), registry().count() + 1);
        let line = table.lines().find(|line| line.starts_with("motor.stator_mass_kg ")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[1..8], ["1.07e-5", "kg", "1e-9", "to", "1", "+-1e-6", "calculated"]);
    }
}
