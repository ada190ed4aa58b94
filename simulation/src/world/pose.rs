//! How the rotor is shifted and tilted, and what follows for the points of its upper face.
//!
//! Axes: x and y in the plane of the stator, z upwards, from the pin's axis. An angle `a` round z is counter-clockwise
//! positive; the rotor's reported angle is its negative. The upper face is the plane
//!
//! ```text
//! z = z_0 + eta . (X - d),      n = (-eta_x, -eta_y, 1) / s,      s = sqrt(1 + eta^2)
//!
//! d: horizontal place of the face's centre     eta: slopes     n: the rotor's own axis
//! ```
//!
//! # Where a camera from above sees a point
//!
//! The rotor stands as if it had first been turned by `a` round z and then been tilted, without a turn round z, until
//! its axis is n. Seen from above the tilt shortens the direction of steepest slope by `1 / s`. A point of the face at
//! `X` from the centre of a level rotor, turned by `a` already, is seen at
//!
//! ```text
//! p = d + X - (eta . X) eta / (s (s + 1))
//! ```
//!
//! # Vertical velocity
//!
//! The material at the place `X` of a laser's spot moves with the tilt, and round the rotor's own axis, which is not
//! vertical. A rough surface shows the velocity of its material along the beam. With r = X - d, to first order in the
//! slopes, horizontal velocities do not enter:
//!
//! ```text
//! v(X) = v_z + eta' . r + a' (eta_y r_x - eta_x r_y)
//! ```
//!
//! The rotor of the height-only motor is level and centred: all of [`Pose`] is zero. The face of a tilting one lies
//! half its thickness above the mass centre, whose shift the model has: `d = (x, y) - h / 2 eta`.

use motor_model::{Real, TiltingState, math};

/// Shift and tilt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Horizontal place of the upper face's centre in m from the pin's axis, x and y.
    pub shift_m: [f64; 2],
    /// Slopes of the rotor's plane along x and y.
    pub slope: [f64; 2],
    /// Rates of the slopes in 1/s.
    pub slope_rate_s: [f64; 2],
}

/// Where a rotor that tilts is, beside its angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorTilt {
    /// Shift of its mass centre, and tilt.
    pub pose: Pose,
    /// Height of its mass centre in m above that of a rotor at rest on level teeth.
    pub height_m: f64,
}

