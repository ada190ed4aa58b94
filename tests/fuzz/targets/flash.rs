//! Any bytes in the flash of a board's kept description: what is there is read as a whole description or as none, and
//! the next description is kept.

#![no_main]

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use firmware::store::{SLOT_BYTES, Store, check_range, store_bytes};
use libfuzzer_sys::fuzz_target;
use link::{DescriptionDigest, HostMessage, KeptDescription};

/// A flash that was found.
struct Found(Vec<u8>);

impl ErrorType for Found {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Found {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Found {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = SLOT_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(from, (to - from) as usize, Self::ERASE_SIZE)?;
        self.0[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::WRITE_SIZE)?;
        for (cell, byte) in self.0[offset as usize..].iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut cells = bytes.to_vec();
    cells.resize(store_bytes::<Found>() as usize, 0xff);
    let mut store = Store::new(Found(cells));
    let mut digest = DescriptionDigest::default();
    store.read(|part| digest.update(part));
    if let KeptDescription::Whole { digest: kept } = store.kept() {
        assert_eq!(digest.finalize(), kept);
    }
    let messages =
        [HostMessage::DescriptionBegin, HostMessage::Timing { latency_ticks: 3, decision_ticks: 1 }];
    store.keep(messages.iter().cloned()).expect("a flash that works");
    let digest = DescriptionDigest::of(messages.into_iter()).expect("each fits");
    assert_eq!(store.kept(), KeptDescription::Whole { digest });
});
