extern crate std;

use std::vec::Vec;

use controller::{PositioningPhase, StopReason, TickReport, Wait};
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
        phase: PositioningPhase::Settling(Wait::Rest),
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
fn logged(ticks: u64, report: impl Fn(u64) -> TickReport) -> Vec<(u64, Entry)> {
    let mut telemetry = Telemetry::default();
    let mut logged = Vec::new();
    for tick in 1..=ticks {
        let mut report = report(tick);
        let report = LoopReport::Move(&mut report);
        telemetry.note(tick, ArmingState::Armed, Some(&report), Counters::default);
        logged.extend(telemetry.take().map(|entry| (tick, entry)));
        assert_eq!(telemetry.take(), None, "once");
    }
    logged
}

fn count(logged: &[(u64, Entry)], kind: fn(&Entry) -> bool) -> usize {
    logged.iter().filter(|(_, entry)| kind(entry)).count()
}

fn is_estimate(entry: &Entry) -> bool {
    matches!(entry, Entry::Estimate(_))
}

/// Entries keep their spacing, and every kind has its turn, even when everything changes in every tick.
#[test]
fn law_the_rate_of_entries_is_bounded_and_every_kind_has_its_turn() {
    // Everything changes in every tick.
    let restless = |tick: u64| {
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
    let logged = logged(100_000, restless);
    assert!(logged.windows(2).all(|pair| pair[1].0 - pair[0].0 >= SPACING_TICKS));
    assert!(logged.len() > 9000, "{}", logged.len());
    // An entry may wait for three others.
    let longest_wait = usize::try_from(TICKS_PER_ESTIMATE + 3 * SPACING_TICKS).unwrap();
    assert!(count(&logged, is_estimate) >= 100_000 / longest_wait);
    assert!(count(&logged, |entry| matches!(entry, Entry::Timing { .. })) >= 9);
    assert!(count(&logged, |entry| matches!(entry, Entry::Innovation { .. })) >= 700);
    for kind in [
        (|entry| matches!(entry, Entry::Phase(_))) as fn(&Entry) -> bool,
        |entry| matches!(entry, Entry::Health(_)),
        |entry| matches!(entry, Entry::Drive { .. }),
    ] {
        assert!(count(&logged, kind) > 100, "{:?}", &logged[..50]);
    }
    // Refused frames are counted even when they have no entry each.
    let refused: u32 = logged
        .iter()
        .map(|(_, entry)| if let Entry::Innovation { refused, .. } = entry { *refused } else { 0 })
        .sum();
    assert!((49_900..=50_000).contains(&refused), "{refused}");
}

/// A loop at rest logs its estimate every millisecond and its timing every tenth of a second, and nothing else twice.
#[test]
fn exact_a_quiet_loop() {
    let logged = logged(30_000, |_| quiet());
    assert_eq!(count(&logged, is_estimate), 300);
    assert_eq!(count(&logged, |entry| matches!(entry, Entry::Timing { .. })), 3);
    assert_eq!(logged.len(), 300 + 3 + 3, "armed, phase, health: {logged:?}");
    assert_eq!(logged[0], (1, Entry::Arming(ArmingState::Armed)));
}

/// A change is logged in its own tick, when there was no entry just before.
#[test]
fn exact_changes_are_logged_at_once() {
    let stopped = PositioningPhase::Stopped(StopReason::Stalled);
    let logged = logged(1000, |tick| TickReport {
        phase: if tick < 555 { PositioningPhase::Settling(Wait::Rest) } else { stopped },
        command: if tick < 777 { DriveCommand::OFF } else { B },
        ..quiet()
    });
    assert!(logged.contains(&(555, Entry::Phase(LoopPhase::Move(stopped)))), "{logged:?}");
    let limited = Entry::Drive { command: B, applied: DriveCommand::OFF };
    assert!(logged.contains(&(777, limited)), "{logged:?}");
}

/// What a phase waits for changes in every tick; the phase is the same.
#[test]
fn exact_a_phase_that_goes_on_is_logged_once() {
    #[expect(clippy::cast_precision_loss, reason = "a thousand")]
    let logged = logged(1000, |tick| TickReport {
        phase: PositioningPhase::Settling(Wait::Measuring { to_go_s: Some(tick as f32) }),
        ..quiet()
    });
    assert_eq!(count(&logged, |entry| matches!(entry, Entry::Phase(_))), 1, "{logged:?}");
}

/// A fault is logged although the loop does not run, and before all else.
#[test]
fn exact_a_fault_is_logged_without_a_report() {
    let mut telemetry = Telemetry::default();
    telemetry.record_duration(17);
    telemetry.record_duration(12);
    for tick in 1..=TICKS_PER_TIMING {
        telemetry.note(tick, ArmingState::Safe, None, Counters::default);
        let timing = Entry::Timing { clocks_max: 17, counters: Counters::default() };
        assert_eq!(telemetry.take(), (tick == TICKS_PER_TIMING).then_some(timing), "{tick}");
    }
    let fault = TICKS_PER_TIMING + SPACING_TICKS;
    telemetry.note(fault, ArmingState::Overrun, None, Counters::default);
    assert_eq!(telemetry.take(), Some(Entry::Arming(ArmingState::Overrun)));
}
