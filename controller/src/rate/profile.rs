//! Profiles: the commanded rate over time, for example of a calibration.

use motor_model::{OutOfBounds, math};

/// A rate over time, as a rate controller follows it.
pub trait RateProfile: Copy {
    /// The rate at `time_s` since the start, in rad/s, clockwise positive. Exactly 0 asks for rest.
    fn rate_rad_s(&self, time_s: f32) -> f32;
}

/// One rate. A controller that follows nothing else computes no sine, for which a microcontroller without double
/// precision takes long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    rate_rad_s: f32,
}

impl Dwell {
    /// Rest.
    pub const REST: Self = Self { rate_rad_s: 0.0 };

    /// One rate in deg/s.
    ///
    /// # Errors
    /// When the rate is no number, or beyond +-1100 deg/s.
    pub fn try_new(rate_deg_s: f64) -> Result<Self, OutOfBounds> {
        let max = RATE_MAX_RAD_S.to_degrees();
        OutOfBounds::check("rate.deg_s", rate_deg_s, -max, max, "deg/s")?;
        #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
        let rate_rad_s = rate_deg_s.to_radians() as f32;
        Ok(Self { rate_rad_s })
    }
}

impl RateProfile for Dwell {
    fn rate_rad_s(&self, _: f32) -> f32 {
        self.rate_rad_s
    }
}

impl RateProfile for Profile {
    fn rate_rad_s(&self, time_s: f32) -> f32 {
        Self::rate_rad_s(self, time_s)
    }
}

/// A rate over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// One rate.
    Dwell {
        /// The rate in rad/s.
        rate_rad_s: f32,
    },
    /// From 0 in equal steps of equal length to the rate, which then stays.
    Staircase {
        /// The last rate in rad/s.
        rate_rad_s: f32,
        /// How many steps, at least 1.
        steps: u16,
        /// Length of a step in s.
        step_s: f32,
    },
    /// Turns to either side at a staircase of rates, with a rest before each and after the last.
    BothWays {
        /// Last rate clockwise in rad/s.
        clockwise_rad_s: f32,
        /// Last rate the other way in rad/s, negative.
        counter_clockwise_rad_s: f32,
        /// How many steps lead up to these, at least 1; each has a turn to either side.
        steps: u16,
        /// Length of a turn in s.
        turn_s: f32,
        /// Length of a rest in s.
        rest_s: f32,
    },
    /// A sine about a mean, its frequency rising in proportion to time.
    Sweep {
        /// The mean in rad/s.
        mean_rad_s: f32,
        /// Amplitude in rad/s.
        amplitude_rad_s: f32,
        /// First and last frequency in Hz.
        frequency_hz: (f32, f32),
        /// Length in s.
        length_s: f32,
    },
}

/// Fastest commanded rate in rad/s: 1100 deg/s, beyond what a drawn motor reaches.
pub const RATE_MAX_RAD_S: f64 = 19.2;

impl Profile {
    /// A dwell.
    ///
    /// # Errors
    /// As [`Dwell::try_new`].
    pub fn dwell(rate_deg_s: f64) -> Result<Self, OutOfBounds> {
        let Dwell { rate_rad_s } = Dwell::try_new(rate_deg_s)?;
        Ok(Self::Dwell { rate_rad_s })
    }

    /// The rate at `time_s` since the start, in rad/s. Exactly 0 asks for rest.
    pub fn rate_rad_s(&self, time_s: f32) -> f32 {
        match *self {
            Self::Dwell { rate_rad_s } => rate_rad_s,
            Self::Staircase { rate_rad_s, steps, step_s } => {
                let step = whole(time_s / step_s);
                rate_rad_s * ((step + 1.0) / f32::from(steps.max(1))).min(1.0)
            }
            Self::BothWays { clockwise_rad_s, counter_clockwise_rad_s, steps, turn_s, rest_s } => {
                let side_s = rest_s + turn_s;
                let (sides, steps) = (whole(time_s / side_s), f32::from(steps.max(1)));
                let step = whole(0.5 * sides);
                if step >= steps || time_s - sides * side_s < rest_s {
                    return 0.0;
                }
                let clockwise = sides - 2.0 * step < 0.5;
                let last_rad_s = if clockwise { clockwise_rad_s } else { counter_clockwise_rad_s };
                last_rad_s * (step + 1.0) / steps
            }
            Self::Sweep { mean_rad_s, amplitude_rad_s, frequency_hz: (from, to), length_s } => {
                let cycles = time_s * (from + 0.5 * (to - from) * time_s / length_s);
                mean_rad_s + amplitude_rad_s * math::sin_f32(cycles * core::f32::consts::TAU)
            }
        }
    }
}

/// The whole part of what is not negative; beyond 65535, that.
fn whole(x: f32) -> f32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let whole = x as u16;
    f32::from(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_profiles() {
        assert_eq!(Profile::dwell(f64::NAN).unwrap_err().key, "rate.deg_s");
        assert!(Profile::dwell(1200.0).is_err());
        let stairs = Profile::Staircase { rate_rad_s: 4.0, steps: 4, step_s: 0.5 };
        for (time_s, rate) in [(0.0, 1.0), (0.49, 1.0), (0.51, 2.0), (1.9, 4.0), (99.0, 4.0)] {
            assert!((stairs.rate_rad_s(time_s) - rate).abs() < 1e-6);
        }
        let sweep =
            Profile::Sweep { mean_rad_s: 2.0, amplitude_rad_s: 1.0, frequency_hz: (1.0, 3.0), length_s: 2.0 };
        // 1 Hz at first; after two seconds 4 cycles are over.
        assert!((sweep.rate_rad_s(0.0) - 2.0).abs() < 1e-6 && (sweep.rate_rad_s(2.0) - 2.0).abs() < 1e-4);
        assert!((sweep.rate_rad_s(0.207) - 3.0).abs() < 0.01);
    }

    /// Two steps of turns of 1 s after rests of 0.5 s: 6 s in all, and rest from then on.
    #[test]
    fn exact_a_staircase_both_ways() {
        let profile = Profile::BothWays {
            clockwise_rad_s: 4.0,
            counter_clockwise_rad_s: -1.0,
            steps: 2,
            turn_s: 1.0,
            rest_s: 0.5,
        };
        for (time_s, rate) in [
            (0.0, 0.0),
            (0.49, 0.0),
            (0.51, 2.0),
            (1.49, 2.0),
            (1.51, 0.0),
            (2.01, -0.5),
            (2.99, -0.5),
            (3.01, 0.0),
            (3.51, 4.0),
            (5.01, -1.0),
            (5.99, -1.0),
            (6.01, 0.0),
            (6.51, 0.0),
            (1e6, 0.0),
        ] {
            let found = profile.rate_rad_s(time_s);
            assert!((found - rate).abs() < 1e-6, "{time_s} s: {found}");
        }
    }
}
