//! Other programs: each is started and given a limited time; a failure is reported in the program's own words.

use std::io::{self, Read as _, Seek as _};
use std::process::{Command, Stdio};
use std::time::Duration;

use wait_timeout::ChildExt as _;

/// Longest output that is read.
const OUTPUT_BYTES_MAX: u64 = 1 << 20;

/// Why another program gave no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ToolError {
    /// A program that this command needs and that cannot be started.
    #[error("cannot run {tool}: {source}")]
    NoTool {
        /// The program.
        tool: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// A program that ended in failure.
    #[error("{tool} failed, {complaint}")]
    ToolFailed {
        /// The program.
        tool: &'static str,
        /// Its status, and the last thing that it said.
        complaint: String,
    },
    /// A program that did not end, and was killed.
    #[error("{tool} did not end within {limit_s} s")]
    ToolTooSlow {
        /// The program.
        tool: &'static str,
        /// Time that it had.
        limit_s: f64,
    },
}

impl ToolError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            // It is part of the checkout; it was found, and could not be started.
            Self::NoTool { tool: "firmware/build.sh", .. } => None,
            Self::NoTool { .. } => Some("tests/run.sh installs it".to_owned()),
            _ => None,
        }
    }
}

/// Standard output of `command`, which is killed when it has not ended within `limit`.
///
/// # Errors
/// When it cannot be started, fails, or does not end in time.
pub(crate) fn run_within(
    command: &mut Command,
    tool: &'static str,
    limit: Duration,
) -> Result<String, ToolError> {
    let lost = |source| ToolError::NoTool { tool, source };
    // Files, not pipes: a program that fills a pipe waits for a reader.
    let (stdout, stderr) = (tempfile::tempfile().map_err(lost)?, tempfile::tempfile().map_err(lost)?);
    let (to_stdout, to_stderr) = (stdout.try_clone().map_err(lost)?, stderr.try_clone().map_err(lost)?);
    let mut child = command.stdin(Stdio::null()).stdout(to_stdout).stderr(to_stderr).spawn().map_err(lost)?;
    let waited = child.wait_timeout(limit);
    if !matches!(waited, Ok(Some(_))) {
        // The wait reaps it, whether it was killed or ended at the last moment.
        let _ = child.kill();
        let _ = child.wait();
    }
    let Some(status) = waited.map_err(lost)? else {
        return Err(ToolError::ToolTooSlow { tool, limit_s: limit.as_secs_f64() });
    };
    let said = text(&stdout).map_err(lost)?;
    if status.success() {
        return Ok(said);
    }
    let complaint = text(&stderr).map_err(lost)?;
    let last = complaint.lines().chain(said.lines()).rfind(|line| !line.trim().is_empty());
    let what = last.map_or_else(String::new, |line| format!(": {}", line.trim()));
    Err(ToolError::ToolFailed { tool, complaint: format!("{status}{what}") })
}

/// All that was written to `file`, up to a limit.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn text(mut file: &std::fs::File) -> io::Result<String> {
    file.rewind()?;
    let mut bytes = Vec::new();
    file.take(OUTPUT_BYTES_MAX).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    const QEMU: &str = "qemu-system-arm";
    const LIMIT: Duration = Duration::from_secs(120);
    const SHELL: &str = "sh";

    fn shell(script: &str, limit: Duration) -> Result<String, ToolError> {
        run_within(Command::new(SHELL).args(["-c", script]), SHELL, limit)
    }

    #[test]
    fn exact_what_a_program_prints() {
        assert_eq!(shell("echo a; echo b >&2", LIMIT).unwrap(), "a\n");
    }

    #[test]
    fn exact_a_program_that_fails_is_quoted() {
        let error = shell("echo first >&2; echo why >&2; exit 3", LIMIT).unwrap_err();
        assert_eq!(error.to_string(), "sh failed, exit status: 3: why");
    }

    #[test]
    fn exact_a_program_that_is_not_there_is_named() {
        let error = run_within(&mut Command::new("/nowhere/qemu"), QEMU, LIMIT).unwrap_err();
        assert!(matches!(error, ToolError::NoTool { .. }));
        assert!(error.to_string().contains("qemu-system-arm"), "{error}");
        assert!(error.hint().unwrap().contains("tests/run.sh installs it"), "{}", error.hint().unwrap());
    }

    /// A program that would write a file in the end, had it not been killed.
    #[test]
    fn law_a_program_that_does_not_end_is_killed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("alive");
        let script = format!("while [ ! -e {0} ]; do :; done; echo > {0}2", file.display());
        let error = shell(&script, Duration::from_millis(200)).unwrap_err();
        assert!(matches!(error, ToolError::ToolTooSlow { .. }), "{error}");
        std::fs::write(&file, "").unwrap();
        std::thread::sleep(Duration::from_millis(300));
        assert!(!folder.path().join("alive2").exists());
    }
}
