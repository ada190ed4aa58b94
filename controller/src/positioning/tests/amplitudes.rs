//! Rotors whose rate over the amplitude is not the map's.

extern crate std;

use std::collections::BTreeMap;

use super::*;

/// What became of a move.
#[derive(Debug)]
struct Moved {
    end: PositioningPhase,
    seconds: f64,
    /// The amplitude that it was driven at for longest, in thousandths.
    mostly: u32,
}

/// A move by `target_mdeg` of a rotor that turns at `rate_of` the amplitude, in deg/s in the direction of the mode, and
/// whose bursts are the map's.
fn moved(target_mdeg: f64, rate_of: impl Fn(f32) -> f64) -> Moved {
    let mut scenario = Scenario::new(target_mdeg, 0.5);
    let mut ticks: BTreeMap<u32, u32> = BTreeMap::new();
    while !matches!(scenario.phase(), PositioningPhase::Holding | PositioningPhase::Stopped(_)) {
        scenario.rest();
        match scenario.phase() {
            PositioningPhase::Burst { .. } => drop(scenario.burst(1.0)),
            PositioningPhase::Cruise { .. } => scenario.cruise_by(|cruise| {
                *ticks.entry((1e3_f32 * cruise.amplitude + 0.5) as u32).or_default() += 1;
                direction(cruise.mode) * rate_of(cruise.amplitude).to_radians() as f32
            }),
            _ => (),
        }
    }
    let mostly = ticks.into_iter().max_by_key(|(_, ticks)| *ticks).map_or(0, |(amplitude, _)| amplitude);
    Moved { end: scenario.phase(), seconds: 1e-9 * scenario.now.nanos() as f64, mostly }
}

/// Time in s in which a search and the approach end: five amplitudes for a window of 0.15 s each, at rest between them
/// where the rotor turns back, and a second near the target.
const SEARCH_AND_APPROACH_S: f64 = 2.0;

/// A rotor that is fastest at a half, 300 deg/s, and that turns slowly at full drive or turns back, is driven at that
/// amplitude for most of the way, either way.
#[test]
fn law_a_rotor_is_driven_at_the_amplitude_that_turns_it_fastest() {
    for full_deg_s in [60.0, 5.0, -60.0, -300.0] {
        let rate_of = |amplitude: f32| {
            let amplitude = f64::from(amplitude);
            if amplitude < 0.5 {
                600.0 * amplitude
            } else {
                300.0 - (300.0 - full_deg_s) * (amplitude - 0.5) / 0.5
            }
        };
        let moved = moved(1080e3, rate_of);
        assert_eq!((moved.end, moved.mostly), (PositioningPhase::Holding, 500), "{full_deg_s}: {moved:?}");
        assert!(moved.seconds < 1080.0 / 300.0 + SEARCH_AND_APPROACH_S, "{full_deg_s}: {moved:?}");
    }
}

/// One that is as slow at the weakest amplitudes as at full drive, and fastest between them: a stronger one is tried
/// since the weak ones have more of the map's rate than full drive has.
#[test]
fn law_a_faster_amplitude_is_found_between_slow_ones() {
    let rate_of = |amplitude: f32| if (0.45..0.85).contains(&amplitude) { 260.0 } else { 120.0 };
    let moved = moved(1080e3, rate_of);
    assert_eq!(moved.end, PositioningPhase::Holding, "{moved:?}");
    assert!((500..=800).contains(&moved.mostly), "{moved:?}");
    assert!(moved.seconds < 1080.0 / 260.0 + SEARCH_AND_APPROACH_S, "{moved:?}");
}

/// The same in mode C, some of whose weak amplitudes do not turn every motor: they are passed over.
#[test]
fn law_no_amplitude_is_tried_that_leaves_some_motors_at_rest() {
    for full_deg_s in [10.0, -10.0] {
        let half_of_the_map = |amplitude: f32| {
            let row = map().strongest_cruise(DriveMode::C, amplitude).unwrap();
            -0.5 * f64::from(row.rate_rad_s.to_degrees())
        };
        let rate_of = |amplitude: f32| if amplitude < 0.95 { half_of_the_map(amplitude) } else { full_deg_s };
        let moved = moved(-360e3, rate_of);
        assert_eq!((moved.end, moved.mostly), (PositioningPhase::Holding, 900), "{full_deg_s}: {moved:?}");
        let fastest_deg_s = half_of_the_map(0.9);
        assert!(moved.seconds < 360.0 / fastest_deg_s + SEARCH_AND_APPROACH_S, "{full_deg_s}: {moved:?}");
    }
}

/// One that is slow under strong drives, and creeps back under weak ones, keeps full drive.
#[test]
fn law_a_rotor_that_creeps_back_under_weak_drives_keeps_full_drive() {
    let moved = moved(360e3, |amplitude| if amplitude < 0.65 { -2.0 } else { 60.0 * f64::from(amplitude) });
    assert_eq!((moved.end, moved.mostly), (PositioningPhase::Holding, 1000), "{moved:?}");
    assert!(moved.seconds < 360.0 / 60.0 + SEARCH_AND_APPROACH_S, "{moved:?}");
}

/// One that is slow at every amplitude keeps full drive: a weak one is tried for a window.
#[test]
fn law_a_rotor_that_is_slow_at_every_amplitude_keeps_full_drive() {
    for weak in [0.1, 0.03] {
        let rate_of = |amplitude: f32| {
            if amplitude < 0.95 { 868.0 * weak * f64::from(amplitude) } else { 868.0 * 0.1 }
        };
        let moved = moved(360e3, rate_of);
        assert_eq!((moved.end, moved.mostly), (PositioningPhase::Holding, 1000), "{weak}: {moved:?}");
        assert!(moved.seconds < 360.0 / 86.8 + SEARCH_AND_APPROACH_S, "{weak}: {moved:?}");
    }
}

/// A rotor that turns back at every amplitude ends the move, after three cruises of a degree.
#[test]
fn law_a_rotor_that_turns_back_at_every_amplitude_is_given_up() {
    let moved = moved(360e3, |amplitude| -300.0 * f64::from(amplitude));
    assert_eq!(moved.end, PositioningPhase::Stopped(StopReason::ModeInverted), "{moved:?}");
    assert!(moved.seconds < 0.5, "{moved:?}");
}
