//! The scenes of `host-sim/scenes`: what the tilting motor does in them, and what a move on it is worth.
//!
//! Expected values are those of another program of the same equations: mean and spread over seeds of 1.5 s. Here two
//! seeds of 0.9 s have a mean that is known to 0.9 of that spread. Bounds are four spreads.

use std::path::Path;

use serde_json::Value;

use crate::support::built_command::{folder, json, number, refuses};
use crate::support::checkout::root;
use crate::support::closeness::assert_between;

fn scene(name: &str) -> String {
    root().join(format!("host-sim/scenes/{name}.toml")).to_str().expect("a path of text").to_owned()
}

/// Two runs of a scene in a mode.
fn runs(folder: &Path, name: &str, drive: &str) -> [Value; 2] {
    let scene = scene(name);
    let times = ["--duration", "1.2", "--settle", "0.3"];
    ["seed=1", "seed=2"].map(|seed| {
        let run = ["simulate", "--format", "json", "--scene", &scene, "--drive", drive, "--set", seed];
        json(folder, &[&run[..], &times].concat())
    })
}

/// The mean of a figure over both runs is within the bounds.
#[track_caller]
fn check(runs: &[Value; 2], figure: &str, factor: f64, (low, high): (f64, f64)) {
    let mean = runs.iter().map(|run| factor * number(run, figure)).sum::<f64>() / 2.0;
    assert_between(mean, low, high, figure);
}

/// A mean and four of its spreads to either side.
fn about(mean: f64, spread: f64) -> (f64, f64) {
    (mean - 4.0 * spread, mean + 4.0 * spread)
}

/// Line, amplitude at the centre and at the rim, tilt and hub contacts of each set. Where no spread is known, a tenth.
#[test]
fn dual_sets_move_as_another_program_says() {
    let folder = folder();
    for (name, drive, line_hz, centre_mm_s, tilt_mrad, hub_per_s) in [
        ("set_f", "b", about(79.0, 11.0), about(4.6, 0.8), (27.9, 34.1), (700.0, 1200.0)),
        ("set_f", "c", about(287.0, 25.0), about(0.77, 0.06), (1.4, 1.8), (40.0, 120.0)),
        ("set_g", "b", about(84.0, 6.0), about(4.7, 0.4), (21.3, 26.1), (700.0, 1200.0)),
        ("set_g", "c", about(244.0, 21.0), about(0.89, 0.10), (1.8, 2.4), (40.0, 120.0)),
        ("nominal_20um", "b", (40.0, 160.0), about(5.3, 1.6), (21.6, 28.6), (440.0, 1100.0)),
        ("nominal_20um", "c", about(304.0, 35.0), about(0.89, 0.06), (1.6, 2.4), (20.0, 100.0)),
    ] {
        let runs = runs(folder.path(), name, drive);
        check(&runs, "collision_frequency_hz", 1.0, line_hz);
        check(&runs, "collision_amplitude_m_s", 1e3, centre_mm_s);
        check(&runs, "tilt_rms_mrad", 1.0, tilt_mrad);
        check(&runs, "hub_contacts_per_s", 1.0, hub_per_s);
        // The line at the rim is about twice that of the centre, by tilt.
        let [rim, centre] = ["rim_amplitude_m_s", "collision_amplitude_m_s"]
            .map(|figure| runs.iter().map(|run| number(run, figure)).sum::<f64>());
        assert_between(rim / centre, 1.2, 5.0, name);
        // A rotor on its pin is shifted by no more than its play.
        let clearance_um = if name == "nominal_20um" { 20.0 } else { 7.0 };
        check(&runs, "shift_rms_m", 1e6, (0.2 * clearance_um, clearance_um));
    }
}

/// Rates beside those of the second program (`tests/system/support/tilting_reference.rs`): mean and spread of five of
/// its runs of 1.2 s. The difference of its mean and that of two runs here has a standard error of 0.84 spreads; bounds
/// are four of them. In mode B the tight sets run backwards for a part of the time; in mode C none does.
#[test]
fn dual_sets_turn_as_the_second_program_says() {
    let folder = folder();
    for (name, drive, mean_rad_s, spread_rad_s, reversed) in [
        ("set_f", "b", 1.50, 0.65, (0.05, 0.6)),
        ("set_g", "b", 1.33, 0.23, (0.05, 0.6)),
        ("nominal_20um", "b", 14.2, 0.4, (0.0, 0.001)),
        ("set_f", "c", -1.68, 0.02, (0.0, 0.001)),
        ("set_g", "c", -2.38, 0.02, (0.0, 0.001)),
        ("set_h", "c", -1.49, 0.03, (0.0, 0.001)),
        ("nominal_20um", "c", -2.50, 0.02, (0.0, 0.001)),
    ] {
        let runs = runs(folder.path(), name, drive);
        let off = 4.0 * 0.84 * spread_rad_s;
        check(&runs, "rotor_rate_mean_rad_s", 1.0, (mean_rad_s - off, mean_rad_s + off));
        check(&runs, "reversed_share", 1.0, reversed);
    }
}

