//! Prints how many instructions each operation takes, by semihosting. `host-sim instructions` runs it and reads its
//! output.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("only the microcontroller's instructions are counted: run `host-sim instructions`");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod board {
    use cortex_m::{Peripherals, singleton};
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln, hprintln};
    use firmware::board::end;
    use firmware_checks::instructions::{self, SysTick};
    use firmware_checks::parity::LoopMemory;

    #[entry]
    fn main() -> ! {
        let Some(peripherals) = Peripherals::take() else { end(debug::EXIT_FAILURE) };
        // Too large for the stack.
        let Some(memory) = singleton!(: LoopMemory = None) else { end(debug::EXIT_FAILURE) };
        let timer = SysTick::start(peripherals.SYST);
        hprintln!("compiler {}", env!("COMPILER"));
        let outcome = match instructions::count_all(&timer, memory, |count| hprintln!("{}", count)) {
            Ok(()) => debug::EXIT_SUCCESS,
            Err(error) => {
                // The key alone: printing its numbers would link decimal conversion of f64.
                heprintln!("{} is out of bounds", error.key);
                debug::EXIT_FAILURE
            }
        };
        end(outcome)
    }
}
