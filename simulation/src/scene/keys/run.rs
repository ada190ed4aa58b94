//! Keys of a move or a rate on a real board.

use crate::scene::{Kind, Setting};

/// Settings of a run on a real board.
pub const SETTINGS: &[Setting] = &[Setting {
    key: "run.zero_deg",
    unit: "deg",
    kind: Kind::Number { default: 0.0, min: -360_000.0, max: 360_000.0 },
    meaning: "angle of the camera from which the board counts: targets, limits and all angles that it tells",
}];
