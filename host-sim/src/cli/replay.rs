//! `replay` and `explain`: a log through a filter, and a log in words.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueHint};

use super::log_args::LogArgs;
use super::report::Request;
use super::{Format, result_json};
use crate::cli::CommandError;
use crate::log::{LogError, explain, open, replay};
use crate::report::files;
use simulation::scene::keys::estimator::FILTERS;
use simulation::scene::{Origin, Scene, SceneError};

#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// Log of a run (`--log FILE.mcap`), or what `import` has written
    #[arg(value_name = "LOG.mcap", value_hint = ValueHint::FilePath)]
    log_file: PathBuf,
    /// Filter to replay it through, instead of the one that was recorded
    #[arg(long, value_parser = PossibleValuesParser::new(FILTERS))]
    filter: Option<String>,
    /// Set one key `motor.` or `estimator.` of the filter, over the scene in the log; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Refuse a log that is damaged, instead of reading it up to the damage
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    log: LogArgs,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl ReplayArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        self.log.apart_from([&self.log_file])?;
        let scene = self.changed(open(&self.log_file)?.0.scene)?;
        let mut log = self.log.open("replay", &scene)?;
        let replayed = match replay(&self.log_file, &scene, self.strict, &mut log) {
            Err(LogError::Ended) => return Err(log.stopped().into()),
            other => other?,
        };
        let request = Request::of_log("replay", &scene);
        let json = result_json::of(&request, &replayed.key_figures(), &files::json_line(&replayed));
        let logged = log.finish(&json)?;
        Ok(files::print(&self.format.of(format!("{replayed}{logged}"), json))?)
    }

    /// The scene of the log with what the flags set of its filter.
    fn changed(&self, mut scene: Scene) -> Result<Scene, SceneError> {
        let admit = |key: &'static str| {
            if key.starts_with("estimator.") || key.starts_with("motor.") {
                return Ok(());
            }
            Err(SceneError::NotRead {
                refusal: format!("replay does not read {key}"),
                hint: "it reads keys estimator. and motor.; everything else has happened already".to_owned(),
            })
        };
        for text in &self.set {
            let (key, value) =
                text.split_once('=').ok_or_else(|| SceneError::NotAnAssignment { text: text.clone() })?;
            scene.assign(key.trim(), value.trim(), &admit, Origin::Set)?;
        }
        if let Some(filter) = &self.filter {
            scene.assign("estimator.filter", filter, &admit, Origin::Flag)?;
        }
        Ok(scene)
    }
}

#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// Log of a run (`--log FILE.mcap`)
    #[arg(value_name = "LOG.mcap", value_hint = ValueHint::FilePath)]
    log_file: PathBuf,
    /// Refuse a log that is damaged, instead of reading it up to the damage
    #[arg(long)]
    strict: bool,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl ExplainArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let explanation = explain(&self.log_file, self.strict)?;
        let scene = open(&self.log_file)?.0.scene;
        let request = Request::of_log("explain", &scene);
        let json = result_json::of(&request, &explanation.key_figures(), &files::json_line(&explanation));
        Ok(files::print(&self.format.of(explanation.to_string(), json))?)
    }
}
