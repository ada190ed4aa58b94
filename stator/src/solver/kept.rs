//! Results that are kept, by a hash of their deck.

use std::fs;
use std::hash::Hasher as _;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use fnv::FnvHasher;

/// The file of a deck's results: two hashes of 64 bits, of the deck forward and backward, so that two decks with the
/// same name are out of the question.
pub(super) fn path(folder: &Path, deck: &str) -> PathBuf {
    let (mut forward, mut backward) = (FnvHasher::default(), FnvHasher::default());
    forward.write(deck.as_bytes());
    deck.bytes().rev().for_each(|byte| backward.write_u8(byte));
    folder.join(format!("{:016x}{:016x}.dat", forward.finish(), backward.finish()))
}

/// What is kept in a file, if it is there and can be read.
pub(super) fn read(path: &Path) -> Option<String> {
    super::read_bounded(path).ok()
}

/// Keeps `text`: under another name first, so that a reader finds all of it or nothing.
pub(super) fn write(path: &Path, text: &str) -> io::Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(text.as_bytes())?;
    file.persist(path)?;
    Ok(())
}
