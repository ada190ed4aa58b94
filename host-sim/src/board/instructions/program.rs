//! The microcontroller's programs, built from the checkout of the project that the command runs in.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::board::BoardError;
use crate::tool::ToolError;

/// What builds them, in a checkout.
const BUILD: &str = "firmware/build.sh";

/// The checkout that the folder `here` is in: the nearest folder upward that holds the script.
fn checkout(here: &Path) -> Result<PathBuf, BoardError> {
    let found = here.ancestors().find(|folder| folder.join(BUILD).is_file());
    found.map(Path::to_owned).ok_or(BoardError::NoCheckout { script: BUILD })
}

/// Builds the program `name` of `firmware` or `firmware-checks` and returns its ELF. The build prints its progress to
/// standard error.
///
/// # Errors
/// When the current folder is in no checkout, or no toolchain for the microcontroller can be had.
pub fn build(name: &str) -> Result<PathBuf, BoardError> {
    build_with(name, None)
}

/// The same, with the filter `only` alone.
///
/// # Errors
/// When the current folder is in no checkout, or no toolchain for the microcontroller can be had.
pub fn build_with(name: &str, only: Option<&str>) -> Result<PathBuf, BoardError> {
    let tool = BUILD;
    // Without a current folder there is no checkout.
    let here = std::env::current_dir().unwrap_or_default();
    let output = Command::new(checkout(&here)?.join(BUILD))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_nearest_folder_upward_with_the_script_is_the_checkout() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("a/b");
        std::fs::create_dir_all(&inside).unwrap();
        let refusal = checkout(&inside).unwrap_err();
        assert!(refusal.to_string().contains(BUILD), "{refusal}");
        assert!(refusal.hint().unwrap().contains("--elf FILE"));
        std::fs::create_dir(folder.path().join("firmware")).unwrap();
        std::fs::write(folder.path().join(BUILD), "").unwrap();
        assert_eq!(checkout(&inside).unwrap(), folder.path());
    }
}
