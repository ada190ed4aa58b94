//! QEMU: runs a program for the microcontroller, gives every instruction the same virtual time, and is stopped if it does not end.

use std::io::{self, Read as _, Seek as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use clap::ValueEnum;
use wait_timeout::ChildExt as _;

use crate::error::CommandError;

/// The emulator.
pub(crate) const QEMU: &str = "qemu-system-arm";

/// The counting program takes some three seconds.
const LIMIT: Duration = Duration::from_secs(120);

/// More than this no program of ours prints.
const OUTPUT_BYTES_MAX: u64 = 1 << 20;

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
pub fn check() -> Result<(), CommandError> {
    run_within(Command::new(QEMU).arg("--version"), QEMU, LIMIT).map(drop)
}

/// Whether there is a program `elf`.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn readable(elf: &Path) -> Result<(), CommandError> {
    let unreadable = |source| CommandError::Unreadable { path: elf.to_owned(), source };
    std::fs::File::open(elf).map(drop).map_err(unreadable)
}

/// What the program `elf` prints on `board`.
///
/// # Errors
/// When the emulator is not there, fails, or does not end in time.
pub fn run(elf: &Path, board: Board) -> Result<String, CommandError> {
    readable(elf)?;
    let mut command = Command::new(QEMU);
    command
        .args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-serial", "none"])
        // An instruction takes 2^10 ns, which is what the program reckons with.
        .args(["-icount", "shift=10", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(elf);
    run_within(&mut command, QEMU, LIMIT)
}

/// Standard output of `command`, which is killed when it has not ended within `limit`.
fn run_within(command: &mut Command, tool: &'static str, limit: Duration) -> Result<String, CommandError> {
    let lost = |source| CommandError::NoTool { tool, source };
    // Files, not pipes: nobody has to read while the program runs.
    let (stdout, stderr) = (tempfile::tempfile().map_err(lost)?, tempfile::tempfile().map_err(lost)?);
    let (to_stdout, to_stderr) = (stdout.try_clone().map_err(lost)?, stderr.try_clone().map_err(lost)?);
    let mut child = command.stdin(Stdio::null()).stdout(to_stdout).stderr(to_stderr).spawn().map_err(lost)?;
    let waited = child.wait_timeout(limit);
    if !matches!(waited, Ok(Some(_))) {
        // It may have ended just now; either way it is reaped.
        let _ = child.kill();
        let _ = child.wait();
    }
    let Some(status) = waited.map_err(lost)? else {
        return Err(CommandError::ToolTooSlow { tool, limit_s: limit.as_secs_f64() });
    };
    let said = text(&stdout).map_err(lost)?;
    if status.success() {
        return Ok(said);
    }
    let complaint = text(&stderr).map_err(lost)?;
    let last = complaint.lines().chain(said.lines()).rfind(|line| !line.trim().is_empty());
    let what = last.map_or_else(String::new, |line| format!(": {}", line.trim()));
    Err(CommandError::ToolFailed { tool, complaint: format!("{status}{what}") })
}

/// All that was written to `file`, up to a limit.
pub(crate) fn text(mut file: &std::fs::File) -> io::Result<String> {
    file.rewind()?;
    let mut bytes = Vec::new();
    file.take(OUTPUT_BYTES_MAX).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    const SHELL: &str = "sh";

    fn shell(script: &str, limit: Duration) -> Result<String, CommandError> {
        run_within(Command::new(SHELL).args(["-c", script]), SHELL, limit)
    }

    #[test]
    fn exact_what_a_program_prints() {
        assert_eq!(shell("echo a; echo b >&2", LIMIT).unwrap(), "a\n");
    }

    #[test]
    fn exact_a_program_that_fails_is_quoted() {
        let error = shell("echo first >&2; echo why >&2; exit 3", LIMIT).unwrap_err();
        assert_eq!(error.one_line(), "error: sh failed, exit status: 3: why");
    }

    #[test]
    fn exact_a_program_that_is_not_there_is_named() {
        let error = run_within(&mut Command::new("/nowhere/qemu"), QEMU, LIMIT).unwrap_err();
        assert!(matches!(error, CommandError::NoTool { .. }));
        assert!(error.one_line().contains("qemu-system-arm"), "{error}");
        assert!(error.one_line().contains("hint: tests/run.sh installs it"), "{}", error.one_line());
    }

    /// A program that would write a file in the end, had it not been killed.
    #[test]
    fn law_a_program_that_does_not_end_is_killed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("alive");
        let script = format!("while [ ! -e {0} ]; do :; done; echo > {0}2", file.display());
        let error = shell(&script, Duration::from_millis(200)).unwrap_err();
        assert!(matches!(error, CommandError::ToolTooSlow { .. }), "{error}");
        std::fs::write(&file, "").unwrap();
        std::thread::sleep(Duration::from_millis(300));
        assert!(!folder.path().join("alive2").exists());
    }
}
