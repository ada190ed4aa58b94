//! Filters without a vibrometer, and with bad ones.

use estimator::{CameraDescription, Health, Instruments, Reason, VibrometerDescription};
use motor_model::{DriveCommand, DriveMode};

use crate::bench::{Bench, TICK_NANOS, filters};

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
                    if instruments.vibrometer.is_none() && n > 10_000 && !moving && estimate.resting {
                        // A slow camera has shown few frames of this rest. The bound is a thirtieth of a degree.
                        let thirtieths = 30.0 * f64::from(estimate.angle_rad2).sqrt().to_degrees();
                        match health {
                            Health::Good => assert!(thirtieths < 1.001, "{name}: {thirtieths}"),
                            Health::Degraded(Reason::Uncertain) => assert!(thirtieths > 0.999, "{name}"),
                            other => panic!("{name}: {other:?} without a fault"),
                        }
                    }
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
