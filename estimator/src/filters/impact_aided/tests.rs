use super::*;
use crate::camera::track::Track;
use crate::camera::track_covariance::TrackCovariance as _;
use crate::filters::constant_rate::ConstantRateTuning;
use crate::innovation::{Rejection, Verdict};
use crate::instruments::Instruments;
use crate::tests::{FRAME_NANOS, LDV_NANOS, assert_consistent, frame, nees, quiet_sample};
use motor_model::{Angle, MotorParams};
use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

pub(super) fn tuning<T: Real>() -> ImpactAidedTuning<T> {
    ImpactAidedTuning::new(&MotorParams::nominal(), &Instruments::default())
}

pub(super) fn driven<T: Real>(mode: DriveMode) -> ImpactAided<T> {
    let mut filter = ImpactAided::new(&tuning());
    filter.drive(Time::ZERO, DriveCommand::full(mode));
    filter
}

/// A rotor that follows the filter's assumptions under mode C, measured by a perfect vibrometer: in flight, with a jump
/// of 2 to 8 mm/s every 100 samples and a kick of random sign and normal size at each.
struct Rotor {
    rng: Pcg64,
    n: u64,
    velocity_m_s: f64,
    angle_rad: f64,
    rate_rad_s: f64,
}

impl Rotor {
    fn new(seed: u64) -> Self {
        Self { rng: Pcg64::seed_from_u64(seed), n: 0, velocity_m_s: 0.0, angle_rad: 0.0, rate_rad_s: 0.0 }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// Moves by one sample; the velocity.
    fn step(&mut self) -> LdvSample {
        let tuning = tuning::<f64>();
        self.n += 1;
        self.angle_rad += self.rate_rad_s * 5e-6;
        self.velocity_m_s -=
            (tuning.detector.gravity_m_s2 + tuning.detector.damping_per_s * self.velocity_m_s) * 5e-6;
        let missed = (tuning.missed_rad2_s3[1] * 5e-6).sqrt();
        self.rate_rad_s += missed * self.normal();
        if self.n.is_multiple_of(100) {
            let size: f64 = self.normal();
            let jump = 2e-3 + 6e-3 * (size.abs() / 3.0).min(1.0);
            let threshold = tuning.detector.threshold * tuning.detector.noise_m_s;
            let bound = tuning.kick_per_jump_rad_m * (jump * jump + threshold * threshold).sqrt();
            self.velocity_m_s += jump;
            self.rate_rad_s += tuning.unexplained.sqrt() * bound * self.normal();
        }
        LdvSample { taken_at: Time::from_nanos(self.n * LDV_NANOS), velocity_m_s: self.velocity_m_s as f32 }
    }

    fn frame(&mut self) -> CameraFrame {
        let noise = tuning::<f64>().constant_rate.track.camera_rad2.sqrt() * self.normal();
        frame(self.n / 20, self.angle_rad + noise)
    }
}

/// Mean NEES and NIS of a run of 400 frames.
fn consistency<T: Real>(seed: u64) -> (f64, f64) {
    let mut rotor = Rotor::new(seed);
    let mut filter = driven::<T>(DriveMode::C);
    let (mut nees_mean, mut nis) = (0.0, 0.0);
    for n in 1..=450 {
        for _ in 0..20 {
            filter.update_ldv(&rotor.step());
        }
        let innovation = filter.update_camera(&rotor.frame());
        if n > 50 {
            nis += innovation.normalised_squared().unwrap().to_f64() / 400.0;
            let track = filter.tracker.track().unwrap();
            nees_mean += nees(&track.state, rotor.angle_rad, rotor.rate_rad_s) / 400.0;
        }
    }
    (nees_mean, nis)
}

#[test]
fn law_filter_is_consistent_in_both_precisions() {
    assert_consistent(consistency::<f64>);
    assert_consistent(consistency::<f32>);
}

/// Frames that arrive up to two frames late, after the impacts in between are known, leave the same estimate as frames
/// in time.
#[test]
fn law_late_frames_equal_frames_in_time() {
    for late in [0, 7, 20, 33] {
        let mut rotor = Rotor::new(3);
        let mut in_time = driven::<f64>(DriveMode::C);
        let mut delayed = driven::<f64>(DriveMode::C);
        let mut in_transit = Deque::<(u64, CameraFrame), 8>::new();
        for sample in 1..=8000_u64 {
            let measured = rotor.step();
            in_time.update_ldv(&measured);
            delayed.update_ldv(&measured);
            if sample % 20 == 0 {
                let frame = rotor.frame();
                in_time.update_camera(&frame);
                in_transit.push_back((sample + late, frame)).unwrap();
            }
            if in_transit.front().is_some_and(|(arrives, _)| *arrives <= sample) {
                let (_, frame) = in_transit.pop_front().unwrap();
                delayed.update_camera(&frame);
            }
        }
        for (_, frame) in in_transit {
            delayed.update_camera(&frame);
        }
        let now = Time::from_nanos(8050 * LDV_NANOS);
        let (a, b) = (in_time.estimate(now).unwrap(), delayed.estimate(now).unwrap());
        assert!((a.angle.minus(b.angle).units()).abs() <= 2, "{late}");
        assert!((a.rate_rad_s - b.rate_rad_s).abs() < 1e-9, "{late}");
        assert!((a.angle_rad2 / b.angle_rad2 - 1.0).abs() < 1e-9, "{late}");
        assert!((a.rate_rad2_s2 / b.rate_rad2_s2 - 1.0).abs() < 1e-9, "{late}");
    }
}

/// A vibrometer that shows a fifth too much: a clock that runs back takes nothing of the learnt scale away.
#[test]
fn law_the_learnt_scale_survives_a_clock_that_runs_back() {
    let (mut filter, of_flight) = (driven::<f64>(DriveMode::C), tuning::<f64>().detector);
    // Flights of 4 ms, each begun by a jump of 40 mm/s.
    let bounce = |filter: &mut ImpactAided<f64>, from: u64| {
        let mut free_m_s = 0.02;
        for n in 0..800 {
            let taken_at = Time::from_nanos((from + n) * LDV_NANOS);
            filter.update_ldv(&LdvSample { taken_at, velocity_m_s: (1.2 * free_m_s) as f32 });
            free_m_s -= (of_flight.gravity_m_s2 + of_flight.damping_per_s * free_m_s) * 5e-6;
        }
    };
    let one = LdvSample { taken_at: Time::ZERO, velocity_m_s: 1.0 };
    let scaled = |filter: &ImpactAided<f64>| 1.2 * filter.detector.scaled(&one).velocity_m_s - 1.0;
    for flight in 10..70 {
        bounce(&mut filter, 800 * flight);
    }
    let newest = filter.detector.newest;
    assert!(scaled(&filter).abs() < 0.01, "{}", scaled(&filter));
    bounce(&mut filter, 800);
    assert!(filter.detector.newest < newest);
    assert!(scaled(&filter).abs() < 0.01, "{}", scaled(&filter));
}

/// Without frames the kicks accumulate, to the capacity and beyond. An estimate of the present passes none of
/// them, and equals that through all. The next frame is fused the same way.
#[test]
fn dual_the_kept_track_equals_a_pass_through_all_kicks() {
    let mut rotor = Rotor::new(4);
    let mut filter = driven::<f64>(DriveMode::C);
    let mut frame = rotor.frame();
    for sample in 1..=40_000_u64 {
        filter.update_ldv(&rotor.step());
        if sample % 20 != 0 {
            continue;
        }
        frame = rotor.frame();
        if sample <= 2000 {
            filter.update_camera(&frame);
            continue;
        }
        let Some(track) = filter.tracker.track() else { panic!("a frame has come") };
        let passed = filter.propagated.map_or(track.state.at, |propagated| propagated.at);
        assert!(filter.kicks.iter().all(|kick| kick.at <= passed));
        let again = ImpactAided { propagated: None, ..filter.clone() };
        let now = Time::from_nanos(sample * LDV_NANOS + 10_000);
        let (kept, gone) = (filter.estimate(now).unwrap(), again.estimate(now).unwrap());
        assert!((kept.rate_rad_s - gone.rate_rad_s).abs() < 1e-9, "{kept:?} {gone:?}");
        assert!((kept.angle_rad2 / gone.angle_rad2 - 1.0).abs() < 1e-9, "{kept:?} {gone:?}");
    }
    assert_eq!(filter.kicks.len(), 128);
    let mut again = ImpactAided { propagated: None, ..filter.clone() };
    assert_eq!(filter.update_camera(&frame), again.update_camera(&frame));
    assert_eq!(filter.estimate(frame.exposed_at), again.estimate(frame.exposed_at));
}

/// The first impact's kick in mode B, towards a tooth known to within a width: the friction law on nominal numbers,
/// worked out here from the parameters.
#[test]
fn exact_kick_in_mode_b_is_coulombs() {
    let mut filter = driven::<f64>(DriveMode::B);
    let (mass, inertia, radius) = (46e-6, 4.59e-10, 3.063e-3);
    let ratio: f64 = 3.0 * mass / 10.7e-6;
    // tan 60 degrees: the effective tooth angle is 30 degrees.
    let lever: f64 = (70e-6 + 2.0 * 260e-6) / radius;
    for (before, jump, rate) in [(-0.02, 0.04, 10.0), (0.01, 0.02, -5.0), (-0.05, 0.03, 15.0)] {
        let rise: f64 = before + jump * (1.0 + ratio) / 1.6;
        let slip = lever / 3_f64.sqrt() * rise - radius * rate;
        let limit = 0.4 * mass * radius * radius / inertia * jump;
        let expected = slip.clamp(-limit, limit) / radius;
        filter.ringing = Ringing::default();
        let kick = filter.impact_kick(Time::ZERO, 0.0, before, jump);
        let towards: f64 = kick.tooth_rate_rad_s - rate;
        let got = Real::clamp_magnitude(towards, kick.kick_max_rad_s);
        assert!((got - expected).abs() < 1e-9 * expected.abs(), "{got} {expected}");
    }
}

/// Ringing is known 6 ms after a gap between samples: until then the kick is as uncertain as the ringing. The tooth's
/// rate is known to 1 rad/s, and to what the ringing changes it by within half the time between the samples.
#[test]
fn exact_a_kick_in_mode_b_is_uncertain_until_the_ringing_is_known() {
    let mut filter = driven::<f64>(DriveMode::B);
    filter.impact_kick(Time::from_micros(1000), 10e-6, -0.02, 0.04);
    for (micros, known) in [(1300, false), (6999, false), (7001, true), (7200, true)] {
        let (at, mut ringing, tuning) = (Time::from_micros(micros), filter.ringing, filter.tuning);
        let slope_rad_s2 =
            ringing.impact(&tuning.ringing, at, -0.02 + 0.04 * tuning.approach_per_jump, 0.04).slope_rad_s2;
        let kick = filter.impact_kick(at, 5e-6, -0.02, 0.04);
        let bound_m2_s2 = 0.04 * 0.04 + filter.detector.threshold_m_s().powi(2);
        let unexplained = tuning.unexplained_b * tuning.kick_per_jump_rad_m.powi(2) * bound_m2_s2;
        let expected = if known { 0.0 } else { unexplained };
        assert!((kick.variance_rad2_s2 - expected).abs() < 1e-12 * unexplained, "{micros}: {kick:?}");
        let half_width = 1.0 + 0.5 * 5e-6 * slope_rad_s2;
        assert!(slope_rad_s2 > 0.0 && (kick.half_width_rad_s / half_width - 1.0).abs() < 1e-12, "{kick:?}");
    }
}

/// Over a gap the rate wanders as without a vibrometer, for no longer than it remembers, 12 ms. What rang before is not
/// known after it, and the next impact is as the first one.
#[test]
fn exact_a_gap_is_a_random_walk_of_bounded_length() {
    for (seconds, counted_s) in [(1e-3, 1e-3), (0.5, 12e-3)] {
        let mut filter = driven::<f64>(DriveMode::B);
        let first = filter.clone().impact_kick(Time::from_micros(900), 5e-6, -0.02, 0.04).tooth_rate_rad_s;
        filter.update_camera(&frame(1, 0.0));
        filter.impact_kick(Time::from_micros(600), 5e-6, -0.02, 0.04);
        filter.random_walk_over_gap(Time::from_micros(800), seconds);
        let expected = counted_s * filter.tuning.constant_rate.random_walk.impacted_b_rad2_s3;
        let variance = filter.kicks.back().unwrap().variance_rad2_s2;
        assert!((variance / expected - 1.0).abs() < 1e-12, "{seconds}: {variance} {expected}");
        let next = filter.impact_kick(Time::from_micros(900), 5e-6, -0.02, 0.04).tooth_rate_rad_s;
        assert!((next - first).abs() < 1e-12, "{next} {first}");
    }
}

/// Without samples the variance grows as the constant-rate filter's.
#[test]
fn law_without_vibrometer_it_is_the_constant_rate_filter() {
    let mut aided = driven::<f32>(DriveMode::B);
    let mut plain = crate::ConstantRate::<f32>::new(&ConstantRateTuning::default());
    plain.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    for n in 1..500 {
        let frame = frame(n, 1.5e-3 * n as f64);
        aided.update_camera(&frame);
        plain.update_camera(&frame);
        let now = frame.exposed_at.plus_nanos(FRAME_NANOS);
        assert_eq!(aided.estimate(now), plain.estimate(now));
        assert_eq!(aided.health(now), Health::Degraded(Reason::VibrometerSilent));
    }
    let now = Time::from_nanos(500 * FRAME_NANOS);
    aided.update_ldv(&quiet_sample(now));
    assert_eq!(aided.health(now), Health::Good);
}

#[test]
fn law_duplicates_and_old_frames_change_nothing() {
    let mut rotor = Rotor::new(5);
    let mut filter = driven::<f32>(DriveMode::C);
    let mut frames = [frame(0, 0.0); 100];
    for kept in &mut frames {
        for _ in 0..20 {
            filter.update_ldv(&rotor.step());
        }
        *kept = rotor.frame();
        filter.update_camera(kept);
    }
    let now = Time::from_nanos(102 * FRAME_NANOS);
    let before = filter.estimate(now);
    for (old, why) in [(99, Rejection::Duplicate), (98, Rejection::Duplicate), (0, Rejection::OutOfHorizon)] {
        assert_eq!(filter.update_camera(&frames[old]).verdict, Verdict::Rejected(why));
    }
    for velocity_m_s in [f32::NAN, f32::INFINITY, 5.0] {
        filter.update_ldv(&LdvSample { taken_at: now, velocity_m_s });
    }
    filter.update_ldv(&LdvSample { taken_at: Time::from_micros(50), velocity_m_s: 1.0 });
    assert_eq!(filter.estimate(now), before);
}

/// Twice round at 15 rad/s: the wrap of the camera's angle does not appear in the estimate.
#[test]
fn exact_turns_are_counted() {
    let mut filter = driven::<f32>(DriveMode::B);
    for n in 1..=9000 {
        filter.update_ldv(&quiet_sample(Time::from_nanos(n * FRAME_NANOS - 1)));
        filter.update_camera(&frame(n, 15e-4 * n as f64));
    }
    let estimate = filter.estimate(Time::from_nanos(9000 * FRAME_NANOS)).unwrap();
    let truth = (15e-4 * 9000.0_f64).to_degrees();
    assert!((estimate.angle.degrees() - truth).abs() < 1e-3, "{}", estimate.angle.degrees());
}

/// An event as the property test draws it: time in ns, shifted right by the lowest six bits of the angle's units; units
/// of angle; velocity in m/s; what happens.
type Event = (u64, i64, f32, u8);

/// Passes an event and checks what holds whatever came before: no NaN, variances positive.
fn pass_event(filter: &mut ImpactAided<f32>, (nanos, units, velocity_m_s, what): Event) {
    let at = Time::from_nanos(nanos >> (units & 63));
    match what {
        0 => filter.drive(at, DriveCommand::full(DriveMode::B)),
        1 => filter.drive(at, DriveCommand::OFF),
        2 | 3 => {
            filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
        }
        _ => {
            let innovation = filter.update_camera(&CameraFrame::new(at, Angle::from_units(units)));
            assert!(
                innovation.innovation_rad.is_finite() && innovation.variance_rad2 >= 0.0,
                "{innovation:?}"
            );
        }
    }
    if let Some(Track { state, .. }) = filter.tracker.track() {
        let covariance = &state.covariance;
        assert!(state.rate_rad_s.is_finite());
        assert!(covariance.angle_rad2() > 0.0 && covariance.rate_rad2_s2() > 0.0, "{covariance:?}");
    }
}

/// 2^63 ns without a sample: the rate is a random walk for 292 years, and its variance grows.
#[test]
fn regress_a_gap_of_half_the_clock_leaves_a_positive_variance() {
    let events: [Event; 8] = [
        (0, 0, 0.0, 0),
        (0, 0, 0.0, 0),
        (0, 0, -3.195_363_2e-38, 2),
        (0, 0, 0.0, 4),
        (16_193_862_744_781_330_471, 1_097_035_663_760_865_216, 0.0, 0),
        (2_686_326_889_512_960, 1_601_051_009_893_436_864, -9.455_963e-28, 2),
        (9_226_058_363_744_288_768, 652_600_192_133_976_384, 1.933_545e-33, 3),
        (16_193_862_744_781_330_471, -4_081_433_020_468_379_136, -7.346_117_6e18, 5),
    ];
    let mut filter = ImpactAided::<f32>::new(&tuning());
    for event in events {
        pass_event(&mut filter, event);
        assert!(filter.kicks.iter().all(|kick| kick.variance_rad2_s2 >= 0.0), "{:?}", filter.kicks);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Anything at any time in any order: never NaN, never a panic, variances positive.
    #[test]
    fn law_any_sequence_leaves_a_finite_estimate(
        events in prop::collection::vec((any::<u64>(), any::<i64>(), any::<f32>(), 0..6_u8), 1..200)
    ) {
        let mut filter = ImpactAided::<f32>::new(&tuning());
        for event in events {
            pass_event(&mut filter, event);
        }
    }
}

/// More impacts than the capacity: the track is carried through the oldest, and frames exposed before them are too
/// late.
#[test]
fn law_impacts_beyond_capacity_are_not_forgotten() {
    let mut filter = driven::<f64>(DriveMode::C);
    filter.update_camera(&frame(1, 0.0));
    let start = Time::from_nanos(FRAME_NANOS);
    let kick = |n: u64| ImpactKick::unknown(start.plus_nanos(n * LDV_NANOS), 1.0);
    let before = filter.estimate(start).unwrap().rate_rad2_s2;
    for n in 1..=200 {
        filter.record_kick(kick(n));
    }
    let after = filter.estimate(start.plus_nanos(300 * LDV_NANOS)).unwrap().rate_rad2_s2;
    assert!(after >= before + 200.0, "{before} {after}");
    assert_eq!(filter.update_camera(&frame(2, 0.0)).verdict, Verdict::Rejected(Rejection::OutOfHorizon));
    assert_eq!(filter.update_camera(&frame(15, 0.0)).verdict, Verdict::Used);
}
