//! What a move is said to take, against the frames and the variance that it needs.

use super::*;
use estimator::{CameraDescription, VibrometerDescription};

fn instruments(frames_per_s: u64) -> Instruments {
    let period_nanos = 1_000_000_000 / frames_per_s;
    let camera =
        CameraDescription { period_nanos, latency_nanos: period_nanos, ..CameraDescription::default() };
    Instruments { camera, vibrometer: Some(VibrometerDescription::default()) }
}

fn forecast(frames_per_s: u64, distance_deg: f32, tolerance_mdeg: f32) -> Result<MoveForecast, Unreachable> {
    let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
    let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
    MoveForecast::try_new(
        &instruments(frames_per_s),
        ResponseMap::table_1(),
        &limits,
        distance_deg.to_radians(),
        tolerance_rad,
    )
}

/// Frames of two marks of 17 milli-degrees each: to 0.452 of a tolerance of 1, less the floor of two marks of 0.05,
/// and 1.3 times as many.
#[test]
fn exact_frames_of_the_default_camera() {
    let seen = forecast(10_000, 37.0, 1.0).unwrap();
    let frame_mdeg = 1e3 * (2e-6_f64 / 3.9e-3).to_degrees() / 6_f64.sqrt();
    let needed_mdeg2 = (0.95_f64 / 2.1).powi(2) - 0.0478_f64.powi(2) / 2.0;
    let expected = 1.3 * frame_mdeg * frame_mdeg / needed_mdeg2;
    assert!((f64::from(seen.frames) / expected - 1.0).abs() < 2e-3, "{} {expected}", seen.frames);
    assert!((f64::from(seen.measuring_s) - 1e-4 * expected).abs() < 1e-3 * expected * 1e-4 + 1e-3);
}

/// The variance of a rotor at rest, by its differential equation in steps of a frame: the frames until it is the
/// one wanted, and never below the square root of growth and information.
#[test]
fn dual_frames_against_the_variance_frame_by_frame() {
    let camera = CameraDescription { marks: 8, ..CameraDescription::default() };
    let (frame_rad2, period_s) = (camera.variance_rad2(), camera.period_s());
    let least_rad2 = (RESTING_GROWTH_RAD2_S * frame_rad2 * period_s).sqrt();
    for part in [1.1, 1.5, 3.0, 30.0, 1000.0] {
        let wanted_rad2 = part * least_rad2;
        let (mut rad2, mut count) = (frame_rad2, 1_u32);
        while rad2 > wanted_rad2 {
            let predicted_rad2 = rad2 + RESTING_GROWTH_RAD2_S * period_s;
            rad2 = predicted_rad2 * frame_rad2 / (predicted_rad2 + frame_rad2);
            count += 1;
        }
        let found = f64::from(frames(frame_rad2 as f32, period_s as f32, wanted_rad2 as f32).unwrap());
        // A frame more or less, and single precision.
        assert!((found - f64::from(count)).abs() < 2.0 + 2e-3 * found, "{part}: {found} {count}");
    }
    assert_eq!(frames(frame_rad2 as f32, period_s as f32, 0.99 * least_rad2 as f32), None);
}

/// A tenth of a milli-degree: refused with two marks, whose floor is too high for it, and told with eight. It takes
/// four times as long as twice that, and more: approaches begin again.
#[test]
fn law_a_tenth_of_a_milli_degree_is_told_or_refused() {
    let refused = forecast(10_000, 5.0, 0.1).unwrap_err();
    let least_mdeg = 1e3 * refused.least_rad.unwrap().to_degrees();
    // Twice the floor in variances, of 0.0338 milli-degrees, is 0.0478: times 2.1 / 0.95, 0.1057. At the shortest
    // step no approach begins again, and 17 s are enough.
    assert!((0.1057..0.1423).contains(&least_mdeg), "{least_mdeg}");
    let camera = CameraDescription { marks: 8, ..CameraDescription::default() };
    let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
    let of = |tolerance_mdeg: f32| {
        let instruments = Instruments { camera, ..Instruments::default() };
        let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
        MoveForecast::try_new(&instruments, ResponseMap::table_1(), &limits, 0.1, tolerance_rad).unwrap()
    };
    let (fine, coarse) = (of(0.1), of(0.2));
    assert!(fine.measuring_s > 4.0 * coarse.measuring_s, "{fine:?} {coarse:?}");
    assert!(fine.time_95_s() - fine.time_s > fine.measuring_s, "{fine:?}");
}

