//! What the program tells of itself, beside its answers to the host: a log for whoever watches the loop.
//!
//! | entry | when |
//! |---|---|
//! | [`Entry::Standing`] | armed, stopped, or a fault has latched: at once |
//! | [`Entry::Estimate`] | every [`TICKS_PER_ESTIMATE`] |
//! | [`Entry::Timing`] | every [`TICKS_PER_TIMING`]: the longest tick, missed deadlines, and what the link lost |
//! | [`Entry::Innovation`] | every [`TICKS_PER_INNOVATION`], and after that many ticks at the latest when frames are refused |
//! | [`Entry::Phase`], [`Entry::Health`], [`Entry::Drive`] | when changed; a phase that is a stop names the limit that was passed |
//!
//! Its cost is bounded: at most one entry a tick, and none within [`SPACING_TICKS`] of the one before, in this order when several wait. What changes
//! faster is told as it stands at its turn. [`Telemetry`] chooses on any machine; `log`, on the microcontroller, puts the entry out
//! in defmt's encoding, whose texts stay in the ELF: over RTT on a board, into a file of the host from the emulator. `host-sim pil --telemetry` reads it.

#[cfg(all(target_os = "none", not(feature = "stm32g474")))]
mod channel;
#[cfg(all(target_os = "none", feature = "stm32g474"))]
#[path = "telemetry/rtt.rs"]
mod channel;
#[cfg(target_os = "none")]
mod log;

use controller::{PositioningPhase, TickReport};
use estimator::{Estimate, Health, Innovation, Verdict};
use link::Counters;
use motor_model::DriveCommand;

#[cfg(target_os = "none")]
pub use channel::open;
#[cfg(target_os = "none")]
pub use log::log;

/// Ticks between two entries: ten thousand a second at most.
pub const SPACING_TICKS: u64 = 10;

/// Ticks between two estimates.
pub const TICKS_PER_ESTIMATE: u64 = 100;

/// Ticks between two accounts of time and link.
pub const TICKS_PER_TIMING: u64 = 10_000;

/// Ticks between two innovations: ten camera frames.
pub const TICKS_PER_INNOVATION: u64 = 100;

/// Whether the loop may drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Not armed.
    Safe,
    /// It may.
    Armed,
    /// Not before a stop: the host was silent.
    HostSilent,
    /// Not before a stop: deadlines were missed.
    Overrun,
}

/// Something told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// Whether the loop may drive.
    Standing(Standing),
    /// The estimate of this tick.
    Estimate(Estimate<f32>),
    /// How the loop keeps its time, and the link its frames.
    Timing {
        /// Longest tick since the last such entry, in clocks of the timer; 0 where nobody measures it.
        clocks_max: u32,
        /// Counts since the start.
        counters: Counters,
    },
    /// What became of a camera frame.
    Innovation {
        /// The last that was refused, else that of this tick.
        innovation: Innovation<f32>,
        /// How many were refused since the last such entry.
        refused: u32,
    },
    /// What positioning does from now on.
    Phase(PositioningPhase),
    /// Whether the estimate may be used from now on.
    Health(Health),
    /// What is driven from now on.
    Drive {
        /// What the controller asked for.
        command: DriveCommand,
        /// What the amplifier applies: less, when it limits.
        applied: DriveCommand,
    },
}

/// Chooses what is told.
#[derive(Clone, Debug)]
pub struct Telemetry {
    /// What was told last.
    standing: Standing,
    phase: Option<PositioningPhase>,
    health: Option<Health>,
    drive: (DriveCommand, DriveCommand),
    /// When the next entry of a kind is due.
    next_at: u64,
    estimate_at: u64,
    timing_at: u64,
    innovation_at: u64,
    /// Since the last entry of their kind.
    refused: u32,
    last_refused: Option<Innovation<f32>>,
    clocks_max: u32,
    /// What this tick tells.
    entry: Option<Entry>,
}

impl Default for Telemetry {
    fn default() -> Self {
        Self {
            standing: Standing::Safe,
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
    /// Takes note of tick number `tick`; `report` is what the loop did, if it was armed.
    pub fn note(&mut self, tick: u64, standing: Standing, report: Option<&TickReport>, counters: &Counters) {
        let camera = report.and_then(|report| report.camera);
        if let Some(innovation) = camera.filter(|camera| matches!(camera.verdict, Verdict::Rejected(_))) {
            self.refused = self.refused.saturating_add(1);
            self.last_refused = Some(innovation);
        }
        self.entry = if tick < self.next_at { None } else { self.choose(tick, standing, report, counters) };
        if self.entry.is_some() {
            self.next_at = tick + SPACING_TICKS;
        }
    }

    /// A tick took so many clocks.
    pub fn worked(&mut self, clocks: u32) {
        self.clocks_max = self.clocks_max.max(clocks);
    }

    /// What the last tick tells, once.
    pub fn take(&mut self) -> Option<Entry> {
        self.entry.take()
    }

    fn choose(
        &mut self,
        tick: u64,
        standing: Standing,
        report: Option<&TickReport>,
        counters: &Counters,
    ) -> Option<Entry> {
        if standing != self.standing {
            self.standing = standing;
            return Some(Entry::Standing(standing));
        }
        if let Some(estimate) = report.and_then(|report| report.estimate).filter(|_| tick >= self.estimate_at)
        {
            self.estimate_at = tick + TICKS_PER_ESTIMATE;
            return Some(Entry::Estimate(estimate));
        }
        if tick >= self.timing_at {
            self.timing_at = tick + TICKS_PER_TIMING;
            let clocks_max = core::mem::take(&mut self.clocks_max);
            return Some(Entry::Timing { clocks_max, counters: *counters });
        }
        let TickReport { camera, command, applied, phase, health, .. } = *report?;
        if let Some(innovation) = self.last_refused.or(camera).filter(|_| tick >= self.innovation_at) {
            self.innovation_at = tick + TICKS_PER_INNOVATION;
            self.last_refused = None;
            let refused = core::mem::take(&mut self.refused);
            return Some(Entry::Innovation { innovation, refused });
        }
        if self.phase.replace(phase) != Some(phase) {
            return Some(Entry::Phase(phase));
        }
        if self.health.replace(health) != Some(health) {
            return Some(Entry::Health(health));
        }
        let drive = (command, applied);
        if core::mem::replace(&mut self.drive, drive) != drive {
            return Some(Entry::Drive { command, applied });
        }
        None
    }
}

#[cfg(test)]
mod tests;
