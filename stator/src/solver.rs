//! CalculiX as a program of its own: started in a folder that is removed, with limits of time and memory, its results
//! kept by the deck that they belong to.
//!
//! What it writes is checked ([`output`]) and never trusted.

mod kept;
pub mod output;

use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use wait_timeout::ChildExt as _;

use output::OutputFault;

/// Address space that CalculiX may have, kB: four times what the finest mesh needs.
#[cfg(unix)]
const MEMORY_KB: u64 = 8 << 20;
/// Longest output that is read: ten times what the finest mesh prints.
const OUTPUT_BYTES_MAX: u64 = 200 << 20;
/// Name of the deck, without its ending.
const JOB: &str = "stator";

/// Where CalculiX is, and what it may take.
#[derive(Clone, Debug)]
pub struct Solver {
    /// The program: a name that is looked for, or a path.
    pub program: PathBuf,
    /// Longest time of a run.
    pub limit: Duration,
    /// Folder in which results are kept; `None` for no such folder.
    pub cache: Option<PathBuf>,
}

impl Default for Solver {
    fn default() -> Self {
        Self { program: PathBuf::from("ccx"), limit: Duration::from_secs(600), cache: None }
    }
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// The program is not there.
    #[error("cannot run {program}: no such program")]
    NotThere {
        /// What was to run.
        program: String,
    },
    /// A file or folder of the run cannot be used.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The program ended in failure.
    #[error("{program} failed, {said}")]
    Failed {
        /// What ran.
        program: String,
        /// Its status, and the last error that it told.
        said: String,
    },
    /// The program did not end, and was killed.
    #[error("{program} did not end within {limit_s} s")]
    TooSlow {
        /// What ran.
        program: String,
        /// Time that it had, s.
        limit_s: f64,
    },
    /// What it wrote cannot be a result.
    #[error("what {program} wrote is no result: {fault}")]
    BadOutput {
        /// What ran.
        program: String,
        /// What is wrong.
        fault: OutputFault,
    },
}

impl SolverError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NotThere { .. } => {
                Some("`apt-get install calculix-ccx` installs CalculiX; --ccx tells where it is otherwise")
            }
            Self::TooSlow { .. } => Some("a larger stator.mesh_size_m, or a larger --limit"),
            Self::Failed { .. } | Self::BadOutput { .. } => Some(
                "CalculiX 2.20 and later are known to work; a drawing far from a thin ring may have no solution",
            ),
            Self::File { .. } => None,
        }
    }
}

impl Solver {
    fn name(&self) -> String {
        self.program.display().to_string()
    }

    /// What `read` makes of the output for `deck`, of a run of today or of one that is kept. Only output that `read`
    /// takes is kept; kept output that it does not take is made again.
    ///
    /// # Errors
    /// When CalculiX is not there, fails, is too slow, or writes what `read` refuses; when a folder cannot be used.
    pub fn solve<T>(
        &self,
        deck: &str,
        read: impl Fn(&str) -> Result<T, OutputFault>,
    ) -> Result<T, SolverError> {
        let kept = self.cache.as_deref().map(|folder| kept::path(folder, deck));
        if let Some(result) = kept.as_deref().and_then(kept::read).and_then(|text| read(&text).ok()) {
            return Ok(result);
        }
        let text = self.run(deck)?;
        let result = read(&text).map_err(|fault| SolverError::BadOutput { program: self.name(), fault })?;
        if let Some(path) = kept {
            kept::write(&path, &text).map_err(|source| file_error(&path, source))?;
        }
        Ok(result)
    }

    fn run(&self, deck: &str) -> Result<String, SolverError> {
        let folder = tempfile::tempdir().map_err(|source| file_error(&std::env::temp_dir(), source))?;
        let input = folder.path().join(JOB).with_extension("inp");
        fs::write(&input, deck).map_err(|source| file_error(&input, source))?;
        let log_path = folder.path().join("log");
        let log = fs::File::create(&log_path).map_err(|source| file_error(&log_path, source))?;
        let said = log.try_clone().map_err(|source| file_error(&log_path, source))?;
        let lost = |source: io::Error| match source.kind() {
            io::ErrorKind::NotFound => SolverError::NotThere { program: self.name() },
            _ => SolverError::File { path: self.name(), source },
        };
        let mut child = command(&self.program)
            .current_dir(folder.path())
            // One thread: many runs at once share the processors better, and the sums are in one order.
            .env("OMP_NUM_THREADS", "1")
            .env("NUMBER_OF_CPUS", "1")
            .stdin(Stdio::null())
            .stdout(log)
            .stderr(said)
            .spawn()
            .map_err(lost)?;
        let waited = child.wait_timeout(self.limit);
        if !matches!(waited, Ok(Some(_))) {
            // The wait reaps it, whether it was killed or ended at the last moment.
            let _ = child.kill();
            let _ = child.wait();
        }
        let Some(status) = waited.map_err(lost)? else {
            return Err(SolverError::TooSlow { program: self.name(), limit_s: self.limit.as_secs_f64() });
        };
        if status.code() == Some(NOT_FOUND) {
            return Err(SolverError::NotThere { program: self.name() });
        }
        let log = read_bounded(&log_path).unwrap_or_default();
        if !status.success() || log.contains("*ERROR") {
            let mut lines = log.lines().map(str::trim).filter(|line| !line.is_empty());
            let line = lines.clone().find(|line| line.starts_with("*ERROR")).or_else(|| lines.next_back());
            let said = line.map_or_else(|| status.to_string(), |line| format!("{status}: {line}"));
            return Err(SolverError::Failed { program: self.name(), said });
        }
        let output = folder.path().join(JOB).with_extension("dat");
        read_bounded(&output).map_err(|source| file_error(&output, source))
    }
}

/// What a shell ends with when it finds no program.
const NOT_FOUND: i32 = 127;

/// The command that solves the deck in its folder. A shell sets the bound of memory.
#[cfg(unix)]
fn command(program: &Path) -> Command {
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!("ulimit -v {MEMORY_KB}; exec \"$0\" -i {JOB}")).arg(program);
    command
}

#[cfg(not(unix))]
fn command(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(["-i", JOB]);
    command
}

fn file_error(path: &Path, source: io::Error) -> SolverError {
    SolverError::File { path: path.display().to_string(), source }
}

/// The text of a file, up to a limit.
fn read_bounded(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(OUTPUT_BYTES_MAX).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests;
