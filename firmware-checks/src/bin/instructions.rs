//! Prints how many instructions each operation takes, by semihosting. `host-sim instructions` runs it and reads its
//! output.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!(
    "only the microcontroller's instructions are counted: run `host-sim instructions`"
);

#[cfg(target_os = "none")]
mod board {
    use cortex_m::{Peripherals, singleton};
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, hprintln};
    use firmware::board::end;
    use firmware_checks::end_with;
    use firmware_checks::instructions::{self, ProgramMemory, SysTick};
    use firmware_checks::parity::LoopMemory;

    #[entry]
    fn main() -> ! {
        let Some(peripherals) = Peripherals::take() else { end(debug::EXIT_FAILURE) };
        // Too large for the stack.
        let Some(memory) = singleton!(: LoopMemory = None) else { end(debug::EXIT_FAILURE) };
        let program = singleton!(: ProgramMemory = ProgramMemory::new());
        let Some(program) = program else { end(debug::EXIT_FAILURE) };
        let timer = SysTick::start(peripherals.SYST);
        hprintln!("compiler {}", env!("COMPILER"));
        end_with(instructions::count_all(&timer, memory, program, |count| hprintln!("{}", count)))
    }
}
