//! `compare`: two results side by side.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueHint};

use super::Format;
use super::report::{ReportArgs, Request};
use crate::cli::CommandError;
use crate::report::compare::Comparison;
use crate::report::compare::result_file::ResultFile;
use crate::report::files;

#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// The first result, as `--format json` of a command prints it
    #[arg(value_name = "A.json", value_hint = ValueHint::FilePath)]
    a: PathBuf,
    /// The second
    #[arg(value_name = "B.json", value_hint = ValueHint::FilePath)]
    b: PathBuf,
    /// End with exit code 1 if a key figure changed beyond noise, or a value without a measure of its chance differs
    #[arg(long)]
    fail_on_change: bool,
    /// How to print the comparison; text is Markdown
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    report: ReportArgs,
}

impl CompareArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let begun = Instant::now();
        let report = self.report.open()?;
        let comparison = Comparison::of(ResultFile::read(&self.a)?, ResultFile::read(&self.b)?);
        if let Some(file) = report {
            let page = comparison.report(begun.elapsed().as_secs_f64());
            file.publish(&page, &Request::without_scene("compare"))?;
        }
        files::print(&self.format.of(comparison.document().markdown(), comparison.json()))?;
        match comparison.changes() {
            count if count > 0 && self.fail_on_change => Err(CommandError::Changed { count }),
            _ => Ok(()),
        }
    }
}
