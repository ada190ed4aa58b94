//! Prints how many instructions other crates' Kalman filters take, as `instructions` does for this project's.
//! `host-sim instructions --peers` runs both.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!(
    "only the microcontroller's instructions are counted: run `host-sim instructions --peers`"
);

#[cfg(target_os = "none")]
mod board {
    use cortex_m::Peripherals;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, hprintln};
    use firmware::board::end;
    use firmware_checks::instructions::{self, SysTick};

    #[entry]
    fn main() -> ! {
        let Some(peripherals) = Peripherals::take() else { end(debug::EXIT_FAILURE) };
        let timer = SysTick::start(peripherals.SYST);
        hprintln!("compiler {}", env!("COMPILER"));
        instructions::count_peers(&timer, |count| hprintln!("{}", count));
        end(debug::EXIT_SUCCESS)
    }
}
