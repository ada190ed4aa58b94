//! The rotor as a rigid body that tilts, shifts and spins, in flight.
//!
//! The slopes `eta = (eta_x, eta_y)` of its plane say where its axis points: `n = (-eta_x, -eta_y, 1)`, to first order.
//! Its spin is about that axis. With `p = eta'`, the spin `W` counter-clockwise and the shift `(x, y)` of the mass
//! centre:
//!
//! ```text
//! I p' = -b_t p + i J W p      p = p_x + i p_y,    I = J/2 + m_r h_r^2/12,    b_t = k_t b_z (R_r^2 + r_h^2)/4
//! m_r (x, y)'' = 0             height and spin: as in (14a, b)
//! ```
//!
//! So `p` turns with the spin at `J W / I`, nearly twice the spin's rate, and decays with `b_t / I`. Over a span `h`
//! both are exact; the slopes are exact to `b_t J W h^2 / (12 I^2)`, relatively:
//!
//! ```text
//! p <- exp(-b h) R(y) p,    eta += h m1(b h) (sin(y/2) / (y/2)) R(y/2) p     b = b_t/I,  y = J W h/I,  R: rotation
//! ```

use nalgebra::Vector2;

use super::Freedom;
use crate::decay::decay_means;
use crate::math::{self, Real};
use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};
use crate::phase::sin_cos_of_turns;

/// Slopes of the rotor's plane along x and y: the tilt rows of [`super::TiltingState`]'s table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltState<T> {
    /// `eta`: rise of the underside per distance along x and y.
    pub slope: Vector2<T>,
    /// `eta'` in rad/s.
    pub rate_rad_s: Vector2<T>,
}

/// Shift of the rotor's mass centre from the stator's axis: the shift rows of [`super::TiltingState`]'s table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShiftState<T> {
    /// `(x, y)` in m.
    pub displacement_m: Vector2<T>,
    /// Its rate in m/s.
    pub velocity_m_s: Vector2<T>,
}

impl<T: Real> Default for TiltState<T> {
    fn default() -> Self {
        Self { slope: Vector2::zeros(), rate_rad_s: Vector2::zeros() }
    }
}

impl<T: Real> Default for ShiftState<T> {
    fn default() -> Self {
        Self { displacement_m: Vector2::zeros(), velocity_m_s: Vector2::zeros() }
    }
}

/// `I = J/2 + m_r h_r^2/12`: inertia of the rotor about a diameter, in kg m^2.
pub(super) fn transverse_inertia_kg_m2(params: &MotorParams, tilting: &TiltingParams) -> f64 {
    let thickness = tilting.get(TiltingParameter::RotorThickness);
    params.get(Parameter::RotorInertia) / 2.0
        + params.get(Parameter::RotorMass) * thickness * thickness / 12.0
}

/// `b_t`: torque of the film per rate of tilt, in N m s.
pub(super) fn tilt_damping_n_m_s(params: &MotorParams, tilting: &TiltingParams) -> f64 {
    let (outer, inner) =
        (tilting.get(TiltingParameter::RotorOuterRadius), tilting.get(TiltingParameter::HubPinRadius));
    tilting.get(TiltingParameter::TiltDampingFactor)
        * params.get(Parameter::VerticalDamping)
        * (outer * outer + inner * inner)
        / 4.0
}

/// Flight of tilt and shift over some time.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeanSpan<T> {
    span_s: T,
    /// `exp(-b h)`.
    decay: T,
    /// `h m1(b h)`: slope gained per rate.
    rise_s: T,
    /// `-J h / (2 I)`: half the turn of `p` per clockwise rate.
    half_turn_s: T,
}

/// Below this half turn a series gives sine and cosine to the last bit.
const SMALL_RAD: f64 = 5e-3;

impl<T: Real> LeanSpan<T> {
    /// Advances tilt and shift while the rotor spins clockwise at `rate_rad_s`.
    #[inline]
    pub(super) fn advance<const SHIFTS: bool>(
        &self,
        tilt: &mut TiltState<T>,
        shift: &mut ShiftState<T>,
        rate_rad_s: T,
    ) {
        let half = self.half_turn_s * rate_rad_s;
        let (sin, cos) = sin_cos_of_half_turn(half);
        let p = tilt.rate_rad_s;
        let middle = Vector2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y);
        // sin(y/2) / (y/2) to the fourth order.
        let mean = self.rise_s * (T::one() - half * half * T::from_f64(1.0 / 6.0));
        tilt.slope += middle * mean;
        tilt.rate_rad_s =
            Vector2::new(cos * middle.x - sin * middle.y, sin * middle.x + cos * middle.y) * self.decay;
        if SHIFTS {
            shift.displacement_m += shift.velocity_m_s * self.span_s;
        }
    }
}

/// Sine and cosine of half the turn of `p` in a span.
#[inline]
fn sin_cos_of_half_turn<T: Real>(x: T) -> (T, T) {
    if x.abs() < T::from_f64(SMALL_RAD) {
        let n = T::from_f64;
        let x2 = x * x;
        let sin = x * (T::one() - x2 * n(1.0 / 6.0) * (T::one() - x2 * n(1.0 / 20.0)));
        (sin, T::one() - x2 * n(0.5) * (T::one() - x2 * n(1.0 / 12.0)))
    } else {
        fast_turn(x)
    }
}

/// The same for a fast spin; beyond a thousand turns a span it stays finite.
#[inline(never)]
fn fast_turn<T: Real>(x: T) -> (T, T) {
    sin_cos_of_turns((x * T::from_f64(1.0 / core::f64::consts::TAU)).clamp_magnitude(T::from_f64(1000.0)))
}

