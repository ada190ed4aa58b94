//! The observer of a run: it gives what is to be written, in batches, to a thread that writes it, so that the run does
//! not wait for the disk. At most [`BATCHES`] batches are under way, so that memory is bounded.
//!
//! Most ticks have vibrometer samples and nothing else to say. Of these no record is kept.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use estimator::{Health, LdvSample};
use motor_model::{DriveCommand, Time};

use super::csv_log::CsvLog;
use super::error::{Kept, LogError};
use super::held_file::HeldFile;
use super::mcap_log::McapLog;
use super::options::LogOptions;
use super::parquet_log::ParquetLog;
use super::{RecordWriter, Stated};
use simulation::runs::record::{Impact, Observer, RunRecord};
use simulation::scene::Scene;

/// Ticks of a batch: 40 ms of a run. Fewer would wake the thread more often.
const BATCH_TICKS: usize = 4000;
/// Batches under way.
const BATCHES: usize = 4;

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

/// A tick of a batch.
#[derive(Clone, Copy, Debug)]
struct BatchTick {
    at: Time,
    impacts: usize,
    ldv_samples: usize,
    /// Whether there is a record of it, and then whether truth and estimate are logged.
    record: Option<bool>,
}

/// Ticks with their lists in one place.
#[derive(Debug, Default)]
struct Batch {
    ticks: Vec<BatchTick>,
    records: Vec<RunRecord<'static>>,
    impacts: Vec<Impact>,
    ldv_samples: Vec<LdvSample>,
}

impl Batch {
    /// Adds a tick, with its record where it is told whether that is logged.
    #[inline]
    fn push(&mut self, tick: &RunRecord, record: Option<bool>) {
        self.impacts.extend_from_slice(tick.impacts);
        self.ldv_samples.extend_from_slice(tick.ldv_samples);
        let (impacts, ldv_samples) = (tick.impacts.len(), tick.ldv_samples.len());
        self.ticks.push(BatchTick { at: tick.at, impacts, ldv_samples, record });
        if record.is_some() {
            self.records.push(tick.without_lists());
        }
    }

    fn clear(&mut self) {
        self.ticks.clear();
        self.records.clear();
        self.impacts.clear();
        self.ldv_samples.clear();
    }

    fn write(&self, writer: &mut dyn RecordWriter) -> Result<(), LogError> {
        let (mut impacts, mut samples) = (&self.impacts[..], &self.ldv_samples[..]);
        let mut records = self.records.iter();
        for tick in &self.ticks {
            let (these_impacts, later_impacts) = impacts.split_at(tick.impacts);
            let (these_samples, later_samples) = samples.split_at(tick.ldv_samples);
            writer.write_samples(tick.at, these_impacts, these_samples)?;
            if let Some((record, logged)) = tick.record.and_then(|logged| Some((records.next()?, logged))) {
                writer.write_tick(record, logged)?;
            }
            (impacts, samples) = (later_impacts, later_samples);
        }
        Ok(())
    }
}

/// Says which ticks have more to say than their samples.
#[derive(Clone, Debug)]
struct TickChoice {
    every: u64,
    ticks: u64,
    last: Option<(Health, DriveCommand, DriveCommand)>,
    phase: Cow<'static, str>,
}

impl TickChoice {
    fn new(every: u64) -> Self {
        Self { every, ticks: 0, last: None, phase: Cow::Borrowed("") }
    }

    /// Whether to keep the record of the next tick, and then whether truth and estimate are logged.
    #[inline]
    fn next(&mut self, tick: &RunRecord) -> Option<bool> {
        let logged = self.ticks.is_multiple_of(self.every);
        self.ticks += 1;
        let state = (tick.health, tick.asked, tick.applied);
        let phase = tick.task.word();
        let changed = self.last != Some(state) || self.phase != phase;
        if changed {
            (self.last, self.phase) = (Some(state), phase);
        }
        (logged || changed || tick.camera_frame.is_some()).then_some(logged)
    }
}

/// What the thread gives back: the writer, and why it stopped before the run did.
type Written = (Box<dyn RecordWriter>, Option<LogError>);

/// The thread that writes. What it writes to has no name yet, and goes with it where nobody asks for its answer.
struct WriterThread {
    full: Option<SyncSender<Batch>>,
    handle: Option<JoinHandle<Written>>,
}

impl WriterThread {
    /// Gives it a batch; whether it takes it. A thread that has stopped takes nothing, and its answer says why.
    fn take(&self, batch: Batch) -> bool {
        self.full.as_ref().is_some_and(|full| full.send(batch).is_ok())
    }

    /// Its answer, once all is written; `None` if it has none.
    fn ended(&mut self) -> Option<Written> {
        self.full = None;
        self.handle.take().and_then(|handle| handle.join().ok())
    }
}

impl Drop for WriterThread {
    /// A process that ends before its threads would leave the file of a run that is refused.
    fn drop(&mut self) {
        self.ended();
    }
}

/// Writes the records of a run to a log. Dropped before it is finished it leaves no file.
pub struct LogRecorder {
    choice: TickChoice,
    batch: Batch,
    thread: WriterThread,
    empty: Receiver<Batch>,
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
            "csv" => Box::new(CsvLog::create(file()?)?),
            _ => return Err(LogError::UnknownKind { path: path.to_owned() }),
        };
        let (full, to_write) = sync_channel::<Batch>(BATCHES);
        let (written, empty) = sync_channel::<Batch>(BATCHES + 2);
        let handle = thread::spawn(move || {
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
        let choice = TickChoice::new(options.every);
        let thread = WriterThread { full: Some(full), handle: Some(handle) };
        Ok(Self { choice, batch: Batch::default(), thread, empty, interrupted })
    }

    /// Ends the log.
    ///
    /// # Errors
    /// When the run was interrupted, there was no room, or the system refused it; the error says what is kept.
    pub fn finish(self, ending: Ending) -> Result<Logged, LogError> {
        let Self { batch, mut thread, empty, .. } = self;
        drop(empty);
        thread.take(batch);
        let (mut writer, stopped) =
            thread.ended().ok_or_else(|| LogError::Format("its thread stopped".to_owned()))?;
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
    // Inlined, so that parts of a record that is not kept are not made.
    #[inline]
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        let kept = self.choice.next(record);
        self.batch.push(record, kept);
        if self.batch.ticks.len() < BATCH_TICKS {
            return ControlFlow::Continue(());
        }
        let empty = self.empty.try_recv().unwrap_or_default();
        let batch = std::mem::replace(&mut self.batch, empty);
        if !self.thread.take(batch) || self.interrupted.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
