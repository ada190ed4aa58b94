//! Operations of each filter while the motor turns.
//!
//! The twin simulates the motor, at full drive from rest, and steady motion is counted. Vibrometer and camera have no
//! noise, so that every detected impact is one.

use core::hint::black_box;

use controller::Target;
use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, ImpactAided, ImpactAidedTuning,
    ImpactInnovation, Innovation, Instruments, LdvSample,
};
use link::FilterKind;
use motor_model::{DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionCounter, InstructionTimer};
use crate::parity::{LoopMemory, build_loop};

/// Time between samples of the vibrometer: 200,000 samples a second.
const LDV_NANOS: u64 = 5_000;

/// Samples from one camera frame to the next: 10,000 frames a second. A frame arrives when the next is exposed.
const SAMPLES_PER_FRAME: u64 = 20;

/// Samples from one prediction to the next: one prediction a tick of the loop.
const SAMPLES_PER_PREDICTION: u64 = 2;

/// Samples until the motion is steady: 100 ms.
const SETTLING_SAMPLES: u64 = 20_000;

/// Samples that are counted: 100 ms.
const COUNTED_SAMPLES: u64 = 20_000;

/// Names of a filter's operations in one mode: a frame, a sample, a prediction.
type Names = [&'static str; 3];

macro_rules! names {
    ($filter_and_mode:literal) => {
        [
            concat!($filter_and_mode, "_camera_frame"),
            concat!($filter_and_mode, "_vibrometer_sample"),
            concat!($filter_and_mode, "_prediction"),
        ]
    };
}

#[inline(never)]
pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (mode, of_constant_rate, of_impact_aided, of_twin) in [
        (DriveMode::B, names!("constant_rate_b"), names!("impact_aided_b"), names!("twin_b")),
        (DriveMode::C, names!("constant_rate_c"), names!("impact_aided_c"), names!("twin_c")),
    ] {
        count_constant_rate(counter, mode, of_constant_rate)?.into_iter().for_each(&mut *report);
        count_impact_aided(counter, mode, of_impact_aided)?.into_iter().for_each(&mut *report);
        count_twin(counter, memory, mode, of_twin)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}

#[inline(never)]
fn update<F: AngleFilter<f32>>(filter: &mut F, frame: &CameraFrame) -> Innovation<f32> {
    filter.update_camera(frame)
}

#[inline(never)]
fn update_ldv<F: AngleFilter<f32>>(filter: &mut F, sample: &LdvSample) -> Option<ImpactInnovation<f32>> {
    filter.update_ldv(sample)
}

#[inline(never)]
fn predict<F: AngleFilter<f32>>(filter: &F, now: Time) -> Option<Estimate<f32>> {
    filter.estimate(now)
}

// Functions of their own, never inlined: these filters are on the stack, one at a time.
#[inline(never)]
fn count_constant_rate(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    run(counter, &mut ConstantRate::<f32>::new(&ConstantRateTuning::default()), mode, names)
}

#[inline(never)]
fn count_impact_aided(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    let tuning = ImpactAidedTuning::new(&MotorParams::nominal(), &Instruments::default());
    run(counter, &mut ImpactAided::<f32>::new(&tuning), mode, names)
}

/// The twin's filter is that of the loop, in the loop's memory: it is too large for the stack.
fn count_twin(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    let target = Target::try_new(1.0, 0.001)?;
    let parts = build_loop(memory, black_box(FilterKind::Twin), target, Time::ZERO)?;
    run(counter, parts.filter, mode, names)
}

/// Runs `filter` on measurements of the motor driven in `mode`.
#[inline(never)]
fn run<F: AngleFilter<f32>>(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    filter: &mut F,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "5,000 is exact")]
    let setup = MotorSetup::with_step(LDV_NANOS as f64 * 1e-9);
    let motor = Motor::<f32>::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let command = DriveCommand::full(mode);
    let [mut frames, mut samples, mut predictions] = names.map(Count::new);
    let mut exposed: Option<CameraFrame> = None;
    filter.drive(Time::ZERO, command);
    for n in 1..=SETTLING_SAMPLES + COUNTED_SAMPLES {
        motor.step(&mut state, command);
        let now = black_box(Time::from_nanos(n * LDV_NANOS));
        let counted = n > SETTLING_SAMPLES;
        let sample = black_box(LdvSample { taken_at: now, velocity_m_s: state.rotor.velocity_m_s });
        let (_, instructions) = black_box(counter.count(|| update_ldv(filter, &sample)));
        if counted {
            samples.add(instructions);
        }
        if n.is_multiple_of(SAMPLES_PER_FRAME) {
            if let Some(frame) = black_box(exposed) {
                let (_, instructions) = black_box(counter.count(|| update(filter, &frame)));
                if counted {
                    frames.add(instructions);
                }
            }
            exposed = Some(CameraFrame::new(now, state.rotor.angle.angle().wrapped()));
        }
        if counted && n.is_multiple_of(SAMPLES_PER_PREDICTION) {
            let (_, instructions) = black_box(counter.count(|| predict(filter, now)));
            predictions.add(instructions);
        }
    }
    Ok([frames, samples, predictions])
}
