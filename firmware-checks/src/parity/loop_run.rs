//! The loop body, [`controller::tick_by`], positions the twin, first clockwise, then counter-clockwise, with one filter
//! after the other.
//!
//! The twin simulates the motor as well, because this run compares machines and does not judge the loop. Its camera
//! follows two marks, quantises and delivers each frame one frame late. Some frames come twice, and some are outliers,
//! so that refusals are part of the run. Its vibrometer takes two samples a tick with the noise of the default scene's:
//! how many samples there are, and what looks like an impact, decides on the work of a tick.

use core::fmt;

use controller::resonance_tracker::ResonanceTracker;
use controller::{
    Drive, InFlight, LoopTiming, PositionLoop, Positioning, PositioningTuning, ResponseMap, Sense, Target,
    TickReport, tick_by,
};
use estimator::{CameraFrame, Instruments, LdvSample};
use link::FilterKind;
use motor_model::{Angle, DriveCommand, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

use super::digest::Digest;
use firmware::filter::SelectedFilter;

/// Ticks towards each target.
pub(crate) const TICKS_PER_TARGET: u64 = 15_000;

/// Targets in degrees, one after the other.
pub(crate) const TARGETS_DEG: [f64; 2] = [20.0, 16.0];

/// Tolerance of each target, in degrees.
pub(crate) const TOLERANCE_DEG: f64 = 0.02;

/// Ticks from one camera frame to the next: 10,000 frames a second.
pub(crate) const TICKS_PER_FRAME: u64 = 10;

/// The camera's resolution, 2 um at 3.9 mm, in units of 2^-32 turn.
pub(crate) const PIXEL_UNITS: i64 = 350_546;

/// Steps of the dither of each mark, which is uniform over two pixels: without noise the filter would not accept frames
/// of a rotor at rest. Odd numbers near the parts 0.7549 and 0.5698 of two pixels, whose multiples fill a square
/// evenly.
const DITHER_STEPS: [u64; 2] = [529_239, 399_511];

/// Samples of the vibrometer in a tick: 200,000 a second.
const LDV_SAMPLES_PER_TICK: usize = 2;

/// Time from one sample to the next, and step of the simulated motor.
pub(crate) const SAMPLE_NANOS: u64 = PositionLoop::TICK_NANOS / LDV_SAMPLES_PER_TICK as u64;

/// Largest noise of a sample, which is uniform: a standard deviation of 2e-4 m/s.
const LDV_NOISE_MAX_M_S: f32 = 3.464e-4;

/// Seed of the vibrometer's noise.
const SEED: u64 = 1;

/// Frames from one outlier to the next, and from one repeated frame to the next.
const FRAMES_PER_OUTLIER: u64 = 97;
const FRAMES_PER_REPEAT: u64 = 61;

/// Error of an outlier: 5 degrees.
const OUTLIER: Angle = Angle::from_units(59_652_324);

/// The filters, one after the other.
const KINDS: [FilterKind; 3] = [FilterKind::ConstantRate, FilterKind::ImpactAided, FilterKind::Twin];

/// Memory of the loop's filter, which is too large for the stack. Empty at first.
pub type LoopMemory = Option<SelectedFilter>;

/// The loop in its parts, as the firmware runs it.
pub(crate) struct LoopParts<'m> {
    pub(crate) filter: &'m mut SelectedFilter,
    positioning: Positioning,
    tracker: ResonanceTracker,
    in_flight: InFlight<TickReport>,
}

/// One tick.
#[inline]
pub(crate) fn tick_parts<'a>(
    parts: &'a mut LoopParts,
    now: Time,
    instruments: &mut TwinInstruments,
) -> &'a TickReport {
    let LoopParts { filter, positioning, tracker, in_flight } = parts;
    tick_by(ResponseMap::table_1(), &mut **filter, positioning, tracker, in_flight, now, instruments)
}

