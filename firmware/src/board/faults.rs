//! Handlers of panics, faults and other exceptions, and the end of a program. Each switches the drive off first, and
//! keeps what there is to know until the program has started again.

#![expect(unsafe_code, reason = "the handler of a fault has no stack of its own")]

use core::arch::naked_asm;
use core::panic::PanicInfo;
#[cfg(feature = "checks")]
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::exception;
use cortex_m_semihosting::{debug, heprintln};

use super::{crash, hardware};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    stay_off();
    crash::keep_panic(info);
    if is_debugged() {
        heprintln!("drive {}; {}", on_or_off(), info);
    }
    end(debug::EXIT_FAILURE)
}

/// A fault of the processor. An overflow of the stack may be its cause, so the stack pointer is reset before anything
/// is put on the stack; where it was is the argument of [`after_fault`].
// SAFETY: the vector table expects a function of this name. It does not return, and needs no more than it sets.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
unsafe extern "C" fn hard_fault() -> ! {
    naked_asm!(
        "mov r0, sp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "b {handle}",
        handle = sym after_fault
    )
}

/// `stack` is where the processor put the frame of the exception.
extern "C" fn after_fault(stack: u32) -> ! {
    stay_off();
    let at = crash::keep_fault(stack);
    if is_debugged() {
        heprintln!("drive {}; HardFault at {:#x}", on_or_off(), at);
    }
    end(debug::EXIT_FAILURE)
}

/// An exception that has no handler of its own. On a real board that is a clock from outside that has stopped, after
/// the hardware has cut the bridge off. On the emulated one it is the first warning of the watchdog, which restarts the
/// board.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    end_by_exception(number)
}

/// The end by an exception that nothing handles: its number in ARM's ARMv7-M manual less 16.
pub(super) fn end_by_exception(number: i16) -> ! {
    stay_off();
    if cfg!(feature = "silicon") {
        crash::keep_exception(number);
    }
    restart()
}

/// Switches the drive off. No interrupt switches it on again.
fn stay_off() {
    cortex_m::interrupt::disable();
    hardware::drive_off();
}

/// Whether the drive is on, read from the register.
fn on_or_off() -> &'static str {
    if hardware::drive_is_on() { "on" } else { "off" }
}

/// Whether the handlers take the emulated board for a real one without a debugger, until the next start.
#[cfg(feature = "checks")]
static IS_ALONE: AtomicBool = AtomicBool::new(false);

/// From here on the handlers do as on a real board without a debugger: they say nothing, and the board starts anew.
#[cfg(feature = "checks")]
pub fn be_alone() {
    IS_ALONE.store(true, Ordering::Relaxed);
}

/// Whether this is no emulated board, or is taken for none.
fn is_alone() -> bool {
    #[cfg(feature = "checks")]
    if IS_ALONE.load(Ordering::Relaxed) {
        return true;
    }
    cfg!(feature = "silicon")
}

/// Whether there is an emulator or a debugger: without one, a semihosting call would be a fault itself.
fn is_debugged() -> bool {
    !is_alone() || cortex_m::peripheral::DCB::is_debugger_attached()
}

/// Ends the emulation. Without emulator or debugger the board starts anew.
pub fn end(outcome: debug::ExitStatus) -> ! {
    stay_off();
    if is_debugged() {
        debug::exit(outcome);
    }
    restart()
}

/// The board starts anew: a real one at once, whether or not its watchdog runs, the emulated one by the watchdog.
fn restart() -> ! {
    if is_alone() {
        cortex_m::peripheral::SCB::sys_reset();
    }
    loop {
        cortex_m::asm::nop();
    }
}
