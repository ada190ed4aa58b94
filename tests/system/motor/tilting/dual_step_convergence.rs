//! The error of the step: located contacts converge with the second order or better, as long as the same contacts
//! happen.

use motor_model::{DriveCommand, DriveMode, TiltingSetup, TiltingState};

use super::{Sets, UNEQUAL, motor, slow_in_b};
use crate::support::motors::steps_in;

/// Height after 1.28 ms of mode B, from a drop of 2 um onto teeth that begin to move, and the number of impacts.
fn end((params, tilting): &Sets, step_s: f64) -> (f64, u32) {
    let motor =
        motor(&(*params, *tilting), &TiltingSetup { variation: UNEQUAL, ..TiltingSetup::with_step(step_s) });
    let mut state = TiltingState::<f64>::default();
    state.rotor.height_m = 2e-6;
    state.tilt.slope.x = 0.5e-3;
    let mut impacts = 0;
    for _ in 0..steps_in(1.28e-3, step_s) {
        impacts +=
            u32::try_from(motor.step(&mut state, DriveCommand::full(DriveMode::B)).len()).expect("few");
    }
    (state.rotor.height_m, impacts)
}

/// Against steps of 0.1 us. Half the step gives a quarter of the error at most.
#[test]
fn dual_located_contacts_converge_with_the_second_order() {
    let sets = slow_in_b();
    let (exact, impacts) = end(&sets, 1e-7);
    assert!(impacts >= 3, "{impacts}");
    let errors = [4e-6, 2e-6, 1e-6].map(|step_s| {
        let (height, same) = end(&sets, step_s);
        assert_eq!(same, impacts, "{step_s}");
        (height - exact).abs()
    });
    let [coarse, middle, fine] = errors;
    assert!(middle <= 0.25 * coarse, "{errors:?}");
    assert!(fine <= 0.25 * middle, "{errors:?}");
    // The error of an instant, 3e-11 m for the cubic at 4 us, times 3 for each of the first impacts.
    assert!(coarse < 1e-9, "{errors:?}");
}
