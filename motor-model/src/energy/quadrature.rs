//! Gauss-Legendre sums over the exact motion of the modes: the nodes, and the pieces into which a step is cut.

use core::f64::consts::TAU;

use crate::drive::DriveCommand;
use crate::modes::{DriveTuning, Mode};
use crate::motor::MotorSetup;

/// Longest piece of a step in radians of the fastest oscillation.
const PIECE_RAD: f64 = 0.75;
/// Most pieces of a step.
const PIECES_MAX: u8 = 64;

/// Nodes of the Gauss-Legendre rule on 0..1.
pub(super) const NODES: usize = 5;
/// Nodes and weights of order 10 on 0..1: `(1 +- sqrt(5 +- 2 sqrt(10/7)) / 3) / 2`, with `128/450` and
/// `(322 +- 13 sqrt 70) / 1800`.
pub(crate) const GAUSS_LEGENDRE: [(f64, f64); NODES] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// `exp(A t)` of the three modes over one piece of a span.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Rows for `g'` at the nodes, for each mode.
    pub(super) velocity_rows: [[[f64; 2]; 3]; NODES],
    /// Both rows at the end, for each mode.
    pub(super) whole: [[[f64; 2]; 2]; 3],
}

impl Piece {
    pub(super) fn new(modes: &[Mode; 3], span_s: f64) -> Self {
        let propagator = |mode: &Mode, t: f64| {
            let [[gg, gv], [vg, vv]] = mode.propagator_minus_identity(t);
            [[1.0 + gg, gv], [vg, 1.0 + vv]]
        };
        Self {
            velocity_rows: GAUSS_LEGENDRE.map(|(node, _)| {
                modes.each_ref().map(|mode| {
                    let [_, velocity_row] = propagator(mode, span_s * node);
                    velocity_row
                })
            }),
            whole: modes.each_ref().map(|mode| propagator(mode, span_s)),
        }
    }
}

/// How many pieces of a step the quadrature needs for the fastest mode and drive.
pub(super) fn pieces(modes: &[Mode; 3], setup: &MotorSetup) -> u8 {
    let natural_rad_s = modes.iter().fold(0.0, |fastest: f64, mode| fastest.max(mode.natural_rad_s));
    let tuned_rad_s = match setup.tuning {
        DriveTuning::Resonant => natural_rad_s,
        DriveTuning::Fixed { b_hz, c_hz } => natural_rad_s.max(TAU * b_hz.max(c_hz)),
    };
    let fastest_rad_s = tuned_rad_s + TAU * f64::from(DriveCommand::FREQUENCY_OFFSET_MAX_HZ);
    let mut pieces = 1;
    while f64::from(pieces) * PIECE_RAD < fastest_rad_s * setup.step_s && pieces < PIECES_MAX {
        pieces += 1;
    }
    pieces
}
