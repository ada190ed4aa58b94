//! The error of a program of the microcontroller that gives no result.

use std::path::PathBuf;

use super::instructions::ListingError;
use super::pil::Difference;
use crate::run_reports;
use crate::tool::ToolError;
use simulation::runs::RunError;

/// Why a program of the microcontroller could not be built, run, measured or compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The host's own run stopped, or its result cannot be laid out or written.
    #[error(transparent)]
    Run(RunError),
    /// The emulator or the compiler gave no answer.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// A program to be built outside a checkout of the project.
    #[error("the firmware cannot be built here: neither this folder nor one above it holds {script}")]
    NoCheckout {
        /// The script that builds it.
        script: &'static str,
    },
    /// The microcontroller and the host compute different bits.
    #[error(transparent)]
    Difference(#[from] Difference),
    /// The microcontroller refused something, or answered something else than was asked.
    #[error("the microcontroller {0}")]
    Board(String),
    /// A file that is no program of the microcontroller.
    #[error("{} is no ELF of the microcontroller: {error}", path.display())]
    NoElf {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: String,
    },
    /// A program without the loop.
    #[error("the program has no function {task}")]
    NoTask {
        /// The missing function.
        task: &'static str,
    },
    /// The firmware exceeds the limits of the part, or makes a forbidden call.
    #[error("{}", .0.join("; "))]
    Oversize(Vec<String>),
    /// A listing of instruction counts that is refused.
    #[error("the emulated program printed no instruction counts: {0}")]
    Listing(#[from] ListingError),
}

impl BoardError {
    /// What to try instead, where there is something to try.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Run(error) => run_reports::hint(error),
            Self::Tool(error) => error.hint(),
            Self::NoCheckout { .. } => Some(
                "run the command in a checkout of the project; or give `instructions` and `pil` a program that is \
                 built already, --elf FILE, and `filters` --host-only"
                    .to_owned(),
            ),
            Self::Listing(_) => {
                Some("`firmware/build.sh instructions` builds the program that prints them".to_owned())
            }
            _ => None,
        }
    }
}

impl<E: Into<RunError>> From<E> for BoardError {
    fn from(error: E) -> Self {
        Self::Run(error.into())
    }
}
