//! Slow, stuck, wrong-way and lost drives, jolts, and the limits of a move.

use super::*;
use crate::positioning::failures::FAILURES_MAX;
use crate::target::Travel;

/// K3: bursts without effect, and a cruise without effect: given up after a bounded number, each time.
#[test]
fn law_a_stuck_rotor_is_given_up() {
    for target_mdeg in [-30.0, 300.0, -700.0] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        assert_eq!(scenario.end(0.0), PositioningPhase::Stopped(StopReason::Stalled), "{target_mdeg}");
        assert!(
            scenario.positioning.drives <= 2 * u32::from(FAILURES_MAX),
            "{}",
            scenario.positioning.drives
        );
    }
    let mut scenario = Scenario::new(90e3, 0.5);
    let mut on_nanos = 0;
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        on_nanos += if scenario.rest().mode().is_some() { TICK } else { 0 };
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::Stalled));
    // Each cruise counts once, and takes a window; the probe is a burst.
    let windows = u64::from(FAILURES_MAX) * crate::progress_window::WINDOW_NANOS;
    assert!((windows..windows + 10 * u64::from(FAILURES_MAX) * TICK).contains(&on_nanos), "{on_nanos}");
}

/// K3: a filter that predicts the rotor's motion takes a stuck rotor for one that arrives, cruise after cruise, until
/// it is measured at rest.
#[test]
fn law_a_stuck_rotor_that_seems_to_arrive_is_given_up() {
    // Each within a window.
    for target_mdeg in [90e3, -10e3] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
            scenario.drive(|_, cruises| if cruises { 1.0 } else { 0.0 });
            scenario.mdeg = 0.0;
        }
        assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::Stalled), "{target_mdeg}");
        assert_given_up_in_time(&scenario, 0.15);
    }
}

/// Cruises count once in a window of 0.15 s each, so that a rotor may stick for a while. `drive_s` is the longest time
/// from one to the next.
fn assert_given_up_in_time(scenario: &Scenario, drive_s: f64) {
    let (windows, given_up_s) = (f64::from(FAILURES_MAX), 1e-9 * scenario.now.nanos() as f64);
    let window_s = 1e-9 * crate::progress_window::WINDOW_NANOS as f64;
    let expected_s = (windows - 1.0) * window_s..windows * (window_s + drive_s) + drive_s;
    assert!(expected_s.contains(&given_up_s), "{given_up_s} {expected_s:?}");
}

/// K4: the same of a rotor that turns the wrong way.
#[test]
fn law_a_rotor_that_seems_to_arrive_and_lies_behind_is_given_up() {
    let mut scenario = Scenario::new(20e3, 0.5);
    let mut drives = 0;
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        let from_mdeg = scenario.mdeg;
        scenario.rest();
        if matches!(scenario.phase(), PositioningPhase::Cruise { .. }) {
            scenario.cruise(1.0);
            scenario.mdeg = from_mdeg - 0.6 * (20e3 - from_mdeg);
            drives += 1;
        }
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::ModeInverted));
    assert_eq!(drives, FAILURES_MAX / 2);
}

/// One that sticks under a weak cruise only, and seems to arrive, gets a stronger one.
#[test]
fn law_a_weak_cruise_that_seems_to_arrive_is_followed_by_a_stronger_one() {
    let scenario = moved_against_static_friction(-200.0, 1000, |scenario, sticks| {
        let from_mdeg = scenario.mdeg;
        scenario.cruise(1.0);
        scenario.mdeg = if sticks { from_mdeg } else { scenario.mdeg };
    });
    assert_eq!(scenario.phase(), PositioningPhase::Holding, "{}", scenario.mdeg);
}

/// A move, for so many ticks at rest, of a rotor that nothing below 0.85 of the drive turns. `cruise` lets a cruise
/// run, and is told whether the rotor sticks.
fn moved_against_static_friction(
    target_mdeg: f64,
    rests: u32,
    cruise: impl Fn(&mut Scenario, bool),
) -> Scenario {
    let mut scenario = Scenario::new(target_mdeg, 0.5);
    for _ in 0..rests {
        scenario.rest();
        match scenario.phase() {
            PositioningPhase::Cruise { cruise: Cruise { amplitude, .. }, .. } => {
                cruise(&mut scenario, amplitude < 0.85);
            }
            PositioningPhase::Burst { .. } => drop(scenario.burst(1.0)),
            PositioningPhase::Holding => break,
            phase => assert!(matches!(phase, PositioningPhase::Settling(_)), "{phase:?}"),
        }
    }
    scenario
}

