//! The rate controller by itself, on estimates made here.

use super::*;
use crate::target::Travel;
use estimator::{CameraDescription, Reason};

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

fn estimate(at: Time, deg: f64) -> Estimate<f32> {
    Estimate {
        at,
        angle: Angle::from_degrees(deg),
        rate_rad_s: 0.0,
        angle_rad2: 1e-8,
        angle_rate_rad2_s: 0.0,
        rate_rad2_s2: 1.0,
        resting: false,
    }
}

/// The inverse of the map: the rate of a cruise gives its amplitude, and half way between two rates half way
/// between the amplitudes.
#[test]
fn exact_amplitudes_invert_the_map() {
    for pair in map().cruises().windows(2).filter(|pair| pair[0].mode == pair[1].mode) {
        let along = direction(pair[0].mode);
        for part in [0.0, 0.5] {
            let of =
                |f: fn(&crate::response_map::Cruise) -> f32| f(&pair[0]) + part * (f(&pair[1]) - f(&pair[0]));
            let command = amplitude_for(map(), pair[0].mode, along * of(|c| c.rate_rad_s), 1.0, false);
            assert_eq!(command.mode(), Some(pair[0].mode));
            assert!((command.amplitude() - of(|c| c.amplitude)).abs() < 1e-4, "{pair:?} {command:?}");
        }
    }
    let fast = amplitude_for(map(), DriveMode::B, 1e3, 0.8, false).amplitude();
    assert!((fast - 0.8).abs() < f32::EPSILON);
}

/// A rotor that stands is behind after a tenth of a second by that of the rate, clockwise and counter-clockwise, and is
/// driven accordingly.
#[test]
fn law_the_reference_turns_at_the_rate_and_the_drive_follows_it() {
    for (rate_deg_s, mode) in [(100.0, DriveMode::B), (-50.0, DriveMode::C)] {
        let profile = Profile::dwell(rate_deg_s).unwrap();
        let mut hold = RateHold::new(profile, RateTuning::default(), Time::ZERO);
        let mut command = DriveCommand::OFF;
        for tick in 1..=10_000 {
            let now = Time::from_nanos(tick * crate::TICK_NANOS);
            command = hold.decide(map(), now, Some(&estimate(now, 0.0)), Health::Good);
        }
        let turned = hold.reference().unwrap().degrees();
        assert!((turned - 0.1 * rate_deg_s).abs() < 1e-3 * rate_deg_s.abs(), "{turned}");
        assert_eq!(command.mode(), Some(mode));
        assert!((command.amplitude() - 1.0).abs() < f32::EPSILON, "far behind: full drive");
    }
}

/// A command is given since the tick that decided it first, for as long as the modes need to respond at least, and the
/// drive is off since the tick that lost the estimate.
#[test]
fn exact_a_command_is_given_since_it_changed() {
    let at = |tick| Time::from_nanos(tick * crate::TICK_NANOS);
    let mut hold = RateHold::new(Profile::dwell(100.0).unwrap(), RateTuning::default(), at(0));
    let (mut last, mut changes) = ((DriveCommand::OFF, at(0)), 0);
    for tick in 1..=20_000 {
        let (now, is_lost) = (at(tick), tick == 15_000);
        let estimate = estimate(now, 0.0);
        let command = hold.decide(map(), now, Some(&estimate).filter(|_| !is_lost), Health::Good);
        if command != last.0 {
            // A lost estimate switches off at once, and the drive goes on at once after it.
            let held = now.nanos_since(last.1) >= RateTuning::default().hold_nanos;
            assert!(held || (15_000..15_050).contains(&tick), "tick {tick}");
            last = (command, now);
            changes += 1;
        }
        assert_eq!((command, hold.since()), last, "tick {tick}");
        assert!(!is_lost || command == DriveCommand::OFF);
    }
    assert!(changes > 100, "{changes}");
}

