//! The law of impact: restitution across the contact, momentum shared with the three modes, friction.
//!
//! There is an impact where the gap between a tooth at height `u` and the rotor closes and `u' > v_z`. Newton's
//! restitution
//!
//! ```text
//! v_z+ - u'+ = e (u' - v_z)                                                              (10)
//! ```
//!
//! and the exchange of momentum `m_r dv` with the modes, by which the tooth's velocity jumps by `-r dv`, `r = 3 m_r /
//! m_s` (8b, 12a), give (13a, 13b in one line)
//!
//! ```text
//! dv = v_z+ - v_z = (1 + e) (u' - v_z) / (1 + r)
//! g_A' -= (m_r/m_s) dv,   g_B' -= 2 (m_r/m_s) dv phi_B,   g_C' -= 2 (m_r/m_s) dv phi_C   (7a-c)
//! ```
//!
//! The printed (12b), with `m_r/m_s` for `r`, breaks momentum conservation and does not reproduce the paper's tables.
//!
//! This is with the modal masses `M_A = m_s`, `M_B = M_C = m_s / 2`. For others `r = m_r sum phi_n^2 / M_n` and
//! `g_n' -= (m_r / M_n) dv phi_n`.
//!
//! Friction acts on the slip `s' - v_th` after the normal impulse, with `v_th = R_t rate`. It stops the slip at most
//! and never reverses it.
//!
//! ```text
//! v_th += clamp(s' - v_th, -lim, +lim),   lim = c dv m_r R_t^2 / J                       (11, 13c)
//! c = min(mu, |s / u|)   the paper's law: its angle of contact, tan(alpha) = |s / u|
//! c = mu                 Coulomb's
//! ```

use crate::friction::{Contact, SustainedFriction, sustained_friction};
use crate::math::Real;
use crate::modes::ModalState;
use crate::params::{MotorParams, Parameter};
use crate::rotor::{RotorJump, RotorState};
use crate::teeth::ToothPair;

/// What limits the tangential impulse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrictionLaw {
    /// `mu` times the normal impulse: the default of twin and plant.
    #[default]
    Coulomb,
    /// `min(mu, |s / u|)` times the normal impulse: the paper's (11).
    Paper,
}

/// The record of one impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact<T> {
    /// Which pair of teeth, 0 or 1.
    pub pair: u8,
    /// Time from the impact to the end of its step, in s.
    pub before_end_s: T,
    /// Speed at which tooth and rotor approached, `u' - v_z > 0`, in m/s.
    pub approach_m_s: T,
    /// Normal impulse on the rotor, `m_r dv > 0`, in N s.
    pub normal_impulse_n_s: T,
    /// Slip before friction, `s' - v_th`, in m/s.
    pub slip_m_s: T,
    /// Tangential impulse on the rotor, of the slip's sign, in N s.
    pub tangential_impulse_n_s: T,
    /// Height of the rotor over the tooth when the impact was applied, in m. A negative value is the depth at the end
    /// of the step; for a located impact the value is the error of its location.
    pub gap_m: T,
}

/// The law of impact of one motor.
#[derive(Clone, Debug)]
pub struct ImpactLaw<T> {
    one_plus_restitution: T,
    rotor_mass_kg: T,
    /// `R_t`.
    radius_m: T,
    per_radius: T,
    /// `J / R_t^2`: the rotor's effective mass for a tangential force at the tooth radius.
    tangential_mass_kg: T,
    per_tangential_mass: T,
    friction: T,
    friction_law: FrictionLaw,
}

impl<T: Real> ImpactLaw<T> {
    /// The law of `params`' motor.
    pub fn new(params: &MotorParams, friction_law: FrictionLaw) -> Self {
        let radius = params.get(Parameter::ToothRadius);
        let tangential_mass = params.get(Parameter::RotorInertia) / (radius * radius);
        Self {
            one_plus_restitution: T::from_f64(1.0 + params.get(Parameter::Restitution)),
            rotor_mass_kg: T::from_f64(params.get(Parameter::RotorMass)),
            radius_m: T::from_f64(radius),
            per_radius: T::from_f64(1.0 / radius),
            tangential_mass_kg: T::from_f64(tangential_mass),
            per_tangential_mass: T::from_f64(1.0 / tangential_mass),
            friction: T::from_f64(params.get(Parameter::Friction)),
            friction_law,
        }
    }

