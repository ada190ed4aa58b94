//! `completions` and `man`: what a shell and a manual need to know of the command line.

use std::path::{Path, PathBuf};

use clap::{Args, Command, ValueHint};
use clap_complete::Shell;
use clap_mangen::Man;
use serde::Serialize;

use super::{Format, command_line};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::{self, OutputFolder};

#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

impl CompletionsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command_line(), "host-sim", &mut script);
        Ok(files::print(&String::from_utf8_lossy(&script))?)
    }
}

#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Folder for a page of each command; without it the page of host-sim is printed
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// What `man` has written.
#[derive(Serialize)]
struct WrittenPages<'a> {
    written: &'a Path,
    pages: Vec<String>,
}

impl ManArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let mut command = command_line();
        command.build();
        let Some(folder) = &self.out else {
            return Ok(files::print(&page(&command)?)?);
        };
        let output = OutputFolder::create(folder)?;
        let commands = std::iter::once(&command).chain(command.get_subcommands());
        let named = commands
            .filter(|command| command.get_name() != "help")
            .map(|command| Ok((Man::new(command.clone()).get_filename(), page(command)?)));
        let pages = named.collect::<Result<Vec<_>, OutputError>>()?;
        output.publish(&pages)?;
        let text = format!("written            {} pages to {}\n", pages.len(), folder.display());
        let written =
            WrittenPages { written: folder, pages: pages.into_iter().map(|(name, _)| name).collect() };
        Ok(files::print(&self.format.of(text, files::json_line(&written)))?)
    }
}

/// The manual page of a command.
fn page(command: &Command) -> Result<String, OutputError> {
    let mut text = Vec::new();
    Man::new(command.clone()).render(&mut text).map_err(OutputError::StandardOutput)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}
