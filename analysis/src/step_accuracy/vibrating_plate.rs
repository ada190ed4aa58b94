//! A problem for any integrator with events: a ball that bounces on a vibrating plate.
//!
//! ```text
//! m z'' = -m g - b z',   plate z_p = A sin(w t),   at an impact z' -> z_p' + e (z_p' - z')
//! ```
//!
//! The ball has the rotor's mass. The plate is a tooth in mode C at full drive, infinitely heavy. The ball starts at
//! rest at a height of about 10 um. An impact slower than 0.1 mm/s ends the bouncing: the ball then rides on the plate
//! until the plate falls faster than the ball.
//!
//! The time of the first impact is a root of a closed form: with `k = b / m`,
//! `z = z_0 - (g / k) (t - (1 - exp(-k t)) / k)`.

#[cfg(any(test, feature = "peers"))]
use core::f64::consts::{PI, TAU};

use motor_model::{Mode, MotorParams, Parameter, ToothPair, math};
use serde::Serialize;

use simulation::runs::RunError;

/// Start height of the timed run.
pub const START_M: f64 = 10e-6;
/// Number of start heights for the error of the first impact.
pub const START_COUNT: u8 = 16;
/// Spacing of these heights.
pub const START_SPACING_M: f64 = 0.1e-6;
/// Upper bound of the time of the first impact from any of these heights.
pub const FIRST_BEFORE_S: f64 = 2.5e-3;
/// Speed of approach below which the ball stays on the plate.
pub const CAPTURE_M_S: f64 = 1e-4;
/// Height of the ball above the plate after an impact, because an event function must not start at zero.
pub const CLEARANCE_M: f64 = 1e-12;
/// Relative tolerance of the adaptive integrators.
pub const RELATIVE_TOLERANCE: f64 = 1e-9;
/// Absolute tolerance of the adaptive integrators, in m and, for the velocity, in m/s.
pub const ABSOLUTE_TOLERANCE: f64 = 1e-12;

/// The parameters of ball and plate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VibratingPlate {
    /// `A`.
    pub amplitude_m: f64,
    /// `w`.
    pub rate_rad_s: f64,
    /// `k = b / m`.
    pub damping_per_s: f64,
    /// `g`.
    pub gravity_m_s2: f64,
    /// `e`.
    pub restitution: f64,
}

/// The state of the ball at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The instant.
    pub time_s: f64,
    /// Height above the middle of the plate's motion.
    pub height_m: f64,
    /// Velocity.
    pub velocity_m_s: f64,
}

impl VibratingPlate {
    /// The plate is a tooth, the ball the rotor of the nominal motor.
    ///
    /// # Errors
    /// Never for nominal parameters.
    pub fn nominal() -> Result<Self, RunError> {
        let params = MotorParams::nominal();
        let [_, _, mode] = Mode::all(&params)?;
        let [pair, _] = ToothPair::<f64>::both(&params, &motor_model::AmplitudeVariation::default());
        Ok(Self {
            amplitude_m: mode.antinode_amplitude_m * pair.shape.z,
            rate_rad_s: mode.natural_rad_s,
            damping_per_s: params.get(Parameter::VerticalDamping) / params.get(Parameter::RotorMass),
            gravity_m_s2: params.get(Parameter::Gravity),
            restitution: params.get(Parameter::Restitution),
        })
    }

    /// The plate's height.
    pub fn height_m(&self, time_s: f64) -> f64 {
        self.amplitude_m * math::sin_cos(self.rate_rad_s * time_s).0
    }

    /// The plate's velocity.
    pub fn velocity_m_s(&self, time_s: f64) -> f64 {
        self.amplitude_m * self.rate_rad_s * math::sin_cos(self.rate_rad_s * time_s).1
    }

    /// Height of the ball above the plate.
    pub fn gap_m(&self, ball: &Ball) -> f64 {
        ball.height_m - self.height_m(ball.time_s)
    }

    /// Acceleration of the ball in flight.
    #[cfg(any(test, feature = "peers"))]
    #[inline]
    pub fn acceleration_m_s2(&self, velocity_m_s: f64) -> f64 {
        -self.gravity_m_s2 - self.damping_per_s * velocity_m_s
    }

    /// State at `time_s` of a ball that falls from rest at `start_m`.
    pub fn falling_from(&self, start_m: f64, time_s: f64) -> Ball {
        let x = self.damping_per_s * time_s;
        Ball {
            time_s,
            height_m: start_m - self.gravity_m_s2 * time_s * time_s * math::decay_second_mean(x),
            velocity_m_s: -self.gravity_m_s2 * time_s * math::decay_mean(x),
        }
    }