#[test]
fn law_no_drive_on_an_unusable_estimate() {
    let profile = Profile::dwell(500.0).unwrap();
    let mut hold = RateHold::new(profile, RateTuning::default(), Time::ZERO);
    let at = |tick| Time::from_nanos(tick * crate::TICK_NANOS);
    for tick in 0..1000 {
        hold.decide(map(), at(tick), Some(&estimate(at(tick), 0.0)), Health::Good);
    }
    let lost = Health::Unusable(Reason::Uncertain);
    assert_eq!(hold.decide(map(), at(1000), Some(&estimate(at(1000), 0.0)), lost), DriveCommand::OFF);
    assert_eq!(hold.reference(), None);
    assert_eq!(hold.decide(map(), at(1001), None, Health::Waiting), DriveCommand::OFF);
}

/// Without a usable estimate for longer than a move would wait, the hold ends for good, at that tick; a loss that is
/// shorter ends nothing, however often it comes.
#[test]
fn exact_a_long_loss_of_the_estimate_ends_the_hold() {
    const TICK: u64 = 1_000_000;
    let limits = RateLimits { blind_max_nanos: 100 * TICK, ..RateLimits::default() };
    let tuning = RateTuning { limits, ..RateTuning::default() };
    let mut hold = RateHold::new(Profile::dwell(10.0).unwrap(), tuning, Time::ZERO);
    for tick in 1..=1000 {
        let now = Time::from_nanos(tick * TICK);
        // Nine losses of a tenth of a second less a tick, and one that lasts. The rotor follows.
        let seen = (tick <= 900 && tick % 100 == 0).then(|| estimate(now, 1e-2 * tick as f64));
        let command = hold.decide(map(), now, seen.as_ref(), Health::Good);
        assert!(seen.is_some() || command == DriveCommand::OFF);
        assert_eq!(hold.stopped(), None, "{tick}");
    }
    let now = Time::from_nanos(1001 * TICK);
    hold.decide(map(), now, None, Health::Good);
    assert_eq!(hold.stopped(), Some(RateStop::NoEstimate));
    let now = Time::from_nanos(1002 * TICK);
    assert_eq!(hold.decide(map(), now, Some(&estimate(now, 0.0)), Health::Good), DriveCommand::OFF);
    assert_eq!(hold.stopped(), Some(RateStop::NoEstimate));
}

/// The default camera shows an error within 0.2 ms. One of 60 Hz does within 33 ms: what it shows is corrected in three
/// times as long, and the rotor may be ahead by as much more.
#[test]
fn exact_a_slow_camera_is_followed_slowly() {
    let instruments = Instruments::default();
    let camera =
        CameraDescription { period_nanos: 16_666_667, latency_nanos: 16_666_667, ..instruments.camera };
    let default = RateTuning::new(&instruments);
    assert_eq!((default.catch_up_s, default.ahead_rad), (0.012, 0.052));
    let slow = RateTuning::new(&Instruments { camera, ..instruments });
    assert!(
        (slow.catch_up_s - 0.1).abs() < 1e-6 && (slow.ahead_rad - 0.052 * 0.1 / 0.012).abs() < 1e-5,
        "{slow:?}"
    );
}

/// A rotor ahead is slowed by friction, and driven back only beyond the limit.
#[test]
fn exact_a_rotor_ahead_is_left_alone_until_it_is_far_ahead() {
    let tuning = RateTuning::default();
    let none = RateSearch::default();
    let drive = |rate_rad_s, behind_rad| tuning.drive(map(), rate_rad_s, behind_rad, &none);
    assert_eq!(drive(1.0, -0.04), DriveCommand::OFF);
    assert_eq!(drive(1.0, -0.06).mode(), Some(DriveMode::C));
    assert_eq!(drive(-1.0, 0.06).mode(), Some(DriveMode::B));
    assert_eq!(drive(0.1, 0.0), DriveCommand::OFF);
    assert_eq!(drive(0.1, 0.001).mode(), Some(DriveMode::B));
    // However far ahead, it is driven back no more strongly than is allowed.
    let back = RateTuning { amplitude_max: 0.5, ..tuning }.drive(map(), 1.0, -10.0, &none);
    assert_eq!(back.mode(), Some(DriveMode::C));
    assert!((back.amplitude() - 0.5).abs() < 1e-4, "{back:?}");
}

