//! With tilt, shift and hub left out the tilting motor is the height-only motor.

use motor_model::{
    AmplitudeVariation, DriveCommand, DriveMode, FrictionLaw, ImpactRule, Motor, MotorParams, MotorSetup,
    MotorState, TiltingMotor, TiltingParams, TiltingSetup, TiltingState, TiltingVariation,
};

use super::{height_only, own_stator};

/// From a drop of 20 um both motors go through the same impacts. An impact multiplies a difference by at most 13, its
/// ratio of recoil. At the end of the step each rounds by some 1e-16 of a velocity: 1e-16 * 13^8 = 1e-7 after eight
/// impacts. Located instants differ by the error of the cubic, 3e-13 m at 0.1 m/s, in which a tooth at 3e4 m/s^2 gains
/// 1e-7 m/s: 2e-6 m/s after two impacts.
#[test]
fn dual_without_tilt_it_is_the_height_only_motor() {
    check(&MotorParams::nominal());
}

/// With mode shifts and modal masses of its own as well.
#[test]
fn dual_without_tilt_a_stator_of_its_own_is_the_height_only_motor_s() {
    check(&own_stator().0);
}

fn check(params: &MotorParams) {
    let variation = AmplitudeVariation { pairs: [0.004, -0.006] };
    for friction_law in [FrictionLaw::Coulomb, FrictionLaw::Paper] {
        for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
            let one = MotorSetup { impact_rule, friction_law, variation, ..MotorSetup::with_step(1e-6) };
            let other = height_only(TiltingSetup {
                impact_rule,
                friction_law,
                variation: TiltingVariation::of_pairs(&variation),
                ..TiltingSetup::with_step(1e-6)
            });
            let height_only = Motor::<f64>::try_new(params, &one).expect("valid");
            let tilting =
                TiltingMotor::<f64>::try_new(params, &TiltingParams::nominal(), &other).expect("valid");
            for mode in [DriveMode::B, DriveMode::C] {
                let (mut a, mut b) = (MotorState::default(), TiltingState::default());
                (a.rotor.height_m, b.rotor.height_m) = (20e-6, 20e-6);
                let mut impacts = 0;
                let (most, within) = if impact_rule == ImpactRule::Located { (2, 2e-6) } else { (8, 1e-7) };
                while impacts < most {
                    let command = DriveCommand::full(mode);
                    impacts += height_only.step(&mut a, command).len();
                    tilting.step(&mut b, command);
                    let what = format!("{impact_rule:?} {friction_law:?} {mode:?} {impacts}");
                    assert!((a.rotor.velocity_m_s - b.rotor.velocity_m_s).abs() < within, "{what}");
                    assert!((a.rotor.rate_rad_s - b.rotor.rate_rad_s).abs() < within / 3e-3, "{what}");
                    assert!((a.modes.velocity_m_s - b.modes.velocity_m_s).amax() < within, "{what}");
                    assert!(b.tilt.slope.amax() <= 0.0 && b.shift.displacement_m.amax() <= 0.0, "{what}");
                }
                assert!(a.rotor.rate_rad_s.abs() > 1e-3, "it turns");
            }
        }
    }
}
