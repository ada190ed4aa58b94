//! The stream of records of a run: one record a tick, with all that happened in it.
//!
//! ```text
//! tick driver ----> RunRecord ----> Observer: a log, a report, a table
//! a log, read -------^
//! ```
//!
//! A record of tick k, which ends at `at`, holds in this order:
//!
//! | field | what it is | of a recording without simulation |
//! |---|---|---|
//! | [`RunRecord::truth`], [`RunRecord::impacts`] | the rotor at `at`, and its impacts since the last tick | none |
//! | [`RunRecord::ldv_samples`] | vibrometer samples that the filter took in, oldest first | yes |
//! | [`RunRecord::camera_frame`], [`RunRecord::marked`] | the frame that it took in after them | yes, without marks |
//! | [`RunRecord::innovation`] | what became of the frame: innovation, variance, used or refused, and why | replayed |
//! | [`RunRecord::estimate`], [`RunRecord::health`] | the estimate at `at`, its covariance, its health | replayed |
//! | [`RunRecord::asked`], [`RunRecord::applied`] | the drive from `at` on: asked for, and applied | applied |
//! | [`RunRecord::task`] | what the controller does: phase of a move, or rate asked for | none |
//!
//! This order is that of [`controller::tick`]. A filter that is given samples, frame and drive of each record in it
//! computes the same bits.
//!
//! A run gives its records to whoever asks in its `intervene`:
//!
//! ```
//! use std::ops::ControlFlow;
//! use simulation::Scene;
//! use simulation::runs::position;
//! use simulation::runs::record::{Observer, RunRecord};
//!
//! /// Counts the frames that were refused.
//! struct Refused(u32);
//!
//! impl Observer for Refused {
//!     fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
//!         self.0 += u32::from(record.is_refused());
//!         ControlFlow::Continue(())
//!     }
//! }
//!
//! let mut scene = Scene::default();
//! scene.set("position.to_deg", "2")?;
//! let mut refused = Refused(0);
//! let outcome = position::run_with(&scene, |run, moment| refused.observe(&run.record(moment)))?;
//! assert!(outcome.is_continue());
//! # Ok::<(), simulation::runs::RunError>(())
//! ```
//!
//! Nothing is computed for a record that is not asked for, and a run has the same bits with observers and without: a
//! record refers to what the driver keeps anyway.

mod words;

pub use words::{health_level, mode_word, verdict_word};

use std::ops::ControlFlow;

use controller::rate::RateStop;
use controller::{PositioningPhase, RateReport, TickReport};
use estimator::{CameraFrame, Estimate, Health, Innovation, LdvSample, Verdict};
use motor_model::{Angle, DriveCommand, Time};

use crate::runs::tick_driver::{Moment, TickDriver, TickProgram};
use crate::world::instruments::camera::MarkedPose;
use crate::world::pose::RotorTilt;
use crate::world::rig::PlantStep;

/// The rotor as it truly is, which only the simulation knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Its angle, as seen from above.
    pub angle: Angle,
    /// The integral of its rate about its own axis: what a gyroscope on it turns by.
    pub own_axis_angle: Angle,
    /// Its rate in rad/s.
    pub rate_rad_s: f64,
    /// Its height in m above that of a rotor at rest on teeth at rest.
    pub height_m: f64,
    /// Its vertical velocity in m/s, upwards positive.
    pub velocity_m_s: f64,
    /// Tilt and shift of a rotor that tilts.
    pub tilt: Option<RotorTilt>,
}

impl Truth {
    /// The same with angles from `zero` on.
    #[must_use]
    pub fn since(self, zero: Angle) -> Self {
        let [angle, own_axis_angle] = [self.angle, self.own_axis_angle].map(|angle| angle.minus(zero));
        Self { angle, own_axis_angle, ..self }
    }
}

/// An impact, to the step of the plant in which it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// End of that step.
    pub at: Time,
    /// Vertical velocity of the rotor's centre in m/s before and after that step, upwards positive.
    pub velocity_m_s: [f64; 2],
    /// Rate of the rotor in rad/s before and after it.
    pub rate_rad_s: [f64; 2],
}

impl Impact {
    /// That of a step of the plant, if the rotor met anything in it.
    pub fn of(step: &PlantStep) -> Option<Self> {
        let PlantStep { before, after, met, .. } = step;
        met.then_some(Self {
            at: after.at,
            velocity_m_s: [before.velocity_m_s, after.velocity_m_s],
            rate_rad_s: [before.rate_rad_s, after.rate_rad_s],
        })
    }

    /// The vertical impulse in N s on a rotor of this mass in kg: of everything that it met in the step.
    pub fn impulse_n_s(&self, rotor_mass_kg: f64) -> f64 {
        rotor_mass_kg * (self.velocity_m_s[1] - self.velocity_m_s[0])
    }

    /// The kick: the change of the rotor's rate, in rad/s.
    pub fn kick_rad_s(&self) -> f64 {
        self.rate_rad_s[1] - self.rate_rad_s[0]
    }
}

