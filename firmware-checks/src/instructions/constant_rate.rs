//! The filter `constant_rate` on each kind of measurement, with its detector of rest.

use core::hint::black_box;

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, ImpactInnovation, Innovation,
    LdvSample, Rejection, Verdict,
};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::{Count, InstructionCounter, InstructionTimer};

/// Time between frames: 10,000 frames a second.
const FRAME_NANOS: u64 = 100_000;

/// Age of a frame when it is used.
const LATENCY_NANOS: u64 = 100_000;

/// Frames of a run.
const FRAMES: u16 = 10_000;

/// Frames after which the filter has converged.
const SETTLING_FRAMES: u16 = 100;

/// Rotation of a rotor at 10 rad/s from frame to frame, in units of 2^-32 turn.
const TURNED_UNITS: i64 = 683_565;

/// Twenty degrees: outside every gate.
const OUTLIER: Angle = Angle::from_units(238_609_294);

/// Samples of the vibrometer, 200,000 a second.
const LDV_SAMPLES: u16 = 10_000;
const LDV_NANOS: u64 = 5_000;
const SAMPLES_PER_FRAME: u64 = FRAME_NANOS / LDV_NANOS;

#[inline(never)]
pub(super) fn count(counter: &InstructionCounter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    turning(counter, report);
    report(at_rest(counter));
    report(vibrometer(counter));
}

#[inline(never)]
fn predict(filter: &ConstantRate<f32>, now: Time) -> Option<Estimate<f32>> {
    filter.estimate(now)
}

#[inline(never)]
fn update(filter: &mut ConstantRate<f32>, frame: &CameraFrame) -> Innovation<f32> {
    filter.update_camera(frame)
}

#[inline(never)]
fn update_and_predict(
    filter: &mut ConstantRate<f32>,
    frame: &CameraFrame,
    now: Time,
) -> Option<Estimate<f32>> {
    filter.update_camera(frame);
    filter.estimate(now)
}

#[inline(never)]
fn update_ldv(filter: &mut ConstantRate<f32>, sample: &LdvSample) -> Option<ImpactInnovation<f32>> {
    filter.update_ldv(sample)
}

/// Frames of a driven rotor at constant rate.
pub(super) fn run_hot_operations() {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    for n in 1..=2 * SETTLING_FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        let angle = Angle::from_units(i64::from(n) * TURNED_UNITS).wrapped();
        black_box(update(&mut filter, &black_box(CameraFrame::new(exposed_at, angle))));
    }
}

/// A driven rotor at constant rate. Each frame comes three times: as an outlier, as it is, and repeated. It is counted
/// by the filter's verdict.
fn turning(counter: &InstructionCounter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    let mut used = Count::new("camera_frame_used");
    let mut refused = Count::new("camera_frame_refused");
    let mut repeated = Count::new("camera_frame_repeated");
    let mut predicted = Count::new("prediction");
    let mut both = Count::new("camera_frame_used_and_prediction");
    for n in 1..=FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        let now = black_box(exposed_at.plus_nanos(LATENCY_NANOS));
        let angle = Angle::from_units(i64::from(n) * TURNED_UNITS).wrapped();
        let frame = black_box(CameraFrame::new(exposed_at, angle));
        let outlier = black_box(CameraFrame::new(exposed_at, angle.plus(OUTLIER).wrapped()));
        if n <= SETTLING_FRAMES {
            black_box(update(&mut filter, &frame));
            continue;
        }
        let mut copy = black_box(filter.clone());
        let (estimate, instructions) = counter.count(|| update_and_predict(&mut copy, &frame, now));
        if black_box(estimate).is_some() {
            both.add(instructions);
        }
        // On a copy, because a refusal increases the variance.
        let mut copy = black_box(filter.clone());
        let outlying = counter.count(|| update(&mut copy, &outlier));
        let accepted = counter.count(|| update(&mut filter, &frame));
        let duplicate = counter.count(|| update(&mut filter, &frame));
        for (innovation, instructions) in black_box([outlying, accepted, duplicate]) {
            match innovation.verdict {
                Verdict::Used => used.add(instructions),
                Verdict::Rejected(Rejection::Gate) => refused.add(instructions),
                Verdict::Rejected(Rejection::Duplicate) => repeated.add(instructions),
                Verdict::Restarted | Verdict::Rejected(_) => (),
            }
        }
        let (estimate, instructions) = counter.count(|| predict(&filter, now));
        if black_box(estimate).is_some() {
            predicted.add(instructions);
        }
    }
    [used, refused, repeated, predicted, both].into_iter().for_each(report);
}

/// The vibrometer's noise at sample `n` in m/s. Equal neighbours would mean a vibrometer without signal.
fn noise(n: u64) -> f32 {
    if n.is_multiple_of(2) { 1e-5 } else { -1e-5 }
}

/// A rotor at rest, dithered between two pixels. The filter also updates the rate here.
fn at_rest(counter: &InstructionCounter<'_, impl InstructionTimer>) -> Count {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    let mut count = Count::new("camera_frame_used_at_rest");
    for n in 1..=FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        for sample in 0..SAMPLES_PER_FRAME {
            let taken_at = exposed_at.plus_nanos(sample * LDV_NANOS);
            filter.update_ldv(&LdvSample { taken_at, velocity_m_s: noise(sample) });
        }
        let angle = Angle::from_units(TURNED_UNITS * i64::from(n % 2));
        let frame = black_box(CameraFrame::new(exposed_at, angle));
        let (_, instructions) = black_box(counter.count(|| update(&mut filter, &frame)));
        if filter.estimate(exposed_at).is_some_and(|estimate| estimate.resting) {
            count.add(instructions);
        }
    }
    count
}

/// Samples of a moving rotor, then of one at rest.
fn vibrometer(counter: &InstructionCounter<'_, impl InstructionTimer>) -> Count {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    let mut count = Count::new("vibrometer_sample");
    for n in 1..=LDV_SAMPLES {
        let taken_at = Time::from_nanos(u64::from(n) * LDV_NANOS);
        let sample = black_box(LdvSample {
            taken_at,
            velocity_m_s: if n < LDV_SAMPLES / 2 { 0.1 } else { 0.0 } + noise(u64::from(n)),
        });
        let (_, instructions) = black_box(counter.count(|| update_ldv(&mut filter, &sample)));
        count.add(instructions);
    }
    count
}
