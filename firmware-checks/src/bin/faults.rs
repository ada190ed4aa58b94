//! Switches the drive on, then fails as a word on the emulator's standard input says. `tests/qemu` checks that the
//! drive goes off.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!("this runs on the microcontroller: firmware/qemu.sh ELF");

#[cfg(target_os = "none")]
mod board {
    use core::hint::black_box;

    use cortex_m::peripheral::SCB;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln};
    use embedded_hal::digital::OutputPin;
    use firmware::board::mps2::{Enable, drive_is_on};
    use firmware::board::{Parts, crash, end, stack_word_is_unused, stack_words};
    use firmware::crash_record::{CrashKind, CrashRecord, CrashText, FaultRegisters};
    use firmware::semihosting::HostFile;
    use firmware::stack_gauge::StackGauge;

    #[entry]
    fn main() -> ! {
        // A reset by the watchdog leads here.
        heprintln!("start, drive {}", if drive_is_on() { "on" } else { "off" });
        if let Some(kept) = crash::take() {
            heprintln!("kept {:?} {:?} {}", kept.kind, kept.registers, kept.text.as_str());
            end(debug::EXIT_SUCCESS)
        }
        let mut block = [0; 16];
        let word = HostFile::reader(c"/dev/stdin").map(|input| input.read(&mut block)).unwrap_or_default();
        let Ok(()) = Enable.set_high();
        heprintln!("drive {}", if drive_is_on() { "on" } else { "off" });
        match word {
            b"panic" => panic!("as requested"),
            b"undefined" => cortex_m::asm::udf(),
            b"overflow" => {
                black_box(descend(black_box(1 << 20)));
            }
            b"stack" => {
                let before = stack_bytes_max();
                black_box(descend(black_box(20)));
                heprintln!("stack {} {}", before, stack_bytes_max());
            }
            b"kept" => {
                let registers = FaultRegisters { pc: 1, lr: 2, cfsr: 3, hfsr: 4, bfar: 5 };
                crash::keep(&CrashRecord {
                    kind: CrashKind::Fault,
                    registers,
                    text: CrashText::of(&"as kept"),
                });
                SCB::sys_reset();
            }
            b"hang" => {
                if let Some(mut parts) = Parts::take() {
                    parts.watchdog.start();
                }
                loop {
                    cortex_m::asm::nop();
                }
            }
            _ => heprintln!("no such fault"),
        }
        end(debug::EXIT_SUCCESS)
    }

    /// The most bytes that the stack has taken, by one look at all of it.
    fn stack_bytes_max() -> u32 {
        let mut gauge = StackGauge::new(stack_words());
        gauge.look(stack_words() + 1, stack_word_is_unused);
        gauge.bytes_max()
    }

    /// Takes some hundred bytes of stack in each of `depth` nested calls.
    #[inline(never)]
    fn descend(depth: u32) -> u32 {
        let place = black_box([depth; 16]);
        let below = if depth == 0 { 0 } else { descend(black_box(depth - 1)) };
        below ^ black_box(place).iter().sum::<u32>()
    }
}
