//! Keys of the camera.

use crate::scene::{Kind, Setting};

/// The camera's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "camera.frame_rate_hz",
        unit: "Hz",
        kind: Kind::Number { default: 10_000.0, min: 10.0, max: 100_000.0 },
        meaning: "frames a second",
    },
    Setting {
        key: "camera.phase_frames",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "part of a frame period by which all frames come later than whole periods from the start",
    },
    Setting {
        key: "camera.period_jitter_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-2 },
        meaning: "standard deviation of a frame's instant about even ones, at most a tenth of a period; its time stamp \
                  is right",
    },
    Setting {
        key: "camera.tracking_radius_m",
        unit: "m",
        kind: Kind::Number { default: 3.9e-3, min: 1e-4, max: 1e-1 },
        meaning: "distance of the tracked marks from the axis",
    },
    Setting {
        key: "camera.marks",
        unit: "",
        kind: Kind::Integer { default: 2, min: 1, max: 16 },
        meaning: "marks tracked, equally spaced on their circle; two or more tell the rotor's angle from its shift",
    },
    Setting {
        key: "camera.mark_tolerance_m",
        unit: "m",
        kind: Kind::Number { default: 5e-6, min: 0.0, max: 1e-3 },
        meaning: "residual of a mark that counts as right beside the noise, for what tilt does to the picture; of two \
                  marks or more",
    },
    Setting {
        key: "camera.resolution_m",
        unit: "m",
        kind: Kind::Number { default: 2e-6, min: 0.0, max: 1e-3 },
        meaning: "step of the tracked position; 0 for none",
    },
    Setting {
        key: "camera.noise_m",
        unit: "m",
        kind: Kind::Number { default: 1e-6, min: 0.0, max: 1e-3 },
        meaning: "standard deviation of the tracking noise, before quantisation",
    },
    Setting {
        key: "camera.subpixel_bias_m",
        unit: "m",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-3 },
        meaning: "amplitude of the error of a mark's coordinate that repeats from pixel to pixel, before quantisation; \
                  averaging does not remove it",
    },
    Setting {
        key: "camera.pixel_m",
        unit: "m",
        kind: Kind::Number { default: 1e-5, min: 1e-7, max: 1e-3 },
        meaning: "size of a pixel on the rotor, the period of camera.subpixel_bias_m; an assumption: some 1,000 pixels \
                  across the rotor",
    },
    Setting {
        key: "camera.vibration_m",
        unit: "m",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-3 },
        meaning: "amplitude of the microscope's vibration across the picture, which moves all marks alike, in a \
                  direction drawn by the seed",
    },
    Setting {
        key: "camera.vibration_hz",
        unit: "Hz",
        kind: Kind::Number { default: 120.0, min: 0.1, max: 1e4 },
        meaning: "frequency of the microscope's vibration; an assumption: a fan or a stage's resonance",
    },
    Setting {
        key: "camera.latency_frames",
        unit: "",
        kind: Kind::Integer { default: 1, min: 0, max: 1000 },
        meaning: "frame periods between the end of the exposure and the arrival",
    },
    Setting {
        key: "camera.latency_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "time between the end of the exposure and the arrival, added to camera.latency_frames",
    },
    Setting {
        key: "camera.exposure_frames",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "exposure per frame period; the frame shows the mean angle over it",
    },
    Setting {
        key: "camera.drop_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a frame never arrives",
    },
    Setting {
        key: "camera.duplicate_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a frame arrives twice",
    },
    Setting {
        key: "camera.outlier_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a frame is an outlier",
    },
    Setting {
        key: "camera.outlier_burst_frames",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 1.0, max: 1000.0 },
        meaning: "mean number of outliers in a row; 1 for as many as there are by chance",
    },
    Setting {
        key: "camera.outlier_m",
        unit: "m",
        kind: Kind::Number { default: 1e-4, min: 0.0, max: 1e-1 },
        meaning: "standard deviation of an outlier's error",
    },
    Setting {
        key: "camera.stamp_jitter_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e-2 },
        meaning: "standard deviation of the error of a frame's time stamp",
    },
    Setting {
        key: "camera.clock_offset_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: -1e5, max: 1e5 },
        meaning: "what the clock that stamps frames shows at the start; with this or a drift the camera has a clock of \
                  its own",
    },
    Setting {
        key: "camera.clock_drift_ppm",
        unit: "ppm",
        kind: Kind::Number { default: 0.0, min: -1000.0, max: 1000.0 },
        meaning: "by how much the clock that stamps frames runs faster than the board's",
    },
    Setting {
        key: "camera.clock_round_trip_s",
        unit: "s",
        kind: Kind::Number { default: 1e-3, min: 0.0, max: 0.02 },
        meaning: "shortest time from a question of the camera's computer to the board's answer, of a camera with a \
                  clock of its own; an assumption: USB",
    },
    Setting {
        key: "camera.clock_round_trip_spread_s",
        unit: "s",
        kind: Kind::Number { default: 2e-4, min: 0.0, max: 0.01 },
        meaning: "mean time by which such an exchange takes longer; an assumption",
    },
    Setting {
        key: "camera.late_probability",
        unit: "",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1.0 },
        meaning: "probability that a frame arrives later than its latency",
    },
    Setting {
        key: "camera.late_frames",
        unit: "",
        kind: Kind::Integer { default: 3, min: 1, max: 1000 },
        meaning: "most frame periods by which a late frame comes later",
    },
    Setting {
        key: "camera.lost_from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the camera sees nothing",
    },
    Setting {
        key: "camera.lost_until_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which it sees again; not after camera.lost_from_s for no loss",
    },
    Setting {
        key: "camera.fault",
        unit: "",
        kind: Kind::Choice { default: "none", of: &["none", "stuck", "zeros", "offset"] },
        meaning: "what the camera shows from camera.fault_from_s on: the last picture again, angle zero, or another \
                  feature",
    },
    Setting {
        key: "camera.fault_from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the camera's fault lasts",
    },
    Setting {
        key: "camera.fault_until_s",
        unit: "s",
        kind: Kind::Number { default: 1e5, min: 0.0, max: 1e5 },
        meaning: "time from which the camera is right again",
    },
    Setting {
        key: "camera.fault_offset_deg",
        unit: "deg",
        kind: Kind::Number { default: 90.0, min: -360.0, max: 360.0 },
        meaning: "how much further the other feature stands",
    },
    Setting {
        key: "camera.mark_fault",
        unit: "",
        kind: Kind::Choice { default: "none", of: &["none", "lost", "stuck", "false", "exchanged"] },
        meaning: "what is wrong with a mark from camera.mark_fault_from_s on: not found, stays where it was in the \
                  picture, another feature of the rotor, or exchanged with its neighbour",
    },
    Setting {
        key: "camera.faulty_mark",
        unit: "",
        kind: Kind::Integer { default: 1, min: 1, max: 16 },
        meaning: "number of that mark, counter-clockwise",
    },
    Setting {
        key: "camera.false_mark_m",
        unit: "m",
        kind: Kind::Number { default: 1e-4, min: -1e-2, max: 1e-2 },
        meaning: "how much further round the axis the other feature is, clockwise",
    },
    Setting {
        key: "camera.mark_fault_from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "time from which the mark's fault lasts",
    },
    Setting {
        key: "camera.mark_fault_until_s",
        unit: "s",
        kind: Kind::Number { default: 1e5, min: 0.0, max: 1e5 },
        meaning: "time from which the mark is right again",
    },
];
