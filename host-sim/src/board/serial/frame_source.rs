//! Where camera frames come from.

use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::sync::mpsc::Sender;

use super::frame_text::{FrameText, FrameTextError, HostFrame, LINE_BYTES_MAX};
use super::session::Event;
use crate::report::OutputError;

/// Where camera frames come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum FrameSource {
    /// The simulated plant, driven by what the board reports: hardware in the loop.
    #[default]
    Plant,
    /// Lines of text on standard input.
    StandardInput,
    /// Lines of text in a file or a named pipe.
    File(PathBuf),
}

impl FrameSource {
    /// The source of this name: `plant`, `-` for standard input, or a file.
    pub fn named(name: &str) -> Self {
        match name {
            "plant" => Self::Plant,
            "-" => Self::StandardInput,
            file => Self::File(PathBuf::from(file)),
        }
    }

    /// Refuses a file that is not there, and a folder. A named pipe is not opened yet: that waits for its writer.
    ///
    /// # Errors
    /// When the file cannot be found, or is a folder.
    pub fn check(&self) -> Result<(), OutputError> {
        let Self::File(path) = self else { return Ok(()) };
        let found = std::fs::metadata(path).and_then(|found| {
            if found.is_dir() { Err(std::io::ErrorKind::IsADirectory.into()) } else { Ok(()) }
        });
        found.map_err(|source| OutputError::Unreadable { path: path.clone(), source })
    }

    /// Reads lines into `events` from a thread of its own; nothing of the plant, which has none.
    pub(super) fn forward_to(&self, events: Sender<Event>) {
        let source = self.clone();
        match source {
            Self::Plant => {}
            Self::StandardInput => {
                std::thread::spawn(move || forward("-", std::io::stdin(), &events));
            }
            Self::File(path) => {
                std::thread::spawn(move || {
                    let name = path.display().to_string();
                    match std::fs::File::open(&path) {
                        Ok(file) => forward(&name, file, &events),
                        Err(error) => {
                            let at = FrameText::new(&name).place();
                            let failed = FrameTextError::Unreadable { at, reason: error.to_string() };
                            let _ = events.send(Event::SourceFailed(failed));
                        }
                    }
                });
            }
        }
    }
}

/// Sends every frame, and at last the end of the source or what is wrong with it.
fn forward(name: &str, source: impl Read, events: &Sender<Event>) {
    let mut text = FrameText::new(name);
    let mut source = BufReader::new(source);
    loop {
        match next_frame(&mut text, &mut source) {
            Ok(Some(frame)) => {
                if events.send(Event::Frame(frame)).is_err() {
                    return;
                }
            }
            Ok(None) => {
                let _ = events.send(Event::SourceEnded);
                return;
            }
            Err(error) => {
                let _ = events.send(Event::SourceFailed(error));
                return;
            }
        }
    }
}

/// The next frame; `None` at the end. No more of a line is read than a line may have.
fn next_frame(text: &mut FrameText, source: &mut impl BufRead) -> Result<Option<HostFrame>, FrameTextError> {
    loop {
        let mut line = Vec::new();
        let read = source.take(LINE_BYTES_MAX as u64 + 2).read_until(b'\n', &mut line);
        match read {
            Ok(0) => return Ok(None),
            Ok(_) => {
                if let Some(frame) = text.read(String::from_utf8_lossy(&line).trim_end_matches('\n'))? {
                    return Ok(Some(frame));
                }
            }
            Err(error) => {
                return Err(FrameTextError::Unreadable { at: text.place(), reason: error.to_string() });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_folder_is_no_source() {
        let folder = tempfile::tempdir().unwrap();
        let checked = FrameSource::File(folder.path().to_owned()).check().unwrap_err();
        assert!(checked.to_string().contains("is a directory"), "{checked}");
        assert!(
            FrameSource::named("-").check().is_ok() && FrameSource::named("no-such-file").check().is_err()
        );
    }
}
