//! QEMU: runs a program for the microcontroller, gives every instruction the same virtual time, and is stopped if it does not end.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use clap::ValueEnum;

use crate::board::BoardError;
use crate::tool::{ToolError, run_within};

/// The emulator.
pub(crate) const QEMU: &str = "qemu-system-arm";

/// The counting program takes some three seconds.
const LIMIT: Duration = Duration::from_secs(120);

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
        match self {
            Self::M4 => "mps2-an386",
            Self::M7 => "mps2-an500",
        }
    }

    /// Name of the processor.
    pub fn processor(self) -> &'static str {
        match self {
            Self::M4 => "Cortex-M4F",
            Self::M7 => "Cortex-M7",
        }
    }

    /// The word that the command line takes.
    pub fn key(self) -> &'static str {
        match self {
            Self::M4 => "m4",
            Self::M7 => "m7",
        }
    }
}

/// Whether the emulator is there.
///
/// # Errors
/// When it cannot be started.
pub fn check() -> Result<(), ToolError> {
    run_within(Command::new(QEMU).arg("--version"), QEMU, LIMIT).map(drop)
}

/// Whether there is a program `elf`.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn readable(elf: &Path) -> Result<(), BoardError> {
    let unreadable = |source| BoardError::Unreadable { path: elf.to_owned(), source };
    std::fs::File::open(elf).map(drop).map_err(unreadable)
}

/// What the program `elf` prints on `board`.
///
/// # Errors
/// When the emulator is not there, fails, or does not end in time.
pub fn run(elf: &Path, board: Board) -> Result<String, BoardError> {
    readable(elf)?;
    let mut command = Command::new(QEMU);
    command
        .args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-serial", "none"])
        // An instruction takes 2^10 ns, which is what the program reckons with.
        .args(["-icount", "shift=10", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(elf);
    Ok(run_within(&mut command, QEMU, LIMIT)?)
}
