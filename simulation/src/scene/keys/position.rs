//! Keys of a move.

use controller::Target;

use crate::scene::{Kind, Setting};

/// Settings of a move.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "position.to_deg",
        unit: "deg",
        kind: Kind::Number { default: 90.0, min: -360_000.0, max: 360_000.0 },
        meaning: "target angle from where the rotor starts, clockwise positive",
    },
    Setting {
        key: "position.tolerance_deg",
        unit: "deg",
        kind: Kind::Number { default: 0.001, min: Target::TOLERANCE_MIN_DEG, max: 10.0 },
        meaning: "distance from the target that counts as reached, with 95 % confidence",
    },
    Setting {
        key: "position.deadline_s",
        unit: "s",
        kind: Kind::Number { default: 30.0, min: 1e-3, max: 1e5 },
        meaning: "time after which positioning gives up",
    },
    Setting {
        key: "position.hold_s",
        unit: "s",
        kind: Kind::Number { default: 0.1, min: 0.0, max: 1e4 },
        meaning: "time to go on watching once the target is reached",
    },
];
