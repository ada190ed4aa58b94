//! The flash of the kept description: the last two sectors of bank 2, 128 KiB each. The program is in bank 1, which an
//! operation of bank 2 leaves alone: the processor runs on.
//!
//! The steps are those of ST's reference manual RM0433, with the registers of its section 4.9:
//!
//! | step | section or register |
//! |---|---|
//! | the control register is unlocked by two keys, once, and locked after an operation | `FLASH_KEYR2`, `FLASH_CR2` |
//! | flags of earlier operations are cleared | `FLASH_CCR2` |
//! | a sector is erased, 32 bits in parallel | 4.3.10, `FLASH_CR2`: `SER2`, `SNB2`, `PSIZE2`, `START2` |
//! | 32 bytes, a flash word, are written as eight words, into erased flash | 4.3.9, `FLASH_CR2`: `PG2` |
//! | an operation is over | `FLASH_SR2`: `QW2` |
//! | a flash word whose error correction fails is a bus fault of what reads it | `FLASH_SR2`: `DBECCERR2` |
//!
//! A flash word that was cut off while it was written may be of the last kind. Nothing switches that fault off in the
//! flash, so it is ignored in the processor (ARM's ARMv7-M manual: at the priority of `FAULTMASK` the bit `BFHFNMIGN`
//! of `CCR` lets loads go on), as Zephyr's driver of this flash does. The reading then fails, and the slot has no whole
//! copy. The memory is strongly ordered ([`super::caches`]): nothing reads ahead, keeps or puts off what is there.
//!
//! A sector takes 2.2 s at most, a flash word 0.3 ms (data sheet DS12110, 32 bits in parallel).

#![expect(unsafe_code, reason = "the flash is read and written through its addresses")]

use core::arch::asm;
use core::ptr;

use cortex_m::peripheral::SCB;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use stm32h7::stm32h743v as pac;

use crate::board::wait::wait_until;
use crate::store::{check_range, store_bytes};

/// Bytes of a sector.
const SECTOR_BYTES: u32 = 128 * 1024;
/// Bytes of a flash word.
const WORD_BYTES: usize = 32;

/// Address of the kept description.
pub(super) const START: u32 = 0x0820_0000 - store_bytes::<Flash>();
/// Number in bank 2 of its first sector.
const FIRST_SECTOR: u8 = 6;

/// What unlocks the control register.
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
/// `PSIZE2` of 32 bits in parallel.
const PARALLEL_32: u8 = 0b10;

/// Longest erasure of a sector: twice the data sheet's.
const ERASE_MICROS: u32 = 4_400_000;
/// Longest writing of a flash word: ten times the data sheet's.
const WRITE_MICROS: u32 = 3000;

/// The bit `BFHFNMIGN` of `CCR`.
const IGNORE_BUS_FAULTS: u32 = 1 << 8;
/// What tells of bus faults in `CFSR`, each cleared by writing 1.
const BUS_FAULTS: u32 = 0xff00;

/// The flash of the kept description.
#[derive(Debug)]
pub struct Flash(pac::FLASH);

impl Flash {
    pub(super) fn new(flash: pac::FLASH) -> Self {
        Self(flash)
    }

    /// Does `operation` of bank 2 with its control register unlocked.
    fn unlocked(
        &mut self,
        operation: impl FnOnce(&pac::flash::BANK) -> Result<(), NorFlashErrorKind>,
    ) -> Result<(), NorFlashErrorKind> {
        // With the banks exchanged the program would be in the one that is erased.
        if self.0.optcr().read().swap_bank().bit_is_set() {
            return Err(NorFlashErrorKind::Other);
        }
        let bank = self.0.bank2();
        wait_until(ERASE_MICROS, || bank.sr().read().qw().bit_is_clear()).ok_or(NorFlashErrorKind::Other)?;
        // Keys for an open register would close it until the next reset.
        if bank.cr().read().lock().bit_is_set() {
            for key in KEYS {
                // SAFETY: a key.
                bank.keyr().write(|w| unsafe { w.key1r().bits(key) });
            }
        }
        clear_flags(bank);
        let done = operation(bank);
        bank.cr().modify(|_, w| w.lock().set_bit());
        done
    }
}

/// Clears the flags of earlier operations. Each is cleared by writing 1.
fn clear_flags(bank: &pac::flash::BANK) {
    bank.ccr().write(|w| {
        w.clr_eop().set_bit().clr_wrperr().set_bit().clr_pgserr().set_bit().clr_strberr().set_bit();
        w.clr_incerr().set_bit().clr_operr().set_bit().clr_rdperr().set_bit().clr_rdserr().set_bit();
        w.clr_sneccerr().set_bit().clr_dbeccerr().set_bit()
    });
}

