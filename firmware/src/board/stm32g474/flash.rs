//! The flash of the kept description: the last 8 KiB of 512, which `memory.x` keeps free of the program.
//!
//! The steps are those of ST's reference manual RM0440:
//!
//! | step | section |
//! |---|---|
//! | the control register is unlocked by two keys, and locked after every operation | 3.3.5 |
//! | a page is erased: flags cleared, page and bank chosen, start | 3.3.6 |
//! | eight bytes are written as two words, into erased flash | 3.3.7 |
//! | the data cache forgets what was there before | 3.3.4 |
//! | eight bytes that were cut off while they were written raise a non-maskable interrupt when they are read | 3.3.2 |
//!
//! A part comes with two banks of 128 pages of 2 KiB (option `DBANK`). It may be set to one bank of 128 pages of 4 KiB.
//! Both work: what is erased at once here is 4 KiB, two pages of the former or one of the latter. In two banks these
//! pages are in the second, and the processor runs on while its program is in the first; otherwise it stands still at
//! its next instruction until the flash has done, 25 ms for a page and 90 us for eight bytes at most (data sheet
//! DS12288). Nothing here depends on which it is.

#![expect(unsafe_code, reason = "the flash is read and written through its addresses")]

use core::ptr;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::exception;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use stm32g4::stm32g474 as pac;

use crate::board::faults::end_by_exception;
use crate::board::wait::wait_until;
use crate::store::{SLOT_BYTES, check_range, store_bytes};

/// Address of the flash.
const FLASH: u32 = 0x0800_0000;
/// Bytes of the flash.
const FLASH_BYTES: u32 = 512 * 1024;
/// Address of the kept description.
const START: u32 = FLASH + FLASH_BYTES - store_bytes::<Flash>();

/// What unlocks the control register.
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// Bytes of a page in two banks, and in one.
const PAGE_BYTES: [u32; 2] = [2048, 4096];
/// Pages of a bank.
const PAGES: u32 = 128;

/// Longest erasure of a page: four times the data sheet's.
const ERASE_MICROS: u32 = 100_000;
/// Longest writing of eight bytes: ten times the data sheet's.
const WRITE_MICROS: u32 = 1000;

/// Whether the kept description is being read, so that its error correction may fail.
static IS_READ: AtomicBool = AtomicBool::new(false);

/// The flash of the kept description.
#[derive(Debug)]
pub struct Flash(pac::FLASH);

impl Flash {
    pub(super) fn new(flash: pac::FLASH) -> Self {
        Self(flash)
    }

    /// Does `operation` with the control register unlocked and the data cache off. The cache is empty afterwards.
    fn unlocked(
        &mut self,
        operation: impl FnOnce(&pac::FLASH) -> Result<(), NorFlashErrorKind>,
    ) -> Result<(), NorFlashErrorKind> {
        let flash = &self.0;
        wait_until(ERASE_MICROS, || flash.sr().read().bsy().bit_is_clear())
            .ok_or(NorFlashErrorKind::Other)?;
        for key in KEYS {
            // SAFETY: a key.
            flash.keyr().write(|w| unsafe { w.keyr().bits(key) });
        }
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        clear_flags(flash);
        let done = operation(flash);
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit().dcen().set_bit());
        flash.cr().modify(|_, w| w.lock().set_bit());
        done
    }
}

/// Clears the flags of earlier operations, which would hold up the next one. Each is cleared by writing 1.
fn clear_flags(flash: &pac::FLASH) {
    flash.sr().write(|w| {
        w.eop().set_bit().operr().set_bit().progerr().set_bit().wrperr().set_bit().pgaerr().set_bit();
        w.sizerr().set_bit().pgserr().set_bit().miserr().set_bit().fasterr().set_bit()
    });
}

