//! Where a crash is kept over a restart: memory that the start-up code leaves as it is.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::crash_record::{CRASH_WORDS, CrashKind, CrashRecord, CrashText, FaultRegisters};

use super::word_of_stack;

#[expect(unsafe_code, reason = "a section of its own, which the start-up code does not write")]
// SAFETY: whatever the section has at the start is a value of the type.
#[unsafe(link_section = ".uninit.CRASH")]
static CRASH: [AtomicU32; CRASH_WORDS] = [const { AtomicU32::new(0) }; CRASH_WORDS];

/// Keeps `record` until [`take`], over any restart but a loss of power.
// Never inlined: both handlers call it.
#[inline(never)]
pub fn keep(record: &CrashRecord) {
    let mut places = CRASH.iter();
    record.write(|word| {
        if let Some(place) = places.next() {
            place.store(word, Ordering::Relaxed);
        }
    });
}

/// The crash that was kept, once.
pub fn take() -> Option<CrashRecord> {
    let mut places = CRASH.iter();
    CrashRecord::read(|| places.next().map_or(0, |place| place.swap(0, Ordering::Relaxed)))
}

/// Keeps a panic and what it says.
pub(super) fn keep_panic(info: &PanicInfo<'_>) {
    let text = CrashText::of(info);
    keep(&CrashRecord { kind: CrashKind::Panic, registers: FaultRegisters::default(), text });
}

/// Keeps an exception that nothing handles, by its number in ARM's ARMv7-M manual less 16, as a panic.
pub(super) fn keep_exception(number: i16) {
    let text = CrashText::of(&format_args!("exception {number}"));
    keep(&CrashRecord { kind: CrashKind::Panic, registers: FaultRegisters::default(), text });
}

/// Keeps a fault whose frame the processor put at the address `stack`; the address of the instruction.
pub(super) fn keep_fault(stack: u32) -> u32 {
    /// Where return address and instruction are in a frame, in words.
    const LR: u32 = 5;
    const PC: u32 = 6;
    #[expect(unsafe_code, reason = "a fault handler owns nothing")]
    // SAFETY: registers that exist on every part, and are only read.
    let control = unsafe { &*cortex_m::peripheral::SCB::PTR };
    let registers = FaultRegisters {
        pc: word_of_stack(stack, PC),
        lr: word_of_stack(stack, LR),
        cfsr: control.cfsr.read(),
        hfsr: control.hfsr.read(),
        bfar: control.bfar.read(),
    };
    keep(&CrashRecord { kind: CrashKind::Fault, registers, text: CrashText::default() });
    registers.pc
}
