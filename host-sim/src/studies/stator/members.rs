//! Stators drawn over what is not published, in parts, and their spreads.

use rayon::prelude::*;
use stator::Drawing;
use stator::ensemble::{self, Member};
use stator::fit::Wanted;
use stator::members::FLAT;
use stator::solution::StatorError;
use stator::solver::Solver;

use super::StatorStudyError;
use crate::report::OutputError;
use crate::studies::shard::{Shard, run_each};
use simulation::math::statistics::Spread;

/// A quantity of members: its name, its unit, and its value in that unit.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Value of a member.
    pub of: fn(&Member) -> f64,
}

const fn quantity(name: &'static str, unit: &'static str, of: fn(&Member) -> f64) -> Quantity {
    Quantity { name, unit, of }
}

/// What is said of an ensemble.
pub const QUANTITIES: [Quantity; 25] = [
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
    quantity("bow", "um", |m| 1e6 * m.bow_m),
    quantity("half-angle of the springs", "deg", |m| m.spring_half_angle_deg),
    quantity("stem of the springs", "mm", |m| 1e3 * m.spring_stem_m),
];

/// Members of an ensemble in the order of their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// All that were drawn.
    pub members: Vec<Member>,
}

impl Ensemble {
    /// The members whose numbers are those of `shard` among the first `count` draws about `drawing`. `progress` is
    /// called after each.
    ///
    /// # Errors
    /// When the part has none, or CalculiX gives no result.
    pub fn run(
        drawing: &Drawing,
        wanted: &Wanted,
        solver: &Solver,
        numbers: Vec<u64>,
        progress: &(impl Fn() + Sync),
    ) -> Result<Self, StatorStudyError> {
        let one = |number| ensemble::member(drawing, number, wanted, solver);
        let members = run_each::<Member, StatorError>(numbers, one, progress)?;
        Ok(Self { members })
    }

    /// The table that is kept with the program: of flat stators.
    ///
    /// # Errors
    /// When it is damaged, which a test excludes.
    pub fn kept() -> Result<Self, OutputError> {
        let mut reader = csv::Reader::from_reader(FLAT.as_bytes());
        let rows: Result<Vec<Member>, csv::Error> = reader.deserialize().collect();
        rows.map(|members| Self { members }).map_err(|error| OutputError::Table(error.to_string()))
    }

    /// Those that meet the frequencies.
    pub fn met(&self) -> impl Iterator<Item = &Member> + Clone {
        self.members.iter().filter(|member| member.met)
    }

    /// Mean and standard deviation of a quantity over those that meet the frequencies.
    pub fn spread(&self, quantity: Quantity) -> Spread {
        self.met().map(|member| (quantity.of)(member)).collect()
    }

    /// Least and largest value.
    pub fn range(&self, quantity: Quantity) -> (f64, f64) {
        let values = self.met().map(|member| (quantity.of)(member));
        values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }
}

/// The numbers of a part.
///
/// # Errors
/// When the part has none.
pub fn numbers(shard: Shard, count: u64) -> Result<Vec<u64>, simulation::scene::SceneError> {
    shard.numbers_of_some(count, "stators")
}

/// Solves each of several drawings, as many at once as there are processors.
///
/// # Errors
/// That of the first drawing that has no result.
pub(super) fn solve_each(
    drawings: &[Drawing],
    solver: &Solver,
) -> Result<Vec<stator::modes::StatorFigures>, StatorError> {
    drawings
        .par_iter()
        .with_max_len(1)
        .map(|drawing| stator::modes::StatorFigures::of(drawing, solver))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kept table is read, and each of its members that meets the paper's frequencies does so within the tolerance
    /// of the fit, to the digits that are written.
    #[test]
    fn law_kept_members_meet_the_frequencies() {
        let ensemble = Ensemble::kept().unwrap();
        assert!(ensemble.met().count() >= 12);
        for (number, member) in (0..).zip(&ensemble.members) {
            assert!(member.number == number && !member.stressed);
        }
        for member in ensemble.met() {
            let found = [member.frequency_a_hz, member.frequency_b_hz, member.frequency_c_hz];
            for (found, wanted) in found.into_iter().zip(Wanted::PAPER.frequencies_hz) {
                assert!((found / wanted - 1.0).abs() < 1.01 * Wanted::PAPER.tolerance, "{member:?}");
            }
            assert!(member.frequency_t1_hz <= member.frequency_t2_hz);
        }
    }
}
