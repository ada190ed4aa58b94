//! What neighbouring frames share: the variances that the filters add for it, against what it does to them.

use estimator::{
    AngleFilter, CameraDescription, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Instruments,
};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

/// One mark, 20 um of noise: the filter's bandwidth w in mode B is `(q / (R dt))^(1/4)`, some 1,000 rad/s.
fn one_mark(shift_m: f64) -> CameraDescription {
    CameraDescription { marks: 1, noise_m: 2e-5, shift_m, ..CameraDescription::default() }
}

/// Estimates at the exposures of 3,000 frames of a rotor that turns at 10 rad/s in mode B, with `error_rad` of the time
/// in s beside. The last 2,000.
pub(crate) fn estimates(
    camera: CameraDescription,
    marks_used: u8,
    error_rad: impl Fn(f64) -> f64,
) -> Vec<Estimate<f64>> {
    let mut filter =
        ConstantRate::<f64>::new(&ConstantRateTuning::new(&Instruments { camera, vibrometer: None }));
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    let each = (1..=3_000_u64).map(|n| {
        let exposed_at = Time::from_micros(100 * n);
        let time_s = 1e-4 * n as f64;
        let angle = Angle::from_degrees((10.0 * time_s + error_rad(time_s)).to_degrees()).wrapped();
        filter.drive(exposed_at, DriveCommand::full(DriveMode::B));
        filter.update_camera(&CameraFrame { marks_used, ..CameraFrame::new(exposed_at, angle) });
        filter.estimate(exposed_at).unwrap()
    });
    each.collect::<Vec<_>>().split_off(1_000)
}

/// An error of frames that is a sine of time turns the estimate by at most its own mean square times `(1 + sqrt 5) /
/// 2`, the largest square of the response of the angle, and its rate by at most what is added to the rate's variance
/// for it: that much at the frequency w. Frames every `0.1 / w` change both by a tenth.
#[test]
fn law_the_rate_s_part_is_the_most_that_a_shared_error_does() {
    const ERROR_RAD: f64 = 1e-3;
    let plain = estimates(one_mark(0.0), CameraFrame::ALL_MARKS, |_| 0.0);
    let shift_m = ERROR_RAD * 3.9e-3 / 2.0_f64.sqrt();
    let told = estimates(one_mark(shift_m), CameraFrame::ALL_MARKS, |_| 0.0);
    let (before, after) = (plain.last().unwrap(), told.last().unwrap());
    let added = (after.angle_rad2 - before.angle_rad2, after.rate_rad2_s2 - before.rate_rad2_s2);
    assert!((added.0 / (0.5 * ERROR_RAD * ERROR_RAD) - 1.0).abs() < 1e-9, "{added:?}");
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let (mut most_angle, mut most_rate) = (0.0_f64, 0.0_f64);
    for rad_s in [3.0, 100.0, 300.0, 600.0, 800.0, 1_000.0, 1_300.0, 2_000.0, 4_000.0, 10_000.0] {
        let moved = estimates(one_mark(0.0), CameraFrame::ALL_MARKS, |s| ERROR_RAD * (rad_s * s).sin());
        let (mut angle, mut rate) = (0.0, 0.0);
        for (moved, plain) in moved.iter().zip(&plain) {
            let off_rad: f64 = moved.angle.radians_since(plain.angle);
            angle += off_rad * off_rad / 2_000.0;
            rate += (moved.rate_rad_s - plain.rate_rad_s).powi(2) / 2_000.0;
        }
        (most_angle, most_rate) = (most_angle.max(angle / added.0), most_rate.max(rate / added.1));
    }
    assert!((0.9..1.1).contains(&(most_angle / golden)), "{most_angle}");
    assert!((0.9..1.1).contains(&most_rate), "{most_rate}");
}

/// A shift counts in an angle from one mark, of however many, and in no other; a bias counts by the marks used, as
/// tracking noise does.
#[test]
fn exact_a_shift_counts_in_an_angle_from_one_mark() {
    let (bias_rad2, shift_rad2) = ((3e-7_f64 / 3.9e-3).powi(2), (4e-6_f64 / 3.9e-3).powi(2));
    let angle_rad2 = |marks, marks_used, mark_bias_m, shift_m| {
        let camera = CameraDescription { marks, mark_bias_m, shift_m, ..CameraDescription::default() };
        estimates(camera, marks_used, |_| 0.0).last().unwrap().angle_rad2
    };
    for (marks, used, bias_part, shift_part) in [
        (1, 0, 1.0, 1.0),
        (2, 0, 0.5, 0.0),
        (2, 2, 0.5, 0.0),
        (2, 1, 1.0, 1.0),
        (8, 1, 1.0, 1.0),
        (4, 3, 3.0 / 8.0, 0.0),
        (8, 4, 0.5, 0.0),
    ] {
        let biased_rad2 = angle_rad2(marks, used, 3e-7, 0.0);
        let both_rad2 = angle_rad2(marks, used, 3e-7, 4e-6);
        assert!(
            (both_rad2 - biased_rad2 - shift_part * shift_rad2).abs() < 1e-6 * shift_rad2,
            "{marks} {used}"
        );
        // As noise of its size has it beside: the frames of a moving rotor have both.
        let noise_m = (1e-12_f64 + 9e-14).sqrt();
        let camera = CameraDescription { marks, noise_m, ..CameraDescription::default() };
        let noisy_rad2 = estimates(camera, used, |_| 0.0).last().unwrap().angle_rad2;
        let floors_rad2 =
            CameraDescription { marks, ..CameraDescription::default() }.floor_rad2() - camera.floor_rad2();
        let off_rad2 = biased_rad2 - noisy_rad2 - floors_rad2 - bias_part * bias_rad2;
        assert!(off_rad2.abs() < 1e-6 * bias_rad2, "{marks} {used}: {off_rad2:e}");
    }
}
