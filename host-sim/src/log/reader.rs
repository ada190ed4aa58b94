//! An MCAP log, read message by message in bounded memory, up to its end or to the first damage.
//!
//! Messages have to stand in the order in which the loop took them in: a tool that sorts a log by time breaks that, and
//! is found out where an arrival is earlier than the one before it.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use motor_model::Time;
use prost::Message as _;

use super::channels::{self, CHANNELS};
use super::error::LogError;
use super::mcap_log::FORMAT;
use crate::report::OutputError;
use simulation::scene::Scene;

/// Largest record or chunk that is read, in bytes; a log of this program has chunks of 1 MiB.
const RECORD_BYTES_MAX: usize = 1 << 26;

/// A message of a log.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is the message of its channel")]
pub enum LogMessage {
    Impact(channels::Impact),
    VibrometerSample(channels::VibrometerSample),
    CameraFrame(channels::CameraFrame),
    Marks(channels::Marks),
    Innovation(channels::Innovation),
    Truth(channels::Truth),
    Tilt(channels::Tilt),
    Estimate(channels::Estimate),
    Reference(channels::Reference),
    Health(channels::Health),
    Task(channels::Task),
    Drive(channels::Drive),
}

/// A part of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum LogPart {
    /// A message, with the time of what it shows.
    Message(Time, LogMessage),
    /// What the run gave, in JSON.
    Result(String),
    /// How the run ended: whole, interrupted or no room.
    Ended(String),
}

/// What a log says of its run.
#[derive(Clone, Debug)]
pub struct LogHead {
    /// The command: `position`, `rate`, `import`.
    pub command: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// The filter that ran; `none` of an import.
    pub filter: String,
    /// Length of a tick.
    pub tick_nanos: u64,
    /// Ticks from one logged estimate to the next.
    pub every: u64,
    /// The effective scene.
    pub scene: Scene,
}

/// Reads a log from any source.
pub struct LogReader<R = BufReader<File>> {
    path: PathBuf,
    source: R,
    reader: LinearReader,
    /// Topics of the channels seen, as places among [`CHANNELS`].
    places: HashMap<u16, Option<usize>>,
    schemas: HashMap<u16, String>,
    last: Time,
    ended: bool,
}

/// Head of the log at `path`, and its reader from the start on.
///
/// # Errors
/// When it cannot be read, is no log of this program, or is of another version.
pub fn open(path: &Path) -> Result<(LogHead, LogReader), LogError> {
    let file = || {
        let file = File::open(path).map(BufReader::new);
        file.map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })
    };
    let head = read_head(path, file()?)?;
    Ok((head, LogReader::new(path, file()?)))
}

/// Head of the log that `source` reads, found before its first chunk or after its last one.
///
/// # Errors
/// When it is no log of this program, or of another version.
pub fn read_head(path: &Path, source: impl Read) -> Result<LogHead, LogError> {
    let not_a_log = |why: &str| LogError::NotALog { path: path.to_owned(), why: why.to_owned() };
    let mut reader = LogReader::raw(path, source, true);
    let (mut facts, mut scene) = (None, None);
    while facts.is_none() || scene.is_none() {
        match reader.record() {
            Ok(Some(Record::Metadata(metadata))) if metadata.name == "host-sim" => {
                facts = Some(metadata.metadata);
            }
            Ok(Some(Record::Attachment { header, data, .. })) if header.name == "scene.toml" => {
                scene = Some(String::from_utf8_lossy(&data).into_owned());
            }
            Ok(Some(_)) => {}
            Ok(None) => {
                return Err(not_a_log("an MCAP file of another program: it has no metadata `host-sim`"));
            }
            Err(mcap::McapError::BadMagic) => {
                return Err(not_a_log("no MCAP file: it does not begin as one"));
            }
            Err(error) => return Err(not_a_log(&format!("it ends before its head: {error}"))),
        }
    }
    let (facts, text) = (facts.unwrap_or_default(), scene.unwrap_or_default());
    let fact = |key: &str| facts.get(key).cloned().unwrap_or_default();
    if fact("format") != FORMAT {
        let (found, version) = (fact("format"), fact("version"));
        return Err(LogError::OtherFormat { path: path.to_owned(), found, version });
    }
    let number =
        |key: &str| fact(key).parse().ok().filter(|number: &u64| (1..=1_000_000_000).contains(number));
    let (Some(tick_nanos), Some(every)) = (number("tick_ns"), number("ticks_per_estimate")) else {
        return Err(not_a_log("its metadata does not say how long a tick is"));
    };
    let mut scene = Scene::default();
    let inside = PathBuf::from(format!("{}:scene.toml", path.display()));
    scene.set_all(&text, &inside)?;
    let (command, version, filter) = (fact("command"), fact("version"), fact("filter"));
    Ok(LogHead { command, version, filter, tick_nanos, every, scene })
}

