//! The log of a run: its stream of records ([`simulation::runs::record`]) in a file.
//!
//! | module | what it is |
//! |---|---|
//! | `channels` | the channels of an MCAP log: a message type each, with its protobuf description |
//! | `mcap_file` | an MCAP file: chunks, their index, the summary |
//! | `mcap_log` | records into an MCAP file |
//! | `table` | records into rows: one of each vibrometer sample, frame, impact and logged tick |
//! | `parquet_log`, `csv_log` | these rows into a file |
//! | `held_file` | a file that has room for its end before its middle is written |
//! | `options` | what is written |
//! | `recorder` | the observer of a run: it gives the records to a thread that writes them |
//! | `reader` | an MCAP log, message by message |
//! | `replay`, `replay_sums` | a log through a filter, beside what was recorded |
//! | `explain`, `words` | a log in words |
//! | `import` | a user's own tables into a log |
//! | `error` | why a log was not written or not read |
//!
//! # What a log keeps when a run ends early
//!
//! Every writer asks for room before it writes a block, enough for the block and for the end of the file after it. When
//! there is none, the block is left out and the file is ended: it opens, and has everything up to that block. The same
//! holds for an interruption. A file that is there already is replaced by the log of a whole run alone; what an
//! unfinished run leaves is then written beside it, as `NAME.partial.EXTENSION`.

pub mod channels;
mod csv_log;
mod error;
mod explain;
mod held_file;
pub mod import;
mod mcap_file;
mod mcap_log;
mod options;
mod parquet_log;
mod reader;
mod recorder;
mod replay;
mod replay_sums;
mod table;
mod words;

pub use channels::{CHANNELS, Channel};
pub use error::LogError;
pub use explain::{Explanation, LogEvent, explain};
pub use options::LogOptions;
pub use reader::{LogHead, LogMessage, LogPart, LogReader, open, read_head};
pub use recorder::{Ending, LogRecorder, Logged};
pub use replay::replay;
pub use replay_sums::{FilterFigures, Replayed};
pub use table::COLUMNS;

use std::collections::BTreeMap;

use controller::TICK_NANOS;
use estimator::LdvSample;
use motor_model::Time;

use held_file::HeldFile;
use simulation::runs::filter;
use simulation::runs::record::{Impact, RunRecord};
use simulation::scene::Scene;

/// A kind of file that takes records. Each tick gives its impacts and samples, and then its record if anything else is
/// to be said of it.
trait RecordWriter: Send {
    /// Writes the impacts and vibrometer samples of the tick that ends at `at`.
    ///
    /// # Errors
    /// When there is no room for the next block, or the system refuses it.
    fn write_samples(&mut self, at: Time, impacts: &[Impact], samples: &[LdvSample]) -> Result<(), LogError>;

    /// Writes what else happened in that tick; truth and estimate if it is one of the `logged` ticks. Its impacts and
    /// samples are written already.
    ///
    /// # Errors
    /// When the system refuses it.
    fn write_tick(&mut self, record: &RunRecord, logged: bool) -> Result<(), LogError>;

    /// Writes the block that is not full yet.
    ///
    /// # Errors
    /// When there is no room for it, or the system refuses it.
    fn last_block(&mut self) -> Result<(), LogError>;

    /// The last tick whose block is written.
    fn until(&self) -> Time;

    /// Ends the file, for which there is room in any case, and gives it back. `ended` says how the run ended, `result`
    /// is what it gave, as JSON.
    ///
    /// # Errors
    /// When the system refuses it.
    fn close(self: Box<Self>, ended: &str, result: Option<&str>) -> Result<HeldFile, LogError>;
}

/// What a log says of its run.
#[derive(Clone, Debug)]
struct Stated {
    command: &'static str,
    scene: String,
    seed: u64,
    filter: &'static str,
}

impl Stated {
    fn of(command: &'static str, scene: &Scene) -> Self {
        let filter = match command {
            // A recording has measurements and no estimates.
            "import" | "record" => "none",
            // Which is the best depends on the board's clock and on what it was built with: the result says it.
            "run" => scene.choice("estimator.filter"),
            _ => filter::chosen(scene),
        };
        Self { command, scene: scene.text(&|_| true, true), seed: scene.seed(), filter }
    }

    /// As keys and values. The length of a tick and the thinning of truth and estimate are those of the log.
    fn facts(&self, options: LogOptions) -> BTreeMap<String, String> {
        let facts = [
            ("format", mcap_log::FORMAT.to_owned()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("command", self.command.to_owned()),
            ("seed", self.seed.to_string()),
            ("filter", self.filter.to_owned()),
            ("tick_ns", TICK_NANOS.to_string()),
            ("ticks_per_estimate", options.every.to_string()),
        ];
        facts.map(|(key, value)| (key.to_owned(), value)).into()
    }
}

#[cfg(test)]
mod tests;
