//! The loop that flies, [`controller::tick`], positioning the twin: first clockwise, then counter-clockwise, by one filter after the other.
//!
//! The twin stands in for the motor as well: this run compares machines, it does not judge the loop. Its camera quantises, delivers one
//! frame late, and now and then sends a frame twice or one that is far off, so that refusals are part of the run.

use core::fmt;

use controller::{Drive, PositionLoop, PositioningTuning, Sense, Target, TickReport, tick};
use estimator::{AngleFilter, CameraFrame, LdvSample};
use link::FilterKind;
use motor_model::{Angle, DriveCommand, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::digest::Digest;
use firmware::filter::SelectedFilter;

/// Ticks towards each target.
const TICKS_PER_TARGET: u64 = 15_000;

/// Targets in degrees, one after the other.
const TARGETS_DEG: [f64; 2] = [20.0, 16.0];

/// Distance from a target that counts as reached, in degrees.
const TOLERANCE_DEG: f64 = 0.02;

/// 10,000 frames a second.
const TICKS_PER_FRAME: u64 = 10;

/// The camera's resolution, 2 um at 3.9 mm, in units of 2^-32 turn.
const PIXEL_UNITS: i64 = 350_546;

/// Tracking noise, even over two pixels: without any, no rotor at rest would count as measured. An odd number near two pixels' golden section.
const DITHER_STEP: u64 = 433_299;

/// The vibrometer's noise: without any, a rotor at rest looks like a vibrometer without light.
const LDV_NOISE_M_S: f32 = 1e-5;

/// Every so many frames one is far off, and one comes twice.
const FRAMES_PER_OUTLIER: u64 = 97;
const FRAMES_PER_REPEAT: u64 = 61;

/// An outlier's error: 5 degrees.
const OUTLIER: Angle = Angle::from_units(59_652_324);

/// The filters, one after the other.
const KINDS: [FilterKind; 3] = [FilterKind::ConstantRate, FilterKind::ImpactAided, FilterKind::Twin];

/// Where the loop lies: larger than a stack should carry. Empty at first.
pub type LoopPlace = Option<PositionLoop<SelectedFilter>>;

/// What the run leaves behind. Its text is what the programs print: one `key value` a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopRun {
    /// FNV-1a, 64 bits, over the bits of all reports and of the twin's states.
    pub digest: u64,
    /// Ticks made.
    pub ticks: u64,
    /// The rotor's angle at the end, in units of 2^-32 turn.
    pub angle_units: i64,
}

impl LoopRun {
    /// Runs the loop in `place` and digests it.
    ///
    /// # Errors
    /// When the model refuses the nominal motor or the controller a target: never, unless their bounds are changed.
    pub fn compute(place: &mut LoopPlace) -> Result<Self, OutOfBounds> {
        let mut digest = Digest::default();
        let mut ticks = 0;
        let mut take = |report: &TickReport, state: &MotorState<f32>| {
            digest.report(report);
            digest.state(state);
            ticks += 1;
        };
        let mut angle_units = 0;
        for kind in KINDS {
            let end = follow_loop(place, || SelectedFilter::try_new(kind), tick, &mut take)?;
            angle_units = end.rotor.angle.angle().units();
        }
        Ok(Self { digest: digest.value(), ticks, angle_units })
    }
}

impl fmt::Display for LoopRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { digest, ticks, angle_units } = self;
        writeln!(f, "loop_digest {digest:#018x}")?;
        writeln!(f, "loop_ticks {ticks}")?;
        write!(f, "loop_angle_units {angle_units}")
    }
}

/// Positions the twin by a `filter` of its own for each target, each time by `tick_once`, shows `observe` each report and the state that it was made from, and returns the last
/// state.
pub(crate) fn follow_loop<F: AngleFilter<f32>>(
    place: &mut Option<PositionLoop<F>>,
    filter: impl Fn() -> Result<F, OutOfBounds>,
    mut tick_once: impl FnMut(&mut PositionLoop<F>, Time, &mut Instruments) -> TickReport,
    mut observe: impl FnMut(&TickReport, &MotorState<f32>),
) -> Result<MotorState<f32>, OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let step_s = PositionLoop::TICK_NANOS as f64 * 1e-9;
    let setup = MotorSetup::with_step(step_s);
    let motor = Motor::<f32>::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let mut instruments = Instruments::default();
    let mut ticks = 0;
    for target_deg in TARGETS_DEG {
        let target = Target::try_new(target_deg, TOLERANCE_DEG)?;
        let now = Time::from_nanos(ticks * PositionLoop::TICK_NANOS);
        let position_loop = put(place, &filter, target, now)?;
        for _ in 0..TICKS_PER_TARGET {
            let now = Time::from_nanos(ticks * PositionLoop::TICK_NANOS);
            instruments.look(&state, ticks, now);
            let report = tick_once(position_loop, now, &mut instruments);
            observe(&report, &state);
            motor.step(&mut state, report.applied);
            ticks += 1;
        }
    }
    Ok(state)
}

