//! The rotor's motion from one step of the plant to the next, at any instant between.
//!
//! ```text
//! angle(t) = angle_0 + (angle_1 - angle_0) (t - t_0) / (t_1 - t_0),     vertical velocity, shift and slopes likewise
//! ```
//!
//! An impact changes the velocity at once. In flight to either side it is constant to 1e-5 m/s, so that the heights
//! tell when the impact was: `z_1 - z_0 = v_0 t + v_1 (t_1 - t_0 - t)`.
//!
//! At the steps it is the plant's own state, bit by bit. Between them, a rotor in flight turns at its rate and falls
//! with gravity, so that both are linear in time. What is left out is within one step, 1 us as a rule:
//!
//! - damping, far below the angle's unit;
//! - an impact changes the rate at once; here the change is spread over its step;
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
    /// The height of the rotor's centre in m.
    pub height_m: f64,
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
    /// Whether the rotor was struck on the way, and flies before and after.
    pub struck: bool,
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
        if self.struck {
            return if self.part(at) < self.part_before_impact() { from } else { until };
        }
        from + (until - from) * self.part(at)
    }

    /// The part of the path before the impact of a rotor that was struck.
    fn part_before_impact(&self) -> f64 {
        let duration_s: f64 = self.until.at.seconds_since(self.from.at);
        let (before, after) = (self.from.velocity_m_s, self.until.velocity_m_s);
        let risen_m = self.until.height_m - self.from.height_m;
        // Equal velocities give no number, which clamps to none: the impact is then at the start, and changes nothing.
        ((risen_m - after * duration_s) / ((before - after) * duration_s)).clamp(0.0, 1.0)
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
        RotorPath { from: point(10, -500, 0.2), until: point(11, 500, -0.2), struck: false }
    }

    /// A rotor that falls at 0.1 m/s and is struck after 0.3 us, from which on it rises at 0.2 m/s.
    #[test]
    fn exact_an_impact_within_a_step_changes_the_velocity_at_once() {
        let mut path = RotorPath { struck: true, ..path() };
        (path.from.velocity_m_s, path.until.velocity_m_s) = (-0.1, 0.2);
        path.until.height_m = -0.1 * 0.3e-6 + 0.2 * 0.7e-6;
        for (nanos, expected) in [(10_000, -0.1), (10_299, -0.1), (10_301, 0.2), (10_900, 0.2), (11_000, 0.2)]
        {
            let shown = path.velocity_at(Time::from_nanos(nanos), [0.0; 2]);
            assert!((shown - expected).abs() < 1e-15, "{nanos}: {shown}");
        }
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
