//! What the filter does with a measurement, its rest detector included.

use core::hint::black_box;

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Innovation, LdvSample, Rejection,
    Verdict,
};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::{Count, InstructionTimer, Meter};

/// Time between frames: 10,000 a second.
const FRAME_NANOS: u64 = 100_000;

/// Age of a frame when it is used.
const LATENCY_NANOS: u64 = 100_000;

/// Frames of a run.
const FRAMES: u16 = 10_000;

/// Frames after which the filter has settled.
const SETTLING_FRAMES: u16 = 100;

/// What a rotor at 10 rad/s turns from frame to frame, in units of 2^-32 turn.
const TURNED_UNITS: i64 = 683_565;

/// Twenty degrees: further off than any gate lets pass.
const OUTLIER: Angle = Angle::from_units(238_609_294);

/// Samples of the vibrometer, 200,000 a second.
const LDV_SAMPLES: u16 = 10_000;
const LDV_NANOS: u64 = 5_000;
const SAMPLES_PER_FRAME: u64 = FRAME_NANOS / LDV_NANOS;

#[inline(never)]
pub(super) fn count(meter: &Meter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    turning(meter, report);
    report(at_rest(meter));
    report(vibrometer(meter));
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
fn listen(filter: &mut ConstantRate<f32>, sample: &LdvSample) -> Option<Innovation<f32>> {
    filter.update_ldv(sample)
}

/// Frames of a driven rotor at constant rate, each as it is.
pub(super) fn rehearse() {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    for n in 1..=2 * SETTLING_FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        let angle = Angle::from_units(i64::from(n) * TURNED_UNITS).wrapped();
        black_box(update(&mut filter, &black_box(CameraFrame { exposed_at, angle })));
    }
}

/// A driven rotor at constant rate. Each frame comes three times, first spoilt, then as it is, then once more, and is counted by what the
/// filter made of it.
fn turning(meter: &Meter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    let mut used = Count::of("camera_frame_used");
    let mut refused = Count::of("camera_frame_refused");
    let mut repeated = Count::of("camera_frame_repeated");
    let mut predicted = Count::of("prediction");
    let mut both = Count::of("camera_frame_used_and_prediction");
    for n in 1..=FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        let now = black_box(exposed_at.plus_nanos(LATENCY_NANOS));
        let angle = Angle::from_units(i64::from(n) * TURNED_UNITS).wrapped();
        let frame = black_box(CameraFrame { exposed_at, angle });
        let outlier = black_box(CameraFrame { exposed_at, angle: angle.plus(OUTLIER).wrapped() });
        if n <= SETTLING_FRAMES {
            black_box(update(&mut filter, &frame));
            continue;
        }
        let mut copy = black_box(filter.clone());
        let (estimate, instructions) = meter.instructions(|| update_and_predict(&mut copy, &frame, now));
        if black_box(estimate).is_some() {
            both.add(instructions);
        }
        // A refusal widens the variance: on a copy.
        let mut copy = black_box(filter.clone());
        let spoilt = meter.instructions(|| update(&mut copy, &outlier));
        let whole = meter.instructions(|| update(&mut filter, &frame));
        let again = meter.instructions(|| update(&mut filter, &frame));
        for (innovation, instructions) in black_box([spoilt, whole, again]) {
            match innovation.verdict {
                Verdict::Used => used.add(instructions),
                Verdict::Rejected(Rejection::Gate) => refused.add(instructions),
                Verdict::Rejected(Rejection::Duplicate) => repeated.add(instructions),
                Verdict::Restarted | Verdict::Rejected(_) => (),
            }
        }
        let (estimate, instructions) = meter.instructions(|| predict(&filter, now));
        if black_box(estimate).is_some() {
            predicted.add(instructions);
        }
    }
    [used, refused, repeated, predicted, both].into_iter().for_each(report);
}

/// The vibrometer's noise at sample `n` in m/s: no live one repeats itself.
fn noise(n: u64) -> f32 {
    if n.is_multiple_of(2) { 1e-5 } else { -1e-5 }
}

/// A rotor that lies still, dithered between two codes: the update of its rate comes on top.
fn at_rest(meter: &Meter<'_, impl InstructionTimer>) -> Count {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    let mut count = Count::of("camera_frame_used_at_rest");
    for n in 1..=FRAMES {
        let exposed_at = Time::from_nanos(u64::from(n) * FRAME_NANOS);
        for sample in 0..SAMPLES_PER_FRAME {
            let taken_at = exposed_at.plus_nanos(sample * LDV_NANOS);
            filter.update_ldv(&LdvSample { taken_at, velocity_m_s: noise(sample) });
        }
        let angle = Angle::from_units(TURNED_UNITS * i64::from(n % 2));
        let frame = black_box(CameraFrame { exposed_at, angle });
        let (_, instructions) = black_box(meter.instructions(|| update(&mut filter, &frame)));
        if filter.estimate(exposed_at).is_some_and(|estimate| estimate.resting) {
            count.add(instructions);
        }
    }
    count
}

/// A rotor that falls quiet half way.
fn vibrometer(meter: &Meter<'_, impl InstructionTimer>) -> Count {
    let mut filter = ConstantRate::new(&ConstantRateTuning::default());
    let mut count = Count::of("vibrometer_sample");
    for n in 1..=LDV_SAMPLES {
        let taken_at = Time::from_nanos(u64::from(n) * LDV_NANOS);
        let sample = black_box(LdvSample {
            taken_at,
            velocity_m_s: if n < LDV_SAMPLES / 2 { 0.1 } else { 0.0 } + noise(u64::from(n)),
        });
        let (_, instructions) = black_box(meter.instructions(|| listen(&mut filter, &sample)));
        count.add(instructions);
    }
    count
}
