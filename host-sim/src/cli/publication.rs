//! Where a command writes its results: files in a folder, a report, standard output.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::report::{ReportArgs, ReportFile, Request};
use super::{Format, result_json};
use crate::report::OutputError;
use crate::report::chart::Figure;
use crate::report::files::{self, Output, OutputFolder};
use crate::studies::study_report::{StudyCost, StudyReport};

/// The flags of a command that writes a folder.
#[derive(Debug, Args)]
pub(super) struct PublicationArgs {
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    report: ReportArgs,
}

/// A publication whose every destination can be written.
pub(super) struct Publication<'a> {
    format: Format,
    path: &'a Path,
    folder: OutputFolder,
    report: Option<ReportFile>,
    begun: Instant,
}

/// The results of a command.
pub(super) struct Findings {
    /// In words, tables, pictures and key figures. Each picture is written as an SVG file.
    pub report: StudyReport,
    /// Names and contents of the files beside the pictures.
    pub files: Vec<(String, String)>,
    /// For programs: a JSON object. What it is of and the key figures are put before its fields.
    pub json: String,
}

impl PublicationArgs {
    /// Makes the folder, and refuses what cannot be written before the computing. The time until the results are
    /// published is what they cost.
    pub(super) fn open<'a>(&self, folder: &'a Path) -> Result<Publication<'a>, OutputError> {
        let report = self.report.open()?;
        let (path, folder) = (folder, OutputFolder::create(folder)?);
        Ok(Publication { format: self.format, path, folder, report, begun: Instant::now() })
    }
}

impl Publication<'_> {
    /// Writes the files and the report, then prints the result.
    pub(super) fn publish(self, findings: Findings, request: &Request) -> Result<(), OutputError> {
        let cost =
            StudyCost { wall_s: self.begun.elapsed().as_secs_f64(), threads: rayon::current_num_threads() };
        let Findings { report, mut files, json } = findings;
        files.extend(svg_files(&report.pictures)?);
        self.folder.publish(&files)?;
        if let Some(file) = self.report {
            let page = report.page(request.scene, &|key| request.reads(key), cost);
            file.publish(&page, request)?;
        }
        let text = format!("{}Written to {}\n", report.document.text(), self.path.display());
        files::print(&self.format.of(text, result_json::of(request, &report.key_figures, &json)))
    }
}

/// Pictures as SVG, each with the name of its file.
///
/// # Errors
/// When one cannot be laid out.
pub(super) fn svg_files(pictures: &[(String, Figure)]) -> Result<Vec<(String, String)>, OutputError> {
    pictures.iter().map(|(name, figure)| Ok((name.clone(), figure.svg()?))).collect()
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
