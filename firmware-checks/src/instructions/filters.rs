//! What each filter's operations take while the motor turns.
//!
//! The twin stands in for the motor, at full drive from rest; what is counted is steady motion. Its vibrometer and its camera add no noise of their own, so that
//! every sample that is heard as an impact is one.

use core::hint::black_box;

use controller::Target;
use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, ImpactAided, ImpactAidedTuning,
    Innovation, LdvSample,
};
use firmware::filter::SelectedFilter;
use link::FilterKind;
use motor_model::{DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionTimer, Meter};
use crate::parity::{LoopPlace, put};

/// Samples of the vibrometer, 200,000 a second.
const LDV_NANOS: u64 = 5_000;

/// Samples from one frame to the next, 10,000 a second, which then is on its way for as long.
const SAMPLES_PER_FRAME: u64 = 20;

/// Samples from one prediction to the next: once a tick of the loop.
const SAMPLES_PER_PREDICTION: u64 = 2;

/// Samples until the motion counts as steady: 100 ms.
const SETTLING_SAMPLES: u64 = 20_000;

/// Samples that are counted: 100 ms.
const COUNTED_SAMPLES: u64 = 20_000;

/// Names of what a filter does in one mode: with a frame, with a sample, when asked.
type Names = [&'static str; 3];

#[inline(never)]
pub(super) fn count(
    meter: &Meter<'_, impl InstructionTimer>,
    place: &mut LoopPlace,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (mode, names) in [
        (
            DriveMode::B,
            [
                [
                    "constant_rate_b_camera_frame",
                    "constant_rate_b_vibrometer_sample",
                    "constant_rate_b_prediction",
                ],
                [
                    "impact_aided_b_camera_frame",
                    "impact_aided_b_vibrometer_sample",
                    "impact_aided_b_prediction",
                ],
                ["twin_b_camera_frame", "twin_b_vibrometer_sample", "twin_b_prediction"],
            ],
        ),
        (
            DriveMode::C,
            [
                [
                    "constant_rate_c_camera_frame",
                    "constant_rate_c_vibrometer_sample",
                    "constant_rate_c_prediction",
                ],
                [
                    "impact_aided_c_camera_frame",
                    "impact_aided_c_vibrometer_sample",
                    "impact_aided_c_prediction",
                ],
                ["twin_c_camera_frame", "twin_c_vibrometer_sample", "twin_c_prediction"],
            ],
        ),
    ] {
        let [of_constant_rate, of_impact_aided, of_twin] = names;
        follow_constant_rate(meter, mode, of_constant_rate)?.into_iter().for_each(&mut *report);
        follow_impact_aided(meter, mode, of_impact_aided)?.into_iter().for_each(&mut *report);
        follow_twin(meter, place, mode, of_twin)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}

#[inline(never)]
fn update<F: AngleFilter<f32>>(filter: &mut F, frame: &CameraFrame) -> Innovation<f32> {
    filter.update_camera(frame)
}

#[inline(never)]
fn listen<F: AngleFilter<f32>>(filter: &mut F, sample: &LdvSample) -> Option<Innovation<f32>> {
    filter.update_ldv(sample)
}

#[inline(never)]
fn predict<F: AngleFilter<f32>>(filter: &F, now: Time) -> Option<Estimate<f32>> {
    filter.estimate(now)
}

// Frames of their own, each gone before the next comes: these filters lie on the stack.
#[inline(never)]
fn follow_constant_rate(
    meter: &Meter<'_, impl InstructionTimer>,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    follow(meter, &mut ConstantRate::<f32>::new(&ConstantRateTuning::default()), mode, names)
}

#[inline(never)]
fn follow_impact_aided(
    meter: &Meter<'_, impl InstructionTimer>,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    let tuning = ImpactAidedTuning::new(&MotorParams::nominal());
    follow(meter, &mut ImpactAided::<f32>::new(&tuning), mode, names)
}

/// The twin's filter is the loop's, which is in the program already, and lies where that does: it is larger than a stack should carry.
fn follow_twin(
    meter: &Meter<'_, impl InstructionTimer>,
    place: &mut LoopPlace,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    let target = Target::try_new(1.0, 0.001)?;
    let held = put(place, &|| SelectedFilter::try_new(black_box(FilterKind::Twin)), target, Time::ZERO)?;
    follow(meter, held.filter_mut(), mode, names)
}

/// `filter` beside the motor driven in `mode`.
#[inline(never)]
fn follow<F: AngleFilter<f32>>(
    meter: &Meter<'_, impl InstructionTimer>,
    filter: &mut F,
    mode: DriveMode,
    names: Names,
) -> Result<[Count; 3], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "5,000 is exact")]
    let setup = MotorSetup::with_step(LDV_NANOS as f64 * 1e-9);
    let motor = Motor::<f32>::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let command = DriveCommand::full(mode);
    let [mut frames, mut samples, mut predictions] = names.map(Count::of);
    let mut on_its_way: Option<CameraFrame> = None;
    filter.drive(Time::ZERO, command);
    for n in 1..=SETTLING_SAMPLES + COUNTED_SAMPLES {
        motor.step(&mut state, command);
        let now = black_box(Time::from_nanos(n * LDV_NANOS));
        let counted = n > SETTLING_SAMPLES;
        let sample = black_box(LdvSample { taken_at: now, velocity_m_s: state.rotor.velocity_m_s });
        let (_, instructions) = black_box(meter.instructions(|| listen(filter, &sample)));
        if counted {
            samples.add(instructions);
        }
        if n.is_multiple_of(SAMPLES_PER_FRAME) {
            if let Some(frame) = black_box(on_its_way) {
                let (_, instructions) = black_box(meter.instructions(|| update(filter, &frame)));
                if counted {
                    frames.add(instructions);
                }
            }
            on_its_way = Some(CameraFrame { exposed_at: now, angle: state.rotor.angle.angle().wrapped() });
        }
        if counted && n.is_multiple_of(SAMPLES_PER_PREDICTION) {
            let (_, instructions) = black_box(meter.instructions(|| predict(filter, now)));
            predictions.add(instructions);
        }
    }
    Ok([frames, samples, predictions])
}
