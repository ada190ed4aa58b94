//! How a figure follows each key: its mean over the rows of a slice of the key's values, whatever the other keys are.
//!
//! A range has [`SLICES`] slices of equal width, or of equal factors on a logarithmic axis; values of a list and of a
//! grid have one each.

use std::cmp::Ordering;

use serde::Serialize;
use serde_json::Value;

use super::tables::{Cells, Column};
use crate::report::parquet_table::Cell;
use simulation::math::count::real;
use simulation::math::statistics::Accumulator;

/// Slices of a range.
const SLICES: u64 = 16;

/// A figure over the slices of a key.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Response {
    /// The figure, by its path.
    pub figure: String,
    /// The key.
    pub key: String,
    /// Whether the key's axis is logarithmic.
    pub log: bool,
    /// The words that the key takes, if it takes words: slice `n` is of the `n`-th.
    pub words: Vec<String>,
    /// The slices that have rows, in the order of the key's values.
    pub slices: Vec<Slice>,
}

/// The rows in a slice of a key's values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slice {
    /// Middle of the slice; of a word its number, from 1.
    pub at: f64,
    /// Rows that have the figure.
    pub rows: u64,
    /// Its mean over them.
    pub mean: f64,
    /// Its sample standard deviation; `null` of one row.
    pub sd: Option<f64>,
}

impl Response {
    /// The least and the largest mean of a slice; `None` without one.
    pub fn range(&self) -> Option<(f64, f64)> {
        let means = || self.slices.iter().map(|slice| slice.mean);
        let (low, high) = (means().reduce(f64::min)?, means().reduce(f64::max)?);
        Some((low, high))
    }
}

/// The slices of a key.
#[derive(Clone, Debug)]
enum Slicing {
    /// Values in the order of a list, and whether they are words.
    Listed { values: Vec<String>, are_words: bool },
    /// Slices of a range; `on_levels` if each is a value of a grid.
    Range { min: f64, max: f64, log: bool, slices: u64, on_levels: bool },
}

impl Slicing {
    /// The slices of an axis, as it is described.
    fn of(axis: &Value) -> Self {
        let range = &axis["range"];
        let number = |name: &str| range[name].as_f64();
        if let (Some(min), Some(max)) = (number("min"), number("max")) {
            let levels = range["count"].as_u64().filter(|count| *count <= SLICES);
            let log = range["log"].as_bool().unwrap_or(false);
            return Self::Range {
                min,
                max,
                log,
                slices: levels.unwrap_or(SLICES),
                on_levels: levels.is_some(),
            };
        }
        let values: Vec<String> = (axis["listed"].as_array().into_iter().flatten())
            .filter_map(|value| value.as_str().map(str::to_owned))
            .collect();
        let are_words = values.iter().any(|value| value.parse::<f64>().is_err());
        Self::Listed { values, are_words }
    }

    fn count(&self) -> u64 {
        match self {
            Self::Listed { values, .. } => values.len() as u64,
            Self::Range { slices, .. } => *slices,
        }
    }

    /// The slice of a cell.
    fn place(&self, cell: &Cell) -> Option<usize> {
        let number = match cell {
            Cell::Number(number) => Some(*number),
            Cell::Whole(whole) => Some(real(*whole)),
            Cell::Word(_) => None,
        };
        match self {
            Self::Listed { values, .. } => values.iter().position(|value| match (cell, number) {
                (Cell::Word(word), _) => value.as_str() == word.as_ref(),
                (_, Some(number)) => {
                    value.parse::<f64>().is_ok_and(|value| value.total_cmp(&number) == Ordering::Equal)
                }
                _ => false,
            }),
            Self::Range { min, max, log, slices, on_levels } => {
                let along = |value: f64| if *log { motor_model::math::ln(value) } else { value };
                let part = (along(number?) - along(*min)) / (along(*max) - along(*min));
                let place = if *on_levels {
                    (part * real(slices - 1)).round()
                } else {
                    (part * real(*slices)).floor()
                };
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "within the slices"
                )]
                let place = place.clamp(0.0, real(slices - 1)) as usize;
                Some(place)
            }
        }
    }

    /// The middle of a slice.
    fn middle(&self, place: usize) -> f64 {
        match self {
            Self::Listed { values, are_words: false } => {
                values.get(place).and_then(|value| value.parse().ok()).unwrap_or(f64::NAN)
            }
            Self::Listed { .. } => real(place + 1),
            Self::Range { min, max, log, slices, on_levels } => {
                let part = if *on_levels {
                    real(place) / real(slices - 1)
                } else {
                    (real(place) + 0.5) / real(*slices)
                };
                if *log {
                    min * motor_model::math::exp(part * motor_model::math::ln(max / min))
                } else {
                    min * (1.0 - part) + max * part
                }
            }
        }
    }
}

