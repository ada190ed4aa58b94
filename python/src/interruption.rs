//! Long work beside Python: the lock is released, progress is reported, Ctrl-C ends it.
//!
//! ```text
//! caller's thread:   waits; every 50 ms takes the lock for signals and progress
//! worker:            computes; its progress unwinds once it is to stop, and Rust's destructors run
//! ```
//!
//! A study ends early only where its progress unwinds, so a run of one's own looks at [`Watch::check`] as well.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors::Error;

/// Time between two looks at signals.
const LOOK: Duration = Duration::from_millis(50);

/// What unwinds.
struct Stopped;

/// How far a work is, and whether it is to stop.
#[derive(Debug, Default)]
pub struct Watch {
    stopped: Arc<AtomicBool>,
    done: AtomicU64,
    total: AtomicU64,
}

impl Watch {
    /// Says how much there is to do.
    pub fn expect(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
    }

    /// Counts what is done, and unwinds if the work is to stop.
    pub fn advance(&self, by: u64) {
        self.done.fetch_add(by, Ordering::Relaxed);
        self.check();
    }

    /// Unwinds if the work is to stop.
    #[inline]
    pub fn check(&self) {
        if self.is_stopped() {
            resume_unwind(Box::new(Stopped));
        }
    }

    /// Whether the work is to stop.
    #[inline]
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// The mark that stops the work, for what has its own way to stop.
    pub fn stop_mark(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stopped)
    }
}

/// Runs `work` without the lock. `progress` is called in this thread with what is done and the total, when either has
/// changed.
///
/// # Errors
/// That of `work`, of `progress`, or of a signal's handler: `KeyboardInterrupt`.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let watch = Watch::default();
    py.detach(|| {
        thread::scope(|scope| {
            let (finished, wait) = channel::<()>();
            let worker = scope.spawn(|| {
                let _at_end = finished;
                work(&watch)
            });
            let (mut failure, mut reported) = (None, (0, 0));
            loop {
                let over = wait.recv_timeout(LOOK) == Err(RecvTimeoutError::Disconnected);
                if failure.is_none() {
                    failure = look(&watch, progress.as_ref(), &mut reported, over).err();
                    watch.stopped.fetch_or(failure.is_some(), Ordering::Relaxed);
                }
                if over {
                    break;
                }
            }
            match (worker.join(), failure) {
                (_, Some(failure)) => Err(failure.into()),
                (Ok(result), None) => result,
                (Err(payload), None) => resume_unwind(payload),
            }
        })
    })
}

/// Looks at signals, unless the work is over, and reports progress.
fn look(watch: &Watch, progress: Option<&Py<PyAny>>, reported: &mut (u64, u64), over: bool) -> PyResult<()> {
    let now = (watch.done.load(Ordering::Relaxed), watch.total.load(Ordering::Relaxed));
    let news = progress.filter(|_| now != *reported);
    if over && news.is_none() {
        return Ok(());
    }
    Python::attach(|py| {
        if !over {
            py.check_signals()?;
        }
        if let Some(progress) = news {
            progress.call1(py, now)?;
            *reported = now;
        }
        Ok(())
    })
}
