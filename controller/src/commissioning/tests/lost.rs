//! Drives that lose the estimate: what their responses keep, and how they are counted.

use super::*;

const CRUISE: Experiment = Experiment::Cruise { mode: DriveMode::B, amplitude: 1.0, offset_hz: 0.0 };

/// The ordered drive from `now` on, for `nanos`; when that is over.
fn driven(experimenter: &mut Experimenter, mut now: Time, estimate: &Estimate<f32>, nanos: u64) -> Time {
    experimenter.decide(now, Some(estimate), Health::Good);
    let begun = now;
    while now.nanos_since(begun) < nanos {
        now = now.plus_nanos(crate::TICK_NANOS);
        experimenter.decide(now, Some(estimate), Health::Good);
    }
    now
}

/// A drive is off in the tick that loses the estimate, and its response is none. Too many of them are the end.
#[test]
fn law_a_drive_that_loses_the_estimate_shows_nothing() {
    let (mut experimenter, mut now, mut estimate) = ready();
    let end = u16::from(experimenter::LOST_MAX) + 1;
    for lost in 1..=end {
        assert!(experimenter.order(CRUISE));
        while experimenter.phase() != ExperimentPhase::Cruising {
            experimenter.decide(now, Some(&estimate), Health::Good);
            now = now.plus_nanos(crate::TICK_NANOS);
        }
        assert_eq!(experimenter.decide(now, None, Health::Waiting), DriveCommand::OFF);
        if lost == end {
            break;
        }
        // Where it is found again it did not lie before.
        estimate.angle = estimate.angle.plus(Angle::from_degrees(1.0));
        while experimenter.phase() != ExperimentPhase::Ready {
            now = now.plus_nanos(crate::TICK_NANOS);
            assert_eq!(experimenter.decide(now, Some(&estimate), Health::Good), DriveCommand::OFF);
        }
        assert_eq!((experimenter.response(), experimenter.number()), (Some(&Response::Lost), lost));
    }
    assert_eq!(experimenter.phase(), ExperimentPhase::Ended(CommissioningEnd::NoEstimate));
}

/// Of a cruise that loses the estimate the windows before it are kept, but for the last: they have no coast.
#[test]
fn law_a_cruise_that_loses_the_estimate_keeps_the_windows_before() {
    let (mut experimenter, mut now, mut estimate) = ready();
    // Spin-up of 150 ms, the wait for a frame, and four windows of 50 ms and a part of one; or one and a part.
    for (driven_nanos, windows) in [(370_000_000, Some(3)), (240_000_000, None)] {
        assert!(experimenter.order(CRUISE));
        now = driven(&mut experimenter, now, &estimate, driven_nanos);
        assert_eq!(experimenter.phase(), ExperimentPhase::Cruising);
        assert_eq!(experimenter.decide(now, None, Health::Waiting), DriveCommand::OFF);
        estimate.angle = estimate.angle.plus(Angle::from_degrees(1.0));
        while experimenter.phase() != ExperimentPhase::Ready {
            now = now.plus_nanos(crate::TICK_NANOS);
            experimenter.decide(now, Some(&estimate), Health::Good);
        }
        let kept = match experimenter.response().unwrap() {
            Response::Cruise { windows, .. } => Some(windows.len()),
            _ => None,
        };
        assert_eq!(kept, windows, "{driven_nanos}");
    }
}

/// A rotor that lies where it lay after a drive that lost the estimate was not turned: that is a window as long as the
/// drive, however often it happens, also where the estimate is lost again meanwhile, and where it was lost after some
/// windows.
#[test]
fn law_a_rotor_that_was_not_turned_is_told_from_one_that_was_lost() {
    let (mut experimenter, mut now, estimate) = ready();
    for number in 1..=12 {
        assert!(experimenter.order(CRUISE));
        let driven_nanos = if number == 12 { 370_000_000 } else { 4_000_000 };
        now = driven(&mut experimenter, now, &estimate, driven_nanos);
        for health in [Health::Waiting, Health::Good, Health::Waiting] {
            let seen = Some(&estimate).filter(|_| health == Health::Good);
            assert_eq!(experimenter.decide(now, seen, health), DriveCommand::OFF);
        }
        while experimenter.phase() != ExperimentPhase::Ready {
            assert_eq!(experimenter.phase(), ExperimentPhase::Resting, "{number}");
            now = now.plus_nanos(crate::TICK_NANOS);
            experimenter.decide(now, Some(&estimate), Health::Good);
        }
        let Some(Response::Unmoved { window }) = experimenter.response() else {
            panic!("{number}: {:?}", experimenter.response())
        };
        let off_s = window.time_s - 1e-9 * driven_nanos as f32;
        assert!(window.turned_rad.abs() < 1e-9 && off_s.abs() < 1e-6, "{number}: {window:?}");
    }
}