/// Sums over the rows of a sweep.
pub(super) struct ResponseSums {
    axes: Vec<AxisSums>,
    figures: Vec<String>,
}

struct AxisSums {
    key: String,
    column: Option<usize>,
    slicing: Slicing,
    /// By slice, then by figure.
    sums: Vec<Vec<(u64, Accumulator)>>,
}

impl ResponseSums {
    /// Sums of the tables with these columns of the sweep that `described` is.
    pub(super) fn new(columns: &[Column], described: &Value) -> Self {
        let figures: Vec<String> = (described["figures"].as_array().into_iter().flatten())
            .filter_map(|path| path.as_str().map(str::to_owned))
            .collect();
        let of_axis = |axis: &Value| {
            let key = axis["key"].as_str().unwrap_or_default().to_owned();
            let slicing = Slicing::of(axis);
            let slices = usize::try_from(slicing.count()).unwrap_or(0);
            AxisSums {
                column: columns.iter().position(|(name, _)| *name == key),
                key,
                slicing,
                sums: vec![vec![(0, Accumulator::default()); figures.len()]; slices],
            }
        };
        let axes = described["over"].as_array().into_iter().flatten().map(of_axis).collect();
        Self { axes, figures }
    }

    /// Adds a row with these figures.
    pub(super) fn add(&mut self, cells: &Cells, figures: &[Option<f64>]) {
        for axis in &mut self.axes {
            let cell = axis.column.and_then(|column| cells.get(column)?.as_ref());
            let place = cell.and_then(|cell| axis.slicing.place(cell));
            let Some(sums) = place.and_then(|place| axis.sums.get_mut(place)) else { continue };
            for ((rows, sum), figure) in sums.iter_mut().zip(figures) {
                if let Some(figure) = figure {
                    *rows += 1;
                    sum.add(*figure);
                }
            }
        }
    }

    /// A response for each figure and key.
    pub(super) fn responses(&self) -> Vec<Response> {
        let of = |(place, figure): (usize, &String)| {
            let of_axis = move |axis: &AxisSums| {
                let (words, log) = match &axis.slicing {
                    Slicing::Listed { values, are_words: true } => (values.clone(), false),
                    Slicing::Listed { .. } => (Vec::new(), false),
                    Slicing::Range { log, .. } => (Vec::new(), *log),
                };
                let slice = |(slice, sums): (usize, &Vec<(u64, Accumulator)>)| {
                    let (rows, sum) = sums.get(place)?;
                    let (at, spread) = (axis.slicing.middle(slice), sum.spread());
                    let sd = (*rows > 1).then_some(spread.sd);
                    (*rows > 0).then_some(Slice { at, rows: *rows, mean: spread.mean, sd })
                };
                let mut slices: Vec<Slice> = axis.sums.iter().enumerate().filter_map(slice).collect();
                slices.sort_by(|a, b| a.at.total_cmp(&b.at));
                Response { figure: figure.clone(), key: axis.key.clone(), log, words, slices }
            };
            self.axes.iter().map(of_axis).collect::<Vec<_>>()
        };
        self.figures.iter().enumerate().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Sampling, SweepPlan, SweepRequest, SweepSummary, SweptCommand};
    use super::*;
    use serde_json::json;
    use simulation::runs::RunError;
    use simulation::scene::Scene;

