//! What is driven next, against the map and closed forms.

extern crate std;

use std::sync::LazyLock;

use super::*;
use crate::amplitude_search::AmplitudeSearch;
use crate::map_correction::MapCorrection;
use crate::response_map::ResponseMap;
use crate::situation::tests::situation;

static ANY_AMPLITUDE: LazyLock<AmplitudeSearch> = LazyLock::new(AmplitudeSearch::default);

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

fn motor(correction: &MapCorrection) -> MotorResponse<'_> {
    MotorResponse { map: map(), correction, amplitudes: &ANY_AMPLITUDE }
}

fn family(remaining_mdeg: f32, sigma_mdeg: f32) -> Option<Family> {
    match situation(remaining_mdeg, sigma_mdeg).plan(motor(&MapCorrection::of(map())), true) {
        Some(DrivePlan::Burst(family, ..)) => Some(family),
        _ => None,
    }
}

#[test]
fn exact_what_is_driven_for_which_distance() {
    for (remaining_mdeg, expected) in [
        (1500.0, Family::Throw),
        (8.0, Family::Nudge),
        (-4.0, Family::Step),
        (-40.0, Family::Walk),
        (-130.0, Family::Stride),
    ] {
        assert_eq!(family(remaining_mdeg, 0.2), Some(expected), "{remaining_mdeg}");
    }
    for (remaining_mdeg, mode) in
        [(90e3, DriveMode::B), (2.5e3, DriveMode::B), (-90e3, DriveMode::C), (-500.0, DriveMode::C)]
    {
        let Some(DrivePlan::Cruise(cruise)) =
            situation(remaining_mdeg, 5.0).plan(motor(&MapCorrection::of(map())), true)
        else {
            panic!("{remaining_mdeg}");
        };
        assert_eq!(cruise.mode, mode);
    }
}

/// The last step goes to the target, one before it stops short, and with little measured none is driven.
#[test]
fn law_steps_stay_on_the_fine_side() {
    let correction = MapCorrection::of(map());
    let turn_mdeg = |sigma_mdeg| match situation(-2.0, sigma_mdeg).plan(motor(&correction), true) {
        Some(DrivePlan::Burst(Family::Step, _, forecast)) => 1e3 * forecast.turn_rad.to_degrees(),
        _ => 0.0,
    };
    assert!((turn_mdeg(0.2) - 2.0).abs() < 1e-3);
    // Of 0.4 milli-degrees all but 0.2375, 0.95 of the tolerance over z2, are still to be measured; and the step
    // has a spread of its own.
    let spread_mdeg = 2.0 * motor(&correction).spread(Family::Step);
    let expected_mdeg =
        2.0 - STEP_SHORT_SIGMAS * (0.4_f32.powi(2) - 0.2375_f32.powi(2) + spread_mdeg.powi(2)).sqrt();
    assert!((turn_mdeg(0.4) - expected_mdeg).abs() < 1e-3, "{} {expected_mdeg}", turn_mdeg(0.4));
    assert!(turn_mdeg(1.0).abs() < f32::EPSILON);
}

/// To a tenth of a milli-degree, and known as well as on target is enough.
fn fine(remaining_mdeg: f32, sigma_mdeg: f32) -> Situation {
    Situation { tolerance_rad: degrees(1e-4), ..situation(remaining_mdeg, sigma_mdeg) }
}

/// A rotor nearer to the target than the shortest step turns it, 0.142 milli-degrees, is left lying only where
/// measuring on ends the move: within 0.1 (1 - 1.7 x 0.7 x 0.95 / 2) = 0.043 milli-degrees.
#[test]
fn exact_what_is_driven_below_the_shortest_step() {
    let correction = MapCorrection::of(map());
    for (remaining_mdeg, expected) in [
        (-0.3, Some((Family::Step, 0.3))),
        (-0.145, Some((Family::Step, 0.145))),
        (-0.14, Some((Family::Step, 0.1423))),
        (-0.072, Some((Family::Step, 0.1423))),
        (-0.07, Some((Family::Nudge, 1.5))),
        (-0.045, Some((Family::Nudge, 1.5))),
        (-0.042, None),
    ] {
        let found = match fine(remaining_mdeg, 0.045).plan(motor(&correction), true) {
            Some(DrivePlan::Burst(family, _, forecast)) => {
                Some((family, 1e3 * forecast.turn_rad.to_degrees()))
            }
            _ => None,
        };
        assert_eq!(found.map(|found| found.0), expected.map(|wanted| wanted.0), "{remaining_mdeg}");
        if let (Some((_, turn_mdeg)), Some((_, wanted_mdeg))) = (found, expected) {
            assert!((turn_mdeg / wanted_mdeg - 1.0).abs() < 1e-3, "{remaining_mdeg} {turn_mdeg}");
        }
    }
}