/// Scalar product.
fn dot([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    a * x + b * y
}

impl Pose {
    /// A rotor that lies level, its axis the pin's.
    pub const LEVEL: Self = Self { shift_m: [0.0; 2], slope: [0.0; 2], slope_rate_s: [0.0; 2] };

    /// That of a tilting motor, at a face that lies `above_centre_m` above the rotor's mass centre.
    #[must_use]
    pub fn of_tilting<T: Real>(state: &TiltingState<T>, above_centre_m: f64) -> Self {
        let (tilt, shift) = (&state.tilt, &state.shift.displacement_m);
        let slope = [tilt.slope.x, tilt.slope.y].map(Real::to_f64);
        let [x, y] = [shift.x, shift.y].map(Real::to_f64);
        Self {
            shift_m: [x - above_centre_m * slope[0], y - above_centre_m * slope[1]],
            slope,
            slope_rate_s: [tilt.rate_rad_s.x, tilt.rate_rad_s.y].map(Real::to_f64),
        }
    }

    /// The angle of the rotor's axis from the vertical in rad, to second order its largest slope.
    #[must_use]
    pub fn tilt_rad(&self) -> f64 {
        math::sqrt(dot(self.slope, self.slope))
    }

    /// Where a camera from above sees the point that stands at `point_m` from the centre of a level rotor.
    #[must_use]
    pub fn seen_from_above(&self, point_m: [f64; 2]) -> [f64; 2] {
        let s = math::sqrt(1.0 + dot(self.slope, self.slope));
        let shortened_m = dot(self.slope, point_m) / (s * (s + 1.0));
        [0, 1].map(|axis| self.shift_m[axis] + point_m[axis] - shortened_m * self.slope[axis])
    }

    /// Vertical velocity in m/s of the material at `spot_m` from the pin's axis, less that of the centre. The rotor
    /// turns at `rate_rad_s`, clockwise positive.
    #[must_use]
    pub fn vertical_velocity(&self, spot_m: [f64; 2], rate_rad_s: f64) -> f64 {
        let [x, y] = [0, 1].map(|axis| spot_m[axis] - self.shift_m[axis]);
        let [slope_x, slope_y] = self.slope;
        dot(self.slope_rate_s, [x, y]) - rate_rad_s * (slope_y * x - slope_x * y)
    }

    /// The sum of this and `weight` times `other`, value by value.
    #[must_use]
    pub fn plus(&self, other: &Self, weight: f64) -> Self {
        let sum = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|axis| a[axis] + weight * b[axis]);
        Self {
            shift_m: sum(self.shift_m, other.shift_m),
            slope: sum(self.slope, other.slope),
            slope_rate_s: sum(self.slope_rate_s, other.slope_rate_s),
        }
    }

    /// The pose that is `part` of the way to `other`.
    #[must_use]
    pub fn between(&self, other: &Self, part: f64) -> Self {
        self.plus(&other.plus(self, -1.0), part)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Unit, Vector3};

    use super::*;

    /// The rotation that brings the vertical to the rotor's axis, without a turn round the vertical.
    fn tilt(slope: [f64; 2]) -> Rotation3<f64> {
        let normal = Vector3::new(-slope[0], -slope[1], 1.0);
        Rotation3::rotation_between(&Vector3::z(), &normal).unwrap()
    }

    /// Beside the rotation itself, as a matrix.
    #[test]
    fn dual_a_tilted_point_is_seen_where_the_rotation_brings_it() {
        for (slope, point_m) in
            [([0.03, 0.0], [3.9e-3, 0.0]), ([-0.4, 0.3], [1e-3, -2e-3]), ([1.0, 2.0], [1e-3, 1e-3])]
        {
            let turned = tilt(slope) * Vector3::new(point_m[0], point_m[1], 0.0);
            let pose = Pose { shift_m: [5e-6, -3e-6], slope, slope_rate_s: [0.0; 2] };
            let seen = pose.seen_from_above(point_m);
            assert!((seen[0] - 5e-6 - turned.x).abs() < 1e-15 && (seen[1] + 3e-6 - turned.y).abs() < 1e-15);
        }
    }

    /// The velocity of a rigid body, `omega x r`, with the tilt's rates as a difference quotient of the rotation: to
    /// first order in slopes of 1e-3, so within 1e-6 of the largest velocity.
    #[test]
    fn dual_vertical_velocity_is_that_of_a_rigid_body() {
        let (slope, slope_rate_s, rate_rad_s) = ([8e-4, -6e-4], [0.3, 0.5], -2.0);
        let pose = Pose { slope, slope_rate_s, ..Pose::LEVEL };
        let height_at = |t_s: f64, point: Vector3<f64>| {
            let slope = [0, 1].map(|axis| slope[axis] + slope_rate_s[axis] * t_s);
            let spin = Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::z()), -rate_rad_s * t_s);
            (tilt(slope) * spin * point).z
        };
        for spot_m in [[3.8e-3, 0.0], [0.0, 3.8e-3], [-2e-3, 1e-3]] {
            // The material that is at the spot at present: the rotation is undone.
            let on_the_face = Vector3::new(spot_m[0], spot_m[1], dot(slope, spot_m));
            let point = tilt(slope).inverse() * on_the_face;
            let dt_s = 1e-7;
            let velocity = (height_at(dt_s, point) - height_at(-dt_s, point)) / (2.0 * dt_s);
            let off = pose.vertical_velocity(spot_m, rate_rad_s) - velocity;
            assert!(off.abs() < 4e-9, "{spot_m:?}: {off:e} of {velocity:e}");
        }
    }

    /// At the axis of a centred rotor nothing of the tilt is seen.
    #[test]
    fn exact_the_centre_shows_its_own_velocity() {
        let pose = Pose { slope: [0.1, 0.2], slope_rate_s: [30.0, -20.0], ..Pose::LEVEL };
        assert!(pose.vertical_velocity([0.0; 2], 15.0).abs() < 1e-30);
        assert_eq!(
            Pose::LEVEL.seen_from_above([1e-3, 2e-3]).map(f64::to_bits),
            [1e-3_f64, 2e-3].map(f64::to_bits)
        );
    }
}
