//! The microcontroller's programs, built for it and run on an emulated one: the bits against the same code on the host,
//! the instructions against counts that were reviewed, the loop with the simulated motor.

mod board;
mod instructions;
mod pil;
mod serial;
mod size;

#[path = "../system/support/browser.rs"]
#[allow(dead_code, reason = "the system tests use the rest of it")]
mod browser;
#[path = "../system/support/page.rs"]
mod page;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use firmware_checks::parity::{LoopRun, TwinRun};
use motor_model::ImpactRule;

/// Long enough for a build of everything from clean on a slow machine.
const BUILD_LIMIT_S: &str = "1500";

/// A run takes about a second.
const RUN_LIMIT_S: &str = "120";

/// What `timeout` and a shell say of a program that is not there.
const NOT_FOUND: i32 = 127;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The command as cargo built it beside these tests, from the same `main.rs`.
fn host_sim() -> Command {
    without_unstable_options(env!("CARGO_BIN_EXE_host-sim-under-test"))
}

/// A command that builds as outside the tests: `tests/run.sh` lets their harness use options that are not stable, with
/// which cargo would build everything anew.
fn without_unstable_options(program: &str) -> Command {
    let mut command = Command::new(program);
    command.env_remove("RUSTC_BOOTSTRAP");
    command
}

/// A program of the microcontroller, built.
fn elf(program: &str) -> String {
    let built = script("build.sh", BUILD_LIMIT_S, &[program]);
    built.lines().last().expect("build.sh names the ELF").to_owned()
}

/// Output of a script of the firmware's within `limit_s`; fails with all that it printed unless it succeeds.
fn script(name: &str, limit_s: &str, arguments: &[&str]) -> String {
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

/// What the page's module computes in a browser.
const IN_THE_BROWSER: &str = "(async () => {
    const { default: load, parity } = await import('./web.js');
    await load({ module_or_path: new URL('web_bg.wasm', location) });
    return parity(); })()";

/// WebAssembly rounds every operation of `f32` as the microcontroller does; one libm serves all three.
#[test]
fn tool_emulated_cortex_m4f_and_webassembly_compute_the_bits_of_the_host() {
    let target = script("qemu.sh", RUN_LIMIT_S, &[&elf("parity")]);
    let served = page::Served::start(&page::built());
    let browser = browser::Browser::start();
    browser.open_address(served.address());
    let webassembly = browser.promised(IN_THE_BROWSER);
    let twin = |rule| TwinRun::compute(rule).expect("the nominal motor is within bounds");
    let whole_loop = LoopRun::compute(&mut None).expect("the targets are within bounds");
    let host = format!("{}\n{}\n{whole_loop}\n", twin(ImpactRule::EndOfStep), twin(ImpactRule::Located));
    assert!(host.contains("\ntwin_digest 0x") || host.starts_with("twin_digest 0x"), "{host}");
    assert!(host.contains("located_twin_digest 0x") && host.contains("loop_digest 0x"), "{host}");
    assert_eq!(target, host, "left: target, right: host");
    assert_eq!(webassembly, host.as_str(), "left: WebAssembly, right: host");
}
