//! Keys of a recording in open loop.

use crate::scene::{Kind, Setting};

/// Settings of a recording.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "record.model",
        unit: "",
        kind: Kind::Choice { default: "motor", of: &["motor", "stator"] },
        meaning: "what is recorded: the motor, or its stator without a rotor, with the vibrometer on a tooth",
    },
    Setting {
        key: "record.schedule",
        unit: "",
        kind: Kind::Schedule { default: "b:1 for 0.5, off for 0.1, c:1 for 0.5, off for 0.1" },
        meaning: "drives, one after the other: mode, amplitude, frequency or sweep in Hz, time in s; (...) x4 repeats",
    },
];
