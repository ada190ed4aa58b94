//! `host-sim compare`: two results of the command side by side, what changed beyond noise, exit codes, refusals.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::built_command::{folder, json, refuses, run, succeeds, written};

/// The result of a command, written to a file.
fn result(folder: &Path, name: &str, arguments: &[&str]) {
    let text = succeeds(folder, &[arguments, &["--format", "json", "--quiet"]].concat());
    fs::write(folder.join(name), text).expect("a folder");
}

/// The same result twice is equal to the last bit; another seed alone changes figures within noise; a camera of forty
/// times the noise is worse beyond it. The error at rest is proportional to the noise of a frame, far more than the
/// spread over eight motors: of each pair the second has to be the worse one, or eight pairs prove nothing.
#[test]
fn law_a_worse_camera_is_found_and_another_seed_is_not() {
    let folder = folder();
    let path = folder.path();
    let trials = |name: &str, more: &[&str]| {
        let coarse = ["positioning-trials", "--motors", "8", "--set", "plant.step_s=1e-5"];
        result(path, name, &[&coarse[..], more].concat());
    };
    trials("a.json", &[]);
    trials("seed.json", &["--seed", "50"]);
    trials("noise.json", &["--set", "camera.noise_m=40e-6"]);
    let compared = |b: &str| json(path, &["compare", "a.json", b, "--format", "json"]);

    let same = compared("a.json");
    assert_eq!(
        (&same["changes"], &same["scene_differences"]),
        (&Value::from(0), &Value::from(Vec::<Value>::new()))
    );
    let seed = compared("seed.json");
    assert_eq!(seed["changes"], 0, "{seed}");
    assert_eq!(seed["scene_differences"][0]["key"], "seed");
    let noise = compared("noise.json");
    let figures = noise["figures"].as_array().expect("figures");
    let verdict = |name: &str| {
        let figure = figures.iter().find(|figure| figure["a"]["name"] == name).expect(name);
        figure["verdict"].as_str().expect("a verdict")
    };
    assert_eq!(verdict("error of the estimate on the way"), "worse", "{noise}");

    let text = succeeds(path, &["compare", "a.json", "noise.json"]);
    assert!(text.contains("The scenes differ: `camera.noise_m`") && text.contains("## Changed"), "{text}");
    let refused = run(path, &["compare", "a.json", "noise.json", "--fail-on-change"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(!refused.stdout.is_empty(), "the comparison is printed all the same");
    succeeds(path, &["compare", "a.json", "seed.json", "--fail-on-change", "--report", "seed.html"]);
    assert!(written(path, "seed.html").ends_with("</html>"));
}

/// Ten percent more noise of the camera make errors of every filter larger by a few percent. On the same four motors
/// that is beyond chance, on four others it is within the spread between motors.
#[test]
fn law_a_little_more_noise_is_found_on_the_same_motors_alone() {
    let folder = folder();
    let path = folder.path();
    let estimate = |name: &str, more: &[&str]| {
        let coarse = ["estimate", "--motors", "4", "--set", "plant.step_s=1e-5"];
        result(path, name, &[&coarse[..], more].concat());
    };
    let noise = ["--set", "camera.noise_m=1.1e-6"];
    estimate("before.json", &[]);
    estimate("same_motors.json", &noise);
    estimate("other_motors.json", &[&noise[..], &["--seed", "50"]].concat());
    let figures = |b: &str| {
        let compared = json(path, &["compare", "before.json", b, "--format", "json"]);
        compared["figures"].as_array().expect("figures").clone()
    };
    let changed =
        |figures: &[Value], verdict: &str| figures.iter().filter(|f| f["verdict"] == verdict).count();
    let (same, other) = (figures("same_motors.json"), figures("other_motors.json"));
    assert!(same.iter().all(|figure| figure["test"] == "paired_t" && figure["pairs"] == 4));
    assert!(changed(&same, "worse") > 0 && changed(&same, "better") == 0, "{same:#?}");
    assert!(other.iter().all(|figure| figure["test"] == "intervals" && figure["pairs"] == Value::Null));
    assert_eq!(changed(&other, "within_noise"), other.len(), "{other:#?}");
}

/// A result of one run has no key figures: its values are compared, and times of the machine are not judged.
#[test]
fn exact_single_runs_are_compared_value_by_value() {
    let folder = folder();
    let path = folder.path();
    for (name, amplitude) in [("a.json", "1"), ("again.json", "1"), ("b.json", "0.9")] {
        result(path, name, &["simulate", "--duration", "0.6", "--amplitude", amplitude]);
    }
    let same = json(path, &["compare", "a.json", "again.json", "--format", "json"]);
    assert_eq!(same["changes"], 0, "{same}");
    let text = succeeds(path, &["compare", "a.json", "b.json"]);
    assert!(text.contains("| rotor_rate_mean_rad_s "), "{text}");
    assert!(!text.contains("| wall_s "), "{text}");
}

#[test]
fn tool_what_is_no_result_is_refused() {
    let folder = folder();
    let path = folder.path();
    result(path, "a.json", &["simulate", "--duration", "0.6"]);
    let whole = written(path, "a.json");
    fs::write(path.join("half.json"), &whole[..whole.len() / 2]).expect("a folder");
    fs::write(path.join("other.json"), "{\"rows\":[]}").expect("a folder");
    fs::write(path.join("bytes.json"), [0xff, 0xfe, 0x00]).expect("a folder");
    for (file, words) in [
        ("missing.json", "missing.json"),
        ("half.json", "half.json:1:"),
        ("other.json", "other.json: this is no result of host-sim: it has no field `command`"),
        ("bytes.json", "bytes.json:1:"),
    ] {
        refuses(path, &["compare", "a.json", file, "--report", "changes.html"], &[words]);
    }
    assert!(!path.join("changes.html").exists(), "no report of a comparison that was not made");
}
