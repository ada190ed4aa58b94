//! The rule by which a simulated figure is compared with a printed one.
//!
//! A figure is *within* when the means differ by no more than the two standard deviations together,
//! `sd_paper + sd_ours`. Both deviations are those of five runs. The comparison also gives
//! `z = |difference| / sqrt(sd_paper^2 + sd_ours^2)`, the difference in units of its standard deviation, for a stricter
//! rule: two single runs of the same law differ by less than `z = 1` two times in three.
//!
//! The paper prints means and spreads to a few digits. A comparison finer than the last digit has no meaning. A figure
//! that fails the rule, but passes it after ours is rounded as the paper rounds, is *within at the printed precision*.
//! It is not counted as within.

use motor_model::math;
use serde::Serialize;

use super::published::{Printed, Quantity, borrowed_relative_sd};
use simulation::math::statistics::Spread;

/// A simulated figure beside a printed one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FigureComparison {
    /// The printed mean and spread, in the quantity's unit.
    pub paper: Spread,
    /// Whether that spread is that of Table 2's first row, because none is printed for the figure.
    pub spread_borrowed: bool,
    /// The simulated mean and spread over the seeds.
    pub ours: Spread,
    /// `|ours - paper| <= sd_paper + sd_ours`.
    pub within: bool,
    /// The same after the simulated values are rounded to the decimals that the paper prints.
    pub within_as_printed: bool,
    /// `|ours - paper| / sqrt(sd_paper^2 + sd_ours^2)`.
    pub z: f64,
}

impl FigureComparison {
    /// Compares `ours` with `printed`.
    pub fn new(quantity: Quantity, printed: Printed, ours: Spread) -> Self {
        let sd = printed.sd.unwrap_or(borrowed_relative_sd(quantity) * printed.mean);
        let difference = (ours.mean - printed.mean).abs();
        Self {
            paper: Spread { mean: printed.mean, sd },
            spread_borrowed: printed.sd.is_none(),
            ours,
            within: difference <= sd + ours.sd,
            within_as_printed: within_as_printed(
                printed.decimals(quantity),
                Spread { mean: printed.mean, sd },
                ours,
            ),
            z: difference / math::sqrt(sd * sd + ours.sd * ours.sd),
        }
    }

    /// Whether the means differ by no more than the root sum of squares of both deviations, `z <= 1`.
    pub fn within_root_sum_of_squares(&self) -> bool {
        self.z <= 1.0
    }
}

/// The rule in units of the last printed digit. These are whole numbers, so that the sums are exact.
fn within_as_printed(decimals: usize, paper: Spread, ours: Spread) -> bool {
    let units_per_one = (0..decimals).fold(1.0, |units, _| 10.0 * units);
    let units = |value: f64| (value * units_per_one).round();
    (units(ours.mean) - units(paper.mean)).abs() <= units(paper.sd) + units(ours.sd)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(paper: f64, sd: Option<f64>, mean: f64, our_sd: f64) -> FigureComparison {
        FigureComparison::new(Quantity::Rate, Printed { mean: paper, sd }, Spread { mean, sd: our_sd })
    }

    /// 3 and 4 combine to 7 one way, to 5 the other.
    #[test]
    fn exact_both_rules() {
        let inside = compared(10.0, Some(3.0), 17.0, 4.0);
        assert!(inside.within && !inside.within_root_sum_of_squares());
        assert!((inside.z - 1.4).abs() < 1e-15);
        assert!(compared(10.0, Some(3.0), 3.0, 4.0).within, "two-sided");
        assert!(!compared(10.0, Some(3.0), 17.001, 4.0).within);
        assert!(!compared(10.0, Some(3.0), 2.999, 4.0).within);
        assert!(compared(10.0, Some(3.0), 15.0, 4.0).within_root_sum_of_squares());
    }

    /// Table 2's first row: 1.72 +- 0.09.
    #[test]
    fn exact_a_spread_is_borrowed_in_proportion() {
        let shifted = compared(3.44, None, 3.5, 0.01);
        assert!(shifted.spread_borrowed && (shifted.paper.sd - 0.18).abs() < 1e-12);
        assert!(!compared(3.44, Some(0.1), 3.5, 0.01).spread_borrowed);
    }

    /// 1.891 +- 0.018 is printed as 1.89 +- 0.02: 9 units from 1.80, and 7 + 2 units are 9.
    #[test]
    fn exact_printed_precision_is_a_verdict_of_its_own() {
        let edge = compared(1.80, Some(0.07), 1.891, 0.018);
        assert!(!edge.within && edge.within_as_printed);
        assert!(!compared(1.80, Some(0.07), 1.896, 0.018).within_as_printed);
    }

    #[test]
    fn exact_what_is_no_number_is_not_within() {
        assert!(!compared(1.0, Some(0.1), f64::NAN, 0.1).within);
    }
}