/// Waits until an operation is over, and says whether it went well.
fn finish(bank: &pac::flash::BANK, micros: u32) -> Result<(), NorFlashErrorKind> {
    wait_until(micros, || bank.sr().read().qw().bit_is_clear()).ok_or(NorFlashErrorKind::Other)?;
    let flags = bank.sr().read();
    let failed = flags.wrperr().bit_is_set()
        || flags.pgserr().bit_is_set()
        || flags.strberr().bit_is_set()
        || flags.incerr().bit_is_set()
        || flags.operr().bit_is_set();
    if failed { Err(NorFlashErrorKind::Other) } else { Ok(()) }
}

/// Erases a sector.
fn erase_sector(bank: &pac::flash::BANK, sector: u8) -> Result<(), NorFlashErrorKind> {
    // SAFETY: one of the bank's eight sectors, and a value of the field.
    bank.cr().modify(|_, w| unsafe { w.ser().set_bit().snb().bits(sector).psize().bits(PARALLEL_32) });
    bank.cr().modify(|_, w| w.start().set_bit());
    let done = finish(bank, ERASE_MICROS);
    bank.cr().modify(|_, w| w.ser().clear_bit());
    done
}

/// Writes a flash word at `address`, and waits until it is written.
fn write_word(
    bank: &pac::flash::BANK,
    address: u32,
    bytes: &[u8; WORD_BYTES],
) -> Result<(), NorFlashErrorKind> {
    let (words, _) = bytes.as_chunks();
    for (place, word) in (address..).step_by(4).zip(words) {
        // SAFETY: an aligned word of the kept description, which no variable is in.
        unsafe {
            ptr::with_exposed_provenance_mut::<u32>(place as usize).write_volatile(u32::from_le_bytes(*word));
        }
    }
    finish(bank, WRITE_MICROS)
}

/// Reads the word at the aligned `address`. Where its error correction fails, a flag of the flash says so, and what is
/// read means nothing.
// Never inlined: the interrupts that it masks are looked at by its name (tests/qemu/masked.rs).
#[inline(never)]
fn read_word(address: u32) -> u32 {
    let word;
    // SAFETY: a word of the kept description, which is only read. What is masked is unmasked: the main loop and what
    // comes before it run with `FAULTMASK` clear.
    unsafe {
        asm!(
            "cpsid f",
            "ldr {word}, [{address}]",
            "dsb",
            "isb",
            "cpsie f",
            word = out(reg) word,
            address = in(reg) address,
            options(nostack, preserves_flags)
        );
    }
    word
}

/// Does `reading` with bus faults ignored wherever `FAULTMASK` is set. `has_failed` says whether there was one.
fn without_bus_faults(reading: impl FnOnce(), has_failed: impl FnOnce() -> bool) -> bool {
    // SAFETY: registers of the processor, which only handlers of faults look at besides: they do not come back.
    let control = unsafe { &*SCB::PTR };
    // SAFETY: bits that act at once, and only where `FAULTMASK` is set.
    unsafe {
        control.ccr.modify(|bits| bits | IGNORE_BUS_FAULTS);
    }
    reading();
    // SAFETY: as above.
    unsafe {
        control.ccr.modify(|bits| bits & !IGNORE_BUS_FAULTS);
    }
    let failed = has_failed();
    if failed {
        // SAFETY: the record of a later fault would have these too.
        unsafe {
            control.cfsr.write(BUS_FAULTS);
        }
    }
    failed
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    /// Fails where the error correction does.
    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::READ_SIZE)?;
        let bank = self.0.bank2();
        clear_flags(bank);
        let read = || {
            for (place, byte) in (START + offset..).zip(bytes) {
                let [wanted, ..] = (read_word(place & !3) >> (8 * (place & 3))).to_le_bytes();
                *byte = wanted;
            }
        };
        let failed = without_bus_faults(read, || {
            let flags = bank.sr().read();
            flags.dbeccerr().bit_is_set() || flags.rdperr().bit_is_set() || flags.rdserr().bit_is_set()
        });
        clear_flags(bank);
        if failed { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }

    fn capacity(&self) -> usize {
        store_bytes::<Self>() as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = SECTOR_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(from, to.saturating_sub(from) as usize, Self::ERASE_SIZE)?;
        self.unlocked(|bank| {
            let sectors = (FIRST_SECTOR..).zip((0..store_bytes::<Self>()).step_by(SECTOR_BYTES as usize));
            sectors
                .filter(|(_, offset)| (from..to).contains(offset))
                .try_for_each(|(sector, _)| erase_sector(bank, sector))
        })
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::WRITE_SIZE)?;
        let (words, _) = bytes.as_chunks();
        self.unlocked(|bank| {
            // SAFETY: a value of the field.
            bank.cr().modify(|_, w| unsafe { w.pg().set_bit().psize().bits(PARALLEL_32) });
            let done = (START + offset..)
                .step_by(WORD_BYTES)
                .zip(words)
                .try_for_each(|(address, word)| write_word(bank, address, word));
            bank.cr().modify(|_, w| w.pg().clear_bit());
            done
        })
    }
}
