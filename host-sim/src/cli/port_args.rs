//! The flags of every command that talks to a real board.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueHint};

use super::count::Count;
use super::{interruption, progress};
use crate::board::serial::{self, IdentityFigures};
use crate::cli::CommandError;
use crate::report::OutputError;
use simulation::scene::Scene;

/// The port of a board.
#[derive(Debug, Args)]
pub(super) struct PortArgs {
    /// Serial port of the board, for example /dev/ttyACM0
    #[arg(long, value_name = "PORT", value_hint = ValueHint::FilePath)]
    pub port: String,
    /// Rate of the line
    #[arg(long, value_name = "N", default_value = "2000000", allow_negative_numbers = true)]
    #[arg(value_parser = Count(1200..=12_000_000))]
    baud: u64,
}

impl PortArgs {
    /// The port `port` at `baud`.
    pub fn new(port: &str, baud: u64) -> Self {
        Self { port: port.to_owned(), baud }
    }

    /// The rate of the line.
    #[expect(clippy::cast_possible_truncation, reason = "at most 12,000,000")]
    pub fn baud(&self) -> u32 {
        self.baud as u32
    }

    /// Lets the board keep the bench of `scene`, with its map, and with an error of the clock of which its filter is
    /// told, in us.
    ///
    /// # Errors
    /// When there is no board, it has no place for a description, or refuses this one.
    pub fn keep(&self, scene: &Scene, clock_error_us: u16) -> Result<(), CommandError> {
        serial::keep(&self.port, self.baud(), scene, clock_error_us)?;
        progress::note("note: the board keeps the map over a loss of power");
        Ok(())
    }

    /// What Ctrl-C sets from now on.
    ///
    /// # Errors
    /// When the system refuses it.
    pub fn watch(&self) -> Result<Arc<AtomicBool>, OutputError> {
        let interrupted = Arc::new(AtomicBool::new(false));
        let unwatched = |source| OutputError::Unwritable { path: PathBuf::from(&self.port), source };
        interruption::watch(&interrupted).map_err(unwatched)?;
        Ok(interrupted)
    }
}

/// Says what is to be known of a board before it is told anything.
pub(super) fn identified(identity: &IdentityFigures) {
    identity.warnings().for_each(|warning| progress::note(&format!("note: {warning}")));
}
