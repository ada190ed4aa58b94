//! `host-sim position`: one move of one motor, and what it refuses.

use crate::support::built_command::{folder, json, number, refuses};
use crate::support::closeness::assert_between;

/// The closed loop reaches a target either way; the second run gives the same bytes.
#[test]
fn tool_position_reaches_its_target() {
    let folder = folder();
    for (to, seed) in [("90", "1"), ("-90", "2"), ("0.5", "3"), ("-0.05", "4")] {
        let arguments = ["position", "--to", to, "--seed", seed, "--format", "json", "--out", "move.svg"];
        let report = json(folder.path(), &arguments);
        let target: f64 = to.parse().expect("a number");
        assert_between(number(&report, "target_deg"), target, target, "target");
        let angle_deg = number(&report, "final_angle_true_deg");
        assert_between(angle_deg - target, -0.1, 0.1, format_args!("distance from {to} degrees"));
        let error_mdeg = number(&report, "final_error_mdeg");
        assert_between(
            error_mdeg,
            1e3 * (angle_deg - target) - 1e-3,
            1e3 * (angle_deg - target) + 1e-3,
            "error",
        );
        assert_between(number(&report, "settle_time_s"), 0.0, 60.0, "time to settle");
        assert_between(number(&report, "drive_switches"), 1.0, 1e5, "switches of the drive");
        assert_between(number(&report, "rms_estimate_error_mdeg"), 0.01, 200.0, "error of the estimate");
        assert_eq!(report["ok"], true, "{report}");
        let picture = std::fs::read_to_string(folder.path().join("move.svg")).expect("a picture");
        assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
        assert_eq!(report.to_string(), json(folder.path(), &arguments).to_string(), "same seed, same run");
    }
}

#[test]
fn tool_position_refuses_what_it_cannot_reach() {
    let folder = folder();
    for (arguments, words) in [
        (&["--to", "NaN"][..], &["position.to_deg", "NaN"][..]),
        (&["--to", "1e30"], &["position.to_deg"]),
        (&["--to", "90", "--tolerance", "0"], &["position.tolerance_deg", "0"]),
        (&["--to", "90", "--out", "nowhere/move.svg"], &["nowhere/move.svg"]),
    ] {
        refuses(folder.path(), &[&["position"], arguments].concat(), words);
    }
}
