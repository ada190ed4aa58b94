//! The search on rotors whose rate over the amplitude is given here, in the loop.

extern crate std;

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
