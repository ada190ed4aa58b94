//! Keys of a rate.

use crate::scene::{Kind, Setting};

/// Settings of a rate.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "rate.deg_s",
        unit: "deg/s",
        kind: Kind::Number { default: 500.0, min: -1100.0, max: 1100.0 },
        meaning: "rate to hold, clockwise positive; the last step of a staircase, the mean of a sweep",
    },
    Setting {
        key: "rate.profile",
        unit: "",
        kind: Kind::Choice { default: "dwell", of: &["dwell", "staircase", "both_ways", "sweep"] },
        meaning: "one rate; five equal steps up to it; turns at steps of it both ways with rests between; or a sine of \
                  1 to 5 Hz about it, a quarter of it in amplitude",
    },
    Setting {
        key: "rate.duration_s",
        unit: "s",
        kind: Kind::Number { default: 20.0, min: 0.5, max: 1000.0 },
        meaning: "length of the run",
    },
];
