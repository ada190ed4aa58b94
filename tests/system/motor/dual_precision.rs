//! `f32` against `f64`: the same first impacts, then, chaos having parted them, the same statistics.

use motor_model::{DriveCommand, DriveMode, Impact, MotorSetup, MotorState, Real};

use crate::motor::tool_steady_rates::steady;
use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{changed, motor};

/// An impact with what it left behind.
struct TimedImpact {
    step: u64,
    impact: Impact<f64>,
    rotor_velocity_m_s: f64,
    rate_rad_s: f64,
}

/// The first impacts harder than 20 mm/s of a rotor dropped from 10 um as the drive is switched on.
fn first_impacts<T: Real>(mode: DriveMode, step_s: f64, count: usize) -> Vec<TimedImpact> {
    let motor = motor::<T>(&changed(&[]), &MotorSetup::with_step(step_s));
    let mut state = MotorState::<T>::default();
    state.rotor.height_m = T::from_f64(10e-6);
    let mut found = Vec::new();
    while found.len() < count {
        for impact in &motor.step(&mut state, DriveCommand::full(mode)) {
            if impact.approach_m_s.to_f64() > 0.02 {
                found.push(TimedImpact {
                    step: state.steps,
                    impact: Impact {
                        pair: impact.pair,
                        before_end_s: impact.before_end_s.to_f64(),
                        approach_m_s: impact.approach_m_s.to_f64(),
                        normal_impulse_n_s: impact.normal_impulse_n_s.to_f64(),
                        slip_m_s: impact.slip_m_s.to_f64(),
                        tangential_impulse_n_s: impact.tangential_impulse_n_s.to_f64(),
                        gap_m: impact.gap_m.to_f64(),
                    },
                    rotor_velocity_m_s: state.rotor.velocity_m_s.to_f64(),
                    rate_rad_s: state.rotor.rate_rad_s.to_f64(),
                });
            }
        }
        assert!(state.steps < 10_000_000, "no impacts");
    }
    found
}

/// The first two impacts fall in the same step, on the same pair, with velocities alike to 1e-3: each impact amplifies
/// what it was given by about a hundred, from 1e-7 a step over some thousand steps.
#[test]
fn dual_first_impacts_agree_between_precisions() {
    for mode in [DriveMode::B, DriveMode::C] {
        for step_s in [1e-6, 10e-6] {
            let single = first_impacts::<f32>(mode, step_s, 2);
            let double = first_impacts::<f64>(mode, step_s, 2);
            for (index, (single, double)) in single.iter().zip(&double).enumerate() {
                let what = format!("{mode:?} at {step_s:e} s, impact {index}");
                assert_eq!(single.step, double.step, "{what}");
                assert_eq!(single.impact.pair, double.impact.pair, "{what}");
                let within = Within { rtol: 1e-3, atol: 1e-5 };
                assert_close(single.impact.approach_m_s, double.impact.approach_m_s, within, &what);
                assert_close(single.impact.slip_m_s, double.impact.slip_m_s, within, &what);
                assert_close(single.rotor_velocity_m_s, double.rotor_velocity_m_s, within, &what);
                assert_close(single.rate_rad_s, double.rate_rad_s, within, &what);
            }
        }
    }
}

/// Mean rate and impacts per second over seconds: the precision does not show. The bands are four standard errors of
/// the difference of two means of twelve runs, which scatter by 3 % in B and 1.5 % in C.
#[test]
fn dual_long_run_statistics_agree_between_precisions() {
    for (mode, rate_share, count_share) in [(DriveMode::B, 0.05, 0.05), (DriveMode::C, 0.025, 0.025)] {
        let single = steady::<f32>(mode, 2e-6, 12);
        let double = steady::<f64>(mode, 2e-6, 12);
        assert_close(
            single.rate_rad_s,
            double.rate_rad_s,
            Within::relative(rate_share),
            format_args!("{mode:?} rate"),
        );
        let within = Within::relative(count_share);
        assert_close(single.impacts_per_s, double.impacts_per_s, within, format_args!("{mode:?} impacts"));
    }
}
