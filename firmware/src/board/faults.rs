//! What a program does when it can do no more.

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::exception;
use cortex_m_semihosting::{debug, heprintln};

use super::mps2;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    mps2::drive_off();
    heprintln!("drive {}; {}", on_or_off(), info);
    end(debug::EXIT_FAILURE)
}

/// A fault of the processor. The stack may be what is at fault: it begins anew, before anything is put on it.
#[expect(unsafe_code, reason = "nothing that was on the stack is used again")]
#[exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    // SAFETY: `after_fault` does not return, and wants nothing but a stack.
    unsafe {
        asm!("ldr r0, =_stack_start", "msr msp, r0", "b {handle}", handle = sym after_fault, options(noreturn))
    }
}

extern "C" fn after_fault() -> ! {
    mps2::drive_off();
    heprintln!("drive {}; HardFault", on_or_off());
    end(debug::EXIT_FAILURE)
}

/// As the register says, not as it should.
fn on_or_off() -> &'static str {
    if mps2::drive_is_on() { "on" } else { "off" }
}

/// Ends the emulation; where no emulator or debugger listens, stands still.
pub fn end(outcome: debug::ExitStatus) -> ! {
    debug::exit(outcome);
    loop {
        cortex_m::asm::wfi();
    }
}