/// A finer tolerance, slower frames and a longer way take longer.
#[test]
fn law_time_grows_with_what_is_asked() {
    let time_s = |frames_per_s, distance_deg, tolerance_mdeg| {
        forecast(frames_per_s, distance_deg, tolerance_mdeg).unwrap().time_s
    };
    for distance_deg in [-90.0, -1.0, -0.05, 0.05, 1.0, 90.0] {
        assert!(time_s(10_000, distance_deg, 0.5) > time_s(10_000, distance_deg, 1.0));
        assert!(time_s(1_000, distance_deg, 5.0) > time_s(10_000, distance_deg, 5.0));
        assert!(time_s(200, 4.0 * distance_deg, 50.0) >= time_s(200, distance_deg, 50.0));
    }
}

/// The tolerance that is offered instead can be met, and a little less cannot be met in time.
#[test]
fn law_what_is_offered_instead_is_the_least() {
    let refused = forecast(200, 37.0, 0.5).unwrap_err();
    let least_mdeg = 1e3 * refused.least_rad.unwrap().to_degrees();
    assert!(least_mdeg > 0.5, "{least_mdeg}");
    let offered = forecast(200, 37.0, least_mdeg).unwrap();
    assert!(offered.time_95_s() <= 30.0 && offered.time_95_s() > 29.0, "{offered:?}");
}

/// What would last longer than the deadline in more than one move of twenty is refused, and every rest takes longer
/// without a vibrometer.
#[test]
fn law_a_promise_holds_before_the_deadline() {
    // 30 frames a second to a milli-degree: 920 frames in 30.6 s.
    assert!(forecast(30, 1.0, 1.0).is_err());
    let accepted = forecast(200, 1.0, 1.0).unwrap();
    assert!(accepted.time_s < accepted.time_95_s() && accepted.time_95_s() <= 30.0);
    let camera_only = Instruments { vibrometer: None, ..instruments(10_000) };
    // The mean move ends before this deadline, and not 95 % of them.
    let between_s = 0.5 * (accepted.time_s + accepted.time_95_s());
    let limits = Limits { deadline_nanos: (1e9 * between_s) as u64, ..Limits::default() };
    let (distance_rad, tolerance_rad) = (1_f32.to_radians(), 1e-3_f32.to_radians());
    let map = ResponseMap::table_1();
    assert!(MoveForecast::try_new(&instruments(200), map, &limits, distance_rad, tolerance_rad).is_err());
    let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
    let alone =
        MoveForecast::try_new(&camera_only, ResponseMap::table_1(), &limits, 0.1, tolerance_rad).unwrap();
    let both = forecast(10_000, 0.1_f32.to_degrees(), 1.0).unwrap();
    // Five rests and more, each by 15 ms.
    assert!(alone.time_s - both.time_s >= 0.075 - 1e-3, "{} {}", alone.time_s, both.time_s);
}

/// A camera of coarse steps and little noise has a floor: no time is enough for less.
#[test]
fn law_the_floor_refuses_whatever_the_deadline() {
    let camera = CameraDescription { resolution_m: 4e-6, ..CameraDescription::default() };
    let coarse = Instruments { camera, ..Instruments::default() };
    let limits = Limits { deadline_nanos: 86_400_000_000_000, ..Limits::default() };
    let of = |tolerance_mdeg: f32| {
        let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
        MoveForecast::try_new(&coarse, ResponseMap::table_1(), &limits, 0.6, tolerance_rad)
    };
    let least_mdeg = 1e3 * of(1.0).unwrap_err().least_rad.unwrap().to_degrees();
    // The floor of two marks of 3.86 milli-degrees each, twice in variances, over 0.95 / 2.1.
    assert!((least_mdeg / (3.86 * 2.1 / 0.95) - 1.0).abs() < 0.02, "{least_mdeg}");
    assert!(of(1.01 * least_mdeg).is_ok() && of(0.99 * least_mdeg).is_err());
}

/// Where frames come too late for a cruise.
fn late_frames() -> PositioningTuning {
    PositioningTuning { frame_wait_nanos: 10_000_000_000, ..PositioningTuning::default() }
}

/// The drives of a way are as long as the map has them. One burst brings a rotor from here to where it is near enough.
#[test]
fn exact_a_burst_takes_the_time_of_the_map() {
    let map = ResponseMap::table_1();
    for distance_rad in [-1e-3_f32, -0.02, 1e-4] {
        let way = way(map, &late_frames(), distance_rad, 0.95 * distance_rad.abs(), |_| 0.0).unwrap();
        let mode = if distance_rad > 0.0 { DriveMode::B } else { DriveMode::C };
        let (_, burst) = burst(map, mode, 1.0, distance_rad.abs()).unwrap();
        assert_eq!((way.drives, way.drive_s.to_bits()), (1, burst.seconds().to_bits()), "{distance_rad}");
    }
}

