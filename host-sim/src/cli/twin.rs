//! `accuracy`: the twin's speed against its error.

use std::path::PathBuf;

use clap::Args;

use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use crate::cli::CommandError;
use crate::studies::step_accuracy::StepAccuracyPlan;

#[derive(Debug, Args)]
pub(super) struct AccuracyArgs {
    /// Folder for accuracy.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/accuracy")]
    out: PathBuf,
    /// Seconds instead of minutes: every figure, none of them sharp
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    publication: PublicationArgs,
}

impl AccuracyArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let publication = self.publication.open(&self.out)?;
        let plan = if self.quick { StepAccuracyPlan::quick() } else { StepAccuracyPlan::full() };
        let accuracy = plan.run()?;
        let findings = Findings {
            files: vec![("table.csv".to_owned(), accuracy.csv()?)],
            json: accuracy.json(),
            report: accuracy.report(),
        };
        Ok(publication.publish(findings, &Request::without_scene("accuracy"))?)
    }
}
