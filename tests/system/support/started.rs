//! The built `host-sim` command while it runs: started, told to end, and what it leaves.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Starts the command in a folder, after the words of bash `before`.
pub fn start(folder: &Path, before: &str, arguments: &[&str]) -> Child {
    let command = format!("{before} exec \"$0\" \"$@\"");
    let mut bash = Command::new("bash");
    bash.args(["-c", &command, env!("CARGO_BIN_EXE_host-sim-under-test")]).args(arguments);
    bash.current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("bash")
}

/// Exit code, and the one line on standard error, beside notes.
#[track_caller]
pub fn ended(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("it ends");
    let complaint = String::from_utf8(output.stderr).expect("text");
    assert_eq!(
        complaint.trim_end().lines().filter(|line| !line.starts_with("note: ")).count(),
        1,
        "{complaint}"
    );
    assert!(output.stdout.is_empty());
    (output.status.code(), complaint)
}

/// Sends a signal: `INT`, `KILL`.
#[track_caller]
pub fn signal(child: &Child, name: &str) {
    let told = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(told.expect("kill").success());
}

/// Waits until something holds, a minute at most.
#[track_caller]
pub fn wait_until(what: &str, holds: impl Fn() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(60), "{what} does not come");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The files of a folder that a run left, temporary ones included.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
