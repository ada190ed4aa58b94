//! Runs the most frequent operations for `host-sim instructions --cycles`, which follows every instruction. Prints
//! nothing.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!(
    "only the microcontroller's instructions are followed: run `host-sim instructions --cycles`"
);

#[cfg(target_os = "none")]
mod board {
    use cortex_m::singleton;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::debug;
    use firmware::board::end;
    use firmware_checks::parity::LoopMemory;
    use firmware_checks::{end_with, instructions};

    #[entry]
    fn main() -> ! {
        let Some(memory) = singleton!(: LoopMemory = None) else { end(debug::EXIT_FAILURE) };
        end_with(instructions::run_hot_operations(memory))
    }
}
