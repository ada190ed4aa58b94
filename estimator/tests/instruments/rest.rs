//! Frames of a rotor that lies still: noise, quantisation, and what is assumed of them.

use estimator::{AngleFilter, CameraDescription, CameraFrame, Estimate, Instruments, RESTING_GROWTH_RAD2_S};
use motor_model::{Angle, DriveCommand, Time};

use crate::bench::{Bench, filters};

/// Frames of a rotor that lies still at `place_rad`, and the last estimate.
fn at_rest(
    filter: &mut dyn AngleFilter<f32>,
    camera: CameraDescription,
    place_rad: f64,
    frames: u64,
) -> Estimate<f32> {
    let mut bench = Bench::new(camera, 7 + frames);
    for n in 0..frames {
        let shown_rad = bench.shown_rad(place_rad);
        let exposed_at = Time::from_nanos(n * camera.period_nanos);
        filter.drive(exposed_at, DriveCommand::OFF);
        filter.update_camera(&CameraFrame::new(exposed_at, Angle::from_degrees(shown_rad.to_degrees())));
    }
    filter.estimate(Time::from_nanos((frames - 1) * camera.period_nanos)).unwrap()
}

/// The square of the angle's error over its variance after a second of rest; `None` if the filter sees no rest.
fn after_a_second(filter: &mut dyn AngleFilter<f32>, bench: &mut Bench) -> Option<f64> {
    let ticks = (0..100_000_u64).map(|_| bench.tick(filter, DriveCommand::OFF, 0.0, None).0);
    let estimate = ticks.last().flatten().filter(|estimate| estimate.resting)?;
    Some(bench.error_rad(&estimate).powi(2) / f64::from(estimate.angle_rad2))
}

/// Rest is averaged as R / n, whatever the rate of the frames, for one mark and several: but for the forty frames until
/// rest and dither are seen, the walk w of [`RESTING_GROWTH_RAD2_S`] that is assumed at rest (the filter of a walk has
/// `x coth x` times the variance `R / n`, with `x^2 = n^2 w dt / R`), and a twelfth for ringing; and no better.
#[test]
fn law_rest_is_averaged_at_any_rate_of_frames() {
    for marks in [1, 2, 3, 8] {
        for (period_nanos, frames) in
            [(100_000, 10_000), (1_000_000, 3_000), (5_000_000, 1_500), (20_000_000, 500), (100_000_000, 300)]
        {
            let camera = CameraDescription { period_nanos, marks, ..CameraDescription::default() };
            // With ten frames a second the filters with impacts do not know the turn between two frames.
            let able = if period_nanos > 50_000_000 { 1 } else { 3 };
            for mut filter in filters(&Instruments { camera, vibrometer: None }).into_iter().take(able) {
                let estimate = at_rest(filter.as_mut(), camera, 0.2, frames);
                assert!(estimate.resting, "{period_nanos}");
                let measured_rad2 = f64::from(estimate.angle_rad2) - camera.floor_rad2();
                let counted = frames as f64 - 40.0;
                let off = measured_rad2 * counted / camera.variance_rad2();
                let walked = frames as f64
                    * (RESTING_GROWTH_RAD2_S * camera.period_s() / camera.variance_rad2()).sqrt();
                let expected = walked / walked.tanh();
                assert!(
                    (0.99 * counted / frames as f64..1.083).contains(&(off / expected)),
                    "{marks} {period_nanos} {frames}: {off} {expected}"
                );
            }
        }
    }
}

/// A coarse camera that is as described is averaged down to the described floor wherever in its cell the rotor lies:
/// what a tolerance is accepted by can be measured.
#[test]
fn law_a_coarse_camera_reaches_its_floor_anywhere_in_a_cell() {
    for resolution_m in [4e-6, 6e-6, 1e-5] {
        let camera = CameraDescription { resolution_m, ..CameraDescription::default() };
        for place in 0..20 {
            let place_rad = 0.2 + resolution_m / camera.radius_m * f64::from(place) / 20.0;
            let mut filter = filters(&Instruments { camera, vibrometer: None }).swap_remove(0);
            let estimate = at_rest(filter.as_mut(), camera, place_rad, 3_000);
            // Frames leave little beside the floor: R / n is at most a seventieth of it.
            let off = f64::from(estimate.angle_rad2) / camera.floor_rad2();
            assert!((1.0..1.1).contains(&off), "{resolution_m} {place}: {off}");
        }
    }
}

/// A coarse camera without dither: the error of a rotor at rest, anywhere in a cell, is honest. Over forty places the
/// mean square of error over deviation is at most 2 (1 expected, forty places of a uniform error give +- 0.15).
#[test]
fn law_the_quantisation_is_never_averaged_away() {
    for (noise_m, resolution_m) in
        [(1e-6, 4e-6), (1e-6, 6e-6), (1e-6, 1e-5), (2e-7, 2e-5), (1e-6, 2e-6), (5e-6, 2e-6)]
    {
        let camera = CameraDescription { noise_m, resolution_m, ..CameraDescription::default() };
        let instruments = Instruments { camera, vibrometer: None };
        let mut square_sum = 0.0;
        for place in 0..40 {
            let mut filter = filters(&instruments).swap_remove(0);
            let mut bench = Bench::new(camera, 100 + place);
            bench.angle_rad = 0.2 + resolution_m / camera.radius_m * place as f64 / 40.0;
            square_sum += after_a_second(filter.as_mut(), &mut bench)
                .unwrap_or_else(|| panic!("{noise_m} {resolution_m} {place}"));
        }
        let mean = square_sum / 40.0;
        assert!(mean < 2.0, "{noise_m} {resolution_m}: {mean}");
    }
}

/// Noise of a quarter to four times what is assumed: after a second of rest the deviations are honest, to a factor of
/// two in the variance over forty rotors (chi-square of forty: 99.9 % within 0.45 and 1.8).
#[test]
fn law_a_wrong_assumption_of_the_noise_is_corrected() {
    for factor in [0.25, 0.5, 2.0, 4.0] {
        let truth = CameraDescription { resolution_m: 2e-7, ..CameraDescription::default() };
        let assumed = CameraDescription { noise_m: truth.noise_m / factor, ..truth };
        let mut square_sum = 0.0;
        for seed in 0..40 {
            let mut filter = filters(&Instruments { camera: assumed, vibrometer: None }).swap_remove(0);
            let mut bench = Bench::new(truth, seed);
            square_sum +=
                after_a_second(filter.as_mut(), &mut bench).unwrap_or_else(|| panic!("{factor} {seed}"));
        }
        let mean = square_sum / 40.0;
        assert!((0.3..2.0).contains(&mean), "{factor}: {mean}");
    }
}
