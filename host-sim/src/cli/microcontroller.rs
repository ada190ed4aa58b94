//! `instructions`, `pil` and `size`: the firmware on an emulated board.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;

use super::report::Request;
#[cfg(feature = "telemetry")]
use super::telemetry;
use super::{Format, MapArgs, SceneArgs, result_json};
use crate::board::BoardError;
use crate::board::instructions::cycles::CycleEstimate;
use crate::board::instructions::{self, Listing};
use crate::board::pil;
use crate::board::qemu::{self, Board, Wiring};
use crate::board::size;
use crate::cli::CommandError;
use crate::report::files;
use crate::report::key_figure::KeyFigure;
use simulation::runs::position;
use simulation::scene::Scene;

#[derive(Debug, Args)]
pub(super) struct InstructionsArgs {
    /// Board to emulate
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Program to run, instead of building it
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Count other crates' Kalman filters too, at the core's own problem
    #[arg(long, conflicts_with = "out")]
    peers: bool,
    /// Estimate the cycles of the hot operations instead, by llvm-mca from what is executed
    #[arg(long, conflicts_with_all = ["elf", "peers", "out"])]
    cycles: bool,
    /// Write the counts as JSON, as tests/qemu keeps them
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl InstructionsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        if self.cycles {
            let estimates = instructions::cycles::estimate(self.board)?;
            let text = instructions::cycles::table(self.board, &estimates);
            let figures: Vec<KeyFigure> = estimates.iter().flat_map(CycleEstimate::key_figures).collect();
            return Ok(files::print(
                &self.format.of(text, self.json(&figures, &files::json_lines(&estimates))),
            )?);
        }
        let file = self.out.as_deref().map(files::Output::create).transpose()?;
        let mut listing = count_instructions(self.elf.as_deref(), self.board)?;
        if self.peers {
            let elf = instructions::program::build("peers")?;
            listing.counts.extend(count_instructions(Some(&elf), self.board)?.counts);
        }
        let report = instructions::CountReport::new(self.board, listing).map_err(BoardError::from)?;
        if let Some(mut file) = file {
            file.write_all(report.json().as_bytes()).map_err(|source| file.unwritable(source))?;
            file.publish()?;
        }
        let json = self.json(&report.key_figures(), &report.json());
        Ok(files::print(&self.format.of(report.to_string(), json))?)
    }

    /// The result whose rows are the array `operations`.
    fn json(&self, key_figures: &[KeyFigure], operations: &str) -> String {
        let (board, operations) = (self.board.key(), operations.trim_end());
        let result = format!("{{\"board\":\"{board}\",\"operations\":{operations}}}");
        result_json::of(&Request::without_scene("instructions"), key_figures, &result)
    }
}

/// What the program prints that counts, run on `board`: that in `elf`, or one built for it.
pub(super) fn count_instructions(elf: Option<&Path>, board: Board) -> Result<Listing, BoardError> {
    qemu::check()?;
    let elf = elf.map_or_else(|| instructions::program::build("instructions"), |elf| Ok(elf.to_owned()))?;
    Ok(Listing::parse(&qemu::run(&elf, board)?)?)
}

#[derive(Debug, Args)]
pub(super) struct PilArgs {
    /// Board to emulate
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
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
        let scene = self.map.provide(self.scene.load("pil", &[("position.to_deg", &self.to)])?)?;
        qemu::check()?;
        let elf = self.elf.clone().map_or_else(|| instructions::program::build("pil"), Ok)?;
        if self.plan {
            let plan = self.plan(&scene, &elf)?;
            return Ok(files::print(&self.format.of(plan.to_string(), files::json_line(&plan)))?);
        }
        let (run, log) = match &self.telemetry {
            #[cfg(feature = "telemetry")]
            Some(folder) => telemetry::run(&scene, &elf, self.board, self.link, folder)?,
            _ => (self.run_alone(&scene, &elf)?, String::new()),
        };
        let text = format!("{} (QEMU {})\n{run}{log}", self.board.processor(), self.board.machine());
        let json =
            result_json::of(&Request::of_scene("pil", &scene).with_key_flags(&["--to"]), &[], &run.json());
        files::print(&self.format.of(text, json))?;
        run.difference.map_or(Ok(()), |difference| Err(BoardError::from(difference).into()))
    }

    /// What the firmware says that the move will take.
    fn plan(&self, scene: &Scene, elf: &Path) -> Result<position::MovePlan, CommandError> {
        let wiring = Wiring { transport: self.link, log: None };
        let mut board = pil::LockStepBoard::start(elf, self.board, wiring)?;
        let forecast = board.forecast(scene)?;
        board.finish()?;
        Ok(position::plan_of(scene, forecast)?)
    }

    /// The run without its log.
    fn run_alone(&self, scene: &Scene, elf: &Path) -> Result<pil::ComparedMove, BoardError> {
        let wiring = Wiring { transport: self.link, log: None };
        let mut processor = pil::LockStepBoard::start(elf, self.board, wiring)?;
        let run = pil::run(scene, &mut processor)?;
        processor.finish()?;
        Ok(run)
    }
}

#[derive(Debug, Args)]
pub(super) struct SizeArgs {
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl SizeArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        qemu::check()?;
        let report = size::SizeReport::measure()?;
        let json = result_json::of(&Request::without_scene("size"), &[], &report.json());
        files::print(&self.format.of(report.to_string(), json))?;
        let complaints = report.complaints();
        if complaints.is_empty() { Ok(()) } else { Err(BoardError::Oversize(complaints).into()) }
    }
}