/// Waits until an operation is over, and says whether it went well.
fn finish(flash: &pac::FLASH, micros: u32) -> Result<(), NorFlashErrorKind> {
    wait_until(micros, || flash.sr().read().bsy().bit_is_clear()).ok_or(NorFlashErrorKind::Other)?;
    let flags = flash.sr().read();
    let failed = flags.operr().bit_is_set()
        || flags.progerr().bit_is_set()
        || flags.wrperr().bit_is_set()
        || flags.pgaerr().bit_is_set()
        || flags.sizerr().bit_is_set()
        || flags.pgserr().bit_is_set();
    if failed { Err(NorFlashErrorKind::Other) } else { Ok(()) }
}

/// Erases the page at `address`.
fn erase_page(flash: &pac::FLASH, address: u32, page_bytes: u32) -> Result<(), NorFlashErrorKind> {
    let page = (address - FLASH) / page_bytes;
    let number = (page % PAGES) as u8;
    // SAFETY: a page of the bank.
    flash.cr().modify(|_, w| unsafe { w.per().set_bit().bker().bit(page >= PAGES).pnb().bits(number) });
    flash.cr().modify(|_, w| w.strt().set_bit());
    let done = finish(flash, ERASE_MICROS);
    flash.cr().modify(|_, w| w.per().clear_bit());
    done
}

/// Writes eight bytes at `address`, the lower word first.
fn write_word(address: u32, bytes: [u8; 8]) {
    let [a, b, c, d, e, f, g, h] = bytes;
    let words = [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])];
    for (place, word) in (address..).step_by(4).zip(words) {
        // SAFETY: an aligned word of the kept description, which no variable is in.
        unsafe {
            ptr::with_exposed_provenance_mut::<u32>(place as usize).write_volatile(word);
        }
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    /// Eight bytes whose error correction fails are read as they are: the store's own CRC finds them out.
    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::READ_SIZE)?;
        IS_READ.store(true, Ordering::SeqCst);
        for (place, byte) in (START + offset..).zip(bytes) {
            // SAFETY: a byte of the kept description, which is only read here.
            let read = unsafe { ptr::with_exposed_provenance::<u8>(place as usize).read_volatile() };
            *byte = read;
        }
        // The interrupt of the last byte has come.
        asm::dsb();
        asm::isb();
        IS_READ.store(false, Ordering::SeqCst);
        Ok(())
    }

    fn capacity(&self) -> usize {
        store_bytes::<Self>() as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = SLOT_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(from, to.saturating_sub(from) as usize, Self::ERASE_SIZE)?;
        self.unlocked(|flash| {
            let [in_two_banks, in_one] = PAGE_BYTES;
            let is_dual = flash.optr().read().dbank().is_dual_bank_mode();
            let page_bytes = if is_dual { in_two_banks } else { in_one };
            (from..to)
                .step_by(page_bytes as usize)
                .try_for_each(|offset| erase_page(flash, START + offset, page_bytes))
        })
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::WRITE_SIZE)?;
        let (words, _) = bytes.as_chunks();
        self.unlocked(|flash| {
            flash.cr().modify(|_, w| w.pg().set_bit());
            let done = (START + offset..).step_by(8).zip(words).try_for_each(|(address, word)| {
                write_word(address, *word);
                finish(flash, WRITE_MICROS)
            });
            flash.cr().modify(|_, w| w.pg().clear_bit());
            done
        })
    }
}

/// The error correction of the flash has failed, or the crystal has stopped. In the kept description a loss of power
/// explains the former; anywhere else the program is damaged. Otherwise the program ends, and the exception is kept.
#[exception]
unsafe fn NonMaskableInt() {
    // SAFETY: what follows clears two flags that nothing else looks at.
    let flash = unsafe { pac::FLASH::steal() };
    let state = flash.eccr().read();
    let is_correction = state.eccd().bit_is_set() || state.eccd2().bit_is_set();
    if !(is_correction && IS_READ.load(Ordering::SeqCst)) {
        end_by_exception(cortex_m::peripheral::scb::Exception::NonMaskableInt.irqn().into())
    }
    flash.eccr().modify(|_, w| w.eccd().set_bit().eccd2().set_bit());
}
