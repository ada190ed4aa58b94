//! The microcontroller's programs, built from the checkout that this command was built from.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::board::BoardError;
use crate::tool::ToolError;

/// Builds the program `name` of `firmware` or `firmware-checks` and returns its ELF. How the build comes along is shown on standard error.
///
/// # Errors
/// When the checkout has gone, or no toolchain for the microcontroller can be had.
pub fn build(name: &str) -> Result<PathBuf, BoardError> {
    build_with(name, None)
}

/// The same, with the filter `only` alone.
///
/// # Errors
/// When the checkout has gone, or no toolchain for the microcontroller can be had.
pub fn build_with(name: &str, only: Option<&str>) -> Result<PathBuf, BoardError> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/build.sh");
    let tool = "firmware/build.sh";
    let output = Command::new(script)
        .arg(name)
        .args(only)
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|source| ToolError::NoTool { tool, source })?;
    if !output.status.success() {
        return Err(ToolError::ToolFailed { tool, complaint: output.status.to_string() }.into());
    }
    let said = String::from_utf8_lossy(&output.stdout);
    let elf = said.lines().next_back().unwrap_or_default();
    Ok(PathBuf::from(elf))
}
