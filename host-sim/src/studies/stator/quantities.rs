//! What is said of the members of an ensemble.

use stator::ensemble::Member;

use super::driven::DrivenStator;

/// A quantity of members: its name, its unit, and its value in that unit.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Value of a member; NaN where it has none.
    pub of: fn(&Member) -> f64,
}

const fn quantity(name: &'static str, unit: &'static str, of: fn(&Member) -> f64) -> Quantity {
    Quantity { name, unit, of }
}

/// A value of how a member is driven.
fn driven(member: &Member, of: fn(&DrivenStator) -> f64) -> f64 {
    DrivenStator::of_member(member).as_ref().map_or(f64::NAN, of)
}

/// What is said of an ensemble.
pub const QUANTITIES: [Quantity; 33] = [
    quantity("f of A", "Hz", |m| m.frequency_a_hz),
    quantity("f of the lower tilt", "Hz", |m| m.frequency_t1_hz),
    quantity("f of the higher tilt", "Hz", |m| m.frequency_t2_hz),
    quantity("f of B", "Hz", |m| m.frequency_b_hz),
    quantity("f of C", "Hz", |m| m.frequency_c_hz),
    quantity("tilt over A", "", |m| 0.5 * (m.frequency_t1_hz + m.frequency_t2_hz) / m.frequency_a_hz),
    quantity("modal mass of A over mass", "", |m| m.modal_mass_a_kg / m.stator_mass_kg),
    quantity("modal mass of tilt over mass", "", |m| m.modal_mass_t_kg / m.stator_mass_kg),
    quantity("modal mass of B over mass", "", |m| m.modal_mass_b_kg / m.stator_mass_kg),
    quantity("modal mass of C over mass", "", |m| m.modal_mass_c_kg / m.stator_mass_kg),
    quantity("exponent of A", "", |m| m.exponent_a),
    quantity("exponent of tilt", "", |m| m.exponent_t),
    quantity("exponent of B", "", |m| m.exponent_b),
    quantity("exponent of C", "", |m| m.exponent_c),
    quantity("mode shift of B", "deg", |m| m.mode_shift_b_deg),
    quantity("mode shift of C", "deg", |m| m.mode_shift_c_deg),
    quantity("lever of B", "", |m| m.lever_b),
    quantity("lever of C", "", |m| m.lever_c),
    quantity("effective tooth mass", "mg", |m| 1e6 * m.effective_tooth_mass_kg),
    quantity("effective tooth mass with tilt", "mg", |m| 1e6 * m.effective_tooth_mass_with_tilt_kg),
    quantity("stator mass", "mg", |m| 1e6 * m.stator_mass_kg),
    quantity("thickness of the silicon", "um", |m| 1e6 * m.silicon_thickness_m),
    quantity("thickness with the foil", "um", |m| 1e6 * (m.silicon_thickness_m + m.foil_thickness_m)),
    quantity("bow", "um", |m| 1e6 * m.bow_m),
    quantity("half-angle of the springs", "deg", |m| m.spring_half_angle_deg),
    quantity("stem of the springs", "mm", |m| 1e3 * m.spring_stem_m),
    quantity("force on B", "mN/ppm", |m| 1e-3 * m.force_per_strain_b_n.unwrap_or(f64::NAN)),
    quantity("force on C", "mN/ppm", |m| 1e-3 * m.force_per_strain_c_n.unwrap_or(f64::NAN)),
    quantity("best field for B", "deg", |m| m.best_field_b_deg.unwrap_or(f64::NAN)),
    quantity("best field for C", "deg", |m| m.best_field_c_deg.unwrap_or(f64::NAN)),
    quantity("field of both amplitudes", "deg", |m| driven(m, |d| d.both[0].field_deg)),
    quantity("the other such field", "deg", |m| driven(m, |d| d.both[1].field_deg)),
    quantity("strain of the foil", "ppm", |m| driven(m, |d| 1e6 * d.both[0].strain)),
];

/// The quantity of a name, which is one of the table.
pub(super) fn named(name: &str) -> Quantity {
    let found = QUANTITIES.into_iter().find(|quantity| quantity.name == name);
    debug_assert!(found.is_some(), "no quantity is called {name}");
    found.unwrap_or(QUANTITIES[0])
}
