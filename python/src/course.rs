//! The course of a run in closed loop: truth, estimate and drive at every so many ticks.

use std::path::Path;

use host_sim::log::{Ending, LogOptions, LogRecorder};
use simulation::runs::record::{Observer as _, RunRecord, Task, health_level};
use simulation::scene::Scene;
use std::ops::ControlFlow;

use motor_model::{Angle, Time, math};

use crate::drives::signed;
use crate::errors::Error;
use crate::interruption::Watch;
use crate::tables::{Column, NumberColumns, Table};

/// The numbers of a row, by the names that logs use.
const NUMBERS: [&str; 10] = [
    "time_s",
    "truth_angle_deg",
    "truth_rate_rad_s",
    "estimate_angle_deg",
    "estimate_angle_sd_mdeg",
    "estimate_rate_rad_s",
    "estimate_rate_sd_rad_s",
    "wanted_rate_rad_s",
    "reference_angle_deg",
    "drive",
];

/// Keeps a row of every so many ticks.
#[derive(Debug)]
pub struct Course {
    every: u64,
    ticks: u64,
    numbers: NumberColumns<10>,
    health: Vec<u8>,
}

impl Course {
    /// One row every `every` ticks; none for 0.
    pub fn new(every: u64) -> Self {
        Self { every, ticks: 0, numbers: NumberColumns::new(NUMBERS), health: Vec::new() }
    }

    /// Counts a tick; whether its record is to be taken.
    #[inline]
    fn wants_next(&mut self) -> bool {
        self.ticks += 1;
        self.every > 0 && self.ticks.is_multiple_of(self.every)
    }

    fn take(&mut self, record: &RunRecord) {
        let truth = record.truth.unwrap_or_default();
        let estimate = record.estimate;
        let of = |number: Option<f64>| number.unwrap_or(f64::NAN);
        let sd = |variance: f32| math::sqrt(f64::from(variance));
        let (wanted, reference) = match record.task {
            Task::Rate { wanted_rad_s, reference, .. } => {
                (f64::from(wanted_rad_s), of(reference.map(Angle::degrees)))
            }
            Task::None | Task::Position(_) | Task::Told(_) => (f64::NAN, f64::NAN),
        };
        self.numbers.push([
            record.at.seconds_since(Time::ZERO),
            truth.angle.degrees(),
            truth.rate_rad_s,
            of(estimate.map(|estimate| estimate.angle.degrees())),
            of(estimate.map(|estimate| 1e3 * sd(estimate.angle_rad2).to_degrees())),
            of(estimate.map(|estimate| f64::from(estimate.rate_rad_s))),
            of(estimate.map(|estimate| sd(estimate.rate_rad2_s2))),
            wanted,
            reference,
            signed(record.applied),
        ]);
        self.health.push(health_level(record.health));
    }

    /// As a table.
    pub fn table(self) -> Table {
        Table::from(self.numbers).with("health", Column::Codes(self.health))
    }
}

/// What sees a run: a course, a log where one is asked for, and the watch.
pub struct RunObserver<'a> {
    /// The course.
    pub course: Course,
    log: Option<LogRecorder>,
    watch: &'a Watch,
}

impl<'a> RunObserver<'a> {
    /// Of a run of `command` on `scene`.
    ///
    /// # Errors
    /// When the log's kind is not known or its file cannot be written.
    pub fn open(
        (command, scene): (&'static str, &Scene),
        every: u64,
        log: Option<(&Path, u64)>,
        watch: &'a Watch,
    ) -> Result<Self, Error> {
        let recorder = |(path, every): (&Path, u64)| {
            LogRecorder::create(path, LogOptions { every }, command, scene, watch.stop_mark())
        };
        Ok(Self { course: Course::new(every), log: log.map(recorder).transpose()?, watch })
    }

    /// Takes a tick, whose record is made only where it is kept.
    #[inline]
    pub fn take<'r>(&mut self, record: impl FnOnce() -> RunRecord<'r>) -> ControlFlow<()> {
        let wanted = self.course.wants_next();
        if let Some(log) = &mut self.log {
            let record = record();
            if wanted {
                self.course.take(&record);
            }
            return log.observe(&record);
        }
        if wanted {
            self.course.take(&record());
        }
        if self.watch.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Ends the log of a run that gave `result`, in JSON, and gives the course.
    ///
    /// # Errors
    /// When the log's end cannot be written.
    pub fn finish(self, result: &str) -> Result<Table, Error> {
        self.log.map(|log| log.finish(Ending::Whole(result))).transpose()?;
        Ok(self.course.table())
    }

    /// Why the run was ended.
    pub fn stopped(self) -> Error {
        let stopped = self.log.map(|log| log.finish(Ending::Interrupted));
        // Without a log only the watch ends a run.
        self.watch.check();
        match stopped {
            Some(Err(error)) => error.into(),
            _ => pyo3::exceptions::PyRuntimeError::new_err("the run was ended").into(),
        }
    }
}
