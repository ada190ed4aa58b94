//! What a frame teaches of the mean, and how the rate returns to it.

use super::*;
use crate::CameraDescription;
use crate::filters::constant_rate::RandomWalkTuning;
use crate::innovation::Source;

fn used(millis: u64, innovation_rad: f64) -> Innovation<f64> {
    Innovation {
        source: Source::Camera,
        taken_at: Time::from_micros(1000 * millis),
        innovation_rad,
        variance_rad2: 1.0,
        verdict: Verdict::Used,
    }
}

/// A frame that is 10 mrad ahead after 20 ms shows a rate of 0.5 rad/s above the mean. Of that a part of 0.3 is
/// learnt, of that mode: all of it where the drive is fast, and less where it is weak. A frame over a change of
/// the drive teaches nothing, and so does one that would make the mean faster than any rotor's, and one of a rate
/// that is on its way to the mean.
#[test]
fn exact_a_frame_teaches_a_part_of_what_it_is_ahead_by() {
    let [b, c] = [DriveMode::B, DriveMode::C];
    let learnt =
        |mode: DriveMode, amplitude: f32, ahead_rad: f64, between: DriveCommand, begun_millis: u64| {
            let begun = Time::from_micros(1000 * begun_millis);
            let mut means = MeanRates::<f64>::new();
            means.note_drive(Time::ZERO, DriveCommand::saturating(mode, amplitude));
            let rad_s = |means: &MeanRates<f64>| [b, c].map(|of| means.rad_s(of, part_of(of, amplitude)));
            let before = rad_s(&means);
            means.note_frame(&used(100, 0.0), Some(mode), begun);
            means.note_drive(Time::from_micros(110_000), between);
            means.note_drive(Time::ZERO, DriveCommand::saturating(mode, amplitude));
            means.note_frame(&used(120, ahead_rad), Some(mode), begun);
            let after = rad_s(&means);
            [after[0] - before[0], after[1] - before[1]]
        };
    let same = |mode, amplitude| DriveCommand::saturating(mode, amplitude);
    let told = |rate_rad_s: f64| 0.15 * rate_rad_s * rate_rad_s / (rate_rad_s * rate_rad_s + 1.0);
    for (mode, amplitude, ahead_rad, between, begun_millis, expected) in [
        (b, 1.0, 0.01, same(b, 1.0), 50, told(16.0)),
        (b, 0.3, 0.01, same(b, 0.3), 50, told(16.0 * 0.05 / 0.75)),
        (c, 1.0, 0.01, same(c, 1.0), 50, told(1.7)),
        (c, 1.0, -0.01, same(c, 1.0), 50, -told(1.7)),
        (c, 1.0, 0.01, same(c, 1.0), 51, 0.0),
        (c, 1.0, 0.01, DriveCommand::OFF, 0, 0.0),
        (c, 1.0, 0.01, same(b, 1.0), 0, 0.0),
        (b, 1.0, 5.0, same(b, 1.0), 0, 0.0),
    ] {
        let learnt = learnt(mode, amplitude, ahead_rad, between, begun_millis);
        let [own, other] = if mode == b { learnt } else { [learnt[1], learnt[0]] };
        assert!(
            other.to_bits() == 0 && (own - expected).abs() < 1e-6,
            "{mode:?} {amplitude} {ahead_rad} {between:?}: {learnt:?}, not {expected}"
        );
    }
}

/// The means of the prior are those that the nominal motor has, by the map of its cruises, in mode B within the
/// ripple of a tenth of 4.4 rad/s, in mode C of 0.54 rad/s; half as much is turned by a motor of half the factor.
#[test]
fn exact_a_weak_drive_has_a_slow_mean() {
    let means = MeanRates::<f64>::new();
    for (mode, amplitude, cruise_rad_s) in [
        (DriveMode::B, 0.2, 0.0),
        (DriveMode::B, 0.3, 0.99),
        (DriveMode::B, 0.5, 5.57),
        (DriveMode::B, 0.8, 11.53),
        (DriveMode::C, 0.3, -0.026),
        (DriveMode::C, 0.6, -0.2),
        (DriveMode::C, 0.8, -0.79),
    ] {
        let own = means.rad_s(mode, part_of(mode, amplitude));
        let within = if mode == DriveMode::B { 0.44 } else { 0.054 };
        assert!((own - cruise_rad_s).abs() < within, "{mode:?} {amplitude}: {own}");
    }
}

const B: DriveMode = DriveMode::B;

fn millis(millis: u64) -> Time {
    Time::from_micros(1000 * millis)
}

fn tuning() -> RandomWalkTuning<f64> {
    RandomWalkTuning::new(&CameraDescription { period_nanos: 20_000_000, ..CameraDescription::default() })
}

/// Piece, mean in rad/s and part of the noise of mode B at full drive, right after `at` in `piece`.
fn returned(means: &MeanRates<f64>, piece: &MotionPiece, at: Time) -> (Time, f64, f64) {
    let tuning = tuning();
    let own = means.returning(piece, at, tuning.wandering(piece, at, false));
    (own.walk.until, own.mean_rad_s, own.walk.intensity_rad2_s3 / tuning.impacted_b_rad2_s3)
}

