//! An MCAP file (<https://mcap.dev/spec>): chunks without compression, each with a checksum and the places of its
//! messages, and a summary at the end.
//!
//! The records are those of the crate `mcap`, which also reads them. Its writer is not used: it takes a message apart
//! into eight writes, each through three layers and two checksums, and messages are most of what a log costs. Here a
//! message is appended to the chunk in one piece, and the checksum is taken of the whole chunk. A test holds the bytes
//! against those of the crate's writer.

mod records;
mod summary;

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::MAGIC;
use mcap::records::{
    AttachmentHeader, AttachmentIndex, Channel, ChunkHeader, ChunkIndex, DataEnd, Header, Metadata,
    MetadataIndex, SchemaHeader, op,
};
use motor_model::Time;
use prost::Message;

use records::{append, fields, record};
use summary::Summary;

/// Code and length of a record.
const RECORD_HEAD: usize = 1 + 8;
/// What stands before the content of a message: the head of its record, channel, sequence and two times.
const MESSAGE_HEAD: usize = RECORD_HEAD + 2 + 4 + 8 + 8;

/// First and last time of messages in ns.
type Span = Option<(u64, u64)>;

/// The writer. What is given to it stands in the file once the chunk is ended.
#[derive(Debug)]
pub(super) struct McapFile<W> {
    file: W,
    position: u64,
    /// Messages of a chunk under way, and the schemas and channels before them.
    chunk: Vec<u8>,
    chunk_span: Span,
    /// Of each channel the places of its messages in the chunk: time and offset.
    places: Vec<Vec<u8>>,
    sequence: u32,
    summary: Summary,
}

/// `span` with `at` in it.
fn with(span: Span, at: u64) -> (u64, u64) {
    span.map_or((at, at), |(first, last)| (first.min(at), last.max(at)))
}

