//! Stators drawn over what is not published, each fitted to the frequencies: what the finite-element model leaves open.
//!
//! | drawn | range |
//! |---|---|
//! | modulus of the foil | 100 to 160 GPa (Sagasti et al., Sensors 19 (2019) 4296: data sheet to saturation) |
//! | thickness of the foil | that of the drawing, 12 % to each side |
//! | silicon | crystal with springs along `<110>`; isotropic, 148 GPa and 0.17; isotropic, 170 GPa and 0.28 |
//! | teeth, along the radius and along the rim | 0.2 to 0.6 mm each |
//! | widths of arms and stem | 0.12 to 0.4 mm each |
//! | arms against each other | 3 % standard deviation in width and angle |
//!
//! Lengths are those of a ring of 3.89 mm; others are scaled.

use rand_core::SeedableRng as _;
use rand_distr::{Distribution as _, Uniform};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::drawing::{Drawing, Silicon};
use crate::drive::ModeDrive;
use crate::fit::{Wanted, fit};
use crate::modes::StatorFigures;
use crate::solution::StatorError;
use crate::solver::Solver;

/// Relative differences of the arms of a member.
const SPREAD: f64 = 0.03;
/// Outer radius for which the ranges of lengths are given, m.
const RADIUS_M: f64 = 3.89e-3;

/// A member: what it is, and what its stator does. One row of the table of members. What was not found is NaN.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each name says quantity, mode and unit; `StatorFigures` has their meanings")]
pub struct Member {
    /// Number of the draw, which is its seed.
    pub number: u64,
    /// Whether the modes are those about the state that bonding leaves.
    pub stressed: bool,
    /// Whether it meets the frequencies it was fitted to. One that does not is no stator of this motor.
    pub met: bool,
    /// Why not; empty of one that does.
    pub why: String,
    pub frequency_a_hz: f64,
    pub frequency_t1_hz: f64,
    pub frequency_t2_hz: f64,
    pub frequency_b_hz: f64,
    pub frequency_c_hz: f64,
    pub stator_mass_kg: f64,
    pub modal_mass_a_kg: f64,
    pub modal_mass_t_kg: f64,
    pub modal_mass_b_kg: f64,
    pub modal_mass_c_kg: f64,
    pub exponent_a: f64,
    pub exponent_t: f64,
    pub exponent_b: f64,
    pub exponent_c: f64,
    pub mode_shift_b_deg: f64,
    pub mode_shift_c_deg: f64,
    pub lever_b: f64,
    pub lever_c: f64,
    pub effective_tooth_mass_kg: f64,
    pub effective_tooth_mass_with_tilt_kg: f64,
    pub silicon_thickness_m: f64,
    pub foil_thickness_m: f64,
    pub bow_m: f64,
    /// Of flat stators, as the others on force and field.
    pub force_per_strain_b_n: Option<f64>,
    pub force_per_strain_c_n: Option<f64>,
    pub best_field_b_deg: Option<f64>,
    pub best_field_c_deg: Option<f64>,
    pub tooth_over_amplitude_b: Option<f64>,
    pub tooth_over_amplitude_c: Option<f64>,
    pub antinode_over_tooth_b: f64,
    pub antinode_over_tooth_c: f64,
    pub transverse_inertia_kg_m2: f64,
    pub foil_modulus_pa: f64,
    /// 0 for a crystal, else the modulus.
    pub silicon_modulus_pa: f64,
    pub tooth_radial_m: f64,
    pub tooth_tangential_m: f64,
    pub spring_arm_width_m: f64,
    pub spring_stem_width_m: f64,
    pub spring_half_angle_deg: f64,
    pub spring_stem_m: f64,
}