/// K3: a filter that predicts the rotor's motion refuses the frames of a stuck rotor, and the estimate is lost in each
/// cruise. A rotor that is found elsewhere turns.
#[test]
fn law_a_rotor_that_is_lost_in_each_cruise_and_found_where_it_was_is_given_up() {
    for (turned_mdeg, stalled) in [(0.0, true), (100.0, false)] {
        let mut scenario = Scenario::new(90e3, 0.5);
        for _ in 0..100 {
            while !matches!(scenario.phase(), PositioningPhase::Cruise { .. } | PositioningPhase::Stopped(_))
            {
                scenario.rest();
            }
            if matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
                break;
            }
            scenario.mdeg += turned_mdeg;
            scenario.now = scenario.now.plus_nanos(4_000_000);
            scenario.positioning.decide(map(), scenario.now, None, Health::Unusable(Reason::Uncertain));
            scenario.ring_down();
        }
        let end = PositioningPhase::Stopped(StopReason::Stalled);
        assert_eq!(scenario.phase() == end, stalled, "{turned_mdeg} {:?}", scenario.phase());
        if stalled {
            assert_given_up_in_time(&scenario, 0.03);
        }
    }
}

/// The burst that probes the other mode of a stuck rotor waits for the ring-down of the drive before it: 16.04 ms after
/// mode B, 11.38 after mode C.
#[test]
fn law_a_probe_begins_on_a_quiet_stator() {
    for (target_mdeg, ring_down_ms) in [(90e3, 16.04), (-90e3, 11.38)] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        let (mut driven, mut waited_ms) = (None, 0.0);
        while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
            let Some(mode) = scenario.rest().mode() else { continue };
            if let Some((_, at)) = driven.filter(|(last, _)| *last != mode) {
                waited_ms = 1e3 * scenario.now.seconds_since::<f64>(at);
            }
            driven = Some((mode, scenario.now));
        }
        assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::Stalled));
        // From the last tick of the drive.
        assert!((0.0..0.03).contains(&(waited_ms - ring_down_ms)), "{target_mdeg} {waited_ms}");
    }
}

/// A motor whose cruises are at a seventh of the map's rates, or a fiftieth, and its bursts at a seventh, is slow, not
/// stuck: it arrives, at full drive for nearly all of the way.
#[test]
fn law_a_slow_motor_arrives() {
    for part in [0.147, 0.02] {
        for target_mdeg in [-360e3, 360e3, -2e3] {
            let limits = Limits { deadline_nanos: 300_000_000_000, ..Limits::default() };
            let mut scenario = Scenario::limited(target_mdeg, 0.5, limits);
            let end = scenario.end_by(|_, cruises| if cruises { part } else { 0.147 });
            assert_eq!(end, PositioningPhase::Holding, "{part} {target_mdeg} at {}", scenario.mdeg);
            assert!((scenario.mdeg - target_mdeg).abs() <= 0.5, "{part} {target_mdeg} {}", scenario.mdeg);
            let mode = if target_mdeg > 0.0 { DriveMode::B } else { DriveMode::C };
            let rate_rad_s = part * direction(mode) * map().strongest_cruise(mode, 1.0).unwrap().rate_rad_s;
            let least_s = (1e-3 * target_mdeg.abs()).to_radians() / f64::from(rate_rad_s);
            let taken_s = 1e-9 * scenario.now.nanos() as f64;
            assert!(taken_s < 1.25 * least_s + 1.0, "{part} {target_mdeg}: {taken_s} s for {least_s} s");
        }
    }
}

/// K3: a rotor that sticks on the way is noticed within two windows, whatever it did before, and one that sticks under
/// a weak drive only is driven more strongly.
#[test]
fn law_a_rotor_that_sticks_on_the_way_is_noticed_in_time() {
    for target_mdeg in [3600e3, -3600e3] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        let command = scenario.rest();
        let full = map().strongest_cruise(command.mode().unwrap(), 1.0).unwrap();
        for _ in 0..123_456 {
            // Six tenths of the map's rate, in a tick of 10 us.
            scenario.mdeg += 6e-3 * f64::from(full.rate_rad_s.to_degrees());
            assert_eq!(scenario.moving(), command);
        }
        let stuck_at = scenario.now;
        while scenario.moving().mode().is_some() {}
        assert!(
            scenario.now.nanos_since(stuck_at) < 2 * crate::progress_window::WINDOW_NANOS,
            "{target_mdeg}"
        );
        assert!(matches!(scenario.phase(), PositioningPhase::Settling(_)));
    }
    let scenario = moved_against_static_friction(-400.0, 20, |scenario, sticks| {
        scenario.cruise(if sticks { 0.0 } else { 1.0 });
    });
    assert_eq!(scenario.phase(), PositioningPhase::Holding, "{}", scenario.mdeg);
}

