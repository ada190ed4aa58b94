//! What the firmware takes of the microcontroller, and the calls that its loop must not make.
//!
//! | item | what it is |
//! |---|---|
//! | [`ProgramSize`] | bytes of flash and RAM of a program, section by section |
//! | [`StackDepth`] | the deepest stack of a move in the emulator |
//! | [`ForbiddenCall`] | a call that the tasks can reach and must not make |
//! | [`MaskedSection`] | a section in which the tasks mask interrupts, which the tests count |
//! | [`SizeReport`] | all of it for every program, beside the limits |
//!
//! The limits are those of the part that `firmware/memory` declares: 504 KiB of flash, beside which a description of
//! the bench is kept, and 128 KiB of RAM. In a program with all three filters, the twin's takes 45 kB of variables,
//! most of them for the kicks of a slow camera, and half of the stack. A program with one of the others fits a smaller
//! part.

mod masked_sections;
mod reachable_calls;
mod stack_depth;

use std::fmt;

use serde::Serialize;

use crate::board::BoardError;
use crate::board::elf_image::ElfImage;
use crate::board::instructions::program::build_with;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
pub use masked_sections::{MaskedSection, masked_sections};
pub use reachable_calls::ForbiddenCall;
use simulation::runs::filter::FILTERS;
pub use stack_depth::StackDepth;

/// Flash for the program in the part on the board, an STM32G474RE, and in the emulated one: what the kept description
/// leaves.
const FLASH_BYTES: u64 = 504 * 1024;

/// RAM of the part, for variables and stack.
const RAM_BYTES: u64 = 128 * 1024;

/// Flash, and RAM for variables and stack, of a small part.
const SMALL_BYTES: [u64; 2] = [256 * 1024, 32 * 1024];

/// The programs, each with the only filter that it is built with, `None` for all: the one for the board, the one in
/// lock step with the simulated motor, and the first with one filter alone.
const PROGRAMS: [(&str, Option<&str>); 4] =
    [("board", None), ("pil", None), ("board", Some("constant_rate")), ("board", Some("impact_aided"))];

/// Bytes that a program takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProgramSize {
    /// Its name in `firmware/src/bin`.
    pub program: &'static str,
    /// The only filter that it was built with; `null` when it has all.
    pub only: Option<&'static str>,
    /// Code, constants and initial values of variables.
    pub flash_bytes: u64,
    /// Variables.
    pub static_bytes: u64,
    /// The stack in a move by each filter.
    pub stacks: Vec<StackDepth>,
    /// Functions that its tasks can reach.
    pub functions: usize,
    /// Forbidden calls that its tasks can reach.
    pub forbidden: Vec<ForbiddenCall>,
}

impl ProgramSize {
    /// The deepest stack of all.
    pub fn deepest(&self) -> Option<StackDepth> {
        self.stacks.iter().copied().max_by_key(|stack| stack.bytes)
    }

    /// Variables and stack.
    pub fn ram_bytes(&self) -> u64 {
        self.static_bytes + self.deepest().map_or(0, |stack| stack.bytes.into())
    }

    /// Its name, and that of its only filter.
    fn name(&self) -> String {
        self.only.map_or_else(|| self.program.to_owned(), |only| format!("{}, {only} alone", self.program))
    }

    /// Whether it fits a small part.
    pub fn is_small(&self) -> bool {
        self.flash_bytes <= SMALL_BYTES[0] && self.ram_bytes() <= SMALL_BYTES[1]
    }

    /// The limits that it exceeds, and its forbidden calls.
    pub fn complaints(&self) -> Vec<String> {
        let (program, flash_bytes) = (self.name(), &self.flash_bytes);
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

/// The sizes of all programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SizeReport {
    /// In the order of [`PROGRAMS`].
    pub programs: Vec<ProgramSize>,
}

impl SizeReport {
    /// Builds, measures and runs every program.
    ///
    /// # Errors
    /// When a program cannot be built, read or run.
    pub fn measure() -> Result<Self, BoardError> {
        let measured = PROGRAMS.map(|(program, only)| {
            let elf = build_with(program, only)?;
            let image = ElfImage::read(&elf)?;
            let reached = reachable_calls::reached(&image)?;
            Ok(ProgramSize {
                program,
                only,
                flash_bytes: image.flash_bytes,
                static_bytes: image.static_bytes,
                stacks: stack_depth::of_each_filter(program, only, &elf)?,
                functions: reached.functions,
                forbidden: reached.forbidden,
            })
        });
        Ok(Self { programs: measured.into_iter().collect::<Result<_, BoardError>>()? })
    }

    /// The complaints about all programs.
    pub fn complaints(&self) -> Vec<String> {
        self.programs.iter().flat_map(ProgramSize::complaints).collect()
    }

    /// The report as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }

    /// Which of them fit a small part.
    fn small(&self) -> String {
        let [flash, ram] = SMALL_BYTES;
        let small: Vec<String> =
            self.programs.iter().filter(|p| p.is_small()).map(ProgramSize::name).collect();
        let which = if small.is_empty() { "none".to_owned() } else { small.join("; ") };
        format!("A part of {flash} and {ram} would do for: {which}.")
    }

    /// Bytes of each program, with the stack of a move by each of its filters.
    fn table(&self) -> Table {
        let stacks: Vec<String> = FILTERS.iter().map(|filter| format!("stack, {filter}")).collect();
        let mut header = vec!["program", "flash", "variables"];
        header.extend(stacks.iter().map(String::as_str));
        let mut table = Table::new(&header);
        for program in &self.programs {
            let stack = |filter: &&str| {
                let of_filter = program.stacks.iter().find(|stack| stack.filter == *filter);
                of_filter.map_or("-".to_owned(), |stack| stack.bytes.to_string())
            };
            let mut row = vec![program.name()];
            row.extend([program.flash_bytes, program.static_bytes].map(|bytes| bytes.to_string()));
            row.extend(FILTERS.iter().map(stack));
            table.push(row);
        }
        table
    }

    /// The values of the page on the microcontroller that sizes give.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let judged = if self.complaints().is_empty() { "All hold." } else { "Not all hold." };
        let excused: Vec<String> =
            reachable_calls::EXCUSED.iter().map(|(callee, reason)| format!("`{callee}`: {reason}")).collect();
        vec![
            ("table_sizes", self.table().markdown()),
            ("part_flash_bytes", FLASH_BYTES.to_string()),
            ("part_ram_bytes", RAM_BYTES.to_string()),
            ("small_part", self.small()),
            ("rules_hold", judged.to_owned()),
            ("excused_calls", excused.join("; ")),
        ]
    }
}

impl fmt::Display for SizeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.table().text())?;
        for program in &self.programs {
            writeln!(f, "{}: its tasks can reach {} functions", program.name(), program.functions)?;
        }
        writeln!(f, "{}", self.small())?;
        for complaint in self.complaints() {
            writeln!(f, "{complaint}")?;
        }
        Ok(())
    }
}
