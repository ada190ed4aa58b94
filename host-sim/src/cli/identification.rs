//! `identify`: a motor's parameters from recordings of it.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueHint};

use super::count::Count;
use super::report::{ReportArgs, Request};
use super::{Format, progress};
use crate::cli::CommandError;
use crate::report::files::{self, OutputFolder};
use crate::studies::identification::{
    self, Calibration, CalibrationPlan, Effort, Identification, IdentificationPlan, Recorded,
};
use simulation::scene::Scene;

#[derive(Debug, Args)]
pub(super) struct IdentifyArgs {
    /// Recordings of one motor, as `record --log` or `import` writes them
    #[arg(value_name = "LOG.mcap", value_hint = ValueHint::FilePath, required_unless_present = "calibration")]
    logs: Vec<PathBuf>,
    /// How the rotor moves, in place of what the logs say: `height_only`, tilting or `tilting_without_shift`
    #[arg(long)]
    rotor: Option<String>,
    /// Motors that are drawn to learn from: more give narrower intervals and take longer
    #[arg(long, value_name = "N", default_value = "1000", value_parser = Count(100..=100_000))]
    #[arg(allow_negative_numbers = true)]
    motors: u64,
    /// Width of what is known before, per the tolerance from which motors are drawn
    #[arg(long, value_name = "FACTOR", default_value = "1.5", value_parser = width, allow_negative_numbers = true)]
    prior_width: f64,
    /// Leave out which further recording would tell what these do not
    #[arg(long)]
    no_advice: bool,
    /// Folder for identified.toml, posterior.svg and fit.svg
    #[arg(long, value_name = "DIR", default_value = "out/identify")]
    out: PathBuf,
    /// Instead of identifying a motor, try the intervals on N motors that are drawn and forgotten
    #[arg(long, value_name = "N", value_parser = Count(20..=100_000), conflicts_with = "logs")]
    #[arg(allow_negative_numbers = true)]
    calibration: Option<u64>,
    /// Seed of the motors that are drawn
    #[arg(long, value_name = "N", default_value = "1", value_parser = Count(0..=1_000_000))]
    #[arg(allow_negative_numbers = true)]
    seed: u64,
    #[command(flatten)]
    report: ReportArgs,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A width within its bounds.
fn width(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(width) if (0.1..=10.0).contains(&width) => Ok(width),
        _ => Err("a number, 0.1 to 10".to_owned()),
    }
}

impl IdentifyArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        if let Some(motors) = self.calibration {
            return self.calibrate(motors);
        }
        let mut recordings = Vec::new();
        for path in &self.logs {
            let mut recorded = Recorded::read(path)?;
            if let Some(rotor) = &self.rotor {
                recorded.scene.set("plant.rotor", rotor)?;
            }
            recordings.push(recorded);
        }
        let plan = IdentificationPlan::new(recordings, self.effort())?;
        let folder = OutputFolder::create(&self.out)?;
        let report_file = self.report.open()?;
        let bar = progress::bar(plan.work());
        let begun = Instant::now();
        let found = plan.run(&|| bar.inc(1))?;
        bar.finish_and_clear();
        folder.publish(&files_of(&found)?)?;
        if let Some(file) = report_file {
            let report = identification::report(&found, begun.elapsed().as_secs_f64());
            file.publish(&report, &Request::without_scene("identify"))?;
        }
        let text = format!("{}Written to {}\n", found.document().text(), self.out.display());
        Ok(files::print(&self.format.of(text, files::json_line(&found)))?)
    }

    fn effort(&self) -> Effort {
        Effort {
            motors: self.motors,
            advice: !self.no_advice,
            prior_width: self.prior_width,
            seed: self.seed,
        }
    }

    fn calibrate(&self, motors: u64) -> Result<(), CommandError> {
        let mut scene = Scene::default();
        if let Some(rotor) = &self.rotor {
            scene.set("plant.rotor", rotor)?;
        }
        let plan = CalibrationPlan::new(&scene, motors, self.effort())?;
        let bar = progress::bar(plan.work());
        let found: Calibration = plan.run(&|| bar.inc(1))?;
        bar.finish_and_clear();
        Ok(files::print(&self.format.of(found.document().text(), files::json_line(&found)))?)
    }
}

/// The files of what was identified.
fn files_of(found: &Identification) -> Result<Vec<(String, String)>, CommandError> {
    let mut files = vec![("identified.toml".to_owned(), found.scene())];
    if !found.sample.is_empty() {
        files.push(("posterior.svg".to_owned(), found.posterior_svg()?));
        files.push(("fit.svg".to_owned(), found.fit_svg()?));
    }
    Ok(files)
}