/// Result of the run. Its text is that of the program: one `key value` a line.
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
    /// Runs the loop in `memory` and digests it.
    ///
    /// # Errors
    /// When the model refuses the nominal motor or the controller a target: never, unless their bounds are changed.
    pub fn compute(memory: &mut LoopMemory) -> Result<Self, OutOfBounds> {
        let mut digest = Digest::default();
        let mut ticks = 0;
        let mut take = |report: &TickReport, state: &MotorState<f32>| {
            digest.report(report);
            digest.state(state);
            ticks += 1;
        };
        let mut angle_units = 0;
        for kind in KINDS {
            let end = run_loop(memory, kind, LoopTiming::default(), tick_parts, &mut take)?;
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

/// Positions the twin, with a new filter of `kind` for each target and `tick_once` at each tick. The loop decides, and
/// its commands act, by `timing`.
///
/// `observe` gets each report, with the state that was measured for it. The result is the last state.
pub(crate) fn run_loop(
    memory: &mut LoopMemory,
    kind: FilterKind,
    timing: LoopTiming,
    mut tick_once: impl for<'a> FnMut(&'a mut LoopParts, Time, &mut TwinInstruments) -> &'a TickReport,
    mut observe: impl FnMut(&TickReport, &MotorState<f32>),
) -> Result<MotorState<f32>, OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let step_s = SAMPLE_NANOS as f64 * 1e-9;
    let setup = MotorSetup::with_step(step_s);
    let motor = Motor::<f32>::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let mut instruments = TwinInstruments::new(timing);
    let mut ticks = 0;
    for target_deg in TARGETS_DEG {
        let target = Target::try_new(target_deg, TOLERANCE_DEG)?;
        let now = Time::from_nanos(ticks * PositionLoop::TICK_NANOS);
        let mut parts = build_loop(memory, kind, target, now)?;
        parts.in_flight.clear();
        for _ in 0..TICKS_PER_TARGET {
            let now = Time::from_nanos(ticks * PositionLoop::TICK_NANOS);
            instruments.expose(&state, ticks, now);
            let report = tick_once(&mut parts, now, &mut instruments);
            observe(report, &state);
            let mut at = now;
            for _ in 0..LDV_SAMPLES_PER_TICK {
                motor.step(&mut state, report.applied);
                at = at.plus_nanos(SAMPLE_NANOS);
                instruments.sample_velocity(&state, at);
            }
            ticks += 1;
        }
    }
    Ok(state)
}

/// Builds the loop in `memory`.
// Never inlined: the stack that construction of a filter takes is then not part of every tick's.
#[inline(never)]
pub(crate) fn build_loop(
    memory: &mut LoopMemory,
    kind: FilterKind,
    target: Target,
    now: Time,
) -> Result<LoopParts<'_>, OutOfBounds> {
    let filter = SelectedFilter::build(memory, kind, &MotorParams::nominal(), &Instruments::default())?;
    let positioning = Positioning::new(ResponseMap::table_1(), target, PositioningTuning::default(), now);
    let tracker = ResonanceTracker::of(ResponseMap::table_1());
    Ok(LoopParts { filter, positioning, tracker, in_flight: InFlight::new() })
}

/// Camera and vibrometer of the twin, and an amplifier without limits.
pub(crate) struct TwinInstruments {
    /// The newest frame, not yet delivered.
    exposed: Option<CameraFrame>,
    /// The frame before it, delivered and not yet read.
    arrived: Option<CameraFrame>,
    /// Samples not yet read, oldest first.
    ldv: [Option<LdvSample>; LDV_SAMPLES_PER_TICK],
    noise: Pcg32,
    timing: LoopTiming,
}

impl TwinInstruments {
    pub(crate) fn new(timing: LoopTiming) -> Self {
        let noise = Pcg32::seed_from_u64(SEED);
        Self { exposed: None, arrived: None, ldv: [None; LDV_SAMPLES_PER_TICK], noise, timing }
    }

