//! Keys of the plant: the motor of every command that draws one.
//!
//! The registry adds a key `plant.motor.` for each parameter of the motor: the true motor's, where it is not drawn
//! around the design. The command `simulate` draws no motor: it runs the design with the keys of [`super::simulate`]
//! and reads `plant.rotor` alone of these.

use crate::scene::{Kind, RotorModel, Setting};

/// The plant's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "plant.rotor",
        unit: "",
        kind: Kind::Choice { default: "height_only", of: RotorModel::WORDS },
        meaning: "how the rotor moves: up and down as in the paper's model, or tilting and shifting on its pin over \
                  four teeth, or tilting alone",
    },
    Setting {
        key: "plant.step_s",
        unit: "s",
        kind: Kind::Number { default: 1e-6, min: 1e-8, max: 1e-5 },
        meaning: "step of the plant; must divide the loop's 10 us; simulate has simulate.step_s",
    },
    Setting {
        key: "plant.parameters",
        unit: "",
        kind: Kind::Choice { default: "drawn", of: &["drawn", "around_plant", "nominal"] },
        meaning: "drawn around the design (motor.*) by the seed, plant.motor.* kept; drawn around the design with \
                  plant.motor.* in it; or the design as in simulate, plant.motor.* kept",
    },
    Setting {
        key: "plant.repetition",
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: 1_000_000 },
        meaning: "which run of the motor and the instruments that the seed names: noise, losses and delays are \
                  drawn by the seed and this",
    },
    #[cfg(feature = "members")]
    Setting {
        key: "plant.stator",
        unit: "",
        kind: Kind::Choice { default: "design", of: &["design", "finite_elements"] },
        meaning: "the true motor's stator: the design's as plant.parameters says; or, whole, one of the stators of \
                  finite elements that are kept with the program, by the seed (host-sim stator --ensemble)",
    },
    Setting {
        key: "plant.impacts",
        unit: "",
        kind: Kind::Choice { default: "located", of: &["end_of_step", "located"] },
        meaning: "when an impact is applied; only with located impacts does a rotor come to full rest",
    },
    Setting {
        key: "plant.friction",
        unit: "",
        kind: Kind::Choice { default: "coulomb", of: &["coulomb", "paper"] },
        meaning: "law of friction: paper limits it by the angle of contact as well; simulate has simulate.friction",
    },
];