impl<R: Read> LogReader<R> {
    /// Reads the log that `source` has, from its start; `path` is for messages.
    pub fn new(path: &Path, source: R) -> Self {
        Self::raw(path, source, false)
    }

    fn raw(path: &Path, source: R, emit_chunks: bool) -> Self {
        let options = LinearReaderOptions {
            emit_chunks,
            prevalidate_chunk_crcs: !emit_chunks,
            record_length_limit: Some(RECORD_BYTES_MAX),
            ..LinearReaderOptions::default()
        };
        Self {
            path: path.to_owned(),
            source,
            reader: LinearReader::new_with_options(options),
            places: HashMap::new(),
            schemas: HashMap::new(),
            last: Time::ZERO,
            ended: false,
        }
    }

    /// The next record of the file; `None` at its end.
    fn record(&mut self) -> Result<Option<Record<'static>>, mcap::McapError> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let read = self.source.read(self.reader.insert(bytes.min(RECORD_BYTES_MAX)))?;
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    return mcap::parse_record(opcode, data).map(|record| Some(record.into_owned()));
                }
                Some(Err(error)) => return Err(error),
            }
        }
    }

    /// The next part; `None` at the end.
    ///
    /// # Errors
    /// When the file is damaged here. Nothing is read after that.
    pub fn next_part(&mut self) -> Result<Option<LogPart>, LogError> {
        while !self.ended {
            let record = self.record().map_err(|error| self.damage(&error.to_string()))?;
            match record {
                None => self.ended = true,
                Some(Record::Schema { header, .. }) => {
                    self.schemas.insert(header.id, header.name);
                }
                Some(Record::Channel(channel)) => {
                    let place = self.place(&channel)?;
                    self.places.insert(channel.id, place);
                }
                Some(Record::Message { header, data }) => {
                    let place = self.places.get(&header.channel_id).copied();
                    let place =
                        place.ok_or_else(|| self.damage("a message of a channel that is not there"))?;
                    let Some(place) = place else { continue };
                    let at = Time::from_nanos(header.log_time);
                    let message = decoded(place, &data).map_err(|error| self.damage(&error.to_string()))?;
                    self.last = at;
                    return Ok(Some(LogPart::Message(at, message)));
                }
                Some(Record::Attachment { header, data, .. }) if header.name == "result.json" => {
                    return Ok(Some(LogPart::Result(String::from_utf8_lossy(&data).into_owned())));
                }
                Some(Record::Metadata(metadata)) if metadata.name == "end" => {
                    let ended = metadata.metadata.get("ended").cloned().unwrap_or_default();
                    return Ok(Some(LogPart::Ended(ended)));
                }
                Some(_) => {}
            }
        }
        Ok(None)
    }

    /// The place of a channel among [`CHANNELS`]; `None` of one that this program does not know.
    fn place(&self, channel: &mcap::records::Channel) -> Result<Option<usize>, LogError> {
        let Some(place) = CHANNELS.iter().position(|known| known.topic == channel.topic) else {
            return Ok(None);
        };
        let expected = CHANNELS.get(place).map(super::Channel::schema_name).unwrap_or_default();
        let found = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
        if found == expected && channel.message_encoding == "protobuf" {
            return Ok(Some(place));
        }
        let (path, topic) = (self.path.clone(), channel.topic.clone());
        Err(LogError::OtherChannel { path, topic, found, expected })
    }

    /// The damage met here.
    pub(super) fn damage(&mut self, why: &str) -> LogError {
        self.ended = true;
        let after_s = self.last.seconds_since(Time::ZERO);
        LogError::Damaged { path: self.path.clone(), after_s, why: why.to_owned() }
    }
}

fn decoded(place: usize, data: &[u8]) -> Result<LogMessage, prost::DecodeError> {
    Ok(match place {
        0 => LogMessage::Impact(channels::Impact::decode(data)?),
        1 => LogMessage::VibrometerSample(channels::VibrometerSample::decode(data)?),
        2 => LogMessage::CameraFrame(channels::CameraFrame::decode(data)?),
        3 => LogMessage::Marks(channels::Marks::decode(data)?),
        4 => LogMessage::Innovation(channels::Innovation::decode(data)?),
        5 => LogMessage::Truth(channels::Truth::decode(data)?),
        6 => LogMessage::Tilt(channels::Tilt::decode(data)?),
        7 => LogMessage::Estimate(channels::Estimate::decode(data)?),
        8 => LogMessage::Reference(channels::Reference::decode(data)?),
        9 => LogMessage::Health(channels::Health::decode(data)?),
        10 => LogMessage::Task(channels::Task::decode(data)?),
        _ => LogMessage::Drive(channels::Drive::decode(data)?),
    })
}
