//! What a step costs in steady motion.
//!
//! Nothing else of the process runs meanwhile. Everyone's batch is timed in turn, round after round, and the least time of each counts: what
//! else the machine does can only add.

use std::hint::black_box;
use std::time::Instant;

use motor_model::{AmplitudeVariation, DriveCommand, DriveMode};
use serde::Serialize;

use super::contestant::{Contestant, Question, Twin};
use crate::studies::StudyError;
use crate::studies::step_accuracy::reference::ReferenceState;

/// How much is timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Batches of each.
    pub rounds: u32,
    /// Time from rest before a batch.
    pub settle_s: f64,
    /// Simulated time of a batch.
    pub time_s: f64,
    /// Simulated time of a batch of the ball on the plate.
    pub plate_s: f64,
}

/// What simulating costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// Time a step takes, impacts included.
    pub ns_per_step: f64,
    /// Time a simulated millisecond takes.
    pub ns_per_ms: f64,
    /// Simulated time per time taken.
    pub times_real_time: f64,
}

impl Cost {
    /// Of steps of `step_s`, when `time_s` of simulated time takes `taken_s`.
    pub fn new(step_s: f64, time_s: f64, taken_s: f64) -> Self {
        Self {
            ns_per_step: 1e9 * taken_s * step_s / time_s,
            ns_per_ms: 1e6 * taken_s / time_s,
            times_real_time: time_s / taken_s,
        }
    }
}

/// The least time of one batch of each of `count` in turn, over all rounds, in s.
///
/// # Errors
/// When a batch fails.
pub fn least_s<E>(
    count: usize,
    rounds: u32,
    mut batch: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Vec<f64>, E> {
    let mut least = vec![f64::INFINITY; count];
    for _ in 0..rounds {
        for (index, least_s) in least.iter_mut().enumerate() {
            *least_s = least_s.min(batch(index)?);
        }
    }
    Ok(least)
}

/// The costs of all `contestants` at full drive of modes B and C.
///
/// # Errors
/// When a contestant's step is out of bounds.
pub fn costs(contestants: &[Contestant], effort: Effort) -> Result<Vec<[Cost; 2]>, StudyError> {
    let of_mode = |mode| {
        let least = least_s(contestants.len(), effort.rounds, |index| {
            let contestant = &contestants[index];
            let batch = Batch { command: DriveCommand::full(mode), effort, step_s: contestant.step_s };
            contestant.examine(AmplitudeVariation::default(), &batch)
        })?;
        let cost = |(contestant, &taken_s): (&Contestant, &f64)| {
            Cost::new(contestant.step_s, effort.time_s, taken_s)
        };
        Ok::<Vec<Cost>, StudyError>(contestants.iter().zip(&least).map(cost).collect())
    };
    let (b, c) = (of_mode(DriveMode::B)?, of_mode(DriveMode::C)?);
    Ok(b.into_iter().zip(c).map(|(b, c)| [b, c]).collect())
}

/// Asks a twin for the time that a batch of steps takes, in s.
struct Batch {
    command: DriveCommand,
    effort: Effort,
    step_s: f64,
}

impl Question for Batch {
    type Answer = f64;

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
    fn ask(&self, twin: &impl Twin) -> f64 {
        let command = black_box(self.command);
        let mut state = twin.state(&ReferenceState::default());
        let steps_in = |time_s: f64| (time_s / self.step_s).round() as u64;
        for _ in 0..steps_in(self.effort.settle_s) {
            twin.step(&mut state, command);
        }
        let start = Instant::now();
        let mut fast = 0;
        for _ in 0..steps_in(self.effort.time_s) {
            fast += twin.step(&mut state, command);
        }
        let taken_s = start.elapsed().as_secs_f64();
        black_box((state, fast));
        taken_s
    }
}