/// The height-only motor reports nothing of a tilt, and refuses the keys of a hub.
#[test]
fn tool_a_rotor_that_does_not_tilt_has_no_tilt() {
    let folder = folder();
    let run = ["simulate", "--format", "json", "--duration", "0.1", "--settle", "0"];
    let report = json(folder.path(), &run);
    assert!(report.get("tilt_rms_mrad").is_none() && report.get("hub_contacts_per_s").is_none());
    let tilting = json(folder.path(), &[&run[..], &["--rotor", "tilting_without_shift"]].concat());
    assert!(number(&tilting, "tilt_rms_mrad") > 0.1 && number(&tilting, "shift_rms_m").abs() < 1e-12);
    let ignored =
        ["plant.rotor = height_only does not use motor.hub.friction", "plant.rotor=tilting uses it"];
    refuses(folder.path(), &["simulate", "--set", "motor.hub.friction=0.3"], &ignored);
    let averaged = ["simulate", "--model", "averaged", "--rotor", "tilting"];
    refuses(folder.path(), &averaged, &["simulate.model = averaged does not use plant.rotor"]);
}

/// Moves to 37 degrees on true motors of both sets, of which controller and filter know nothing. With two opposite
/// marks and with three none is held as on target beyond three tolerances, six standard deviations. With one mark the
/// tolerance is refused, and one of a degree is met. Where the filters are told of no play, a move ends off by as much
/// as the play looks like, 7 um and what tilt adds to it at 3.9 mm, and that is said.
#[test]
fn law_moves_on_a_tilting_motor_end_as_the_camera_sees_it() {
    let folder = folder();
    for name in ["set_f_plant", "set_g_plant"] {
        let scene = scene(name);
        // Contacts are located, and converged at this step.
        let step = "plant.step_s=5e-6";
        let run = ["position", "--to", "37", "--format", "json", "--scene", &scene, "--set", step];
        let out = folder.path().join("move.svg");
        let run = [&run[..], &["--out", out.to_str().expect("text")]].concat();
        for (marks, seed) in [(2, 1), (2, 2), (2, 3), (3, 1)] {
            let sets = [format!("camera.marks={marks}"), format!("seed={seed}")];
            let run = [&run[..], &["--set", &sets[0], "--set", &sets[1]]].concat();
            let moved = crate::support::built_command::run(folder.path(), &run);
            let moved: Value = serde_json::from_slice(&moved.stdout).expect("one JSON value");
            assert!(moved["stopped"].is_null() && !moved["settle_time_s"].is_null(), "{moved}");
            assert_between(number(&moved, "final_error_mdeg"), -3.0, 3.0, &moved);
            // Tilt and shift of the truth: the pin lets the mass centre be off by the play and a little that tilt adds.
            assert_between(number(&moved, "shift_max_m"), 1e-6, 8e-6, name);
            assert_between(number(&moved, "tilt_max_mrad"), 5.0, 80.0, name);
            assert!(number(&moved["marks"], "frames") > 1000.0 && number(&moved["marks"], "refused") < 10.0);
        }
        let picture = crate::support::built_command::written(folder.path(), "move.svg");
        assert!(picture.contains("Tilt of the rotor") && picture.contains("on the pin"), "{name}");
        let one = [&run[..], &["--set", "camera.marks=1"]].concat();
        refuses(folder.path(), &one, &["position.tolerance_deg = 0.001", "cannot be met", "--tolerance"]);
        let within = json(folder.path(), &[&one[..], &["--tolerance", "1"]].concat());
        assert!(within["ok"] == Value::Bool(true), "{within}");
        assert_between(number(&within, "final_error_mdeg"), -1000.0, 1000.0, name);
        let untold = [&one[..], &["--set", "estimator.assumed.hub.clearance_m=0"]].concat();
        let one = crate::support::built_command::run(folder.path(), &untold);
        let one: Value = serde_json::from_slice(&one.stdout).expect("one JSON value");
        let error_mdeg = number(&one, "final_error_mdeg");
        assert_between(error_mdeg, -200.0, 200.0, name);
        assert_eq!(one["ok"], Value::Bool(error_mdeg.abs() <= number(&one, "tolerance_deg") * 1e3), "{one}");
    }
}
