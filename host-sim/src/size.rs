//! `host-sim size`: what the firmware takes of the microcontroller, and what its loop must not call.
//!
//! - [`Image`]: bytes of flash and RAM of an ELF, section by section.
//! - [`calls`]: every function that can be reached from the two tasks, by their branches.
//! - [`Report`]: both beside the limits, with the deepest stack of moves in the emulator.
//!
//! Held to the part that `firmware/memory` declares, 256 KiB of flash and 64 KiB of RAM. All three filters are in each program; the twin's alone takes 15 kB of
//! variables, and three quarters of the stack.

pub mod calls;
mod image;

use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::error::CommandError;
use crate::filter::FILTERS;
use crate::instructions::Board;
use crate::pil::{self, Emulated};
use crate::scene::Scene;
use crate::section::Section;
pub use calls::Forbidden;
pub use image::Image;

/// Where the README has this section.
pub const SECTION: Section = Section { begin: "<!-- size:begin -->", end: "<!-- size:end -->" };

/// Flash of the part.
pub const FLASH_BYTES: u64 = 256 * 1024;

/// RAM of the part, for variables and stack.
pub const RAM_BYTES: u64 = 64 * 1024;

/// The programs that fly: on the emulated board, and in lock step with the simulated motor.
pub const PROGRAMS: [&str; 2] = ["board", "pil"];

/// How deep the stack went in a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Stack {
    /// The filter that it went by, one of [`crate::filter::FILTERS`].
    pub filter: &'static str,
    /// Most that it took.
    pub bytes: u32,
}

/// What a program takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Program {
    /// Its name in `firmware/src/bin`.
    pub program: &'static str,
    /// Code, constants, and what variables begin with.
    pub flash_bytes: u64,
    /// Variables.
    pub static_bytes: u64,
    /// The stack in a move by each filter; empty where it was not run.
    pub stacks: Vec<Stack>,
    /// Functions that its tasks can reach.
    pub functions: usize,
    /// Calls from its tasks that must not be.
    pub forbidden: Vec<Forbidden>,
}

impl Program {
    /// The deepest stack of all.
    pub fn deepest(&self) -> Option<Stack> {
        self.stacks.iter().copied().max_by_key(|stack| stack.bytes)
    }

    /// Variables and stack.
    pub fn ram_bytes(&self) -> u64 {
        self.static_bytes + self.deepest().map_or(0, |stack| stack.bytes.into())
    }

    /// What is wrong with it.
    pub fn complaints(&self) -> Vec<String> {
        let Self { program, flash_bytes, .. } = self;
        let mut complaints: Vec<String> =
            self.forbidden.iter().map(|forbidden| format!("{program}: {forbidden}")).collect();
        if *flash_bytes > FLASH_BYTES {
            complaints.push(format!("{program}: {flash_bytes} bytes of flash, the part has {FLASH_BYTES}"));
        }
        if self.ram_bytes() > RAM_BYTES {
            complaints
                .push(format!("{program}: {} bytes of RAM, the part has {RAM_BYTES}", self.ram_bytes()));
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
                stacks: if program == "pil" { stacks(elf.as_ref())? } else { Vec::new() },
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
            let of = |filter: &str| program.stacks.iter().find(|stack| stack.filter == filter);
            let stack =
                |filter: &&'static str| of(filter).map_or("-".to_owned(), |stack| stack.bytes.to_string());
            let stacks: Vec<String> = FILTERS.iter().map(stack).collect();
            let Program { program, flash_bytes, static_bytes, .. } = program;
            format!("| {program} | {flash_bytes} | {static_bytes} | {} |", stacks.join(" | "))
        };
        let rows: Vec<String> = self.programs.iter().map(row).collect();
        let judged = if self.complaints().is_empty() { "All hold." } else { "Not all hold." };
        let excused: Vec<String> =
            calls::EXCUSED.iter().map(|(callee, reason)| format!("`{callee}`: {reason}")).collect();
        format!(
            "| program | flash | variables | stack, {} |\n| --- | --- | --- |{}\n{}\n\n\
             Bytes; all filters are in each program, and the stack is the deepest of a move by one. The part has {FLASH_BYTES} of flash, and {RAM_BYTES} of RAM \
             for variables and the deepest stack of all; nothing that the tasks can reach may panic, allocate, compute in double precision, or be called by \
             address. {judged} Excused: {}.\n",
            FILTERS.join(" | stack, "),
            " --- |".repeat(FILTERS.len()),
            rows.join("\n"),
            excused.join("; ")
        )
    }
}

/// How deep the stack goes in a short move by each filter, with frames that are overtaken.
fn stacks(elf: &Path) -> Result<Vec<Stack>, CommandError> {
    let of = |&filter| {
        let mut scene = Scene::default();
        scene.set("estimator.filter", filter)?;
        scene.set("position.deadline_s", "0.2")?;
        scene.set("camera.late_probability", "0.2")?;
        let mut processor = Emulated::start(elf, Board::M4)?;
        pil::run(&scene, &mut processor)?;
        let bytes = processor.counters()?.stack_bytes_max;
        processor.finish()?;
        Ok(Stack { filter, bytes })
    };
    FILTERS.iter().map(of).collect()
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:8} {:>8} {:>10} {:>8} {:>10}", "program", "flash", "variables", "stack", "functions")?;
        for program in &self.programs {
            let stack = program.deepest().map_or("-".to_owned(), |stack| stack.bytes.to_string());
            let Program { program, flash_bytes, static_bytes, stacks, functions, .. } = program;
            writeln!(f, "{program:8} {flash_bytes:>8} {static_bytes:>10} {stack:>8} {functions:>10}")?;
            for Stack { filter, bytes } in stacks {
                writeln!(f, "  stack in a move by {filter}: {bytes}")?;
            }
        }
        for complaint in self.complaints() {
            writeln!(f, "{complaint}")?;
        }
        Ok(())
    }
}
