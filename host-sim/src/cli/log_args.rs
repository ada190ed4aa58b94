//! The flags of a run that can be logged, and Ctrl-C while it is.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueHint};

use super::count::Count;
use super::interruption;
use crate::log::{Ending, LogError, LogOptions, LogRecorder};
use crate::report::{OutputError, files};
use simulation::runs::record::{Observer, RunRecord};
use simulation::scene::Scene;

/// Where a run is logged, and how finely.
#[derive(Debug, Default, Args)]
pub(super) struct LogArgs {
    /// Write all that happens to a log: .mcap for Foxglove, `PlotJuggler` and `host-sim replay`, .parquet or .csv for a
    /// table
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    log: Option<PathBuf>,
    /// Log truth and estimate at every N-th tick of 10 us [default: 10]. Measurements, innovations and impacts are all
    /// logged
    #[arg(long, value_name = "N", requires = "log")]
    #[arg(value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    log_every: Option<u64>,
}

/// The log of a run, if there is one.
pub(super) struct Log(Option<LogRecorder>);

impl LogArgs {
    /// Ticks from one logged estimate to the next, unless a flag says otherwise: 0.1 ms.
    const EVERY: u64 = 10;

    /// Refuses a log in the place of one of the files that are read.
    ///
    /// # Errors
    /// When it has the place of one.
    pub(super) fn apart_from<'a>(
        &self,
        inputs: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<(), LogError> {
        let Some(path) = &self.log else { return Ok(()) };
        let is_read = inputs.into_iter().any(|input| files::is_same(path, input));
        if is_read { Err(LogError::OverInput { path: path.clone() }) } else { Ok(()) }
    }

    /// Opens the log of a run of `command`, if one was asked for. From now on Ctrl-C ends the run and not the process;
    /// a second one ends the process.
    pub(super) fn open(&self, command: &'static str, scene: &Scene) -> Result<Log, LogError> {
        let Some(path) = &self.log else { return Ok(Log(None)) };
        let interrupted = Arc::new(AtomicBool::new(false));
        let options = LogOptions { every: self.log_every.unwrap_or(Self::EVERY) };
        let recorder = LogRecorder::create(path, options, command, scene, Arc::clone(&interrupted))?;
        interruption::watch(&interrupted)
            .map_err(|source| OutputError::Unwritable { path: path.clone(), source })?;
        Ok(Log(Some(recorder)))
    }
}

impl Observer for Log {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.0.observe(record)
    }
}

impl Log {
    /// Takes a record, which is made only where there is a log.
    pub(super) fn observe_made<'a>(&mut self, record: impl FnOnce() -> RunRecord<'a>) -> ControlFlow<()> {
        match &mut self.0 {
            Some(recorder) => recorder.observe(&record()),
            None => ControlFlow::Continue(()),
        }
    }

    /// Ends the log of a run that gave `result` in JSON; what was written, as a line of text.
    pub(super) fn finish(self, result: &str) -> Result<String, LogError> {
        let Some(recorder) = self.0 else { return Ok(String::new()) };
        let logged = recorder.finish(Ending::Whole(result))?;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let megabytes = logged.bytes as f64 / 1e6;
        Ok(format!("log                {}, {megabytes:.1} MB\n", logged.path.display()))
    }

    /// Why the log ended the run.
    pub(super) fn stopped(self) -> LogError {
        match self.0.map(|recorder| recorder.finish(Ending::Interrupted)) {
            Some(Err(error)) => error,
            _ => LogError::Format("it ended the run without a reason".to_owned()),
        }
    }
}
