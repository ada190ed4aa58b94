//! Python with its packages: what other people's readers find in files that the command wrote, and `HyperQueue`.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use super::checkout::root;

/// The interpreter of an environment with the packages of the file `requirements`. It is kept beside what cargo builds.
fn environment(name: &str, requirements: &str) -> String {
    let script = root().join("tests/logs/environment.sh");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let output = Command::new(script).arg(folder).arg(root().join(requirements)).output().expect("bash");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text").trim().to_owned()
}

/// The interpreter of `tests/logs/readers.py` and of the module's tests, whose environment is made once.
pub fn python() -> &'static str {
    static PYTHON: OnceLock<String> = OnceLock::new();
    PYTHON.get_or_init(|| environment("python", "tests/logs/requirements.txt"))
}

/// The interpreter of `tests/cluster/hyperqueue_cluster.py`.
pub fn hyperqueue() -> String {
    environment("hyperqueue", "tests/cluster/requirements.txt")
}

/// What the readers find in the files of a folder, by name.
#[track_caller]
pub fn found(folder: &Path, files: &[&str]) -> Value {
    let script = root().join("tests/logs/readers.py");
    let output = Command::new(python()).arg(script).args(files).current_dir(folder).output().expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}
