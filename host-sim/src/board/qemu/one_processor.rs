//! Host and emulator on one processor of this machine.

/// Holds this thread, and the processes that it starts, to one processor for as long as it lives.
///
/// In lock step, host and emulator take turns. To wake another processor takes longer than a turn.
#[derive(Debug)]
pub(in crate::board) struct OneProcessor {
    #[cfg(target_os = "linux")]
    before: rustix::thread::CpuSet,
}

impl OneProcessor {
    /// Holds them to the processor that this thread is on; `None` where the system does not allow it.
    #[cfg(target_os = "linux")]
    pub(in crate::board) fn hold() -> Option<Self> {
        let before = rustix::thread::sched_getaffinity(None).ok()?;
        let mut one = rustix::thread::CpuSet::new();
        one.set(rustix::thread::sched_getcpu());
        rustix::thread::sched_setaffinity(None, &one).ok()?;
        Some(Self { before })
    }

    #[cfg(not(target_os = "linux"))]
    pub(in crate::board) fn hold() -> Option<Self> {
        None
    }
}

#[cfg(target_os = "linux")]
impl Drop for OneProcessor {
    fn drop(&mut self) {
        let _ = rustix::thread::sched_setaffinity(None, &self.before);
    }
}
