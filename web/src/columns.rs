//! The columns of a row of samples, and of an impact, by name.

/// Columns of a row, in order. An angle is in degrees, an error of the estimate in milli-degrees, a height in
/// micrometres, a slope in milliradians. What there is not is NaN.
pub const ROW: [&str; 24] = [
    // End of the tick, in s.
    "t",
    // True angle and rate in rad/s.
    "angle",
    "rate",
    // Estimate less truth, its standard deviation in milli-degrees, and the estimated rate in rad/s.
    "error",
    "sd",
    "rate_estimate",
    // Strongest drive of the row: its amplitude, positive in mode B, negative in mode C.
    "drive",
    // 0 good, 1 degraded, 2 unusable, 3 waiting.
    "health",
    // Rotor and teeth, above the rotor and the teeth at rest.
    "height",
    "tooth_0",
    "tooth_1",
    "tooth_2",
    "tooth_3",
    // Tilt, and shift of the mass centre in micrometres.
    "slope_x",
    "slope_y",
    "shift_x",
    "shift_y",
    // The last frame of the row: measured less predicted angle in milli-degrees, the standard deviation predicted for
    // that, whether it was used (1) or refused (0), and the shift that its marks show, in micrometres.
    "innovation",
    "innovation_sd",
    "used",
    "marked_x",
    "marked_y",
    // Impacts in the row, and the sum of their impulses in micronewton seconds.
    "impacts",
    "impulse",
];

/// Columns of an impact: its time in s, its vertical impulse in micronewton seconds, the change of the rotor's rate in
/// rad/s, and the number of the tooth that is nearest to the rotor at the end of the tick.
pub const IMPACT: [&str; 4] = ["t", "impulse", "kick", "tooth"];
