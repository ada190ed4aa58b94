//! The pin, met by the upper and the lower edge of the rotor's hole.
//!
//! Pin radius `r_h`, radius of the hole `a = r_h + c`. At the edge at level `s = +-l_h/2` from the mass centre the
//! hole's centre lies at `d = (x, y) - s eta` from the pin. Seen along the pin the edge is an ellipse, and
//!
//! ```text
//! gap = c - |d| - (a/2) (eta . d/|d|)^2
//! ```
//!
//! The pin pushes along the gradient of this gap, `-d/|d|` turned by `e = a (eta . d/|d|) (eta . t)/|d|`, where `t` is
//! `d/|d|` turned by 90 degrees. That line meets both the pin's axis and the rotor's, so the push does not turn the
//! rotor. Along the surface friction acts counter-clockwise and up, at the arm `r_h n - (x, y)` and the height
//! `s - a eta . d/|d|`.
//!
//! In the middle of the hole both edges meet the pin at once, at the tilt `eta_c` of the *tilt stop*:
//!
//! ```text
//! (l_h/2) eta_c + (a/2) eta_c^2 = c
//! ```
//!
//! A pin that leans has a slope of its own: `eta` is then relative to it in `d` and in the gap.

use nalgebra::Vector2;

use super::TiltingMotion;
use super::contact::{Contact, ContactPlace, Direction, Mobility};
use super::rigid_body::Twist;
use crate::math::{self, Real};
use crate::params::{TiltingParameter, TiltingParams};

/// Largest turn of the normal by the edge's ellipse, in rad. It is small where the gap's equation holds.
const NORMAL_TURN_MAX: f64 = 0.3;
/// Distance below which the direction from the pin to the hole's centre is not defined, in m.
const NO_DIRECTION_M: f64 = 1e-15;

/// Pin and hole of one motor.
#[derive(Clone, Debug)]
pub(super) struct Hub<T> {
    pub(super) clearance_m: T,
    pub(super) half_length_m: T,
    pub(super) hole_radius_m: T,
    pub(super) pin_radius_m: T,
    pub(super) pin_slope: Vector2<T>,
    pub(super) friction: T,
    pub(super) restitution: T,
}

/// An edge of the hole, as it lies about the pin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<T> {
    pub(super) gap_m: T,
    /// `n`: away from the pin's axis, where the pin is met.
    pub(super) normal: Vector2<T>,
    /// Height of the contact above the mass centre.
    pub(super) height_m: T,
}

impl<T: Real> Hub<T> {
    pub(super) fn new(tilting: &TiltingParams, pin_direction_deg: f64) -> Self {
        use TiltingParameter::{
            HubClearance, HubFriction, HubLength, HubPinRadius, HubRestitution, PinSlope,
        };
        let get = |parameter| T::from_f64(tilting.get(parameter));
        let (sin, cos) = math::sin_cos(pin_direction_deg.to_radians());
        let lean = tilting.get(PinSlope);
        Self {
            clearance_m: get(HubClearance),
            half_length_m: T::from_f64(0.5) * get(HubLength),
            hole_radius_m: T::from_f64(tilting.get(HubPinRadius) + tilting.get(HubClearance)),
            pin_radius_m: get(HubPinRadius),
            // A pin that leans towards x has the plane square to it fall towards x.
            pin_slope: -Vector2::new(T::from_f64(lean * cos), T::from_f64(lean * sin)),
            friction: get(HubFriction),
            restitution: get(HubRestitution),
        }
    }

    /// `s` of an edge.
    #[inline]
    fn level_m(&self, place: ContactPlace) -> T {
        if place == ContactPlace::UpperEdge { self.half_length_m } else { -self.half_length_m }
    }

    /// The edge at `place`.
    #[inline]
    pub(super) fn edge(&self, place: ContactPlace, motion: &TiltingMotion<T>) -> Edge<T> {
        let level = self.level_m(place);
        let eta = motion.tilt.slope - self.pin_slope;
        let d = motion.shift.displacement_m - eta * level;
        let distance = d.dot(&d).sqrt();
        // 0 where there is no direction: then along x, and not turned.
        let (away, per_distance) = if distance > T::from_f64(NO_DIRECTION_M) {
            let per_distance = T::one() / distance;
            (d * per_distance, per_distance)
        } else {
            (Vector2::new(T::one(), T::zero()), T::zero())
        };
        let (along, across) = (eta.dot(&away), eta.y * away.x - eta.x * away.y);
        let bend = self.hole_radius_m * along;
        let gap_m = self.clearance_m - distance - T::from_f64(0.5) * bend * along;
        // -(d/|d| + e t), made a unit vector to the fourth order.
        let most = T::from_f64(NORMAL_TURN_MAX) * distance;
        let turn = (bend * across).clamp_magnitude(most) * per_distance;
        let half_square = T::from_f64(0.5) * turn * turn;
        let scale = T::one() - half_square * (T::one() - T::from_f64(1.5) * half_square);
        let normal = Vector2::new(-away.x + turn * away.y, -away.y - turn * away.x) * scale;
        Edge { gap_m, normal, height_m: level - bend }
    }

    /// Rate at which the gap opens.
    #[inline]
    pub(super) fn gap_rate_m_s(edge: &Edge<T>, motion: &TiltingMotion<T>) -> T {
        edge.normal.dot(&motion.shift.velocity_m_s) - edge.height_m * edge.normal.dot(&motion.tilt.rate_rad_s)
    }

    /// The contact of an edge.
    pub(super) fn contact(
        &self,
        place: ContactPlace,
        edge: &Edge<T>,
        motion: &TiltingMotion<T>,
        mobility: &Mobility<T>,
    ) -> Contact<T> {
        let Edge { gap_m, normal, height_m } = *edge;
        let zero = T::zero();
        let open = Twist { rise: zero, turn: zero, shift: normal, slope: normal * -height_m };
        let arm = (normal * self.pin_radius_m - motion.shift.displacement_m, height_m);
        let round = Vector2::new(-normal.y, normal.x);
        let eta = &motion.tilt.slope;
        let along = |way| Direction::at_rest(Twist::of_point(arm, way, eta), mobility);
        Contact {
            place,
            normal: Direction::at_rest(open, mobility),
            along: [along((round, zero)), along((Vector2::zeros(), T::one()))],
            friction: self.friction,
            restitution: self.restitution,
            gap_m,
        }
    }
}
