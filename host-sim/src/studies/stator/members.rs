//! Stators drawn over what is not published, in parts, and their spreads.

use rayon::prelude::*;
use stator::Drawing;
use stator::ensemble::{self, Member};
use stator::fit::Wanted;
use stator::solution::StatorError;
use stator::solver::Solver;

use super::StatorStudyError;
use super::quantities::Quantity;
use crate::report::OutputError;
use crate::studies::shard::{Shard, run_each};
use simulation::math::statistics::Spread;

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

    /// The table that is kept with the program: of flat stators, or of stressed ones.
    ///
    /// # Errors
    /// When it is damaged, which a test excludes.
    pub fn kept(stressed: bool) -> Result<Self, OutputError> {
        stator::members::kept(stressed)
            .map(|members| Self { members })
            .map_err(|error| OutputError::Table(error.to_string()))
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

    /// The kept tables are read, and each member that meets the paper's frequencies does so within the tolerance of the
    /// fit, to the digits that are written. One that does not has a reason. Flat ones are driven.
    #[test]
    fn law_kept_members_meet_the_frequencies() {
        for (stressed, least) in [(false, 12), (true, 4)] {
            let ensemble = Ensemble::kept(stressed).unwrap();
            assert!(ensemble.met().count() >= least);
            for (number, member) in (0..).zip(&ensemble.members) {
                assert!(member.number == number && member.stressed == stressed);
                assert_eq!(member.met, member.why.is_empty(), "{member:?}");
                assert_eq!(member.force_per_strain_b_n.is_some(), member.met && !stressed, "{member:?}");
            }
            meets(&ensemble);
        }
    }

    fn meets(ensemble: &Ensemble) {
        for member in ensemble.met() {
            let found = [member.frequency_a_hz, member.frequency_b_hz, member.frequency_c_hz];
            for (found, wanted) in found.into_iter().zip(Wanted::PAPER.frequencies_hz) {
                assert!((found / wanted - 1.0).abs() < 1.01 * Wanted::PAPER.tolerance, "{member:?}");
            }
            assert!(member.frequency_t1_hz <= member.frequency_t2_hz);
        }
    }
}
