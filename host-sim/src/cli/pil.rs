//! `pil`: the firmware on an emulated board moves the simulated motor, holds its rate or commissions it, beside the
//! host.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;

use super::port_args::identified;
use super::readers::{PIL_COMMISSION, PIL_MOVE, PIL_RATE};
use super::report::Request;
#[cfg(feature = "telemetry")]
use super::telemetry;
use super::{Format, MapArgs, SceneArgs, result_json};
use crate::board::BoardError;
use crate::board::instructions;
use crate::board::pil::{self, Difference, LockStepBoard};
use crate::board::qemu::{self, Board, Wiring};
use crate::cli::CommandError;
use crate::report::files;
use simulation::runs::position;
use simulation::scene::Scene;

/// The flags that are names of keys.
const KEY_FLAGS: [&str; 3] = ["--to", "--deg-s", "--duration"];

#[derive(Debug, Args)]
pub(super) struct PilArgs {
    /// Board to emulate
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
    /// Hold a rate in deg/s instead of a move, clockwise positive
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    #[arg(conflicts_with_all = ["to", "plan", "telemetry"])]
    deg_s: Option<String>,
    /// Time in s for which the rate is held
    #[arg(long, value_name = "S", allow_negative_numbers = true, requires = "deg_s")]
    duration: Option<String>,
    /// Commission the motor instead of a move: the host orders the experiments, and the firmware makes them
    #[arg(long)]
    #[arg(conflicts_with_all = ["to", "deg_s", "plan", "telemetry"])]
    commission: bool,
    /// Program to run, instead of building it
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Print what the firmware says that the move will take, and do not move
    #[arg(long, conflicts_with = "telemetry")]
    plan: bool,
    /// What carries the frames between host and firmware
    #[arg(long, value_enum, default_value_t)]
    link: qemu::Transport,
    /// Decode the program's log (defmt), and write it beside the truth: telemetry.csv and telemetry.svg. Only in a
    /// command that is built with the feature `telemetry`
    #[arg(long, value_name = "FOLDER")]
    telemetry: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PilArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        if self.telemetry.is_some() && cfg!(not(feature = "telemetry")) {
            return Err(CommandError::LeftOut { what: "pil --telemetry", feature: "telemetry" });
        }
        let scene = self.map.provide(self.scene()?)?;
        qemu::check()?;
        let elf = self.elf.clone().map_or_else(|| instructions::program::build("pil"), Ok)?;
        if self.deg_s.is_some() {
            let run = self.locked(&elf, |board| pil::hold_rate(&scene, board))?;
            return self.print(&scene, &run, &run.json(), run.difference.clone());
        }
        if self.commission {
            let run = self.locked(&elf, |board| pil::commission(&scene, board))?;
            return self.print(&scene, &run, &run.json(), run.difference.clone());
        }
        if self.plan {
            let plan = self.plan(&scene, &elf)?;
            return Ok(files::print(&self.format.of(plan.to_string(), files::json_line(&plan)))?);
        }
        let (run, log) = match &self.telemetry {
            #[cfg(feature = "telemetry")]
            Some(folder) => telemetry::run(&scene, &elf, self.board, self.link, folder)?,
            _ => (self.locked(&elf, |board| pil::run(&scene, board))?, String::new()),
        };
        self.print(&scene, &format_args!("{run}{log}"), &run.json(), run.difference.clone())
    }

    /// The scene; each task reads other keys of it.
    fn scene(&self) -> Result<Scene, CommandError> {
        let reader = match (&self.deg_s, self.commission) {
            (Some(_), _) => &PIL_RATE,
            (None, true) => &PIL_COMMISSION,
            (None, false) => &PIL_MOVE,
        };
        let flags =
            [("position.to_deg", &self.to), ("rate.deg_s", &self.deg_s), ("rate.duration_s", &self.duration)];
        self.scene.load_for(reader, &flags)
    }

    /// Prints what became of a run. A difference is an error.
    fn print(
        &self,
        scene: &Scene,
        run: &impl fmt::Display,
        json: &str,
        difference: Option<Difference>,
    ) -> Result<(), CommandError> {
        let text = format!("{} (QEMU {})\n{run}", self.board.processor(), self.board.machine());
        let request = Request::of_scene("pil", scene).with_key_flags(&KEY_FLAGS);
        files::print(&self.format.of(text, result_json::of(&request, &[], json)))?;
        difference.map_or(Ok(()), |difference| Err(BoardError::from(difference).into()))
    }

    /// What the firmware says that the move will take.
    fn plan(&self, scene: &Scene, elf: &Path) -> Result<position::MovePlan, CommandError> {
        let forecast = self.locked(elf, |board| board.forecast(scene))?;
        Ok(position::plan_of(scene, forecast)?)
    }

    /// What `run` makes of a board with the program `elf`, which ends after it.
    fn locked<R>(
        &self,
        elf: &Path,
        run: impl FnOnce(&mut LockStepBoard) -> Result<R, BoardError>,
    ) -> Result<R, BoardError> {
        let wiring = Wiring { transport: self.link, log: None };
        let mut board = LockStepBoard::start(elf, self.board, wiring)?;
        identified(&board.identity()?.into());
        let result = run(&mut board)?;
        board.finish()?;
        Ok(result)
    }
}
