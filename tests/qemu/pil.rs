//! `host-sim pil`: the firmware in the loop, bit by bit beside the host.

use std::process::Output;
use std::sync::OnceLock;

use serde_json::Value;

use crate::host_sim;

/// `host-sim pil` with the program built once.
fn pil(arguments: &[&str]) -> Output {
    static ELF: OnceLock<String> = OnceLock::new();
    let elf = ELF.get_or_init(|| crate::elf("pil"));
    host_sim()
        .args(["pil", "--format", "json", "--elf", elf])
        .args(arguments)
        .output()
        .expect("host-sim starts")
}

#[track_caller]
fn identical(arguments: &[&str]) -> Value {
    let Output { status, stdout, stderr } = pil(arguments);
    let complaint = String::from_utf8_lossy(&stderr);
    assert!(status.success() && complaint.is_empty(), "{arguments:?}: {status} {complaint}");
    let run: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert_eq!(run["identical"], true, "{run}");
    run
}

/// Ten seconds on the Cortex-M4F: a move, and a long hold after it.
#[test]
fn tool_pil_ten_seconds_on_a_cortex_m4f() {
    let run = identical(&["--board", "m4", "--set", "position.hold_s=10"]);
    assert!(run["steps"].as_u64().expect("a number") > 1_000_000, "{run}");
    let error_mdeg = run["final_error_mdeg"].as_f64().expect("a number");
    assert!(error_mdeg.abs() <= 20.0 && run["outcome"]["ok"] == true, "{run}");
}

/// The other board, the other filter, the other way.
#[test]
fn tool_pil_ten_seconds_on_a_cortex_m7() {
    let other = [
        "--board",
        "m7",
        "--to",
        "-90",
        "--set",
        "estimator.filter=impact_aided",
        "--set",
        "position.hold_s=10",
    ];
    let run = identical(&other);
    assert!(run["steps"].as_u64().expect("a number") > 1_000_000, "{run}");
    assert!(run["outcome"]["ok"] == true, "{run}");
}

/// The filter with the twin: of all that both compute, most of it.
#[test]
fn tool_pil_a_move_by_the_twin_on_either_board() {
    for board in ["m4", "m7"] {
        let run = identical(&["--board", board, "--set", "estimator.filter=twin"]);
        assert!(run["outcome"]["ok"] == true, "{run}");
    }
}

/// Short scenes with instruments that drop, repeat, delay and spoil what they measure.
#[test]
fn tool_pil_random_scenes() {
    // Each number differs from scene to scene, in steps without a common period.
    for n in 0..50_u32 {
        let spread = |times: u32, of: u32| f64::from(n * times % of) / f64::from(of);
        let sets = [
            format!("seed={n}"),
            format!("position.to_deg={}", 180.0 * (spread(37, 101) - 0.5)),
            format!("position.tolerance_deg={}", 0.01 + 0.1 * spread(29, 97)),
            format!("estimator.filter={}", ["constant_rate", "impact_aided", "twin"][(n % 3) as usize]),
            format!("camera.drop_probability={}", 0.2 * spread(23, 89)),
            format!("camera.duplicate_probability={}", 0.2 * spread(19, 83)),
            format!("camera.outlier_probability={}", 0.05 * spread(17, 79)),
            format!("camera.late_probability={}", 0.2 * spread(13, 73)),
            format!("camera.lost_from_s={}", 0.2 * spread(11, 71)),
            format!("camera.lost_until_s={}", 0.2 * spread(7, 67)),
            format!("ldv.lost_from_s={}", 0.2 * spread(5, 61)),
            format!("ldv.lost_until_s={}", 0.2 * spread(3, 59)),
            "position.deadline_s=0.2".to_owned(),
            "position.hold_s=0.2".to_owned(),
        ];
        let mut arguments = vec!["--board", ["m4", "m7"][(n / 2 % 2) as usize]];
        for set in &sets {
            arguments.extend(["--set", set]);
        }
        identical(&arguments);
    }
}

/// A program that says something else than frames is no partner, and the host does not wait for it.
#[test]
fn tool_pil_refuses_another_program_in_one_line() {
    let elf = &crate::elf("parity");
    let Output { status, stdout, stderr } =
        host_sim().args(["pil", "--elf", elf]).output().expect("host-sim starts");
    let complaint = String::from_utf8_lossy(&stderr);
    assert_eq!(status.code(), Some(2), "{complaint}");
    assert!(stdout.is_empty() && complaint.lines().count() == 1, "{complaint}");
    assert!(complaint.starts_with("error: the microcontroller"), "{complaint}");
}