/// K4: a cruise that turns round on the way is noticed within a degree or a window.
#[test]
fn law_a_rotor_that_turns_back_on_the_way_is_noticed_in_time() {
    for back_mdeg in [10.0, 0.05] {
        let mut scenario = Scenario::new(3600e3, 0.5);
        scenario.rest();
        for _ in 0..50_000 {
            scenario.mdeg += 5.0;
            assert_eq!(scenario.moving().mode(), Some(DriveMode::B));
        }
        let (turned_at, farthest_mdeg) = (scenario.now, scenario.mdeg);
        while scenario.moving().mode().is_some() {
            scenario.mdeg -= back_mdeg;
        }
        let within_a_degree = farthest_mdeg - scenario.mdeg < 1e3 + 15.0 * 5e3;
        assert!(within_a_degree, "{back_mdeg}: {}", farthest_mdeg - scenario.mdeg);
        assert!(
            scenario.now.nanos_since(turned_at) < 2 * crate::progress_window::WINDOW_NANOS,
            "{back_mdeg}"
        );
    }
}

/// K5: one mode is dead, the other is not. The move ends by saying which, and with the other the motor is still of use.
#[test]
fn law_a_lost_mode_is_told_from_a_stuck_rotor() {
    for (target_mdeg, parts, lost, usable_mdeg) in [
        (-700.0, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (-30.0, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (90e3, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (90e3, (0.0, 1.0), StopReason::ModeBLost, -700.0),
        (8.0, (0.0, 1.0), StopReason::ModeBLost, -30.0),
    ] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        let part = |mode, _| if mode == DriveMode::B { parts.0 } else { parts.1 };
        // As a rotor that has just come to rest: what is probed is measured first, and again after.
        let mut rests = 0;
        while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) && !scenario.positioning.probes() {
            scenario.drive(part);
        }
        scenario.sigma_mdeg = 9.0;
        while matches!(scenario.phase(), PositioningPhase::Settling(_)) {
            rests += 1;
            scenario.sigma_mdeg *= 0.99;
            scenario.rest();
        }
        assert!(rests > 10 && scenario.sigma_mdeg < 2.0, "{target_mdeg} {rests} {}", scenario.sigma_mdeg);
        scenario.sigma_mdeg = 0.1;
        let end = scenario.end_by(part);
        assert_eq!(end, PositioningPhase::Stopped(lost), "{target_mdeg} at {}", scenario.mdeg);
        let target_deg = 1e-3 * (scenario.mdeg + usable_mdeg);
        scenario.positioning.retarget(Target::try_new(target_deg, 0.001).unwrap(), scenario.now);
        let driven = scenario.rest().mode();
        assert_eq!(driven, Some(if lost == StopReason::ModeCLost { DriveMode::B } else { DriveMode::C }));
    }
}

/// K4.
#[test]
fn law_a_rotor_that_turns_the_wrong_way_is_given_up() {
    for target_mdeg in [-30.0, 300.0] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        assert_eq!(scenario.end(-1.0), PositioningPhase::Stopped(StopReason::ModeInverted), "{target_mdeg}");
        assert!(scenario.positioning.drives <= 4, "{}", scenario.positioning.drives);
    }
    let mut scenario = Scenario::new(90e3, 0.5);
    let mut ticks = 0;
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        let driven = scenario.rest().mode().is_some();
        scenario.mdeg -= if driven { 10.0 } else { 0.0 };
        ticks += 1;
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::ModeInverted));
    // Three cruises of a degree, each counted once.
    assert!(ticks < 400 && (-4e3..-2.8e3).contains(&scenario.mdeg), "{ticks} {}", scenario.mdeg);
}

