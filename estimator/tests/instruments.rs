//! The filters with any instruments, on rotors whose motion is known: without a vibrometer, with bad ones, with slow,
//! coarse and late cameras.
#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "tests fail by panicking, and take their yardsticks from another library"
)]

use std::collections::VecDeque;

use estimator::{
    AngleFilter, CameraDescription, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health,
    ImpactAided, ImpactAidedTuning, Instruments, LdvSample, Reason, TwinFilter, TwinTuning, Verdict,
    VibrometerDescription,
};
use motor_model::{Angle, DriveCommand, DriveMode, MotorParams, Time};
use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

const TICK_NANOS: u64 = 10_000;

/// All three filters for these instruments.
fn filters(instruments: &Instruments) -> Vec<Box<dyn AngleFilter<f32>>> {
    let motor = MotorParams::nominal();
    vec![
        Box::new(ConstantRate::new(&ConstantRateTuning::for_motor(&motor, instruments))),
        Box::new(ImpactAided::new(&ImpactAidedTuning::new(&motor, instruments))),
        Box::new(TwinFilter::try_new(&motor, &TwinTuning::new(&motor, instruments)).unwrap()),
    ]
}

/// A rotor, what drives it, and the camera that shows it.
struct Bench {
    camera: CameraDescription,
    /// Where in its pixel each mark lies when the rotor stands at zero, in steps.
    places: Vec<f64>,
    rng: Pcg64,
    now: Time,
    angle_rad: f64,
    frames: VecDeque<(Time, CameraFrame)>,
    next_frame: Time,
    restarts: u32,
}

