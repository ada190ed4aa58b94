//! Keys of a calibration.

use crate::scene::{Kind, Setting};

/// Settings of the plan.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "calibrate.duration_s",
        unit: "s",
        kind: Kind::Number { default: 60.0, min: 1.0, max: 10_000.0 },
        meaning: "motor time of the whole plan",
    },
    Setting {
        key: "calibrate.clockwise_deg_s",
        unit: "deg/s",
        kind: Kind::Number { default: 120.0, min: 1.0, max: 1000.0 },
        meaning: "last step of the staircase clockwise, far below the gyroscope's range, so that the ripple seldom \
                  saturates it",
    },
    Setting {
        key: "calibrate.counter_clockwise_deg_s",
        unit: "deg/s",
        kind: Kind::Number { default: 200.0, min: 1.0, max: 1000.0 },
        meaning: "last step the other way; a motor that cannot follow turns as fast as it can",
    },
    Setting {
        key: "calibrate.steps",
        unit: "",
        kind: Kind::Integer { default: 1, min: 1, max: 1000 },
        meaning: "steps of the staircase, each a turn to either side",
    },
    Setting {
        key: "calibrate.rest_s",
        unit: "s",
        kind: Kind::Number { default: 0.5, min: 0.05, max: 1000.0 },
        meaning: "rest before each turn and after the last",
    },
    Setting {
        key: "calibrate.interval_s",
        unit: "s",
        kind: Kind::Number { default: 0.25, min: 0.01, max: 10.0 },
        meaning: "gyroscope and reference are compared once in this time, rounded to samples",
    },
    Setting {
        key: "calibrate.pilot_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1000.0 },
        meaning: "length of a pilot, after which rates and times are chosen; 0 for none. Unless it is set, 10 s where \
                  the rotor tilts, there is one step, and the plan takes 20 s or more",
    },
    Setting {
        key: "calibrate.within_ppm",
        unit: "ppm",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1000.0 },
        meaning: "after the pilot the plan ends once the fit states 95 % of scale factors within this, looked at a few \
                  times, and after calibrate.duration_s at the latest; 0 for all of that time",
    },
    Setting {
        key: "calibrate.camera_angle_mdeg",
        unit: "mdeg",
        kind: Kind::Number { default: 10.0, min: 0.0, max: 10_000.0 },
        meaning: "standard deviation of what the camera's angle is off by, once and twice round with the angle (a \
                  lens's distortion, a mark's position); the fit finds these errors",
    },
];
