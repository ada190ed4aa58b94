//! What a tooth did to the rotor: the truth of an impact, which only the simulation knows.

use motor_model::{ContactPlace, Impact, MotorParams, Parameter, TiltingContact, math};

/// Share of the largest friction from which on a tooth counts as slipping: the rest is rounding.
const SLIPPING: f64 = 1.0 - 1e-6;

/// An impact of teeth on the rotor, within a step of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToothImpact {
    /// The pair of teeth, 0 or 1. A single tooth of a rotor that tilts counts as its pair.
    pub pair: u8,
    /// Time from the impact to the end of the step, in s.
    pub before_end_s: f64,
    /// Normal impulse per mass of the rotor, in m/s: the jump of the velocity of its centre.
    pub jump_m_s: f64,
    /// Rate to which the tooth would carry the rotor if friction had no limit, in rad/s. Of a height-only rotor it is
    /// the tooth's tangential velocity per radius. One that tilts or shifts gives way, and where the tooth sticks this
    /// is the rate after the impact.
    pub tooth_rate_rad_s: f64,
    /// Change of the rotor's rate, in rad/s.
    pub kick_rad_s: f64,
    /// Largest kick that friction allows per jump, in rad/s per m/s: of a rotor that also slips outward, what is left.
    pub kick_per_jump_rad_m: f64,
}

/// What turns impulses and slips into jumps and rates.
struct Rotor {
    mass_kg: f64,
    radius_m: f64,
    /// Kick per tangential impulse, `R_t / J`.
    per_n_s: f64,
    friction: f64,
}

impl Rotor {
    fn of(params: &MotorParams) -> Self {
        let radius_m = params.get(Parameter::ToothRadius);
        Self {
            mass_kg: params.get(Parameter::RotorMass),
            radius_m,
            per_n_s: radius_m / params.get(Parameter::RotorInertia),
            friction: params.get(Parameter::Friction),
        }
    }

    /// Largest kick per jump where nothing but the rotation takes friction up.
    fn kick_per_jump_rad_m(&self) -> f64 {
        self.friction * self.mass_kg * self.per_n_s
    }
}

/// The impacts of a step of the height-only motor, before which the rotor had this rate.
pub(super) fn of_pairs(
    params: &MotorParams,
    mut rate_rad_s: f64,
    impacts: &[Impact<f64>],
) -> Vec<ToothImpact> {
    let rotor = Rotor::of(params);
    let of_pair = |impact: &Impact<f64>| {
        let kick_rad_s = rotor.per_n_s * impact.tangential_impulse_n_s;
        let tooth_rate_rad_s = rate_rad_s + impact.slip_m_s / rotor.radius_m;
        rate_rad_s += kick_rad_s;
        ToothImpact {
            pair: impact.pair,
            before_end_s: impact.before_end_s,
            jump_m_s: impact.normal_impulse_n_s / rotor.mass_kg,
            tooth_rate_rad_s,
            kick_rad_s,
            kick_per_jump_rad_m: rotor.kick_per_jump_rad_m(),
        }
    };
    impacts.iter().map(of_pair).collect()
}

/// The same of the tilting motor: the teeth's impacts alone, not what the hub did nor what a sustained contact does.
pub(super) fn of_teeth(
    params: &MotorParams,
    mut rate_rad_s: f64,
    contacts: &[TiltingContact<f64>],
) -> Vec<ToothImpact> {
    let rotor = Rotor::of(params);
    let of_tooth = |contact: &TiltingContact<f64>| {
        let ContactPlace::Tooth(tooth) = contact.place else { return None };
        if contact.sustained {
            return None;
        }
        let ([clockwise_n_s, outward_n_s], [slip_m_s, _]) =
            (contact.tangential_impulse_n_s, contact.slip_m_s);
        let kick_rad_s = rotor.per_n_s * clockwise_n_s;
        let jump_m_s = contact.normal_impulse_n_s / rotor.mass_kg;
        let along_n_s = math::sqrt(clockwise_n_s * clockwise_n_s + outward_n_s * outward_n_s);
        let slips = along_n_s > SLIPPING * rotor.friction * contact.normal_impulse_n_s;
        let (carried_rad_s, kick_per_jump_rad_m) = if slips {
            let least_rad_s = kick_rad_s.abs();
            ((slip_m_s.abs() / rotor.radius_m).max(least_rad_s).copysign(kick_rad_s), least_rad_s / jump_m_s)
        } else {
            (kick_rad_s, rotor.kick_per_jump_rad_m())
        };
        let tooth_rate_rad_s = rate_rad_s + carried_rad_s;
        rate_rad_s += kick_rad_s;
        Some(ToothImpact {
            pair: tooth & 1,
            before_end_s: contact.before_end_s,
            jump_m_s,
            tooth_rate_rad_s,
            kick_rad_s,
            kick_per_jump_rad_m,
        })
    };
    contacts.iter().filter_map(of_tooth).collect()
}