/// While a profile rests the drive is off, and the next turn begins where the rotor came to rest, however far it
/// was behind before.
#[test]
fn law_rest_is_without_drive_and_drops_the_error() {
    let profile = Profile::BothWays {
        clockwise_rad_s: 2.0,
        counter_clockwise_rad_s: -1.0,
        steps: 1,
        turn_s: 0.5,
        rest_s: 0.25,
    };
    let mut hold = RateHold::new(profile, RateTuning::default(), Time::ZERO);
    for tick in 1..200_000 {
        let now = Time::from_nanos(tick * crate::TICK_NANOS);
        let command = hold.decide(map(), now, Some(&estimate(now, 7.0)), Health::Good);
        let asked = hold.wanted_rad_s(now);
        if asked.abs() > 0.0 {
            assert!(command.mode() != Some(if asked > 0.0 { DriveMode::C } else { DriveMode::B }));
        } else {
            assert_eq!((command, hold.reference()), (DriveCommand::OFF, Some(Angle::from_degrees(7.0))));
        }
    }
}

/// How a rotor that is led through ticks of a hold turns: its rate in rad/s at a time in s, clockwise positive.
type Turning<'a> = &'a dyn Fn(f64) -> f64;

/// The hold after `seconds` of a rotor that turns like this from `from_deg` on: when it stopped and why, where the
/// rotor then was in degrees, and the time with the drive on until then.
fn led(
    limits: RateLimits,
    profile: Profile,
    from_deg: f64,
    turning: Turning,
    seconds: f64,
) -> (Option<(f64, RateStop)>, f64, f64) {
    let tuning = RateTuning { limits, ..RateTuning::default() };
    let mut hold = RateHold::new(profile, tuning, Time::ZERO);
    let (mut deg, mut on_s, tick_s) = (from_deg, 0.0, 1e-9 * crate::TICK_NANOS as f64);
    for tick in 1..=(seconds / tick_s) as u64 {
        let now = Time::from_nanos(tick * crate::TICK_NANOS);
        let time_s = tick as f64 * tick_s;
        let rate_rad_s = turning(time_s);
        deg += rate_rad_s.to_degrees() * tick_s;
        let estimate = Estimate { rate_rad_s: rate_rad_s as f32, ..estimate(now, deg) };
        let command = hold.decide(map(), now, Some(&estimate), Health::Good);
        if let Some(why) = hold.stopped() {
            assert_eq!(command, DriveCommand::OFF);
            stays_stopped(hold, now, deg);
            return (Some((time_s, why)), deg, on_s);
        }
        on_s += if command == DriveCommand::OFF { 0.0 } else { tick_s };
    }
    (None, deg, on_s)
}

/// A hold that has ended drives no more, whatever becomes of the rotor: here it stands for a second.
fn stays_stopped(mut hold: RateHold, since: Time, deg: f64) {
    let why = hold.stopped();
    for tick in 1..=100_000 {
        let now = since.plus_nanos(tick * crate::TICK_NANOS);
        let command = hold.decide(map(), now, Some(&estimate(now, deg)), Health::Good);
        assert_eq!((command, hold.stopped()), (DriveCommand::OFF, why));
    }
}

fn dwell(rate_deg_s: f64) -> Profile {
    Profile::dwell(rate_deg_s).unwrap()
}

/// A rotor that stands is noticed after two windows of 0.15 s with the drive on, which comes on when it is behind by
/// 0.05 degrees: after a millisecond at 50 deg/s. At 0.2 deg/s a window lasts until the turn asked for exceeds forty
/// standard deviations of two angles, 0.324 degrees: 1.62 s, after 0.25 s.
#[test]
fn exact_a_rotor_that_stands_ends_the_hold_after_two_windows() {
    for (rate_deg_s, expected_s) in [(100.0, 0.3005), (-50.0, 0.301), (0.2, 0.25 + 2.0 * 1.6205)] {
        let (stopped, ..) = led(RateLimits::default(), dwell(rate_deg_s), 0.0, &|_| 0.0, 4.0);
        let (at_s, why) = stopped.unwrap();
        assert_eq!(why, RateStop::Stuck);
        assert!((at_s - expected_s).abs() < 2e-3, "{rate_deg_s}: {at_s} {expected_s}");
    }
}

