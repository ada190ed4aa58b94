//! The log of the loop, for an observer, apart from the answers to the host.
//!
//! | entry | when |
//! |---|---|
//! | [`Entry::Arming`] | at once when the loop is armed or stopped, or when a fault latches |
//! | [`Entry::Estimate`] | every [`TICKS_PER_ESTIMATE`] |
//! | [`Entry::Timing`] | every [`TICKS_PER_TIMING`]: the longest tick, missed deadlines, and losses of the link |
//! | [`Entry::Innovation`] | every [`TICKS_PER_INNOVATION`]; when frames were refused, the last of them |
//! | [`Entry::Phase`], [`Entry::Health`], [`Entry::Drive`] | when changed; a phase that is a stop names its limit |
//!
//! Its cost is bounded: there is at most one entry a tick, and at most one in [`SPACING_TICKS`]. When several wait,
//! they come in this order, each with the value of its own tick. Faster changes are not in the log.
//!
//! [`Telemetry`] chooses the entries, on any machine. `log`, on the microcontroller, writes an entry in defmt's
//! encoding, whose texts stay in the ELF: over RTT on a real board, into a file of the host from the emulator.
//! `host-sim pil --telemetry` decodes it.

#[cfg(all(target_os = "none", not(feature = "silicon")))]
mod host_file;
#[cfg(target_os = "none")]
mod log;
#[cfg(all(target_os = "none", feature = "silicon"))]
mod rtt;

use estimator::{Estimate, Health, Innovation, Verdict};
use link::{Counters, PhaseRecord};
use motor_model::DriveCommand;

use crate::loop_report::{LoopPhase, LoopReport};

#[cfg(all(target_os = "none", not(feature = "silicon")))]
pub use host_file::open;
#[cfg(target_os = "none")]
pub use log::{log, log_crash};
#[cfg(all(target_os = "none", feature = "silicon"))]
pub use rtt::open;

/// Fewest ticks between two entries: ten thousand entries a second at most.
pub const SPACING_TICKS: u64 = 10;

/// Ticks between two estimates.
pub const TICKS_PER_ESTIMATE: u64 = 100;

/// Ticks between two entries of timing.
pub const TICKS_PER_TIMING: u64 = 10_000;

/// Ticks between two innovations: ten camera frames.
pub const TICKS_PER_INNOVATION: u64 = 100;

/// Whether the loop may drive, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmingState {
    /// Not armed.
    Safe,
    /// Driven by hand.
    Jogging,
    /// The loop may drive.
    Armed,
    /// Latched until a stop: the host was silent.
    HostSilent,
    /// Latched until a stop: deadlines were missed.
    Overrun,
    /// Latched until a stop: the amplifier failed, or was cut off.
    AmplifierFailed,
}

/// An entry of the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// Whether the loop may drive.
    Arming(ArmingState),
    /// The estimate of this tick.
    Estimate(Estimate<f32>),
    /// How well the loop meets its deadlines, and what the link lost.
    Timing {
        /// Longest tick since the last such entry, in clocks of the timer; 0 where it is not measured.
        clocks_max: u32,
        /// Counts since the start.
        counters: Counters,
    },
    /// What became of a camera frame.
    Innovation {
        /// The last refused innovation, or else that of this tick.
        innovation: Innovation<f32>,
        /// Frames that were refused since the last such entry.
        refused: u32,
    },
    /// The phase of a move, a rate or experiments from now on.
    Phase(LoopPhase),
    /// Whether the estimate may be used from now on.
    Health(Health),
    /// The drive from now on.
    Drive {
        /// The command of the controller.
        command: DriveCommand,
        /// What the amplifier applies: less, when it limits.
        applied: DriveCommand,
    },
}

