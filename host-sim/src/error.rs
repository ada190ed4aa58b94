//! Everything that can go wrong in the command, each as one line that names the culprit and the way out.

use std::io;
use std::path::PathBuf;

use motor_model::OutOfBounds;

use crate::board::instructions::ListingError;
use crate::board::pil::Difference;
use crate::studies::step_accuracy::reference::patience::Stalled;

/// Why a command stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// No setting has this key.
    #[error("unknown key {key}")]
    UnknownKey {
        /// The key as given.
        key: String,
        /// The key that looks most like it.
        nearest: Option<&'static str>,
    },
    /// A value outside the bounds of its key.
    #[error("{key} = {value} is outside its bounds {bounds}{}{unit}", if unit.is_empty() { "" } else { " " })]
    OutOfBounds {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// Smallest and largest value allowed.
        bounds: String,
        /// Unit of value and bounds; empty for a pure number.
        unit: &'static str,
    },
    /// A value that should be a number and is not.
    #[error("{key} = {value} is not a {wanted}, bounds {bounds}{}{unit}", if unit.is_empty() { "" } else { " " })]
    NotANumber {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// "number" or "whole number".
        wanted: &'static str,
        /// Smallest and largest value allowed.
        bounds: String,
        /// Unit of the bounds; empty for a pure number.
        unit: &'static str,
    },
    /// A value that is none of the words its key accepts.
    #[error("{key} = {value} is none of {}", of.join(", "))]
    NotAChoice {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// The words accepted.
        of: &'static [&'static str],
    },
    /// `--set` without a key and a value.
    #[error("--set {text} is not of the form key=value")]
    NotAnAssignment {
        /// The argument as given.
        text: String,
    },
    /// Two settings that do not go together.
    #[error("{conflict}")]
    Conflict {
        /// Both settings, their values and why they clash.
        conflict: String,
        /// Values that would work.
        hint: String,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A scene file that is not TOML, or holds something that is no setting.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong there.
        message: String,
    },
    /// A setting refused, and where in the scene file it stands.
    #[error("{}:{line}:{column}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Why it was refused.
        source: Box<CommandError>,
    },
    /// A result that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Standard output refused the result.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(#[source] io::Error),
    /// A picture that could not be laid out.
    #[error("cannot draw the picture: {0}")]
    Drawing(String),
    /// A table that could not be written.
    #[error("cannot write the table: {0}")]
    Table(String),
    /// A file in which a section is to be replaced, without the section's markers.
    #[error("{} has not the lines {} and {}, each once and in this order", path.display(), markers[0], markers[1])]
    NoMarkers {
        /// The file.
        path: PathBuf,
        /// The first and the last line of the section.
        markers: [&'static str; 2],
    },
    /// The reference integrator gave up.
    #[error(transparent)]
    Stalled(#[from] Stalled),
    /// A run whose numbers grew beyond all bounds.
    #[error("the run diverged: {quantity} is no longer finite after {time_s} s")]
    Diverged {
        /// What is not finite.
        quantity: &'static str,
        /// Simulated time.
        time_s: f64,
    },
    /// A program that this command needs and that cannot be started.
    #[error("cannot run {tool}: {source}")]
    NoTool {
        /// The program.
        tool: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// A program that ended in failure.
    #[error("{tool} failed, {complaint}")]
    ToolFailed {
        /// The program.
        tool: &'static str,
        /// Its status, and the last thing that it said.
        complaint: String,
    },
    /// A program that did not end, and was killed.
    #[error("{tool} did not end within {limit_s} s")]
    ToolTooSlow {
        /// The program.
        tool: &'static str,
        /// Time that it had.
        limit_s: f64,
    },
    /// The microcontroller computes something else than the host.
    #[error(transparent)]
    Difference(#[from] Difference),
    /// The microcontroller refused something, or answered something else than was asked.
    #[error("the microcontroller {0}")]
    Board(String),
    /// A file that is no program of the microcontroller.
    #[error("{} is no ELF of the microcontroller: {error}", path.display())]
    NoElf {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: String,
    },
    /// A program without the loop.
    #[error("the program has no function {task}")]
    NoTask {
        /// What should be there.
        task: &'static str,
    },
    /// The firmware takes more than it may, or calls what it must not.
    #[error("{}", .0.join("; "))]
    Oversize(Vec<String>),
    /// Instruction counts that are none.
    #[error("the emulated program printed no instruction counts: {0}")]
    Listing(#[from] ListingError),
}

impl CommandError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownKey { nearest: Some(nearest), .. } => Some(format!("did you mean {nearest}?")),
            Self::UnknownKey { nearest: None, .. } => Some("`host-sim keys` lists every key".to_owned()),
            Self::NotAnAssignment { .. } => Some("for example --set motor.stator_mass_kg=9.7e-6".to_owned()),
            Self::Conflict { hint, .. } => Some(hint.clone()),
            Self::NoMarkers { .. } => Some("add both where the section shall stand".to_owned()),
            Self::InFile { source, .. } => source.hint(),
            Self::Diverged { .. } => {
                Some("a smaller simulate.step_s, or parameters nearer to nominal".to_owned())
            }
            Self::NoTool { tool: "firmware/build.sh", .. } => {
                Some("--elf FILE names a program that is built already".to_owned())
            }
            Self::NoTool { .. } => Some("tests/run.sh installs it".to_owned()),
            Self::Listing(_) => {
                Some("`firmware/build.sh instructions` builds the program that prints them".to_owned())
            }
            _ => None,
        }
    }

    /// Whether the reader of standard output went away, which is no error of ours.
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::StandardOutput(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        let text = match self.hint() {
            Some(hint) => format!("error: {self}; hint: {hint}"),
            None => format!("error: {self}"),
        };
        // Values come from the user and may hold line breaks or terminal codes.
        text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
    }
}

impl From<OutOfBounds> for CommandError {
    fn from(OutOfBounds { key, value, min, max, unit }: OutOfBounds) -> Self {
        let bounds = format!("{} to {}", plain(min), plain(max));
        Self::OutOfBounds { key: key.to_owned(), value: plain(value), bounds, unit }
    }
}

/// A number as a person would write it: with an exponent where zeros would have to be counted.
pub fn plain(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) { format!("{x:e}") } else { format!("{x}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_one_line_even_for_values_with_line_breaks() {
        let error =
            CommandError::UnknownKey { key: "a\nb\u{1b}[31m".to_owned(), nearest: Some("motor.friction") };
        assert_eq!(error.one_line(), "error: unknown key a b [31m; hint: did you mean motor.friction?");
    }

    #[test]
    fn exact_out_of_bounds_names_key_value_bounds_and_unit() {
        let refused = OutOfBounds { key: "step_s", value: f64::NAN, min: 1e-9, max: 1e-3, unit: "s" };
        let error = CommandError::from(refused);
        assert_eq!(error.to_string(), "step_s = NaN is outside its bounds 1e-9 to 0.001 s");
    }
}
