//! `estimate` and `filters`: the filters against the truth, and what they cost.

use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;

use super::microcontroller::count_instructions;
use super::{Format, SceneArgs, progress_style};
use crate::error::CommandError;
use crate::export::{self, OutputFolder};
use crate::instructions::Board;
use crate::{estimate, filters};

#[derive(Debug, Args)]
pub(super) struct EstimateArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, value_name = "N", default_value = "100", allow_negative_numbers = true)]
    plants: String,
    /// Folder for estimate.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/estimate")]
    out: PathBuf,
    /// Replace the section between `<!-- estimate:begin -->` and `<!-- estimate:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl EstimateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let plants = estimate::PLANTS.integer(&self.plants)?;
        let scene = self.scene.load(&[])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            estimate::SECTION.read(path)?;
        }
        let plan = estimate::Plan::new(&scene, plants)?;
        let folder = OutputFolder::create(&self.out)?;
        let bar = ProgressBar::new(plan.milliseconds()).with_style(progress_style());
        let estimation = plan.run(&|milliseconds| bar.inc(milliseconds))?;
        bar.finish_and_clear();
        folder.publish(&[
            ("estimate.svg".to_owned(), estimation.picture()?),
            ("table.csv".to_owned(), estimation.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            estimate::SECTION.write(path, &estimation.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", estimation.document().text(), self.out.display()),
            Format::Json => estimation.json(),
        })
    }
}

#[derive(Debug, Args)]
pub(super) struct FiltersArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, value_name = "N", default_value = "20", allow_negative_numbers = true)]
    plants: String,
    /// Leave the microcontroller's instructions out: neither the cross compiler nor the emulator is needed then
    #[arg(long)]
    host_only: bool,
    /// Folder for filters.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/filters")]
    out: PathBuf,
    /// Replace the section between `<!-- filters:begin -->` and `<!-- filters:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl FiltersArgs {
    /// How often each cost is measured.
    const ROUNDS: u32 = 10;

    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let plants = filters::PLANTS.integer(&self.plants)?;
        let scene = self.scene.load(&[])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            filters::SECTION.read(path)?;
        }
        let plan = filters::Plan::new(&scene, plants, Self::ROUNDS)?;
        let folder = OutputFolder::create(&self.out)?;
        let counts = if self.host_only { None } else { Some(count_instructions(None, Board::M4)?) };
        let bar = ProgressBar::new(plan.recordings()).with_style(progress_style());
        let comparison = plan.run(counts.as_ref(), &|| bar.inc(1))?;
        bar.finish_and_clear();
        folder.publish(&[
            ("filters.svg".to_owned(), comparison.picture()?),
            ("table.csv".to_owned(), comparison.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            filters::SECTION.write(path, &comparison.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", comparison.document().text(), self.out.display()),
            Format::Json => comparison.json(),
        })
    }
}
