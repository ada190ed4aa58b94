//! QEMU, the emulator of the boards: every program of the microcontroller is started here.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the boards, the arguments, and a program that runs to its end in a limited time |
//! | [`watched_process`] | a program that talks to the host through pipes, and is ended when it falls silent |
//! | [`wiring`] | what carries the frames between host and program, and where the program logs |
//! | [`one_processor`] | host and emulator on one processor of this machine |
//! | [`trace`] | the address of every instruction that a program executes |

mod one_processor;
mod trace;
mod watched_process;
mod wiring;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use clap::ValueEnum;

use crate::board::BoardError;
use crate::report::files;
use crate::tool::{ToolError, run_within};
pub(super) use one_processor::OneProcessor;
pub(super) use trace::Trace;
pub(super) use watched_process::{SILENCE_MAX, Watchdog, WatchedProcess};
pub use wiring::{Transport, Wiring};

/// The emulator.
const QEMU: &str = "qemu-system-arm";

/// Time for a program that runs to its end. The one that counts instructions takes some three seconds.
const LIMIT: Duration = Duration::from_secs(120);

/// What lets a program that runs alone print and end.
const SEMIHOSTING: [&str; 2] = ["-semihosting-config", "enable=on,target=native"];

/// An emulated board. Both run the same ELF: it is built for the Cortex-M4F, whose instructions the Cortex-M7 has too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// Cortex-M4F, QEMU's mps2-an386
    #[default]
    M4,
    /// Cortex-M7, QEMU's mps2-an500
    M7,
}

impl Board {
    /// QEMU's name of the board.
    pub fn machine(self) -> &'static str {
        self.of("mps2-an386", "mps2-an500")
    }

    /// Name of the processor.
    pub fn processor(self) -> &'static str {
        self.of("Cortex-M4F", "Cortex-M7")
    }

    /// The word that the command line takes.
    pub fn key(self) -> &'static str {
        self.of("m4", "m7")
    }

    /// What holds for this board.
    pub(super) fn of<T>(self, m4: T, m7: T) -> T {
        match self {
            Self::M4 => m4,
            Self::M7 => m7,
        }
    }
}

/// Whether the emulator can be started.
///
/// # Errors
/// When it cannot.
pub(crate) fn check() -> Result<(), BoardError> {
    run_within(Command::new(QEMU).arg("--version"), QEMU, LIMIT)?;
    Ok(())
}

/// What the program `elf` prints on `board` until it ends.
///
/// # Errors
/// When the program cannot be read, or the emulator cannot be started, fails or does not end in time.
pub(crate) fn run(elf: &Path, board: Board) -> Result<String, BoardError> {
    readable(elf)?;
    let mut command = command(board, "none");
    // An instruction takes 2^10 ns; the program reckons with that.
    command.args(["-icount", "shift=10"]).args(SEMIHOSTING).arg("-kernel").arg(elf);
    Ok(run_within(&mut command, QEMU, LIMIT)?)
}

/// The emulator of `board` without a screen, its serial line connected to `serial`.
fn command(board: Board, serial: &str) -> Command {
    let mut command = Command::new(QEMU);
    command.args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-serial", serial]);
    command
}

/// The error that says that the emulator cannot be run.
fn not_run(source: std::io::Error) -> ToolError {
    ToolError::NoTool { tool: QEMU, source }
}

/// Whether there is a program `elf`.
fn readable(elf: &Path) -> Result<(), BoardError> {
    files::read(elf)?;
    Ok(())
}
