use crate::constant_rate::WanderTuning;
use motor_model::{Angle, DriveMode};
use proptest::prelude::*;

use super::*;

fn filter<T: Real>() -> TwinFilter<T> {
    let params = MotorParams::nominal();
    TwinFilter::try_new(&params, &TwinTuning::new(&params)).unwrap()
}

/// A rotor in free flight turns steadily: samples of a fall at 9.81 m/s^2, and frames. Impacts under which the rate stays would be no rotor's, and the filter says so.
fn run(filter: &mut TwinFilter<f64>, micros: core::ops::Range<u64>) {
    for n in (micros.start..micros.end).step_by(5) {
        let at = Time::from_micros(n);
        let velocity = 2e-3 - 9.81e-6 * n as f64;
        filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s: velocity as f32 });
        if n % 100 == 0 {
            show(filter, n);
        }
    }
}

/// The frame of an instant.
fn show(filter: &mut TwinFilter<f64>, micros: u64) {
    let exposed_at = Time::from_micros(micros);
    filter.update_camera(&CameraFrame { exposed_at, angle: Angle::from_degrees(1e-4 * micros as f64) });
}

#[test]
fn law_the_estimate_needs_a_frame_and_the_health_follows_the_vibrometer() {
    let mut filter = filter::<f64>();
    assert_eq!(filter.health(Time::ZERO), Health::Waiting);
    assert!(filter.estimate(Time::ZERO).is_none() && filter.scales().is_none());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::C));
    run(&mut filter, 5..20_000);
    let (now, later) = (Time::from_micros(20_000), Time::from_micros(21_100));
    assert_eq!(filter.health(now), Health::Good);
    (20_100..=21_000).step_by(100).for_each(|n| show(&mut filter, n));
    assert_eq!(filter.health(later), Health::Degraded(Reason::VibrometerSilent));
    run(&mut filter, 23_000..30_000);
    assert_eq!(filter.health(Time::from_micros(30_000)), Health::Good);
}

/// Without samples the rate wanders as in the simplest filter: so does its variance.
#[test]
fn dual_a_silent_vibrometer_leaves_the_simplest_filter_s_noise() {
    let mut filter = filter::<f64>();
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    run(&mut filter, 5..20_000);
    let heard_until = Time::from_micros(19_995 + 50);
    let (near, far) =
        (filter.estimate(heard_until).unwrap(), filter.estimate(heard_until.plus_nanos(1_000_000)).unwrap());
    let grown = far.rate_rad2_s2 - near.rate_rad2_s2;
    let intensity = WanderTuning::<f64>::default().struck_b_rad2_s3;
    assert!((grown - intensity * 1e-3).abs() < 1e-6, "{grown}");
}

/// One thing that a filter can be told.
#[derive(Clone, Copy, Debug)]
enum Told {
    Sample(f32),
    Frame(f64),
    Drive(Option<DriveMode>, f32),
}

fn told() -> impl Strategy<Value = Told> {
    let wild = prop_oneof![
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(-f32::INFINITY),
        Just(f32::MAX),
        Just(1e-40),
        Just(0.0),
        -2.5..2.5_f32
    ];
    let mode = prop_oneof![Just(None), Just(Some(DriveMode::B)), Just(Some(DriveMode::C))];
    prop_oneof![
        20 => (-0.1..0.1_f32).prop_map(Told::Sample),
        4 => wild.prop_map(Told::Sample),
        4 => (-400.0..400.0_f64).prop_map(Told::Frame),
        1 => (mode, 0.0..1.0_f32).prop_map(|(mode, amplitude)| Told::Drive(mode, amplitude)),
    ]
}

/// Plays a sequence in which most times are 5 us apart, some run back, repeat or leap.
fn play<T: Real>(script: &[(Told, u8, u64)]) -> TwinFilter<T> {
    let (mut filter, mut at) = (filter::<T>(), Time::from_micros(10_000));
    for &(told, kind, nanos) in script {
        at = match kind {
            0 => Time::from_nanos(at.nanos().saturating_sub(nanos)),
            1 => at.plus_nanos(nanos),
            2 => at,
            3 => at.plus_nanos(nanos * 1000),
            _ => at.plus_nanos(5000),
        };
        match told {
            Told::Sample(velocity_m_s) => {
                filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
            }
            Told::Frame(degrees) => {
                filter.update_camera(&CameraFrame { exposed_at: at, angle: Angle::from_degrees(degrees) });
            }
            Told::Drive(mode, amplitude) => {
                let command =
                    mode.map_or(DriveCommand::OFF, |mode| DriveCommand::saturating(mode, amplitude));
                filter.drive(at, command);
            }
        }
        if let Some(estimate) = filter.estimate(at) {
            let numbers =
                [estimate.rate_rad_s, estimate.angle_rad2, estimate.angle_rate_rad2_s, estimate.rate_rad2_s2];
            assert!(numbers.iter().all(|x| x.to_f64().is_finite()), "{estimate:?}");
            assert!(estimate.angle_rad2 > T::zero() && estimate.rate_rad2_s2 > T::zero(), "{estimate:?}");
        }
    }
    filter
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 200, ..ProptestConfig::default() })]

    /// Whatever it is told, in whatever order, the estimate is a number with positive variances, and the stator is one.
    #[test]
    fn law_the_estimate_is_finite_whatever_is_told(
        script in proptest::collection::vec((told(), 0..30_u8, 0..3_000_000_u64), 1..300)
    ) {
        prop_assert!(play::<f32>(&script).stator.is_sound());
        prop_assert!(play::<f64>(&script).stator.is_sound());
    }
}