    /// Time of the first impact of a ball that falls from rest at `start_m`: Newton's method on the closed form, from a
    /// bracket of 0.1 us.
    pub fn first_impact_s(&self, start_m: f64) -> f64 {
        let gap_m = |time_s| self.gap_m(&self.falling_from(start_m, time_s));
        let mut time_s = 0.0;
        while gap_m(time_s) > 0.0 {
            time_s += 1e-7;
        }
        for _ in 0..6 {
            let ball = self.falling_from(start_m, time_s);
            time_s -= self.gap_m(&ball) / (ball.velocity_m_s - self.velocity_m_s(time_s));
        }
        time_s
    }

    /// Error of the first of the times of impacts of a ball that falls from rest at `start_m`.
    pub fn first_error_s(&self, times_s: &[f64], start_m: f64) -> f64 {
        times_s.first().map_or(f64::INFINITY, |time_s| (time_s - self.first_impact_s(start_m)).abs())
    }

    /// State of the ball after its impact on the plate.
    #[cfg(any(test, feature = "peers"))]
    #[must_use]
    pub fn after_impact(&self, ball: &Ball) -> Ball {
        let plate_m_s = self.velocity_m_s(ball.time_s);
        let approach_m_s = plate_m_s - ball.velocity_m_s;
        if approach_m_s < CAPTURE_M_S {
            return self.after_riding(ball.time_s);
        }
        let height_m = self.height_m(ball.time_s) + CLEARANCE_M;
        Ball { height_m, velocity_m_s: plate_m_s + self.restitution * approach_m_s, ..*ball }
    }

    /// State of a ball that rides on the plate from `time_s`, at the instant at which it leaves the plate. It leaves
    /// while `-A w^2 sin(w t) + k A w cos(w t) + g < 0`.
    #[cfg(any(test, feature = "peers"))]
    fn after_riding(&self, time_s: f64) -> Ball {
        let Self { amplitude_m, rate_rad_s, damping_per_s, gravity_m_s2, .. } = *self;
        let size =
            amplitude_m * rate_rad_s * math::sqrt(rate_rad_s * rate_rad_s + damping_per_s * damping_per_s);
        let lag = (damping_per_s / rate_rad_s).atan();
        let first = lag + (gravity_m_s2 / size).asin();
        let last = PI + 2.0 * lag - first;
        let phase = (rate_rad_s * time_s).rem_euclid(TAU);
        let wait = if phase < first {
            first - phase
        } else if phase < last {
            0.0
        } else {
            first + TAU - phase
        };
        let time_s = time_s + wait / rate_rad_s;
        Ball {
            time_s,
            height_m: self.height_m(time_s) + CLEARANCE_M,
            velocity_m_s: self.velocity_m_s(time_s),
        }
    }
}

/// The start heights for the error of the first impact.
pub fn start_heights_m() -> impl Iterator<Item = f64> {
    (0..START_COUNT).map(|index| START_M + f64::from(index) * START_SPACING_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_plate_is_a_tooth_in_mode_c() {
        let plate = VibratingPlate::nominal().unwrap();
        assert!((plate.amplitude_m - 1.57e-6).abs() < 0.005e-6, "{}", plate.amplitude_m);
        assert!((plate.rate_rad_s / TAU - 7460.0).abs() < 1e-9);
    }

    #[test]
    fn law_the_gap_is_zero_at_the_first_impact_and_positive_before() {
        let plate = VibratingPlate::nominal().unwrap();
        for start_m in start_heights_m() {
            let first_s = plate.first_impact_s(start_m);
            assert!(first_s < FIRST_BEFORE_S);
            assert!(plate.gap_m(&plate.falling_from(start_m, first_s)).abs() < 1e-19);
            let before = (0..1000).map(|part| first_s * (f64::from(part) / 1000.0 - 1e-6));
            assert!(
                before
                    .into_iter()
                    .skip(1)
                    .all(|time_s| plate.gap_m(&plate.falling_from(start_m, time_s)) > 0.0)
            );
        }
    }

    /// A ball that rides leaves the plate where the plate falls faster than the ball: `z_p'' < -g - k z_p'`.
    #[test]
    fn law_release_where_the_plate_falls_away() {
        let plate = VibratingPlate::nominal().unwrap();
        for part in 0..20 {
            let time_s = f64::from(part) * 0.05 * TAU / plate.rate_rad_s;
            let ball =
                Ball { time_s, height_m: plate.height_m(time_s), velocity_m_s: plate.velocity_m_s(time_s) };
            let free = plate.after_impact(&ball);
            let pull = |time_s: f64| {
                -plate.rate_rad_s * plate.rate_rad_s * plate.height_m(time_s)
                    - plate.acceleration_m_s2(plate.velocity_m_s(time_s))
            };
            assert!(pull(free.time_s + 1e-9) < 0.0, "{part}");
            assert!(free.time_s <= time_s || pull(free.time_s - 1e-9) > 0.0, "{part}");
        }
    }
}
