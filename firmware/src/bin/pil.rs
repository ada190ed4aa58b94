//! Processor in the loop: the loop that flies, in lock step with a host that plays the motor. `host-sim pil` runs it.
//!
//! Frames come on the emulator's standard input and go to its standard output, through semihosting. When the input ends, so does the program.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this is the microcontroller's side: run `host-sim pil`");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod board {
    use controller::Drive;
    // Supplies the critical section that semihosting needs as well.
    use cortex_m::singleton;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln};
    use firmware::application::{Application, MoveMemory};
    use firmware::board::{end, stack_bytes_max};
    use firmware::semihosting::HostFile;
    use motor_model::DriveCommand;

    /// The amplifier is on the host: the report carries the command there.
    struct Plant;

    impl Drive for Plant {
        fn drive(&mut self, command: DriveCommand) -> DriveCommand {
            command
        }
    }

    /// More than a tick's frames.
    const BLOCK_BYTES: usize = 1024;

    #[entry]
    fn main() -> ! {
        let files = HostFile::reader(c"/dev/stdin").zip(HostFile::writer(c"/dev/stdout"));
        let Some((input, output)) = files else {
            heprintln!("the host has no standard input or output");
            end(debug::EXIT_FAILURE)
        };
        let Some(memory) = singleton!(: MoveMemory = MoveMemory::new()) else { end(debug::EXIT_FAILURE) };
        let mut application = Application::new(Plant, memory).with_stack_gauge(stack_bytes_max);
        let mut block = [0; BLOCK_BYTES];
        let mut answers = heapless::Vec::<u8, BLOCK_BYTES>::new();
        loop {
            let bytes = input.read(&mut block);
            if bytes.is_empty() {
                end(debug::EXIT_SUCCESS)
            }
            // As few calls to the host as possible: each stops the emulation.
            let mut heard = true;
            application.receive(bytes, &mut |frame| {
                if answers.extend_from_slice(frame).is_err() {
                    heard &= output.write(&answers) && output.write(frame);
                    answers.clear();
                }
            });
            heard &= output.write(&answers);
            answers.clear();
            if !heard {
                heprintln!("the host does not take what is said");
                end(debug::EXIT_FAILURE)
            }
        }
    }
}
