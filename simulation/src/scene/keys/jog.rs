//! Keys of a drive by hand.

use motor_model::DriveCommand;

use crate::scene::{Kind, Setting};

/// Settings of a jog.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "jog.mode",
        unit: "",
        kind: Kind::Choice { default: "b", of: &["b", "c"] },
        meaning: "mode of the drive: b turns the rotor clockwise, c counter-clockwise",
    },
    Setting {
        key: "jog.level",
        unit: "",
        kind: Kind::Number { default: 0.5, min: 0.0, max: 1.0 },
        meaning: "amplitude of the drive",
    },
    Setting {
        key: "jog.duration_s",
        unit: "s",
        kind: Kind::Number { default: 0.2, min: 1e-5, max: 1.0 },
        meaning: "time for which the drive is on, in whole ticks of 10 us",
    },
    Setting {
        key: "jog.offset_hz",
        unit: "Hz",
        kind: Kind::Number {
            default: 0.0,
            min: -(DriveCommand::FREQUENCY_OFFSET_MAX_HZ as f64),
            max: DriveCommand::FREQUENCY_OFFSET_MAX_HZ as f64,
        },
        meaning: "frequency of the drive less that of its mode",
    },
];