    /// `e`.
    #[inline]
    pub(crate) fn restitution(&self) -> T {
        self.one_plus_restitution - T::one()
    }

    /// Applies an impact of `tooth` that approaches at `approach_m_s > 0`, and returns its impulses and slip.
    #[inline]
    pub fn apply(
        &self,
        tooth: &ToothPair<T>,
        approach_m_s: T,
        modes: &mut ModalState<T>,
        rotor: &mut RotorState<T>,
    ) -> Impulse<T> {
        let dv = self.one_plus_restitution * approach_m_s * tooth.share;
        let normal_n_s = self.rotor_mass_kg * dv;
        let slip_m_s = tooth.tangential_velocity(modes) - self.radius_m * rotor.rate_rad_s - tooth.sway * dv;
        let limit_m_s = self.friction_coefficient(tooth, modes) * normal_n_s * self.per_tangential_mass;
        let push_m_s = slip_m_s.clamp_magnitude(limit_m_s);
        let jump =
            RotorJump { height_m: T::zero(), velocity_m_s: dv, rate_rad_s: push_m_s * self.per_radius };
        rotor.velocity_m_s += jump.velocity_m_s;
        rotor.rate_rad_s += jump.rate_rad_s;
        modes.velocity_m_s -= tooth.recoil * dv;
        Impulse { normal_n_s, tangential_n_s: self.tangential_mass_kg * push_m_s, slip_m_s, jump }
    }

    /// Applies the friction of `teeth` that push the rotor up with the velocities `dv_m_s` over a span of time, in
    /// which their tangential velocities go from `from_m_s` to those in `modes`.
    pub(crate) fn apply_sustained_friction(
        &self,
        teeth: &[ToothPair<T>; 2],
        dv_m_s: [T; 2],
        from_m_s: [T; 2],
        modes: &ModalState<T>,
        rotor: &mut RotorState<T>,
    ) -> [SustainedFriction<T>; 2] {
        let contact = |tooth: &ToothPair<T>, dv: T, from: T| Contact {
            from,
            to: tooth.tangential_velocity(modes),
            limit: self.friction_coefficient(tooth, modes)
                * self.rotor_mass_kg
                * dv
                * self.per_tangential_mass,
        };
        let ([first, second], [dv_0, dv_1], [from_0, from_1]) = (teeth, dv_m_s, from_m_s);
        let friction = sustained_friction(
            [contact(first, dv_0, from_0), contact(second, dv_1, from_1)],
            self.radius_m * rotor.rate_rad_s,
        );
        let [push_0, push_1] = friction.map(|friction| friction.push_m_s);
        rotor.rate_rad_s += (push_0 + push_1) * self.per_radius;
        friction
    }

    /// `c` of the law in force.
    #[inline]
    fn friction_coefficient(&self, tooth: &ToothPair<T>, modes: &ModalState<T>) -> T {
        match self.friction_law {
            FrictionLaw::Coulomb => self.friction,
            FrictionLaw::Paper => {
                let across = tooth.tangential_displacement(modes).abs();
                let up = tooth.height(modes).abs();
                // Compared before dividing: at u = 0 the angle of contact is a right angle and mu is the limit.
                if across < self.friction * up { across / up } else { self.friction }
            }
        }
    }
}

/// The impulses of an impact on the rotor, and the slip that friction met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse<T> {
    /// Normal impulse, `m_r dv`, in N s.
    pub normal_n_s: T,
    /// Tangential impulse in N s.
    pub tangential_n_s: T,
    /// Slip before friction, `s' - v_th`, in m/s.
    pub slip_m_s: T,
    /// The jump of the rotor's motion.
    pub jump: RotorJump<T>,
}
