//! The emulator as a process with pipes, and the watchdog that ends it.

use std::fs::File;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use super::{Board, Wiring, command, not_run, readable};
use crate::board::BoardError;
use crate::tool::text;

/// Longest time without a message. An answer takes microseconds, over a serial line a few milliseconds; the emulator
/// starts in a fraction of a second.
pub(in crate::board) const SILENCE_MAX: Duration = Duration::from_secs(20);

/// A running program: both ends of its transport, and its watchdog.
#[derive(Debug)]
pub(in crate::board) struct WatchedProcess {
    pub(in crate::board) to_board: ChildStdin,
    pub(in crate::board) from_board: ChildStdout,
    pub(in crate::board) watchdog: Watchdog,
}

impl WatchedProcess {
    /// Starts the program `elf` on `board`, connected as `wiring` says, with further `arguments` of the emulator.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator cannot be started.
    pub(in crate::board) fn start(
        elf: &Path,
        board: Board,
        wiring: Wiring<'_>,
        arguments: &[&str],
    ) -> Result<Self, BoardError> {
        readable(elf)?;
        let standard_error = tempfile::tempfile().map_err(not_run)?;
        let mut child = command(board, wiring.serial())
            .args(arguments)
            .arg("-semihosting-config")
            .arg(wiring.semihosting())
            .arg("-kernel")
            .arg(elf)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(standard_error.try_clone().map_err(not_run)?)
            .spawn()
            .map_err(not_run)?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let watchdog = Watchdog::of(child, standard_error);
        let (to_board, from_board) = pipes.ok_or_else(|| BoardError::Board("has no pipes".to_owned()))?;
        Ok(Self { to_board, from_board, watchdog })
    }
}

/// Kills the emulator when it sends no message for [`SILENCE_MAX`], and when this is dropped.
///
/// A reader of the killed emulator's pipe reads the end of the pipe.
#[derive(Debug)]
pub(in crate::board) struct Watchdog {
    child: Arc<Mutex<Child>>,
    standard_error: File,
    messages: Arc<AtomicU64>,
    /// Dropped to end the thread.
    running: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watchdog {
    fn of(child: Child, standard_error: File) -> Self {
        let child = Arc::new(Mutex::new(child));
        let messages = Arc::new(AtomicU64::new(0));
        let (running, ended) = mpsc::channel();
        let thread = std::thread::spawn({
            let (child, messages) = (Arc::clone(&child), Arc::clone(&messages));
            move || {
                let mut before = None;
                while ended.recv_timeout(SILENCE_MAX) == Err(RecvTimeoutError::Timeout) {
                    let now = messages.load(Ordering::Relaxed);
                    if before.replace(now) == Some(now) {
                        let _ = child.lock().map(|mut child| child.kill());
                    }
                }
            }
        });
        Self { child, standard_error, messages, running: Some(running), thread: Some(thread) }
    }

    /// Takes note that the board has sent a message.
    pub(in crate::board) fn note_message(&self) {
        self.messages.fetch_add(1, Ordering::Relaxed);
    }

    /// Waits until the program ends by itself.
    ///
    /// # Errors
    /// When it ends in failure, or is killed for its silence.
    pub(in crate::board) fn wait(&self) -> Result<(), BoardError> {
        // Polled, because the thread needs the lock to kill the program.
        loop {
            let status = self.child.lock().ok().map(|mut child| child.try_wait());
            match status {
                Some(Ok(None)) => std::thread::sleep(Duration::from_millis(1)),
                Some(Ok(Some(status))) if status.success() => return Ok(()),
                Some(Err(source)) => return Err(not_run(source).into()),
                Some(Ok(Some(_))) | None => return Err(self.kill_and_explain()),
            }
        }
    }

    /// Kills the emulator, which has closed its pipe or is silent. The error has its status and the last line that it
    /// wrote to standard error.
    pub(in crate::board) fn kill_and_explain(&self) -> BoardError {
        let status = self.child.lock().ok().and_then(|mut child| {
            let _ = child.kill();
            child.wait().ok()
        });
        let status = status.map_or_else(String::new, |status| format!(", {status}"));
        let written = text(&self.standard_error).unwrap_or_default();
        let last = written.lines().rfind(|line| !line.trim().is_empty());
        let last = last.map_or_else(String::new, |line| format!(": {}", line.trim()));
        BoardError::Board(format!("fell silent{status}{last}"))
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.running = None;
        if let Ok(mut child) = self.child.lock() {
            let _ = child.kill();
            let _ = child.wait();
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