impl Bench {
    fn new(camera: CameraDescription, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let places = (0..camera.marks).map(|_| Uniform::new(0.0, 1.0).unwrap().sample(&mut rng)).collect();
        Self {
            camera,
            places,
            rng,
            now: Time::ZERO,
            angle_rad: 0.3,
            frames: VecDeque::new(),
            next_frame: Time::ZERO,
            restarts: 0,
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// The angle in rad that the marks of a rotor at `place_rad` show: the mean of their codes along the arc.
    fn shown_rad(&mut self, place_rad: f64) -> f64 {
        let step_m = self.camera.resolution_m.max(1e-12);
        let mut sum_m = 0.0;
        for mark in 0..self.places.len() {
            let off_m = self.places[mark] * step_m;
            let shown_m = place_rad * self.camera.radius_m + self.camera.noise_m * self.normal();
            sum_m += ((shown_m + off_m) / step_m).round() * step_m - off_m;
        }
        sum_m / (self.places.len() as f64 * self.camera.radius_m)
    }

    /// One tick: the rotor turns at `rate_rad_s`, the filter receives what is due. The vibrometer shows `velocity_m_s`.
    fn tick(
        &mut self,
        filter: &mut dyn AngleFilter<f32>,
        command: DriveCommand,
        rate_rad_s: f64,
        velocity_m_s: Option<f64>,
    ) -> (Option<Estimate<f32>>, Health) {
        self.now = self.now.plus_nanos(TICK_NANOS);
        self.angle_rad += rate_rad_s * 1e-9 * TICK_NANOS as f64;
        filter.drive(self.now, command);
        if let Some(velocity_m_s) = velocity_m_s {
            filter.update_ldv(&LdvSample { taken_at: self.now, velocity_m_s: velocity_m_s as f32 });
        }
        if self.now >= self.next_frame {
            self.next_frame = self.next_frame.plus_nanos(self.camera.period_nanos);
            let shown_rad = self.shown_rad(self.angle_rad);
            let angle = Angle::from_degrees(shown_rad.to_degrees()).wrapped();
            let frame = CameraFrame::new(self.now, angle);
            self.frames.push_back((self.now.plus_nanos(self.camera.latency_nanos), frame));
        }
        while self.frames.front().is_some_and(|(due, _)| *due <= self.now) {
            let Some((_, frame)) = self.frames.pop_front() else { break };
            let restarted = filter.update_camera(&frame).verdict == Verdict::Restarted;
            self.restarts += u32::from(restarted);
        }
        filter.assess(self.now)
    }

    /// Error of an estimate in rad.
    fn error_rad(&self, estimate: &Estimate<f32>) -> f64 {
        let truth = Angle::from_degrees(self.angle_rad.to_degrees());
        estimate.angle.radians_since(truth)
    }
}

/// What a vibrometer shows that cannot be used, at tick n; `None` for no sample.
type Broken = fn(u64) -> Option<f64>;

const BROKEN: [(&str, Broken); 4] = [
    ("lost", |_| None),
    ("zeros", |_| Some(0.0)),
    ("stuck", |_| Some(0.0123)),
    ("not a number", |_| Some(f64::NAN)),
];

/// A rotor that was never driven, then is driven for 20 ms, slides to a stop at 600 rad/s^2 and lies still: every
/// filter calls it at rest within the settling time of its design (60 ms) and the time of the test (0.1 s of a slow
/// camera), with an error within five standard deviations; at a drive it is called moving at once.
#[test]
fn law_rest_is_found_without_a_vibrometer() {
    let fitted = Instruments::default();
    let without = Instruments { vibrometer: None, ..fitted };
    for frame_nanos in [10_000, 100_000, 5_000_000] {
        for (instruments, (name, broken)) in [(fitted, BROKEN[0]), (without, BROKEN[0])]
            .into_iter()
            .chain(BROKEN[1..].iter().map(|broken| (fitted, *broken)))
        {
            let camera = CameraDescription { period_nanos: frame_nanos, ..instruments.camera };
            let instruments = Instruments { camera, ..instruments };
            for (kind, mut filter) in filters(&instruments).into_iter().enumerate() {
                let mut bench = Bench::new(camera, 1);
                let name = format!("{name}, filter {kind}, {frame_nanos} ns");
                let mut rate: f64 = 0.0;
                for n in 0..50_000_u64 {
                    let driven = (20_000..22_000).contains(&n);
                    rate = if driven { 8.0 } else { (rate - 600e-5).max(0.0) };
                    let command = if driven { DriveCommand::full(DriveMode::B) } else { DriveCommand::OFF };
                    let (estimate, health) = bench.tick(filter.as_mut(), command, rate, broken(n));
                    let Some(estimate) = estimate else { continue };
                    let moving = driven || rate > 0.0;
                    assert!(!(moving && estimate.resting), "{name}: at rest while it moves, {n}");
                    if n == 19_999 || n == 49_999 {
                        assert!(estimate.resting, "{name}: not at rest at {n}");
                        let sigma_rad = f64::from(estimate.angle_rad2).sqrt();
                        assert!(bench.error_rad(&estimate).abs() < 5.0 * sigma_rad, "{name}");
                        assert!(sigma_rad < 3e-4, "{name}: {sigma_rad}");
                        assert!(!matches!(health, Health::Unusable(_)), "{name}: {health:?}");
                    }
                    let expected =
                        if instruments.vibrometer.is_none() && n > 10_000 && !moving && estimate.resting {
                            health == Health::Good
                        } else {
                            true
                        };
                    assert!(expected, "{name}: {health:?} without a fault");
                }
            }
        }
    }
}

/// A rotor without friction coasts for ever after a drive: above 1 rad/s it is never called at rest, and a slow one at
/// most for a twentieth of the time.
#[test]
fn law_a_rotor_that_coasts_is_not_at_rest() {
    let instruments = Instruments { vibrometer: None, ..Instruments::default() };
    for (rate, most) in [(8.0, 0.0), (1.5, 0.0), (1.1, 0.0), (0.3, 0.05), (0.1, 0.05)] {
        for (kind, mut filter) in filters(&instruments).into_iter().enumerate() {
            let mut bench = Bench::new(instruments.camera, 2);
            let (mut resting, ticks) = (0_u32, 100_000_u64);
            for n in 0..ticks {
                let command = if n < 1000 { DriveCommand::full(DriveMode::B) } else { DriveCommand::OFF };
                let (estimate, _) = bench.tick(filter.as_mut(), command, rate, None);
                resting += u32::from(estimate.is_some_and(|estimate| estimate.resting));
            }
            let share = f64::from(resting) / ticks as f64;
            assert!(share <= most, "{rate} rad/s, filter {kind}: at rest for {share} of the time");
        }
    }
}

/// A vibrometer with a bias, with ten times the noise, or that shows eight bits: rest is found by the camera, then bias
/// and noise are learnt, and after a later drive of mode B the vibrometer shows quiet again: rest is called sooner than
/// the settling time of 60 ms, and by all filters.
#[test]
fn law_a_bad_vibrometer_is_learnt_at_rest() {
    let fitted = VibrometerDescription { period_nanos: TICK_NANOS, ..VibrometerDescription::default() };
    for (bias, noise, step) in [
        (1e-3, 2e-4, 0.0),
        (3e-3, 2e-4, 0.0),
        (0.01, 2e-4, 0.0),
        (0.05, 2e-4, 0.0),
        (0.0, 2e-3, 0.0),
        (0.0, 1e-2, 0.0),
        (0.0, 2e-4, 1.6e-4),
    ] {
        let described = VibrometerDescription { resolution_m_s: step, ..fitted };
        let instruments = Instruments { vibrometer: Some(described), ..Instruments::default() };
        for (kind, mut filter) in filters(&instruments).into_iter().enumerate() {
            let name = format!("bias {bias}, noise {noise}, step {step}, filter {kind}");
            let mut bench = Bench::new(instruments.camera, 3);
            let mut at_rest_after = None;
            for n in 0..80_000_u64 {
                let driven = (60_000..61_000).contains(&n);
                let command = if driven { DriveCommand::full(DriveMode::B) } else { DriveCommand::OFF };
                let mut shown = bias + noise * bench.normal();
                if driven {
                    shown += 0.05 * (n as f64).sin();
                }
                if step > 0.0 {
                    shown = (shown / step).round() * step;
                }
                let rate = if driven { 5.0 } else { 0.0 };
                let (estimate, _) = bench.tick(filter.as_mut(), command, rate, Some(shown));
                let resting = estimate.is_some_and(|estimate| estimate.resting);
                assert!(!(driven && n > 60_020 && resting), "{name}: at rest while driven");
                assert!(n != 59_999 || resting, "{name}: not at rest");
                if n > 61_000 && resting {
                    at_rest_after = at_rest_after.or(Some(1e-5 * (n - 61_000) as f64));
                }
            }
            assert!(at_rest_after.is_some_and(|seconds| seconds < 0.04), "{name}: {at_rest_after:?}");
        }
    }
}

/// Slow cameras, down to ten frames a second, and late ones, up to 50 ms: a rotor in mode B whose rate follows the law
/// assumed (mean 14 rad/s, standard deviation 4.4, correlation time 12 ms). The turn is kept: no restart, each error
/// less than half a turn. The errors over the reported deviations have a mean square within 0.2 to 2: wide is allowed
/// where the mean rate is not known, too narrow is not. The health between frames is wide, not lost.
#[test]
fn law_slow_and_late_cameras_keep_the_turn() {
    for (period_nanos, latency_nanos) in [
        (5_000_000, 5_000_000),
        (20_000_000, 0),
        (20_000_000, 50_000_000),
        (100_000_000, 0),
        (1_000_000, 50_000_000),
    ] {
        let camera = CameraDescription { period_nanos, latency_nanos, ..CameraDescription::default() };
        let instruments = Instruments { camera, vibrometer: None };
        let (mut square_sum, mut count) = (0.0, 0_u32);
        for seed in 0..8 {
            let mut filter = filters(&instruments).swap_remove(0);
            let mut bench = Bench::new(camera, seed);
            let mut rate = 0.0;
            for n in 0..230_000_u64 {
                let driven = n >= 30_000;
                let kick = 4.4 * (2.0e-5_f64 / 12e-3).sqrt() * bench.normal();
                rate = if driven { rate + (14.0 - rate) * 1e-5 / 12e-3 + kick } else { 0.0 };
                let command = if driven { DriveCommand::full(DriveMode::B) } else { DriveCommand::OFF };
                let (estimate, health) = bench.tick(filter.as_mut(), command, rate, None);
                if n > 60_000 {
                    let estimate = estimate.unwrap();
                    let error_rad = bench.error_rad(&estimate);
                    assert!(error_rad.abs() < 3.1, "{period_nanos} {latency_nanos} {seed}: turn lost");
                    let usable = matches!(
                        health,
                        Health::Good | Health::Degraded(Reason::Uncertain | Reason::NoiseMismatch)
                    );
                    assert!(usable, "{period_nanos} {latency_nanos} {seed} {n}: {health:?}");
                    square_sum += error_rad * error_rad / f64::from(estimate.angle_rad2);
                    count += 1;
                }
            }
            assert_eq!(bench.restarts, 1, "{period_nanos} {latency_nanos} {seed}");
        }
        let mean = square_sum / f64::from(count);
        assert!((0.2..2.0).contains(&mean), "{period_nanos} {latency_nanos}: {mean}");
    }
}

/// Frames of a rotor that lies still at `place_rad`, and the last estimate.
fn at_rest(
    filter: &mut dyn AngleFilter<f32>,
    camera: CameraDescription,
    place_rad: f64,
    frames: u64,
) -> Estimate<f32> {
    let mut bench = Bench::new(camera, 7 + frames);
    for n in 0..frames {
        let shown_rad = bench.shown_rad(place_rad);
        let exposed_at = Time::from_nanos(n * camera.period_nanos);
        filter.drive(exposed_at, DriveCommand::OFF);
        filter.update_camera(&CameraFrame::new(exposed_at, Angle::from_degrees(shown_rad.to_degrees())));
    }
    filter.estimate(Time::from_nanos((frames - 1) * camera.period_nanos)).unwrap()
}

/// Rest is averaged as R / n, whatever the rate of the frames, for one mark and several: but for the forty frames until
/// rest and dither are seen, the walk of w = 1e-12 rad^2/s that is assumed at rest (the filter of a walk has `x coth x`
/// times the variance `R / n`, with `x^2 = n^2 w dt / R`), and a twelfth for ringing; and no better.
#[test]
fn law_rest_is_averaged_at_any_rate_of_frames() {
    for marks in [1, 2, 3, 8] {
        for (period_nanos, frames) in
            [(100_000, 10_000), (1_000_000, 3_000), (5_000_000, 1_500), (20_000_000, 500), (100_000_000, 300)]
        {
            let camera = CameraDescription { period_nanos, marks, ..CameraDescription::default() };
            // With ten frames a second the filters with impacts do not know the turn between two frames.
            let able = if period_nanos > 50_000_000 { 1 } else { 3 };
            for mut filter in filters(&Instruments { camera, vibrometer: None }).into_iter().take(able) {
                let estimate = at_rest(filter.as_mut(), camera, 0.2, frames);
                assert!(estimate.resting, "{period_nanos}");
                let measured_rad2 = f64::from(estimate.angle_rad2) - camera.floor_rad2();
                let counted = frames as f64 - 40.0;
                let off = measured_rad2 * counted / camera.variance_rad2();
                let walked = frames as f64 * (1e-12 * camera.period_s() / camera.variance_rad2()).sqrt();
                let expected = walked / walked.tanh();
                assert!(
                    (0.99 * counted / frames as f64..1.083).contains(&(off / expected)),
                    "{marks} {period_nanos} {frames}: {off} {expected}"
                );
            }
        }
    }
}

/// A coarse camera that is as described is averaged down to the described floor wherever in its cell the rotor lies:
/// what a tolerance is accepted by can be measured.
#[test]
fn law_a_coarse_camera_reaches_its_floor_anywhere_in_a_cell() {
    for resolution_m in [4e-6, 6e-6, 1e-5] {
        let camera = CameraDescription { resolution_m, ..CameraDescription::default() };
        for place in 0..20 {
            let place_rad = 0.2 + resolution_m / camera.radius_m * f64::from(place) / 20.0;
            let mut filter = filters(&Instruments { camera, vibrometer: None }).swap_remove(0);
            let estimate = at_rest(filter.as_mut(), camera, place_rad, 3_000);
            // Frames leave little beside the floor: R / n is at most a seventieth of it.
            let off = f64::from(estimate.angle_rad2) / camera.floor_rad2();
            assert!((1.0..1.1).contains(&off), "{resolution_m} {place}: {off}");
        }
    }
}

/// A coarse camera without dither: the error of a rotor at rest, anywhere in a cell, is honest. Over forty places the
/// mean square of error over deviation is at most 2 (1 expected, forty places of a uniform error give +- 0.15).
#[test]
fn law_the_quantisation_is_never_averaged_away() {
    for (noise_m, resolution_m) in
        [(1e-6, 4e-6), (1e-6, 6e-6), (1e-6, 1e-5), (2e-7, 2e-5), (1e-6, 2e-6), (5e-6, 2e-6)]
    {
        let camera = CameraDescription { noise_m, resolution_m, ..CameraDescription::default() };
        let instruments = Instruments { camera, vibrometer: None };
        let mut square_sum = 0.0;
        for place in 0..40 {
            let mut filter = filters(&instruments).swap_remove(0);
            let mut bench = Bench::new(camera, 100 + place);
            bench.angle_rad = 0.2 + resolution_m / camera.radius_m * place as f64 / 40.0;
            let mut last = None;
            for _ in 0..100_000_u64 {
                last = bench.tick(filter.as_mut(), DriveCommand::OFF, 0.0, None).0;
            }
            let estimate = last.unwrap();
            assert!(estimate.resting, "{noise_m} {resolution_m} {place}");
            square_sum += bench.error_rad(&estimate).powi(2) / f64::from(estimate.angle_rad2);
        }
        let mean = square_sum / 40.0;
        assert!(mean < 2.0, "{noise_m} {resolution_m}: {mean}");
    }
}

/// Noise of a quarter to four times what is assumed: after a second of rest the deviations are honest, to a factor of
/// two in the variance over forty rotors (chi-square of forty: 99.9 % within 0.45 and 1.8).
#[test]
fn law_a_wrong_assumption_of_the_noise_is_corrected() {
    for factor in [0.25, 0.5, 2.0, 4.0] {
        let truth = CameraDescription { resolution_m: 2e-7, ..CameraDescription::default() };
        let assumed = CameraDescription { noise_m: truth.noise_m / factor, ..truth };
        let mut square_sum = 0.0;
        for seed in 0..40 {
            let mut filter = filters(&Instruments { camera: assumed, vibrometer: None }).swap_remove(0);
            let mut bench = Bench::new(truth, seed);
            let mut last = None;
            for _ in 0..100_000_u64 {
                last = bench.tick(filter.as_mut(), DriveCommand::OFF, 0.0, None).0;
            }
            let estimate = last.unwrap();
            assert!(estimate.resting, "{factor} {seed}");
            square_sum += bench.error_rad(&estimate).powi(2) / f64::from(estimate.angle_rad2);
        }
        let mean = square_sum / 40.0;
        assert!((0.3..2.0).contains(&mean), "{factor}: {mean}");
    }
}

prop_compose! {
    /// Any instruments within their bounds, and beyond what the study asks for.
    fn any_instruments()(
        period_nanos in 10_000_u64..100_000_000,
        exposure in 0.0..1.0_f64,
        latency_nanos in 0_u64..1_000_000_000,
        noise_log in -9.0..-3.0_f64,
        resolution_log in -9.0..-3.0_f64,
        radius_log in -4.0..-1.0_f64,
        marks in 1..=16_u8,
        ldv_nanos in 1000_u64..100_000,
        ldv_log in -6.0..0.0_f64,
        range in prop_oneof![Just(0.0), 0.01..100.0_f64],
        step in prop_oneof![Just(0.0), 1e-6..1.0_f64],
        fitted in any::<bool>(),
    ) -> Instruments {
        let power = |x: f64| 10.0_f64.powf(x);
        let camera = CameraDescription {
            period_nanos,
            exposure_nanos: (exposure * period_nanos as f64) as u64,
            latency_nanos,
            noise_m: power(noise_log),
            resolution_m: power(resolution_log),
            radius_m: power(radius_log).clamp(1e-4, 0.1),
            marks,
        };
        let vibrometer = VibrometerDescription {
            period_nanos: ldv_nanos,
            noise_m_s: power(ldv_log),
            bias_max_m_s: 0.0,
            range_m_s: range,
            resolution_m_s: step,
        };
        Instruments { camera, vibrometer: fitted.then_some(vibrometer) }.checked().unwrap()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any instruments, any frames and samples: no panic, finite estimates, positive variances.
    #[test]
    fn law_any_instruments_leave_a_finite_estimate(
        instruments in any_instruments(),
        events in proptest::collection::vec((0_u8..4, 1_u64..3_000_000, any::<i64>(), -0.2..0.2_f32), 1..300),
    ) {
        for mut filter in filters(&instruments) {
            let mut now = Time::ZERO;
            for &(kind, nanos, units, velocity_m_s) in &events {
                now = now.plus_nanos(nanos);
                match kind {
                    0 => filter.drive(now, DriveCommand::full(DriveMode::B)),
                    1 => filter.drive(now, DriveCommand::OFF),
                    2 => drop(filter.update_ldv(&LdvSample { taken_at: now, velocity_m_s })),
                    _ => {
                        let angle = Angle::from_degrees(units as f64 / 1e19 * 360.0).wrapped();
                        let _ = filter.update_camera(&CameraFrame::new(now, angle));
                    }
                }
                if let (Some(estimate), _) = filter.assess(now) {
                    prop_assert!(estimate.rate_rad_s.is_finite());
                    prop_assert!(estimate.angle_rad2 > 0.0 && estimate.angle_rad2.is_finite());
                    prop_assert!(estimate.rate_rad2_s2 > 0.0 && estimate.rate_rad2_s2.is_finite());
                }
            }
        }
    }
}