/// The drawing of draw `number` about `drawing`, before it is fitted.
pub fn draw(drawing: &Drawing, number: u64) -> Drawing {
    let mut rng = Pcg64::seed_from_u64(number);
    let mut uniform = |low: f64, high: f64| {
        Uniform::new_inclusive(low, high).map_or(low, |uniform| uniform.sample(&mut rng))
    };
    let mut drawn = *drawing;
    let scale = drawing.numbers.outer_radius_m / RADIUS_M;
    let n = &mut drawn.numbers;
    n.foil_modulus_pa = uniform(100e9, 160e9);
    n.foil_thickness_m *= uniform(0.88, 1.12);
    (drawn.silicon, n.silicon_modulus_pa, n.silicon_poisson) = match uniform(0.0, 3.0) {
        kind if kind < 1.0 => (Silicon::Crystal, n.silicon_modulus_pa, n.silicon_poisson),
        kind if kind < 2.0 => (Silicon::Isotropic, 148e9, 0.17),
        _ => (Silicon::Isotropic, 170e9, 0.28),
    };
    n.tooth_radial_m = scale * uniform(0.2e-3, 0.6e-3);
    n.tooth_tangential_m = scale * uniform(0.2e-3, 0.6e-3);
    n.spring_arm_width_m = scale * uniform(0.12e-3, 0.4e-3);
    n.spring_stem_width_m = scale * uniform(0.12e-3, 0.4e-3);
    n.spring_spread = SPREAD;
    drawn.spread_seed = number;
    drawn
}

/// Member `number` about `drawing`, fitted to `wanted`. One whose search ends without a result is a row of NaN with the
/// reason.
///
/// # Errors
/// When there is no solver, or a folder cannot be used: then no member has a result.
pub fn member(
    drawing: &Drawing,
    number: u64,
    wanted: &Wanted,
    solver: &Solver,
) -> Result<Member, StatorError> {
    let drawn = draw(drawing, number);
    match fit(&drawn, wanted, solver, &mut || ()) {
        Ok(fitted) => {
            let row = Member::of(number, &fitted.drawing, &fitted.figures);
            let why = fitted.met(wanted).err().map_or_else(String::new, |error| error.to_string());
            Ok(Member { met: why.is_empty(), why, ..row })
        }
        Err(error) if error.is_of_the_drawing() => {
            let row = Member::of(number, &drawn, &StatorFigures::NONE);
            Ok(Member { met: false, why: error.to_string(), ..row })
        }
        Err(error) => Err(error),
    }
}

impl PartialEq for Member {
    /// As they are printed: a value that was not found is the same as another one.
    fn eq(&self, other: &Self) -> bool {
        format!("{self:?}") == format!("{other:?}")
    }
}