/// Chooses the entries of the log.
#[derive(Clone, Debug)]
pub struct Telemetry {
    /// Values of the last entries of their kind.
    arming: ArmingState,
    phase: Option<PhaseRecord>,
    health: Option<Health>,
    drive: (DriveCommand, DriveCommand),
    /// Ticks at which the next entry of any kind, or of one kind, is due.
    next_at: u64,
    estimate_at: u64,
    timing_at: u64,
    innovation_at: u64,
    /// Collected since the last entry of their kind.
    refused: u32,
    last_refused: Option<Innovation<f32>>,
    clocks_max: u32,
    /// The entry of this tick.
    entry: Option<Entry>,
}

impl Default for Telemetry {
    fn default() -> Self {
        Self {
            arming: ArmingState::Safe,
            phase: None,
            health: None,
            drive: (DriveCommand::OFF, DriveCommand::OFF),
            next_at: 0,
            estimate_at: 0,
            timing_at: TICKS_PER_TIMING,
            innovation_at: 0,
            refused: 0,
            last_refused: None,
            clocks_max: 0,
            entry: None,
        }
    }
}

impl Telemetry {
    /// Records tick number `tick`; `report` is that of the loop, if it was armed, and `counters` gives the counts since
    /// the start.
    pub fn note(
        &mut self,
        tick: u64,
        arming: ArmingState,
        report: Option<&LoopReport<'_>>,
        counters: impl FnOnce() -> Counters,
    ) {
        let camera = report.and_then(LoopReport::camera);
        if let Some(innovation) = camera.filter(|camera| matches!(camera.verdict, Verdict::Rejected(_))) {
            self.refused = self.refused.saturating_add(1);
            self.last_refused = Some(*innovation);
        }
        self.entry = None;
        if tick >= self.next_at
            && let Some(entry) = self.choose(tick, arming, report, counters)
        {
            self.entry = Some(entry);
            self.next_at = tick + SPACING_TICKS;
        }
    }

    /// Records that a tick took so many clocks.
    pub fn record_duration(&mut self, clocks: u32) {
        self.clocks_max = self.clocks_max.max(clocks);
    }

    /// The entry of the last tick, once.
    #[inline]
    pub fn take(&mut self) -> Option<Entry> {
        // Most ticks have none, and nothing is moved in memory.
        if self.entry.is_some() { self.entry.take() } else { None }
    }

    /// The most urgent entry that is due.
    fn choose(
        &mut self,
        tick: u64,
        arming: ArmingState,
        report: Option<&LoopReport<'_>>,
        counters: impl FnOnce() -> Counters,
    ) -> Option<Entry> {
        if arming != self.arming {
            self.arming = arming;
            return Some(Entry::Arming(arming));
        }
        if let Some(estimate) = report.and_then(LoopReport::estimate).filter(|_| tick >= self.estimate_at) {
            self.estimate_at = tick + TICKS_PER_ESTIMATE;
            return Some(Entry::Estimate(*estimate));
        }
        if tick >= self.timing_at {
            self.timing_at = tick + TICKS_PER_TIMING;
            let clocks_max = core::mem::take(&mut self.clocks_max);
            return Some(Entry::Timing { clocks_max, counters: counters() });
        }
        let report = report?;
        if tick >= self.innovation_at
            && let Some(&innovation) = self.last_refused.as_ref().or(report.camera())
        {
            self.innovation_at = tick + TICKS_PER_INNOVATION;
            self.last_refused = None;
            let refused = core::mem::take(&mut self.refused);
            return Some(Entry::Innovation { innovation, refused });
        }
        let phase = report.kind_of_phase();
        if self.phase.replace(phase) != Some(phase) {
            return Some(Entry::Phase(report.phase()));
        }
        let health = report.health();
        if self.health.replace(health) != Some(health) {
            return Some(Entry::Health(health));
        }
        let (command, applied) = (report.command(), report.applied());
        if core::mem::replace(&mut self.drive, (command, applied)) != (command, applied) {
            return Some(Entry::Drive { command, applied });
        }
        None
    }
}

#[cfg(test)]
mod tests;
