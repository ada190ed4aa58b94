//! The rotor in flight: ballistic, with squeeze-film damping and drag, exact over a step.
//!
//! ```text
//! m_r v_z' = -m_r g - b_z v_z,   J rate' = -b_th R_t^2 rate                            (14a, 14b)
//! ```
//!
//! With `x = b_z h / m_r`, `m1 = (1 - exp(-x)) / x` and `m2 = (x - 1 + exp(-x)) / x^2`:
//!
//! ```text
//! v(t + h) = v + (exp(-x) - 1) v - g h m1
//! z(t + h) = z + h m1 v - g h^2 m2
//! ```
//!
//! and likewise for rate and angle. `m1` and `m2` are smooth through `x = 0` (1 and 1/2: the parabola) and for large
//! `x` (terminal speed).

use crate::angle::AngleAccumulator;
use crate::decay::decay_means;
use crate::math::{self, Real};
use crate::params::{MotorParams, Parameter};

/// The rotor's motion: the rotor rows of [`crate::MotorState`]'s table. Upward and clockwise are positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorState<T> {
    /// Height of the rotor's underside above the teeth of the stator at rest, in m.
    pub height_m: T,
    /// Vertical velocity in m/s.
    pub velocity_m_s: T,
    /// Angle turned.
    pub angle: AngleAccumulator<T>,
    /// Angular rate in rad/s.
    pub rate_rad_s: T,
}

/// A sudden change of the rotor's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorJump<T> {
    /// Of the height, in m: 0 except where a rotor is put back on a tooth.
    pub height_m: T,
    /// Of the vertical velocity, in m/s.
    pub velocity_m_s: T,
    /// Of the angular rate, in rad/s.
    pub rate_rad_s: T,
}

/// Exact flight over one step, and over parts of it.
#[derive(Clone, Debug)]
pub struct Flight<T> {
    step: FlightSpan<T>,
    /// `x` of a step.
    decay: T,
    /// The same for the rate.
    rate_decay: T,
    damping_per_s: T,
    gravity_m_s2: T,
    step_s: T,
}

/// Exact flight over some time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlightSpan<T> {
    /// `exp(-x) - 1`.
    velocity_loss: T,
    gravity_m_s2: T,
    /// `h m1`: velocity gained per acceleration, height per velocity.
    pub(crate) rise_s: T,
    /// `h^2 m2`: height gained per acceleration.
    pub(crate) sweep_s2: T,
    rate_loss: T,
    /// Angle gained per rate, in units of 2^-32 turn.
    turn_units_per_rad_s: T,
}

impl<T: Real> FlightSpan<T> {
    /// Advances the rotor without contact.
    #[inline]
    pub(crate) fn advance(&self, rotor: &mut RotorState<T>) {
        let (v, rate) = (rotor.velocity_m_s, rotor.rate_rad_s);
        rotor.height_m += self.rise_s * v - self.sweep_s2 * self.gravity_m_s2;
        rotor.velocity_m_s += self.velocity_loss * v - self.rise_s * self.gravity_m_s2;
        rotor.angle.advance(self.turn_units_per_rad_s * rate);
        rotor.rate_rad_s += self.rate_loss * rate;
    }

    /// Adds the response to a jump at the start of this time.
    #[inline]
    pub(crate) fn add_jump(&self, rotor: &mut RotorState<T>, jump: &RotorJump<T>) {
        rotor.height_m += jump.height_m + self.rise_s * jump.velocity_m_s;
        rotor.velocity_m_s += jump.velocity_m_s + self.velocity_loss * jump.velocity_m_s;
        rotor.angle.advance(self.turn_units_per_rad_s * jump.rate_rad_s);
        rotor.rate_rad_s += jump.rate_rad_s + self.rate_loss * jump.rate_rad_s;
    }
}

impl<T: Real> Flight<T> {
    /// Flight of `params`' rotor over `step_s`.
    pub fn new(params: &MotorParams, step_s: f64) -> Self {
        let damping_per_s = params.get(Parameter::VerticalDamping) / params.get(Parameter::RotorMass);
        let gravity_m_s2 = T::from_f64(params.get(Parameter::Gravity));
        let (x, y) = (damping_per_s * step_s, tangential_damping_per_s(params) * step_s);
        let turning_s = step_s * math::decay_mean(y);
        Self {
            step: FlightSpan {
                velocity_loss: T::from_f64(math::exp_m1(-x)),
                gravity_m_s2,
                rise_s: T::from_f64(step_s * math::decay_mean(x)),
                sweep_s2: T::from_f64(step_s * step_s * math::decay_second_mean(x)),
                rate_loss: T::from_f64(math::exp_m1(-y)),
                turn_units_per_rad_s: T::from_f64(turning_s * AngleAccumulator::<f64>::UNITS_PER_RADIAN),
            },
            decay: T::from_f64(x),
            rate_decay: T::from_f64(y),
            damping_per_s: T::from_f64(damping_per_s),
            gravity_m_s2,
            step_s: T::from_f64(step_s),
        }
    }