impl<W: Write> McapFile<W> {
    /// Begins a file.
    pub(super) fn create(file: W, profile: &str, library: &str) -> io::Result<Self> {
        let mut begun = Self {
            file,
            position: 0,
            chunk: Vec::new(),
            chunk_span: None,
            places: Vec::new(),
            sequence: 0,
            summary: Summary::default(),
        };
        let mut bytes = MAGIC.to_vec();
        record(&mut bytes, op::HEADER, &Header { profile: profile.to_owned(), library: library.to_owned() })?;
        begun.write(&bytes)?;
        Ok(begun)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// The file itself.
    pub(super) fn file(&mut self) -> &mut W {
        &mut self.file
    }

    /// Writes keys with values.
    pub(super) fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> io::Result<()> {
        self.end_chunk()?;
        let mut bytes = Vec::new();
        record(&mut bytes, op::METADATA, &Metadata { name: name.to_owned(), metadata })?;
        let (offset, length) = (self.position, bytes.len() as u64);
        self.summary.metadata.push(MetadataIndex { offset, length, name: name.to_owned() });
        self.write(&bytes)
    }

    /// Writes a text beside the messages.
    pub(super) fn attachment(&mut self, name: &str, media_type: &str, text: &str) -> io::Result<()> {
        self.end_chunk()?;
        let (name, media_type, data_size) = (name.to_owned(), media_type.to_owned(), text.len() as u64);
        let (log_time, create_time) = (0, 0);
        let mut bytes = Vec::new();
        append(&mut bytes, op::ATTACHMENT, |into| {
            let start = into.len();
            let (name, media_type) = (name.clone(), media_type.clone());
            fields(into, &AttachmentHeader { log_time, create_time, name, media_type })?;
            into.extend(data_size.to_le_bytes());
            into.extend(text.as_bytes());
            let checksum = crc32fast::hash(&into[start..]);
            into.extend(checksum.to_le_bytes());
            Ok(())
        })?;
        let (offset, length) = (self.position, bytes.len() as u64);
        let index = AttachmentIndex { offset, length, log_time, create_time, data_size, name, media_type };
        self.summary.attachments.push(index);
        self.write(&bytes)
    }

    /// Adds the next channel, whose messages are of a protobuf type described by `schema`. Channels count from 0.
    pub(super) fn channel(&mut self, topic: &str, type_name: &str, schema: &[u8]) -> io::Result<()> {
        self.places.push(Vec::new());
        self.summary.counts.push(0);
        let id = id(self.places.len() - 1);
        let encoding = || "protobuf".to_owned();
        let mut bytes = Vec::new();
        append(&mut bytes, op::SCHEMA, |into| {
            fields(into, &SchemaHeader { id, name: type_name.to_owned(), encoding: encoding() })?;
            let length = u32::try_from(schema.len()).map_err(io::Error::other)?;
            into.extend(length.to_le_bytes());
            into.extend(schema);
            Ok(())
        })?;
        self.summary.schemas.extend(&bytes);
        self.chunk.append(&mut bytes);
        let (topic, metadata) = (topic.to_owned(), BTreeMap::new());
        let channel = Channel { id, schema_id: id, topic, message_encoding: encoding(), metadata };
        record(&mut bytes, op::CHANNEL, &channel)?;
        self.summary.channels.extend(&bytes);
        self.chunk.append(&mut bytes);
        Ok(())
    }

    /// Adds a message of the channel `channel` to the chunk under way, and returns the bytes that it takes.
    pub(super) fn message(&mut self, channel: usize, at: Time, message: &impl Message) -> io::Result<usize> {
        let (at, start) = (at.nanos(), self.chunk.len());
        self.sequence = self.sequence.wrapping_add(1);
        self.chunk.extend_from_slice(&[0; MESSAGE_HEAD]);
        message.encode(&mut self.chunk).map_err(io::Error::other)?;
        let length = self.chunk.len() - start;
        let mut head = [op::MESSAGE; MESSAGE_HEAD];
        head[1..9].copy_from_slice(&((length - RECORD_HEAD) as u64).to_le_bytes());
        head[9..11].copy_from_slice(&id(channel).to_le_bytes());
        head[11..15].copy_from_slice(&self.sequence.to_le_bytes());
        head[15..23].copy_from_slice(&at.to_le_bytes());
        head[23..].copy_from_slice(&at.to_le_bytes());
        self.chunk[start..start + MESSAGE_HEAD].copy_from_slice(&head);
        let mut place = [0; 16];
        place[..8].copy_from_slice(&at.to_le_bytes());
        place[8..].copy_from_slice(&(start as u64).to_le_bytes());
        self.places[channel].extend_from_slice(&place);
        self.chunk_span = Some(with(self.chunk_span, at));
        Ok(length + place.len())
    }

    /// Writes the chunk under way, unless it is empty.
    pub(super) fn end_chunk(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let chunk_start_offset = self.position;
        let (message_start_time, message_end_time) = self.chunk_span.unwrap_or_default();
        let (size, compression) = (self.chunk.len() as u64, String::new());
        let header = ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size: size,
            uncompressed_crc: crc32fast::hash(&self.chunk),
            compression: compression.clone(),
            compressed_size: size,
        };
        let mut head = Vec::new();
        record(&mut head, op::CHUNK, &header)?;
        let length = (head.len() - RECORD_HEAD) as u64 + size;
        head[1..RECORD_HEAD].copy_from_slice(&length.to_le_bytes());
        self.write(&head)?;
        let chunk = std::mem::take(&mut self.chunk);
        self.write(&chunk)?;
        self.chunk = chunk;
        self.chunk.clear();
        let chunk_length = self.position - chunk_start_offset;
        let (message_index_offsets, message_index_length) = self.write_places()?;
        self.summary.chunks.push(ChunkIndex {
            message_start_time,
            message_end_time,
            chunk_start_offset,
            chunk_length,
            message_index_offsets,
            message_index_length,
            compression,
            compressed_size: size,
            uncompressed_size: size,
        });
        if let Some((first, last)) = self.chunk_span.take() {
            self.summary.span = Some(with(Some(with(self.summary.span, first)), last));
        }
        Ok(())
    }

    /// Writes the places of the messages of each channel that has some in the chunk: where these stand, and their
    /// length.
    fn write_places(&mut self) -> io::Result<(BTreeMap<u16, u64>, u64)> {
        let start = self.position;
        let (mut offsets, mut bytes) = (BTreeMap::new(), Vec::new());
        for (channel, places) in self.places.iter_mut().enumerate().filter(|(_, places)| !places.is_empty()) {
            offsets.insert(id(channel), start + bytes.len() as u64);
            append(&mut bytes, op::MESSAGE_INDEX, |into| {
                into.extend(id(channel).to_le_bytes());
                let length = u32::try_from(places.len()).map_err(io::Error::other)?;
                into.extend(length.to_le_bytes());
                into.extend_from_slice(places);
                Ok(())
            })?;
            self.summary.counts[channel] += places.len() as u64 / 16;
            places.clear();
        }
        self.write(&bytes)?;
        Ok((offsets, bytes.len() as u64))
    }

    /// Ends the file, and gives it back.
    pub(super) fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        let mut end = Vec::new();
        record(&mut end, op::DATA_END, &DataEnd { data_section_crc: 0 })?;
        self.write(&end)?;
        let summary = self.summary.bytes(self.position)?;
        self.write(&summary)?;
        Ok(self.file)
    }
}

/// The number of a channel, and of its schema, in the file: from 1.
fn id(channel: usize) -> u16 {
    u16::try_from(channel + 1).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests;
