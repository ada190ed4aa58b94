//! A file that has room for its end before its middle is written.
//!
//! Where the next bytes will stand the system is asked for room, or, where it cannot be asked, zeros are written. What
//! is written there later needs no more room. At the end the file is cut to what was written.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use super::error::{LogError, is_no_room};
use crate::report::OutputError;
use crate::report::files;

/// The zeros that are written at a time where the system cannot be asked for room.
static ZEROS: [u8; 1 << 16] = [0; 1 << 16];

/// A temporary file beside its destination.
#[derive(Debug)]
pub(super) struct HeldFile {
    file: NamedTempFile,
    destination: PathBuf,
    /// Where the next byte is written.
    position: u64,
    /// End of what was written.
    end: u64,
    /// End of the room behind it.
    held: u64,
}

impl HeldFile {
    /// Opens a file that will be at `destination`.
    pub(super) fn create(destination: &Path) -> Result<Self, OutputError> {
        let file = files::temporary(destination)?;
        Ok(Self { file, destination: destination.to_owned(), position: 0, end: 0, held: 0 })
    }

    /// Where it will be.
    pub(super) fn destination(&self) -> &Path {
        &self.destination
    }

    /// Bytes written.
    pub(super) fn len(&self) -> u64 {
        self.end
    }

    /// Finds room for `bytes` more.
    ///
    /// # Errors
    /// When there is none; what was written stays, and so does the room found before.
    pub(super) fn hold(&mut self, bytes: u64) -> io::Result<()> {
        let until = self.end.saturating_add(bytes);
        if until <= self.held {
            return Ok(());
        }
        let file = self.file.as_file_mut();
        file.seek(SeekFrom::Start(self.held))?;
        let found = hold_until(file, &mut self.held, until);
        // Where there is no room, what was held before is still there to be written to.
        file.seek(SeekFrom::Start(self.position))?;
        found
    }

    /// Cuts the file to what was written and gives it its name: that of the destination, or, if the run is not
    /// `whole` and there is a file already, a name beside it. Returns the name.
    pub(super) fn publish(self, whole: bool) -> Result<PathBuf, LogError> {
        let Self { file, destination, end, .. } = self;
        let path = if whole || !destination.exists() { destination } else { partial(&destination) };
        let refused = |source| LogError::unwritable(&path, source);
        file.as_file().set_len(end).map_err(refused)?;
        file.persist(&path).map_err(|error| refused(error.error))?;
        Ok(path)
    }
}

/// Finds room from `held` on, which goes on to `until`.
fn hold_until(file: &mut File, held: &mut u64, until: u64) -> io::Result<()> {
    if allocated(file, *held, until)? {
        *held = until;
        return Ok(());
    }
    write_zeros(file, held, until)
}

fn write_zeros(file: &mut File, held: &mut u64, until: u64) -> io::Result<()> {
    while *held < until {
        let bytes = ZEROS.len().min(usize::try_from(until - *held).unwrap_or(usize::MAX));
        let written = file.write(ZEROS.get(..bytes).unwrap_or_default())?;
        if written == 0 {
            return Err(io::ErrorKind::WriteZero.into());
        }
        *held += written as u64;
    }
    Ok(())
}

/// Asks the system for room from `from` to `until`; false where the file's system has no such call.
#[cfg(target_os = "linux")]
fn allocated(file: &File, from: u64, until: u64) -> io::Result<bool> {
    use rustix::fs::{FallocateFlags, fallocate};
    use rustix::io::Errno;
    match fallocate(file, FallocateFlags::empty(), from, until - from) {
        Ok(()) => Ok(true),
        Err(Errno::OPNOTSUPP | Errno::NOSYS | Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn allocated(_: &File, _: u64, _: u64) -> io::Result<bool> {
    Ok(false)
}

/// The name of what an unfinished run leaves beside a file that is there: `NAME.partial.EXTENSION`.
fn partial(destination: &Path) -> PathBuf {
    let extension = destination.extension().unwrap_or_default().to_string_lossy();
    destination.with_extension(format!("partial.{extension}"))
}

impl Write for HeldFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.as_file_mut().write(bytes)?;
        self.position += written as u64;
        self.end = self.end.max(self.position);
        self.held = self.held.max(self.end);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_file_mut().flush()
    }
}

impl Seek for HeldFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let to = match to {
            SeekFrom::End(offset) => SeekFrom::Start(self.end.saturating_add_signed(offset)),
            other => other,
        };
        self.position = self.file.as_file_mut().seek(to)?;
        Ok(self.position)
    }
}

/// A file that is written by the writer of a format, and held by its user.
#[derive(Clone, Debug)]
pub(super) struct SharedFile(Arc<Mutex<HeldFile>>);

impl SharedFile {
    pub(super) fn new(file: HeldFile) -> Self {
        Self(Arc::new(Mutex::new(file)))
    }

    /// The file, once nothing else has it.
    pub(super) fn into_inner(self) -> Result<HeldFile, LogError> {
        let file = Arc::into_inner(self.0).map(Mutex::into_inner);
        file.map(|file| file.unwrap_or_else(PoisonError::into_inner))
            .ok_or_else(|| LogError::Format("its file is still in use".to_owned()))
    }

    /// The file, for a moment.
    pub(super) fn lock(&self) -> MutexGuard<'_, HeldFile> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for SharedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lock().flush()
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.lock().seek(to)
    }
}

/// The error of a block for which there is no room, or of a system that refuses it.
pub(super) fn refusal(path: &Path, source: io::Error) -> LogError {
    if is_no_room(&source) {
        // The recorder knows how much of the run is in the file.
        let kept = super::error::Kept { path: path.to_owned(), until_s: 0.0 };
        LogError::Full { kept, source }
    } else {
        LogError::unwritable(path, source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is held is there for what comes, what is written over it is kept, and the end is cut to it.
    #[test]
    fn exact_a_held_file_ends_where_its_bytes_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut file = HeldFile::create(&path).unwrap();
        file.write_all(b"abc").unwrap();
        file.hold(100_000).unwrap();
        assert_eq!(file.file.as_file().metadata().unwrap().len(), 100_003);
        file.write_all(b"def").unwrap();
        file.hold(10).unwrap();
        assert_eq!((file.len(), file.held), (6, 100_003));
        assert_eq!(file.publish(true).unwrap(), path);
        assert_eq!(std::fs::read(&path).unwrap(), b"abcdef");
    }

    /// Without a call for room the zeros take it.
    #[test]
    fn exact_zeros_stand_where_there_is_no_call_for_room() {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(b"abc").unwrap();
        let mut held = 3;
        write_zeros(&mut file, &mut held, 100_003).unwrap();
        assert_eq!((held, file.metadata().unwrap().len()), (100_003, 100_003));
    }

    /// A file that is there stays beside what an unfinished run leaves.
    #[test]
    fn exact_an_unfinished_run_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        for (text, whole, name) in
            [("one", false, "run.csv"), ("two", false, "run.partial.csv"), ("three", true, "run.csv")]
        {
            let mut file = HeldFile::create(&path).unwrap();
            file.write_all(text.as_bytes()).unwrap();
            assert_eq!(file.publish(whole).unwrap(), folder.path().join(name));
            assert_eq!(std::fs::read_to_string(folder.path().join(name)).unwrap(), text);
        }
    }
}
