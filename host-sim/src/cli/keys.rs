//! `keys`: the keys that a scene can set, and which commands read them.

use clap::Args;
use clap::builder::PossibleValuesParser;
use serde::Serialize;

use super::Format;
use super::readers::{READERS, Reader, readers_of};
use crate::cli::CommandError;
use crate::report::files;
use crate::report::table::Table;
use simulation::scene::faults::{FaultWord, WORDS};
use simulation::scene::{Setting, registry};

#[derive(Debug, Args)]
pub(super) struct KeysArgs {
    /// List only the keys that this command reads
    #[arg(value_name = "COMMAND", value_parser = PossibleValuesParser::new(READERS.map(|reader| reader.command)))]
    command: Option<String>,
    /// List the words of faults instead, which `--fault` and the key faults take
    #[arg(long, conflicts_with = "command")]
    faults: bool,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A key in JSON.
#[derive(Serialize)]
struct ListedKey {
    key: &'static str,
    default: String,
    unit: &'static str,
    bounds: String,
    tolerance: String,
    origin: &'static str,
    read_by: Vec<&'static str>,
    meaning: &'static str,
}

impl From<Setting> for ListedKey {
    fn from(setting: Setting) -> Self {
        Self {
            key: setting.key,
            default: setting.kind.default_text(),
            unit: setting.unit,
            bounds: setting.kind.bounds_text(),
            tolerance: setting.tolerance_text(),
            origin: setting.origin_text(),
            read_by: readers_of(setting.key).collect(),
            meaning: setting.meaning,
        }
    }
}

impl KeysArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        if self.faults {
            let words = match self.format {
                Format::Text => table_of_faults(),
                Format::Json => files::json_lines(&WORDS.map(ListedFault::from)),
            };
            return Ok(files::print(&words)?);
        }
        let reader = self.command.as_deref().map(Reader::named);
        let read = registry().filter(|setting| reader.is_none_or(|reader| reader.reads(setting.key)));
        let text = match self.format {
            Format::Text => table(read),
            Format::Json => files::json_lines(&read.map(ListedKey::from).collect::<Vec<_>>()),
        };
        Ok(files::print(&text)?)
    }
}

/// A word of a fault in JSON.
#[derive(Serialize)]
struct ListedFault {
    word: String,
    also: &'static str,
    meaning: &'static str,
}

impl From<FaultWord> for ListedFault {
    fn from(word: FaultWord) -> Self {
        Self { word: word.pattern(), also: word.alias, meaning: word.meaning }
    }
}

/// The words of faults as a table.
fn table_of_faults() -> String {
    let mut table = Table::new(&["fault", "also", "what happens"]);
    for word in WORDS {
        table.push(vec![word.pattern(), word.alias.to_owned(), word.meaning.to_owned()]);
    }
    let times = "When: @FROM, @FROM.., @..UNTIL or @FROM..UNTIL in s of the run; without it the whole run.";
    format!(
        "{}\n{times}\nExample: --fault camera:lost@1.0..2.0 --fault drive:weak:0.7@0.05..\n",
        table.text()
    )
}

/// The settings as a table in columns.
fn table(settings: impl Iterator<Item = Setting>) -> String {
    let header = ["key", "default", "unit", "bounds", "tolerance", "origin", "read by", "meaning"];
    let mut table = Table::new(&header);
    for setting in settings {
        let [key, unit, origin, meaning] =
            [setting.key, setting.unit, setting.origin_text(), setting.meaning].map(str::to_owned);
        let (default, bounds) = (setting.kind.default_text(), setting.kind.bounds_text());
        let tolerance = setting.tolerance_text();
        table.push(vec![key, default, unit, bounds, tolerance, origin, read_by(setting.key), meaning]);
    }
    table.text()
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