    /// Advances the rotor by one step without contact.
    #[inline]
    pub fn advance(&self, rotor: &mut RotorState<T>) {
        self.step.advance(rotor);
    }

    /// Flight over the fraction `part` of a step; no transcendental call.
    pub(crate) fn part(&self, part: T) -> FlightSpan<T> {
        let span_s = self.step_s * part;
        let (velocity_loss, m1, m2) = decay_means(self.decay * part);
        let (rate_loss, turning, _) = decay_means(self.rate_decay * part);
        FlightSpan {
            velocity_loss,
            gravity_m_s2: self.gravity_m_s2,
            rise_s: span_s * m1,
            sweep_s2: span_s * span_s * m2,
            rate_loss,
            turn_units_per_rad_s: span_s * turning * T::from_f64(AngleAccumulator::<f64>::UNITS_PER_RADIAN),
        }
    }

    /// Vertical acceleration in flight, in m/s^2.
    #[inline]
    pub(crate) fn acceleration(&self, rotor: &RotorState<T>) -> T {
        -self.gravity_m_s2 - self.damping_per_s * rotor.velocity_m_s
    }
}

/// Decay rate of the rotation, `b_th R_t^2 / J` (14b).
pub(crate) fn tangential_damping_per_s(params: &MotorParams) -> f64 {
    let radius = params.get(Parameter::ToothRadius);
    params.get(Parameter::TangentialDrag) * radius * radius / params.get(Parameter::RotorInertia)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    fn params(damping: f64, drag: f64) -> MotorParams {
        MotorParams::nominal()
            .with(Parameter::VerticalDamping, damping)
            .and_then(|p| p.with(Parameter::TangentialDrag, drag))
            .unwrap()
    }

    fn flown(damping: f64, drag: f64, step_s: f64, steps: u32) -> RotorState<f64> {
        let flight = Flight::new(&params(damping, drag), step_s);
        let mut rotor =
            RotorState { height_m: 1e-3, velocity_m_s: 0.2, rate_rad_s: 12.0, ..RotorState::default() };
        for _ in 0..steps {
            flight.advance(&mut rotor);
        }
        rotor
    }

    /// Height, velocity, rate and angle after 10 ms against the closed form, at steps that differ 100 times.
    #[test]
    fn exact_flight_for_any_step_and_damping() {
        let time_s: f64 = 0.01;
        for (damping, drag) in [(0.0, 0.0), (1e-12, 1e-14), (3.6e-3, 4.3e-11), (0.5, 1e-3), (1e3, 1e3)] {
            let k = damping / 46e-6;
            let (decay, mean, second) =
                (math::exp(-k * time_s), math::decay_mean(k * time_s), math::decay_second_mean(k * time_s));
            let height = 1e-3 + time_s * mean * 0.2 - 9.81 * time_s * time_s * second;
            let velocity = decay * 0.2 - 9.81 * time_s * mean;
            let turning = tangential_damping_per_s(&params(damping, drag)) * time_s;
            let rate = 12.0 * math::exp(-turning);
            let angle_rad = 12.0 * time_s * math::decay_mean(turning);
            for (step_s, steps) in [(1e-6, 10_000), (1e-4, 100)] {
                let rotor = flown(damping, drag, step_s, steps);
                assert!((rotor.height_m - height).abs() < 1e-13, "{damping} {step_s}");
                assert!((rotor.velocity_m_s - velocity).abs() < 1e-12, "{damping} {step_s}");
                assert!((rotor.rate_rad_s - rate).abs() < 1e-10 * 12.0, "{drag} {step_s}");
                let turned = rotor.angle.angle().degrees().to_radians();
                assert!(
                    (turned - angle_rad).abs() < 2.0 * TAU / 4_294_967_296.0,
                    "{drag} {step_s} {turned} {angle_rad}"
                );
            }
        }
    }

    #[test]
    fn law_terminal_speed_is_weight_over_damping() {
        let rotor = flown(3.6e-3, 0.0, 1e-4, 10_000);
        assert!((rotor.velocity_m_s + 46e-6 * 9.81 / 3.6e-3).abs() < 1e-12);
    }
}
