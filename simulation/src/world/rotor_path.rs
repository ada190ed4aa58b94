//! The rotor's motion from one step of the plant to the next, at any instant between.
//!
//! ```text
//! angle(t) = angle_0 + (angle_1 - angle_0) (t - t_0) / (t_1 - t_0),     vertical velocity, shift and slopes likewise
//! ```
//!
//! At the steps it is the plant's own state, bit by bit. Between them, a rotor in flight turns at its rate and falls
//! with gravity, so that both are linear in time. What is left out is within one step, 1 us as a rule:
//!
//! - damping, far below the angle's unit;
//! - an impact changes rate and velocity at once; here the change is spread over its step;
//! - the velocity on teeth that vibrate at 7 kHz is off by 3e-4 of its amplitude.

use motor_model::{Angle, Time};

use crate::world::pose::Pose;

/// The rotor at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorPoint {
    /// The instant.
    pub at: Time,
    /// The rotor's angle, clockwise positive.
    pub angle: Angle,
    /// The rotor's rate in rad/s, clockwise positive.
    pub rate_rad_s: f64,
    /// The vertical velocity of the rotor's centre in m/s, upwards positive.
    pub velocity_m_s: f64,
    /// How it is shifted and tilted.
    pub pose: Pose,
}

/// The rotor from one step of the plant to the next, or to the one after a long step at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorPath {
    /// At the start of the step.
    pub from: RotorPoint,
    /// At its end, which is later.
    pub until: RotorPoint,
}

impl RotorPoint {
    /// The vertical velocity in m/s of the rotor's surface where it passes `spot`, a place at rest in m from the pin's
    /// axis.
    pub fn velocity_at_spot(&self, spot: [f64; 2]) -> f64 {
        self.velocity_m_s + self.pose.vertical_velocity(spot, self.rate_rad_s)
    }
}

impl RotorPath {
    /// The angle at `at`, within the path, rounded to the unit of 2^-32 turn.
    #[expect(clippy::cast_possible_truncation, reason = "between two angles")]
    pub fn angle_at(&self, at: Time) -> Angle {
        if at >= self.until.at {
            return self.until.angle;
        }
        let (since, all) = self.nanos(at);
        let turned = i128::from(self.until.angle.minus(self.from.angle).units());
        let part = (2 * turned * i128::from(since) + i128::from(all)).div_euclid(2 * i128::from(all));
        self.from.angle.plus(Angle::from_units(part as i64))
    }

    /// The vertical velocity of the rotor's surface at a spot (see [`RotorPoint::velocity_at_spot`]) at `at`, within
    /// the path, in m/s.
    pub fn velocity_at(&self, at: Time, spot: [f64; 2]) -> f64 {
        let until = self.until.velocity_at_spot(spot);
        if at >= self.until.at {
            return until;
        }
        let from = self.from.velocity_at_spot(spot);
        from + (until - from) * self.part(at)
    }

    /// Shift and tilt at `at`, within the path.
    pub fn pose_at(&self, at: Time) -> Pose {
        if at >= self.until.at {
            return self.until.pose;
        }
        self.from.pose.between(&self.until.pose, self.part(at))
    }

    /// The part of the path that has passed at `at`.
    #[expect(clippy::cast_precision_loss, reason = "a step is far below 2^53 ns")]
    fn part(&self, at: Time) -> f64 {
        let (since, all) = self.nanos(at);
        since as f64 / all as f64
    }

    /// Time from the start to `at`, and the length of the path, which is at least 1.
    fn nanos(&self, at: Time) -> (u64, u64) {
        (at.nanos_since(self.from.at), self.until.at.nanos_since(self.from.at).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path() -> RotorPath {
        let point = |micros, units, velocity_m_s| RotorPoint {
            at: Time::from_micros(micros),
            angle: Angle::from_units(units),
            velocity_m_s,
            ..RotorPoint::default()
        };
        RotorPath { from: point(10, -500, 0.2), until: point(11, 500, -0.2) }
    }

    #[test]
    fn exact_ends_and_middle() {
        for (nanos, units, velocity_m_s) in [(10_000, -500, 0.2), (10_500, 0, 0.0), (11_000, 500, -0.2)] {
            assert_eq!(path().angle_at(Time::from_nanos(nanos)), Angle::from_units(units));
            assert!((path().velocity_at(Time::from_nanos(nanos), [0.0; 2]) - velocity_m_s).abs() < 1e-15);
        }
        assert_eq!(path().angle_at(Time::from_nanos(10_001)), Angle::from_units(-499));
        // Half of 1001 units is rounded up.
        let mut odd = path();
        odd.until.angle = Angle::from_units(501);
        assert_eq!(odd.angle_at(Time::from_nanos(10_500)), Angle::from_units(1));
    }

    /// Shift, slopes and their rates are the plant's own at the end, and half-way between in the middle.
    #[test]
    fn exact_pose_between_two_steps() {
        let mut path = path();
        path.from.pose = Pose { shift_m: [2e-6, 0.0], slope: [0.01, 0.02], slope_rate_s: [-4.0, 8.0] };
        path.until.pose = Pose { shift_m: [4e-6, -2e-6], slope: [0.03, 0.0], slope_rate_s: [4.0, 8.0] };
        assert_eq!(path.pose_at(Time::from_micros(11)), path.until.pose);
        let Pose { shift_m, slope, slope_rate_s } = path.pose_at(Time::from_nanos(10_500));
        let expected = [3e-6, -1e-6, 0.02, 0.01, 0.0, 8.0];
        for (value, expected) in [shift_m, slope, slope_rate_s].concat().into_iter().zip(expected) {
            assert!((value - expected).abs() < 1e-15, "{value} {expected}");
        }
    }

    /// Beyond +-2^31 turns an angle wraps; the path across the seam is as short as it is.
    #[test]
    fn exact_across_the_seam_of_the_angle() {
        let mut path = path();
        path.from.angle = Angle::from_units(i64::MAX - 499);
        path.until.angle = path.from.angle.plus(Angle::from_units(1000));
        assert_eq!(path.angle_at(Time::from_nanos(10_499)), Angle::from_units(i64::MAX));
        assert_eq!(path.angle_at(Time::from_nanos(10_500)), Angle::from_units(i64::MIN));
    }
}
