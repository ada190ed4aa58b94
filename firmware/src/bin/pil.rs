//! Processor in the loop: the program of the board in lock step with a host that simulates the motor. `host-sim pil`
//! runs it.
//!
//! Frames come from the emulator's standard input and go to its standard output, through semihosting. With `link=uart`
//! on the command line they use the emulated serial line. The program ends with its input. The log of a tick is written
//! before the answer, so a host that has the answer can read the log.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!("this runs on the microcontroller: run `host-sim pil`");

#[cfg(target_os = "none")]
mod board {
    use controller::{Drive, LoopTiming};
    // Supplies the critical section that semihosting needs as well.
    use cortex_m::singleton;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::{debug, heprintln};
    use firmware::application::{Application, MoveMemory};
    use firmware::board::hardware::Line;
    use firmware::board::{Parts, end, stack_word_is_unused, stack_words};
    use firmware::design::DesignedDrive;
    use firmware::main_loop::SerialLine;
    use firmware::semihosting::{HostFile, has_argument};
    use firmware::stack_gauge::StackGauge;
    use firmware::telemetry::{self, log};
    use motor_model::{DriveCommand, MotorParams, OutOfBounds};

    /// The amplifier is on the host: the report carries the command there, when it acts.
    struct Plant {
        timing: LoopTiming,
    }

    impl Drive for Plant {
        fn drive(&mut self, command: DriveCommand) -> DriveCommand {
            command
        }

        fn timing(&self) -> LoopTiming {
            self.timing
        }
    }

    impl DesignedDrive for Plant {
        type Design = ();

        fn design(_: &MotorParams) -> Result<(), OutOfBounds> {
            Ok(())
        }

        fn follow(&mut self, (): ()) {}

        fn keep_time(&mut self, timing: LoopTiming) {
            self.timing = timing;
        }
    }

    /// More than the frames of a tick.
    const BLOCK_BYTES: usize = 1024;

    /// Words of the stack that are looked at between two blocks: all of them in some milliseconds of a move.
    const STACK_WORDS_PER_BLOCK: usize = 64;

    /// The transport of the frames.
    enum Link {
        Files { input: HostFile, output: HostFile },
        Uart(Line),
    }

    impl Link {
        fn open() -> Option<Self> {
            if has_argument(b"link=uart") {
                return Parts::take().map(|parts| Self::Uart(parts.line));
            }
            let (input, output) = HostFile::reader(c"/dev/stdin").zip(HostFile::writer(c"/dev/stdout"))?;
            Some(Self::Files { input, output })
        }

        /// Waits for bytes; an empty slice at the end.
        fn read<'a>(&mut self, block: &'a mut [u8]) -> &'a [u8] {
            match self {
                Self::Files { input, .. } => input.read(block),
                Self::Uart(line) => {
                    let byte = loop {
                        if let Some(byte) = line.read() {
                            break byte;
                        }
                    };
                    block.first_mut().map_or(&[], |place| {
                        *place = byte;
                        core::slice::from_ref(place)
                    })
                }
            }
        }

        /// Writes all of `bytes`; whether the host took them.
        fn write(&mut self, bytes: &[u8]) -> bool {
            match self {
                Self::Files { output, .. } => output.write(bytes),
                Self::Uart(line) => {
                    let mut rest = bytes;
                    while !rest.is_empty() {
                        rest = rest.get(line.write(rest)..).unwrap_or_default();
                    }
                    true
                }
            }
        }
    }

    #[entry]
    fn main() -> ! {
        let Some(mut link) = Link::open() else {
            heprintln!("the host has no standard input or output");
            end(debug::EXIT_FAILURE)
        };
        let Some(memory) = singleton!(: MoveMemory = MoveMemory::new()) else { end(debug::EXIT_FAILURE) };
        let mut application = Application::new(Plant { timing: LoopTiming::default() }, memory);
        let mut stack = StackGauge::new(stack_words());
        let logs = telemetry::open();
        let mut block = [0; BLOCK_BYTES];
        let mut answers = heapless::Vec::<u8, BLOCK_BYTES>::new();
        loop {
            let bytes = link.read(&mut block);
            if bytes.is_empty() {
                end(debug::EXIT_SUCCESS)
            }
            stack.look(STACK_WORDS_PER_BLOCK, stack_word_is_unused);
            application.record_stack(stack.bytes_max());
            // As few calls to the host as possible, because each stops the emulation.
            let mut delivered = true;
            application.receive(bytes, &mut |frame| {
                if answers.extend_from_slice(frame).is_err() {
                    delivered &= link.write(&answers) && link.write(frame);
                    answers.clear();
                }
            });
            if let Some((tick, entry)) = application.telemetry().filter(|_| logs) {
                log(tick, &entry);
            }
            delivered &= link.write(&answers);
            answers.clear();
            if !delivered {
                heprintln!("the host does not take the answers");
                end(debug::EXIT_FAILURE)
            }
        }
    }
}
