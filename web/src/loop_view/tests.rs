use simulation::runs::position;

use super::*;
use crate::columns::{IMPACT, ROW};
use crate::rows::IMPACTS_MAX;

const MOVE: &str = "position.to_deg=2\nestimator.filter=constant_rate\nplant.step_s=1e-5";

/// Runs until the move has ended, at most 5 s.
fn ended(view: &mut LoopView) -> MoveOutcome {
    for _ in 0..500 {
        view.advance(1000, 100);
        if let Some(outcome) = &view.outcome {
            return outcome.clone();
        }
    }
    panic!("the move does not end: {}", view.status());
}

/// A move on the page is the command's move, to the last bit.
#[test]
fn exact_a_move_is_that_of_the_command() {
    let outcome = position::run(&scene(MOVE).unwrap(), |_| ()).unwrap();
    let mut view = LoopView::new(MOVE).unwrap();
    assert_eq!(ended(&mut view), outcome);
}

/// Rows come after so many ticks each, and after the last; they hold what their names say.
#[test]
fn exact_rows() {
    let mut view = LoopView::new(MOVE).unwrap();
    view.advance(1005, 100);
    let rows = view.rows();
    assert_eq!(rows.len(), 11 * ROW.len());
    let value = |row: usize, name: &str| rows[row * ROW.len() + ROW.iter().position(|n| *n == name).unwrap()];
    for row in 0..10_u8 {
        assert!((value(row.into(), "t") - 1e-3 * f64::from(row + 1)).abs() < 1e-12);
    }
    assert!((value(10, "t") - 10.05e-3).abs() < 1e-12);
    assert!(value(10, "drive") > 0.0 && value(10, "angle") > 0.0, "clockwise by mode B");
    assert!(value(9, "sd") > 0.0 && value(9, "innovation_sd") > 0.0 && value(9, "impacts") > 0.0);
    assert!(view.rows().is_empty());
    let impacts = view.impacts();
    assert!(impacts.len().is_multiple_of(IMPACT.len()) && impacts.len() <= IMPACTS_MAX * IMPACT.len());
    for impact in impacts.chunks(IMPACT.len()) {
        assert!(impact[1] > 0.0 && (0.0..4.0).contains(&impact[3]), "{impact:?}");
    }
}

/// A second move begins where the first one ended.
#[test]
fn law_a_run_goes_on_to_another_target() {
    let mut view = LoopView::new(MOVE).unwrap();
    ended(&mut view);
    view.go_on(&MOVE.replace("to_deg=2", "to_deg=-1")).unwrap();
    let outcome = ended(&mut view);
    assert!(outcome.ok && (outcome.final_angle_true_deg + 1.0).abs() < 0.002, "{outcome}");
    // Three degrees of bursts in mode C: longer than a tick, and not longer than the deadline.
    assert!(outcome.duration_s < 30.0);
}

/// Driven by hand the rotor turns as the mode does, and the filter is told.
#[test]
fn law_driven_by_hand_the_modes_turn_the_rotor_their_way() {
    for (mode, sign) in [("b", 1.0), ("c", -1.0), ("", 0.0)] {
        let mut view = LoopView::new(MOVE).unwrap();
        view.drive_by_hand(mode, 1.0);
        view.advance(5000, 5000);
        let rows = view.rows();
        assert!(rows[1] * sign > 0.1 || (sign.abs() < 0.5 && rows[1].abs() < 0.01), "{mode}: {}", rows[1]);
        assert!((rows[6] - sign).abs() < 1e-6);
    }
}

/// A scene that is refused says so as the command does, and changes nothing.
#[test]
fn exact_refusals() {
    let refused = LoopView::new("camera.noise_m=-1").map(|_| ()).unwrap_err();
    assert_eq!(refused, "error: camera.noise_m = -1 is outside its bounds 0 to 0.001 m");
    let mut view = LoopView::new(MOVE).unwrap();
    view.advance(10, 10);
    let status = view.status();
    assert!(view.go_on("position.to_deg=1e9").is_err());
    assert!(view.change_faults("faults=hub:rub:0.5").is_err());
    assert_eq!(view.status(), status);
}

/// The true motor has the values that are set, and those that are drawn.
#[test]
fn exact_true_motor() {
    let view = LoopView::new("plant.motor.friction=0.25\nplant.rotor=tilting").unwrap();
    let values: Value = serde_json::from_str(&view.true_motor()).unwrap();
    assert_eq!(values["plant.motor.friction"], 0.25);
    assert_ne!(values["plant.motor.rotor_mass_kg"], 46e-6);
    assert!(values["plant.motor.hub.clearance_m"].as_f64().unwrap() > 0.0);
}
