//! Puts the memory map on the link path and names the linker scripts, on the microcontroller only.
//!
//! Here rather than in `.cargo/config.toml`, whose flags are dropped whole when somebody sets `RUSTFLAGS`.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
        println!("cargo::rustc-link-search={folder}");
        // Sections need no page alignment on a part without pages.
        println!("cargo::rustc-link-arg-bins=--nmagic");
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
    }
}