/// Flight of tilt and shift over one step and over parts of it.
#[derive(Clone, Debug)]
pub(super) struct LeanFlight<T> {
    pub(super) step: LeanSpan<T>,
    /// `b h` of a step.
    decay: T,
    step_s: T,
    half_turn_s: T,
}

impl<T: Real> LeanFlight<T> {
    pub(super) fn new(params: &MotorParams, tilting: &TiltingParams, step_s: f64) -> Self {
        let inertia = transverse_inertia_kg_m2(params, tilting);
        let decay = tilt_damping_n_m_s(params, tilting) / inertia * step_s;
        let half_turn_s = T::from_f64(-0.5 * params.get(Parameter::RotorInertia) / inertia * step_s);
        Self {
            step: LeanSpan {
                span_s: T::from_f64(step_s),
                decay: T::from_f64(math::exp(-decay)),
                rise_s: T::from_f64(step_s * math::decay_mean(decay)),
                half_turn_s,
            },
            decay: T::from_f64(decay),
            step_s: T::from_f64(step_s),
            half_turn_s,
        }
    }

    /// Flight over the fraction `part` of a step; no transcendental call.
    pub(super) fn part(&self, part: T) -> LeanSpan<T> {
        let (loss, mean, _) = decay_means(self.decay * part);
        let span_s = self.step_s * part;
        LeanSpan {
            span_s,
            decay: T::one() + loss,
            rise_s: span_s * mean,
            half_turn_s: self.half_turn_s * part,
        }
    }
}

/// A motion of the rotor, or what acts along one: rise, clockwise turn, shift of the mass centre, change of slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Twist<T> {
    pub(super) rise: T,
    pub(super) turn: T,
    pub(super) shift: Vector2<T>,
    pub(super) slope: Vector2<T>,
}

impl<T: Real> Twist<T> {
    /// No motion.
    pub(super) fn zero() -> Self {
        let zero = T::zero();
        Self { rise: zero, turn: zero, shift: Vector2::zeros(), slope: Vector2::zeros() }
    }

    /// How a point at `arm` (x and y, then height) from the mass centre moves along `(across, up)`, per motion of a
    /// rotor with the slopes `eta`.
    #[inline]
    pub(super) fn of_point(
        (arm, height): (Vector2<T>, T),
        (across, up): (Vector2<T>, T),
        eta: &Vector2<T>,
    ) -> Self {
        let slope = arm * up - across * height;
        // The spin is about the tilted axis.
        let counter_clockwise = cross(&arm, &across) - cross(eta, &slope);
        Self { rise: up, turn: -counter_clockwise, shift: across, slope }
    }

    /// Speed along this of a rotor that moves with `motion`.
    #[inline]
    pub(super) fn dot(&self, motion: &Self) -> T {
        self.rise * motion.rise
            + self.turn * motion.turn
            + (self.shift.x * motion.shift.x + self.shift.y * motion.shift.y)
            + (self.slope.x * motion.slope.x + self.slope.y * motion.slope.y)
    }
}

/// `a_x b_y - a_y b_x`.
#[inline]
pub(super) fn cross<T: Real>(a: &Vector2<T>, b: &Vector2<T>) -> T {
    a.x * b.y - a.y * b.x
}

/// Motion of the rotor per impulse along each of its coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotorMobility<T> {
    pub(super) rise: T,
    pub(super) turn: T,
    /// 0 where the shift is left out.
    pub(super) shift: T,
    /// 0 where tilt is left out.
    pub(super) slope: T,
}

impl<T: Real> RotorMobility<T> {
    pub(super) fn new(params: &MotorParams, tilting: &TiltingParams, freedom: Freedom) -> Self {
        let per_mass = 1.0 / params.get(Parameter::RotorMass);
        let (shift, slope) = match freedom {
            Freedom::Full => (per_mass, 1.0 / transverse_inertia_kg_m2(params, tilting)),
            Freedom::WithoutShift => (0.0, 1.0 / transverse_inertia_kg_m2(params, tilting)),
            Freedom::HeightOnly => (0.0, 0.0),
        };
        Self {
            rise: T::from_f64(per_mass),
            turn: T::from_f64(1.0 / params.get(Parameter::RotorInertia)),
            shift: T::from_f64(shift),
            slope: T::from_f64(slope),
        }
    }

    /// The motion that a unit impulse along `direction` causes.
    #[inline]
    pub(super) fn response(&self, direction: &Twist<T>) -> Twist<T> {
        Twist {
            rise: self.rise * direction.rise,
            turn: self.turn * direction.turn,
            shift: direction.shift * self.shift,
            slope: direction.slope * self.slope,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pressure that is spread evenly over the rotor's ring resists a tilt by the mean square of the distance from
    /// the axis of tilt, times the damping of the height: here by a sum over rings, of each of which it is half of the
    /// radius squared.
    #[test]
    fn dual_tilt_is_damped_by_an_evenly_spread_pressure() {
        let (params, tilting) = (MotorParams::nominal(), TiltingParams::nominal());
        let [outer, inner] = [TiltingParameter::RotorOuterRadius, TiltingParameter::HubPinRadius]
            .map(|parameter| tilting.get(parameter));
        let (mut moment, mut area) = (0.0, 0.0);
        for ring in 0..100_000 {
            let r = inner + (outer - inner) * (f64::from(ring) + 0.5) / 1e5;
            (moment, area) = (moment + r * (0.5 * r * r), area + r);
        }
        let expected = params.get(Parameter::VerticalDamping) * moment / area;
        let own = tilt_damping_n_m_s(&params, &tilting);
        assert!((own / expected - 1.0).abs() < 1e-9, "{own:e} {expected:e}");
    }
}