/// A rotor that turns at a thirtieth of the rate asked for, or sticks for 50 ms in every 200, or begins a tenth of a
/// second late, is driven on.
#[test]
fn law_a_rotor_that_turns_slowly_or_sticks_now_and_then_is_driven_on() {
    let sticks = |time_s: f64| if (5.0 * time_s).fract() < 0.25 { 0.0 } else { 0.5 };
    let begins_late = |time_s: f64| if time_s < 0.1 { 0.0 } else { 1.0 };
    let turnings: [Turning; 3] = [&|_| 1.0 / 30.0, &sticks, &begins_late];
    for turning in turnings {
        let (stopped, _, on_s) = led(RateLimits::default(), dwell(57.3), 0.0, turning, 3.0);
        assert!(stopped.is_none() && on_s > 2.9, "{stopped:?}");
    }
}

/// A rotor that creeps at a hundredth of the rate asked for, forth or back, is stuck. One of which the estimate is lost
/// for half of the time is found out after twice the time: 0.6 s.
#[test]
fn exact_neither_creep_nor_a_lost_estimate_hides_a_rotor_that_is_stuck() {
    for creep in [0.01, -0.01] {
        let (stopped, ..) = led(RateLimits::default(), dwell(57.3), 0.0, &|_| creep, 1.0);
        assert_eq!(stopped.unwrap().1, RateStop::Stuck, "{creep}");
    }
    let mut hold = RateHold::new(Profile::dwell(100.0).unwrap(), RateTuning::default(), Time::ZERO);
    let stopped_at = (1..200_000_u64).find(|tick| {
        let now = Time::from_nanos(tick * crate::TICK_NANOS);
        let lost = Health::Unusable(Reason::Uncertain);
        let health = if tick % 1000 < 500 { Health::Good } else { lost };
        hold.decide(map(), now, Some(&estimate(now, 0.0)), health);
        hold.stopped().is_some()
    });
    let at_s = stopped_at.unwrap() as f64 * 1e-9 * crate::TICK_NANOS as f64;
    // Twice 0.3 s, and after each loss the half millisecond until the drive may change again.
    assert!((0.59..0.66).contains(&at_s), "{at_s}");
}

/// A rotor that sticks for 0.28 s in every 0.7 fills a window with it, and turns in the next.
#[test]
fn law_one_window_without_a_turn_ends_nothing() {
    let sticks = |time_s: f64| if (time_s / 0.7).fract() < 0.4 { 0.0 } else { 0.5 };
    let (stopped, ..) = led(RateLimits::default(), dwell(57.3), 0.0, &sticks, 10.0);
    assert!(stopped.is_none(), "{stopped:?}");
}

/// A rotor that follows and turns back by 17 degrees within 30 ms, once a second, is driven on: no whole window after
/// it is the wrong way.
#[test]
fn law_a_rotor_that_follows_may_turn_back_now_and_then() {
    let back = |time_s: f64| if (0.5..0.53).contains(&time_s.fract()) { -10.0 } else { 1.0 };
    let (stopped, ..) = led(RateLimits::default(), dwell(57.3), 0.0, &back, 3.0);
    assert!(stopped.is_none(), "{stopped:?}");
}

/// A rotor that was thrown ahead by 60 degrees is driven back, at half the rate asked for, until it is ahead by three.
#[test]
fn law_a_rotor_that_is_driven_back_does_not_turn_the_wrong_way() {
    let thrown = |time_s: f64| match time_s {
        ..0.05 => 21.0,
        ..0.7 => -0.5,
        _ => 1.0,
    };
    let (stopped, ..) = led(RateLimits::default(), dwell(57.3), 0.0, &thrown, 2.0);
    assert!(stopped.is_none(), "{stopped:?}");
}

