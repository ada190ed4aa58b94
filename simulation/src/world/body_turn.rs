//! By how much a rotor turns about each of three axes that are fixed in it: what a gyroscope on it senses.
//!
//! About its own axis that is the integral of its rate, [`crate::world::plant::Plant::own_axis_angle`]. About the two
//! axes across it the rotor turns where its tilt changes, seen from the rotor: a tilt whose direction stays in space
//! is one that goes round the rotor as it turns, and a tilt that turns with the rotor is a steady rate across its axis,
//! `sin e` of the rotor's rate.
//!
//! The rotor stands as if turned by `a` round the vertical and then tilted, without a turn round the vertical, until
//! its axis is n ([`crate::world::pose`]). Its axis moves with `n' = w x n`. So across n the rotor turns at `n x n'`,
//! and along the two axes that were horizontal before the tilt and the turn
//!
//! ```text
//! (w_1, w_2) = Rz(-a) (-h_y, h_x),      h = n'_xy - n'_z n_xy / (1 + n_z)
//! n = (-eta_x, -eta_y, 1) / s,          s = sqrt(1 + eta^2)
//! ```
//!
//! `a` is counter-clockwise positive; the rotor's reported angle is its negative. The height-only rotor stays level: it
//! does not turn across its axis.

use motor_model::math;

/// Turn of the rotor about axes fixed in it, in degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyTurn {
    /// About its own axis, clockwise positive.
    pub own_axis_deg: f64,
    /// About two axes across it, right-handed. The first points to x and the second to y at angle 0 of a level rotor.
    pub across_deg: [f64; 2],
}

impl BodyTurn {
    /// A turn about the rotor's own axis alone.
    #[must_use]
    pub fn about_own_axis(own_axis_deg: f64) -> Self {
        Self { own_axis_deg, across_deg: [0.0; 2] }
    }
}

/// Turn in rad about the two axes across the rotor's, on the way from one pair of slopes to another, by the rule of the
/// midpoint. The rotor stands at `angle_rad` in the middle, as seen from above, clockwise positive.
#[must_use]
pub fn turn_across([x_0, y_0]: [f64; 2], [x_1, y_1]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let axis_at = |x: f64, y: f64| {
        let s = math::sqrt(1.0 + x * x + y * y);
        [-x / s, -y / s, 1.0 / s]
    };
    let (from, until) = (axis_at(x_0, y_0), axis_at(x_1, y_1));
    let [mx, my, mz] = axis_at(0.5 * (x_0 + x_1), 0.5 * (y_0 + y_1));
    let risen = until[2] - from[2];
    let levelled = risen / (1.0 + mz);
    let (h_x, h_y) = (until[0] - from[0] - levelled * mx, until[1] - from[1] - levelled * my);
    let (s, c) = math::sin_cos(angle_rad);
    [-c * h_y - s * h_x, c * h_x - s * h_y]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::{Rotation3, Vector3};

    use super::*;

    /// A tilt that turns with the rotor is a steady rate across its axis: `sin e` of the angle turned, about the line
    /// of steepest slope. Clockwise turns are negative about the upward axis.
    #[test]
    fn exact_a_tilt_that_turns_with_the_rotor() {
        let slope = 0.031_f64;
        let sine = slope / math::sqrt(1.0 + slope * slope);
        let steps = 10_000_u32;
        for sense in [1.0, -1.0] {
            let angle = |step: f64| sense * 0.7 * TAU * step / f64::from(steps);
            // At angle 0 it falls along x: the axis leans to x.
            let slopes = |step: u32| {
                let (s, c) = math::sin_cos(-angle(f64::from(step)));
                [-slope * c, -slope * s]
            };
            let mut across = [0.0; 2];
            for step in 0..steps {
                let turn = turn_across(slopes(step), slopes(step + 1), angle(f64::from(step) + 0.5));
                across = [across[0] + turn[0], across[1] + turn[1]];
            }
            // Across n the rate is a' times the vertical's part across n, which lies opposite to where n leans.
            let expected = sense * 0.7 * TAU * sine;
            assert!((across[0] / expected - 1.0).abs() < 1e-6, "{across:?} {expected}");
            assert!(across[1].abs() < 1e-6 * expected.abs(), "{across:?}");
        }
    }

    /// A tilt that stays in space of a rotor that does not turn: no turn. A level rotor that falls by 0.02 along x
    /// turns by atan(0.02) about y, which is another of its own axes when it has turned by a quarter.
    #[test]
    fn exact_a_tilt_that_stays_and_one_that_grows() {
        assert!(turn_across([0.03, 0.01], [0.03, 0.01], 2.0).iter().all(|turn| turn.abs() < 1e-18));
        let grow = |angle_rad| {
            (0..1000).fold([0.0; 2], |sum: [f64; 2], step| {
                let at = |step: i32| [-2e-5 * f64::from(step), 0.0];
                let turn = turn_across(at(step), at(step + 1), angle_rad);
                [sum[0] + turn[0], sum[1] + turn[1]]
            })
        };
        let turned = 0.02_f64.atan();
        let (ahead, clockwise) = (grow(0.0), grow(0.25 * TAU));
        assert!(ahead[0].abs() < 1e-15 && (ahead[1] / turned - 1.0).abs() < 1e-8, "{ahead:?}");
        // Turned clockwise by a quarter, the rotor's first axis points to -y.
        assert!((clockwise[0] / -turned - 1.0).abs() < 1e-8 && clockwise[1].abs() < 1e-9, "{clockwise:?}");
    }

    /// A rotor that wobbles and turns at once: its rotation, written down from slopes and angle, gives the rate in the
    /// rotor's axes by differences, `R' dR`.
    #[test]
    fn dual_body_rates_from_the_rotation_itself() {
        let state = |t: f64| {
            let sine = |x: f64| math::sin_cos(x).0;
            let slopes = [0.02 * sine(7.0 * t) + 0.01, 0.03 * sine(5.0 * t + 2.5)];
            (slopes, 0.8 * t + 0.2 * sine(11.0 * t))
        };
        let rotation = |t: f64| {
            let ([x, y], angle_rad) = state(t);
            let tilted = Rotation3::rotation_between(&Vector3::z(), &Vector3::new(-x, -y, 1.0)).unwrap();
            tilted * Rotation3::from_axis_angle(&Vector3::z_axis(), -angle_rad)
        };
        let step = 1e-4;
        for at in 0..100 {
            let t = 0.05 * f64::from(at);
            let (from, until) = (state(t), state(t + step));
            let turn = turn_across(from.0, until.0, 0.5 * (from.1 + until.1));
            let seen = (rotation(t).inverse() * rotation(t + step)).scaled_axis();
            // The third order of a step of 1e-4 s at rates of a few rad/s.
            for axis in [0, 1] {
                assert!((turn[axis] - seen[axis]).abs() < 1e-10, "{t} {turn:?} {seen:?}");
            }
        }
    }
}
