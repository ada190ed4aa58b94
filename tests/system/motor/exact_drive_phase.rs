//! The phase of the drive: an integer that stands still while the drive is off and never jumps.

use motor_model::{DriveCommand, DriveMode, DriveTuning, MotorParams, MotorSetup, MotorState, Phase};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{command, motor};

#[expect(clippy::cast_precision_loss, reason = "1e-16 of a turn")]
fn turns(phase: Phase) -> f64 {
    phase.units() as f64 / 18_446_744_073_709_551_616.0
}

/// `actual` and `expected` turns apart, whole turns dropped.
fn apart(actual: f64, expected: f64) -> f64 {
    let difference = actual - expected;
    difference - difference.round()
}

#[test]
fn exact_phase_stands_still_while_off_and_runs_on_through_changes() {
    let schedule = [
        (command(DriveMode::B, 1.0, 0.0), 6300.0, 1234_u32),
        (DriveCommand::OFF, 0.0, 777),
        (command(DriveMode::B, 0.5, 100.25), 6400.25, 4321),
        (command(DriveMode::C, 0.5, -1999.5), 5460.5, 99),
        (DriveCommand::OFF, 0.0, 1),
        // No amplitude is not off: the generator runs.
        (command(DriveMode::C, 0.0, 0.0), 7460.0, 1001),
    ];
    for step_s in [0.25e-6, 1e-6, 10e-6, 50e-6] {
        let motor = motor::<f64>(&MotorParams::nominal(), &MotorSetup::with_step(step_s));
        let mut state = MotorState::default();
        let mut expected = 0.0;
        for (command, hz, steps) in schedule {
            let before = state.phase;
            for _ in 0..steps {
                motor.step(&mut state, command);
            }
            if command.mode().is_none() {
                assert_eq!(state.phase, before, "the phase stands still while off");
            }
            expected += hz * step_s * f64::from(steps);
            let what = format!("{command:?}");
            assert_close(apart(turns(state.phase), expected), 0.0, Within::absolute(1e-11), what);
        }
        assert_eq!(state.steps, schedule.iter().map(|entry| u64::from(entry.2)).sum::<u64>());
    }
}

/// Both precisions count the same integers at the nominal frequency, so twin and plant never drift apart.
#[test]
fn exact_phase_is_the_same_integer_in_both_precisions() {
    let setup = MotorSetup {
        tuning: DriveTuning::Fixed { b_hz: 6301.7, c_hz: 7455.0 },
        ..MotorSetup::with_step(3e-6)
    };
    let (single, double) =
        (motor::<f32>(&MotorParams::nominal(), &setup), motor::<f64>(&MotorParams::nominal(), &setup));
    let (mut single_state, mut double_state) = (MotorState::default(), MotorState::default());
    for command in [DriveCommand::full(DriveMode::B), DriveCommand::OFF, DriveCommand::full(DriveMode::C)] {
        for _ in 0..10_000 {
            single.step(&mut single_state, command);
            double.step(&mut double_state, command);
        }
        assert_eq!(single_state.phase, double_state.phase);
    }
    let expected = (6301.7 + 7455.0) * 0.03;
    assert_close(apart(turns(double_state.phase), expected), 0.0, Within::absolute(1e-11), "fixed tuning");
}
