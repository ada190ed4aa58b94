//! Puts the memory map on the link path and names the linker scripts, on the microcontroller only; tells the programs which compiler
//! builds them.
//!
//! Here rather than in `.cargo/config.toml`, whose flags are dropped whole when somebody sets `RUSTFLAGS`.

use std::env;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=memory");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=FIRMWARE_RUSTC={}", compiler());
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
        let board = if env::var_os("CARGO_FEATURE_STM32G474").is_some() { "stm32g474" } else { "mps2" };
        println!("cargo::rustc-link-search={folder}/memory/{board}");
        // Sections need no page alignment on a part without pages.
        println!("cargo::rustc-link-arg-bins=--nmagic");
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
        // The texts of the log, which stay in the ELF.
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
}

/// What the compiler says of itself, as in `rustc 1.95.0 (59807616e 2026-04-14)`.
fn compiler() -> String {
    let rustc = env::var_os("RUSTC").expect("cargo sets RUSTC");
    let output = Command::new(rustc).arg("--version").output().expect("the compiler starts");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}
