//! The closed loop on motors that nobody has tuned it for.

use crate::closeness::assert_between;
use crate::command::{folder, json, number};

const SEEDS: u32 = 20;
/// The default tolerance.
const TOLERANCE_MDEG: f64 = 20.0;

/// Moves 20 drawn motors by `degrees` and checks what the plant, not the estimate, says of each.
fn check_moves(degrees: f64, settle_max_s: f64) {
    let folder = folder();
    let to = degrees.to_string();
    for seed in 1..=SEEDS {
        let seed = seed.to_string();
        let moved = json(folder.path(), &["position", "--to", &to, "--seed", &seed, "--format", "json"]);
        let what = format!("{to} degrees, seed {seed}");
        assert!(moved["ok"].as_bool().unwrap_or(false), "{what}: {moved}");
        assert_between(number(&moved, "final_error_mdeg"), -TOLERANCE_MDEG, TOLERANCE_MDEG, &what);
        // Three witnesses: the error, the angle and the target must agree, to the unit of an angle, 8.4e-5 milli-degrees.
        let off_deg = number(&moved, "final_angle_true_deg") - number(&moved, "target_deg");
        assert_between(1e3 * off_deg - number(&moved, "final_error_mdeg"), -1e-4, 1e-4, &what);
        assert_between(number(&moved, "settle_time_s"), 1e-3, settle_max_s, &what);
        assert_between(number(&moved, "rms_estimate_error_mdeg"), 0.3, 25.0, &what);
        assert_between(number(&moved, "drive_switches"), 2.0, 60.0, &what);
    }
}

#[test]
fn tool_moves_clockwise_by_a_quarter_turn() {
    check_moves(90.0, 1.0);
}

/// Mode C is slow, and slower in some motors: 15 to 170 degrees a second.
#[test]
fn tool_moves_counter_clockwise_by_a_quarter_turn() {
    check_moves(-90.0, 6.0);
}

#[test]
fn tool_moves_clockwise_by_half_a_degree() {
    check_moves(0.5, 1.0);
}

#[test]
fn tool_moves_counter_clockwise_by_a_twentieth_of_a_degree() {
    check_moves(-0.05, 0.5);
}