/// K6: a rotor that turns back and forth, never near the target: the number of drives is bounded, and so is the time.
#[test]
fn law_chatter_is_bounded_by_drives_and_by_the_deadline() {
    let mut scenario = Scenario::limited(0.0, 0.5, Limits { drives_max: 25, ..Limits::default() });
    for n in 0.. {
        assert!(n < 1000);
        scenario.mdeg = if n % 2 == 0 { 30.0 } else { -40.0 };
        scenario.rest();
        match scenario.phase() {
            PositioningPhase::Stopped(why) => {
                assert_eq!(why, StopReason::TooManyDrives);
                break;
            }
            PositioningPhase::Burst { .. } => drop(scenario.burst(1.0)),
            _ => (),
        }
    }
    assert_eq!(scenario.positioning.drives, 26);
    let deadline_nanos = RING_DOWN + 1_000_000;
    let mut scenario = Scenario::limited(0.0, 0.5, Limits { deadline_nanos, ..Limits::default() });
    scenario.sigma_mdeg = 5.0;
    while scenario.now.nanos() <= deadline_nanos {
        scenario.rest();
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::TimedOut));
}

/// 900 bursts that each bring the rotor nearer are no chatter: the number of drives does not end the move.
#[test]
fn law_many_small_bursts_on_the_way_are_allowed() {
    let mut scenario = Scenario::limited(1.9e3, 0.5, Limits { drives_max: 25, ..Limits::default() });
    let mut bursts = 0;
    while scenario.mdeg < 1.8e3 {
        scenario.rest();
        // Every throw turns by two milli-degrees, whatever the map says.
        if let PositioningPhase::Burst { family, burst, .. } = scenario.phase() {
            scenario.burst(2.0 * 1e-3_f32.to_radians() / (direction(family.mode()) * burst.turn_rad));
            bursts += 1;
        }
        assert!(!matches!(scenario.phase(), PositioningPhase::Stopped(_)), "{:?}", scenario.phase());
    }
    assert!(bursts > 800, "{bursts}");
}

/// K10: a target nearer than any burst: measuring alone decides.
#[test]
fn law_a_target_closer_than_one_burst_is_reached() {
    for target_mdeg in [0.1, -0.1, 0.05, -0.05] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        assert_eq!(scenario.end(1.0), PositioningPhase::Holding, "{target_mdeg}");
        assert_eq!(scenario.positioning.drives, 0);
    }
}

/// K7.
#[test]
fn law_travel_is_kept_to() {
    let limits = Limits { travel: Travel::try_new(-10.0, 50.0).unwrap(), ..Limits::default() };
    let mut scenario = Scenario::limited(90e3, 1.0, limits);
    assert_eq!(scenario.rest(), DriveCommand::OFF);
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::OutOfTravel));
    let mut scenario = Scenario::limited(40e3, 1.0, limits);
    assert_eq!(scenario.rest().mode(), Some(DriveMode::B));
    scenario.mdeg = 51e3;
    assert_eq!(scenario.moving(), DriveCommand::OFF);
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::OutOfTravel));
}

/// K7: neither a cruise nor a burst keeps the coil warm for longer than is allowed.
#[test]
fn law_the_drive_is_never_on_for_longer_than_allowed() {
    for (target_mdeg, on_max_ticks) in [(90e3, 300), (-90e3, 300), (900.0, 20), (-700.0, 20)] {
        let on_max_nanos = on_max_ticks * TICK;
        let mut scenario = Scenario::limited(target_mdeg, 1.0, Limits { on_max_nanos, ..Limits::default() });
        assert!(scenario.rest().mode().is_some(), "{target_mdeg}");
        let mut ticks = 1;
        while scenario.moving().mode().is_some() {
            ticks += 1;
        }
        assert!(matches!(scenario.phase(), PositioningPhase::Settling(_)), "{target_mdeg}");
        assert_eq!(ticks, on_max_ticks, "{target_mdeg}");
    }
}

/// K8: in hold the rotor is not driven until it is off for certain; a jolt is corrected, even after the deadline.
#[test]
fn law_a_jolt_in_hold_is_corrected() {
    let mut scenario =
        Scenario::limited(0.0, 1.0, Limits { deadline_nanos: 1_000_000_000, ..Limits::default() });
    assert_eq!(scenario.end(1.0), PositioningPhase::Holding);
    scenario.now = scenario.now.plus_nanos(5_000_000_000);
    scenario.mdeg = 0.9;
    scenario.rest();
    assert_eq!(scenario.phase(), PositioningPhase::Holding);
    scenario.mdeg = 50.0;
    scenario.moving();
    assert!(matches!(scenario.phase(), PositioningPhase::Settling(_)));
    assert_eq!(scenario.end(1.0), PositioningPhase::Holding);
    assert!(scenario.mdeg.abs() <= 1.0);
    scenario.mdeg = -20.0;
    scenario.rest();
    assert_eq!(scenario.end(1.0), PositioningPhase::Holding, "moved without being noticed");
    assert!(scenario.mdeg.abs() <= 1.0);
}
