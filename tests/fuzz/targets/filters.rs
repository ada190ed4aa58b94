//! Any samples, frames and drives at any times, to each of the filters in both precisions: estimates stay finite, with
//! a covariance that is one.

#![no_main]

use estimator::{AngleFilter, CameraFrame, Estimate, LdvSample};
use libfuzzer_sys::fuzz_target;
use motor_model::{Angle, DriveCommand, DriveMode, Real, Time};
use simulation::Scene;
use simulation::runs::filter::{AnyFilter, FILTERS};

/// Most inputs of a run, of 3 bytes or more each: a second of samples and frames takes a filter half a second.
const INPUTS_MAX: usize = 2_000;

/// A time after `at`, or before: as in a laboratory for half of the bytes, and as it never is for the others.
fn moved(at: Time, kind: u8, amount: u8) -> Time {
    let nanos = u64::from(amount);
    match kind % 8 {
        0 => Time::from_nanos(at.nanos().saturating_sub(nanos * 1_000)),
        1 => Time::from_nanos(at.nanos().saturating_sub(nanos * 10_000_000)),
        2 => at,
        3 => at.plus_nanos(nanos * 1_000_000_000_000),
        4 => at.plus_nanos(nanos * 100_000),
        _ => at.plus_nanos(5_000),
    }
}

fn assert_sound<T: Real>(estimate: &Estimate<T>) {
    let [rate, angle2, both, rate2] =
        [estimate.rate_rad_s, estimate.angle_rad2, estimate.angle_rate_rad2_s, estimate.rate_rad2_s2]
            .map(Real::to_f64);
    assert!(rate.is_finite() && both.is_finite(), "{estimate:?}");
    assert!(angle2 > 0.0 && angle2.is_finite() && rate2 > 0.0 && rate2.is_finite(), "{estimate:?}");
    // Of single precision.
    assert!(both * both <= angle2 * rate2 * 1.001, "{estimate:?}");
}

fn feed<T: Real>(filter: &mut dyn AngleFilter<T>, mut bytes: impl Iterator<Item = u8>) {
    let mut at = Time::from_micros(10_000);
    for _ in 0..INPUTS_MAX {
        let (Some(what), Some(kind), Some(amount)) = (bytes.next(), bytes.next(), bytes.next()) else {
            return;
        };
        at = moved(at, kind, amount);
        let mut four = || [0; 4].map(|_: u8| bytes.next().unwrap_or_default());
        match what % 8 {
            0 => {
                let degrees = f64::from(f32::from_le_bytes(four()));
                let angle = if degrees.is_finite() { degrees.clamp(-1e6, 1e6) } else { 0.0 };
                filter.update_camera(&CameraFrame::new(at, Angle::from_degrees(angle)));
            }
            1 => {
                let mode = [None, Some(DriveMode::B), Some(DriveMode::C)][usize::from(amount) % 3];
                let amplitude = f32::from(what) / 255.0;
                let command =
                    mode.map_or(DriveCommand::OFF, |mode| DriveCommand::saturating(mode, amplitude));
                filter.drive(at, command);
            }
            2 => {
                let velocity_m_s = f32::from_le_bytes(four());
                filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
            }
            _ => {
                // The velocities of a motor, up to 0.13 m/s.
                let velocity_m_s = (f32::from(what) - 128.0) * 1e-3 + f32::from(amount) * 1e-6;
                filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
            }
        }
        for instant in [at, at.plus_nanos(100_000)] {
            let (estimate, _) = filter.assess_for(at, instant);
            estimate.iter().for_each(assert_sound);
            filter.smoothed(instant).iter().for_each(assert_sound);
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((which, bytes)) = bytes.split_first() else { return };
    let (name, scene) = (FILTERS[usize::from(which >> 1) % FILTERS.len()], Scene::default());
    let inputs = bytes.iter().copied();
    if which & 1 == 0 {
        feed(&mut AnyFilter::<f32>::named(name, &scene).expect("the nominal motor"), inputs);
    } else {
        feed(&mut AnyFilter::<f64>::named(name, &scene).expect("the nominal motor"), inputs);
    }
});
