//! Keys of the laser-Doppler vibrometer.

use crate::scene::{Kind, Setting};

/// The vibrometer's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "ldv.installed",
        unit: "",
        kind: Kind::Choice { default: "yes", of: &["yes", "no"] },
        meaning: "whether there is a vibrometer",
    },
    Setting {
        key: "ldv.radius_m",
        unit: "m",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-2 },
        meaning: "distance of the spot from the axis; 0 for the axis",
    },
    Setting {
        key: "ldv.angle_deg",
        unit: "deg",
        kind: Kind::Number { default: 0.0, min: -360.0, max: 360.0 },
        meaning: "where the spot is round the axis, counter-clockwise; 0 is the x axis of camera and rotor",
    },
    Setting {
        key: "ldv.sample_rate_hz",
        unit: "Hz",
        kind: Kind::Number { default: 200_000.0, min: 10_000.0, max: 1e6 },
        meaning: "samples a second",
    },
    Setting {
        key: "ldv.phase_samples",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "part of a sample period by which all samples come later than whole periods from the start",
    },
    Setting {
        key: "ldv.period_jitter_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-5 },
        meaning: "standard deviation of a sample's instant about even ones, at most a tenth of a period; its time \
                  stamp is right",
    },
    Setting {
        key: "ldv.noise_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 2e-4, min: 0.0, max: 1.0 },
        meaning: "standard deviation of a sample's noise",
    },
    Setting {
        key: "ldv.drop_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a sample is missing",
    },
    Setting {
        key: "ldv.outlier_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a sample is an outlier",
    },
    Setting {
        key: "ldv.outlier_burst_samples",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 1.0, max: 1000.0 },
        meaning: "mean number of outliers in a row; 1 for as many as there are by chance",
    },
    Setting {
        key: "ldv.outlier_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 0.1, min: 0.0, max: 10.0 },
        meaning: "standard deviation of an outlier's error",
    },
    Setting {
        key: "ldv.range_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 100.0 },
        meaning: "speed at which samples saturate; 0 for no limit",
    },
    Setting {
        key: "ldv.bits",
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: 24 },
        meaning: "bits of a sample, 6 to 24: steps of 2 ldv.range_m_s / 2^bits; 0 for no steps",
    },
    Setting {
        key: "ldv.gain_error",
        unit: "",
        kind: Kind::Number { default: 0.0, min: -0.5, max: 0.5 },
        meaning: "relative error of the velocity's scale",
    },
    Setting {
        key: "ldv.bias_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 0.0, min: -1.0, max: 1.0 },
        meaning: "velocity shown at rest",
    },
    Setting {
        key: "ldv.lost_from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the vibrometer sees nothing",
    },
    Setting {
        key: "ldv.lost_until_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which it sees again; not after ldv.lost_from_s for no loss",
    },
    Setting {
        key: "ldv.fault",
        unit: "",
        kind: Kind::Choice { default: "none", of: &["none", "stuck", "zeros", "inverted", "not_a_number"] },
        meaning: "what the vibrometer delivers from ldv.fault_from_s on: the last value again, zeros, the negative \
                  velocity, or no numbers",
    },
    Setting {
        key: "ldv.fault_from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the vibrometer's fault lasts",
    },
    Setting {
        key: "ldv.fault_until_s",
        unit: "s",
        kind: Kind::Number { default: 1e5, min: 0.0, max: 1e5 },
        meaning: "time from which the vibrometer is right again",
    },
];
