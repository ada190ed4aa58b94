//! The deepest stack of a move in the emulator.

use std::path::Path;

use controller::PositionLoop;
use link::{BoardMessage, CameraRecord, HostMessage, LdvRecord};
use serde::Serialize;

use crate::board::BoardError;
use crate::board::pil::{self, FreeRunningBoard, LockStepBoard};
use crate::board::qemu::{Board, Wiring};
use simulation::runs::filter::FILTERS;
use simulation::scene::Scene;

/// The deepest stack of a move by one filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StackDepth {
    /// The filter, one of [`FILTERS`].
    pub filter: &'static str,
    /// Bytes of stack at its deepest.
    pub bytes: u32,
}

/// The stack of a short move by each filter that `program` has, or by the filter `only`.
///
/// # Errors
/// When the program cannot be run.
pub(super) fn of_each_filter(
    program: &str,
    only: Option<&str>,
    elf: &Path,
) -> Result<Vec<StackDepth>, BoardError> {
    let of = |&filter| {
        let mut scene = Scene::default();
        scene.set("estimator.filter", filter)?;
        scene.set("position.deadline_s", "0.2")?;
        scene.set("camera.late_probability", "0.2")?;
        let bytes = if program == "board" { free_running(elf, &scene)? } else { in_lock_step(elf, &scene)? };
        Ok(StackDepth { filter, bytes })
    };
    FILTERS.iter().filter(|&&filter| only.is_none_or(|only| only == filter)).map(of).collect()
}

/// In lock step; some camera frames come after later ones.
fn in_lock_step(elf: &Path, scene: &Scene) -> Result<u32, BoardError> {
    let mut processor = LockStepBoard::start(elf, Board::M4, Wiring::default())?;
    pil::run(scene, &mut processor)?;
    let bytes = processor.counters()?.stack_bytes_max;
    processor.finish()?;
    Ok(bytes)
}

/// Reports that a board sends in a move: one a millisecond.
const REPORTS: u32 = 200;

/// On the board's own timer; its interrupt takes the same stack. The measurements are those of a rotor at rest. Every
/// fifth time a camera frame comes after a later one.
fn free_running(elf: &Path, scene: &Scene) -> Result<u32, BoardError> {
    let mut board = FreeRunningBoard::start(elf, None)?;
    let preparation = pil::preparation(scene)?;
    for message in [&HostMessage::Hello].into_iter().chain(&preparation).chain([&HostMessage::Arm]) {
        board.send(message)?;
        board.receive_answer()?;
    }
    let mut reports = 0;
    while reports < REPORTS {
        match board.receive()? {
            (header, BoardMessage::Report(_)) => {
                reports += 1;
                let now_nanos = header.ticks * PositionLoop::TICK_NANOS;
                let velocity_m_s = if reports % 2 == 0 { 1e-5 } else { -1e-5 };
                let ldv = LdvRecord { taken_nanos: now_nanos, velocity_m_s };
                board.send(&HostMessage::Ldv([ldv].into_iter().collect()))?;
                let ages_nanos: &[u64] = if reports % 5 == 0 { &[0, 500_000] } else { &[0] };
                for age_nanos in ages_nanos {
                    let exposed_nanos = now_nanos.saturating_sub(*age_nanos);
                    board.send(&HostMessage::Camera(CameraRecord {
                        exposed_nanos,
                        angle_units: 0,
                        marks_used: 0,
                        residual: 0,
                    }))?;
                }
            }
            // This machine was too slow for the board. The move starts again.
            (_, BoardMessage::Fault(_)) => {
                board.send(&HostMessage::Stop)?;
                board.send(&HostMessage::Arm)?;
            }
            _ => (),
        }
    }
    board.send(&HostMessage::Stop)?;
    while board.receive_answer()? != BoardMessage::Stopped {}
    Ok(board.counters()?.stack_bytes_max)
}
