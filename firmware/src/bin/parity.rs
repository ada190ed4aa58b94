//! Prints the digests of the runs: by semihosting on the microcontroller, by standard output on the host.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), motor_model::OutOfBounds> {
    use firmware::parity::{LoopRun, TwinRun};
    use motor_model::ImpactRule;

    println!("{}", TwinRun::compute(ImpactRule::EndOfStep)?);
    println!("{}", TwinRun::compute(ImpactRule::Located)?);
    println!("{}", LoopRun::compute()?);
    Ok(())
}

#[cfg(target_os = "none")]
mod board {
    // Supplies the critical section that semihosting needs.
    use cortex_m as _;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln, hprintln};
    use firmware::board::end;
    use firmware::parity::{LoopRun, TwinRun};
    use motor_model::{ImpactRule, OutOfBounds};

    #[entry]
    fn main() -> ! {
        let outcome = match print() {
            Ok(()) => debug::EXIT_SUCCESS,
            Err(error) => {
                // The key alone: printing its numbers would link decimal conversion of f64.
                heprintln!("{} is out of bounds", error.key);
                debug::EXIT_FAILURE
            }
        };
        end(outcome)
    }

    fn print() -> Result<(), OutOfBounds> {
        hprintln!("{}", TwinRun::compute(ImpactRule::EndOfStep)?);
        hprintln!("{}", TwinRun::compute(ImpactRule::Located)?);
        hprintln!("{}", LoopRun::compute()?);
        Ok(())
    }
}
