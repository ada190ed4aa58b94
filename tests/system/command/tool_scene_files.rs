//! `init`, `scene` and `scenes`: a scene file to begin with, what a scene sets and from where, and the gallery.

use serde_json::Value;

use crate::support::built_command::{folder, json, refuses, succeeds};

fn array(folder: &std::path::Path, arguments: &[&str]) -> Vec<Value> {
    serde_json::from_str(&succeeds(folder, arguments)).expect("one JSON array and nothing else")
}

/// A new scene is the default scene for every command, and a key whose # is taken away is set.
#[test]
fn tool_init_writes_a_scene_that_sets_nothing() {
    let folder = folder();
    let said = succeeds(folder.path(), &["init"]);
    assert!(said.contains("scene.toml") && said.contains("host-sim position --scene scene.toml"), "{said}");
    let path = folder.path().join("scene.toml");
    let text = std::fs::read_to_string(&path).expect("written");
    assert_eq!(succeeds(folder.path(), &["scene", "scene.toml", "--only-set"]), "");
    let plan = |extra: &[&str]| {
        json(folder.path(), &[&["position", "--plan", "--format", "json"][..], extra].concat())
    };
    assert_eq!(plan(&["--scene", "scene.toml"]), plan(&[]));
    std::fs::write(&path, text.replace("\n#to_deg = 90\n", "\nto_deg = 45\n")).expect("a writable folder");
    assert_eq!(plan(&["--scene", "scene.toml"]), plan(&["--to", "45"]));
}

/// What stands there stays, unless the user says otherwise.
#[test]
fn tool_init_writes_over_nothing() {
    let folder = folder();
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, "seed = 2\n").expect("a writable folder");
    refuses(folder.path(), &["init", "mine.toml"], &["mine.toml", "there already", "--force"]);
    refuses(folder.path(), &["init", "nowhere/mine.toml"], &["nowhere/mine.toml"]);
    assert_eq!(std::fs::read_to_string(&path).expect("still there"), "seed = 2\n");
    let written = json(folder.path(), &["init", "mine.toml", "--force", "--for", "rate", "--format", "json"]);
    assert_eq!(written["written"], "mine.toml");
    let text = std::fs::read_to_string(&path).expect("written");
    assert!(text.contains("[rate]") && !text.contains("[calibrate]"), "only what rate reads");
}

/// Each value names its source; the text is the scene again.
#[test]
fn tool_scene_says_where_each_value_comes_from() {
    let folder = folder();
    std::fs::write(folder.path().join("mine.toml"), "[camera]\n\nmarks = 3\nnoise_m = 2e-6\n")
        .expect("a folder");
    let arguments = ["scene", "mine.toml", "--set", "camera.noise_m=3e-6", "--seed", "7"];
    let keys = array(folder.path(), &[&arguments[..], &["--format", "json"]].concat());
    let of = |name: &str| keys.iter().find(|key| key["key"] == name).unwrap_or_else(|| panic!("{name}"));
    for (name, value, source) in [
        ("seed", Value::from(7), "flag"),
        ("camera.marks", Value::from(3), "file"),
        ("camera.noise_m", Value::from(3e-6), "set"),
        ("position.to_deg", Value::from(90.0), "default"),
        ("estimator.assumed.camera.marks", Value::from(3), "as"),
        ("plant.motor.friction", Value::from(0.4), "drawn"),
    ] {
        assert_eq!((&of(name)["value"], of(name)["source"].as_str()), (&value, Some(source)), "{name}");
    }
    assert_eq!(
        (&of("camera.marks")["path"], of("camera.marks")["line"].as_u64()),
        (&Value::from("mine.toml"), Some(3))
    );
    let text = succeeds(folder.path(), &arguments);
    assert!(
        text.contains("# mine.toml:3\n") && text.contains("# --set\n") && text.contains("# flag\n"),
        "{text}"
    );
    std::fs::write(folder.path().join("again.toml"), text).expect("a writable folder");
    let values = |keys: Vec<Value>| keys.iter().map(|key| key["value"].clone()).collect::<Vec<_>>();
    let again = array(folder.path(), &["scene", "again.toml", "--format", "json"]);
    assert_eq!(values(again), values(keys));
}

#[test]
fn tool_scene_refuses_what_a_command_would_refuse() {
    let folder = folder();
    refuses(folder.path(), &["scene", "heavy_rotr"], &["heavy_rotr", "did you mean heavy_rotor?"]);
    refuses(
        folder.path(),
        &["scene", "--for", "rate", "--set", "position.to_deg=3"],
        &["rate does not read"],
    );
    refuses(folder.path(), &["scenes", "xyzzy"], &["xyzzy", "host-sim scenes"]);
    std::fs::write(folder.path().join("mine.toml"), "[position]\nto_deg = \"37\"\n")
        .expect("a writable folder");
    refuses(folder.path(), &["scene", "mine.toml"], &["mine.toml:2:10", "no quotes"]);
}

/// The list, one scene's file, and a run by name that is the run by path.
#[test]
fn tool_scenes_lists_the_gallery() {
    let folder = folder();
    let scenes = array(folder.path(), &["scenes", "--format", "json"]);
    let text = succeeds(folder.path(), &["scenes"]);
    assert_eq!(text.lines().count(), scenes.len() + 2, "a header, a rule, and a line for each scene");
    for scene in &scenes {
        let name = scene["name"].as_str().expect("a name");
        assert!(text.contains(name) && text.contains(scene["look_at"].as_str().expect("words")), "{name}");
    }
    let file = succeeds(folder.path(), &["scenes", "heavy-rotor"]);
    std::fs::write(folder.path().join("mine.toml"), &file).expect("a writable folder");
    let run = |scene: &str| {
        let arguments = ["simulate", "--duration", "0.6", "--format", "json", "--scene", scene];
        let mut report = json(folder.path(), &arguments);
        report.as_object_mut().expect("an object").remove("wall_s");
        report
    };
    assert_eq!(run("heavy_rotor"), run("mine.toml"));
}
