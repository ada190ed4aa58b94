//! `host-sim size`: what the firmware takes of the microcontroller, and what its loop must not call.
//!
//! - [`Image`]: bytes of flash and RAM of an ELF, section by section.
//! - [`calls`]: every function that can be reached from the two tasks, by their branches.
//! - [`Report`]: both beside the limits, with the deepest stack of moves in the emulator.
//!
//! Held to the part that `firmware/memory` declares, 256 KiB of flash and 64 KiB of RAM. With all three filters, the twin's alone takes 15 kB of
//! variables and three quarters of the stack; a program built with one of the others has room in a smaller part.

pub mod calls;
mod image;

use std::fmt;
use std::path::Path;

use controller::PositionLoop;
use link::{BoardMessage, CameraRecord, HostMessage, LdvRecord};
use serde::Serialize;

use crate::board::BoardError;
use crate::board::instructions::Board;
use crate::board::pil::{self, Emulated, Live, Wiring};
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::runs::filter::FILTERS;
use crate::scene::Scene;
pub use calls::Forbidden;
pub use image::Image;

/// Flash of the part.
pub const FLASH_BYTES: u64 = 256 * 1024;

/// RAM of the part, for variables and stack.
pub const RAM_BYTES: u64 = 64 * 1024;

/// What a small part has: flash, and RAM for variables and stack.
pub const SMALL_BYTES: [u64; 2] = [96 * 1024, 16 * 1024];

/// The programs that fly, on the emulated board and in lock step with the simulated motor; and the first with one filter alone.
pub const PROGRAMS: [(&str, Option<&str>); 4] =
    [("board", None), ("pil", None), ("board", Some("constant_rate")), ("board", Some("impact_aided"))];

/// How deep the stack went in a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Stack {
    /// The filter that it went by, one of [`crate::runs::filter::FILTERS`].
    pub filter: &'static str,
    /// Most that it took.
    pub bytes: u32,
}

/// What a program takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Program {
    /// Its name in `firmware/src/bin`.
    pub program: &'static str,
    /// The only filter that it was built with; `null` when it has all.
    pub only: Option<&'static str>,
    /// Code, constants, and what variables begin with.
    pub flash_bytes: u64,
    /// Variables.
    pub static_bytes: u64,
    /// The stack in a move by each filter.
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

    /// Its name, and that of its only filter.
    fn name(&self) -> String {
        self.only.map_or_else(|| self.program.to_owned(), |only| format!("{}, {only} alone", self.program))
    }

    /// Whether a small part would do.
    pub fn is_small(&self) -> bool {
        self.flash_bytes <= SMALL_BYTES[0] && self.ram_bytes() <= SMALL_BYTES[1]
    }

    /// What is wrong with it.
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

/// All programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// In the order of [`PROGRAMS`].
    pub programs: Vec<Program>,
}

impl Report {
    /// Measures the ELF that `elf_of` gives for a program, and runs it.
    ///
    /// # Errors
    /// When an ELF cannot be had, read or run.
    pub fn measure<P: AsRef<Path>>(
        mut elf_of: impl FnMut(&str, Option<&str>) -> Result<P, BoardError>,
    ) -> Result<Self, BoardError> {
        let measured = PROGRAMS.map(|(program, only)| {
            let elf = elf_of(program, only)?;
            let image = Image::read(elf.as_ref())?;
            let reached = calls::reached(&image)?;
            Ok(Program {
                program,
                only,
                flash_bytes: image.flash_bytes(),
                static_bytes: image.static_bytes(),
                stacks: stacks(program, only, elf.as_ref())?,
                functions: reached.functions,
                forbidden: reached.forbidden,
            })
        });
        Ok(Self { programs: measured.into_iter().collect::<Result<_, BoardError>>()? })
    }

    /// Whatever is wrong with any of them.
    pub fn complaints(&self) -> Vec<String> {
        self.programs.iter().flat_map(Program::complaints).collect()
    }

    /// The report as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }

    /// Which of them a small part would do for.
    fn small(&self) -> String {
        let [flash, ram] = SMALL_BYTES;
        let small: Vec<String> = self.programs.iter().filter(|p| p.is_small()).map(Program::name).collect();
        let which = if small.is_empty() { "none".to_owned() } else { small.join("; ") };
        format!("A part of {flash} and {ram} would do for: {which}.")
    }

    /// Bytes of each program, with the stack in a move by each filter that it has.
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
            calls::EXCUSED.iter().map(|(callee, reason)| format!("`{callee}`: {reason}")).collect();
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

/// How deep the stack goes in a short move by each filter.
fn stacks(program: &str, only: Option<&str>, elf: &Path) -> Result<Vec<Stack>, BoardError> {
    let of = |&filter| {
        let mut scene = Scene::default();
        scene.set("estimator.filter", filter)?;
        scene.set("position.deadline_s", "0.2")?;
        scene.set("camera.late_probability", "0.2")?;
        let bytes = if program == "board" { live_stack(elf, &scene)? } else { lock_step_stack(elf, &scene)? };
        Ok(Stack { filter, bytes })
    };
    FILTERS.iter().filter(|&&filter| only.is_none_or(|only| only == filter)).map(of).collect()
}

/// In lock step, with frames that are overtaken.
fn lock_step_stack(elf: &Path, scene: &Scene) -> Result<u32, BoardError> {
    let mut processor = Emulated::start(elf, Board::M4, Wiring::default())?;
    pil::run(scene, &mut processor)?;
    let bytes = processor.counters()?.stack_bytes_max;
    processor.finish()?;
    Ok(bytes)
}

/// Reports that a board sends in a move: one a millisecond.
const REPORTS: u32 = 200;

/// On the board's own timer, whose interrupt takes the same stack: a rotor at rest is shown to it, now and then with a frame that is overtaken.
fn live_stack(elf: &Path, scene: &Scene) -> Result<u32, BoardError> {
    let mut board = Live::start(elf, None)?;
    for message in [HostMessage::Hello, HostMessage::Configure(pil::configuration(scene)), HostMessage::Arm] {
        board.say(&message)?;
        board.hear_answer()?;
    }
    let mut reports = 0;
    while reports < REPORTS {
        match board.hear()? {
            (header, BoardMessage::Report(_)) => {
                reports += 1;
                let now_nanos = header.ticks * PositionLoop::TICK_NANOS;
                let velocity_m_s = if reports % 2 == 0 { 1e-5 } else { -1e-5 };
                let ldv = LdvRecord { taken_nanos: now_nanos, velocity_m_s };
                board.say(&HostMessage::Ldv([ldv].into_iter().collect()))?;
                let ages_nanos: &[u64] = if reports % 5 == 0 { &[0, 500_000] } else { &[0] };
                for age_nanos in ages_nanos {
                    let exposed_nanos = now_nanos.saturating_sub(*age_nanos);
                    board.say(&HostMessage::Camera(CameraRecord { exposed_nanos, angle_units: 0 }))?;
                }
            }
            // This machine was too slow for the board: on with it.
            (_, BoardMessage::Fault(_)) => {
                board.say(&HostMessage::Stop)?;
                board.say(&HostMessage::Arm)?;
            }
            _ => (),
        }
    }
    board.say(&HostMessage::Stop)?;
    while board.hear_answer()? != BoardMessage::Stopped {}
    Ok(board.counters()?.stack_bytes_max)
}

impl fmt::Display for Report {
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
