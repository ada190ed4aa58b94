//! `accuracy`: the twin's speed against its error.

use std::path::PathBuf;

use clap::Args;

use super::Format;
use crate::accuracy;
use crate::error::CommandError;
use crate::export::{self, OutputFolder};

#[derive(Debug, Args)]
pub(super) struct AccuracyArgs {
    /// Folder for accuracy.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/accuracy")]
    out: PathBuf,
    /// Seconds instead of minutes: every figure, none of them sharp
    #[arg(long)]
    quick: bool,
    /// Replace the section between `<!-- accuracy:begin -->` and `<!-- accuracy:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl AccuracyArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            accuracy::readme::SECTION.read(path)?;
        }
        let folder = OutputFolder::create(&self.out)?;
        let plan = if self.quick { accuracy::Plan::quick() } else { accuracy::Plan::full() };
        let accuracy = plan.run()?;
        folder.publish(&[
            ("accuracy.svg".to_owned(), accuracy.picture()?),
            ("table.csv".to_owned(), accuracy.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            accuracy::readme::SECTION.write(path, &accuracy.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", accuracy.document().text(), self.out.display()),
            Format::Json => accuracy.json(),
        })
    }
}