// Never inlined: what building a filter takes need not lie on the stack of every tick.
#[inline(never)]
pub(crate) fn put<'p, F>(
    place: &'p mut Option<PositionLoop<F>>,
    filter: &impl Fn() -> Result<F, OutOfBounds>,
    target: Target,
    now: Time,
) -> Result<&'p mut PositionLoop<F>, OutOfBounds> {
    let filter = filter()?;
    Ok(place.insert(PositionLoop::new(filter, target, PositioningTuning::default(), now)))
}

/// Camera and vibrometer on the twin, and an amplifier that does as it is told.
#[derive(Default)]
pub(crate) struct Instruments {
    /// The newest frame, still on its way.
    exposed: Option<CameraFrame>,
    /// The frame before it, arrived and not yet taken.
    arrived: Option<CameraFrame>,
    ldv: Option<LdvSample>,
}

impl Instruments {
    /// Sees the twin as it is at `now`.
    fn look(&mut self, state: &MotorState<f32>, ticks: u64, now: Time) {
        let noise_m_s = if ticks.is_multiple_of(2) { LDV_NOISE_M_S } else { -LDV_NOISE_M_S };
        self.ldv = Some(LdvSample { taken_at: now, velocity_m_s: state.rotor.velocity_m_s + noise_m_s });
        if !ticks.is_multiple_of(TICKS_PER_FRAME) {
            return;
        }
        let frame = ticks / TICKS_PER_FRAME;
        let dither = frame.wrapping_mul(DITHER_STEP).cast_signed().rem_euclid(2 * PIXEL_UNITS);
        let pixels = (state.rotor.angle.angle().units() + dither - PIXEL_UNITS).div_euclid(PIXEL_UNITS);
        let mut angle = Angle::from_units(pixels * PIXEL_UNITS).wrapped();
        if frame % FRAMES_PER_OUTLIER == 1 {
            angle = angle.plus(OUTLIER).wrapped();
        }
        self.arrived = self.exposed;
        if frame % FRAMES_PER_REPEAT != 1 {
            self.exposed = Some(CameraFrame { exposed_at: now, angle });
        }
    }
}

impl Sense for Instruments {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.arrived.take()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.take()
    }
}

impl Drive for Instruments {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::PositioningPhase;
    use estimator::{Rejection, Verdict};
    use motor_model::DriveMode;

    /// Equal digests say little of code that the run never enters.
    #[test]
    fn law_the_runs_reach_what_the_loop_can_do() {
        KINDS.into_iter().for_each(reaches_all);
    }

    fn reaches_all(kind: FilterKind) {
        let (mut modes, mut phases, mut verdicts) = ([0; 2], [0; 5], [0; 5]);
        follow_loop(
            &mut None,
            || SelectedFilter::try_new(kind),
            tick,
            |report, _| {
                match report.applied.mode() {
                    Some(DriveMode::B) => modes[0] += 1,
                    Some(DriveMode::C) => modes[1] += 1,
                    None => (),
                }
                match report.phase {
                    PositioningPhase::Cruise { .. } => phases[0] += 1,
                    PositioningPhase::Settling => phases[1] += 1,
                    PositioningPhase::Holding => phases[2] += 1,
                    PositioningPhase::Burst { .. } => phases[3] += 1,
                    PositioningPhase::Waiting(_) => phases[4] += 1,
                    PositioningPhase::Stopped(why) => panic!("{why:?}"),
                }
                match report.camera.map(|innovation| innovation.verdict) {
                    Some(Verdict::Used) => verdicts[0] += 1,
                    Some(Verdict::Restarted) => verdicts[1] += 1,
                    Some(Verdict::Rejected(Rejection::Gate)) => verdicts[2] += 1,
                    Some(Verdict::Rejected(Rejection::Duplicate)) => verdicts[3] += 1,
                    Some(Verdict::Rejected(Rejection::Repeated)) => verdicts[4] += 1,
                    Some(Verdict::Rejected(_)) | None => (),
                }
            },
        )
        .unwrap();
        let mut all = modes.iter().chain(&phases).chain(&verdicts);
        assert!(all.all(|&n| n > 0), "{modes:?} {phases:?} {verdicts:?}");
        assert!(verdicts[0] > 1000, "{verdicts:?}");
    }
}