/// Far away the longest bursts lead there, and their time spreads over motors as their turn.
#[test]
fn exact_the_time_of_far_bursts_spreads_as_their_turn() {
    let map = ResponseMap::table_1();
    let longest = map.burst(Family::Throw, f32::INFINITY, 1.0).unwrap();
    // Nine of them, and one and a half are left.
    let distance_rad = 10.5 * longest.turn_rad;
    let way = way(map, &late_frames(), distance_rad, 0.99 * distance_rad, |_| 1.0).unwrap();
    let expected_s = 9.0 * (longest.seconds() + 1.0) * longest.motors_sd_rad / longest.turn_rad;
    assert_eq!(way.drives, 9);
    assert!((way.far_sd_s / expected_s - 1.0).abs() < 1e-5, "{} {expected_s}", way.far_sd_s);
}

/// Three ways by the strongest cruise end alike: their times differ by the cruise. The drive of each is that and the
/// same bursts, so that the second difference of the squared spreads is that of the squared times of the cruises, a
/// fifth of which is the spread over motors.
#[test]
fn exact_the_time_of_a_cruise_spreads_by_a_fifth() {
    let ways = [1.0, 2.0, 3.0].map(|part| forecast(10_000, 1200.0 * part, 1.0).unwrap());
    let rate_rad_s = ResponseMap::table_1().strongest_cruise(DriveMode::B, 1.0).unwrap().rate_rad_s;
    let cruise_s = 1200_f32.to_radians() / rate_rad_s;
    let [near, middle, far] = ways.map(|way| way.time_s);
    assert!((far - middle - cruise_s).abs() < 1e-4 && (middle - near - cruise_s).abs() < 1e-4, "{ways:?}");
    let [near, middle, far] = ways.map(|way| way.time_sd_s * way.time_sd_s);
    let expected_s2 = 0.2 * 0.2 * 2.0 * cruise_s * cruise_s;
    assert!(((far - 2.0 * middle + near) / expected_s2 - 1.0).abs() < 1e-3, "{ways:?}");
}

/// A drive that may be on for a part of its cruise at a time is cut: four times in a cruise of four and a half such
/// times, with a look of 1 s after each. One that may be on for all of it is not.
#[test]
fn exact_a_cruise_is_cut_where_the_drive_may_be_on_no_longer() {
    let of = |on_max_s: f64| {
        let on_max_nanos = (1e9 * on_max_s) as u64;
        let limits = Limits { on_max_nanos, ..Limits::default() };
        let tuning = PositioningTuning { limits, ..PositioningTuning::default() };
        way(ResponseMap::table_1(), &tuning, 6.0, 1.0, |_| 1.0).unwrap()
    };
    let whole = of(20.0);
    let cruise_s = f64::from(whole.drive_s);
    for (on_max_s, cuts) in [(1.01 * cruise_s, 0), (cruise_s / 4.5, 4)] {
        let cut = of(on_max_s);
        assert_eq!((cut.drives, cut.look_s.to_bits()), (1 + cuts, whole.look_s.to_bits()));
        assert_eq!(cut.drive_s.to_bits(), (whole.drive_s + real(cuts)).to_bits());
    }
}

/// Nearer than a cruise is driven from, bursts lead to the target: the way is that of a camera too slow for a cruise.
#[test]
fn dual_a_near_target_is_reached_by_bursts() {
    let map = ResponseMap::table_1();
    let of = |tuning: &PositioningTuning, distance_rad| {
        let way = way(map, tuning, distance_rad, 1e-5, |_| 1.0).unwrap();
        (way.drives, way.drive_s.to_bits(), way.look_s.to_bits())
    };
    for (mode, along) in [(DriveMode::B, 1.0), (DriveMode::C, -1.0)] {
        let from_rad = map.cruise_from_rad(mode);
        for part in [1e-3, 0.1, 0.99] {
            let distance_rad = along * part * from_rad;
            assert_eq!(
                of(&PositioningTuning::default(), distance_rad),
                of(&late_frames(), distance_rad),
                "{part}"
            );
        }
        let far_rad = 30.0 * along * from_rad;
        assert_ne!(of(&PositioningTuning::default(), far_rad), of(&late_frames(), far_rad));
    }
}

/// A rotor that is at the target already comes to rest and is measured, and nothing else.
#[test]
fn exact_a_rotor_at_the_target_is_measured() {
    let there = forecast(10_000, 0.0, 1.0).unwrap();
    // Rest is concluded 20 ms after a drive, by six frames and the wait for one: two periods.
    let rest_s = 0.02 + 8e-4;
    assert_eq!(there.drives, 0);
    assert!((there.time_s - there.measuring_s - rest_s).abs() < 2e-4, "{there:?}");
}
