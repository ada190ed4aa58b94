//! `jog`: a drive by hand on a real board, and `self-test`: what it tells of itself.

use clap::Args;

use super::port_args::{PortArgs, identified};
use super::report::Request;
use super::{Format, MapArgs, SceneArgs, result_json};
use crate::board::serial::{FrameSource, SerialJog, SerialSelfTest};
use crate::cli::CommandError;
use crate::report::files;

/// The flags that are names of keys.
const KEY_FLAGS: [&str; 3] = ["--mode", "--level", "--duration"];

#[derive(Debug, Args)]
pub(super) struct JogArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Mode of the drive: B turns clockwise, C counter-clockwise
    #[arg(long, value_name = "MODE")]
    mode: Option<String>,
    /// Amplitude of the drive, 0 to 1
    #[arg(long, value_name = "LEVEL", allow_negative_numbers = true)]
    level: Option<String>,
    /// Time in s for which the drive is on, at most 1
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl JogArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        // Modes are capitals in the papers, and small letters in a scene.
        let mode = self.mode.as_ref().map(|mode| mode.to_ascii_lowercase());
        let flags = [("jog.mode", &mode), ("jog.level", &self.level), ("jog.duration_s", &self.duration)];
        let scene = self.map.provide(self.scene.load("jog", &flags)?)?;
        let interrupted = self.port.watch()?;
        let jog = SerialJog {
            port: &self.port.port,
            baud: self.port.baud(),
            scene: &scene,
            interrupted: &interrupted,
        };
        let outcome = jog.run(identified)?;
        let request = Request::of_scene("jog", &scene).with_key_flags(&KEY_FLAGS);
        let json = result_json::of(&request, &[], &files::json_line(&outcome));
        Ok(files::print(&self.format.of(outcome.to_string(), json))?)
    }
}

#[derive(Debug, Args)]
pub(super) struct SelfTestArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Where camera frames come from: `plant` for the simulated camera, or lines as of `run`, from standard input for
    /// `-`, a program that listens for `tcp:HOST:PORT`, a named pipe, or a recorded file
    #[arg(long, value_name = "SOURCE", default_value = "plant")]
    camera: String,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl SelfTestArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("self-test", &[])?;
        let interrupted = self.port.watch()?;
        let source = FrameSource::named(&self.camera);
        let test = SerialSelfTest {
            port: &self.port.port,
            baud: self.port.baud(),
            scene: &scene,
            source: &source,
            interrupted: &interrupted,
        };
        let outcome = test.run(identified)?;
        let request = Request::of_scene("self-test", &scene);
        let json = result_json::of(&request, &[], &files::json_line(&outcome));
        files::print(&self.format.of(outcome.to_string(), json))?;
        if outcome.ok { Ok(()) } else { Err(CommandError::SelfTestFailed { failed: outcome.failed() }) }
    }
}