/// What the controller does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// There is no controller: a recording from elsewhere.
    None,
    /// It moves the rotor to an angle.
    Position(PositioningPhase),
    /// It moves the rotor to an angle on a microcontroller, which tells its phase in a word.
    Told(&'static str),
    /// It holds a rate.
    Rate {
        /// The rate asked for, in rad/s.
        wanted_rad_s: f32,
        /// The angle that the rotor should have; `None` before the first usable estimate.
        reference: Option<Angle>,
        /// Why it is held no more; `None` while it is.
        stopped: Option<RateStop>,
    },
}

/// One tick of a run. The module's head says in which order its parts happen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunRecord<'a> {
    /// End of the tick.
    pub at: Time,
    /// The rotor at that instant; `None` where nobody knows it.
    pub truth: Option<Truth>,
    /// Its impacts since the last tick, oldest first.
    pub impacts: &'a [Impact],
    /// Vibrometer samples, oldest first.
    pub ldv_samples: &'a [LdvSample],
    /// The camera frame.
    pub camera_frame: Option<CameraFrame>,
    /// What the marks of that frame showed.
    pub marked: Option<MarkedPose>,
    /// What became of that frame.
    pub innovation: Option<Innovation<f32>>,
    /// The estimate; `None` before the first frame.
    pub estimate: Option<Estimate<f32>>,
    /// Whether the estimate may be used.
    pub health: Health,
    /// The drive that the controller asked for.
    pub asked: DriveCommand,
    /// The drive that is applied from `at` on.
    pub applied: DriveCommand,
    /// What the controller does.
    pub task: Task,
}

impl RunRecord<'_> {
    /// The same record without its impacts and samples, to be kept.
    #[inline]
    pub fn without_lists(&self) -> RunRecord<'static> {
        let Self {
            at, truth, camera_frame, marked, innovation, estimate, health, asked, applied, task, ..
        } = *self;
        RunRecord {
            at,
            truth,
            impacts: &[],
            ldv_samples: &[],
            camera_frame,
            marked,
            innovation,
            estimate,
            health,
            asked,
            applied,
            task,
        }
    }

    /// Whether a frame was refused.
    pub fn is_refused(&self) -> bool {
        self.innovation.is_some_and(|innovation| matches!(innovation.verdict, Verdict::Rejected(_)))
    }

    /// Estimated less true angle in milli-degrees, where both are known.
    pub fn error_mdeg(&self) -> Option<f64> {
        let truth = self.truth?;
        self.estimate.map(|estimate| 1e3 * estimate.angle.minus(truth.angle).degrees())
    }
}

/// Takes the records of a run, one after the other.
pub trait Observer {
    /// Takes a record. [`ControlFlow::Break`] ends the run early.
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()>;
}

/// Takes nothing.
impl Observer for () {
    fn observe(&mut self, _: &RunRecord) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// An observer that may be there.
impl<O: Observer> Observer for Option<O> {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.as_mut().map_or(ControlFlow::Continue(()), |observer| observer.observe(record))
    }
}

/// Two observers: the first one that breaks ends the run.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.0.observe(record)?;
        self.1.observe(record)
    }
}

/// What a record takes from the report of a tick of a controller's loop.
#[derive(Clone, Copy, Debug)]
pub struct LoopParts {
    estimate: Option<Estimate<f32>>,
    health: Health,
    innovation: Option<Innovation<f32>>,
    asked: DriveCommand,
    applied: DriveCommand,
    task: Task,
}

/// The report of a tick of a controller's loop.
pub trait LoopReport {
    /// What a record takes from it.
    fn parts(&self) -> LoopParts;
}

/// A program that drives and estimates nothing.
impl LoopReport for DriveCommand {
    fn parts(&self) -> LoopParts {
        LoopParts {
            estimate: None,
            health: Health::Waiting,
            innovation: None,
            asked: *self,
            applied: *self,
            task: Task::None,
        }
    }
}

impl LoopReport for TickReport {
    fn parts(&self) -> LoopParts {
        let Self { estimate, health, camera, command, applied, phase, .. } = *self;
        let task = Task::Position(phase);
        LoopParts { estimate, health, innovation: camera, asked: command, applied, task }
    }
}

impl LoopReport for RateReport {
    fn parts(&self) -> LoopParts {
        let Self { estimate, health, camera, command, applied, wanted_rad_s, reference, stopped, .. } = *self;
        let task = Task::Rate { wanted_rad_s, reference, stopped };
        LoopParts { estimate, health, innovation: camera, asked: command, applied, task }
    }
}

impl<P: TickProgram<Report: LoopReport>> TickDriver<P> {
    /// The record of the last tick, whose end is `moment`.
    pub fn record(&self, moment: &Moment<P::Report>) -> RunRecord<'_> {
        let measurements = self.measurements();
        let LoopParts { estimate, health, innovation, asked, applied, task } = moment.report.parts();
        RunRecord {
            at: moment.at,
            truth: Some(Truth {
                angle: moment.angle,
                own_axis_angle: moment.own_axis_angle,
                rate_rad_s: moment.rate_rad_s,
                height_m: self.plant().height_m(),
                velocity_m_s: self.plant().rotor().velocity_m_s,
                tilt: moment.tilt,
            }),
            impacts: self.impacts(),
            ldv_samples: &measurements.ldv_samples,
            camera_frame: measurements.camera_frame,
            marked: measurements.marked,
            innovation,
            estimate,
            health,
            asked,
            applied,
            task,
        }
    }
}

#[cfg(test)]
mod tests;
