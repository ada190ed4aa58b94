//! A flash as an STM32G474's, whose power can fail: erased by the page to ones, written by the word to zeros, and no
//! word twice but with zeros alone.

extern crate std;

use std::vec;
use std::vec::Vec;

use super::*;

/// Bytes of a word.
const WORD_BYTES: usize = 8;

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

/// The flash, of pages of `PAGE` bytes.
#[derive(Clone, Debug)]
pub struct EmulatedFlash<const PAGE: usize = { SLOT_BYTES as usize }> {
    /// What it holds.
    pub bytes: Vec<u8>,
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

impl<const PAGE: usize> EmulatedFlash<PAGE> {
    /// As it comes from its maker.
    pub fn new() -> Self {
        let bytes = vec![0xff; STORE_BYTES as usize];
        let erasures = vec![0; STORE_BYTES as usize / PAGE];
        Self { bytes, power: None, half_erased: HalfErased::InOrder, erasures, broken: None, noise: 1 }
    }

    /// Full of noise.
    pub fn of_noise(noise: u32) -> Self {
        let mut flash = Self { noise, ..Self::new() };
        for at in 0..flash.bytes.len() {
            flash.bytes[at] = flash.noise();
        }
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
        self.bytes[at] = match self.broken {
            Some((broken, stays)) if broken == at => stays,
            _ => byte,
        };
    }

    fn erase_page(&mut self, page: usize) -> Result<(), NorFlashErrorKind> {
        self.erasures[page] += 1;
        let cells = page * PAGE..(page + 1) * PAGE;
        for at in cells.clone() {
            if !self.has_power() {
                let worked = if self.half_erased == HalfErased::InOrder { at..at } else { cells.clone() };
                for at in worked {
                    let (before, noise) = (self.bytes[at], self.noise());
                    let is_noise = self.half_erased == HalfErased::Noise;
                    self.set(at, if is_noise { noise } else { before | noise });
                }
                return Err(NorFlashErrorKind::Other);
            }
            if self.half_erased == HalfErased::InOrder {
                self.set(at, 0xff);
            }
        }
        cells.for_each(|at| self.set(at, 0xff));
        Ok(())
    }

    /// Whether it is on.
    fn check_power(&self) -> Result<(), NorFlashErrorKind> {
        if self.power == Some(0) { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }
}

impl<const PAGE: usize> ErrorType for EmulatedFlash<PAGE> {
    type Error = NorFlashErrorKind;
}

impl<const PAGE: usize> ReadNorFlash for EmulatedFlash<PAGE> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range(offset, bytes.len(), Self::READ_SIZE)?;
        self.check_power()?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const PAGE: usize> NorFlash for EmulatedFlash<PAGE> {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range(from, (to - from) as usize, PAGE)?;
        self.check_power()?;
        (from as usize / PAGE..to as usize / PAGE).try_for_each(|page| self.erase_page(page))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range(offset, bytes.len(), WORD_BYTES)?;
        self.check_power()?;
        for (start, word) in (offset as usize..).step_by(WORD_BYTES).zip(bytes.chunks(WORD_BYTES)) {
            let is_erased = self.bytes[start..start + WORD_BYTES].iter().all(|&byte| byte == 0xff);
            if !is_erased && word.iter().any(|&byte| byte != 0) {
                return Err(NorFlashErrorKind::Other);
            }
            for (at, &byte) in (start..).zip(word) {
                let is_done = self.has_power();
                // Where the power fails, some bits of the byte are written.
                let written = if is_done { byte } else { byte | self.noise() };
                self.set(at, self.bytes[at] & written);
                if !is_done {
                    return Err(NorFlashErrorKind::Other);
                }
            }
        }
        Ok(())
    }
}
