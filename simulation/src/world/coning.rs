//! Coning: by how much the angle that a camera sees from above and the integral of the rate about the rotor's own axis
//! differ.
//!
//! The rotor stands as if turned by `a` round the vertical and then tilted, without a turn round the vertical, until
//! its axis is n ([`crate::world::pose`]). A camera from above sees `a`. A gyroscope on the rotor senses its rate about
//! n:
//!
//! ```text
//! w . n = a' - (1 - cos e) f'       e: angle of n from the vertical,  f: direction of the tilt round the vertical
//! ```
//!
//! The second term is the rate at which the great circle from the vertical to n sweeps solid angle on the unit sphere
//! (Goodman and Robinson, J. Appl. Mech. 25 (1958) 210-213). When n has come back, the integrals differ by the solid
//! angle that it went round: `2 pi (1 - cos e)` for each turn on a cone. A tilt that turns with the rotor (f' = a')
//! makes a gyroscope read by the factor `cos e` too little, 480 ppm at 31 mrad. A tilt whose direction stays in space
//! changes nothing.
//!
//! Slopes are the gnomonic projection of n, in which great circles are straight. So between two states of which the
//! slopes change in proportion the solid angle is that of a spherical triangle, exactly, with `s = sqrt(1 + eta^2)`:
//!
//! ```text
//! solid angle = 2 atan2(eta_0 x eta_1, s_0 s_1 + s_0 + s_1 + 1 + eta_0 . eta_1)
//! ```
//!
//! counter-clockwise positive (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125-126).

use motor_model::math;

/// Solid angle in sr that the tilt sweeps on the way from one pair of slopes to another, counter-clockwise positive:
/// the change of the angle seen from above less the integral of the rate about the rotor's own axis.
#[must_use]
pub fn solid_angle([x_0, y_0]: [f64; 2], [x_1, y_1]: [f64; 2]) -> f64 {
    let s = |x: f64, y: f64| math::sqrt(1.0 + x * x + y * y);
    let (s_0, s_1) = (s(x_0, y_0), s(x_1, y_1));
    let across = x_0 * y_1 - y_0 * x_1;
    2.0 * math::atan2(across, s_0 * s_1 + s_0 + s_1 + 1.0 + x_0 * x_1 + y_0 * y_1)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Unit, Vector3};
    use std::f64::consts::TAU;

    use super::*;

    fn slopes_on_a_cone(slope: f64, direction_rad: f64) -> [f64; 2] {
        let (s, c) = math::sin_cos(direction_rad);
        [slope * c, slope * s]
    }

    /// A turn on a cone of the angle e: `2 pi (1 - cos e)`, the polygon of great circles through n of its points
    /// approaches it as the square of n; backwards it is the negative.
    #[test]
    fn exact_a_turn_on_a_cone_is_its_solid_angle() {
        for slope in [1e-3, 0.031, 0.5, 3.0_f64] {
            let cone = TAU * (1.0 - 1.0 / math::sqrt(1.0 + slope * slope));
            for sense in [1.0, -1.0] {
                let sum = |points: u32| -> f64 {
                    let at = |j: u32| slopes_on_a_cone(slope, sense * TAU * f64::from(j) / f64::from(points));
                    (0..points).map(|j| solid_angle(at(j), at(j + 1))).sum()
                };
                let [coarse, fine] = [1000, 4000].map(|points| sense * sum(points) / cone - 1.0);
                assert!(
                    fine.abs() < 1e-5 && (fine / coarse * 16.0 - 1.0).abs() < 0.02,
                    "{slope} {coarse} {fine}"
                );
            }
        }
    }

    /// The solid angle of an octant is an eighth of the sphere.
    #[test]
    fn exact_an_octant_and_a_straight_way() {
        let far = 1e9;
        assert!((solid_angle([far, 0.0], [0.0, far]) - 0.125 * 2.0 * TAU).abs() < 1e-8);
        assert!(solid_angle([0.01, 0.02], [0.03, 0.06]).abs() < 1e-17);
    }

    /// A rotor that turns at a steady rate about its own axis while that goes round a cone: its rotation is integrated
    /// from body rates alone, by rotations of tiny steps, and then seen from above. The angle seen differs from the
    /// integral of the rate by the solid angle.
    #[test]
    fn dual_coning_of_an_integrated_rotation() {
        let (tilt_rad, steps, spin_rad): (f64, u32, f64) = (0.3, 20_000, 5.0);
        let (s_tilt, c_tilt) = math::sin_cos(tilt_rad);
        let axis_at = |direction_rad: f64| {
            let (s, c) = math::sin_cos(direction_rad);
            Vector3::new(s_tilt * c, s_tilt * s, c_tilt)
        };
        let begun = |axis: &Vector3<f64>| Rotation3::rotation_between(&Vector3::z(), axis).unwrap();
        let mut rotation = begun(&axis_at(0.0));
        let (turned_rad, round_rad) = (spin_rad / f64::from(steps), 2.5 / f64::from(steps));
        for step in 0..steps {
            let axis = axis_at(round_rad * f64::from(step));
            let next = axis_at(round_rad * f64::from(step + 1));
            // First about its own axis, then the axis moves on along a great circle: no rate about the axis itself.
            let spin = Rotation3::from_axis_angle(&Unit::new_normalize(axis), turned_rad);
            rotation = Rotation3::rotation_between(&axis, &next).unwrap() * spin * rotation;
        }
        let seen = begun(&axis_at(2.5)).inverse() * rotation;
        let seen_rad = math::atan2(seen[(1, 0)], seen[(0, 0)]);
        let slopes = |direction_rad| slopes_on_a_cone(-s_tilt / c_tilt, direction_rad);
        let swept: f64 = (0..steps)
            .map(|step| [step, step + 1].map(|step| slopes(round_rad * f64::from(step))))
            .map(|[from, until]| solid_angle(from, until))
            .sum();
        let off_rad = seen_rad + TAU - spin_rad - swept;
        assert!((off_rad - TAU * (off_rad / TAU).round()).abs() < 1e-9, "{off_rad}");
        assert!((swept - 2.5 * (1.0 - c_tilt)).abs() < 1e-8, "{swept}");
    }
}
