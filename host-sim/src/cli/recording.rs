//! `record`: the true motor under given drives, into a log.

use std::ops::ControlFlow;

use clap::Args;

use super::log_args::LogArgs;
use super::{Format, SceneArgs};
use crate::cli::CommandError;
use crate::report::files;
use simulation::runs::recording;

#[derive(Debug, Args)]
pub(super) struct RecordArgs {
    /// Drives, one after the other: `b:1 for 0.5, off for 0.3, c:0.5@7440..7480 for 2`, `(b:1 for 0.1, off for 0.1) x4`
    #[arg(long, value_name = "DRIVES")]
    schedule: Option<String>,
    /// What is recorded: motor, or stator (without a rotor, the vibrometer on a tooth)
    #[arg(long)]
    model: Option<String>,
    /// How the rotor moves: `height_only`, tilting or `tilting_without_shift`
    #[arg(long)]
    rotor: Option<String>,
    #[command(flatten)]
    log: LogArgs,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl RecordArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let flags = [
            ("record.schedule", &self.schedule),
            ("record.model", &self.model),
            ("plant.rotor", &self.rotor),
        ];
        let scene = self.scene.load("record", &flags)?;
        let mut log = self.log.open("record", &scene)?;
        let ControlFlow::Continue(outcome) = recording::run(&scene, &mut log)? else {
            return Err(log.stopped().into());
        };
        let json = files::json_line(&outcome);
        let logged = log.finish(&json)?;
        Ok(files::print(&self.format.of(format!("{outcome}{logged}"), json))?)
    }
}
