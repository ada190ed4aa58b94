//! Handlers of panics and faults, and the end of a program. Each switches the drive off first.

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::exception;
use cortex_m_semihosting::{debug, heprintln};

use super::hardware;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    hardware::drive_off();
    if is_debugged() {
        heprintln!("drive {}; {}", on_or_off(), info);
    }
    end(debug::EXIT_FAILURE)
}

/// A fault of the processor. An overflow of the stack may be its cause, so the stack pointer is reset first.
#[expect(unsafe_code, reason = "nothing that was on the stack is used again")]
#[exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    // SAFETY: `after_fault` does not return, and needs only a stack.
    unsafe {
        asm!("ldr r0, =_stack_start", "msr msp, r0", "b {handle}", handle = sym after_fault, options(noreturn))
    }
}

extern "C" fn after_fault() -> ! {
    hardware::drive_off();
    if is_debugged() {
        heprintln!("drive {}; HardFault", on_or_off());
    }
    end(debug::EXIT_FAILURE)
}

/// Whether the drive is on, read from the register.
fn on_or_off() -> &'static str {
    if hardware::drive_is_on() { "on" } else { "off" }
}

/// Whether there is an emulator or a debugger: without one, a semihosting call would be a fault itself.
fn is_debugged() -> bool {
    cfg!(not(feature = "silicon")) || cortex_m::peripheral::DCB::is_debugger_attached()
}

/// Ends the emulation. Without emulator or debugger it waits until the watchdog restarts the board.
pub fn end(outcome: debug::ExitStatus) -> ! {
    hardware::drive_off();
    if is_debugged() {
        debug::exit(outcome);
    }
    loop {
        cortex_m::asm::nop();
    }
}
