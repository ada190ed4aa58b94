//! What the board is: which loop it was built of, and why it started.

use serde::{Deserialize, Serialize};

use crate::numbering::Coded;

/// Digest of the sources of loop and firmware: motor model, filter core, estimator, controller, this protocol, the
/// firmware of all boards, and the versions of other people's crates (`Cargo.lock`).
///
/// Where host and board have the same, the board was built of the sources that the host simulates. It does not cover
/// how they were built: the part and the other features, the compiler, its options, and the manifests and linker
/// scripts. Another digest may be another comment, or the file of another board. It is a CRC-64: it tells sources
/// apart, and protects from nothing.
pub const LOOP_DIGEST: u64 = match u64::from_str_radix(env!("LOOP_DIGEST"), 16) {
    Ok(digest) => digest,
    Err(_) => 0,
};

/// Why the board started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResetCause {
    /// The board does not know.
    #[default]
    Unknown,
    /// Its supply came, or sank and came back.
    Power,
    /// The pin for it was low, by a button or a debugger.
    Pin,
    /// The watchdog was not fed: the main loop had stopped.
    Watchdog,
    /// The program asked for it.
    Software,
    /// Something else: an option byte was loaded, or a low-power mode entered that is not allowed.
    Other,
    /// The program had found an error of its own, and ended.
    Panic,
    /// The processor had found one: a fault.
    Fault,
}

/// What the board is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoardIdentity {
    /// The [`LOOP_DIGEST`] that it was built with.
    pub loop_digest: u64,
    /// Why it started.
    pub reset_cause: Coded<ResetCause>,
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::collections::BTreeMap;
    use std::path::{Path, PathBuf};
    use std::{fs, vec};

    use super::LOOP_DIGEST;

    /// The digest again, of what loop and firmware are made of: paths from this crate's folder and contents, in the
    /// order of the paths.
    #[test]
    fn dual_the_digest_is_of_loop_firmware_and_versions() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut files = BTreeMap::<PathBuf, vec::Vec<u8>>::new();
        let crates =
            ["./", "../motor-model/", "../ud-filter/", "../estimator/", "../controller/", "../firmware/"];
        let mut left = vec![PathBuf::from("../Cargo.lock")];
        left.extend(crates.map(|name| Path::new(name).join("src")));
        while let Some(path) = left.pop() {
            if let Ok(entries) = fs::read_dir(here.join(&path)) {
                left.extend(entries.map(|entry| path.join(entry.unwrap().file_name())));
            } else {
                let content = fs::read(here.join(&path)).unwrap();
                files.insert(path, content);
            }
        }
        let crc = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
        let mut digest = crc.digest();
        for (path, content) in files {
            digest.update(path.to_str().unwrap().as_bytes());
            digest.update(&content);
        }
        assert_eq!(LOOP_DIGEST, digest.finalize());
    }
}
