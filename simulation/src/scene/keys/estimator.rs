//! Keys of the estimator.

use crate::scene::{Kind, Setting};

/// The filters by name, from the simplest to the richest.
pub const FILTERS: &[&str] = &["constant_rate", "impact_aided", "twin"];

/// What the filter of a scene may be: one of [`FILTERS`], or the best that the instruments allow.
const CHOICES: &[&str] = &["best", "constant_rate", "impact_aided", "twin"];

/// A key of `estimator.assumed`, which is as `key` unless it is set.
const fn assumed(
    name: &'static str,
    key: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Setting {
    Setting { key: name, unit, kind: Kind::As { key }, meaning }
}

/// The estimator's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "estimator.filter",
        unit: "",
        kind: Kind::Choice { default: "best", of: CHOICES },
        meaning: "filter of angle and rate: the best that the instruments allow, or from the camera alone, with the \
                  vibrometer's impacts, or with a twin as well",
    },
    assumed(
        "estimator.assumed.camera.frame_rate_hz",
        "camera.frame_rate_hz",
        "Hz",
        "frames a second, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.exposure_frames",
        "camera.exposure_frames",
        "",
        "exposure per frame period, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.latency_frames",
        "camera.latency_frames",
        "",
        "frame periods of latency, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.latency_s",
        "camera.latency_s",
        "s",
        "latency beside the frame periods, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.noise_m",
        "camera.noise_m",
        "m",
        "standard deviation of the tracking noise, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.resolution_m",
        "camera.resolution_m",
        "m",
        "step of the tracked position, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.tracking_radius_m",
        "camera.tracking_radius_m",
        "m",
        "distance of the tracked marks from the axis, as the filters assume",
    ),
    assumed("estimator.assumed.camera.marks", "camera.marks", "", "marks tracked, as the filters assume"),
    assumed(
        "estimator.assumed.camera.subpixel_bias_m",
        "camera.subpixel_bias_m",
        "m",
        "amplitude of the sub-pixel bias of a mark's coordinate, as the filters assume",
    ),
    assumed(
        "estimator.assumed.camera.vibration_m",
        "camera.vibration_m",
        "m",
        "amplitude of the microscope's vibration, as the filters assume: an error of a single mark; several marks may \
         be shifted by so much",
    ),
    assumed(
        "estimator.assumed.camera.stamp_jitter_s",
        "camera.stamp_jitter_s",
        "s",
        "standard deviation of the error of a frame's time stamp, as the filters assume",
    ),
    Setting {
        key: "estimator.assumed.camera.clock_error_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-2 },
        meaning: "root mean square error of the clock that stamps frames, as the filters assume; where this is not \
                  set, that of camera.clock_round_trip_s, or what a run on a board finds",
    },
    assumed(
        "estimator.assumed.hub.clearance_m",
        "motor.hub.clearance_m",
        "m",
        "radial clearance in which the rotor shifts, as the filters assume, where the rotor has a hub or this is set: \
         an error of a single mark; several marks may be shifted by so much and a third more",
    ),
    assumed(
        "estimator.assumed.ldv.installed",
        "ldv.installed",
        "",
        "whether there is a vibrometer, as the filters assume",
    ),
    assumed(
        "estimator.assumed.ldv.sample_rate_hz",
        "ldv.sample_rate_hz",
        "Hz",
        "samples a second, as the filters assume",
    ),
    assumed(
        "estimator.assumed.ldv.noise_m_s",
        "ldv.noise_m_s",
        "m/s",
        "standard deviation of a sample's noise, as the filters assume",
    ),
    Setting {
        key: "estimator.assumed.ldv.bias_max_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "largest velocity, of either sign, shown at rest, as the filters assume, which do not know \
                  ldv.bias_m_s",
    },
    assumed(
        "estimator.assumed.ldv.range_m_s",
        "ldv.range_m_s",
        "m/s",
        "speed at which samples saturate, as the filters assume",
    ),
    assumed("estimator.assumed.ldv.bits", "ldv.bits", "", "bits of a sample, as the filters assume"),
];