/// Where the rate asked for changes its sign the turn before it is none the wrong way: a sine of 5 Hz about 0, which
/// the rotor follows a tenth of a radian behind.
#[test]
fn law_a_rate_that_changes_its_sign_is_followed() {
    let profile =
        Profile::Sweep { mean_rad_s: 0.0, amplitude_rad_s: 5.0, frequency_hz: (5.0, 5.0), length_s: 10.0 };
    let turning = |time_s: f64| f64::from(profile.rate_rad_s((time_s - 3e-3) as f32));
    let (stopped, _, on_s) = led(RateLimits::default(), profile, 0.0, &turning, 4.0);
    assert!(stopped.is_none() && on_s > 1.0, "{stopped:?} {on_s}");
}

/// A rotor that turns back is noticed after two windows, each of which ends after a degree. One that turned back only
/// at first, as after a change of the direction, is driven on.
#[test]
fn exact_a_rotor_that_turns_back_ends_the_hold() {
    for rate_deg_s in [100.0_f64, -100.0] {
        let back = -rate_deg_s.signum() * 1.0_f64;
        let (stopped, deg, _) = led(RateLimits::default(), dwell(rate_deg_s), 0.0, &|_| back, 1.0);
        let (at_s, why) = stopped.unwrap();
        assert_eq!(why, RateStop::WrongWay);
        // 0.017 rad twice at 1 rad/s.
        assert!((at_s - 0.034).abs() < 2e-3 && deg.abs() < 2.1, "{at_s} {deg}");
        let at_first = |time_s: f64| if time_s < 0.02 { back } else { -back };
        assert!(led(RateLimits::default(), dwell(rate_deg_s), 0.0, &at_first, 1.0).0.is_none());
    }
}

/// The drive is cut where the rotor comes to rest at the end of the travel by the map's coast, to a tick; from outside
/// it is driven back in.
#[test]
fn exact_the_hold_ends_a_coast_before_the_travel_does() {
    let limits = RateLimits { travel: Travel::try_new(-90.0, 180.0).unwrap(), ..RateLimits::default() };
    for (rate_rad_s, mode, end_deg) in [(10.0_f64, DriveMode::B, 180.0), (-10.0, DriveMode::C, -90.0)] {
        let coast_deg = f64::from(map().coast_rad(mode, 10.0)).to_degrees();
        assert!(coast_deg > 0.5, "{coast_deg}");
        let (stopped, deg, _) = led(limits, dwell(rate_rad_s.to_degrees()), 0.0, &|_| rate_rad_s, 2.0);
        assert_eq!(stopped.unwrap().1, RateStop::EndOfTravel);
        let expected = end_deg - rate_rad_s.signum() * coast_deg;
        assert!((deg - expected).abs() < 2e-5 * 573.0, "{deg} {expected}");
        let outside = end_deg + 5.0 * rate_rad_s.signum();
        let back = -rate_rad_s;
        assert!(led(limits, dwell(back.to_degrees()), outside, &|_| back, 0.1).0.is_none());
        assert!(led(limits, dwell(rate_rad_s.to_degrees()), outside, &|_| rate_rad_s, 0.1).0.is_some());
    }
}

/// The time with the drive on is added up, pulses too: at half the rate asked for it is on all the time, and of a rotor
/// that keeps up in pulses a part of it.
#[test]
fn exact_the_hold_ends_after_the_time_that_the_drive_may_be_on() {
    let limits = RateLimits { on_max_nanos: Some(200_000_000), ..RateLimits::default() };
    for (rate_deg_s, turning) in [(100.0, (&|_| 0.87) as Turning), (-5.0, &|_| -0.0873)] {
        let (stopped, _, on_s) = led(limits, dwell(rate_deg_s), 0.0, turning, 20.0);
        assert_eq!(stopped.unwrap().1, RateStop::DrivenTooLong);
        assert!((on_s - 0.2).abs() < 2e-5, "{rate_deg_s}: {on_s}");
    }
}
