//! The loop body that flies and that is simulated: fuse what arrived, estimate, decide, drive.

use estimator::{ConstantRate, ConstantRateTuning, Estimate, Innovation, Motion, RestDetector, RestTuning};
use motor_model::{DriveCommand, DriveMode, Time};

use crate::ports::{Drive, LDV_SAMPLES_PER_TICK_MAX, Sense};
use crate::positioning::{Phase, Positioning, PositioningTuning, Target};

/// Everything the loop remembers from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct PositionLoop {
    filter: ConstantRate<f32>,
    rest: RestDetector<f32>,
    positioning: Positioning,
    applied: DriveCommand,
    struck_by: DriveMode,
}

impl PositionLoop {
    /// Period of the loop in ns.
    pub const TICK_NANOS: u64 = 10_000;

    /// A loop that will position to `target` from `now` on.
    pub fn new(target: Target, tuning: PositioningTuning, now: Time) -> Self {
        Self {
            filter: ConstantRate::new(ConstantRateTuning::default()),
            rest: RestDetector::new(&RestTuning::default()),
            positioning: Positioning::new(target, tuning, now),
            applied: DriveCommand::OFF,
            // Until the rotor is seen to be quiet it may be moving in the wilder mode.
            struck_by: DriveMode::B,
        }
    }

    /// What is known of the rotor's motion: the drive that is really applied, otherwise what the LDV hears.
    fn motion(&self, now: Time) -> Motion {
        match (self.applied.mode(), self.rest.quiet_since(now)) {
            (Some(mode), _) => Motion::Struck(mode),
            (None, Some(_)) => Motion::Quiet,
            (None, None) => Motion::Struck(self.struck_by),
        }
    }
}

/// What a tick did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The estimate the decision was based on; `None` before the first camera frame.
    pub estimate: Option<Estimate<f32>>,
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<Innovation<f32>>,
    /// The command given.
    pub command: DriveCommand,
    /// The command really applied.
    pub applied: DriveCommand,
    /// What positioning is doing.
    pub phase: Phase,
}

/// One tick of the loop at `now`.
///
/// To be called every [`PositionLoop::TICK_NANOS`]; a late or missed tick costs accuracy of the cut-off, nothing else, since every
/// measurement carries its own time. Takes at most one camera frame and [`LDV_SAMPLES_PER_TICK_MAX`] vibrometer samples.
pub fn tick<P: Sense + Drive>(state: &mut PositionLoop, now: Time, ports: &mut P) -> Report {
    for _ in 0..LDV_SAMPLES_PER_TICK_MAX {
        let Some(sample) = ports.ldv_sample() else { break };
        state.rest.observe(&sample);
    }
    let motion = state.motion(now);
    let camera = ports.camera_frame().map(|frame| state.filter.update_camera(&frame, motion));
    let estimate = state.filter.estimate(now, motion);
    let command = state.positioning.decide(now, estimate.as_ref());
    state.applied = ports.drive(command);
    state.struck_by = state.applied.mode().unwrap_or(state.struck_by);
    Report { estimate, camera, command, applied: state.applied, phase: state.positioning.phase() }
}
