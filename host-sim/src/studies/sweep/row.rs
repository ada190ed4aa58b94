//! One row of a sweep: its figures, or why it has none.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde_json::Value;

use super::figure::{self, Found};
use super::{FailureCounts, SweepError, SweepPlan};
use simulation::runs::RunError;
use simulation::scene::Scene;

thread_local! {
    /// Whether this thread makes a row.
    static MAKES_A_ROW: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread makes a row: what panics there is told by the row.
pub fn makes_a_row() -> bool {
    MAKES_A_ROW.get()
}

/// What `run` gives, or what it panicked with.
fn caught<T>(run: impl FnOnce() -> T) -> Result<T, Box<dyn Any + Send>> {
    MAKES_A_ROW.set(true);
    let result = catch_unwind(AssertUnwindSafe(run));
    MAKES_A_ROW.set(false);
    result
}

/// A row that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its place among all rows.
    pub number: u64,
    /// The seed of its run.
    pub seed: u64,
    /// Its values as text, in the order of the axes.
    pub values: Vec<String>,
    /// What it gave.
    pub outcome: RowOutcome,
    /// Time that it took on this machine in s.
    pub time_s: f64,
}

/// What a row gave.
#[derive(Clone, Debug, PartialEq)]
pub enum RowOutcome {
    /// Its figures, in the order of their paths; `None` where the result has `null`.
    Figures(Vec<Option<f64>>),
    /// Nothing, and why.
    Failed {
        /// The kind of failure.
        failure: Failure,
        /// The reason, on one line.
        reason: String,
    },
}

/// Why a row has no figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Its scene was refused.
    Refused,
    /// A number was not finite.
    Diverged,
    /// A slip in the program.
    Panicked,
    /// Its result lacks a figure.
    NoFigure,
}

impl Failure {
    const ALL: [Self; 4] = [Self::Refused, Self::Diverged, Self::Panicked, Self::NoFigure];

    /// Its word in the tables.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Refused => "refused",
            Self::Diverged => "diverged",
            Self::Panicked => "panicked",
            Self::NoFigure => "no_figure",
        }
    }

    /// The failure that a word of the tables means.
    pub(super) fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|failure| failure.word() == word)
    }

    /// Counts it.
    pub(super) fn count(self, counts: &mut FailureCounts) {
        match self {
            Self::Refused => counts.refused += 1,
            Self::Diverged => counts.diverged += 1,
            Self::Panicked => counts.panicked += 1,
            Self::NoFigure => counts.no_figure += 1,
        }
    }
}

impl SweepPlan {
    /// Makes row `number`.
    pub fn make(&self, number: u64) -> Row {
        self.make_with(number, |scene| self.command.result(scene, self.sample))
    }

    /// Makes row `number` with the result that `run` gives for its scene.
    ///
    /// A run that panics is a slip in the program. It costs this row and no other: what the run had is dropped, and
    /// nothing outside it was changed, since a run takes its scene alone.
    pub(super) fn make_with(&self, number: u64, run: impl Fn(&Scene) -> Result<Value, RunError>) -> Row {
        let (point, repeat) = self.place_of(number);
        let values = self.values(point);
        let begun = Instant::now();
        let scene = self.scene_of(&values, repeat);
        let seed = scene.as_ref().map_or_else(|_| self.scene.seed(), Scene::seed);
        let outcome = match scene {
            Err(error) => failed(Failure::Refused, &error),
            Ok(scene) => match caught(|| run(&scene)) {
                Err(payload) => failed(Failure::Panicked, &said(payload.as_ref())),
                Ok(Err(error @ RunError::Scene(_))) => failed(Failure::Refused, &error),
                Ok(Err(error)) => failed(Failure::Diverged, &error),
                Ok(Ok(result)) => self.figures_of(&result),
            },
        };
        Row { number, seed, values, outcome, time_s: begun.elapsed().as_secs_f64() }
    }

    fn figures_of(&self, result: &Value) -> RowOutcome {
        let mut figures = Vec::with_capacity(self.figures.len());
        for path in &self.figures {
            match figure::find(result, path) {
                Found::Number(number) => figures.push(Some(number)),
                Found::Empty => figures.push(None),
                Found::Nothing => {
                    let command = self.command.name();
                    return failed(Failure::NoFigure, &figure::missing(command, result, path));
                }
            }
        }
        RowOutcome::Figures(figures)
    }

    /// Refuses figures that the first row does not have; other reasons of the first row to fail are its own.
    ///
    /// # Errors
    /// When the result of the first row has none of a path, or no figure was named.
    pub fn check_figures(&self) -> Result<Row, SweepError> {
        let kept = Mutex::new(None);
        let row = self.make_with(0, |scene| {
            let result = self.command.result(scene, self.sample)?;
            *kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(result.clone());
            Ok(result)
        });
        let Some(result) = kept.into_inner().unwrap_or_else(PoisonError::into_inner) else { return Ok(row) };
        if self.figures.is_empty() {
            return Err(figure::unnamed(&result));
        }
        let lacking = self.figures.iter().find(|path| figure::find(&result, path) == Found::Nothing);
        lacking.map_or(Ok(row), |path| Err(figure::missing(self.command.name(), &result, path)))
    }
}

fn failed(failure: Failure, reason: &impl std::fmt::Display) -> RowOutcome {
    // One line: a reason may hold what a user has typed.
    let reason = reason.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    RowOutcome::Failed { failure, reason }
}

/// What a panic has said.
fn said(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().cloned();
    text.or_else(|| payload.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::{Sampling, SweepRequest, SweptCommand};
    use super::*;
    use serde_json::json;

    fn plan() -> SweepPlan {
        let request = SweepRequest {
            command: SweptCommand::Simulate,
            sample: 1,
            over: vec!["motor.friction=0.1..0.4:4".to_owned()],
            sampling: Sampling::Grid,
            repeats: 3,
            figures: vec!["x".to_owned(), "y.0".to_owned()],
        };
        SweepPlan::new(&Scene::default(), request, |_, _| true, &|_| Ok(())).unwrap()
    }

    /// A run that panics, one that diverges, one that is refused and one without a figure are rows with their seed and
    /// their reason; the row after them has its figures.
    #[test]
    fn exact_a_run_that_fails_costs_its_own_row() {
        let plan = plan();
        assert_eq!(plan.rows(), 12);
        let run = |scene: &Scene| {
            let friction = scene.number("motor.friction");
            match (scene.seed(), friction < 0.15) {
                (1, true) => panic!("index {} is\nout of bounds", 3),
                (2, true) => Err(RunError::Diverged { quantity: "the angle", time_s: 0.5 }),
                (3, true) => Ok(json!({"x": 1.0})),
                _ => Ok(json!({"x": friction, "y": [null]})),
            }
        };
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| ()));
        let rows: Vec<Row> = (0..4).map(|number| plan.make_with(number, run)).collect();
        std::panic::set_hook(hook);
        for (row, (seed, failure, words)) in rows.iter().zip([
            (1, Failure::Panicked, "index 3 is out of bounds"),
            (2, Failure::Diverged, "the angle is no longer finite after 0.5 s"),
            (3, Failure::NoFigure, "the result of simulate has no figure y.0"),
        ]) {
            let RowOutcome::Failed { failure: found, reason } = &row.outcome else { panic!("{row:?}") };
            assert_eq!((row.seed, *found), (seed, failure));
            assert!(reason.contains(words), "{reason}");
        }
        assert_eq!((rows[3].seed, &rows[3].values), (1, &vec!["0.2".to_owned()]));
        assert_eq!(rows[3].outcome, RowOutcome::Figures(vec![Some(0.2), None]));
    }
}
