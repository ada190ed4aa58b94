//! Errors of time stamps: what they do to the variances of a rotor that turns at 10 rad/s (F21).

use estimator::{CameraDescription, CameraFrame, Estimate};

use crate::shared_errors::estimates;

fn last(camera: CameraDescription) -> Estimate<f64> {
    *estimates(camera, CameraFrame::ALL_MARKS, |_| 0.0).last().unwrap()
}

/// An error of the clock of 292 us is 2.92 mrad of angle, whatever is averaged, and nothing of the rate.
#[test]
fn exact_the_clock_s_error_is_the_angle_that_the_rotor_turns_by() {
    let camera = CameraDescription::default();
    let told = last(CameraDescription { clock_sd_micros: 292, ..camera });
    let plain = last(camera);
    let added_rad2 = told.angle_rad2 - plain.angle_rad2;
    assert!((added_rad2 / 2.92e-3_f64.powi(2) - 1.0).abs() < 1e-6, "{added_rad2:e}");
    assert_eq!(told.rate_rad_s.to_bits(), plain.rate_rad_s.to_bits());
    assert_eq!(told.rate_rad2_s2.to_bits(), plain.rate_rad2_s2.to_bits());
}

/// Errors of single stamps are noise of what the rotor turns by: of two marks `sqrt 2` times that at each mark. The
/// floor is of the tracking noise alone.
#[test]
fn exact_errors_of_single_stamps_are_noise() {
    let camera = CameraDescription { resolution_m: 0.0, ..CameraDescription::default() };
    for stamp_sd_s in [1e-5_f32, 1e-4, 3e-3] {
        let told = last(CameraDescription { stamp_sd_s, ..camera });
        let turned_m = 10.0 * f64::from(stamp_sd_s) * camera.radius_m * 2.0_f64.sqrt();
        let noise_m = (camera.noise_m.powi(2) + turned_m.powi(2)).sqrt();
        let noisy = last(CameraDescription { noise_m, ..camera });
        let ratios = [told.angle_rad2 / noisy.angle_rad2, told.rate_rad2_s2 / noisy.rate_rad2_s2];
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-6), "{stamp_sd_s}: {ratios:?}");
    }
}
