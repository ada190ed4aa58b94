//! The address of every instruction that an emulated program executes.

use std::io::{BufRead as _, BufReader, Lines};
use std::path::Path;
use std::process::{Child, ChildStderr, Stdio};

use super::{Board, SEMIHOSTING, command, not_run};
use crate::board::BoardError;

/// The addresses, in the order of execution. Its drop ends the program.
#[derive(Debug)]
pub(in crate::board) struct Trace {
    child: Child,
    lines: Option<Lines<BufReader<ChildStderr>>>,
}

impl Trace {
    /// Starts the program `elf` on `board`, one instruction at a time.
    ///
    /// # Errors
    /// When the emulator cannot be started.
    pub(in crate::board) fn start(elf: &Path, board: Board) -> Result<Self, BoardError> {
        let mut child = command(board, "none")
            .args(["-singlestep", "-d", "exec,nochain"])
            .args(SEMIHOSTING)
            .arg("-kernel")
            .arg(elf)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(not_run)?;
        let lines = child.stderr.take().map(|stderr| BufReader::new(stderr).lines());
        Ok(Self { child, lines })
    }
}

impl Iterator for Trace {
    type Item = Result<u32, BoardError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.lines.as_mut()?.find_map(|line| match line {
            Ok(line) => address(&line).map(Ok),
            Err(source) => Some(Err(not_run(source).into())),
        })
    }
}

impl Drop for Trace {
    fn drop(&mut self) {
        // It may have ended by itself; either way it is reaped.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The program counter in a line like `Trace 0: 0x7f.. [00800408/0000040a/00000110/ff000201] name`.
fn address(line: &str) -> Option<u32> {
    let (_, fields) = line.strip_prefix("Trace")?.split_once('[')?;
    u32::from_str_radix(fields.split('/').nth(1)?, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_address_of_a_line() {
        let line = "Trace 0: 0x7faa98000b40 [00800408/0000040a/00000110/ff000201] Reset";
        assert_eq!(address(line), Some(0x40a));
        assert_eq!(address("Trace 0: 0x7faa98000b40"), None);
        assert_eq!(address("qemu: hello"), None);
    }
}
