//! Switches the drive on, then fails as a word on the emulator's standard input says. `tests/qemu` checks that the
//! drive goes off. After `alone ` the word fails as on a real board without a debugger, which starts anew.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!("this runs on the microcontroller: firmware/qemu.sh ELF");

#[cfg(target_os = "none")]
mod board {
    use core::hint::black_box;

    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln};
    use embedded_hal::digital::OutputPin;
    use firmware::board::mps2::{Enable, drive_is_on};
    use firmware::board::{Parts, be_alone, crash, end, stack_word_is_unused, stack_words};
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
        let words = HostFile::reader(c"/dev/stdin").map(|input| input.read(&mut block)).unwrap_or_default();
        let word = words.strip_prefix(b"alone ").unwrap_or(words);
        if word != words {
            be_alone();
        }
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
