//! Kicks, outliers that were used, and what restarts the filter.

use super::*;

/// A rotor turns by 20 rad/s more between an even frame and the next one than before it, as when it lands: the kick is
/// told. Smoothed, the frames after it say nothing of the rate before it.
#[test]
fn law_frames_after_a_kick_say_nothing_of_the_rate_before_it() {
    let tuning = ConstantRateTuning::<f64>::default();
    let mut filter = ConstantRate::new(&tuning);
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    let truth = |n: u64| 1e-4 * (18.0 * n as f64 + 20.0 * n.saturating_sub(300) as f64);
    let mut refused = 0;
    for n in 1..=315 {
        filter.drive(Time::from_nanos(n * FRAME_NANOS), DriveCommand::full(DriveMode::B));
        refused += u32::from(filter.update_camera(&frame(n, truth(n))).verdict != Verdict::Used);
    }
    assert!((2..=4).contains(&refused), "the first frame, and those of a kick: {refused}");
    let smoothed = filter.smoothed(Time::from_nanos(299 * FRAME_NANOS)).unwrap();
    let off_rad_s = smoothed.rate_rad_s - 18.0;
    assert!(off_rad_s * off_rad_s < 9.0 * smoothed.rate_rad2_s2, "{off_rad_s} {}", smoothed.rate_rad2_s2);
}

/// The second frame is 8 mrad off, within its gate since no rate is known yet, and is used. The two after it fit the
/// first one without it: so it was an outlier, and the past forgets it too.
#[test]
fn law_an_outlier_that_was_used_is_taken_back() {
    let mut filter = ConstantRate::<f64>::new(&ConstantRateTuning::default());
    let verdicts: [Verdict; 20] = core::array::from_fn(|index| {
        let n = 1 + index as u64;
        filter.drive(Time::from_nanos(n * FRAME_NANOS), DriveCommand::full(DriveMode::B));
        let off_rad = if n == 2 { 8e-3 } else { 0.0 };
        filter.update_camera(&frame(n, 5e-4 * n as f64 + off_rad)).verdict
    });
    assert_eq!(verdicts[1..4], [Verdict::Used, Verdict::Rejected(Rejection::Gate), Verdict::Used]);
    for n in 2..=20 {
        let smoothed = filter.smoothed(Time::from_nanos(n * FRAME_NANOS)).unwrap();
        let off_rad = smoothed.angle.radians_since::<f64>(Angle::ZERO) - 5e-4 * n as f64;
        assert!(off_rad * off_rad < 9.0 * smoothed.angle_rad2, "{n}: {off_rad:e} {:e}", smoothed.angle_rad2);
    }
}

/// A rotor that really is elsewhere: the estimate restarts after twenty frames, in the turn nearest to where it was.
#[test]
fn exact_sustained_refusal_restarts() {
    let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
    for n in 1..100 {
        filter.update_with_motion(&frame(n, 3.1), Motion::Quiet);
    }
    let verdicts: [Verdict; 21] = core::array::from_fn(|n| {
        filter.update_with_motion(&frame(100 + n as u64, -3.1), Motion::Quiet).verdict
    });
    assert!(verdicts[..19].iter().all(|&verdict| verdict == Verdict::Rejected(Rejection::Gate)));
    assert_eq!(verdicts[19], Verdict::Restarted);
    assert_eq!(verdicts[20], Verdict::Used);
    let angle = filter.tracker.track().unwrap().state.angle.angle().degrees();
    assert!((angle - (-3.1_f64).to_degrees() - 360.0).abs() < 0.1, "{angle}");
}

/// Frames up to the clock's range apart: the turn is lost and the estimate restarts, with positive variances before and
/// after.
#[test]
fn law_frames_half_the_clock_apart_restart() {
    for nanos in [(1 << 63) - 1, 1 << 63, (1 << 63) + 1, u64::MAX] {
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
        filter.update_with_motion(&frame(0, 0.0), IMPACTED_B);
        let ahead =
            filter.tracker.estimate(Time::from_nanos(nanos), &filter.process_under(IMPACTED_B)).unwrap();
        assert!(ahead.angle_rad2 > 0.25 && ahead.rate_rad2_s2 > 400.0, "{nanos} {ahead:?}");
        let late = CameraFrame::new(Time::from_nanos(nanos), Angle::ZERO);
        assert_eq!(filter.update_with_motion(&late, IMPACTED_B).verdict, Verdict::Restarted, "{nanos}");
        let covariance = filter.tracker.track().unwrap().state.covariance;
        assert!(covariance.angle_rad2() > 0.0 && covariance.rate_rad2_s2() > 0.0, "{nanos}");
    }
}
