//! The search on rotors whose rate over the amplitude is given here, in the loop.

extern crate std;

use core::cell::Cell;

use estimator::Health;

use super::*;
use crate::rate::{Profile, RateHold, RateStop, RateTuning};

/// Mean rate in deg/s in the direction of the mode at an amplitude.
type RateOf<'a> = &'a dyn Fn(f32) -> f64;

/// A rotor that is fastest at a half, 300 deg/s, and turns at 60 at full drive.
fn tilting(amplitude: f32) -> f64 {
    let amplitude = f64::from(amplitude);
    if amplitude < 0.5 { 600.0 * amplitude } else { 300.0 - 480.0 * (amplitude - 0.5) }
}

/// One whose rates are those of the map's mode B, times `factor`.
fn by_the_map(factor: f64) -> impl Fn(f32) -> f64 {
    move |amplitude| {
        let rows = ResponseMap::table_1().cruises_of(DriveMode::B);
        let above = rows.iter().position(|row| row.amplitude >= amplitude).unwrap_or(rows.len() - 1).max(1);
        let [low, high] = [&rows[above - 1], &rows[above]];
        let part = (amplitude - low.amplitude) / (high.amplitude - low.amplitude);
        factor * f64::from(low.rate_rad_s + part * (high.rate_rad_s - low.rate_rad_s)).to_degrees()
    }
}

/// What became of a rotor in the end.
#[derive(Debug)]
struct Ended {
    /// How far it was behind, in degrees.
    behind_deg: f64,
    /// The strongest amplitude in the last half second.
    amplitude: f32,
    stopped: Option<RateStop>,
}

/// The hold of `rate_deg_s` for `seconds`, of a rotor of `map` that follows its drive within a tick.
fn held(map: &ResponseMap, rate_deg_s: f64, rate_of: RateOf, seconds: f64) -> Ended {
    let profile = Profile::dwell(rate_deg_s).unwrap();
    let mut hold = RateHold::new(profile, RateTuning::default(), Time::ZERO);
    let tick_s = 1e-9 * crate::TICK_NANOS as f64;
    let (mut deg, mut command, mut amplitude) = (0.0, DriveCommand::OFF, 0.0_f32);
    for tick in 1..=(seconds / tick_s) as u64 {
        // It stands for a tenth of a second first, so that it is behind, and driven fully.
        let stands = tick < 10_000;
        let rate_deg_s = command
            .mode()
            .filter(|_| !stands)
            .map_or(0.0, |mode| f64::from(direction(mode)) * rate_of(command.amplitude()));
        deg += rate_deg_s * tick_s;
        let now = Time::from_nanos(tick * crate::TICK_NANOS);
        let estimate = Estimate {
            at: now,
            angle: Angle::from_degrees(deg),
            rate_rad_s: rate_deg_s.to_radians() as f32,
            angle_rad2: 1e-8,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 1.0,
            resting: false,
        };
        command = hold.decide(map, now, Some(&estimate), Health::Good);
        if tick as f64 * tick_s > seconds - 0.5 {
            amplitude = amplitude.max(command.amplitude());
        }
    }
    let reference = hold.reference().unwrap().degrees();
    Ended { behind_deg: rate_deg_s.signum() * (reference - deg), amplitude, stopped: hold.stopped() }
}

/// A rotor that is fastest at half drive is held at every rate below that, though at full drive, where its start throws
/// it, it turns at 60 deg/s; either way.
#[test]
fn law_a_rotor_that_is_fastest_below_full_drive_is_held() {
    for rate_deg_s in [100.0, 200.0, 250.0] {
        let ended = held(ResponseMap::table_1(), rate_deg_s, &tilting, 6.0);
        assert!(ended.stopped.is_none() && ended.behind_deg.abs() < 3.0, "{rate_deg_s}: {ended:?}");
    }
}

/// Beyond its reach it is driven at the fastest row of the map, 0.5, however the search came there: from the row of 600
/// deg/s down, and from that of 300 by itself.
#[test]
fn exact_beyond_its_reach_a_rotor_is_driven_at_its_fastest() {
    for rate_deg_s in [310.0, 400.0, 600.0] {
        let ended = held(ResponseMap::table_1(), rate_deg_s, &tilting, 8.0);
        assert!(ended.stopped.is_none(), "{rate_deg_s}: {ended:?}");
        assert!((ended.amplitude - 0.5).abs() < 1e-6, "{rate_deg_s}: {ended:?}");
    }
}

/// A rotor that turns back when driven at more than 0.6 is held as well, and one that turns back at any drive ends the
/// hold.
#[test]
fn law_a_rotor_that_turns_back_at_full_drive_is_held_at_less() {
    let back = |amplitude: f32| if amplitude > 0.55 { -100.0 } else { 600.0 * f64::from(amplitude) };
    let ended = held(ResponseMap::table_1(), 250.0, &back, 6.0);
    assert!(ended.stopped.is_none() && ended.behind_deg.abs() < 3.0, "{ended:?}");
    let ended = held(ResponseMap::table_1(), 250.0, &|_| -100.0, 6.0);
    assert_eq!(ended.stopped, Some(RateStop::WrongWay));
}

