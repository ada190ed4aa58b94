//! A drawing that meets given frequencies of A, B and C, by what is least known of it: thickness of the silicon,
//! half-angle and stem of the springs.
//!
//! Three equations in three unknowns, in logarithms, by Newton's method. The slopes are differences at the start and
//! then follow the steps (Broyden's update), so that a step costs one solution:
//!
//! ```text
//! J dx = -f,      J <- J + f(x + dx) dx' / (dx' dx)
//! ```
//!
//! A drawing on the way may have no solution: a thin stator that bonding stresses buckles. Then the step is halved, a
//! difference is taken to the other side, and a start is made of thicker silicon.

use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::modes::StatorFigures;
use crate::solution::StatorError;
use crate::solver::Solver;

/// What is fitted, in the order of the unknowns.
pub const FITTED_KEYS: [&str; 3] =
    ["stator.silicon_thickness_m", "stator.spring_half_angle_deg", "stator.spring_stem_m"];
const NAMES: [&str; 3] = ["A", "B", "C"];
/// Solutions that a fit may take.
const ROUNDS_MAX: usize = 24;
/// Largest step of a logarithm, and that of a difference.
const STEP_MAX: f64 = 0.25;
const DIFFERENCE: f64 = 0.03;
/// Parts of a step without a result that are tried instead.
const SHORTER: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
/// By how much the logarithm of the first unknown, the thickness, is raised where the start has no result.
const THICKER: [f64; 4] = [0.08, 0.16, 0.24, 0.32];
/// The half-angle stays below this, degrees: arms of neighbouring springs do not meet.
const HALF_ANGLE_MAX_DEG: f64 = 44.0;

/// Frequencies to be met, Hz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// Of A, B and C.
    pub frequencies_hz: [f64; 3],
    /// By which part they may be missed.
    pub tolerance: f64,
}

impl Wanted {
    /// The paper's: A as its finite elements gave it, B and C as measured.
    pub const PAPER: Self = Self { frequencies_hz: [2150.0, 6300.0, 7460.0], tolerance: 5e-4 };
}

/// A drawing that was fitted to frequencies.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// The drawing.
    pub drawing: Drawing,
    /// What is known of it.
    pub figures: StatorFigures,
    /// Solutions that it took.
    pub rounds: usize,
    /// The mode that is furthest off, 0 to 2 for A, B and C, and the logarithm of its frequency over the wanted one.
    pub worst: (usize, f64),
}

impl Fitted {
    /// Whether the frequencies are met.
    pub fn meets(&self, wanted: &Wanted) -> bool {
        self.worst.1.abs() <= wanted.tolerance
    }

    /// The fit, if the frequencies are met.
    ///
    /// # Errors
    /// When they are not.
    pub fn met(self, wanted: &Wanted) -> Result<Self, StatorError> {
        let (worst, _) = self.worst;
        if self.meets(wanted) {
            return Ok(self);
        }
        Err(StatorError::NotMet {
            rounds: self.rounds,
            mode: NAMES[worst],
            found_hz: self.figures.abc_hz()[worst],
            wanted_hz: wanted.frequencies_hz[worst],
        })
    }
}

/// The first of `first` and `others` that has a result, with it. An error after which another point `may_have` none
/// either ends the search, as the last point does.
fn first_result<R, E>(
    first: [f64; 3],
    others: impl IntoIterator<Item = [f64; 3]>,
    may_have: fn(&E) -> bool,
    f: &mut impl FnMut([f64; 3]) -> Result<R, E>,
) -> Result<([f64; 3], R), E> {
    let mut x = first;
    let mut others = others.into_iter();
    loop {
        match f(x) {
            Ok(result) => return Ok((x, result)),
            Err(error) if !may_have(&error) => return Err(error),
            Err(error) => x = others.next().ok_or(error)?,
        }
    }
}