    fn summary(over: &[&str], sampling: Sampling, of: impl Fn(&Scene) -> f64) -> SweepSummary {
        let request = SweepRequest {
            command: SweptCommand::Simulate,
            sample: 1,
            over: over.iter().map(|over| (*over).to_owned()).collect(),
            sampling,
            repeats: 1,
            figures: vec!["f".to_owned()],
        };
        let plan = SweepPlan::new(&Scene::default(), request, |_, _| false, &|_| Ok(())).unwrap();
        let run = |scene: &Scene| Ok::<_, RunError>(json!({"f": of(scene)}));
        let mut sums = super::super::summary::SummarySums::new(&plan.columns(), &plan.described());
        (0..plan.rows()).for_each(|number| sums.add(&plan.cells(&plan.make_with(number, run))));
        sums.summary(std::path::PathBuf::new())
    }

    /// Of `f = 10 x + d`, over a grid of three x and two drives, d being 0 and 1: each level of x has the mean of both
    /// drives, each drive that of the three x.
    #[test]
    fn exact_slices_of_a_grid_have_the_mean_over_the_other_keys() {
        let of = |scene: &Scene| {
            10.0 * scene.number("motor.friction") + f64::from(u8::from(scene.choice("simulate.drive") == "c"))
        };
        let over = ["motor.friction=0.1..0.3:3", "simulate.drive=b,c"];
        let found = summary(&over, Sampling::Grid, of).responses;
        let close = |found: &[(f64, f64)], expected: &[(f64, f64)]| {
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            found.len() == expected.len()
                && found.iter().zip(expected).all(|(a, b)| near(a.0, b.0) && near(a.1, b.1))
        };
        let means = |response: &Response| -> Vec<(f64, f64)> {
            response.slices.iter().map(|slice| (slice.at, slice.mean)).collect()
        };
        assert!(close(&means(&found[0]), &[(0.1, 1.5), (0.2, 2.5), (0.3, 3.5)]), "{found:?}");
        assert!(close(&means(&found[1]), &[(1.0, 2.0), (2.0, 3.0)]), "{found:?}");
        assert_eq!((&found[1].words, found[0].slices[0].rows), (&vec!["b".to_owned(), "c".to_owned()], 2));
    }

    /// Of one row there is no standard deviation, and no bar in the picture. Of 1.5 and 2.5 it is 1 / sqrt 2.
    #[test]
    fn exact_a_slice_of_one_row_has_no_spread() {
        let of = |scene: &Scene| 10.0 * scene.number("motor.friction") + 0.5;
        let alone = summary(&["motor.friction=0.1,0.2"], Sampling::Grid, of);
        let json: Value = serde_json::from_str(&alone.json()).unwrap();
        let slices = &json["responses"][0]["slices"];
        assert_eq!((&slices[0]["mean"], &slices[1]["mean"]), (&json!(1.5), &json!(2.5)));
        assert!(slices[0]["sd"].is_null() && slices[1]["sd"].is_null(), "{slices}");
        let pictures = alone.pictures();
        let (_, drawn) = pictures.iter().find(|(name, _)| name == "responses.svg").unwrap();
        // A bar has a dot of its own.
        assert_eq!(drawn.svg().unwrap().matches("<circle").count(), 2);
        let words = ["motor.friction=0.1,0.2", "simulate.drive=b"];
        let found = summary(&words, Sampling::Grid, of).responses;
        assert_eq!(found[0].slices[0].sd, None);
        assert!((found[1].slices[0].sd.unwrap() - core::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
    }

    /// Of drawn points each slice of a linear figure has a mean within the figure's values over that slice, and of 256
    /// points of a Sobol sequence each has the same number of rows.
    #[test]
    fn law_slices_of_a_range_have_their_own_rows() {
        let of = |scene: &Scene| scene.number("motor.friction");
        let over = ["motor.friction=0.2..1", "motor.restitution=0.1..0.9:log"];
        let found = summary(&over, Sampling::Sobol(256), of).responses;
        assert_eq!(found[0].slices.len(), 16);
        for slice in &found[0].slices {
            let off = slice.mean - slice.at;
            assert!(off.abs() <= 0.025 && slice.rows == 16, "{slice:?}");
        }
        assert!(found[1].log && found[1].slices.iter().all(|slice| slice.rows == 16), "{:?}", found[1]);
    }
}