impl Member {
    /// The row of a drawing and its figures.
    pub fn of(number: u64, drawing: &Drawing, figures: &StatorFigures) -> Self {
        let n = &drawing.numbers;
        let [t1, t2] = figures.tilt;
        let of_drive =
            |mode: usize, value: fn(&ModeDrive) -> f64| figures.drive.map(|drive| value(&drive[mode]));
        Self {
            number,
            stressed: drawing.stressed,
            met: true,
            why: String::new(),
            frequency_a_hz: figures.a.frequency_hz,
            frequency_t1_hz: t1.frequency_hz,
            frequency_t2_hz: t2.frequency_hz,
            frequency_b_hz: figures.b.frequency_hz,
            frequency_c_hz: figures.c.frequency_hz,
            stator_mass_kg: figures.stator_mass_kg,
            modal_mass_a_kg: figures.a.modal_mass_kg,
            modal_mass_t_kg: 0.5 * (t1.modal_mass_kg + t2.modal_mass_kg),
            modal_mass_b_kg: figures.b.modal_mass_kg,
            modal_mass_c_kg: figures.c.modal_mass_kg,
            exponent_a: figures.a.exponent,
            exponent_t: 0.5 * (t1.exponent + t2.exponent),
            exponent_b: figures.b.exponent,
            exponent_c: figures.c.exponent,
            mode_shift_b_deg: figures.mode_shift_deg[0],
            mode_shift_c_deg: figures.mode_shift_deg[1],
            lever_b: figures.lever[0],
            lever_c: figures.lever[1],
            effective_tooth_mass_kg: figures.effective_tooth_mass_kg,
            effective_tooth_mass_with_tilt_kg: figures.effective_tooth_mass_with_tilt_kg,
            silicon_thickness_m: n.silicon_thickness_m,
            foil_thickness_m: n.foil_thickness_m,
            bow_m: figures.bow_m,
            force_per_strain_b_n: of_drive(0, |drive| drive.force_per_strain_n),
            force_per_strain_c_n: of_drive(1, |drive| drive.force_per_strain_n),
            best_field_b_deg: of_drive(0, |drive| drive.best_field_deg),
            best_field_c_deg: of_drive(1, |drive| drive.best_field_deg),
            tooth_over_amplitude_b: of_drive(0, |drive| drive.tooth_over_amplitude),
            tooth_over_amplitude_c: of_drive(1, |drive| drive.tooth_over_amplitude),
            antinode_over_tooth_b: figures.antinode_over_tooth[0],
            antinode_over_tooth_c: figures.antinode_over_tooth[1],
            transverse_inertia_kg_m2: figures.transverse_inertia_kg_m2,
            foil_modulus_pa: n.foil_modulus_pa,
            silicon_modulus_pa: if drawing.silicon == Silicon::Crystal { 0.0 } else { n.silicon_modulus_pa },
            tooth_radial_m: n.tooth_radial_m,
            tooth_tangential_m: n.tooth_tangential_m,
            spring_arm_width_m: n.spring_arm_width_m,
            spring_stem_width_m: n.spring_stem_width_m,
            spring_half_angle_deg: n.spring_half_angle_deg,
            spring_stem_m: n.spring_stem_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A search that ends without a result is a row with its reason, equal to itself. Where there is no solver, the
    /// ensemble ends.
    #[cfg(unix)]
    #[test]
    fn law_a_draw_without_a_result_is_a_row() {
        let ensemble = |program: &str| {
            member(
                &Drawing::default(),
                3,
                &Wanted::PAPER,
                &Solver { program: program.into(), ..Solver::default() },
            )
        };
        let row = ensemble("false").unwrap();
        assert!(!row.met && row.why.starts_with("false failed"), "{row:?}");
        assert!(row.frequency_b_hz.is_nan() && row.force_per_strain_b_n.is_none());
        assert!((row.tooth_radial_m - draw(&Drawing::default(), 3).numbers.tooth_radial_m).abs() < 1e-12);
        assert_eq!(row, row.clone());
        assert_ne!(row, Member { number: 4, ..row.clone() });
        let error = ensemble("/nowhere/ccx").unwrap_err();
        assert!(!error.is_of_the_drawing(), "{error}");
    }

    /// Draws differ, repeat by their number, pass every check, and scale with the ring.
    #[test]
    fn law_draws_are_drawings() {
        let whole = Drawing::default();
        let mut half = whole;
        for key in
            ["stator.inner_radius_m", "stator.outer_radius_m", "stator.tooth_radius_m", "stator.mesh_size_m"]
        {
            *half.numbers.value_mut(key).unwrap() *= 0.5;
        }
        let mut kinds = [0; 3];
        for number in 0..60 {
            let drawn = draw(&whole, number);
            assert_eq!(drawn, draw(&whole, number));
            assert_ne!(drawn, draw(&whole, number + 1));
            drawn.check().unwrap();
            let small = draw(&half, number);
            small.check().unwrap();
            let ratio = small.numbers.tooth_radial_m / drawn.numbers.tooth_radial_m;
            assert!((ratio - 0.5).abs() < 1e-12, "{ratio}");
            let is_stiff = drawn.numbers.silicon_modulus_pa > 160e9;
            kinds[if drawn.silicon == Silicon::Crystal { 0 } else { 1 + usize::from(is_stiff) }] += 1;
        }
        // Each kind is a third: binomial, 20 +- 3.7.
        assert!(kinds.iter().all(|count| (5..36).contains(count)), "{kinds:?}");
    }
}