    /// Takes a sample of the vibrometer at `now`.
    pub(crate) fn sample_velocity(&mut self, state: &MotorState<f32>, now: Time) {
        // From -1 to 1 in steps that `f32` has.
        let [low, high, ..] = self.noise.next_u32().to_le_bytes();
        let part = f32::from(i16::from_le_bytes([low, high])) / 32_768.0;
        let velocity_m_s = state.rotor.velocity_m_s + LDV_NOISE_MAX_M_S * part;
        self.ldv.rotate_left(1);
        if let Some(newest) = self.ldv.last_mut() {
            *newest = Some(LdvSample { taken_at: now, velocity_m_s });
        }
    }

    /// Exposes a frame at `now`, if one is due.
    pub(crate) fn expose(&mut self, state: &MotorState<f32>, ticks: u64, now: Time) {
        if !ticks.is_multiple_of(TICKS_PER_FRAME) {
            return;
        }
        let frame = ticks / TICKS_PER_FRAME;
        let code = |step: u64| {
            let dither = frame.wrapping_mul(step).cast_signed().rem_euclid(2 * PIXEL_UNITS);
            (state.rotor.angle.angle().units() + dither - PIXEL_UNITS).div_euclid(PIXEL_UNITS)
        };
        let pixels: i64 = DITHER_STEPS.into_iter().map(code).sum();
        let mut angle = Angle::from_units(pixels * PIXEL_UNITS / 2).wrapped();
        if frame % FRAMES_PER_OUTLIER == 1 {
            angle = angle.plus(OUTLIER).wrapped();
        }
        self.arrived = self.exposed;
        if frame % FRAMES_PER_REPEAT != 1 {
            self.exposed = Some(CameraFrame::new(now, angle));
        }
    }
}

impl Sense for TwinInstruments {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.arrived.take()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.iter_mut().find_map(Option::take)
    }
}

impl Drive for TwinInstruments {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::PositioningPhase;
    use estimator::{Rejection, Verdict};
    use motor_model::DriveMode;

    /// Equal digests prove nothing about code that the run does not execute. A code that repeats itself at rest is not
    /// among it: this camera dithers, and such a code is refused by a count of equal codes, without arithmetic.
    #[test]
    fn law_the_runs_execute_all_that_the_loop_can_do() {
        KINDS.into_iter().for_each(executes_all);
    }

    fn executes_all(kind: FilterKind) {
        let (mut modes, mut phases, mut verdicts) = ([0; 2], [0; 5], [0; 4]);
        run_loop(&mut None, kind, LoopTiming::default(), tick_parts, |report, _| {
            match report.applied.mode() {
                Some(DriveMode::B) => modes[0] += 1,
                Some(DriveMode::C) => modes[1] += 1,
                None => (),
            }
            match report.phase {
                PositioningPhase::Cruise { .. } => phases[0] += 1,
                PositioningPhase::Settling(_) => phases[1] += 1,
                PositioningPhase::Holding => phases[2] += 1,
                PositioningPhase::Burst { .. } => phases[3] += 1,
                PositioningPhase::Waiting(_) => phases[4] += 1,
                PositioningPhase::Brake { .. } | PositioningPhase::Stopped(_) => {
                    panic!("{:?}", report.phase)
                }
            }
            match report.camera.map(|innovation| innovation.verdict) {
                Some(Verdict::Used) => verdicts[0] += 1,
                Some(Verdict::Restarted) => verdicts[1] += 1,
                Some(Verdict::Rejected(Rejection::Gate)) => verdicts[2] += 1,
                Some(Verdict::Rejected(Rejection::Duplicate)) => verdicts[3] += 1,
                Some(Verdict::Rejected(_)) | None => (),
            }
        })
        .unwrap();
        let mut all = modes.iter().chain(&phases).chain(&verdicts);
        assert!(all.all(|&n| n > 0), "{modes:?} {phases:?} {verdicts:?}");
        assert!(verdicts[0] > 1000, "{verdicts:?}");
    }
}
