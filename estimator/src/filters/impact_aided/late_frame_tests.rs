use motor_model::{Angle, DriveCommand, Time};

use super::tests::tuning;
use super::*;
use crate::filters::checkpoints::Checkpoints;

/// A filter with a frame at a millisecond, and 80 kicks every 10 us from 1.1 ms on.
fn kicked() -> ImpactAided<f64> {
    let mut filter = ImpactAided::new(&ImpactAidedTuning { slow_camera: true, ..tuning() });
    filter.drive(Time::from_micros(1000), DriveCommand::OFF);
    filter.update_camera(&CameraFrame::new(Time::from_micros(1000), Angle::ZERO));
    for n in 0..80 {
        filter.record_kick(ImpactKick::unknown(Time::from_micros(1100 + 10 * n), 1e-3));
    }
    filter.drive(Time::from_micros(1900), DriveCommand::OFF);
    filter
}

/// A frame that was exposed at 1.5 ms is fused from the checkpoint at 1.41 ms as from the frame before it. Of the 39
/// kicks since, 32 are passed at once. The estimate is as it was before the frame until a sample brings the others, and
/// then that of all kicks at once.
#[test]
fn exact_a_late_frame_is_fused_a_few_kicks_at_a_time() {
    let mut filter = kicked();
    let mut passed = filter.tracker.track().unwrap().state;
    filter.checkpoints.go_on(&mut passed, false, Time::from_micros(1500));
    assert_eq!(passed.at, Time::from_micros(1410));
    let (now, before) = (Time::from_micros(1901), filter.clone());
    let mut without_checkpoints = ImpactAided { checkpoints: Checkpoints::none(), ..filter.clone() };
    let frame = CameraFrame::new(Time::from_micros(1500), Angle::from_degrees(0.01));
    assert_eq!(filter.update_camera(&frame), without_checkpoints.update_camera(&frame));
    assert_eq!(filter.tracker.place(), without_checkpoints.tracker.place());
    assert_eq!(filter.estimate(now), before.estimate(now));
    filter.go_on();
    let fused = filter.estimate(now);
    assert_ne!(fused, before.estimate(now));
    let process = process!(without_checkpoints, now);
    assert_eq!(fused, without_checkpoints.tracker.estimate(now, &process));
}

/// A kick that the end of a fault leaves, right after the newest one, widens the rate at once.
#[test]
fn exact_an_unknown_kick_after_a_fault_acts_at_once() {
    let mut filter = kicked();
    let now = Time::from_micros(1901);
    let before = filter.estimate(now).unwrap().rate_rad2_s2;
    filter.resume_detection(Time::from_micros(1900));
    let wider = filter.estimate(now).unwrap().rate_rad2_s2 - before;
    let kick_rad2_s2 = filter.tuning.constant_rate.track.kick_rad2_s2;
    assert!((wider / kick_rad2_s2 - 1.0).abs() < 1e-9, "{wider} {kick_rad2_s2}");
}