/// The rates of `of` by the time in s for which the rotor was driven, and the amplitude.
fn in_time(of: impl Fn(f64, f32) -> f64) -> impl Fn(f32) -> f64 {
    let ticks = Cell::new(0_u64);
    move |amplitude| {
        ticks.set(ticks.get() + 1);
        of(1e-9 * (ticks.get() * crate::TICK_NANOS) as f64, amplitude)
    }
}

/// A rotor that turns back at full drive, but not at once, and at less comes to turn after a quarter of a second: the
/// windows at full drive do not count there, so that it is held.
#[test]
fn law_a_rotor_that_turns_back_after_a_while_is_held_at_less() {
    let rotor = in_time(|time_s, amplitude| match (time_s, amplitude) {
        (..0.03, _) => 400.0,
        (..0.2, _) => 250.0,
        (_, 0.55..) => -100.0,
        (..0.55, _) => 0.0,
        _ => tilting(amplitude),
    });
    let ended = held(ResponseMap::table_1(), 250.0, &rotor, 8.0);
    assert!(ended.stopped.is_none() && ended.behind_deg.abs() < 3.0, "{ended:?}");
}

/// A rotor that stands for longer than two windows at the amplitude that was found is driven on at another, and one
/// that stands there too ends the hold.
#[test]
fn law_a_rotor_that_stands_at_what_was_found_is_driven_at_another() {
    for (until_s, stopped) in [(3.45, None), (f64::INFINITY, Some(RateStop::Stuck))] {
        let stands = 3.0..until_s;
        let rotor =
            in_time(|time_s, amplitude| if stands.contains(&time_s) { 0.0 } else { tilting(amplitude) });
        let ended = held(ResponseMap::table_1(), 400.0, &rotor, 6.0);
        assert_eq!(ended.stopped, stopped, "{until_s}: {ended:?}");
    }
}

/// A rotor that turns under strong drives alone is driven so, though it stands at the rows with which the search
/// begins.
#[test]
fn law_rows_at_which_a_rotor_stands_do_not_end_a_search() {
    let strong = |amplitude: f32| if amplitude < 0.85 { 0.0 } else { 100.0 };
    let ended = held(ResponseMap::table_1(), 600.0, &strong, 8.0);
    assert!(ended.stopped.is_none() && ended.amplitude > 0.85, "{ended:?}");
}

/// A rotor that has turned in mode B, and stands under mode C, is driven at another amplitude of B, and not of C.
#[test]
fn exact_a_mode_says_nothing_of_the_other() {
    let driven = |rate_deg_s: f32, mode| Driven {
        map: ResponseMap::table_1(),
        command: DriveCommand::full(mode),
        rate_rad_s: rate_deg_s.to_radians(),
        amplitude_max: 1.0,
        window_nanos: crate::progress_window::WINDOW_NANOS,
    };
    let modes = [(driven(600.0, DriveMode::B), 100.0), (driven(-50.0, DriveMode::C), 0.0)];
    let mut search = RateSearch::default();
    let (mut now, mut deg) = (Time::ZERO, 0.0);
    for (driven, rate_deg_s) in &modes {
        // To spin up and half a window take an eighth of a second.
        for _ in 0..150 {
            now = now.plus_nanos(1_000_000);
            deg += 1e-3 * rate_deg_s;
            search.watch(driven, now, &crate::rest_filter::tests::estimate(1e3 * deg, 1.0));
        }
    }
    assert_eq!(modes.map(|(driven, _)| search.tries_another(&driven, now)), [true, false]);
}

/// A rotor that is as much slower than the map as none of the design is keeps its full drive, which is its fastest.
#[test]
fn exact_a_slow_rotor_keeps_full_drive() {
    for (factor, rate_deg_s) in [(0.6, 700.0), (0.6, 850.0), (0.3, 700.0)] {
        let ended = held(ResponseMap::table_1(), rate_deg_s, &by_the_map(factor), 8.0);
        assert!(ended.stopped.is_none() && (ended.amplitude - 1.0).abs() < 1e-6, "{factor}: {ended:?}");
    }
}

/// A map of its own ends at the fastest amplitude, and no rate asks for a stronger one.
#[test]
fn exact_no_drive_is_stronger_than_the_last_row_of_the_map() {
    let table_1 = ResponseMap::table_1();
    let rows: std::vec::Vec<Cruise> = table_1
        .cruises()
        .iter()
        .filter(|row| row.mode == DriveMode::C || row.amplitude < 0.55)
        .copied()
        .collect();
    let bursts = crate::response_map::Family::ALL.map(|family| table_1.bursts(family));
    let own = ResponseMap::try_new(*table_1.design(), &rows, bursts, 0.0).unwrap();
    let ended = held(&own, 600.0, &tilting, 2.0);
    assert!((ended.amplitude - 0.5).abs() < 1e-6, "{ended:?}");
}
