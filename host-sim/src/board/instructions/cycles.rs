//! Cycles of the hot operations: an estimate, since no emulator has a pipeline.
//!
//! 1. The emulator prints the address of every instruction that the program `hot_operations` executes.
//! 2. Of each operation the call of median length is taken.
//! 3. It is written down as assembly without jumps, in the order of execution.
//! 4. `llvm-mca`, which knows latencies and units of the processor, analyses that.
//! 5. [`Board::cycles_per_jump`] is added for every jump that was taken; `llvm-mca` does not know it.
//!
//! Wait states of the flash, caches and interrupts are left out. Where `llvm-mca` has no model of an instruction (a
//! comparison of floats on the Cortex-M7), it counts as one that does nothing.

use std::collections::HashMap;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde::Serialize;

use super::program;
use crate::board::BoardError;
use crate::board::elf_image::ElfImage;
use crate::board::qemu::{self, Board, Trace};
use crate::report::key_figure::KeyFigure;
use crate::report::table::Table;
use crate::tool::{ToolError, run_within};
use simulation::math::count::real;

/// Ends of the names of functions, and the operations that they are.
const OPERATIONS: [(&str, &str); 4] = [
    ("instructions::twin_step::step", "located_step_aloft"),
    ("instructions::filter_core::step_two_states", "core_2_predict_and_update"),
    ("instructions::constant_rate::update", "camera_frame_used"),
    ("instructions::loop_tick::tick_once", "loop_tick_impact_aided"),
];

/// Calls of the last operation that are followed: 20 ms of motion.
const TICKS: usize = 2000;

/// Of Debian's package `llvm`.
const DISASSEMBLER: &str = "llvm-objdump";
/// Of the same package.
const ANALYSER: &str = "llvm-mca";

/// Time for one analysis, which takes some seconds.
const ANALYSIS_LIMIT: Duration = Duration::from_secs(120);

/// The cycles of an operation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CycleEstimate {
    /// `m4` or `m7`.
    pub board: &'static str,
    /// Name of the operation.
    pub operation: &'static str,
    /// Instructions of the call of median length.
    pub instructions: usize,
    /// Cycles, estimated.
    pub cycles_estimate: usize,
}

impl CycleEstimate {
    /// The figures that another build's are compared with.
    pub fn key_figures(&self) -> [KeyFigure; 2] {
        [("instructions of the median call", self.instructions), ("cycles, estimated", self.cycles_estimate)]
            .map(|(name, count)| {
                KeyFigure::single(name, "", real(count)).of(self.operation).lower_is_better()
            })
    }
}

impl Board {
    /// LLVM's name of the processor.
    fn cpu(self) -> &'static str {
        self.of("cortex-m4", "cortex-m7")
    }

    /// Cycles of a jump beside its own: to fill the pipeline anew, or none where the jump is predicted.
    fn cycles_per_jump(self) -> usize {
        self.of(2, 0)
    }

    /// Whether LLVM knows how long an instruction takes.
    fn is_modelled(self, mnemonic: &str) -> bool {
        self == Self::M4 || !["vcmp", "vmrs", "umull"].iter().any(|unknown| mnemonic.starts_with(unknown))
    }
}

/// The estimates of all operations on `board`.
///
/// # Errors
/// When a tool is missing or fails.
pub fn estimate(board: Board) -> Result<Vec<CycleEstimate>, BoardError> {
    qemu::check()?;
    let elf = program::build("hot_operations")?;
    let image = ElfImage::read(&elf)?;
    let code = disassembled(&elf, board)?;
    let entries = OPERATIONS.map(|(name, _)| {
        image.functions.iter().find(|function| function.name.ends_with(name)).map(|function| function.address)
    });
    let mut estimates = Vec::new();
    for ((_, operation), mut calls) in OPERATIONS.iter().zip(followed(&elf, board, entries)?) {
        calls.sort_by_key(Vec::len);
        let Some(call) = calls.get(calls.len() / 2) else { continue };
        let cycles_estimate = analysed(call, &code, board)? + jumps(call, &code) * board.cycles_per_jump();
        estimates.push(CycleEstimate {
            board: board.key(),
            operation,
            instructions: call.len(),
            cycles_estimate,
        });
    }
    Ok(estimates)
}

/// The instructions of every call of the functions that begin at `entries`, up to the return.
fn followed(elf: &Path, board: Board, entries: [Option<u32>; 4]) -> Result<[Vec<Vec<u32>>; 4], BoardError> {
    let mut calls: [Vec<Vec<u32>>; 4] = Default::default();
    // The operation that runs, where it returns to, and what it has executed.
    let mut running: Option<(usize, u32, Vec<u32>)> = None;
    let mut before = 0;
    for at in Trace::start(elf, board)? {
        let at = at?;
        if let Some((operation, back, executed)) = &mut running {
            if at == *back {
                calls[*operation].push(std::mem::take(executed));
                running = None;
            } else {
                executed.push(at);
            }
        } else if let Some(operation) = entries.iter().position(|&entry| entry == Some(at)) {
            // The call has four bytes.
            running = Some((operation, before + 4, vec![at]));
        }
        before = at;
        if calls[3].len() >= TICKS {
            break;
        }
    }
    Ok(calls)
}

