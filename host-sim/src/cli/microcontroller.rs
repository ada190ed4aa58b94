//! `instructions`, `size` and `parts`: what the firmware costs on an emulated board, and which part has that.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;

use super::report::Request;
use super::{Format, result_json};
use crate::board::BoardError;
use crate::board::instructions::cycles::CycleEstimate;
use crate::board::instructions::{self, Listing};
use crate::board::parts;
use crate::board::qemu::{self, Board};
use crate::board::size;
use crate::cli::CommandError;
use crate::report::files;
use crate::report::key_figure::KeyFigure;

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

#[derive(Debug, Args)]
pub(super) struct PartsArgs {
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl PartsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let listing = count_instructions(None, Board::M4)?;
        let counts = instructions::CountReport::new(Board::M4, listing).map_err(BoardError::from)?;
        let report =
            parts::PartsReport::new(&counts, size::SizeReport::measure()?).map_err(BoardError::from)?;
        let json = result_json::of(&Request::without_scene("parts"), &[], &report.json());
        Ok(files::print(&self.format.of(report.to_string(), json))?)
    }
}
