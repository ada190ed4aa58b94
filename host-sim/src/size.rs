//! `host-sim size`: what the firmware takes of the microcontroller, and what its loop must not call.
//!
//! - [`Image`]: bytes of flash and RAM of an ELF, section by section.
//! - [`calls`]: every function that can be reached from the two tasks, by their branches.
//! - [`Report`]: both beside the limits, with the deepest stack of moves in the emulator.
//!
//! Held to the part that `firmware/memory` declares, 256 KiB of flash and 64 KiB of RAM, and to the aim of 96 and 16 KiB.

pub mod calls;
mod image;

use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::error::CommandError;
use crate::instructions::Board;
use crate::pil::{self, Emulated};
use crate::scene::Scene;
use crate::section::Section;
pub use calls::Forbidden;
pub use image::Image;

/// Where the README has this section.
pub const SECTION: Section = Section { begin: "<!-- size:begin -->", end: "<!-- size:end -->" };

/// Flash that the project wants to do with.
pub const FLASH_BYTES_AIM: u64 = 96 * 1024;

/// RAM that the project wants to do with, variables and stack.
pub const RAM_BYTES_AIM: u64 = 16 * 1024;

/// The programs that fly: on the emulated board, and in lock step with the simulated motor.
pub const PROGRAMS: [&str; 2] = ["board", "pil"];

/// What a program takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Program {
    /// Its name in `firmware/src/bin`.
    pub program: &'static str,
    /// Code, constants, and what variables begin with.
    pub flash_bytes: u64,
    /// Variables.
    pub static_bytes: u64,
    /// Most that the stack took in moves by every filter; `null` where it was not run.
    pub stack_bytes_max: Option<u32>,
    /// Functions that its tasks can reach.
    pub functions: usize,
    /// Calls from its tasks that must not be.
    pub forbidden: Vec<Forbidden>,
}

impl Program {
    /// Variables and stack.
    pub fn ram_bytes(&self) -> u64 {
        self.static_bytes + u64::from(self.stack_bytes_max.unwrap_or(0))
    }

    /// What is wrong with it.
    pub fn complaints(&self) -> Vec<String> {
        let Self { program, flash_bytes, .. } = self;
        let mut complaints: Vec<String> =
            self.forbidden.iter().map(|forbidden| format!("{program}: {forbidden}")).collect();
        if *flash_bytes > FLASH_BYTES_AIM {
            complaints.push(format!("{program}: {flash_bytes} bytes of flash, aim {FLASH_BYTES_AIM}"));
        }
        if self.ram_bytes() > RAM_BYTES_AIM {
            complaints.push(format!("{program}: {} bytes of RAM, aim {RAM_BYTES_AIM}", self.ram_bytes()));
        }
        complaints
    }
}

/// All programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// In the order of [`PROGRAMS`].
    pub programs: Vec<Program>,
}

impl Report {
    /// Measures the ELF that `elf_of` gives for a program; `pil` is run as well.
    ///
    /// # Errors
    /// When an ELF cannot be had, read or run.
    pub fn measure<P: AsRef<Path>>(
        mut elf_of: impl FnMut(&str) -> Result<P, CommandError>,
    ) -> Result<Self, CommandError> {
        let measured = PROGRAMS.map(|program| {
            let elf = elf_of(program)?;
            let image = Image::read(elf.as_ref())?;
            let reached = calls::reached(&image)?;
            Ok(Program {
                program,
                flash_bytes: image.flash_bytes(),
                static_bytes: image.static_bytes(),
                stack_bytes_max: if program == "pil" { Some(stack(elf.as_ref())?) } else { None },
                functions: reached.functions,
                forbidden: reached.forbidden,
            })
        });
        Ok(Self { programs: measured.into_iter().collect::<Result<_, CommandError>>()? })
    }

    /// Whatever is wrong with any of them.
    pub fn complaints(&self) -> Vec<String> {
        self.programs.iter().flat_map(Program::complaints).collect()
    }

    /// The report as one JSON object on one line.
    pub fn json(&self) -> String {
        let mut text = serde_json::to_string(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The section of the README.
    pub fn markdown(&self) -> String {
        let row = |program: &Program| {
            let Program { program, flash_bytes, static_bytes, stack_bytes_max, .. } = program;
            let stack = stack_bytes_max.map_or("-".to_owned(), |bytes| bytes.to_string());
            format!("| {program} | {flash_bytes} | {static_bytes} | {stack} |")
        };
        let rows: Vec<String> = self.programs.iter().map(row).collect();
        let judged = if self.complaints().is_empty() { "All hold." } else { "Not all hold." };
        let excused: Vec<String> =
            calls::EXCUSED.iter().map(|(callee, reason)| format!("`{callee}`: {reason}")).collect();
        format!(
            "| program | flash | variables | deepest stack |\n| --- | --- | --- | --- |\n{}\n\n\
             Bytes. Aims: {FLASH_BYTES_AIM} of flash, {RAM_BYTES_AIM} of variables and stack; nothing that the tasks can reach may panic, allocate, \
             compute in double precision, or be called by address. {judged} Excused: {}.\n",
            rows.join("\n"),
            excused.join("; ")
        )
    }
}

/// How deep the stack goes in a short move by each filter.
fn stack(elf: &Path) -> Result<u32, CommandError> {
    let mut deepest = 0;
    for filter in crate::filter::FILTERS {
        let mut scene = Scene::default();
        scene.set("estimator.filter", filter)?;
        scene.set("position.deadline_s", "0.2")?;
        let mut processor = Emulated::start(elf, Board::M4)?;
        pil::run(&scene, &mut processor)?;
        deepest = deepest.max(processor.counters()?.stack_bytes_max);
        processor.finish()?;
    }
    Ok(deepest)
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:8} {:>8} {:>10} {:>8} {:>10}", "program", "flash", "variables", "stack", "functions")?;
        for Program { program, flash_bytes, static_bytes, stack_bytes_max, functions, .. } in &self.programs {
            let stack = stack_bytes_max.map_or("-".to_owned(), |bytes| bytes.to_string());
            writeln!(f, "{program:8} {flash_bytes:>8} {static_bytes:>10} {stack:>8} {functions:>10}")?;
        }
        for complaint in self.complaints() {
            writeln!(f, "{complaint}")?;
        }
        Ok(())
    }
}
