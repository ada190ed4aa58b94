//! The strengths of drive that positioning picks from.
//!
//! Each gear says from what distance it is used, how long the rotor coasts after it, and how long it may stay on. What they do in the model, with
//! Coulomb friction and located impacts at a 1 us step, in 40 motors drawn within Table 1's tolerances and driven at the nominal frequencies (mean
//! +- standard deviation over the motors, printed by `cargo run --release -p host-sim --example coast`):
//!
//! | drive | on for | turned deg | rate deg/s | coast mdeg |
//! |---|---|---|---|---|
//! | B, 1 | 150 ms | 120 +- 14 | 931 +- 250 | 8650 +- 3970 |
//! | B, 0.5 | 150 ms | 45.6 +- 8.3 | 312 +- 141 | 1640 +- 600 |
//! | B, 0.3 | 10 ms | 0.26 +- 0.26 | 43 +- 48 | 126 +- 190 |
//! | B, 0.3 | 3 ms | 0.040 +- 0.024 | 16 +- 19 | 43 +- 63 |
//! | B, 0.2 | 3 ms | 0.013 +- 0.005 | 1.6 +- 2.9 | 0.0 +- 1.7 |
//! | C, 1 | 150 ms | -12.8 +- 2.9 | -80 +- 39 | -168 +- 107 |
//! | C, 0.6 | 150 ms | -2.4 +- 1.5 | -16 +- 16 | -17 +- 15 |
//! | C, 0.3 | 150 ms | -0.231 +- 0.063 | -1.9 +- 0.5 | -2.3 +- 0.4 |
//!
//! Clockwise needs mode B, whose throws are long and uncertain, so the last step clockwise is a burst of a fixed few milliseconds; counter-clockwise
//! the rotor walks under weak mode C and can be stopped almost at will. An overshoot clockwise is therefore cheap to mend.

use core::f32::consts::PI;

use motor_model::DriveMode;

/// A drive for a range of remaining angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    /// The mode, which sets the direction.
    pub mode: DriveMode,
    /// Drive amplitude, 0 to 1.
    pub amplitude: f32,
    /// Used when at least this much remains, in rad.
    pub from_rad: f32,
    /// Coast after cut-off per rate at cut-off, in s.
    pub coast_s: f32,
    /// Aimed short of the target by this, in rad: about one standard deviation of the coast.
    pub short_rad: f32,
    /// Longest time on, in ns.
    pub longest_nanos: u64,
}

const fn degrees(deg: f32) -> f32 {
    deg * (PI / 180.0)
}

const fn millis(ms: u64) -> u64 {
    ms * 1_000_000
}

/// Clockwise gears, strongest first; the last one takes whatever remains.
pub const CLOCKWISE: [Gear; 5] = [
    gear(DriveMode::B, 1.0, 30.0, 10.5e-3, 2.0, 10_000),
    gear(DriveMode::B, 0.5, 3.0, 5.5e-3, 0.3, 10_000),
    gear(DriveMode::B, 0.3, 1.0, 2.0e-3, 0.1, 10),
    gear(DriveMode::B, 0.3, 0.12, 2.0e-3, 0.0, 3),
    gear(DriveMode::B, 0.2, 0.0, 0.0, 0.0, 3),
];

/// Counter-clockwise gears, strongest first; the last one takes whatever remains.
pub const COUNTER_CLOCKWISE: [Gear; 3] = [
    gear(DriveMode::C, 1.0, 1.0, 2.2e-3, 0.05, 20_000),
    gear(DriveMode::C, 0.6, 0.1, 1.3e-3, 0.01, 2_000),
    gear(DriveMode::C, 0.3, 0.0, 1.3e-3, 0.0, 200),
];

const fn gear(
    mode: DriveMode,
    amplitude: f32,
    from_deg: f32,
    coast_s: f32,
    short_deg: f32,
    longest_ms: u64,
) -> Gear {
    Gear {
        mode,
        amplitude,
        from_rad: degrees(from_deg),
        coast_s,
        short_rad: degrees(short_deg),
        longest_nanos: millis(longest_ms),
    }
}

/// The gear for `remaining_rad`, clockwise positive.
pub fn select(remaining_rad: f32) -> Gear {
    let (stronger, last): (&[Gear], &Gear) = if remaining_rad > 0.0 {
        let [stronger @ .., last] = &CLOCKWISE;
        (stronger, last)
    } else {
        let [stronger @ .., last] = &COUNTER_CLOCKWISE;
        (stronger, last)
    };
    *stronger.iter().find(|gear| remaining_rad.abs() >= gear.from_rad).unwrap_or(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_selection_by_sign_and_distance() {
        for (deg, mode, amplitude) in [
            (90.0, DriveMode::B, 1.0),
            (5.0, DriveMode::B, 0.5),
            (0.01, DriveMode::B, 0.2),
            (-90.0, DriveMode::C, 1.0),
            (-0.5, DriveMode::C, 0.6),
            (-0.01, DriveMode::C, 0.3),
        ] {
            let gear = select(degrees(deg));
            assert_eq!(gear.mode, mode, "{deg}");
            assert!((gear.amplitude - amplitude).abs() < f32::EPSILON, "{deg}");
        }
    }

    /// A weaker gear must be able to start where a stronger one, aimed short, may leave the rotor.
    #[test]
    fn law_gears_are_ordered_from_strong_and_far_to_weak_and_near() {
        for gears in [&CLOCKWISE[..], &COUNTER_CLOCKWISE[..]] {
            for pair in gears.windows(2) {
                assert!(pair[0].from_rad > pair[1].from_rad && pair[0].amplitude >= pair[1].amplitude);
            }
            assert!(gears.last().unwrap().from_rad.abs() < f32::EPSILON);
        }
    }
}
