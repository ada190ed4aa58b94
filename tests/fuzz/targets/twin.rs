//! Any parameters within bounds, any commands, either rule, in f32: the state stays finite and every impact is one.

#![no_main]

use libfuzzer_sys::fuzz_target;
use motor_model::{
    DriveCommand, DriveMode, FrictionLaw, ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Parameter,
};

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.iter().copied();
    let mut next = || bytes.next();
    let Some(flags) = next() else { return };
    let mut params = MotorParams::nominal();
    for parameter in Parameter::ALL {
        let Some(byte) = next() else { return };
        let spec = parameter.spec();
        // Within an octave of nominal either way, or as it is for a zero byte; beyond the bounds it is left alone.
        let value = spec.nominal * (f64::from(byte.max(1)) / 128.0).max(0.5);
        params = if byte == 0 { params } else { params.with(parameter, value).unwrap_or(params) };
    }
    let setup = MotorSetup {
        impact_rule: if flags & 1 == 0 { ImpactRule::EndOfStep } else { ImpactRule::Located },
        friction_law: if flags & 2 == 0 { FrictionLaw::Coulomb } else { FrictionLaw::Paper },
        ..MotorSetup::with_step([1e-6, 1e-5, 2e-5, 5e-5][usize::from(flags >> 2) % 4])
    };
    let Ok(motor) = Motor::<f32>::try_new(&params, &setup) else { return };
    let mut state = MotorState::default();
    while let (Some(what), Some(amplitude), Some(length)) = (next(), next(), next()) {
        let mode = if what & 1 == 0 { DriveMode::B } else { DriveMode::C };
        let offset_hz = (f32::from(what) - 128.0) * 15.0;
        let command = DriveCommand::saturating(mode, f32::from(amplitude) / 255.0)
            .with_frequency_offset(offset_hz)
            .expect("within 2000 Hz");
        let command = if what & 2 == 0 { command } else { DriveCommand::OFF };
        for _ in 0..u32::from(length) * 4 {
            for impact in motor.step(&mut state, command) {
                assert!(impact.approach_m_s > 0.0 && impact.normal_impulse_n_s >= 0.0);
            }
        }
        let rotor = state.rotor;
        assert!(rotor.height_m.is_finite() && rotor.velocity_m_s.is_finite() && rotor.rate_rad_s.is_finite());
        assert!(state.modes.displacement_m.iter().chain(&state.modes.velocity_m_s).all(|x| x.is_finite()));
    }
});