fn impacted(mode: DriveMode) -> MotionPiece {
    MotionPiece { motion: Motion::Impacted(mode), rested: false, begun: Time::ZERO, until: NEVER }
}

fn assert_returns(means: &MeanRates<f64>, piece: &MotionPiece, expected: &[(Time, Time, f64, f64)]) {
    for &(at, until, mean_rad_s, noise) in expected {
        let found = returned(means, piece, at);
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + b.abs());
        assert!(
            found.0 == until && is_near(found.1, mean_rad_s) && is_near(found.2, noise),
            "{at:?}: {found:?}"
        );
    }
}

/// The drive is off from 100 to 130 ms, and frames are exposed at 80 and 110 ms. From each frame to the last change
/// the mean is that over the time; then it is that of the drive, and zero without. Each change is followed by 50 ms
/// of transition, with the noise of the drive before while that is off.
#[test]
fn exact_the_mean_is_zero_after_the_drive() {
    let mut means = MeanRates::<f64>::new();
    means.note_frame(&used(80, 0.0), Some(B), Time::ZERO);
    means.note_drive(millis(100), DriveCommand::OFF);
    means.note_drive(millis(105), DriveCommand::OFF);
    let piece = impacted(B);
    assert_returns(
        &means,
        &piece,
        &[
            (millis(80), millis(100), 16.0, 1.0),
            (millis(100), millis(150), 0.0, TRANSITION),
            (millis(150), NEVER, 0.0, 1.0),
        ],
    );
    means.note_frame(&used(110, 0.0), None, Time::ZERO);
    means.note_drive(millis(130), DriveCommand::full(B));
    means.note_drive(millis(140), DriveCommand::full(B));
    // Of the rotor's part 0.4 is left after 30 of 50 ms; off is a part of 0.
    assert_returns(
        &means,
        &piece,
        &[
            (millis(110), millis(130), 0.0, TRANSITION * 0.4),
            (millis(130), millis(180), 16.0, TRANSITION),
            (millis(180), NEVER, 16.0, 1.0),
        ],
    );
}

/// A drive of three amplitudes, then off and on: the mean until the last change is that over the time since the
/// frame. A mode that was driven before keeps its own.
#[test]
fn exact_the_mean_until_the_last_change_is_that_over_the_time() {
    let mut means = MeanRates::<f64>::new();
    means.note_frame(&used(200, 0.0), Some(B), Time::ZERO);
    for (at, amplitude) in [(204, 0.625), (208, 0.25), (210, 0.4)] {
        means.note_drive(millis(at), DriveCommand::saturating(B, amplitude));
    }
    // 4 ms of part 1, 4 of 0.5 and 2 of 0; then 0.2.
    let expected = [(millis(200), millis(210), 9.6, 0.6), (millis(210), NEVER, 3.2, 0.2)];
    assert_returns(&means, &impacted(B), &expected);
    means.note_drive(millis(220), DriveCommand::OFF);
    means.note_drive(millis(230), DriveCommand::full(DriveMode::C));
    // 10 ms of 0.2 and 10 of 0 come to these.
    let mean = 16.0 * (6.0 + 2.0) / 30.0;
    let (settled, until) = (mean / 16.0, NEVER);
    assert_returns(&means, &impacted(B), &[(millis(200), until, mean, settled)]);
    let of_c = tuning().impacted_c_rad2_s3 / tuning().impacted_b_rad2_s3;
    let expected = [(millis(230), millis(280), -1.7, TRANSITION * of_c), (millis(280), NEVER, -1.7, of_c)];
    assert_returns(&means, &impacted(DriveMode::C), &expected);
}

/// The noise of a drive is in proportion to its amplitude above that which does not turn the rotor, in both modes.
#[test]
fn exact_a_weak_drive_makes_little_noise() {
    for (mode, amplitude, expected) in [
        (B, 1.0, 1.0),
        (B, 0.625, 0.5),
        (B, 0.25, 0.02),
        (DriveMode::C, 1.0, 1.0),
        (DriveMode::C, 0.7, 0.5),
        (DriveMode::C, 0.3, 0.02),
    ] {
        let noise = noise_of(mode, part_of(mode, amplitude));
        assert!((noise - expected).abs() < 1e-6, "{mode:?} {amplitude}: {noise}");
    }
}

/// A quiet rotor wanders for 25 ms before its rate returns to zero, whatever drove it.
#[test]
fn exact_a_quiet_rotor_returns_to_rest() {
    let (means, tuning) = (MeanRates::<f64>::new(), tuning());
    let quiet = MotionPiece { motion: Motion::Quiet, begun: millis(200), ..impacted(B) };
    for (at, until, per_s) in [(200, millis(225), 0.0), (225, NEVER, 1.0 / CORRELATION_B_S)] {
        let own = means.returning(&quiet, millis(at), tuning.wandering(&quiet, millis(at), false));
        let found = (own.walk.until, own.mean_rad_s, own.per_s, own.walk.intensity_rad2_s3);
        assert_eq!(found, (until, 0.0, per_s, tuning.sliding_rad2_s3), "{at}");
    }
}
