use controller::{PositioningPhase, StopReason, TickReport, Wait};
use estimator::{Estimate, Health};
use link::{TargetRecord, TickRecord};
use motor_model::DriveCommand;

use super::*;

const MS: u64 = 1_000_000;
const WAIT: i64 = 300_000_000;

/// The report of a board whose rotor is at `deg`.
fn reported(deg: f64, phase: PositioningPhase) -> Reported {
    let estimate = Estimate {
        at: Time::ZERO,
        angle: Angle::from_degrees(deg),
        rate_rad_s: 0.0,
        angle_rad2: 1e-9,
        angle_rate_rad2_s: 0.0,
        rate_rad2_s2: 1.0,
        resting: true,
    };
    let report = TickReport {
        estimate: Some(estimate),
        health: Health::Good,
        camera: None,
        command: DriveCommand::OFF,
        applied: DriveCommand::OFF,
        phase,
    };
    Reported::of(&TickRecord::from(&report)).unwrap()
}

/// A move to 30 degrees within 0.1, to be held for 20 ms, and `steps` after it.
fn watched(steps: &[NextStep]) -> WatchedMove {
    let sets = ["position.to_deg=30", "position.tolerance_deg=0.1", "position.hold_s=0.02"];
    WatchedMove::new(&Scene::of_sets(&sets.map(str::to_owned)).unwrap()).followed_by(steps)
}

/// Lets the board report each millisecond that it holds `deg`, for `ms` from `from_ms` on; whether the run is over.
fn holds(watched: &mut WatchedMove, (from_ms, ms): (u64, u64), deg: f64) -> bool {
    let report = reported(deg, PositioningPhase::Holding);
    let mut take = |ms| watched.take(Time::from_nanos(ms * MS), &report, None);
    (from_ms..=from_ms + ms).map(&mut take).fold(false, |_, is_over| is_over)
}

fn retargeted(deg: f64) -> BoardMessage {
    BoardMessage::Retargeted { target_units: Angle::from_degrees(deg).units() }
}

fn to(target_deg: f64) -> HostMessage {
    HostMessage::Retarget(TargetRecord { target_deg, tolerance_deg: 0.1 })
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-6
}

/// Each target in turn, asked for once the one before was held for its time, and again where no answer comes. Reports
/// before the answer, and those that may be older by the latency, are of the target before.
#[test]
fn exact_targets_are_held_one_after_the_other() {
    let mut watched = watched(&[NextStep::To(60.0), NextStep::To(-5.0)]);
    assert!(!holds(&mut watched, (0, 19), 30.05) && watched.due(0).is_none());
    assert!(!holds(&mut watched, (20, 0), 30.05));
    assert_eq!((watched.due(1), watched.due(WAIT)), (Some(to(60.0)), None));
    assert_eq!(watched.due(WAIT + 1), Some(to(60.0)), "the answer is lost");
    assert!(!holds(&mut watched, (21, 100), 30.05), "of the target before");
    watched.take_answer(&retargeted(60.0));
    assert!(watched.due(3 * WAIT).is_none() && near(watched.target_deg(), 60.0));
    assert!(!holds(&mut watched, (200, 0), 30.05));
    let settling = reported(59.0, PositioningPhase::Settling(Wait::Rest));
    assert!(!watched.take(Time::from_nanos(201 * MS), &settling, None));
    assert!(!holds(&mut watched, (300, 19), 60.0) && watched.due(3 * WAIT).is_none());
    assert!(!holds(&mut watched, (320, 0), 60.0));
    // The answer to what was sent twice comes twice.
    assert_eq!(watched.due(4 * WAIT), Some(to(-5.0)));
    watched.take_answer(&retargeted(60.0));
    assert_eq!(watched.due(5 * WAIT), Some(to(-5.0)));
    watched.take_answer(&retargeted(-5.0));
    assert!(!holds(&mut watched, (400, 20), -5.2), "a report of the target before is among these");
    assert!(holds(&mut watched, (421, 0), -5.2));
    let figures = watched.figures(Some(&reported(-5.2, PositioningPhase::Holding)), None);
    let held: Vec<_> =
        figures.held_before.iter().map(|held| (held.target_deg, held.held_s, held.ok)).collect();
    assert_eq!(held, [(30.0, 0.02, true), (60.0, 0.32, true)]);
    assert!(!figures.ok && near(figures.target_deg, -5.0), "-5.2 is not within 0.1 of -5: {figures:?}");
}

/// One target that was not held within the tolerance is not made good by the next one.
#[test]
fn exact_every_target_counts() {
    for (deg, ok) in [(30.05, true), (30.2, false)] {
        let mut watched = watched(&[NextStep::To(60.0)]);
        assert!(!holds(&mut watched, (0, 20), deg));
        watched.take_answer(&retargeted(60.0));
        assert!(holds(&mut watched, (100, 21), 60.0));
        let figures = watched.figures(Some(&reported(60.0, PositioningPhase::Holding)), None);
        assert_eq!((figures.ok, figures.held_before[0].ok), (ok, ok));
        assert_eq!(figures.to_string().contains("not within the tolerance"), !ok, "{figures}");
    }
}

/// A hold takes the target that the board says. A zero moves the target, and not the rotor: the next angle counts from
/// it.
#[test]
fn exact_a_hold_and_a_zero_where_the_rotor_is() {
    let mut watched = watched(&[NextStep::Hold, NextStep::Zero, NextStep::To(5.0)]);
    assert!(!holds(&mut watched, (0, 20), 30.05));
    assert_eq!(watched.due(0), Some(HostMessage::Hold));
    watched.take_answer(&retargeted(30.05));
    assert!(near(watched.target_deg(), 30.05));
    assert!(!holds(&mut watched, (100, 21), 30.05));
    assert_eq!(watched.due(WAIT), Some(HostMessage::Zero { angle_units: None }));
    watched.take_answer(&retargeted(30.05));
    assert_eq!(
        watched.due(2 * WAIT),
        Some(HostMessage::Zero { angle_units: None }),
        "it is no answer to this"
    );
    watched.zeroed(Angle::from_degrees(30.05));
    assert!(near(watched.target_deg(), 0.0));
    // It was held already.
    assert!(!holds(&mut watched, (122, 0), 0.0));
    assert_eq!(watched.due(3 * WAIT), Some(to(5.0)));
    let held: Vec<f64> = watched.held.iter().map(|held| held.target_deg).collect();
    assert!(held.len() == 2 && near(held[0], 30.0) && near(held[1], 30.05), "{held:?}");
}

/// A move that is given up ends the run, whatever is left to do.
#[test]
fn exact_steps_end_with_the_move() {
    let stopped = reported(10.0, PositioningPhase::Stopped(StopReason::OutOfTravel));
    let mut moving = watched(&[NextStep::Hold]);
    assert!(moving.take(Time::ZERO, &stopped, None));
    let mut asking = watched(&[NextStep::Hold]);
    assert!(!holds(&mut asking, (0, 20), 30.0));
    assert!(asking.take(Time::from_nanos(21 * MS), &stopped, None));
    let figures = asking.figures(Some(&stopped), None);
    assert_eq!((figures.ok, figures.stopped.as_deref()), (false, Some("OutOfTravel")));
}
