//! Says which filters the program holds, by `cfg(holds_twin)` and the like. Puts the memory map on the link path and
//! names the linker scripts, on the microcontroller only.
//!
//! The latter is not in `.cargo/config.toml`, because Cargo ignores all flags there when somebody sets `RUSTFLAGS`.

use std::env;

#[path = "src/part_filters.rs"]
mod part_filters;

/// The linker's arguments for a program on the microcontroller.
const LINK_ARGUMENTS: [&str; 3] = [
    // Sections need no page alignment on a part without pages.
    "--nmagic",
    "-Tlink.x",
    // The texts of the log, which stay in the ELF.
    "-Tdefmt.x",
];

/// Whether a feature is on.
fn has(feature: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase())).is_some()
}

/// Says which filters the program holds, and which it does not, although it was asked for.
fn hold_filters() {
    for filter in part_filters::OPTIONAL_FILTERS {
        println!("cargo::rustc-check-cfg=cfg(holds_{filter})");
        if part_filters::is_held(filter, has) {
            println!("cargo::rustc-cfg=holds_{filter}");
        } else if has(filter) {
            println!(
                "cargo::warning=no {filter}: the part has no time for it; every_filter takes it nevertheless"
            );
        }
    }
}

fn main() {
    println!("cargo::rerun-if-changed=memory");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/part_filters.rs");
    hold_filters();
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
        let boards = [("stm32g474", "stm32g474"), ("stm32h743", "stm32h743"), ("checks", "mps2-checks")];
        let board = boards.into_iter().find(|&(feature, _)| has(feature)).map_or("mps2", |(_, board)| board);
        println!("cargo::rustc-link-search={folder}/memory/{board}");
        for argument in LINK_ARGUMENTS {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
        // For the build script of a package with programs of its own: `links` in Cargo.toml.
        println!("cargo::metadata=link_arguments={}", LINK_ARGUMENTS.join(" "));
    }
}
