//! What is kept of a crash until the program has started again: why it ended, where, and what it said.
//!
//! The words go into memory that a restart leaves as it is, and are told once after it. A loss of power leaves anything
//! there: the last word is a check of the others.

use core::fmt::{self, Write};

use link::ResetCause;

/// Bytes of a text; what is longer is cut off.
const TEXT_BYTES: usize = 96;
/// First word of a record.
const MAGIC: u32 = 0x6372_6173;
/// Words before the text: magic, kind, registers and length.
const HEAD_WORDS: usize = 8;
/// Words of the text.
const TEXT_WORDS: usize = TEXT_BYTES / 4;

/// Words of a record, its check included.
pub const CRASH_WORDS: usize = HEAD_WORDS + TEXT_WORDS + 1;

/// Why a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashKind {
    /// The program found out.
    Panic,
    /// The processor did.
    Fault,
}

impl CrashKind {
    /// The cause of the restart that follows.
    pub fn reset_cause(self) -> ResetCause {
        match self {
            Self::Panic => ResetCause::Panic,
            Self::Fault => ResetCause::Fault,
        }
    }
}

/// Registers of the processor at a fault; 0 where they are not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultRegisters {
    /// Address of the instruction.
    pub pc: u32,
    /// Where the function returns to.
    pub lr: u32,
    /// Kind of the fault: `CFSR` of ARM's ARMv7-M manual.
    pub cfsr: u32,
    /// Why it is a hard one: `HFSR`.
    pub hfsr: u32,
    /// Address that was accessed, where `cfsr` says that it is valid: `BFAR`.
    pub bfar: u32,
}

/// Text of a crash, in ASCII, cut off at its end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CrashText(heapless::Vec<u8, TEXT_BYTES>);

impl CrashText {
    /// As much of `text` as there is room for. A question mark stands for each byte of another character.
    pub fn of(text: &impl fmt::Display) -> Self {
        let mut cut = Self::default();
        let _ = write!(cut, "{text}");
        cut
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        str::from_utf8(&self.0).unwrap_or_default()
    }
}

impl Write for CrashText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut bytes = text.bytes().map(|byte| if byte.is_ascii() { byte } else { b'?' });
        bytes.try_for_each(|byte| self.0.push(byte).map_err(|_| fmt::Error))
    }
}

/// A crash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// Why the program ended.
    pub kind: CrashKind,
    /// Where, of a fault.
    pub registers: FaultRegisters,
    /// What it said, of a panic.
    pub text: CrashText,
}

impl CrashRecord {
    /// Gives each of the [`CRASH_WORDS`] to keep, in order, to `put`.
    pub fn write(&self, mut put: impl FnMut(u32)) {
        let FaultRegisters { pc, lr, cfsr, hfsr, bfar } = self.registers;
        let kind = match self.kind {
            CrashKind::Panic => 1,
            CrashKind::Fault => 2,
        };
        let length = u32::try_from(self.text.0.len()).unwrap_or_default();
        let mut bytes = self.text.0.iter().copied().fuse();
        let mut check = CHECK_BEGIN;
        for word in [MAGIC, kind, pc, lr, cfsr, hfsr, bfar, length] {
            check = checked(check, word);
            put(word);
        }
        for _ in 0..TEXT_WORDS {
            let word = u32::from_le_bytes([(); 4].map(|()| bytes.next().unwrap_or_default()));
            check = checked(check, word);
            put(word);
        }
        put(check);
    }

    /// The crash that [`CRASH_WORDS`] words tell of; `None` of anything else.
    pub fn read(mut get: impl FnMut() -> u32) -> Option<Self> {
        let mut check = CHECK_BEGIN;
        let mut next = || {
            let word = get();
            check = checked(check, word);
            word
        };
        let (magic, kind) = (next(), next());
        let registers = FaultRegisters { pc: next(), lr: next(), cfsr: next(), hfsr: next(), bfar: next() };
        let length = usize::try_from(next()).unwrap_or(usize::MAX);
        let mut text = heapless::Vec::new();
        for _ in 0..TEXT_WORDS {
            for byte in next().to_le_bytes() {
                let _ = text.push(byte);
            }
        }
        text.truncate(length);
        let kind = match kind {
            1 => CrashKind::Panic,
            2 => CrashKind::Fault,
            _ => return None,
        };
        (magic == MAGIC && get() == check).then_some(Self { kind, registers, text: CrashText(text) })
    }
}

/// The hash FNV-1a, by words: it tells garbage from a record.
const CHECK_BEGIN: u32 = 0x811c_9dc5;

/// The check of one word more.
fn checked(check: u32, word: u32) -> u32 {
    (check ^ word).wrapping_mul(0x0100_0193)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;
    use std::vec::Vec;

    use super::*;

    fn record(text: &str) -> CrashRecord {
        let registers =
            FaultRegisters { pc: 0x0800_1234, lr: 0x0800_5679, cfsr: 1 << 9, hfsr: 1 << 30, bfar: 7 };
        CrashRecord { kind: CrashKind::Fault, registers, text: CrashText::of(&text) }
    }

    fn written(record: &CrashRecord) -> Vec<u32> {
        let mut words = Vec::new();
        record.write(|word| words.push(word));
        words
    }

    fn read(words: &[u32]) -> Option<CrashRecord> {
        assert_eq!(words.len(), CRASH_WORDS);
        let mut words = words.iter();
        CrashRecord::read(|| *words.next().unwrap())
    }

    /// Texts of any length, and both kinds.
    #[test]
    fn law_what_is_kept_is_told() {
        for text in ["", "a", "four", "panicked at src/a.rs:1:2:\nas requested", &"x".repeat(96)] {
            let fault = record(text);
            let panic =
                CrashRecord { kind: CrashKind::Panic, registers: FaultRegisters::default(), ..fault.clone() };
            for kept in [fault, panic] {
                assert_eq!(read(&written(&kept)), Some(kept.clone()));
                assert_eq!(kept.text.as_str(), text);
            }
        }
    }

    #[test]
    fn exact_a_long_text_is_cut_off_and_is_ascii() {
        assert_eq!(record(&"y".repeat(200)).text.as_str(), "y".repeat(96));
        assert_eq!(
            record(&format!("{}\u{20ac}", "x".repeat(94))).text.as_str(),
            format!("{}??", "x".repeat(94))
        );
    }

    /// Memory after a loss of power: zeros, ones, and a record any bit of which has turned.
    #[test]
    fn law_garbage_is_no_record() {
        assert_eq!(read(&[0; CRASH_WORDS]), None);
        assert_eq!(read(&[u32::MAX; CRASH_WORDS]), None);
        let words = written(&record("as requested"));
        for bit in 0..32 * CRASH_WORDS {
            let mut spoilt = words.clone();
            spoilt[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(read(&spoilt), None, "bit {bit}");
        }
    }

    #[test]
    fn exact_causes() {
        assert_eq!(CrashKind::Panic.reset_cause(), ResetCause::Panic);
        assert_eq!(CrashKind::Fault.reset_cause(), ResetCause::Fault);
    }
}