/// Solves `f(x) = 0`, where `f` may give [`ROUNDS_MAX`] results; after an error that `may_have` is told, another point
/// may have one. The last point comes with its residuals, whether they meet `tolerance` or not, and with what `f` gave
/// beside them.
fn solve<T, E>(
    start: [f64; 3],
    limits: [(f64, f64); 3],
    tolerance: f64,
    may_have: fn(&E) -> bool,
    f: &mut impl FnMut([f64; 3]) -> Result<([f64; 3], T), E>,
) -> Result<([f64; 3], [f64; 3], T, usize), E> {
    let bound = |x: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| x[i].clamp(limits[i].0, limits[i].1)) };
    let thicker = |rise: f64| bound([start[0] + rise, start[1], start[2]]);
    let (mut x, (mut residuals, mut beside)) = first_result(thicker(0.0), THICKER.map(thicker), may_have, f)?;
    let mut jacobian = [[0.0; 3]; 3];
    let size = |r: &[f64; 3]| r.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let mut rounds = 1;
    if size(&residuals) <= tolerance {
        return Ok((x, residuals, beside, rounds));
    }
    for j in 0..3 {
        let side = if x[j] + DIFFERENCE > limits[j].1 { -DIFFERENCE } else { DIFFERENCE };
        let beside_x =
            |side: f64| -> [f64; 3] { std::array::from_fn(|i| if i == j { x[i] + side } else { x[i] }) };
        let (moved, (at, _)) = first_result(beside_x(side), [beside_x(-side)], may_have, f)?;
        rounds += 1;
        for i in 0..3 {
            jacobian[i][j] = (at[i] - residuals[i]) / (moved[j] - x[j]);
        }
    }
    while size(&residuals) > tolerance && rounds < ROUNDS_MAX {
        let Some(step) = solved(&jacobian, residuals.map(|value| -value)) else { break };
        let whole = (STEP_MAX / size(&step)).min(1.0);
        let part = |part: f64| bound(std::array::from_fn(|i| x[i] + whole * part * step[i]));
        let (next, (at, with)) = first_result(part(1.0), SHORTER.map(part), may_have, f)?;
        rounds += 1;
        let moved: [f64; 3] = std::array::from_fn(|i| next[i] - x[i]);
        let square: f64 = moved.iter().map(|value| value * value).sum();
        if square == 0.0 {
            break;
        }
        for i in 0..3 {
            let expected: f64 = (0..3).map(|j| jacobian[i][j] * moved[j]).sum();
            let miss = at[i] - residuals[i] - expected;
            for j in 0..3 {
                jacobian[i][j] += miss * moved[j] / square;
            }
        }
        (x, residuals, beside) = (next, at, with);
    }
    Ok((x, residuals, beside, rounds))
}

