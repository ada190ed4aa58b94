//! The description of the bench as a whole: its messages, and a digest by which host and board compare theirs.
//!
//! ```text
//! DescriptionBegin, Instruments, Timing, MotorParameter ..., MapBegin, MapRows ..., MapEnd       the whole
//! CRC-64( part, part ... )                                         its digest; a part is a message, by postcard
//! ```
//!
//! Host and board make these messages of what they have by the same function, so the same bench has the same digest on
//! both sides, whatever the host has sent to describe it.

use controller::{LoopTiming, ResponseMap};
use crc::{CRC_64_XZ, Crc, Digest, NoTable};
use estimator::Instruments;
use motor_model::{MotorParams, Parameter};
use serde::{Deserialize, Serialize};

use crate::frame::{FRAME_BYTES_MAX, FrameError};
use crate::map_rows::map_messages;
use crate::message::{HostMessage, MotorParameterRecord};

/// Longest part of a description, in bytes: a message fits a frame.
pub const PART_BYTES_MAX: usize = FRAME_BYTES_MAX;

/// Without a table, which takes 2 KiB: a description has some 3 kB, and its digest is rarely asked for.
static CRC: Crc<u64, NoTable> = Crc::<u64, NoTable>::new(&CRC_64_XZ);

/// The messages that describe a bench to a board, whatever description is in force there, in the order in which it
/// takes them: the begin, instruments, timing, each parameter of `design` that is not Table 1's, and `map`, which goes
/// with `design`. Without a map the board plans by that of Table 1.
pub fn description_messages<'m>(
    design: &'m MotorParams,
    instruments: Instruments,
    timing: LoopTiming,
    map: Option<&'m ResponseMap>,
) -> impl Iterator<Item = HostMessage> + 'm {
    let nominal = MotorParams::nominal();
    let parameters = (0_u8..).zip(Parameter::ALL).filter_map(move |(index, parameter)| {
        let value = design.get(parameter);
        let is_nominal = value.to_bits() == nominal.get(parameter).to_bits();
        (!is_nominal).then_some(HostMessage::MotorParameter(MotorParameterRecord { index, value }))
    });
    let LoopTiming { latency_ticks, decision_ticks } = timing;
    let timing = HostMessage::Timing { latency_ticks, decision_ticks };
    [HostMessage::DescriptionBegin, HostMessage::Instruments(instruments), timing]
        .into_iter()
        .chain(parameters)
        .chain(map.into_iter().flat_map(map_messages))
}

/// Writes a message of a description as a part of it.
///
/// # Errors
/// When the message does not fit. Every message of this crate fits.
pub fn encode_part<'b>(
    message: &HostMessage,
    part: &'b mut [u8; PART_BYTES_MAX],
) -> Result<&'b [u8], FrameError> {
    match postcard::to_slice(message, part) {
        Ok(part) => Ok(part),
        Err(_) => Err(FrameError::TooLong),
    }
}

/// Reads a part of a description; `None` where it is no message, or something is left over.
pub fn decode_part(part: &[u8]) -> Option<HostMessage> {
    match postcard::take_from_bytes(part) {
        Ok((message, [])) => Some(message),
        Ok(_) | Err(_) => None,
    }
}

/// The digest of a description, part by part. It is a CRC-64: it tells descriptions apart, and protects from damage.
#[derive(Clone)]
pub struct DescriptionDigest(Digest<'static, u64, NoTable>);

impl Default for DescriptionDigest {
    fn default() -> Self {
        Self(CRC.digest())
    }
}

impl DescriptionDigest {
    /// Takes the next part.
    pub fn update(&mut self, part: &[u8]) {
        self.0.update(part);
    }

    /// The digest of the parts that were taken.
    pub fn finalize(self) -> u64 {
        self.0.finalize()
    }

    /// The digest of a whole description.
    ///
    /// # Errors
    /// As [`encode_part`].
    pub fn of(messages: impl Iterator<Item = HostMessage>) -> Result<u64, FrameError> {
        let (mut digest, mut part) = (Self::default(), [0; PART_BYTES_MAX]);
        for message in messages {
            digest.update(encode_part(&message, &mut part)?);
        }
        Ok(digest.finalize())
    }
}

impl core::fmt::Debug for DescriptionDigest {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "DescriptionDigest({:016x})", self.clone().finalize())
    }
}

/// Which description of the bench is in force on a board, and which one it keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DescriptionDigests {
    /// Digest of the description in force.
    pub in_force: u64,
    /// The one that is kept. Where it has the same digest, what is in force was restored, or was kept since.
    pub kept: KeptDescription,
}

/// What a board keeps over a loss of power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeptDescription {
    /// Nothing, or nothing whole.
    #[default]
    Nothing,
    /// A description.
    Whole {
        /// Its digest.
        digest: u64,
    },
    /// A description of another version of the protocol, which is not read: as if nothing were kept.
    OtherVersion {
        /// That version.
        version: u8,
    },
}

#[cfg(test)]
mod tests;
