//! The scenes of the gallery: each one's own command runs, and a fault does what its scene says.

use serde_json::Value;

use crate::support::built_command::{folder, json, run, succeeds};

/// What makes a run short.
const SHORTER: [(&str, &[&str]); 6] = [
    ("simulate", &["--set", "simulate.duration_s=0.6"]),
    ("position", &[]),
    ("rate", &[]),
    ("record", &[]),
    ("stator", &["--set", "stator.mesh_size_m=0.45e-3"]),
    ("calibrate", &["--duration", "2", "--set", "calibrate.rest_s=0.05"]),
];

/// Name and command of each scene.
fn scenes() -> Vec<(String, Vec<String>)> {
    let folder = folder();
    let listed = succeeds(folder.path(), &["scenes", "--format", "json"]);
    let listed: Vec<Value> = serde_json::from_str(&listed).expect("one JSON array");
    let text = |scene: &Value, field: &str| scene[field].as_str().expect("text").to_owned();
    let of = |scene: &Value| {
        let command = shlex::split(&text(scene, "command")).expect("words");
        assert_eq!(command[0], "host-sim", "{command:?}");
        (text(scene, "name"), command[1..].to_vec())
    };
    listed.iter().map(of).collect()
}

/// A design of its own needs a map, which takes seconds to make: other tests move such motors, here they are simulated.
#[test]
fn tool_every_scene_of_the_gallery_runs() {
    let folder = folder();
    for (name, command) in scenes() {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        // A drawing is a scene of its own command, whatever it says of the motor beside.
        let own_design = words[0] != "stator"
            && succeeds(folder.path(), &["scene", &name, "--only-set"]).contains("[motor");
        let arguments = if own_design {
            vec!["simulate", "--scene", &name, "--duration", "0.6"]
        } else {
            let shorter =
                SHORTER.iter().find(|(of, _)| *of == words[0]).expect("a command that takes scenes");
            [&words[..], shorter.1].concat()
        };
        let output = run(folder.path(), &[&arguments[..], &["--quiet"]].concat());
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && complaint.is_empty(), "{name}: {complaint}");
    }
}

/// How each faulty move ends, and what the estimate's health says of it on the way.
#[test]
fn tool_faults_of_the_gallery_do_what_their_scenes_say() {
    let folder = folder();
    for (name, stopped, health) in [
        ("fault_camera_lost", None, "CameraSilent"),
        ("fault_camera_stuck", None, "CameraStuck"),
        ("fault_camera_zeros", None, "FramesRefused"),
        ("fault_camera_other_feature", None, "FramesRefused"),
        ("fault_mark_false", None, "Good"),
        ("fault_marks_exchanged", None, "Uncertain"),
        ("fault_ldv_lost", None, "VibrometerSilent"),
        ("fault_ldv_stuck", None, "VibrometerSilent"),
        ("fault_ldv_zeros", None, "VibrometerSilent"),
        ("fault_ldv_inverted", None, "VibrometerInverted"),
        ("fault_ldv_not_a_number", None, "VibrometerSilent"),
        ("fault_drive_weak", None, "Good"),
        ("fault_drive_dead", Some("Stalled"), "Good"),
        ("fault_drive_dead_mode_c", Some("ModeCLost"), "Good"),
        ("fault_drive_swapped", Some("ModeInverted"), "Good"),
        ("fault_resonance_drift", None, "Good"),
        ("fault_rotor_jolt", None, "Good"),
        ("fault_camera_intermittent", None, "CameraSilent"),
        ("fault_camera_outliers", None, "NoiseMismatch"),
        ("fault_camera_delayed", None, "CameraSilent"),
        ("fault_ldv_intermittent", None, "Good"),
        ("fault_ldv_outliers", None, "VibrometerErratic"),
        ("fault_ldv_offset", None, "VibrometerErratic"),
        ("fault_rotor_stuck", None, "Good"),
        ("fault_hub_rub", None, "Good"),
    ] {
        let outcome = json(folder.path(), &["position", "--to", "37", "--scene", name, "--format", "json"]);
        assert_eq!(outcome["stopped"].as_str(), stopped, "{name}: {outcome}");
        if stopped.is_none() {
            // One move in twenty may end outside of the tolerance of a milli-degree, none outside of three.
            let error_mdeg = outcome["final_error_mdeg"].as_f64().expect("a number");
            assert!(error_mdeg.abs() <= 3.0, "{name}: {outcome}");
        }
        let states = outcome["health"].as_object().expect("an object");
        assert!(states.keys().any(|state| state.contains(health)), "{name}: {states:?}");
        let counted = |what: &str| outcome["marks"][what].as_u64().expect("a count");
        match name {
            "fault_mark_false" => assert_eq!(counted("mark_left_out"), 300, "{outcome}"),
            "fault_marks_exchanged" => assert_eq!(counted("refused"), 300, "{outcome}"),
            _ => {}
        }
    }
}

/// A fault by words is the fault by keys, to the last digit of the result.
#[test]
fn dual_words_and_keys_of_faults_give_the_same_move() {
    let folder = folder();
    let outcome = |sets: &[&str]| {
        let mut outcome =
            json(folder.path(), &[&["position", "--to", "5", "--format", "json"][..], sets].concat());
        // What was set is written as it was set.
        outcome.as_object_mut().expect("an object").remove("scene").expect("the scene of the result");
        outcome
    };
    let by_words = outcome(&["--fault", "camera:lost@0.02..0.03", "--fault", "drive:weak:0.7@0.04.."]);
    let by_keys = outcome(&[
        "--set",
        "camera.lost_from_s=0.02",
        "--set",
        "camera.lost_until_s=0.03",
        "--set",
        "fault.drive_gain=0.7",
        "--set",
        "fault.from_s=0.04",
    ]);
    assert_eq!(by_words, by_keys);
    assert_ne!(by_words, outcome(&[]));
}
