//! The firmware's log of a run, read by defmt's own decoder, with the true motion at the same ticks.
//!
//! | item | what it is |
//! |---|---|
//! | [`LogDictionary`] | the texts of the log, which only the ELF has |
//! | [`LogReader`] | reads the entries of the file that the emulated program logs into |
//! | [`LogBesideTruth`] | each [`LogEntry`] with the truth of its tick, as a table (CSV) and a picture |
//!
//! `firmware/src/telemetry.rs` says what the firmware logs, and how often.

mod log_beside_truth;
mod picture;

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use defmt_decoder::{DecodeError, StreamDecoder, Table};

use crate::board::BoardError;
use crate::report::{OutputError, files};
pub use log_beside_truth::LogBesideTruth;

/// The texts of a program's log.
pub struct LogDictionary {
    table: Table,
}

impl LogDictionary {
    /// Reads them out of the ELF at `path`.
    ///
    /// # Errors
    /// When it cannot be read, or is no ELF of a program that logs.
    pub fn read(path: &Path) -> Result<Self, BoardError> {
        let bytes = files::read(path)?;
        let no_elf = |error: String| BoardError::NoElf { path: path.to_owned(), error };
        let table = Table::parse(&bytes).map_err(|error| no_elf(error.to_string()))?;
        let table = table.filter(|table| !table.is_empty() && table.has_timestamp());
        Ok(Self { table: table.ok_or_else(|| no_elf("it logs nothing".to_owned()))? })
    }
}

/// One entry of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogEntry {
    /// The tick of the loop at which it was logged.
    pub tick: u64,
    /// Its level: `info`, `warn` or `error`.
    pub level: &'static str,
    /// Its text: the kind, then words and fields `name=value`.
    pub text: String,
}

impl LogEntry {
    /// Its first word: `estimate`, `innovation`, `phase`...
    pub fn kind(&self) -> &str {
        self.text.split(' ').next().unwrap_or_default()
    }

    /// The value of a field, if it has it and the value can be read as a `T`. Numbers are exact to the last bit.
    pub fn field<T: std::str::FromStr>(&self, name: &str) -> Option<T> {
        let value = |word: &str| word.strip_prefix(name)?.strip_prefix('=')?.parse().ok();
        self.text.split(' ').find_map(value)
    }
}

/// Reads a log while the firmware writes it.
pub struct LogReader<'d> {
    file: File,
    decoder: Box<dyn StreamDecoder + Send + Sync + 'd>,
}

impl<'d> LogReader<'d> {
    /// Reads the log of the program of `dictionary` at `path`.
    ///
    /// # Errors
    /// When it cannot be opened.
    pub fn open(dictionary: &'d LogDictionary, path: &Path) -> Result<Self, BoardError> {
        let file =
            File::open(path).map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })?;
        Ok(Self { file, decoder: dictionary.table.new_stream_decoder() })
    }

    /// The entries since the last call.
    ///
    /// # Errors
    /// When it cannot be read, or is no log of this program.
    pub fn entries(&mut self) -> Result<Vec<LogEntry>, BoardError> {
        let mut bytes = Vec::new();
        self.file
            .read_to_end(&mut bytes)
            .map_err(|error| BoardError::Board(format!("logs into a file that cannot be read: {error}")))?;
        if bytes.is_empty() {
            return Ok(Vec::new());
        }
        self.decoder.received(&bytes);
        let mut entries = Vec::new();
        loop {
            match self.decoder.decode() {
                Ok(frame) => {
                    let tick = frame.display_timestamp().and_then(|tick| tick.to_string().parse().ok());
                    let tick = tick.ok_or_else(|| BoardError::Board("logs without a tick".to_owned()))?;
                    let level = frame.level().map_or("info", |level| level.as_str());
                    entries.push(LogEntry { tick, level, text: frame.display_message().to_string() });
                }
                Err(DecodeError::UnexpectedEof) => return Ok(entries),
                Err(DecodeError::Malformed) => {
                    return Err(BoardError::Board("logs what its ELF does not explain".to_owned()));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_reports;

    #[test]
    fn exact_fields_of_an_entry() {
        let text = "estimate angle_units=-7 rate_rad_s=1.0e-5 resting=true".to_owned();
        let entry = LogEntry { tick: 1, level: "info", text };
        assert_eq!(entry.kind(), "estimate");
        assert_eq!(entry.field::<i64>("angle_units"), Some(-7));
        assert_eq!(entry.field::<f32>("rate_rad_s").map(f32::to_bits), Some(1e-5_f32.to_bits()));
        assert_eq!(entry.field::<bool>("resting"), Some(true));
        assert_eq!(entry.field::<i64>("angle"), None, "a name is not the beginning of another");
    }

    #[test]
    fn exact_what_is_no_program_that_logs_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("elf");
        let Err(BoardError::Run(error)) = LogDictionary::read(&path) else { panic!("there is no file") };
        assert!(matches!(run_reports::output_error(&error), Some(OutputError::Unreadable { .. })), "{error}");
        std::fs::write(&path, "text").unwrap();
        assert!(matches!(LogDictionary::read(&path), Err(BoardError::NoElf { .. })));
        // An ELF, but of a program that does not log.
        let ourselves = std::env::current_exe().unwrap();
        assert!(matches!(LogDictionary::read(&ourselves), Err(BoardError::NoElf { .. })));
    }
}