/// A step before the last leaves what the shortest step turns by, and a standard deviation of what is left.
#[test]
fn law_steps_to_a_fine_tolerance_leave_room_for_the_last() {
    let correction = MapCorrection::of(map());
    let (shortest, _) = map().range_rad(Family::Step, 1.0).unwrap();
    let mut steps = 0;
    for remaining_mdeg in [0.3, 0.5, 0.8, 1.5, 3.0] {
        for sigma_mdeg in [0.06, 0.1, 0.2] {
            let Some(DrivePlan::Burst(Family::Step, _, forecast)) =
                fine(-remaining_mdeg, sigma_mdeg).plan(motor(&correction), true)
            else {
                continue;
            };
            steps += 1;
            let left_rad = degrees(1e-3 * remaining_mdeg) - forecast.turn_rad;
            assert!(left_rad > shortest + 0.9 * forecast.turn_rad2.sqrt(), "{remaining_mdeg} {sigma_mdeg}");
        }
    }
    assert!(steps >= 6, "{steps}");
}

/// A target far beyond the longest burst is not measured for, however well the burst is forecast; one near it is.
#[test]
fn law_bursts_on_a_long_way_are_due_at_once() {
    let mut learnt = MapCorrection::of(map());
    let longest = map().burst(Family::Throw, f32::INFINITY, 1.0).unwrap();
    (0..50).for_each(|_| learnt.learn(Family::Throw, &longest, longest.turn_rad, 0.0));
    for (remaining_mdeg, due) in [(90e3, true), (20e3, false)] {
        let slow = Situation { frame_wait_s: 1.0, ..situation(remaining_mdeg, 4e3) };
        assert_eq!(slow.plan(motor(&learnt), true).is_some(), due, "{remaining_mdeg}");
    }
}

/// Clockwise bursts are aimed beyond the target; a short uncertain way clockwise is measured, not driven.
#[test]
fn law_clockwise_bursts_go_beyond_and_need_certainty() {
    let correction = MapCorrection::of(map());
    for remaining_mdeg in [0.6, 3.0, 30.0, 300.0, 1900.0] {
        let Some(DrivePlan::Burst(_, _, forecast)) =
            situation(remaining_mdeg, 0.2).plan(motor(&correction), true)
        else {
            panic!("{remaining_mdeg}");
        };
        assert!(forecast.turn_rad > degrees(1e-3 * remaining_mdeg), "{remaining_mdeg} {forecast:?}");
    }
    assert_eq!(family(0.4, 0.5), None);
    assert_eq!(family(0.8, 0.5), Some(Family::Nudge));
}

/// With 60 frames a second no cruise is cut in time: bursts go there, none longer than the longest of the map. With
/// 500 the strongest cruise is, at a distance.
#[test]
fn law_slow_frames_are_met_by_bursts() {
    for remaining_mdeg in [90e3, 2.5e3, -90e3, -500.0] {
        let slow = Situation { frame_wait_s: 2.0 / 60.0, ..situation(remaining_mdeg, 5.0) };
        let Some(DrivePlan::Burst(family, burst, _)) = slow.plan(motor(&MapCorrection::of(map())), true)
        else {
            panic!("{remaining_mdeg}");
        };
        assert!(matches!(family, Family::Throw | Family::Stride), "{family:?}");
        assert!(burst.turn_rad + 5.0 * burst.motors_sd_rad < core::f32::consts::FRAC_PI_2);
    }
    for remaining_mdeg in [90e3, -90e3] {
        let faster = Situation { frame_wait_s: 2.0 / 500.0, ..situation(remaining_mdeg, 5.0) };
        assert!(matches!(faster.plan(motor(&MapCorrection::of(map())), true), Some(DrivePlan::Cruise(_))));
        // Under a weak amplifier there are no such bursts.
        let weak = Situation { frame_wait_s: 0.1, amplitude_max: 0.7, ..situation(remaining_mdeg, 5.0) };
        assert!(matches!(weak.plan(motor(&MapCorrection::of(map())), true), Some(DrivePlan::Cruise(_))));
    }
}

