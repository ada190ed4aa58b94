//! How long after the drive goes off the rotor lies quiet on the teeth, from the motor's design.
//!
//! ```text
//! launch      v = (1 + e) a w / (1 + r)      one impact of a tooth of speed a w on a slow rotor, r: mass ratio there
//! bounces     t_1 = 2 v / (g (1 - e))        flights of a rotor on teeth at rest: a geometric series of ratio e
//! ring-down   t_2 = ln(a w^2 / g) / (zeta w) from then on the teeth do not throw the rotor
//! quiet after 1.25 max(t_1, t_2)
//! ```
//!
//! A rotor that the ringing teeth throw at t is launched at `v exp(-zeta w t)` at most and lies quiet at `t + t_1
//! exp(-zeta w t)`, which is largest at an end: hence the maximum. The factor 1.25 stands for the differences between
//! motors. Nominal: 60 ms after mode B, 21 ms after mode C. Drawn motors need up to 38 and 8 ms.

use motor_model::{DriveMode, MotorParams, Parameter, math};

/// Bounds in s: a motor without damping or of restitution 1 never lies still.
const BOUNDS_S: (f64, f64) = (0.005, 1.0);
/// What motors of one make differ by.
const MARGIN: f64 = 1.25;

/// Time in ns after which a motor of `params` lies quiet once the drive, which was of `mode`, is off.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 5e6 and 1e9")]
pub(crate) fn settling_nanos(params: &MotorParams, mode: DriveMode) -> u64 {
    let of_mode = |b, c| params.get(if mode == DriveMode::B { b } else { c });
    let frequency_hz = of_mode(Parameter::ModeBFrequency, Parameter::ModeCFrequency);
    let amplitude_m = of_mode(Parameter::ModeBToothAmplitude, Parameter::ModeCToothAmplitude);
    let damping_ratio = of_mode(Parameter::ModeBDampingRatio, Parameter::ModeCDampingRatio);
    let (gravity, restitution) = (params.get(Parameter::Gravity), params.get(Parameter::Restitution));
    let natural_rad_s = core::f64::consts::TAU * frequency_hz;
    let speed_m_s = amplitude_m * natural_rad_s;
    let launch_m_s = (1.0 + restitution) * speed_m_s / (1.0 + params.tooth_mass_ratio());
    let bounces_s = 2.0 * launch_m_s / (gravity * (1.0 - restitution));
    let ring_down_s = math::ln(speed_m_s * natural_rad_s / gravity) / (damping_ratio * natural_rad_s);
    let settled_s = MARGIN * bounces_s.max(ring_down_s);
    let (least_s, most_s) = BOUNDS_S;
    // Written so that NaN becomes the most.
    let settled_s = if settled_s < most_s { settled_s.max(least_s) } else { most_s };
    (1e9 * settled_s) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{DriveCommand, Motor, MotorSetup, MotorState};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Motors drawn about the nominal one, driven for 30 and for 120 ms at full amplitude: after the time that the
    /// nominal design gives, no rotor is faster than 2 mm/s, which is a flight of 0.2 um.
    #[test]
    fn law_drawn_motors_lie_quiet_after_the_time_of_their_design() {
        let design = MotorParams::nominal();
        for (mode, driven_ms) in [(DriveMode::B, 30), (DriveMode::B, 120), (DriveMode::C, 120)] {
            let settled = settling_nanos(&design, mode) / 2_000;
            for seed in 0..20 {
                let params = design.draw(&mut Pcg64::seed_from_u64(seed));
                let motor = Motor::<f64>::try_new(&params, &MotorSetup::with_step(2e-6)).unwrap();
                let mut state = MotorState::default();
                for _ in 0..driven_ms * 500 {
                    motor.step(&mut state, DriveCommand::full(mode));
                }
                for n in 0..settled + 10_000 {
                    motor.step(&mut state, DriveCommand::OFF);
                    let speed_m_s = state.rotor.velocity_m_s.abs();
                    assert!(n < settled || speed_m_s < 2e-3, "{mode:?} {seed} {n} {speed_m_s}");
                }
            }
        }
    }

    /// By hand: 20.72 um at 6.3 kHz are 0.820 m/s, a launch of 0.0944 m/s, bounces of 48.1 ms; mode C rings down in
    /// 17.1 ms. Without damping, gravity or loss the time is the most.
    #[test]
    fn exact_times_of_the_nominal_motor_and_of_motors_that_never_settle() {
        let nominal = MotorParams::nominal();
        for (mode, expected_ms) in [(DriveMode::B, 60.2), (DriveMode::C, 21.3)] {
            let ms = 1e-6 * settling_nanos(&nominal, mode) as f64;
            assert!((ms - expected_ms).abs() < 0.2, "{ms}");
        }
        for (parameter, value) in
            [(Parameter::Restitution, 1.0), (Parameter::Gravity, 0.0), (Parameter::ModeBDampingRatio, 0.0)]
        {
            let motor = nominal.with(parameter, value).unwrap();
            assert_eq!(settling_nanos(&motor, DriveMode::B), 1_000_000_000, "{parameter:?}");
        }
    }
}
