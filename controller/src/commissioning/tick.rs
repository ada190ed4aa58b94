//! The loop body of experiments: fuse what arrived, estimate, decide, drive.

use estimator::{AngleFilter, CameraFrame, Estimate, Health, Innovation, LdvSample};
use motor_model::{DriveCommand, Time};

use super::{ExperimentPhase, Experimenter};
use crate::in_flight::{Decision, Due, InFlight};
use crate::ports::{Drive, Sense};
use crate::tick::{Fused, fuse_for, without_decision};

/// The sensors, of which the experimenter hears the vibrometer as well.
struct Heard<'a, P> {
    ports: &'a mut P,
    experimenter: &'a mut Experimenter,
}

impl<P: Sense> Sense for Heard<'_, P> {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.ports.camera_frame()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        let sample = self.ports.ldv_sample()?;
        self.experimenter.hear(&sample);
        Some(sample)
    }
}

/// What a tick of experiments did; with a latency as [`crate::TickReport`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentReport {
    /// The estimate the decision was based on; `None` as in [`crate::TickReport`].
    pub estimate: Option<Estimate<f32>>,
    /// Whether it may be used.
    pub health: Health,
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<Innovation<f32>>,
    /// The command of the state machine.
    pub command: DriveCommand,
    /// The command that the amplifier applies.
    pub applied: DriveCommand,
    /// What the state machine does.
    pub phase: ExperimentPhase,
}

impl Decision for ExperimentReport {
    const UNDECIDED: Self = Self {
        estimate: None,
        health: Health::Waiting,
        camera: None,
        command: DriveCommand::OFF,
        applied: DriveCommand::OFF,
        phase: ExperimentPhase::Resting,
    };

    fn applied(&self) -> DriveCommand {
        self.applied
    }

    fn pass(&mut self) {
        (self.estimate, self.camera) = (None, None);
    }
}

/// One tick at `now`, to be called every [`crate::TICK_NANOS`], as [`crate::tick()`] is. Orders are given, and
/// responses taken, between two ticks.
pub fn tick_experiment<'d, F: AngleFilter<f32>, P: Sense + Drive>(
    filter: &mut F,
    experimenter: &mut Experimenter,
    in_flight: &'d mut InFlight<ExperimentReport>,
    now: Time,
    ports: &mut P,
) -> &'d mut ExperimentReport {
    let timing = ports.timing();
    let due = in_flight.due(now, timing);
    let mut heard = Heard { ports: &mut *ports, experimenter: &mut *experimenter };
    if due != Due::Decision {
        return without_decision(filter, in_flight, due, now, &mut heard);
    }
    let acts_at = timing.acts_at(now);
    let Fused { camera, estimate, health } = fuse_for(filter, now, acts_at, timing, &mut heard);
    let command = experimenter.decide(acts_at, estimate.as_ref(), health);
    if let Some(offsets) = experimenter.take_moved_resonances() {
        filter.retune(&offsets);
    }
    let applied = ports.drive(command);
    let (report, tells) = in_flight.exchange(
        now,
        timing,
        || experimenter.burst_end(),
        |decision| {
            decision.estimate = estimate;
            decision.health = health;
            decision.command = command;
            decision.applied = applied;
            decision.camera = None;
            decision.phase = experimenter.phase();
        },
    );
    report.camera = camera;
    if tells {
        filter.drive(now, report.applied);
    }
    report
}
