//! Python with the packages of `tests/logs`: what other people's readers find in files that the command wrote.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use super::checkout::root;

/// The interpreter of `tests/logs/readers.py`, whose environment is made once and kept beside what cargo builds.
pub fn python() -> &'static str {
    static PYTHON: OnceLock<String> = OnceLock::new();
    PYTHON.get_or_init(|| {
        let script = root().join("tests/logs/environment.sh");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("log-readers");
        let output = Command::new(script).arg(folder).output().expect("bash");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text").trim().to_owned()
    })
}

/// What the readers find in the files of a folder, by name.
#[track_caller]
pub fn found(folder: &Path, files: &[&str]) -> Value {
    let script = root().join("tests/logs/readers.py");
    let output = Command::new(python()).arg(script).args(files).current_dir(folder).output().expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}
