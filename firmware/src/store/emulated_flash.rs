//! A flash whose power can fail, as an STM32G474's or an STM32H743's: erased by the page to ones, and written by the
//! word.
//!
//! | part | bytes of a word | a second writing of a word | a word in which the power failed |
//! |---|---|---|---|
//! | STM32G474 | 8 | with zeros alone | reads as its cells are |
//! | STM32H743 | 32 | never | reads as its cells are, or not at all: its error correction fails |

extern crate std;

use core::ops::Range;
use std::vec;
use std::vec::Vec;

use super::*;

/// Bytes of the longer word, whose error correction makes a reading fail.
const CORRECTED_WORD_BYTES: usize = 32;

/// What the cells of a page are in the middle of its erasure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HalfErased {
    /// Those up to the cut are ones, the others as they were.
    InOrder,
    /// Some of the zeros are ones.
    Bits,
    /// Anything.
    Noise,
}

/// The flash, of pages of `PAGE` bytes and words of `WORD` bytes.
#[derive(Clone, Debug)]
pub struct EmulatedFlash<const PAGE: usize = { SLOT_BYTES as usize }, const WORD: usize = 8> {
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Whether the error correction of a word fails.
    pub unreadable: Vec<bool>,
    /// Bytes that are erased or written before the power fails; `None` where it does not.
    pub power: Option<usize>,
    /// What an erasure leaves in whose middle the power fails.
    pub half_erased: HalfErased,
    /// Erasures of each page.
    pub erasures: Vec<usize>,
    /// A byte that is worn, and what it stays.
    pub broken: Option<(usize, u8)>,
    /// State of a generator of noise.
    pub noise: u32,
}

impl<const PAGE: usize, const WORD: usize> EmulatedFlash<PAGE, WORD> {
    /// Bytes of a slot of a store.
    pub const SLOT: usize = slot_bytes::<Self>() as usize;
    /// Bytes of a store.
    pub const STORE: usize = store_bytes::<Self>() as usize;
    const IS_CORRECTED: bool = WORD == CORRECTED_WORD_BYTES;

    /// As it comes from its maker.
    pub fn new() -> Self {
        Self {
            bytes: vec![0xff; Self::STORE],
            unreadable: vec![false; Self::STORE / WORD],
            power: None,
            half_erased: HalfErased::InOrder,
            erasures: vec![0; Self::STORE / PAGE],
            broken: None,
            noise: 1,
        }
    }

    /// Full of noise.
    pub fn of_noise(noise: u32) -> Self {
        let mut flash = Self { noise, ..Self::new() };
        for at in 0..flash.bytes.len() {
            flash.bytes[at] = flash.noise();
        }
        (0..flash.unreadable.len()).for_each(|word| flash.tear(word));
        flash
    }

    /// A byte of noise (a linear congruential generator; its high bits are the better ones).
    fn noise(&mut self) -> u8 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.noise >> 24) as u8
    }

    /// Whether the next byte is done; it is the last one that is touched where it is not.
    fn has_power(&mut self) -> bool {
        match &mut self.power {
            None => true,
            Some(0) => false,
            Some(left) => {
                *left -= 1;
                true
            }
        }
    }

    fn set(&mut self, at: usize, byte: u8) {
        self.bytes[at] = byte;
        if let Some((broken, stays)) = self.broken
            && broken == at
        {
            self.bytes[at] = stays;
            self.unreadable[at / WORD] |= Self::IS_CORRECTED && stays != byte;
        }
    }

    /// The power has failed while this word was worked at: what corrects its errors may fail from now on.
    fn tear(&mut self, word: usize) {
        self.unreadable[word] = Self::IS_CORRECTED && self.noise().is_multiple_of(2);
    }

    fn erase_page(&mut self, page: usize) -> Result<(), NorFlashErrorKind> {
        self.erasures[page] += 1;
        let cells = page * PAGE..(page + 1) * PAGE;
        for at in cells.clone() {
            if !self.has_power() {
                self.half_erase(at, cells);
                return Err(NorFlashErrorKind::Other);
            }
            if self.half_erased == HalfErased::InOrder {
                self.set(at, 0xff);
            }
        }
        self.unreadable[cells.start / WORD..cells.end / WORD].fill(false);
        cells.for_each(|at| self.set(at, 0xff));
        Ok(())
    }

    /// What a cut at the cell `at` leaves of an erasure of `cells`.
    fn half_erase(&mut self, at: usize, cells: Range<usize>) {
        let is_in_order = self.half_erased == HalfErased::InOrder;
        for at in if is_in_order { at..at } else { cells.clone() } {
            let (before, noise) = (self.bytes[at], self.noise());
            let is_noise = self.half_erased == HalfErased::Noise;
            self.set(at, if is_noise { noise } else { before | noise });
        }
        if is_in_order {
            self.unreadable[cells.start / WORD..at / WORD].fill(false);
            self.tear(at / WORD);
        } else {
            (cells.start / WORD..cells.end / WORD).for_each(|word| self.tear(word));
        }
    }

    /// Whether it is on.
    fn check_power(&self) -> Result<(), NorFlashErrorKind> {
        if self.power == Some(0) { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }
}

impl<const PAGE: usize, const WORD: usize> ErrorType for EmulatedFlash<PAGE, WORD> {
    type Error = NorFlashErrorKind;
}

impl<const PAGE: usize, const WORD: usize> ReadNorFlash for EmulatedFlash<PAGE, WORD> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::READ_SIZE)?;
        self.check_power()?;
        let words = offset as usize / WORD..(offset as usize + bytes.len()).div_ceil(WORD);
        if self.unreadable[words].contains(&true) {
            return Err(NorFlashErrorKind::Other);
        }
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const PAGE: usize, const WORD: usize> NorFlash for EmulatedFlash<PAGE, WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(from, (to - from) as usize, PAGE)?;
        self.check_power()?;
        (from as usize / PAGE..to as usize / PAGE).try_for_each(|page| self.erase_page(page))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), WORD)?;
        self.check_power()?;
        for (start, word) in (offset as usize..).step_by(WORD).zip(bytes.chunks(WORD)) {
            let is_erased = self.bytes[start..start + WORD].iter().all(|&byte| byte == 0xff);
            let is_zero = word.iter().all(|&byte| byte == 0);
            if self.unreadable[start / WORD] || !is_erased && (Self::IS_CORRECTED || !is_zero) {
                return Err(NorFlashErrorKind::Other);
            }
            let mut is_cut = false;
            for (at, &byte) in (start..).zip(word) {
                is_cut = is_cut || !self.has_power();
                // Where the power fails, some bits of the byte are written, and of those after it in a longer word.
                let written = if is_cut { byte | self.noise() } else { byte };
                self.set(at, self.bytes[at] & written);
                if is_cut && !Self::IS_CORRECTED {
                    break;
                }
            }
            if is_cut {
                self.tear(start / WORD);
                return Err(NorFlashErrorKind::Other);
            }
        }
        Ok(())
    }
}