/// The text of every instruction by its address.
fn disassembled(elf: &Path, board: Board) -> Result<HashMap<u32, String>, BoardError> {
    let tool = DISASSEMBLER;
    let output = Command::new(tool)
        .args(["-d", "--no-show-raw-insn", &format!("--mcpu={}", board.cpu())])
        .arg(elf)
        .output()
        .map_err(|source| ToolError::NoTool { tool, source })?;
    let printed = String::from_utf8_lossy(&output.stdout);
    let instruction = |line: &str| {
        let (at, text) = line.split_once(':')?;
        let text = text.split(['@', '<']).next()?.trim();
        Some((u32::from_str_radix(at.trim(), 16).ok()?, text.to_owned()))
    };
    Ok(printed.lines().filter_map(instruction).collect())
}

/// How often the next instruction of a call was not the one behind.
fn jumps(call: &[u32], code: &HashMap<u32, String>) -> usize {
    let next = |at: u32| if code.contains_key(&(at + 2)) { at + 2 } else { at + 4 };
    call.windows(2).filter(|pair| pair[1] != next(pair[0])).count()
}

/// Cycles of a call, without those of its jumps.
fn analysed(call: &[u32], code: &HashMap<u32, String>, board: Board) -> Result<usize, BoardError> {
    let tool = ANALYSER;
    let not_run = |source| ToolError::NoTool { tool, source };
    let mut assembly = tempfile::NamedTempFile::new().map_err(not_run)?;
    assembly.write_all(straight_line(call, code, board).as_bytes()).map_err(not_run)?;
    let mut command = Command::new(tool);
    command
        .args(["-mtriple=thumbv7em-none-eabihf", &format!("-mcpu={}", board.cpu()), "-iterations=1"])
        .args(["-instruction-info=0", "-resource-pressure=0"])
        .arg(assembly.path());
    let printed = run_within(&mut command, tool, ANALYSIS_LIMIT)?;
    let cycles = printed.lines().find_map(|line| line.strip_prefix("Total Cycles:")?.trim().parse().ok());
    cycles.ok_or_else(|| ToolError::ToolFailed { tool, complaint: "it printed no cycles".to_owned() }.into())
}

/// A call as assembly: its instructions in the order of execution, each jump to a label before all of them.
fn straight_line(call: &[u32], code: &HashMap<u32, String>, board: Board) -> String {
    let mut text = String::from(".syntax unified\n.thumb\n1:\n");
    for instruction in call.iter().filter_map(|at| code.get(at)) {
        let mnemonic = instruction.split_whitespace().next().unwrap_or_default();
        let written = match instruction.rsplit_once(char::is_whitespace) {
            // Tables of jumps hold addresses of their own.
            _ if mnemonic.starts_with("tb") || !board.is_modelled(mnemonic) => "nop".to_owned(),
            // The analyser does not follow the condition of an `it`.
            _ if mnemonic.starts_with("it") => "nop".to_owned(),
            Some((head, target)) if target.starts_with("0x") => format!("{head} 1b"),
            _ => instruction.clone(),
        };
        text.push_str(&written);
        text.push('\n');
    }
    text
}

/// For the terminal.
pub fn table(board: Board, estimates: &[CycleEstimate]) -> String {
    let mut table = Table::new(&["operation", "instructions", "cycles"]);
    for CycleEstimate { operation, instructions, cycles_estimate, .. } in estimates {
        table.push(vec![(*operation).to_owned(), instructions.to_string(), cycles_estimate.to_string()]);
    }
    let processor = board.processor();
    format!("{processor}, cycles estimated by {ANALYSER}: no wait states, no caches\n\n{}", table.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two instructions in line, a jump back, and what follows it.
    #[test]
    fn exact_straight_line_and_jumps() {
        let code = [(2, "vadd.f32\ts0, s1, s2"), (6, "bne\t0x2"), (8, "vcmp.f32\ts0, #0"), (12, "bx\tlr")];
        let code: HashMap<u32, String> = code.map(|(at, text)| (at, text.to_owned())).into();
        let call = [2, 6, 2, 6, 8, 12];
        assert_eq!(jumps(&call, &code), 1);
        let line = straight_line(&call, &code, Board::M7);
        let expected = "vadd.f32\ts0, s1, s2\nbne 1b\nvadd.f32\ts0, s1, s2\nbne 1b\nnop\nbx\tlr\n";
        assert_eq!(line, format!(".syntax unified\n.thumb\n1:\n{expected}"));
    }
}
