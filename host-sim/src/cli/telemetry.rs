//! `pil --telemetry`: the run with the log of its program beside the truth.

use std::path::Path;

use crate::board::pil::{self, LockStepBoard};
use crate::board::qemu::{Board, Transport, Wiring};
use crate::board::telemetry::{LogBesideTruth, LogDictionary, LogReader};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::OutputFolder;
use simulation::scene::Scene;

/// The run of `scene` by the program `elf`, its log beside the truth in `folder`, and what is to be said of that.
pub(super) fn run(
    scene: &Scene,
    elf: &Path,
    board: Board,
    link: Transport,
    folder: &Path,
) -> Result<(pil::ComparedMove, String), CommandError> {
    let dictionary = LogDictionary::read(elf)?;
    let output = OutputFolder::create(folder)?;
    let mut record = LogBesideTruth::create(&folder.join("telemetry.csv"))?;
    let unwritable = |source| OutputError::Unwritable { path: std::env::temp_dir(), source };
    let log = tempfile::NamedTempFile::new().map_err(unwritable)?;
    let mut reader = LogReader::open(&dictionary, log.path())?;
    let mut processor = LockStepBoard::start(elf, board, Wiring { transport: link, log: Some(log.path()) })?;
    let run = pil::run_with(scene, &mut processor, |moment| record.take(&reader.entries()?, moment))?;
    processor.finish()?;
    let said = format!("{record}written            {}\n", folder.join("telemetry.{csv,svg}").display());
    output.publish(&[("telemetry.svg".to_owned(), record.svg()?)])?;
    record.publish()?;
    Ok((run, said))
}
