//! Files that appear whole or not at all.
//!
//! A result is written to a temporary file in the folder of its destination, and renamed over the destination when
//! everything is in it. A failed run leaves the earlier file. That the file can be written is tried before the run
//! starts. The temporary file is opened with the first byte: a run that is ended before, by Ctrl-C, leaves none.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::NamedTempFile;

use crate::report::OutputError;

/// Rows as CSV, their fields as columns. `header` has the names of the columns with commas between them; without it
/// they are the names of the fields, and no field has parts of its own.
///
/// # Errors
/// When a row has more or fewer columns than the header.
pub fn csv<R: Serialize>(
    header: Option<&str>,
    mut rows: impl Iterator<Item = R>,
) -> Result<String, OutputError> {
    let refused = |error: csv::Error| OutputError::Table(error.to_string());
    let mut writer = csv::WriterBuilder::new().has_headers(header.is_none()).from_writer(Vec::new());
    header.map_or(Ok(()), |names| writer.write_record(names.split(','))).map_err(refused)?;
    rows.try_for_each(|row| writer.serialize(row)).map_err(refused)?;
    let bytes = writer.into_inner().map_err(|error| OutputError::Table(error.to_string()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// JSON on one line.
pub fn json_line<V: Serialize + ?Sized>(value: &V) -> String {
    let mut text = serde_json::to_string(value).unwrap_or_default();
    text.push('\n');
    text
}

/// All bytes of the file at `path`.
///
/// # Errors
/// When it cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>, OutputError> {
    std::fs::read(path).map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })
}

/// A JSON array with one value a line.
pub fn json_lines<V: Serialize>(values: &[V]) -> String {
    let values: Vec<String> =
        values.iter().map(|value| serde_json::to_string(value).unwrap_or_default()).collect();
    format!("[\n{}\n]\n", values.join(",\n"))
}

/// A file that is being written.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    /// `None` before the first byte.
    writer: Option<BufWriter<NamedTempFile>>,
}

impl Output {
    /// A file that will be at `path` after [`Self::publish`].
    ///
    /// # Errors
    /// When `path` is a folder, or no file can be written in its folder.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        // Opened and dropped, which deletes the temporary file.
        temporary(path)?;
        Ok(Self { path: path.to_owned(), writer: None })
    }

    /// Renames the file over its destination.
    ///
    /// # Errors
    /// When the rest cannot be written or the file cannot be renamed; the destination is then unchanged.
    pub fn publish(self) -> Result<(), OutputError> {
        let Self { path, writer } = self;
        let persist = || {
            let writer = writer.map_or_else(|| opened(&path).map(BufWriter::new), Ok)?;
            let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.persist(&path).map_err(|error| error.error)
        };
        persist().map(|_| ()).map_err(|source| OutputError::Unwritable { path: path.clone(), source })
    }

    fn writer(&mut self) -> io::Result<&mut BufWriter<NamedTempFile>> {
        let writer = self.writer.take().map_or_else(|| opened(&self.path).map(BufWriter::new), Ok)?;
        Ok(self.writer.insert(writer))
    }

    /// The error that says that this file could not be written.
    pub fn unwritable(&self, source: io::Error) -> OutputError {
        OutputError::Unwritable { path: self.path.clone(), source }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), Write::flush)
    }
}

/// A temporary file in the folder of `path`, to be renamed to it.
///
/// # Errors
/// When `path` is a folder, or no file can be written in its folder.
pub(crate) fn temporary(path: &Path) -> Result<NamedTempFile, OutputError> {
    opened(path).map_err(|source| OutputError::Unwritable { path: path.to_owned(), source })
}

fn opened(path: &Path) -> io::Result<NamedTempFile> {
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let has_name = path.file_name().is_some() && !path.as_os_str().to_string_lossy().ends_with('/');
    if !has_name {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it names no file"));
    }
    if path.exists() && !path.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no ordinary file"));
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(io::Error::new(io::ErrorKind::NotFound, "its folder does not exist"));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".host-sim-");
    // A temporary file is private by default, a result is an ordinary file; the umask still applies.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // Only the kind: the text would name the temporary file.
    builder.tempfile_in(folder).map_err(|error| error.kind().into())
}

/// Whether two paths lead to one file that is there.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| std::fs::canonicalize(path).ok();
    place(one).is_some_and(|one| place(other) == Some(one))
}

/// A set of text files for one folder, published together at the end.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
}

impl OutputFolder {
    /// Makes the folder if it does not exist, and checks that files can be written there.
    ///
    /// # Errors
    /// When they cannot.
    pub fn create(folder: &Path) -> Result<Self, OutputError> {
        std::fs::create_dir_all(folder)
            .map_err(|source| OutputError::Unwritable { path: folder.to_owned(), source })?;
        temporary(&folder.join("probe"))?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes every file, name and text, before the first of them is renamed over its destination.
    ///
    /// # Errors
    /// When one cannot be written.
    pub fn publish(&self, files: &[(String, String)]) -> Result<(), OutputError> {
        let mut outputs = Vec::with_capacity(files.len());
        for (name, text) in files {
            let mut output = Output::create(&self.folder.join(name))?;
            output.write_all(text.as_bytes()).map_err(|source| output.unwritable(source))?;
            outputs.push(output);
        }
        outputs.into_iter().try_for_each(Output::publish)
    }
}

/// Writes `text` to standard output. A reader that has closed it is no error: what follows is done all the same.
///
/// # Errors
/// When standard output is full.
pub fn print(text: &str) -> Result<(), OutputError> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(OutputError::StandardOutput).or_else(|error| match error {
        error if error.is_broken_pipe() => Ok(()),
        error => Err(error),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn exact_the_old_file_stays_until_the_new_one_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.csv");
        fs::write(&path, "old").unwrap();

        let mut abandoned = Output::create(&path).unwrap();
        abandoned.write_all(b"half").unwrap();
        abandoned.flush().unwrap();
        drop(abandoned);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");

        let mut output = Output::create(&path).unwrap();
        output.write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        output.publish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
    }

    /// A run that Ctrl-C ends before it has a result drops nothing: there must be no file that would stay.
    #[test]
    fn exact_before_the_first_byte_there_is_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let files = || fs::read_dir(folder.path()).unwrap().count();
        let mut output = Output::create(&folder.path().join("result.csv")).unwrap();
        assert_eq!(files(), 0);
        output.write_all(b"first").unwrap();
        assert_eq!(files(), 1);
        drop(output);
        Output::create(&folder.path().join("empty.csv")).unwrap().publish().unwrap();
        assert_eq!(fs::read(folder.path().join("empty.csv")).unwrap(), b"");
    }

    #[test]
    fn exact_unwritable_places_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path().join("missing/result.csv");
        for path in [nowhere.as_path(), folder.path(), Path::new("/dev/null"), Path::new("")] {
            assert!(
                matches!(Output::create(path), Err(OutputError::Unwritable { .. })),
                "{}",
                path.display()
            );
        }
        assert!(OutputFolder::create(Path::new("/dev/null/x")).is_err());
    }
}