/// Each drive of either mode loses the estimate. A rotor that was never turned is dead in both modes, and not lost. A
/// rotor that was turned is lost and not dead, by some windows in which it stuck, or by every second drive.
#[test]
fn law_a_stuck_rotor_is_told_from_one_that_is_lost_in_each_drive() {
    let instruments = Instruments { vibrometer: None, ..Instruments::default() };
    let map = ResponseMap::table_1();
    let window = TurnWindow { turned_rad: 0.0, turned_rad2: 1e-8, time_s: 0.05 };
    let windows = Vec::from_slice(&[window; 2]).unwrap();
    let cut = Response::Cruise { windows, coast: Coast::default(), to_rest_s: 0.0 };
    let unmoved = Response::Unmoved { window };
    for (shown, is_lost) in
        [([&unmoved, &unmoved], false), ([&cut, &cut], true), ([&unmoved, &Response::Lost], true)]
    {
        let mut commissioning = Commissioning::new(&instruments);
        for response in shown.into_iter().cycle().take(64) {
            if commissioning.next(map).is_some() {
                commissioning.take(map, response);
            }
        }
        let found = commissioning.result(map, CommissioningEnd::Enough, 10.0);
        let lost = found.findings.iter().filter(|finding| matches!(finding.kind, FindingKind::Lost { .. }));
        assert_eq!(lost.count() > 0, is_lost, "{:?}", found.findings);
        let unfit = found.map.unwrap_err();
        assert_eq!(matches!(unfit, Unfit::LostWhenDriven { .. }), is_lost, "{unfit:?}");
        assert_eq!(unfit == Unfit::NothingTurns, !is_lost, "{unfit:?}");
    }
}

/// A cruise that was cut counts with its windows, and has no coast. After sixteen drives in a row of which nothing is
/// known, and not after fifteen, the loss is the reason, and the mode is that of the last.
#[test]
fn exact_what_is_lost_is_counted() {
    let instruments = Instruments { vibrometer: None, ..Instruments::default() };
    let map = ResponseMap::table_1();
    let mut commissioning = Commissioning::new(&instruments);
    assert!(matches!(commissioning.next(map), Some(Experiment::Cruise { .. })), "a cruise is first");
    let window = TurnWindow { turned_rad: 0.75, turned_rad2: 1e-8, time_s: 0.05 };
    let windows = Vec::from_slice(&[window; 3]).unwrap();
    let cut = Response::Cruise { windows, coast: Coast::default(), to_rest_s: 0.0 };
    commissioning.take(map, &cut);
    let found = commissioning.evidence().cruise(7);
    assert_eq!((found.runs, found.lost, found.windows.count()), (1, 1, 3));
    assert_eq!((found.coasts.count(), found.to_rest_s.count()), (0, 0));
    for lost in 1..=experimenter::LOST_MAX {
        let mode = commissioning.next(map).expect("not every cruise is lost yet").mode();
        commissioning.take(map, &Response::Lost);
        let unfit = commissioning.result(map, CommissioningEnd::NoEstimate, 1.0).map.unwrap_err();
        assert_eq!(
            unfit,
            if lost < experimenter::LOST_MAX { Unfit::NoEstimate } else { Unfit::LostWhenDriven { mode } }
        );
    }
    commissioning.next(map);
    commissioning.take(map, &cut);
    let unfit = commissioning.result(map, CommissioningEnd::NoEstimate, 1.0).map.unwrap_err();
    assert_eq!(unfit, Unfit::NoEstimate, "a drive that showed something begins the count anew");
}

/// A drive that is seen in between counts anew: at some drives a rotor that tilts is lost now and then.
#[test]
fn law_drives_that_lose_the_estimate_count_in_a_row() {
    let (mut experimenter, mut now, estimate) = ready();
    let mut tick = |experimenter: &mut Experimenter, seen: bool| {
        now = now.plus_nanos(crate::TICK_NANOS);
        let health = if seen { Health::Good } else { Health::Waiting };
        experimenter.decide(now, Some(&estimate).filter(|_| seen), health);
    };
    for number in 0..30 {
        assert!(experimenter.order(BURST));
        while experimenter.phase() != ExperimentPhase::Bursting {
            tick(&mut experimenter, true);
        }
        if number % 5 != 4 {
            tick(&mut experimenter, false);
        }
        while experimenter.phase() != ExperimentPhase::Ready {
            assert!(!matches!(experimenter.phase(), ExperimentPhase::Ended(_)), "{number}");
            tick(&mut experimenter, true);
        }
    }
}
