//! Prints the digests of the runs: by semihosting on the microcontroller, to standard output on the host.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), motor_model::OutOfBounds> {
    use firmware_checks::parity::{LoopRun, TwinRun};
    use motor_model::ImpactRule;

    println!("{}", TwinRun::compute(ImpactRule::EndOfStep)?);
    println!("{}", TwinRun::compute(ImpactRule::Located)?);
    println!("{}", LoopRun::compute(&mut None)?);
    Ok(())
}

#[cfg(target_os = "none")]
mod board {
    // Supplies the critical section that semihosting needs as well.
    use cortex_m::singleton;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, hprintln};
    use firmware::board::end;
    use firmware_checks::end_with;
    use firmware_checks::parity::{LoopMemory, LoopRun, TwinRun};
    use motor_model::{ImpactRule, OutOfBounds};

    #[entry]
    fn main() -> ! {
        let Some(memory) = singleton!(: LoopMemory = None) else { end(debug::EXIT_FAILURE) };
        end_with(print(memory))
    }

    fn print(memory: &mut LoopMemory) -> Result<(), OutOfBounds> {
        hprintln!("{}", TwinRun::compute(ImpactRule::EndOfStep)?);
        hprintln!("{}", TwinRun::compute(ImpactRule::Located)?);
        hprintln!("{}", LoopRun::compute(memory)?);
        Ok(())
    }
}
