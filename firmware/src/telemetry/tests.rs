extern crate std;

use std::vec::Vec;

use controller::StopReason;
use estimator::{Reason, Rejection, Source};
use motor_model::{Angle, DriveMode, Time};

use super::*;

const B: DriveCommand = DriveCommand::full(DriveMode::B);

fn quiet() -> TickReport {
    let estimate = Estimate {
        at: Time::ZERO,
        angle: Angle::from_units(5),
        rate_rad_s: 0.0,
        angle_rad2: 1e-6,
        angle_rate_rad2_s: 0.0,
        rate_rad2_s2: 1.0,
        resting: true,
    };
    TickReport {
        estimate: Some(estimate),
        health: Health::Good,
        camera: None,
        command: DriveCommand::OFF,
        applied: DriveCommand::OFF,
        phase: PositioningPhase::Settling,
    }
}

fn frame(verdict: Verdict) -> Innovation<f32> {
    Innovation {
        source: Source::Camera,
        taken_at: Time::ZERO,
        innovation_rad: 1.0,
        variance_rad2: 1.0,
        verdict,
    }
}

/// The entries of ticks 1 to `ticks`, with their ticks, of a loop that is armed and does what `report` says.
fn told(ticks: u64, report: impl Fn(u64) -> TickReport) -> Vec<(u64, Entry)> {
    let mut telemetry = Telemetry::default();
    let mut told = Vec::new();
    for tick in 1..=ticks {
        telemetry.note(tick, Standing::Armed, Some(&report(tick)), &Counters::default());
        told.extend(telemetry.take().map(|entry| (tick, entry)));
        assert_eq!(telemetry.take(), None, "once");
    }
    told
}

fn count(told: &[(u64, Entry)], kind: fn(&Entry) -> bool) -> usize {
    told.iter().filter(|(_, entry)| kind(entry)).count()
}

fn is_estimate(entry: &Entry) -> bool {
    matches!(entry, Entry::Estimate(_))
}

/// Whatever the loop does, entries keep their distance, and none of a kind is crowded out by the others.
#[test]
fn law_the_rate_of_entries_is_bounded_and_no_kind_starves() {
    // Everything changes in every tick.
    let wild = |tick: u64| {
        let odd = tick % 2 == 1;
        let verdict = if odd { Verdict::Used } else { Verdict::Rejected(Rejection::Gate) };
        let applied = if tick.is_multiple_of(3) { B } else { DriveCommand::OFF };
        TickReport {
            camera: Some(frame(verdict)),
            health: if odd { Health::Good } else { Health::Degraded(Reason::FramesRefused) },
            phase: if tick.is_multiple_of(5) {
                PositioningPhase::Holding
            } else {
                PositioningPhase::Waiting(Health::Waiting)
            },
            command: B,
            applied,
            ..quiet()
        }
    };
    let told = told(100_000, wild);
    assert!(told.windows(2).all(|pair| pair[1].0 - pair[0].0 >= SPACING_TICKS));
    assert!(told.len() > 9000, "{}", told.len());
    // An entry may wait for three others.
    let longest_wait = usize::try_from(TICKS_PER_ESTIMATE + 3 * SPACING_TICKS).unwrap();
    assert!(count(&told, is_estimate) >= 100_000 / longest_wait);
    assert!(count(&told, |entry| matches!(entry, Entry::Timing { .. })) >= 9);
    assert!(count(&told, |entry| matches!(entry, Entry::Innovation { .. })) >= 700);
    for kind in [
        (|entry| matches!(entry, Entry::Phase(_))) as fn(&Entry) -> bool,
        |entry| matches!(entry, Entry::Health(_)),
        |entry| matches!(entry, Entry::Drive { .. }),
    ] {
        assert!(count(&told, kind) > 100, "{:?}", &told[..50]);
    }
    // Refused frames are counted even when they are not told one by one.
    let refused: u32 = told
        .iter()
        .map(|(_, entry)| if let Entry::Innovation { refused, .. } = entry { *refused } else { 0 })
        .sum();
    assert!((49_900..=50_000).contains(&refused), "{refused}");
}

/// A loop at rest tells its estimate every millisecond and its time every tenth of a second, and nothing else twice.
#[test]
fn exact_a_quiet_loop() {
    let told = told(30_000, |_| quiet());
    assert_eq!(count(&told, is_estimate), 300);
    assert_eq!(count(&told, |entry| matches!(entry, Entry::Timing { .. })), 3);
    assert_eq!(told.len(), 300 + 3 + 3, "armed, phase, health: {told:?}");
    assert_eq!(told[0], (1, Entry::Standing(Standing::Armed)));
}

/// What changes is told in the tick in which it does, when nothing else was told just before.
#[test]
fn exact_changes_are_told_at_once() {
    let stopped = PositioningPhase::Stopped(StopReason::Stalled);
    let told = told(1000, |tick| TickReport {
        phase: if tick < 555 { PositioningPhase::Settling } else { stopped },
        command: if tick < 777 { DriveCommand::OFF } else { B },
        ..quiet()
    });
    assert!(told.contains(&(555, Entry::Phase(stopped))), "{told:?}");
    let limited = Entry::Drive { command: B, applied: DriveCommand::OFF };
    assert!(told.contains(&(777, limited)), "{told:?}");
}

/// A fault is told although the loop does nothing any more, and before all else.
#[test]
fn exact_a_fault_is_told_without_a_report() {
    let mut telemetry = Telemetry::default();
    telemetry.worked(17);
    telemetry.worked(12);
    for tick in 1..=TICKS_PER_TIMING {
        telemetry.note(tick, Standing::Safe, None, &Counters::default());
        let timing = Entry::Timing { clocks_max: 17, counters: Counters::default() };
        assert_eq!(telemetry.take(), (tick == TICKS_PER_TIMING).then_some(timing), "{tick}");
    }
    let fault = TICKS_PER_TIMING + SPACING_TICKS;
    telemetry.note(fault, Standing::Overrun, None, &Counters::default());
    assert_eq!(telemetry.take(), Some(Entry::Standing(Standing::Overrun)));
}
