//! Optional surfaces that the tilted rotor meets with a circle: a floor under its rim, and a ceiling.
//!
//! ```text
//! rim      gap = z - R |eta| + depth         the lowest point, against the slope
//! ceiling  gap = height - z - R |eta|        the highest point, along the slope
//! ```

use nalgebra::Vector2;

use super::TiltingMotion;
use super::contact::{Contact, ContactPlace, Direction, Mobility};
use super::rigid_body::Twist;
use crate::math::Real;
use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};

/// A plane surface that stands still.
#[derive(Clone, Debug)]
pub(super) struct Stop<T> {
    place: ContactPlace,
    /// +1 for a floor, -1 for a ceiling.
    sign: T,
    /// Distance from the rotor at rest.
    pub(super) distance_m: T,
    pub(super) radius_m: T,
    /// Height of the circle above the mass centre.
    level_m: T,
    friction: T,
    restitution: T,
}

/// Distances from which on there is no such surface.
const NONE_M: f64 = 1.0;

impl<T: Real> Stop<T> {
    /// Those of rim and ceiling that there are.
    pub(super) fn both(params: &MotorParams, tilting: &TiltingParams) -> [Option<Self>; 2] {
        use TiltingParameter::{CeilingHeight, CeilingRadius, RimDepth, RotorOuterRadius};
        [
            Self::new(ContactPlace::Rim, 1.0, RimDepth, RotorOuterRadius, params, tilting),
            Self::new(ContactPlace::Ceiling, -1.0, CeilingHeight, CeilingRadius, params, tilting),
        ]
    }

    fn new(
        place: ContactPlace,
        sign: f64,
        distance: TiltingParameter,
        radius: TiltingParameter,
        params: &MotorParams,
        tilting: &TiltingParams,
    ) -> Option<Self> {
        let distance_m = tilting.get(distance);
        let half_thickness = 0.5 * tilting.get(TiltingParameter::RotorThickness);
        (distance_m < NONE_M).then(|| Self {
            place,
            sign: T::from_f64(sign),
            distance_m: T::from_f64(distance_m),
            radius_m: T::from_f64(tilting.get(radius)),
            level_m: T::from_f64(-sign * half_thickness),
            friction: T::from_f64(tilting.get(TiltingParameter::CeilingFriction)),
            restitution: T::from_f64(params.get(Parameter::Restitution)),
        })
    }

    /// The side that is nearest, as a unit vector; zero for a level rotor.
    #[inline]
    fn nearest(&self, motion: &TiltingMotion<T>) -> Vector2<T> {
        let eta = motion.tilt.slope;
        let steepness = eta.dot(&eta).sqrt();
        if steepness > T::zero() { eta * (-self.sign / steepness) } else { Vector2::zeros() }
    }

    #[inline]
    pub(super) fn gap_m(&self, motion: &TiltingMotion<T>) -> T {
        let eta = motion.tilt.slope;
        self.distance_m + self.sign * motion.rotor.height_m - self.radius_m * eta.dot(&eta).sqrt()
    }

    #[inline]
    pub(super) fn gap_rate_m_s(&self, motion: &TiltingMotion<T>) -> T {
        let arm = self.nearest(motion) * self.radius_m;
        self.sign * (motion.rotor.velocity_m_s + motion.tilt.rate_rad_s.dot(&arm))
    }

    pub(super) fn contact(&self, motion: &TiltingMotion<T>, mobility: &Mobility<T>) -> Contact<T> {
        let (zero, one) = (T::zero(), T::one());
        let side = self.nearest(motion);
        let arm = side * self.radius_m;
        let open = Twist { rise: self.sign, turn: zero, shift: Vector2::zeros(), slope: arm * self.sign };
        // Clockwise and outward; for a level rotor along x and y.
        let (clockwise, outward) = if side.dot(&side) > zero {
            (Vector2::new(side.y, -side.x), side)
        } else {
            (Vector2::new(one, zero), Vector2::new(zero, one))
        };
        let eta = &motion.tilt.slope;
        let along =
            |way| Direction::at_rest(Twist::of_point((arm, self.level_m), (way, zero), eta), mobility);
        Contact {
            place: self.place,
            normal: Direction::at_rest(open, mobility),
            along: [along(clockwise), along(outward)],
            friction: self.friction,
            restitution: self.restitution,
            gap_m: self.gap_m(motion),
        }
    }
}
