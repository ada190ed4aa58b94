//! The firmware in QEMU, at the other end of two pipes.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use controller::PositionLoop;
use link::{
    BoardMessage, Configuration, Counters, Deframer, FRAME_BYTES_MAX, Header, HostMessage, LdvRecords,
    Report, decode, encode,
};

use super::Processor;
use crate::closed_loop::Taken;
use crate::error::CommandError;
use crate::instructions::Board;
use crate::instructions::emulator::{QEMU, readable, text};

/// An answer takes microseconds; a start of the emulator a fraction of a second.
const SILENCE_MAX: Duration = Duration::from_secs(20);

/// Any number but 0, which the board bears without a host.
const SESSION: u32 = 1;

/// A board at work.
#[derive(Debug)]
pub struct Emulated {
    to_board: Option<ChildStdin>,
    from_board: ChildStdout,
    deframer: Deframer,
    /// Bytes received, and how many of them are used up.
    block: Vec<u8>,
    used: usize,
    sequence: u32,
    ticks: u64,
    guard: Guard,
    _one_processor: Option<OneProcessor>,
}

impl Emulated {
    /// Starts `elf`, which speaks frames by semihosting, on `board`.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator not be started.
    pub fn start(elf: &Path, board: Board) -> Result<Self, CommandError> {
        readable(elf)?;
        let lost = |source| CommandError::NoTool { tool: QEMU, source };
        let complaints = tempfile::tempfile().map_err(lost)?;
        let to_complaints = complaints.try_clone().map_err(lost)?;
        let one_processor = OneProcessor::hold();
        let mut command = Command::new(QEMU);
        command
            .args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(elf);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(to_complaints)
            .spawn()
            .map_err(lost)?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (to_board, from_board) = pipes.ok_or_else(|| CommandError::Board("has no pipes".to_owned()))?;
        Ok(Self {
            to_board: Some(to_board),
            from_board,
            deframer: Deframer::default(),
            block: Vec::new(),
            used: 0,
            sequence: 0,
            ticks: 0,
            guard: Guard::new(child, complaints),
            _one_processor: one_processor,
        })
    }

    /// How the board fares.
    ///
    /// # Errors
    /// When it does not say.
    pub fn counters(&mut self) -> Result<Counters, CommandError> {
        let mut bytes = Vec::new();
        self.put(&mut bytes, &HostMessage::Count)?;
        self.send(&bytes)?;
        match self.receive()? {
            BoardMessage::Counters(counters) => Ok(counters),
            said => Err(unexpected(&said)),
        }
    }

    /// Ends the program.
    ///
    /// # Errors
    /// When it ends in failure.
    pub fn finish(mut self) -> Result<(), CommandError> {
        self.to_board = None;
        self.guard.wait()
    }

    /// Puts a message at the end of `bytes`.
    fn put(&mut self, bytes: &mut Vec<u8>, message: &HostMessage) -> Result<(), CommandError> {
        let header = Header { session: SESSION, sequence: self.sequence, ticks: self.ticks };
        self.sequence = self.sequence.wrapping_add(1);
        let mut frame = [0; FRAME_BYTES_MAX];
        let length =
            encode(header, message, &mut frame).map_err(|error| CommandError::Board(error.to_string()))?;
        bytes.extend_from_slice(&frame[..length]);
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), CommandError> {
        let written = self.to_board.as_mut().map(|pipe| pipe.write_all(bytes).and_then(|()| pipe.flush()));
        match written {
            Some(Ok(())) => Ok(()),
            _ => Err(self.guard.lost()),
        }
    }

    fn receive(&mut self) -> Result<BoardMessage, CommandError> {
        loop {
            while let Some(&byte) = self.block.get(self.used) {
                self.used += 1;
                let Some(frame) = self.deframer.push(byte) else { continue };
                let (header, message) = decode::<BoardMessage>(frame)
                    .map_err(|error| CommandError::Board(format!("sends a frame that is none: {error}")))?;
                self.guard.alive();
                if header.session != SESSION && !matches!(message, BoardMessage::Fault(_)) {
                    return Err(CommandError::Board("has started anew".to_owned()));
                }
                if header.ticks != self.ticks {
                    let (theirs, ours) = (header.ticks, self.ticks);
                    return Err(CommandError::Board(format!("is at tick {theirs}, the plant at {ours}")));
                }
                return Ok(message);
            }
            self.block.resize(4 * FRAME_BYTES_MAX, 0);
            match self.from_board.read(&mut self.block) {
                Ok(length @ 1..) => {
                    self.block.truncate(length);
                    self.used = 0;
                }
                Ok(0) | Err(_) => return Err(self.guard.lost()),
            }
        }
    }

    /// Says `message` and wants `answer`.
    fn ask(&mut self, message: &HostMessage, answer: &BoardMessage) -> Result<(), CommandError> {
        let mut bytes = Vec::new();
        self.put(&mut bytes, message)?;
        self.send(&bytes)?;
        match self.receive()? {
            said if said == *answer => Ok(()),
            said => Err(unexpected(&said)),
        }
    }
}

