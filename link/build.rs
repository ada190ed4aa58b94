//! Makes the digest of the sources of loop and firmware, `link::LOOP_DIGEST`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crc::{CRC_64_XZ, Crc};

/// All that loop and firmware are made of, from this folder. Outside of the repository this crate is alone.
const CRATES: [&str; 6] =
    ["../motor-model", "../ud-filter", "../estimator", "../controller", ".", "../firmware"];

/// The versions of other people's crates.
const LOCK: &str = "../Cargo.lock";

fn main() -> io::Result<()> {
    let mut files = Vec::new();
    for name in CRATES {
        let sources = Path::new(name).join("src");
        if sources.is_dir() {
            println!("cargo::rerun-if-changed={}", sources.display());
            collect(&sources, &mut files)?;
        }
    }
    if Path::new(LOCK).is_file() {
        println!("cargo::rerun-if-changed={LOCK}");
        files.push(LOCK.into());
    }
    files.sort();
    let crc = Crc::<u64>::new(&CRC_64_XZ);
    let mut digest = crc.digest();
    for file in files {
        digest.update(file.to_string_lossy().replace('\\', "/").as_bytes());
        digest.update(&fs::read(&file)?);
    }
    println!("cargo::rustc-env=LOOP_DIGEST={:016x}", digest.finalize());
    Ok(())
}

/// Every file of a folder and of those in it.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { collect(&path, files)? } else { files.push(path) }
    }
    Ok(())
}
