//! Puts the memory map on the link path and names the linker scripts, on the microcontroller only.
//!
//! This is not in `.cargo/config.toml`, because Cargo ignores all flags there when somebody sets `RUSTFLAGS`.

use std::env;

/// The linker's arguments for a program on the microcontroller.
const LINK_ARGUMENTS: [&str; 3] = [
    // Sections need no page alignment on a part without pages.
    "--nmagic",
    "-Tlink.x",
    // The texts of the log, which stay in the ELF.
    "-Tdefmt.x",
];

fn main() {
    println!("cargo::rerun-if-changed=memory");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
        let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
        let boards = [("STM32G474", "stm32g474"), ("STM32H743", "stm32h743"), ("CHECKS", "mps2-checks")];
        let board = boards.into_iter().find(|&(feature, _)| has(feature)).map_or("mps2", |(_, board)| board);
        println!("cargo::rustc-link-search={folder}/memory/{board}");
        for argument in LINK_ARGUMENTS {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
        // For the build script of a package with programs of its own: `links` in Cargo.toml.
        println!("cargo::metadata=link_arguments={}", LINK_ARGUMENTS.join(" "));
    }
}
