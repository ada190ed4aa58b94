//! `host-sim stator`: from a drawing to modes, with CalculiX and without it.

use serde_json::Value;

use crate::support::built_command::{folder, json, run, succeeds};

/// A coarse mesh: a solution takes less than a second.
const COARSE: [&str; 4] = ["--set", "stator.mesh_size_m=0.9e-3", "--format", "json"];

fn solved(extra: &[&str]) -> Value {
    let folder = folder();
    json(folder.path(), &[&["stator"][..], &COARSE, extra].concat())
}

/// The object that programs read; its modes are in the order of the paper.
#[test]
fn tool_a_stator_is_one_object() {
    let found = solved(&[]);
    let number =
        |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    let order = ["a", "tilt_1", "tilt_2", "b", "c"].map(|mode| number(&format!("/frequencies_hz/{mode}")));
    assert!(order.is_sorted(), "{order:?}");
    for mode in ["a", "tilt_1", "tilt_2", "b", "c"] {
        assert!(number(&format!("/modal_mass_kg/{mode}")) < number("/stator_mass_kg"));
        assert!(number(&format!("/tooth_exponent/{mode}")).is_finite());
    }
    for mode in ["b", "c"] {
        assert!(number(&format!("/mode_shift_deg/{mode}")).abs() < 45.0);
    }
    assert!(number("/bow_m") > 0.0);
    assert_eq!(found["stressed"], false);
    // The field of one direction gives B its amplitude; in two directions it gives C its own as well.
    let strain = number("/drive/at_field/strain");
    assert!((1e-6..20e-6).contains(&strain), "{strain}");
    for place in [0, 1] {
        let field = number(&format!("/drive/fields_of_both_amplitudes/{place}/field_deg"));
        let key = format!("stator.field_angle_deg={field}");
        let again = solved(&["--set", &key]);
        let amplitude = again["drive"]["at_field"]["tooth_amplitude_c_m"].as_f64().unwrap();
        assert!((amplitude / 1.81e-6 - 1.0).abs() < 1e-3, "{field}: {amplitude}");
    }
}

/// Half the size, twice the frequency: a law of elasticity. The mesh is halved with the rest.
#[test]
fn law_frequencies_go_with_the_inverse_of_the_size() {
    let found = solved(&[]);
    let folder = folder();
    let half = ["--set", "stator.mesh_size_m=0.45e-3", "--format", "json", "--scene", "half_the_size_stator"];
    let half = json(folder.path(), &[&["stator"][..], &half].concat());
    for mode in ["a", "tilt_1", "b", "c"] {
        let ratio =
            half["frequencies_hz"][mode].as_f64().unwrap() / found["frequencies_hz"][mode].as_f64().unwrap();
        assert!((ratio - 2.0).abs() < 1e-3, "{mode}: {ratio}");
    }
    let bow = half["bow_m"].as_f64().unwrap() / found["bow_m"].as_f64().unwrap();
    assert!((bow - 0.5).abs() < 1e-3, "{bow}");
}

/// What is written is a scene of a motor, with what the drawing's scene says of it.
#[test]
fn tool_a_stator_gives_the_scene_of_a_motor() {
    let folder = folder();
    let flags = ["--scene", "half_the_size_stator", "--set", "stator.mesh_size_m=0.45e-3", "--out", "half"];
    succeeds(folder.path(), &[&["stator"][..], &flags].concat());
    let said = succeeds(folder.path(), &["scene", "half/motor.toml", "--only-set"]);
    assert!(said.contains("rotor_mass_kg") && said.contains("stator_mass_kg"), "{said}");
    let again = succeeds(
        folder.path(),
        &["stator", "--scene", "half/drawing.toml", "--format", "json", "--out", "again"],
    );
    assert!(again.contains("frequencies_hz"));
}

/// One line each, and exit code 2: no solver, a solver that is too slow, a drawing that is refused.
#[test]
fn tool_what_gives_no_stator_is_said_in_one_line() {
    let folder = folder();
    for (flags, said) in [
        (
            &["--ccx", "/nowhere/ccx"][..],
            "error: cannot run /nowhere/ccx: no such program; hint: `apt-get install calculix-ccx`",
        ),
        (
            &["--set", "stator.tooth_radial_m=2e-3"],
            "error: stator.tooth_radial_m = 0.002 is outside its bounds 0 to 0.0008",
        ),
        (&["--set", "stator.mesh_size_m=1e-5"], "error: stator.mesh_size_m = 0.00001 makes "),
        (&["--shard", "1/2"], "error: one stator is not made in parts"),
        (&["--set", "camera.marks=2"], "error: stator does not read camera.marks"),
        (&["--ensemble", "1", "--shard", "2/2"], "error: part 2/2 of 1 stators has none"),
    ] {
        let output = run(folder.path(), &[&["stator", "--quiet"][..], flags].concat());
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {complaint}");
        assert!(complaint.starts_with(said) && complaint.lines().count() == 1, "{flags:?}: {complaint}");
    }
}

/// Two parts together are the whole, and a second run takes what is kept.
#[test]
fn tool_an_ensemble_in_parts_is_the_whole() {
    let folder = folder();
    let coarse = ["--set", "stator.mesh_size_m=1.5e-3", "--cache", "kept", "--quiet"];
    let ensemble = |extra: &[&str]| succeeds(folder.path(), &[&["stator"][..], &coarse, extra].concat());
    ensemble(&["--ensemble", "2", "--out", "whole"]);
    for (shard, out) in [("1/2", "one"), ("2/2", "two")] {
        ensemble(&["--ensemble", "2", "--shard", shard, "--out", out]);
    }
    ensemble(&["--merge", "two/members.csv", "one/members.csv", "--out", "merged"]);
    let table =
        |out: &str| std::fs::read_to_string(folder.path().join(out).join("members.csv")).expect("a table");
    assert_eq!(table("whole"), table("merged"));
    assert_eq!(table("whole").lines().count(), 3);
}

/// A draw that CalculiX cannot solve is a row with its reason, and does not end the ensemble. Parts with such rows are
/// merged as others are; the same part given twice stands once.
#[cfg(unix)]
#[test]
fn tool_a_draw_without_a_result_is_a_row() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder();
    let program = folder.path().join("fails");
    let script = "#!/bin/sh\nexit 3\n";
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let coarse = ["--set", "stator.mesh_size_m=1.5e-3", "--quiet"];
    let ensemble = |extra: &[&str]| succeeds(folder.path(), &[&["stator"][..], &coarse, extra].concat());
    let ccx = program.to_str().unwrap();
    ensemble(&["--ensemble", "2", "--shard", "1/2", "--out", "good"]);
    ensemble(&["--ensemble", "2", "--shard", "2/2", "--ccx", ccx, "--cache", "none", "--out", "bad"]);
    let (good, bad) = ("good/members.csv", "bad/members.csv");
    let said = ensemble(&["--merge", bad, good, bad, "--out", "merged"]);
    assert!(said.contains("1 of 2 stators") && said.contains("failed, exit status: 3"), "{said}");
    let rows = std::fs::read_to_string(folder.path().join("merged/members.csv")).unwrap();
    assert_eq!(rows.lines().count(), 3);
    // The mean motor is that of the one that meets the frequencies.
    succeeds(folder.path(), &["scene", "merged/motor.toml", "--only-set"]);
}
