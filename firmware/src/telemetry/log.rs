//! Entries as log statements of defmt. The time of an entry is the number of its tick.
//!
//! Fields are `name=value` with the unit in the name, so that a program can read them. Numbers keep every bit.

use core::cell::Cell;

use controller::PositioningPhase;
use controller::commissioning::ExperimentPhase;
use cortex_m::interrupt::{Mutex, free};
use defmt::{error, info, warn};
use estimator::Verdict;
use link::RatePhase;
use motor_model::{DriveCommand, DriveMode};

use super::{ArmingState, Entry};
use crate::crash_record::{CrashKind, CrashRecord, FaultRegisters};
use crate::loop_report::LoopPhase;

/// The tick of the entry.
static TICK: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

defmt::timestamp!("{=u64}", free(|token| TICK.borrow(token).get()));

/// Logs a crash from which the program has started anew. Called from the task that logs.
// Never inlined: it is called from two places.
#[inline(never)]
pub fn log_crash(crash: &CrashRecord) {
    let FaultRegisters { pc, lr, cfsr, hfsr, bfar } = crash.registers;
    match crash.kind {
        CrashKind::Panic => error!("crash panic: {=str}", crash.text.as_str()),
        CrashKind::Fault => error!(
            "crash fault pc={=u32:#x} lr={=u32:#x} cfsr={=u32:#x} hfsr={=u32:#x} bfar={=u32:#x}",
            pc, lr, cfsr, hfsr, bfar
        ),
    }
}

/// Logs `entry` of tick number `tick`. Called from one task only.
// Never inlined: `host-sim size` follows every call from here.
#[inline(never)]
pub fn log(tick: u64, entry: &Entry) {
    free(|token| TICK.borrow(token).set(tick));
    match entry {
        Entry::Arming(ArmingState::Safe) => info!("state safe"),
        Entry::Arming(ArmingState::Jogging) => info!("state jogging"),
        Entry::Arming(ArmingState::Armed) => info!("state armed"),
        Entry::Arming(ArmingState::HostSilent) => error!("fault host_silent: drive off until a stop"),
        Entry::Arming(ArmingState::Overrun) => error!("fault overrun: drive off until a stop"),
        Entry::Arming(ArmingState::AmplifierFailed) => error!("fault amplifier: drive off until a stop"),
        Entry::Estimate(estimate) => info!(
            "estimate angle_units={=i64} rate_rad_s={=f32} angle_rad2={=f32} rate_rad2_s2={=f32} resting={=bool}",
            estimate.angle.units(),
            estimate.rate_rad_s,
            estimate.angle_rad2,
            estimate.rate_rad2_s2,
            estimate.resting
        ),
        Entry::Timing { clocks_max, counters } => info!(
            "timing clocks_max={=u32} overruns={=u32} taken={=u32} damaged={=u32} oversize={=u32} lost={=u32} \
             late={=u32} duplicates={=u32} dropped={=u32}",
            *clocks_max,
            counters.overruns,
            counters.taken,
            counters.damaged,
            counters.oversize,
            counters.lost,
            counters.late,
            counters.duplicates,
            counters.dropped
        ),
        Entry::Innovation { innovation, refused } => {
            let age_nanos = tick
                .wrapping_mul(controller::PositionLoop::TICK_NANOS)
                .wrapping_sub(innovation.taken_at.nanos());
            let (rad, rad2) = (innovation.innovation_rad, innovation.variance_rad2);
            match innovation.verdict {
                Verdict::Rejected(why) => warn!(
                    "innovation refused {} rad={=f32} variance_rad2={=f32} age_nanos={=u64} refused={=u32}",
                    why, rad, rad2, age_nanos, *refused
                ),
                Verdict::Used | Verdict::Restarted => info!(
                    "innovation {} rad={=f32} variance_rad2={=f32} age_nanos={=u64} refused={=u32}",
                    innovation.verdict, rad, rad2, age_nanos, *refused
                ),
            }
        }
        Entry::Phase(LoopPhase::Move(phase)) => log_phase(phase),
        Entry::Phase(LoopPhase::Rate(RatePhase::Waiting)) => info!("phase waiting"),
        Entry::Phase(LoopPhase::Rate(RatePhase::Following)) => info!("phase following"),
        Entry::Phase(LoopPhase::Rate(RatePhase::Over)) => info!("phase over"),
        Entry::Phase(LoopPhase::Rate(RatePhase::Stopped(why))) => warn!("phase stopped {}", why),
        Entry::Phase(LoopPhase::Experiment(phase)) => log_experiment(*phase),
        Entry::Health(health) => info!("health {}", health),
        Entry::Drive { command, applied } => {
            let (wanted, amplitude) = (mode(*command), applied.amplitude());
            if command == applied {
                info!("drive {=istr} amplitude={=f32}", wanted, amplitude);
            } else {
                warn!(
                    "drive {=istr} amplitude={=f32} limited: {=istr} {=f32} asked for",
                    mode(*applied),
                    amplitude,
                    wanted,
                    command.amplitude()
                );
            }
        }
    }
}

fn log_experiment(phase: ExperimentPhase) {
    match phase {
        ExperimentPhase::Resting => info!("phase resting"),
        ExperimentPhase::Sweeping => info!("phase sweeping"),
        ExperimentPhase::Cruising => info!("phase cruise"),
        ExperimentPhase::Bursting => info!("phase burst"),
        ExperimentPhase::Ready => info!("phase ready"),
        ExperimentPhase::Ended(why) => warn!("phase stopped {}", why),
    }
}

fn log_phase(phase: &PositioningPhase) {
    match phase {
        PositioningPhase::Waiting(health) => info!("phase waiting {}", health),
        PositioningPhase::Cruise { .. } => info!("phase cruise"),
        PositioningPhase::Burst { .. } => info!("phase burst"),
        PositioningPhase::Settling(_) => info!("phase settling"),
        PositioningPhase::Brake { .. } => info!("phase brake"),
        PositioningPhase::Holding => info!("phase holding"),
        PositioningPhase::Stopped(why) => warn!("phase stopped {}", why),
    }
}

#[expect(clippy::match_same_arms, reason = "the texts differ in the ELF only")]
fn mode(command: DriveCommand) -> defmt::Str {
    match command.mode() {
        None => defmt::intern!("off"),
        Some(DriveMode::B) => defmt::intern!("B"),
        Some(DriveMode::C) => defmt::intern!("C"),
    }
}
