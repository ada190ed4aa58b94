//! Where camera frames come from.
//!
//! | source | instant of an exposure | its frame is there |
//! |---|---|---|
//! | the simulated plant | by the board's clock | when the board has reported as far |
//! | standard input, a named pipe, a TCP port | the line's time of day | when the line is |
//! | a file: a recording | the run's begin, and the line's time since the first line | the camera's latency after it |

use std::io::{self, BufRead, BufReader, Read};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::time::Duration;

use super::frame_text::{FrameText, FrameTextError, HostFrame, LINE_BYTES_MAX};
use super::host_clock::{self, host_nanos};
use super::session::Event;
use crate::report::OutputError;

/// Longest wait for a camera program at a TCP port.
const CONNECTION_MAX: Duration = Duration::from_secs(2);

/// Where camera frames come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum FrameSource {
    /// The simulated plant, driven by what the board reports: hardware in the loop.
    #[default]
    Plant,
    /// Lines of text on standard input.
    StandardInput,
    /// Lines of text in a file, which is a recording, or in a named pipe.
    File(PathBuf),
    /// Lines of text from a program that listens at this host and port, `HOST:PORT`.
    Tcp(String),
}

impl FrameSource {
    /// The source of this name: `plant`, `-` for standard input, `tcp:HOST:PORT`, or a file.
    pub fn named(name: &str) -> Self {
        match (name, name.strip_prefix("tcp:")) {
            ("plant", _) => Self::Plant,
            ("-", _) => Self::StandardInput,
            (_, Some(address)) => Self::Tcp(address.to_owned()),
            (file, None) => Self::File(PathBuf::from(file)),
        }
    }

    /// Looks for the source. A named pipe is not opened yet: that waits for its writer.
    ///
    /// # Errors
    /// When the file cannot be found, or is a folder, or nothing listens at the port.
    pub(super) fn find(&self) -> Result<FoundSource, OutputError> {
        let unreadable = |path: PathBuf| |source| OutputError::Unreadable { path, source };
        Ok(match self {
            Self::Plant => FoundSource::Plant,
            Self::StandardInput => FoundSource::StandardInput,
            Self::File(path) => {
                let found = std::fs::metadata(path).and_then(|found| {
                    if found.is_dir() { Err(io::ErrorKind::IsADirectory.into()) } else { Ok(found) }
                });
                let is_recording = found.map_err(unreadable(path.clone()))?.is_file();
                FoundSource::File { path: path.clone(), is_recording }
            }
            Self::Tcp(address) => {
                let name = format!("tcp:{address}");
                let stream = connected(address).map_err(unreadable(PathBuf::from(&name)))?;
                FoundSource::Tcp { name, stream }
            }
        })
    }
}

