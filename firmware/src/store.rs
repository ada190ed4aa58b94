//! The kept description: two slots of flash, of which the newest whole copy counts.
//!
//! ```text
//! slot 0   | part | part | ... | record |             a queue of `sequential-storage`, each item with its CRC-32
//! slot 1   | part | part | ... | record |
//! record = version u8 | generation u32 | parts u16 | CRC-64 of the parts u64            little endian
//! ```
//!
//! A new description goes into the slot that does not hold the newest whole copy. Its record is written last. So
//! wherever the power fails, in the middle of a page's erasure or of a word, the newest whole copy is the old
//! description or the new one. The crate frames the parts, and this module decides which copy counts; a slot is always
//! erased before it is written, so nothing of what the crate would repair is relied upon. Reading writes nothing.
//!
//! A flash page of an STM32G474 bears 10,000 erasures, as a sector of an STM32H743 does, and each slot is erased by
//! every other description: 20,000 descriptions.
//!
//! What a flash cannot read is no part of a copy: an error of its reading makes the slot one without a whole copy. No
//! word is written twice between two erasures.
//!
//! The parts are messages of the [`link`], so their version is the protocol's. Version and CRC keep their places in
//! every version to come: a copy of another version is known as one, and not read. A parameter of the motor that is
//! Table 1's is not told, and so not kept: firmware with another Table 1 restores it as its own.
//!
//! The flash is a port: [`NorFlash`] of `embedded-storage-async`. No flash of these boards lets others run while it
//! works, so an operation that is not done at once counts as failed.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError as _, NorFlashErrorKind, ReadNorFlash,
};
use link::{
    DescriptionDigest, FrameError, HostMessage, KeptDescription, PART_BYTES_MAX, VERSION, encode_part,
};
use sequential_storage::Error;
use sequential_storage::cache::Cache;
use sequential_storage::queue::{QueueConfig, QueueConfigError, QueueStorage};

/// Bytes of a slot: room for the largest description, every parameter changed and a map of full tables, where a word of
/// the flash has eight bytes. A flash that is erased by more has slots of what it is erased by.
pub const SLOT_BYTES: u32 = 4096;

/// Bytes of a slot in the flash `F`: a multiple of what is erased at once.
#[expect(clippy::cast_possible_truncation, reason = "a flash has less than 4 GiB")]
pub const fn slot_bytes<F: NorFlash>() -> u32 {
    SLOT_BYTES.next_multiple_of(F::ERASE_SIZE as u32)
}

/// Bytes of the flash `F` that a store takes, from its offset 0.
pub const fn store_bytes<F: NorFlash>() -> u32 {
    2 * slot_bytes::<F>()
}

// Items are read by whole words of the flash, of 32 bytes at most.
const _: () = assert!(PART_BYTES_MAX.is_multiple_of(32));

/// Whether `bytes` from `offset` on are in the flash `F` of a store, and both are multiples of `unit`: what every
/// operation of such a flash checks first.
///
/// # Errors
/// When they are not.
pub fn check_range<F: NorFlash>(offset: u32, bytes: usize, unit: usize) -> Result<(), NorFlashErrorKind> {
    let start = offset as usize;
    let is_within = start.checked_add(bytes).is_some_and(|end| end <= store_bytes::<F>() as usize);
    if !is_within {
        return Err(NorFlashErrorKind::OutOfBounds);
    }
    let is_aligned = start.is_multiple_of(unit) && bytes.is_multiple_of(unit);
    if is_aligned { Ok(()) } else { Err(NorFlashErrorKind::NotAligned) }
}

/// The flash has failed, or has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotStored;

impl<E> From<Error<E>> for NotStored {
    fn from(_: Error<E>) -> Self {
        Self
    }
}

impl From<QueueConfigError> for NotStored {
    fn from(_: QueueConfigError) -> Self {
        Self
    }
}

impl From<FrameError> for NotStored {
    fn from(_: FrameError) -> Self {
        Self
    }
}

/// The last item of a copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Record {
    /// [`VERSION`] of the protocol that the parts are messages of.
    version: u8,
    /// Copies that were written before this one, modulo 2^32.
    generation: u32,
    /// Items before this one.
    parts: u16,
    /// Digest of those items.
    digest: u64,
}

impl Record {
    const BYTES: usize = 15;

    fn bytes(self) -> [u8; Self::BYTES] {
        let Self { version, generation, parts, digest } = self;
        let mut bytes = [version; Self::BYTES];
        let fields =
            generation.to_le_bytes().into_iter().chain(parts.to_le_bytes()).chain(digest.to_le_bytes());
        bytes.iter_mut().skip(1).zip(fields).for_each(|(byte, field)| *byte = field);
        bytes
    }

    fn read(item: &[u8]) -> Option<Self> {
        let (&[version], rest) = item.split_first_chunk()?;
        let (generation, rest) = rest.split_first_chunk()?;
        let (parts, rest) = rest.split_first_chunk()?;
        Some(Self {
            version,
            generation: u32::from_le_bytes(*generation),
            parts: u16::from_le_bytes(*parts),
            digest: u64::from_le_bytes(rest.try_into().ok()?),
        })
    }

    fn is_newer_than(&self, other: &Self) -> bool {
        self.generation.wrapping_sub(other.generation).cast_signed() > 0
    }
}

/// A slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    First,
    Second,
}