/// The solution of three linear equations by Cramer's rule; `None` if there is not one.
fn solved(m: &[[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let determinant = |m: &[[f64; 3]; 3]| -> f64 {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = determinant(m);
    let x: [f64; 3] = std::array::from_fn(|j| {
        let mut changed = *m;
        for i in 0..3 {
            changed[i][j] = right[i];
        }
        determinant(&changed) / whole
    });
    x.iter().all(|value| value.is_finite()).then_some(x)
}

/// A drawing like `drawing` that meets `wanted`, or comes as near as was found. `progress` is called after each
/// solution.
///
/// # Errors
/// When the drawings at and near a step of the search are refused or have no result, or the solver does not work.
pub fn fit(
    drawing: &Drawing,
    wanted: &Wanted,
    solver: &Solver,
    progress: &mut dyn FnMut(),
) -> Result<Fitted, StatorError> {
    let scale = drawing.numbers.outer_radius_m;
    let least_angle = drawing.stem_half_angle().to_degrees() + 1.5;
    let limits =
        [(1e-3 * scale, 0.1 * scale), (least_angle, HALF_ANGLE_MAX_DEG), (0.01 * scale, 0.6 * scale)];
    let mut start = [0.0; 3];
    let mut numbers = drawing.numbers;
    for (value, key) in start.iter_mut().zip(FITTED_KEYS) {
        *value = libm::log(numbers.value_mut(key).map_or(1.0, |value| *value));
    }
    let at = |x: [f64; 3]| {
        let mut drawing = *drawing;
        for (value, key) in x.iter().zip(FITTED_KEYS) {
            if let Some(number) = drawing.numbers.value_mut(key) {
                *number = libm::exp(*value);
            }
        }
        drawing
    };
    let mut evaluate = |x: [f64; 3]| -> Result<([f64; 3], StatorFigures), StatorError> {
        let figures = StatorFigures::of(&at(x), solver)?;
        progress();
        let found = figures.abc_hz();
        let off = std::array::from_fn(|i| libm::log(found[i] / wanted.frequencies_hz[i]));
        Ok((off, figures))
    };
    let limits = limits.map(|(low, high)| (libm::log(low), libm::log(high)));
    let (x, residuals, figures, rounds) =
        solve(start, limits, wanted.tolerance, StatorError::is_of_the_drawing, &mut evaluate)?;
    let worst = (0..3).max_by(|a, b| residuals[*a].abs().total_cmp(&residuals[*b].abs())).unwrap_or(0);
    Ok(Fitted { drawing: at(x), figures, rounds, worst: (worst, residuals[worst]) })
}

/// The values of a drawing that a fit finds, with their keys.
pub fn fitted_values(drawing: &Drawing) -> [(&'static str, f64); 3] {
    let mut numbers = drawing.numbers;
    FITTED_KEYS.map(|key| (key, numbers.value_mut(key).map_or(0.0, |value| *value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three laws of powers, which are lines in logarithms, and a term that bends them: solved to the tolerance in few
    /// rounds, whatever the start.
    #[test]
    fn law_bent_equations_are_solved() {
        let truth = [0.3, -0.8, 0.5];
        for start in [[0.0; 3], [1.0, 0.2, -0.5], [0.3, -0.8, 0.5]] {
            let mut count = 0;
            let mut f = |x: [f64; 3]| -> Result<_, ()> {
                count += 1;
                let d: [f64; 3] = std::array::from_fn(|i| x[i] - truth[i]);
                let bend = 0.1 * d[0] * d[1];
                Ok(([d[0] - 0.7 * d[1] + bend, d[0] - 0.2 * d[2], 0.9 * d[0] + 0.4 * d[2] - bend], ()))
            };
            let (x, residuals, (), rounds) = solve(start, [(-2.0, 2.0); 3], 1e-6, |()| true, &mut f).unwrap();
            assert!(residuals.iter().all(|value| value.abs() <= 1e-6), "{residuals:?}");
            assert!((0..3).all(|i| (x[i] - truth[i]).abs() < 1e-5), "{x:?}");
            assert_eq!(rounds, count);
            assert!(rounds <= 16, "{rounds}");
        }
    }

    /// What cannot be met stays unmet, within the limits, and ends.
    #[test]
    fn law_limits_hold() {
        let mut f = |x: [f64; 3]| -> Result<_, ()> {
            assert!(x.iter().all(|value| value.abs() <= 0.5 + DIFFERENCE));
            Ok((std::array::from_fn(|i| x[i] - 1.0), ()))
        };
        let (_, residuals, (), rounds) = solve([0.0; 3], [(-0.5, 0.5); 3], 1e-6, |()| true, &mut f).unwrap();
        assert!(residuals.iter().all(|value| (value + 0.5).abs() < 1e-9) && rounds <= ROUNDS_MAX);
    }

    /// From a start at its limits no point lies beyond them: the differences are taken to the other side.
    #[test]
    fn exact_a_difference_at_a_limit_is_taken_inside() {
        let mut f = |x: [f64; 3]| -> Result<_, ()> {
            assert!(x.iter().all(|value| value.abs() <= 0.5), "{x:?}");
            Ok((x.map(|value| value - 0.2), ()))
        };
        let (x, ..) = solve([0.5; 3], [(-0.5, 0.5); 3], 1e-9, |()| true, &mut f).unwrap();
        assert!(x.iter().all(|value| (value - 0.2).abs() < 1e-9), "{x:?}");
    }

    /// Steps into a region without a result are halved, a difference is taken to the other side, and a start without
    /// a result is moved. The first equation is concave, so that a Newton step from above goes past the root at -0.8.
    #[test]
    fn law_a_region_without_a_result_is_gone_round() {
        type Region = fn([f64; 3]) -> bool;
        let cases: [(f64, Region); 5] = [
            (-0.7, |x| x[0] < -0.81),
            (0.3, |x| x[0] < -0.81),
            (-0.7, |x| x[1] > -0.39),
            (-0.95, |x| x[0] < -0.9),
            (-1.18, |x| x[0] < -0.9),
        ];
        for (number, (start, has_none)) in cases.into_iter().enumerate() {
            let mut without = 0;
            let mut f = |x: [f64; 3]| {
                if has_none(x) {
                    without += 1;
                    return Err("buckled");
                }
                Ok(([libm::exp(1.6) - libm::exp(-2.0 * x[0]), x[1] - 0.5 * x[0], x[2] + x[0] * x[1]], ()))
            };
            let (x, ..) = solve([start, -0.4, -0.3], [(-2.0, 2.0); 3], 1e-9, |_| true, &mut f).unwrap();
            assert!((x[0] + 0.8).abs() < 1e-8 && (x[1] + 0.4).abs() < 1e-8, "{number}: {x:?}");
            assert!(without > 0, "{number}: the region was not entered");
        }
    }

    /// A region that no attempt leaves is an error, and so is at once one after which no point has a result.
    #[test]
    fn law_no_result_anywhere_is_an_error() {
        for (goes_on, expected) in [(true, THICKER.len() + 1), (false, 1)] {
            let mut count = 0;
            let mut f = |_| -> Result<([f64; 3], ()), bool> {
                count += 1;
                Err(goes_on)
            };
            assert!(solve([0.0; 3], [(-2.0, 2.0); 3], 1e-9, |goes_on| *goes_on, &mut f).is_err());
            assert_eq!(count, expected);
        }
    }
}