/// A connection to one of the addresses of `HOST:PORT`.
fn connected(address: &str) -> io::Result<TcpStream> {
    let mut refused = io::ErrorKind::AddrNotAvailable.into();
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECTION_MAX) {
            Ok(stream) => return Ok(stream),
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

/// A source that is there, before its first line is read.
pub(super) enum FoundSource {
    Plant,
    StandardInput,
    File { path: PathBuf, is_recording: bool },
    Tcp { name: String, stream: TcpStream },
}

impl FoundSource {
    /// Reads lines into `events` from a thread of its own; nothing of the plant, which has none. A run begins now; the
    /// frames of its camera are there `latency_nanos` after their exposure.
    pub(super) fn forward_to(self, events: Sender<Event>, latency_nanos: i64) {
        match self {
            Self::Plant => {}
            Self::StandardInput => forward("-".to_owned(), || Ok(io::stdin()), LineTimes::Live, events),
            Self::File { path, is_recording } => {
                let times = if is_recording {
                    LineTimes::Recorded { begun_nanos: host_nanos(), latency_nanos, first_nanos: None }
                } else {
                    LineTimes::Live
                };
                let name = path.display().to_string();
                forward(name, move || std::fs::File::open(&path), times, events);
            }
            Self::Tcp { name, stream } => forward(name, || Ok(stream), LineTimes::Live, events),
        }
    }
}

/// What the times of lines mean.
#[derive(Clone, Copy, Debug)]
enum LineTimes {
    /// They are times of day.
    Live,
    /// Only their differences count.
    Recorded {
        /// When the run began, by the host's clock.
        begun_nanos: i64,
        /// Time in ns from an exposure until its frame is there.
        latency_nanos: i64,
        /// The time of the first line.
        first_nanos: Option<i64>,
    },
}

impl LineTimes {
    /// The frame of a line by the host's clock, and when it is there by that clock; `None` where it is there now.
    fn frame(&mut self, line: HostFrame) -> (HostFrame, Option<i64>) {
        match self {
            Self::Live => {
                let exposed_nanos = host_clock::of_day(line.exposed_nanos);
                (HostFrame { exposed_nanos, ..line }, None)
            }
            Self::Recorded { begun_nanos, latency_nanos, first_nanos } => {
                let first_nanos = *first_nanos.get_or_insert(line.exposed_nanos);
                let exposed_nanos = begun_nanos.saturating_add(line.exposed_nanos - first_nanos);
                (HostFrame { exposed_nanos, ..line }, Some(exposed_nanos.saturating_add(*latency_nanos)))
            }
        }
    }
}

/// Forwards the lines of a source from a thread of its own.
fn forward<R: Read>(
    name: String,
    open: impl FnOnce() -> io::Result<R> + Send + 'static,
    times: LineTimes,
    events: Sender<Event>,
) {
    std::thread::spawn(move || match open() {
        Ok(source) => forward_lines(&name, source, times, &events),
        Err(error) => {
            let at = FrameText::new(&name).place();
            let failed = FrameTextError::Unreadable { at, reason: error.to_string() };
            let _ = events.send(Event::SourceFailed(failed));
        }
    });
}

/// Sends every frame when it is there, and at last the end of the source or what is wrong with it. No line of a
/// recording is read before the frame of the one before it is sent.
fn forward_lines(name: &str, source: impl Read, mut times: LineTimes, events: &Sender<Event>) {
    let mut text = FrameText::new(name);
    let mut source = BufReader::new(source);
    loop {
        match next_frame(&mut text, &mut source) {
            Ok(Some(line)) => {
                let (frame, due) = times.frame(line);
                let wait = due.map_or(0, |due| due.saturating_sub(host_nanos()));
                std::thread::sleep(Duration::from_nanos(u64::try_from(wait).unwrap_or(0)));
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
    use std::io::Write as _;
    use std::net::TcpListener;
    use std::sync::mpsc::channel;

    use motor_model::Angle;

    use super::*;

    #[test]
    fn exact_a_folder_is_no_source() {
        let folder = tempfile::tempdir().unwrap();
        let found = FrameSource::File(folder.path().to_owned()).find().err().unwrap();
        assert!(found.to_string().contains("is a directory"), "{found}");
        assert!(FrameSource::named("-").find().is_ok() && FrameSource::named("no-such-file").find().is_err());
    }

    /// A recording of 2001, with a latency of 3 ms: its first frame is exposed when the run begins, and each is there 3
    /// ms after its exposure. One that lasts longer than any run does not run over.
    #[test]
    fn exact_a_recording_begins_with_the_run() {
        const MS: i64 = 1_000_000;
        let line = |ms: i64| HostFrame { exposed_nanos: ms * MS, angle: Angle::ZERO, residual: 3 };
        let begun_nanos = 7 * MS;
        let mut times = LineTimes::Recorded { begun_nanos, latency_nanos: 3 * MS, first_nanos: None };
        for (ms, since_ms) in [(1_000_000_000_000, 0), (1_000_000_000_002, 2), (1_000_000_005_000, 5000)] {
            let (frame, due) = times.frame(line(ms));
            assert_eq!(frame, HostFrame { exposed_nanos: begun_nanos + since_ms * MS, ..line(0) });
            assert_eq!(due, Some(begun_nanos + (since_ms + 3) * MS));
        }
        let late = times.frame(HostFrame { exposed_nanos: i64::MAX, ..line(0) });
        assert!(late.0.exposed_nanos > 0 && late.1 > Some(0), "{late:?}");
    }

    /// The frames of a file, in their order, none before it is there; then its end.
    #[test]
    fn exact_a_file_is_a_recording() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.txt");
        std::fs::write(&path, "1000000000.000 12 3\n1000000000.010 13 3\n").unwrap();
        let found = FrameSource::named(path.to_str().unwrap()).find().unwrap();
        let (to_events, events) = channel();
        let begun = host_nanos();
        found.forward_to(to_events, 2_000_000);
        let frames: Vec<(HostFrame, i64)> = events
            .iter()
            .map_while(|event| match event {
                Event::Frame(frame) => Some((frame, host_nanos())),
                _ => None,
            })
            .collect();
        let [(first, first_at), (second, second_at)] = frames[..] else { panic!("{frames:?}") };
        assert!(first.exposed_nanos >= begun, "{first:?}");
        // Their times have seven digits after the second.
        let apart = second.exposed_nanos - first.exposed_nanos;
        assert!((apart - 10_000_000).abs() <= 1_000, "{apart}");
        assert!(first_at - first.exposed_nanos >= 2_000_000 && second_at - second.exposed_nanos >= 2_000_000);
    }

    /// Lines of a program that listens at a port: their times are times of day. At a port at which nobody listens there
    /// is no source.
    #[test]
    fn exact_frames_of_a_tcp_port() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let name = format!("tcp:{}", listener.local_addr().unwrap());
        let source = FrameSource::named(&name);
        let found = source.find().unwrap();
        let (mut camera, _) = listener.accept().unwrap();
        drop(listener);
        let now = host_clock::day_nanos();
        writeln!(camera, "{:.6} 12 3", host_clock::seconds(now)).unwrap();
        drop(camera);
        let (to_events, events) = channel();
        let before = host_nanos();
        found.forward_to(to_events, 0);
        let Ok(Event::Frame(frame)) = events.recv() else { panic!("a frame") };
        assert_eq!((frame.angle, frame.residual), (Angle::from_degrees(12.0), 3));
        assert!((frame.exposed_nanos - before).abs() < 60_000_000_000, "{frame:?}");
        assert!(matches!(events.recv(), Ok(Event::SourceEnded)));
        let error = source.find().err().unwrap().to_string();
        assert!(error.starts_with(&format!("cannot read {name}: ")), "{error}");
    }
}
