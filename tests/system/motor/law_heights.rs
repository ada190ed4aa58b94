//! Nothing tangential acts on the heights: friction turns the rotor, and neither lifts it nor shakes the stator.

use motor_model::{
    AngleAccumulator, DriveCommand, DriveMode, ImpactRule, Motor, MotorParams, MotorSetup, MotorState,
    Parameter,
};

use crate::support::motors::{motor, steps_in};

const STEP_S: f64 = 5e-6;

/// Both modes, full and weak, and a rest: impacts, sustained contacts and landings.
fn schedule() -> impl Iterator<Item = DriveCommand> {
    let stretch = |mode, amplitude, time_s| {
        std::iter::repeat_n(DriveCommand::saturating(mode, amplitude), steps_in(time_s, STEP_S) as usize)
    };
    stretch(DriveMode::B, 1.0, 0.03)
        .chain(stretch(DriveMode::C, 1.0, 0.03))
        .chain(stretch(DriveMode::C, 0.3, 0.03))
        .chain(std::iter::repeat_n(DriveCommand::OFF, steps_in(0.05, STEP_S) as usize))
}

/// With friction or without it, the heights and what the modes do are the same to the bit.
#[test]
fn dual_heights_do_not_depend_on_friction() {
    for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
        let setup = MotorSetup { impact_rule, ..MotorSetup::with_step(STEP_S) };
        let params = MotorParams::nominal();
        let without_friction = params.with(Parameter::Friction, 0.0).expect("within bounds");
        let rough = motor::<f64>(&params, &setup);
        let smooth = Motor::<f64>::try_new(&without_friction, &setup).expect("a valid motor");
        let (mut turning, mut still) = (MotorState::default(), MotorState::default());
        let mut impacts = 0;
        for command in schedule() {
            let (of_rough, of_smooth) = (rough.step(&mut turning, command), smooth.step(&mut still, command));
            assert_eq!(of_rough.len(), of_smooth.len());
            impacts += of_rough.len();
            assert_eq!((turning.modes, turning.in_contact), (still.modes, still.in_contact));
            assert_eq!(
                (turning.rotor.height_m, turning.rotor.velocity_m_s),
                (still.rotor.height_m, still.rotor.velocity_m_s)
            );
        }
        assert!(impacts > 100 && turning.rotor.rate_rad_s.abs() < 1.0, "{impacts}");
        assert!(turning.rotor.angle.angle().degrees().abs() > 1.0, "friction turned the rotor");
        assert_eq!(still.rotor.angle, AngleAccumulator::default());
    }
}
