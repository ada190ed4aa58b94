//! The end of an MCAP file: what there is and where it stands, so that a reader need not read all of it.

use std::io::{self, Write as _};

use mcap::MAGIC;
use mcap::records::{AttachmentIndex, ChunkIndex, Footer, MetadataIndex, Statistics, SummaryOffset, op};

use super::records::record;
use super::{Span, id};

/// What the end of the file repeats and lists.
#[derive(Debug, Default)]
pub(super) struct Summary {
    pub schemas: Vec<u8>,
    pub channels: Vec<u8>,
    pub chunks: Vec<ChunkIndex>,
    pub attachments: Vec<AttachmentIndex>,
    pub metadata: Vec<MetadataIndex>,
    /// Messages of each channel.
    pub counts: Vec<u64>,
    /// First and last time of the messages.
    pub span: Span,
}

impl Summary {
    /// The summary with the footer, which stand at `position`.
    pub(super) fn bytes(&self, position: u64) -> io::Result<Vec<u8>> {
        let Self { schemas, channels, chunks, attachments, metadata, .. } = self;
        let (message_start_time, message_end_time) = self.span.unwrap_or_default();
        let numbers = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let count = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        let statistics = Statistics {
            message_count: self.counts.iter().sum(),
            schema_count: id(self.counts.len()) - 1,
            channel_count: count(self.counts.len()),
            attachment_count: count(attachments.len()),
            metadata_count: count(metadata.len()),
            chunk_count: count(chunks.len()),
            message_start_time,
            message_end_time,
            channel_message_counts: numbers.map(|(channel, count)| (id(channel), *count)).collect(),
        };
        let (mut bytes, mut groups, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
        let mut group = |bytes: &mut Vec<u8>, code: u8, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
            let before = bytes.len() as u64;
            write(bytes)?;
            let (group_start, group_length) = (position + before, bytes.len() as u64 - before);
            if group_length > 0 {
                groups.push(SummaryOffset { group_opcode: code, group_start, group_length });
            }
            Ok::<(), io::Error>(())
        };
        group(&mut bytes, op::SCHEMA, &|into| into.write_all(schemas))?;
        group(&mut bytes, op::CHANNEL, &|into| into.write_all(channels))?;
        group(&mut bytes, op::STATISTICS, &|into| record(into, op::STATISTICS, &statistics))?;
        group(&mut bytes, op::CHUNK_INDEX, &|into| {
            chunks.iter().try_for_each(|chunk| record(into, op::CHUNK_INDEX, chunk))
        })?;
        group(&mut bytes, op::ATTACHMENT_INDEX, &|into| {
            attachments.iter().try_for_each(|attachment| record(into, op::ATTACHMENT_INDEX, attachment))
        })?;
        group(&mut bytes, op::METADATA_INDEX, &|into| {
            metadata.iter().try_for_each(|metadata| record(into, op::METADATA_INDEX, metadata))
        })?;
        let summary_offset_start = position + bytes.len() as u64;
        groups.iter().try_for_each(|group| record(&mut offsets, op::SUMMARY_OFFSET, group))?;
        bytes.append(&mut offsets);
        let footer = Footer { summary_start: position, summary_offset_start, summary_crc: 0 };
        record(&mut bytes, op::FOOTER, &footer)?;
        // The last field is the checksum of all before it.
        bytes.truncate(bytes.len() - 4);
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes.extend(MAGIC);
        Ok(bytes)
    }
}
