//! Mode B turns the tilting rotor clockwise, mode C counter-clockwise, as the paper's motor does.

use motor_model::{DriveCommand, DriveMode, Freedom, TiltingSetup, TiltingState};

use super::{UNEQUAL, motor, slow_in_b, tilting};
use crate::support::motors::{changed, steps_in};

/// Half a second in either mode, four at a tight hub. There mode B turns backwards a third of the time: its mean over
/// half a second is 1 +- 0.5 rad/s, and over four seconds more than five deviations from none.
#[test]
fn law_sense_of_rotation() {
    let nominal = (changed(&[]), tilting(&[]));
    for (what, sets, freedom, time_s) in [
        ("nominal", nominal, Freedom::Full, 0.6),
        ("nominal", nominal, Freedom::WithoutShift, 0.6),
        ("tight hub", slow_in_b(), Freedom::Full, 4.0),
    ] {
        for (mode, sign) in [(DriveMode::B, 1.0), (DriveMode::C, -1.0)] {
            let motor =
                motor(&sets, &TiltingSetup { freedom, variation: UNEQUAL, ..TiltingSetup::with_step(2e-6) });
            let mut state = TiltingState::<f64>::default();
            for _ in 0..steps_in(time_s, 2e-6) {
                motor.step(&mut state, DriveCommand::full(mode));
            }
            let turned = state.rotor.angle.angle().degrees();
            assert!(sign * turned > 5.0, "{what} {freedom:?} {mode:?}: {turned} degrees");
        }
    }
}
