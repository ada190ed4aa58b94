//! The emulator's process: started with a program and pipes, ended whatever happens.

use std::ffi::OsString;
use std::fs::File;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use clap::ValueEnum;

use crate::board::BoardError;
use crate::board::instructions::Board;
use crate::board::instructions::emulator::{QEMU, readable};
use crate::tool::ToolError;
use crate::tool::text;

/// An answer takes microseconds, over a serial line a few milliseconds; a start of the emulator a fraction of a second.
pub(super) const SILENCE_MAX: Duration = Duration::from_secs(20);

/// What carries the frames between host and emulated program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Link {
    /// Calls to the host: fast
    #[default]
    Semihosting,
    /// The emulated serial line, byte by byte
    Uart,
}

/// How host and emulated program are connected.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wiring<'a> {
    /// What carries the frames.
    pub link: Link,
    /// The file that the program logs into; it has to be there.
    pub log: Option<&'a Path>,
}

impl Wiring<'_> {
    /// What the program may ask of the host, and its command line. A comma in a name is written twice.
    fn semihosting(&self) -> OsString {
        let mut text = OsString::from("enable=on,target=native,arg=firmware");
        if self.link == Link::Uart {
            text.push(",arg=link=uart");
        }
        if let Some(log) = self.log {
            text.push(",arg=telemetry=");
            text.push(log.to_string_lossy().replace(',', ",,"));
        }
        text
    }
}

/// Starts the emulator with `elf`; its standard input and output are what `wiring` says.
pub(super) fn start(
    elf: &Path,
    board: Board,
    wiring: Wiring<'_>,
    arguments: &[&str],
) -> Result<(ChildStdin, ChildStdout, Guard), BoardError> {
    readable(elf)?;
    let lost = |source| ToolError::NoTool { tool: QEMU, source };
    let complaints = tempfile::tempfile().map_err(lost)?;
    let to_complaints = complaints.try_clone().map_err(lost)?;
    let serial = if wiring.link == Link::Uart { "stdio" } else { "none" };
    let mut child = Command::new(QEMU)
        .args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-serial", serial])
        .args(arguments)
        .arg("-semihosting-config")
        .arg(wiring.semihosting())
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(to_complaints)
        .spawn()
        .map_err(lost)?;
    let pipes = child.stdin.take().zip(child.stdout.take());
    let guard = Guard::new(child, complaints);
    let (to_board, from_board) = pipes.ok_or_else(|| BoardError::Board("has no pipes".to_owned()))?;
    Ok((to_board, from_board, guard))
}

/// Host and emulator on one processor, for as long as this lives: they take turns, and waking another processor takes longer than a turn.
#[derive(Debug)]
pub(super) struct OneProcessor {
    #[cfg(target_os = "linux")]
    before: rustix::thread::CpuSet,
}

impl OneProcessor {
    /// Holds this thread, and the processes that it starts, to the processor that it is on; `None` where that cannot be.
    #[cfg(target_os = "linux")]
    pub(super) fn hold() -> Option<Self> {
        let before = rustix::thread::sched_getaffinity(None).ok()?;
        let mut one = rustix::thread::CpuSet::new();
        one.set(rustix::thread::sched_getcpu());
        rustix::thread::sched_setaffinity(None, &one).ok()?;
        Some(Self { before })
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn hold() -> Option<Self> {
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
pub(super) struct Guard {
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

    pub(super) fn alive(&self) {
        self.heard.fetch_add(1, Ordering::Relaxed);
    }

    /// Waits for the program's own end.
    pub(super) fn wait(&self) -> Result<(), BoardError> {
        let lost = |source| ToolError::NoTool { tool: QEMU, source };
        // Polled, so that the watch can still end it.
        loop {
            let status = self.child.lock().ok().map(|mut child| child.try_wait());
            match status {
                Some(Ok(None)) => std::thread::sleep(Duration::from_millis(1)),
                Some(Ok(Some(status))) if status.success() => return Ok(()),
                Some(Err(source)) => return Err(lost(source).into()),
                Some(Ok(Some(_))) | None => return Err(self.lost()),
            }
        }
    }

    /// Why nothing comes any more.
    pub(super) fn lost(&self) -> BoardError {
        let status = self.child.lock().ok().and_then(|mut child| {
            let _ = child.kill();
            child.wait().ok()
        });
        let status = status.map_or_else(String::new, |status| format!(", {status}"));
        let complaint = text(&self.complaints).unwrap_or_default();
        let last = complaint.lines().rfind(|line| !line.trim().is_empty());
        let last = last.map_or_else(String::new, |line| format!(": {}", line.trim()));
        BoardError::Board(format!("fell silent{status}{last}"))
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
