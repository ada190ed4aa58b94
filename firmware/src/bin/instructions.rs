//! Prints how many instructions each operation takes, by semihosting. `host-sim instructions` runs it and reads what it prints.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("only the microcontroller's instructions are counted: run `host-sim instructions`");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod board {
    use cortex_m::Peripherals;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln, hprintln};
    use firmware::board::end;
    use firmware::instructions::{self, InstructionTimer};

    /// Ticks after which the timer starts again: all its 24 bits.
    const RELOAD: u32 = 0x00ff_ffff;

    /// The timer that every Cortex-M has, at the processor's clock.
    struct SysTick;

    impl SysTick {
        fn start(mut timer: SYST) -> Self {
            timer.set_clock_source(SystClkSource::Core);
            timer.set_reload(RELOAD);
            timer.clear_current();
            timer.enable_counter();
            Self
        }
    }

    impl InstructionTimer for SysTick {
        // Never inlined, so that a reading costs the same wherever it stands.
        #[inline(never)]
        fn ticks(&self) -> u32 {
            SYST::get_current()
        }

        #[inline(never)]
        fn turn(&self, turns: u32) {
            // It makes one turn more than it is told.
            cortex_m::asm::delay(turns - 1);
        }
    }

    #[entry]
    fn main() -> ! {
        let Some(peripherals) = Peripherals::take() else { end(debug::EXIT_FAILURE) };
        let timer = SysTick::start(peripherals.SYST);
        hprintln!("compiler {}", env!("FIRMWARE_RUSTC"));
        let outcome = match instructions::count_all(&timer, |count| hprintln!("{}", count)) {
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