/// A motor of a quarter of the map's rate coasts a quarter as far: it is driven as a motor of the map is at four
/// times the distance.
#[test]
fn law_a_slow_motor_eases_off_later() {
    let mut slow = MapCorrection::of(map());
    let full = map().strongest_cruise(DriveMode::B, 1.0).unwrap();
    (0..50).for_each(|_| slow.learn_rate(&full, 0.25 * full.rate_rad_s));
    let amplitude = |remaining_mdeg, correction: &MapCorrection| {
        let plan = situation(remaining_mdeg, 5.0).plan(motor(correction), true);
        let Some(DrivePlan::Cruise(cruise)) = plan else { panic!("{remaining_mdeg}") };
        cruise.amplitude
    };
    let mean = MapCorrection::of(map());
    let stronger = [3e3, 5e3, 10e3, 20e3].map(|remaining_mdeg| {
        let of_slow = amplitude(remaining_mdeg, &slow);
        assert!((of_slow - amplitude(4.0 * remaining_mdeg, &mean)).abs() < 1e-6, "{remaining_mdeg}");
        of_slow > amplitude(remaining_mdeg, &mean)
    });
    assert!(stronger.contains(&true));
}

/// A weaker amplifier gets other bursts, never stronger ones.
#[test]
fn law_nothing_exceeds_the_amplitude_allowed() {
    let correction = MapCorrection::of(map());
    for amplitude_max in [0.02, 0.3, 0.45, 0.9] {
        for exponent in 0..60 {
            let magnitude = 0.1 * 1.3_f32.powi(exponent);
            for remaining_mdeg in [magnitude, -magnitude] {
                let limited = Situation { amplitude_max, ..situation(remaining_mdeg, 0.01) };
                let amplitude = match limited.plan(motor(&correction), true) {
                    Some(DrivePlan::Burst(_, burst, _)) => burst.amplitude,
                    Some(DrivePlan::Cruise(cruise)) => cruise.amplitude,
                    None => 0.0,
                };
                assert!(amplitude <= amplitude_max, "{amplitude_max} {remaining_mdeg} {amplitude}");
            }
        }
    }
}

/// A map without walks has steps up to where they end, and strides beyond; one without throws nudges as far as it can,
/// again and again.
#[test]
fn law_a_family_that_a_map_lacks_is_replaced_by_its_neighbour() {
    let planned = |lacks: Family, remaining_mdeg: f32| {
        let mut map = ResponseMap::without_rows(*map().design());
        map.append_cruises(self::map().cruises()).unwrap();
        for family in Family::ALL.into_iter().filter(|family| *family != lacks) {
            map.append_bursts(family, self::map().bursts(family)).unwrap();
        }
        map.complete(self::map().step_walk_correlation()).unwrap();
        let correction = MapCorrection::of(&map);
        match situation(remaining_mdeg, 0.2).plan(MotorResponse { map: &map, ..motor(&correction) }, true) {
            Some(DrivePlan::Burst(family, ..)) => Some(family),
            _ => None,
        }
    };
    for (lacks, remaining_mdeg, expected) in [
        (Family::Walk, -4.0, Family::Step),
        (Family::Walk, -40.0, Family::Stride),
        (Family::Throw, 1500.0, Family::Nudge),
    ] {
        assert_eq!(planned(lacks, remaining_mdeg), Some(expected), "{lacks:?} {remaining_mdeg}");
    }
}
