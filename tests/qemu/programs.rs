//! The command, and the microcontroller's programs and scripts, as these tests build and start them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Long enough for a build of everything from clean on a slow machine.
const BUILD_LIMIT_S: &str = "1500";

/// What `timeout` and a shell say of a program that is not there.
const NOT_FOUND: i32 = 127;

pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The command as cargo built it beside these tests, from the same `main.rs`.
pub fn host_sim() -> Command {
    without_unstable_options(env!("CARGO_BIN_EXE_host-sim-under-test"))
}

/// A command that builds as outside the tests: `tests/run.sh` lets their harness use options that are not stable, with
/// which cargo would build everything anew.
pub fn without_unstable_options(program: &str) -> Command {
    let mut command = Command::new(program);
    command.env_remove("RUSTC_BOOTSTRAP");
    command
}

/// A program of the microcontroller, built.
pub fn elf(program: &str) -> String {
    elf_with(&[program])
}

/// The same with one filter alone, or for a part, or scripted: the word for it after the name of the program.
pub fn elf_with(program_and_filter: &[&str]) -> String {
    let built = script("build.sh", BUILD_LIMIT_S, program_and_filter);
    built.lines().last().expect("build.sh names the ELF").to_owned()
}

/// Output of a script of the firmware's within `limit_s`; fails with all that it printed unless it succeeds.
pub fn script(name: &str, limit_s: &str, arguments: &[&str]) -> String {
    let Output { status, stdout, stderr } = without_unstable_options("timeout")
        .arg(limit_s)
        .arg(repository().join("firmware").join(name))
        .args(arguments)
        .output()
        .expect("timeout (coreutils) starts");
    let (stdout, stderr) = (String::from_utf8_lossy(&stdout).into_owned(), String::from_utf8_lossy(&stderr));
    assert!(status.code() != Some(NOT_FOUND), "a tool is missing, tests/run.sh installs it\n{stderr}");
    assert!(
        status.success(),
        "firmware/{name} {arguments:?}: {status} (124: more than {limit_s} s)\n{stdout}{stderr}"
    );
    stdout
}