impl Slot {
    fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }

    fn queue<F: NorFlash>(self) -> Result<QueueConfig<F>, QueueConfigError> {
        QueueConfig::try_new(match self {
            Self::First => 0..slot_bytes::<F>(),
            Self::Second => slot_bytes::<F>()..store_bytes::<F>(),
        })
    }
}

/// The kept description, in the [`store_bytes`] of a flash.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
}

impl<F: NorFlash> Store<F> {
    /// A store in `flash`, whatever is there.
    pub fn new(flash: F) -> Self {
        Self { flash }
    }

    /// What is kept.
    pub fn kept(&mut self) -> KeptDescription {
        match self.newest() {
            None => KeptDescription::Nothing,
            Some((_, Record { version: VERSION, digest, .. })) => KeptDescription::Whole { digest },
            Some((_, Record { version, .. })) => KeptDescription::OtherVersion { version },
        }
    }

    /// Gives the parts of the kept description to `take`, in their order; none of another version.
    pub fn read(&mut self, mut take: impl FnMut(&[u8])) {
        let Some((slot, Record { version: VERSION, parts, .. })) = self.newest() else { return };
        let mut left = parts;
        // What has just been found whole can be read.
        let _ = self.walk(slot, |item| {
            if let Some(fewer) = left.checked_sub(1) {
                left = fewer;
                take(item);
            }
        });
    }

    /// Keeps a description instead of the one before it.
    ///
    /// # Errors
    /// When the flash fails, or has no room for it; the one before it is kept then.
    pub fn keep(&mut self, messages: impl Iterator<Item = HostMessage>) -> Result<(), NotStored> {
        let newest = self.newest();
        let slot = newest.map_or(Slot::First, |(slot, _)| slot.other());
        let generation = newest.map_or(0, |(_, record)| record.generation.wrapping_add(1));
        let record = self.write(slot, generation, messages)?;
        if self.whole(slot) == Some(record) { Ok(()) } else { Err(NotStored) }
    }

    /// Keeps nothing any more: the older copy goes first, so that it is never the newest.
    ///
    /// # Errors
    /// When the flash fails.
    pub fn forget(&mut self) -> Result<(), NotStored> {
        let older = self.newest().map_or(Slot::First, |(slot, _)| slot.other());
        for slot in [older, older.other()] {
            let mut queue = QueueStorage::new(&mut self.flash, slot.queue()?, Cache::new_uncached());
            at_once(queue.erase_all())?;
        }
        Ok(())
    }

    /// Erases `slot` and writes a copy into it; its record.
    fn write(
        &mut self,
        slot: Slot,
        generation: u32,
        messages: impl Iterator<Item = HostMessage>,
    ) -> Result<Record, NotStored> {
        let mut queue = QueueStorage::new(&mut self.flash, slot.queue()?, Cache::new_uncached());
        at_once(queue.erase_all())?;
        let (mut digest, mut parts, mut buffer) = (DescriptionDigest::default(), 0, [0; PART_BYTES_MAX]);
        for message in messages {
            let part = encode_part(&message, &mut buffer)?;
            digest.update(part);
            at_once(queue.push(part, false))?;
            parts += 1;
        }
        let record = Record { version: VERSION, generation, parts, digest: digest.finalize() };
        at_once(queue.push(&record.bytes(), false))?;
        Ok(record)
    }

    /// The newest whole copy, of any version.
    fn newest(&mut self) -> Option<(Slot, Record)> {
        let first = self.whole(Slot::First).map(|record| (Slot::First, record));
        let second = self.whole(Slot::Second).map(|record| (Slot::Second, record));
        match (&first, &second) {
            (Some((_, older)), Some((_, newer))) if newer.is_newer_than(older) => second,
            _ => first.or(second),
        }
    }

    /// The record of the copy in `slot`, if that is whole.
    fn whole(&mut self, slot: Slot) -> Option<Record> {
        let (mut digest, mut parts, mut record) = (DescriptionDigest::default(), 0, None);
        let read = self.walk(slot, |item| {
            let is_whole =
                |record: &Record| record.parts == parts && record.digest == digest.clone().finalize();
            record = Record::read(item).filter(is_whole);
            digest.update(item);
            parts = parts.saturating_add(1);
        });
        read.ok().and(record)
    }

    /// Gives the items in `slot` to `take`.
    fn walk(&mut self, slot: Slot, mut take: impl FnMut(&[u8])) -> Result<(), NotStored> {
        let flash = ReadOnly(&mut self.flash);
        let mut queue = QueueStorage::new(flash, slot.queue()?, Cache::new_uncached());
        let mut buffer = [0; PART_BYTES_MAX];
        at_once(async {
            let mut items = queue.iter().await?;
            while let Some(item) = items.next(&mut buffer).await? {
                take(&item);
            }
            Ok(())
        })
    }
}

/// The flash of a store that is read: the crate may not repair what it finds.
struct ReadOnly<'f, F>(&'f mut F);

impl<F> ErrorType for ReadOnly<'_, F> {
    type Error = NorFlashErrorKind;
}

impl<F: ReadNorFlash> ReadNorFlash for ReadOnly<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.0.read(offset, bytes).await.map_err(|error| error.kind())
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for ReadOnly<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }

    async fn write(&mut self, _: u32, _: &[u8]) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }
}

/// The result of an operation that is done without waiting.
fn at_once<T, E>(operation: impl Future<Output = Result<T, Error<E>>>) -> Result<T, NotStored> {
    match pin!(operation).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => Ok(result?),
        Poll::Pending => Err(NotStored),
    }
}

#[cfg(test)]
pub(crate) mod emulated_flash;
#[cfg(test)]
mod tests;
