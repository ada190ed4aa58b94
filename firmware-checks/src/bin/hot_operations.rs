//! Runs the most frequent operations for `host-sim instructions --cycles`, which follows every instruction. Prints
//! nothing.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("only the microcontroller's instructions are followed: run `host-sim instructions --cycles`");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod board {
    use cortex_m::singleton;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::debug;
    use firmware::board::end;
    use firmware_checks::instructions;
    use firmware_checks::parity::LoopMemory;

    #[entry]
    fn main() -> ! {
        let Some(memory) = singleton!(: LoopMemory = None) else { end(debug::EXIT_FAILURE) };
        let ran = instructions::run_hot_operations(memory).is_ok();
        end(if ran { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE })
    }
}
