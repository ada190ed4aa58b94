//! Keys of one run of the nominal motor in open loop.
//!
//! Every other command draws its motors and has the keys of [`super::plant`] instead.

use motor_model::DriveCommand;

use crate::scene::{Kind, Setting};

/// Settings of a run.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "simulate.model",
        unit: "",
        kind: Kind::Choice { default: "motor", of: &["motor", "stator", "averaged"] },
        meaning: "what is simulated: the motor, its stator without a rotor, or its mean rate and random deviations; \
                  the latter two refuse the keys that they do not use",
    },
    Setting {
        key: "simulate.drive",
        unit: "",
        kind: Kind::Choice { default: "c", of: &["b", "c", "off"] },
        meaning: "mode that the coil drives: b turns the rotor clockwise, c counter-clockwise",
    },
    Setting {
        key: "simulate.amplitude",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 0.0, max: DriveCommand::AMPLITUDE_MAX as f64 },
        meaning: "drive amplitude, 1 being that of Table 1",
    },
    Setting {
        key: "simulate.duration_s",
        unit: "s",
        kind: Kind::Number { default: 2.0, min: 1e-4, max: 1e5 },
        meaning: "simulated time",
    },
    Setting {
        key: "simulate.settle_s",
        unit: "s",
        kind: Kind::Number { default: 0.5, min: 0.0, max: 1e5 },
        meaning: "time left out of the statistics at the start",
    },
    Setting {
        key: "simulate.step_s",
        unit: "s",
        kind: Kind::Number { default: 1e-6, min: 1e-9, max: 1e-3 },
        meaning: "length of a step; commands that draw the motor have plant.step_s",
    },
    Setting {
        key: "simulate.friction",
        unit: "",
        kind: Kind::Choice { default: "coulomb", of: &["paper", "coulomb"] },
        meaning: "law of friction: paper limits it by the angle of contact as well; commands that draw the motor have \
                  plant.friction",
    },
    Setting {
        key: "simulate.impacts",
        unit: "",
        kind: Kind::Choice { default: "located", of: &["end_of_step", "located"] },
        meaning: "when an impact is applied: where it happens, or at the end of its step, as in the paper's program; \
                  commands that draw the motor have plant.impacts",
    },
    Setting {
        key: "simulate.precision",
        unit: "",
        kind: Kind::Choice { default: "f64", of: &["f32", "f64"] },
        meaning: "arithmetic of the motor: f32 is the microcontroller's",
    },
];
