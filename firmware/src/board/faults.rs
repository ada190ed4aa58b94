//! What a program does when it can do no more.

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::exception;
use cortex_m_semihosting::{debug, heprintln};

use super::hardware;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    hardware::drive_off();
    if is_heard() {
        heprintln!("drive {}; {}", on_or_off(), info);
    }
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
    hardware::drive_off();
    if is_heard() {
        heprintln!("drive {}; HardFault", on_or_off());
    }
    end(debug::EXIT_FAILURE)
}

/// As the register says, not as it should.
fn on_or_off() -> &'static str {
    if hardware::drive_is_on() { "on" } else { "off" }
}

/// Whether an emulator or a debugger listens: without, a word to it would be a fault of its own.
fn is_heard() -> bool {
    cfg!(not(feature = "stm32g474")) || cortex_m::peripheral::DCB::is_debugger_attached()
}

/// Ends the emulation; where no emulator or debugger listens, stands still until the watchdog starts the board anew.
pub fn end(outcome: debug::ExitStatus) -> ! {
    hardware::drive_off();
    if is_heard() {
        debug::exit(outcome);
    }
    loop {
        cortex_m::asm::nop();
    }
}
