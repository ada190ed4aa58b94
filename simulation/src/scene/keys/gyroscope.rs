//! Keys of the gyroscope.

use crate::scene::{Kind, Setting};

/// The gyroscope's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "gyroscope.parameters",
        unit: "",
        kind: Kind::Choice { default: "drawn", of: &["drawn", "nominal"] },
        meaning: "errors drawn by seed and serial (normal; the keys of scale factor, bias, misalignment, \
                  non-linearity and warming up are the standard deviations), or as they stand",
    },
    Setting {
        key: "gyroscope.scale_factor_ppm",
        unit: "ppm",
        kind: Kind::Number { default: 500.0, min: -100_000.0, max: 100_000.0 },
        meaning: "error of the scale factor",
    },
    Setting {
        key: "gyroscope.bias_deg_h",
        unit: "deg/h",
        kind: Kind::Number { default: 10.0, min: -36_000.0, max: 36_000.0 },
        meaning: "rate shown at rest",
    },
    Setting {
        key: "gyroscope.misalignment_mrad",
        unit: "mrad",
        kind: Kind::Number { default: 2.0, min: -100.0, max: 100.0 },
        meaning: "misalignment with the rotor's own axis, along each of two axes across it: what is shown of a rate \
                  about them",
    },
    Setting {
        key: "gyroscope.nonlinearity_ppm",
        unit: "ppm",
        kind: Kind::Number { default: 25.0, min: -10_000.0, max: 10_000.0 },
        meaning: "error at the end of the range, of the range; it grows with the cube of the rate",
    },
    Setting {
        key: "gyroscope.warm_up_ppm",
        unit: "ppm",
        kind: Kind::Number { default: 8.0, min: -10_000.0, max: 10_000.0 },
        meaning: "what warming up changes of the scale factor in the end",
    },
    Setting {
        key: "gyroscope.warm_up_deg_h",
        unit: "deg/h",
        kind: Kind::Number { default: 1.0, min: -3600.0, max: 3600.0 },
        meaning: "what warming up changes of the bias in the end",
    },
    Setting {
        key: "gyroscope.warm_up_s",
        unit: "s",
        kind: Kind::Number { default: 120.0, min: 1.0, max: 1e6 },
        meaning: "time constant of warming up, which begins with the run",
    },
    Setting {
        key: "gyroscope.random_walk_deg_rh",
        unit: "deg/sqrt(h)",
        kind: Kind::Number { default: 0.15, min: 0.0, max: 100.0 },
        meaning: "angle random walk",
    },
    Setting {
        key: "gyroscope.instability_deg_h",
        unit: "deg/h",
        kind: Kind::Number { default: 0.5, min: 0.0, max: 1000.0 },
        meaning: "bias instability: the plateau of the Allan deviation without random walk",
    },
    Setting {
        key: "gyroscope.instability_time_s",
        unit: "s",
        kind: Kind::Number { default: 200.0, min: 1.0, max: 1e5 },
        meaning: "correlation time of the instability; the plateau lies at 1.9 of it",
    },
    Setting {
        key: "gyroscope.sample_rate_hz",
        unit: "Hz",
        kind: Kind::Number { default: 500.0, min: 1.0, max: 10_000.0 },
        meaning: "samples a second, each the angle turned since the last",
    },
    Setting {
        key: "gyroscope.range_deg_s",
        unit: "deg/s",
        kind: Kind::Number { default: 400.0, min: 1.0, max: 100_000.0 },
        meaning: "mean rate over a sample at which it saturates",
    },
    Setting {
        key: "gyroscope.resolution_deg",
        unit: "deg",
        kind: Kind::Number { default: 4.768_371_582_031_25e-7, min: 0.0, max: 1.0 },
        meaning: "unit of a sample; 0 for none",
    },
    Setting {
        key: "gyroscope.serial",
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: 1_000_000 },
        meaning: "which gyroscope: its errors and its noise are drawn by the seed and this",
    },
];
