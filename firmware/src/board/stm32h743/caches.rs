//! The processor's caches, and the memory that they leave alone: what the DMA writes and reads.
//!
//! Variables and stack lie in the DTCM, which no cache is in front of and which the DMA cannot reach. The rings and
//! buffers of the DMA lie in SRAM1, in the section `.dma` of `memory.x`, which is not cached. Nor is the flash of the
//! kept description, of which nothing may be read ahead either: a word of it may be damaged.
//!
//! | step | register of ARM's ARMv7-M manual |
//! |---|---|
//! | the first 4 KiB of SRAM1 are normal memory that is shared and not cached | `MPU_RNR`, `MPU_RBAR`, `MPU_RASR` |
//! | the last 256 KiB of the flash are strongly ordered memory | the same |
//! | all the rest is as without protection | `MPU_CTRL`: `PRIVDEFENA`, `ENABLE` |
//! | both caches are emptied, and on | `CCR`: `IC`, `DC` |

use cortex_m::{Peripherals, asm};

/// Start of SRAM1.
const START: u32 = 0x3000_0000;
/// A region of `2^(SIZE + 1)` bytes: 4 KiB.
const SIZE: u32 = 11;

/// Start and size of the kept description: 256 KiB.
const KEPT_START: u32 = 0x081c_0000;
const KEPT_SIZE: u32 = 17;
#[cfg(feature = "keep")]
const _: () = assert!(super::flash::START == KEPT_START);

/// Both may read and write.
const ACCESS: u32 = 0b011 << 24;
/// Normal memory, shared, not cached (`TEX` = 1, `C` = 0, `B` = 0), with no program in it.
const NOT_CACHED: u32 = 1 << 28 | 0b001 << 19 | 1 << 18;
/// Strongly ordered memory, shared (`TEX` = 0, `C` = 0, `B` = 0), with no program in it.
const STRONGLY_ORDERED: u32 = 1 << 28 | 1 << 18;

const PRIVILEGED_DEFAULT: u32 = 1 << 2;
const ENABLE: u32 = 1;

/// Sets the regions, then switches the caches on. The clock of SRAM1 is on.
pub(super) fn start() {
    #[expect(unsafe_code, reason = "the program takes the processor's devices after the board's")]
    // SAFETY: nothing else uses cache and protection, now or later.
    let Peripherals { MPU: protection, mut SCB, mut CPUID, .. } = unsafe { Peripherals::steal() };
    #[expect(unsafe_code, reason = "the registers' description does not bound their values")]
    // SAFETY: memory keeps the access that it had; only the cache leaves a part of it alone.
    unsafe {
        protection.rnr.write(0);
        protection.rbar.write(START);
        protection.rasr.write(NOT_CACHED | ACCESS | SIZE << 1 | ENABLE);
        protection.rnr.write(1);
        protection.rbar.write(KEPT_START);
        protection.rasr.write(STRONGLY_ORDERED | ACCESS | KEPT_SIZE << 1 | ENABLE);
        protection.ctrl.write(PRIVILEGED_DEFAULT | ENABLE);
    }
    asm::dsb();
    asm::isb();
    SCB.enable_icache();
    SCB.enable_dcache(&mut CPUID);
}
