//! The time of a step in steady motion.
//!
//! Nothing else of the process runs meanwhile. Each round times one batch of each method. The least time over the
//! rounds counts, because other work of the machine can only add to it.

use std::hint::black_box;
use std::time::Instant;

use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, Motor, Real};
use serde::Serialize;

use super::method::{Measurement, StepMethod, fast_impacts, start};
use super::reference::state::ReferenceState;
use simulation::runs::RunError;
use simulation::runs::simulate::steps_in;

/// Number and length of the timed batches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimingEffort {
    /// Number of batches of each method.
    pub rounds: u32,
    /// Time from rest before a batch.
    pub settle_s: f64,
    /// Simulated time of a batch.
    pub time_s: f64,
    /// Simulated time of a batch of the ball on the plate.
    pub plate_s: f64,
}

/// The cost of a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepCost {
    /// Time of a step, impacts included.
    pub ns_per_step: f64,
    /// Time of a simulated millisecond.
    pub ns_per_ms: f64,
    /// Simulated time over time taken.
    pub times_real_time: f64,
}

impl StepCost {
    /// The cost of steps of `step_s`, when `time_s` of simulated time takes `taken_s`.
    pub fn new(step_s: f64, time_s: f64, taken_s: f64) -> Self {
        Self {
            ns_per_step: 1e9 * taken_s * step_s / time_s,
            ns_per_ms: 1e6 * taken_s / time_s,
            times_real_time: time_s / taken_s,
        }
    }
}

/// The least time of a batch of each of `count` methods in s. Each round times one batch of each.
///
/// # Errors
/// When a batch fails.
pub fn least_times_s<E>(
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

/// The costs of all `methods` at full drive of modes B and C.
///
/// # Errors
/// When a method's step is out of bounds.
pub fn costs(methods: &[StepMethod], effort: TimingEffort) -> Result<Vec<[StepCost; 2]>, RunError> {
    let of_mode = |mode| {
        let least = least_times_s(methods.len(), effort.rounds, |index| {
            let method = &methods[index];
            let TimingEffort { settle_s, time_s, .. } = effort;
            let (start, command) = (ReferenceState::default(), DriveCommand::full(mode));
            let batch = TimedBatch { start, command, settle_s, time_s, step_s: method.step_s };
            method.apply(AmplitudeVariation::default(), &batch)
        })?;
        let cost =
            |(method, &taken_s): (&StepMethod, &f64)| StepCost::new(method.step_s, effort.time_s, taken_s);
        Ok::<Vec<StepCost>, RunError>(methods.iter().zip(&least).map(cost).collect())
    };
    let (b, c) = (of_mode(DriveMode::B)?, of_mode(DriveMode::C)?);
    Ok(b.into_iter().zip(c).map(|(b, c)| [b, c]).collect())
}

/// Measures the time of a batch of steps in s.
pub struct TimedBatch {
    /// Where the motor starts.
    pub start: ReferenceState,
    /// Its drive.
    pub command: DriveCommand,
    /// Time before the batch.
    pub settle_s: f64,
    /// Simulated time of the batch.
    pub time_s: f64,
    /// The motor's step.
    pub step_s: f64,
}

impl Measurement for TimedBatch {
    type Outcome = f64;

    fn measure<T: Real>(&self, motor: &Motor<T>) -> f64 {
        let command = black_box(self.command);
        let mut state = start(&self.start);
        for _ in 0..steps_in(self.settle_s, self.step_s) {
            motor.step(&mut state, command);
        }
        let steps = steps_in(self.time_s, self.step_s);
        let start = Instant::now();
        let mut fast = 0;
        for _ in 0..steps {
            fast += fast_impacts(motor, &mut state, command);
        }
        let taken_s = start.elapsed().as_secs_f64();
        black_box((state, fast));
        taken_s
    }
}
