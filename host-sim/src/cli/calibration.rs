//! `calibrate`: the gyroscope on the rotor.

use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;

use super::{Format, SceneArgs, progress_style};
use crate::calibrate;
use crate::error::CommandError;
use crate::export::{self, OutputFolder};

#[derive(Debug, Args)]
pub(super) struct CalibrateArgs {
    /// Calibrations, each of a gyroscope of its own
    #[arg(long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    runs: String,
    /// Motors that the calibrations are spread over, at most one each
    #[arg(long, value_name = "N", default_value = "10", allow_negative_numbers = true)]
    motors: String,
    /// Motor time of the plan in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    /// Folder for calibrate.svg and runs.csv
    #[arg(long, value_name = "DIR", default_value = "out/calibrate")]
    out: PathBuf,
    /// Replace the section between `<!-- calibration:begin -->` and `<!-- calibration:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl CalibrateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let runs = calibrate::RUNS.integer(&self.runs)?;
        let motors = calibrate::MOTORS.integer(&self.motors)?;
        let scene = self.scene.load(&[("calibrate.duration_s", &self.duration)])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            calibrate::SECTION.read(path)?;
        }
        let plan = calibrate::Plan::new(&scene, runs, motors)?;
        let folder = OutputFolder::create(&self.out)?;
        let bar = ProgressBar::new(plan.motors()).with_style(progress_style());
        let calibrations = plan.run(&|| bar.inc(1))?;
        bar.finish_and_clear();
        folder.publish(&[
            ("calibrate.svg".to_owned(), calibrations.picture()?),
            ("runs.csv".to_owned(), calibrations.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            calibrate::SECTION.write(path, &calibrations.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", calibrations.document().text(), self.out.display()),
            Format::Json => calibrations.json(),
        })
    }
}
