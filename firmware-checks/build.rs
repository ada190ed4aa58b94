//! Links the programs with the arguments of the firmware, on the microcontroller only; names the compiler to the
//! programs.

use std::env;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=COMPILER={}", compiler());
    // From `firmware/build.rs`, which also puts the folder of `memory.x` on the link path of all dependents.
    for argument in env::var("DEP_FIRMWARE_LINK_ARGUMENTS").unwrap_or_default().split_whitespace() {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}

/// Name and version of the compiler, as in `rustc 1.95.0 (59807616e 2026-04-14)`.
fn compiler() -> String {
    let rustc = env::var_os("RUSTC").expect("cargo sets RUSTC");
    let output = Command::new(rustc).arg("--version").output().expect("the compiler starts");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}
