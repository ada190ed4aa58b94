//! The observer of a run: it gives the records, in batches, to a thread that writes them, so that the run does not wait
//! for the disk. At most [`BATCHES`] batches are under way, so that memory is bounded.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use estimator::LdvSample;
use motor_model::Time;

use super::csv_log::CsvLog;
use super::error::{Kept, LogError};
use super::held_file::HeldFile;
use super::mcap_log::McapLog;
use super::parquet_log::ParquetLog;
use super::{RecordWriter, Stated};
use crate::runs::record::{Impact, Observer, RunRecord};
use crate::scene::Scene;

/// Records of a batch: 10 ms of a run.
const BATCH_RECORDS: usize = 1000;
/// Batches under way.
const BATCHES: usize = 8;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogOptions {
    /// Ticks from one logged truth and estimate to the next.
    pub every: u64,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending<'a> {
    /// As it should, with this result in JSON.
    Whole(&'a str),
    /// By an interruption.
    Interrupted,
}

/// A log that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Logged {
    /// The file.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
}

/// Records with their lists in one place.
#[derive(Debug, Default)]
struct Batch {
    records: Vec<(RunRecord<'static>, usize, usize)>,
    impacts: Vec<Impact>,
    ldv_samples: Vec<LdvSample>,
}

impl Batch {
    fn push(&mut self, record: &RunRecord) {
        self.impacts.extend(record.impacts);
        self.ldv_samples.extend(record.ldv_samples);
        self.records.push((record.without_lists(), record.impacts.len(), record.ldv_samples.len()));
    }

    fn clear(&mut self) {
        self.records.clear();
        self.impacts.clear();
        self.ldv_samples.clear();
    }

    fn write(&self, writer: &mut dyn RecordWriter) -> Result<(), LogError> {
        let (mut impacts, mut samples) = (&self.impacts[..], &self.ldv_samples[..]);
        for (record, impacts_of_it, samples_of_it) in &self.records {
            let (these_impacts, later_impacts) = impacts.split_at(*impacts_of_it);
            let (these_samples, later_samples) = samples.split_at(*samples_of_it);
            writer.write(&record.with_lists(these_impacts, these_samples))?;
            (impacts, samples) = (later_impacts, later_samples);
        }
        Ok(())
    }
}

/// What the thread gives back: the writer, and why it stopped before the run did.
type Written = (Box<dyn RecordWriter>, Option<LogError>);

/// Writes the records of a run to a log.
pub struct LogRecorder {
    batch: Batch,
    full: SyncSender<Batch>,
    empty: Receiver<Batch>,
    thread: JoinHandle<Written>,
    interrupted: Arc<AtomicBool>,
}

impl LogRecorder {
    /// Opens the log of a run of `command` with `scene` at `path`, whose name says which kind it is. The run ends early
    /// once `interrupted` is set.
    ///
    /// # Errors
    /// When the kind is not known or the file cannot be written.
    pub fn create(
        path: &Path,
        options: LogOptions,
        command: &'static str,
        scene: &Scene,
        interrupted: Arc<AtomicBool>,
    ) -> Result<Self, LogError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let file = || HeldFile::create(path);
        let stated = Stated::of(command, scene);
        let mut writer: Box<dyn RecordWriter> = match extension.as_str() {
            "mcap" => Box::new(McapLog::create(file()?, &stated, options)?),
            "parquet" => Box::new(ParquetLog::create(file()?, &stated, options)?),
            "csv" => Box::new(CsvLog::create(file()?, options)?),
            _ => return Err(LogError::UnknownKind { path: path.to_owned() }),
        };
        let (full, to_write) = sync_channel::<Batch>(BATCHES);
        let (written, empty) = sync_channel::<Batch>(BATCHES + 2);
        let thread = thread::spawn(move || {
            for mut batch in to_write {
                if let Err(error) = batch.write(writer.as_mut()) {
                    return (writer, Some(error));
                }
                batch.clear();
                // A run that has ended, or has enough, takes none back.
                written.try_send(batch).ok();
            }
            (writer, None)
        });
        Ok(Self { batch: Batch::default(), full, empty, thread, interrupted })
    }

    /// Ends the log.
    ///
    /// # Errors
    /// When the run was interrupted, there was no room, or the system refused it; the error says what is kept.
    pub fn finish(self, ending: Ending) -> Result<Logged, LogError> {
        let Self { batch, full, thread, empty, .. } = self;
        drop(empty);
        // A thread that has stopped takes nothing; its answer says why.
        full.send(batch).ok();
        drop(full);
        let (mut writer, stopped) =
            thread.join().map_err(|_| LogError::Format("its thread stopped".to_owned()))?;
        let stopped = stopped.or_else(|| writer.last_block().err());
        let (ended, result) = match (&stopped, ending) {
            (Some(_), _) => ("no room", None),
            (None, Ending::Interrupted) => ("interrupted", None),
            (None, Ending::Whole(result)) => ("whole", Some(result)),
        };
        let until_s = writer.until().seconds_since(Time::ZERO);
        let file = writer.close(ended, result)?;
        let bytes = file.len();
        let path = file.publish(result.is_some())?;
        match (stopped, ending) {
            (Some(LogError::Full { source, .. }), _) => {
                Err(LogError::Full { kept: Kept { path, until_s }, source })
            }
            (Some(other), _) => Err(other),
            (None, Ending::Interrupted) => Err(LogError::Interrupted { kept: Kept { path, until_s } }),
            (None, Ending::Whole(_)) => Ok(Logged { path, bytes }),
        }
    }
}

impl Observer for LogRecorder {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.batch.push(record);
        if self.batch.records.len() < BATCH_RECORDS {
            return ControlFlow::Continue(());
        }
        let empty = self.empty.try_recv().unwrap_or_default();
        let batch = std::mem::replace(&mut self.batch, empty);
        if self.full.send(batch).is_err() || self.interrupted.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
