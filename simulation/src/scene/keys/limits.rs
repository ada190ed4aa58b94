//! Keys of the limits that a motor is driven within.

use crate::scene::{Kind, Setting};

/// Angle in degrees to either side from which there is no limit: more than any task asks for.
pub const FREE_DEG: f64 = 1e9;
/// Time in s from which there is no limit: a day.
pub const ANY_TIME_S: f64 = 86_400.0;

/// Settings of the limits.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "limits.least_deg",
        unit: "deg",
        kind: Kind::Number { default: -FREE_DEG, min: -FREE_DEG, max: -1e-3 },
        meaning: "angle beyond which it is not driven counter-clockwise, from where it starts; at its least: none",
    },
    Setting {
        key: "limits.greatest_deg",
        unit: "deg",
        kind: Kind::Number { default: FREE_DEG, min: 1e-3, max: FREE_DEG },
        meaning: "angle beyond which it is not driven clockwise, from where it starts; at its greatest: none",
    },
    Setting {
        key: "limits.drive_on_s",
        unit: "s",
        kind: Kind::Number { default: 20.0, min: 1e-3, max: ANY_TIME_S },
        meaning: "longest time with the drive on in one drive of a move",
    },
    Setting {
        key: "limits.drive_on_total_s",
        unit: "s",
        kind: Kind::Number { default: ANY_TIME_S, min: 1e-3, max: ANY_TIME_S },
        meaning: "longest time with the drive on of a rate, added up; at its greatest: any",
    },
    Setting {
        key: "limits.amplitude_max",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 0.05, max: 1.0 },
        meaning: "strongest drive",
    },
];