fn unexpected(said: &BoardMessage) -> CommandError {
    CommandError::Board(match said {
        BoardMessage::Fault(fault) => format!("reports a fault: {fault}"),
        other => format!("answers something else than was asked: {other:?}"),
    })
}

impl Processor for Emulated {
    fn arm(&mut self, configuration: Configuration) -> Result<(), CommandError> {
        let tick_nanos = PositionLoop::TICK_NANOS;
        self.ask(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos })?;
        self.ask(&HostMessage::Configure(configuration), &BoardMessage::Configured)?;
        self.ask(&HostMessage::Arm, &BoardMessage::Armed)
    }

    fn tick(&mut self, taken: &Taken) -> Result<Report, CommandError> {
        let mut bytes = Vec::with_capacity(2 * FRAME_BYTES_MAX);
        if !taken.ldv_samples.is_empty() {
            let samples: LdvRecords = taken.ldv_samples.iter().map(|&sample| sample.into()).collect();
            self.put(&mut bytes, &HostMessage::Ldv(samples))?;
        }
        if let Some(frame) = taken.camera_frame {
            self.put(&mut bytes, &HostMessage::Camera(frame.into()))?;
        }
        self.put(&mut bytes, &HostMessage::Step)?;
        self.send(&bytes)?;
        self.ticks += 1;
        match self.receive()? {
            BoardMessage::Report(report) => Ok(report),
            said => Err(unexpected(&said)),
        }
    }
}

/// Host and emulator on one processor, for as long as this lives: they take turns, and waking another processor takes longer than a turn.
#[derive(Debug)]
struct OneProcessor {
    #[cfg(target_os = "linux")]
    before: rustix::thread::CpuSet,
}

impl OneProcessor {
    /// Holds this thread, and the processes that it starts, to the processor that it is on; `None` where that cannot be.
    #[cfg(target_os = "linux")]
    fn hold() -> Option<Self> {
        let before = rustix::thread::sched_getaffinity(None).ok()?;
        let mut one = rustix::thread::CpuSet::new();
        one.set(rustix::thread::sched_getcpu());
        rustix::thread::sched_setaffinity(None, &one).ok()?;
        Some(Self { before })
    }

    #[cfg(not(target_os = "linux"))]
    fn hold() -> Option<Self> {
        None
    }
}

#[cfg(target_os = "linux")]
impl Drop for OneProcessor {
    fn drop(&mut self) {
        let _ = rustix::thread::sched_setaffinity(None, &self.before);
    }
}

/// Ends the emulator when it is no longer wanted, or has been silent for [`SILENCE_MAX`]: whoever waits for it then reads the end of the pipe.
#[derive(Debug)]
struct Guard {
    child: Arc<Mutex<Child>>,
    complaints: File,
    heard: Arc<AtomicU64>,
    done: Option<Sender<()>>,
    watch: Option<JoinHandle<()>>,
}

impl Guard {
    fn new(child: Child, complaints: File) -> Self {
        let child = Arc::new(Mutex::new(child));
        let heard = Arc::new(AtomicU64::new(0));
        let (done, ended) = mpsc::channel();
        let watch = std::thread::spawn({
            let (child, heard) = (Arc::clone(&child), Arc::clone(&heard));
            move || {
                let mut before = None;
                while ended.recv_timeout(SILENCE_MAX) == Err(RecvTimeoutError::Timeout) {
                    let now = heard.load(Ordering::Relaxed);
                    if before.replace(now) == Some(now) {
                        let _ = child.lock().map(|mut child| child.kill());
                    }
                }
            }
        });
        Self { child, complaints, heard, done: Some(done), watch: Some(watch) }
    }

    fn alive(&self) {
        self.heard.fetch_add(1, Ordering::Relaxed);
    }

    /// Waits for the program's own end.
    fn wait(&self) -> Result<(), CommandError> {
        let lost = |source| CommandError::NoTool { tool: QEMU, source };
        // Polled, so that the watch can still end it.
        loop {
            let status = self.child.lock().ok().map(|mut child| child.try_wait());
            match status {
                Some(Ok(None)) => std::thread::sleep(Duration::from_millis(1)),
                Some(Ok(Some(status))) if status.success() => return Ok(()),
                Some(Err(source)) => return Err(lost(source)),
                Some(Ok(Some(_))) | None => return Err(self.lost()),
            }
        }
    }

    /// Why nothing comes any more.
    fn lost(&self) -> CommandError {
        let status = self.child.lock().ok().and_then(|mut child| {
            let _ = child.kill();
            child.wait().ok()
        });
        let status = status.map_or_else(String::new, |status| format!(", {status}"));
        let complaint = text(&self.complaints).unwrap_or_default();
        let last = complaint.lines().rfind(|line| !line.trim().is_empty());
        let last = last.map_or_else(String::new, |line| format!(": {}", line.trim()));
        CommandError::Board(format!("fell silent{status}{last}"))
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.done = None;
        if let Ok(mut child) = self.child.lock() {
            let _ = child.kill();
            let _ = child.wait();
        }
        if let Some(watch) = self.watch.take() {
            let _ = watch.join();
        }
    }
}
