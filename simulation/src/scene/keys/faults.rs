//! Keys of faults: all by words, and those of drive and motor, one of each kind, by keys of their own.

use crate::scene::{Kind, Setting};

/// Settings of the faults.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "faults",
        unit: "",
        kind: Kind::Faults,
        meaning: "faults of instruments, drive and motor by words, as many as wanted; `host-sim keys --faults` lists \
                  the words",
    },
    Setting {
        key: "fault.from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the drive is faulty, and at which the rotor is jolted",
    },
    Setting {
        key: "fault.drive_gain",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 0.0, max: 1.0 },
        meaning: "amplitude that reaches the coil, per amplitude that the amplifier reports",
    },
    Setting {
        key: "fault.dead_mode",
        unit: "",
        kind: Kind::Choice { default: "none", of: &["none", "b", "c"] },
        meaning: "mode of which nothing reaches the coil",
    },
    Setting {
        key: "fault.drift_percent",
        unit: "%",
        kind: Kind::Number { default: 0.0, min: -5.0, max: 5.0 },
        meaning: "change of the resonances of modes B and C at the end of their drift; the drive keeps its frequencies",
    },
    Setting {
        key: "fault.drift_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time that the drift takes, in proportion to time; 0 for a step",
    },
    Setting {
        key: "fault.modes",
        unit: "",
        kind: Kind::Choice { default: "right", of: &["right", "swapped"] },
        meaning: "right, or swapped: the coil is driven in the other mode than the amplifier reports",
    },
    Setting {
        key: "fault.jolt_rad_s",
        unit: "rad/s",
        kind: Kind::Number { default: 0.0, min: -100.0, max: 100.0 },
        meaning: "change of the rotor's rate by a jolt",
    },
    Setting {
        key: "fault.rotor",
        unit: "",
        kind: Kind::Choice { default: "free", of: &["free", "stuck"] },
        meaning: "free, or stuck: the rotor does not turn",
    },
    Setting {
        key: "fault.hub_friction",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 2.0 },
        meaning: "friction of a hub that begins to rub, of a rotor that shifts on its pin; 0 for its own",
    },
];
