//! Where a command writes its results: files in a folder, standard output.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;

use super::Format;
use crate::report::OutputError;
use crate::report::files::{self, Output, OutputFolder};

/// The flags of a command that writes a folder.
#[derive(Debug, Args)]
pub(super) struct PublicationArgs {
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A publication whose every destination can be written.
pub(super) struct Publication<'a> {
    args: &'a PublicationArgs,
    path: &'a Path,
    folder: OutputFolder,
}

/// The results of a command, in each form in which they are written.
pub(super) struct Findings {
    /// Names and contents of the files.
    pub files: Vec<(String, String)>,
    /// For people.
    pub text: String,
    /// For programs.
    pub json: String,
}

impl PublicationArgs {
    /// Makes the folder, and refuses what cannot be written before the computing.
    pub(super) fn open<'a>(&'a self, folder: &'a Path) -> Result<Publication<'a>, OutputError> {
        Ok(Publication { args: self, path: folder, folder: OutputFolder::create(folder)? })
    }
}

impl Publication<'_> {
    pub(super) fn publish(&self, findings: Findings) -> Result<(), OutputError> {
        let Findings { files, text, json } = findings;
        self.folder.publish(&files)?;
        files::print(&self.args.format.of(format!("{text}Written to {}\n", self.path.display()), json))
    }
}

/// The flags of a command that draws one run.
#[derive(Debug, Default, Args)]
pub(super) struct DrawingArgs {
    /// Where to draw the run
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A drawing whose file can be written.
pub(super) struct Drawing {
    path: PathBuf,
    file: Output,
    format: Format,
}

impl DrawingArgs {
    /// How to print the result.
    pub(super) fn format(&self) -> Format {
        self.format
    }

    /// Opens the file, which is `name` in the folder `out` unless a flag says otherwise.
    pub(super) fn open(&self, name: &str) -> Result<Drawing, OutputError> {
        let path = if let Some(path) = &self.out {
            path.clone()
        } else {
            let folder = Path::new("out");
            OutputFolder::create(folder)?;
            folder.join(name)
        };
        Ok(Drawing { file: Output::create(&path)?, path, format: self.format })
    }
}

impl Drawing {
    /// Writes the picture, then prints the run.
    pub(super) fn publish(mut self, svg: &str, text: &str, json: String) -> Result<(), OutputError> {
        self.file.write_all(svg.as_bytes()).map_err(|source| self.file.unwritable(source))?;
        self.file.publish()?;
        files::print(&self.format.of(format!("{text}picture            {}\n", self.path.display()), json))
    }
}
