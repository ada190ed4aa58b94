//! `host-sim run --then`: several targets in one session.

use link::BoardMessage;
use motor_model::Angle;
use serde_json::Value;

use crate::cabled_board::CabledBoard;
use crate::short_move;
use crate::starved::not_starved;

/// Several targets in one session: the board is configured once, moves on to each from the one before, and counts from
/// the place at which it was zeroed.
#[test]
fn tool_run_goes_on_to_other_targets_in_one_session() {
    let steps = ["--then", "zero", "--then", "-1", "--then", "hold"];
    let (said, outcome) = not_starved(|| {
        let board = CabledBoard::start();
        let outcome = short_move(&board, &steps)?;
        Ok((board.said_so_far(), outcome))
    });
    let configured = said.iter().filter(|said| **said == BoardMessage::Configured).count();
    assert_eq!(configured, 1, "{outcome}");
    let (mut zeros, mut targets) = (Vec::new(), Vec::new());
    for said in said {
        match said {
            BoardMessage::Zeroed { angle_units } => zeros.push(Angle::from_units(angle_units).degrees()),
            BoardMessage::Retargeted { target_units } => {
                targets.push(Angle::from_units(target_units).degrees());
            }
            _ => {}
        }
    }
    // The answer to a step that was sent twice comes twice.
    let ([before, .., zero], [second, .., held]) = (&zeros[..], &targets[..]) else {
        panic!("{zeros:?} {targets:?}")
    };
    // Each place is held within the tolerance of the move.
    assert!(*before == 0.0 && (zero - 2.0).abs() <= 0.1, "{zeros:?}");
    assert!((second + 1.0).abs() < 1e-6 && (held + 1.0).abs() <= 0.1, "{targets:?}");
    let number = |pointer: &str| outcome.pointer(pointer).and_then(Value::as_f64).expect("a number");
    assert_eq!(outcome["held_before"].as_array().map(Vec::len), Some(2), "{outcome}");
    for (target, expected) in
        [("/held_before/0/target_deg", 2.0), ("/held_before/1/target_deg", -1.0), ("/target_deg", *held)]
    {
        assert!((number(target) - expected).abs() < 1e-6, "{target}: {outcome}");
    }
    let held_s = [number("/held_before/0/held_s"), number("/held_before/1/held_s"), number("/duration_s")];
    assert!(held_s.is_sorted(), "{outcome}");
}
