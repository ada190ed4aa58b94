//! The variances of a camera against sums over codes, and what is refused.

use super::*;

/// The default camera on a single mark.
fn one_mark() -> CameraDescription {
    CameraDescription { marks: 1, ..CameraDescription::default() }
}

/// (1/4 + 1/12) of the step's square: noise of half a step, and a uniform error over a step. Two marks have half of it.
#[test]
fn exact_variance_of_the_default_camera() {
    let step_rad = 2e-6_f64 / 3.9e-3;
    let variance_rad2 = CameraDescription::default().variance_rad2();
    assert!((variance_rad2 * 6.0 / (step_rad * step_rad) - 1.0).abs() < 1e-12);
}

/// `n` marks are one at `sqrt n` times the radius: so variance, quantisation, floor and dither are an `n`-th each.
#[test]
fn exact_marks_divide_all_variances() {
    for marks in [2_u8, 5, 16] {
        let n = f64::from(marks);
        let one = CameraDescription { mark_bias_m: 4e-7, ..one_mark() };
        let several = CameraDescription { marks, ..one };
        for of in [
            CameraDescription::variance_rad2,
            CameraDescription::quantisation_rad2,
            CameraDescription::floor_rad2,
            CameraDescription::dither_rad2,
            CameraDescription::mark_bias_rad2,
        ] {
            assert!((n * of(&several) / of(&one) - 1.0).abs() < 1e-12, "{marks}");
        }
    }
}

/// Of marks on a circle, without those left out: the inverse of `sum |X - mean X|^2` per that of all. Of fewer than
/// all but one the factor is that of the most crowded that a camera delivers, half the spread of as many all round.
#[test]
fn dual_variance_factor_is_that_of_the_marks_places() {
    for marks in 2_u8..=16 {
        let camera = CameraDescription { marks, ..CameraDescription::default() };
        let place = |j: u8| {
            let (s, c) = math::sin_cos(core::f64::consts::TAU * f64::from(j) / f64::from(marks));
            [c, s]
        };
        for used in 0..=20_u8 {
            let factor: f64 = camera.variance_factor(used);
            let kept = if used == 0 { marks } else { used.min(marks) };
            let sums = (0..kept).map(place).fold([0.0; 2], |[x, y], [c, s]| [x + c, y + s]);
            let spread = f64::from(kept) - (sums[0] * sums[0] + sums[1] * sums[1]) / f64::from(kept);
            let expected = match marks - kept {
                0 => 1.0,
                _ if kept == 1 => f64::from(marks),
                1 => f64::from(marks) / spread,
                _ => 2.0 * f64::from(marks) / f64::from(kept),
            };
            assert!((factor / expected - 1.0).abs() < 1e-12, "{used} of {marks}: {factor} {expected}");
            let factor: f32 = camera.variance_factor(used);
            assert!((f64::from(factor) / expected - 1.0).abs() < 1e-6);
        }
    }
}

/// The variance of the codes in the middle of a cell, `sum of k^2 p_k` by the normal distribution's tails, in steps
/// squared: `2 Q(2)` and a little for noise of a quarter of a step.
#[test]
fn exact_least_dither_is_the_sum_over_codes() {
    for (steps, expected) in [(0.15, 0.000_858_121), (0.25, 0.045_500_3), (0.5, 0.325_413), (1.0, 1.083_33)] {
        let camera = CameraDescription { noise_m: 2e-6 * steps, radius_m: 1e-3, ..one_mark() };
        let dither_steps2 = camera.dither_rad2() / (2e-3 * 2e-3);
        assert!((dither_steps2 / expected - 1.0).abs() < 1e-4, "{steps}: {dither_steps2}");
    }
}

/// The mean square of the bias, from the distribution of the codes by itself, over the places in a cell.
#[test]
fn dual_floor_is_the_mean_square_of_the_mean_codes_error() {
    // The standard normal's distribution, by Simpson's rule.
    let below = |x: f64| {
        let (n, h) = (200, x.clamp(-9.0, 9.0) / 200.0);
        let density = |i: i32| (-0.5 * (f64::from(i) * h).powi(2)).exp();
        let inner: f64 = (1..n).map(|i| density(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        0.5 + (density(0) + inner + density(n)) * h / 3.0 / core::f64::consts::TAU.sqrt()
    };
    for noise_steps in [0.02, 0.1, 0.25, 0.5, 1.0] {
        let places = 60;
        let mean_square = (0..places)
            .map(|place| {
                let x = (f64::from(place) + 0.5) / f64::from(places) - 0.5;
                let code = |n: i32| {
                    let (low, high) = (f64::from(n) - 0.5 - x, f64::from(n) + 0.5 - x);
                    f64::from(n) * (below(high / noise_steps) - below(low / noise_steps))
                };
                let bias = (-12..=12).map(code).sum::<f64>() - x;
                bias * bias
            })
            .sum::<f64>()
            / f64::from(places);
        let camera = CameraDescription {
            noise_m: 4e-6 * noise_steps,
            resolution_m: 4e-6,
            radius_m: 2e-3,
            ..one_mark()
        };
        let floor_steps2 = camera.floor_rad2() / (2e-3 * 2e-3);
        assert!((floor_steps2 - mean_square).abs() < 0.01 * mean_square + 1e-15, "{noise_steps}");
    }
    let without_noise = CameraDescription { noise_m: 0.0, ..CameraDescription::default() };
    let whole_rad2 = without_noise.quantisation_rad2();
    assert!((without_noise.floor_rad2() / whole_rad2 - 1.0).abs() < 0.01);
    let without_steps = CameraDescription { resolution_m: 0.0, ..CameraDescription::default() };
    assert!(without_steps.floor_rad2().abs() < f64::MIN_POSITIVE);
}

/// 0.3 um and 4 um at 3.9 mm: one mark has both, several an n-th of the first alone; an angle from one mark of several
/// has what one has. The floor has it beside the quantisation's.
#[test]
fn exact_what_neighbouring_frames_share() {
    let shared = |marks| CameraDescription { marks, mark_bias_m: 3e-7, shift_m: 4e-6, ..one_mark() };
    let (bias_rad2, shift_rad2) = ((3e-7_f64 / 3.9e-3).powi(2), (4e-6_f64 / 3.9e-3).powi(2));
    for (marks, expected) in [(1_u8, bias_rad2 + shift_rad2), (2, bias_rad2 / 2.0), (8, bias_rad2 / 8.0)] {
        let camera = shared(marks);
        assert!((camera.persistent_rad2() / expected - 1.0).abs() < 1e-12, "{marks}");
        assert!((camera.single_mark_rad2() / (bias_rad2 + shift_rad2) - 1.0).abs() < 1e-12, "{marks}");
        let without = CameraDescription { mark_bias_m: 0.0, shift_m: 0.0, ..camera };
        assert!(((camera.floor_rad2() - without.floor_rad2()) / expected - 1.0).abs() < 1e-9, "{marks}");
        assert!((camera.variance_rad2() - without.variance_rad2()).abs() < f64::MIN_POSITIVE);
    }
}

/// A filter for each row of the table at [`Instruments::best_filter`], and for a bench without a vibrometer.
#[test]
fn exact_best_filters() {
    let (camera, vibrometer) = (CameraDescription::default(), VibrometerDescription::default());
    let best = |camera, vibrometer| Instruments { camera, vibrometer }.best_filter();
    assert_eq!(best(camera, None), FilterKind::ConstantRate);
    for (period_nanos, filter) in [(100_000, FilterKind::Twin), (5_000_000, FilterKind::Twin)] {
        assert_eq!(best(CameraDescription { period_nanos, ..camera }, Some(vibrometer)), filter);
    }
    let slow = CameraDescription { period_nanos: 100_000_000, ..camera };
    assert_eq!(best(slow, Some(vibrometer)), FilterKind::ConstantRate);
    // 30 frames a second, a frame late.
    let nanos = 33_333_333;
    let thirty = CameraDescription { period_nanos: nanos, latency_nanos: nanos, ..camera };
    let of_thirty = if cfg!(feature = "slow_cameras") { FilterKind::Twin } else { FilterKind::ConstantRate };
    assert_eq!(best(thirty, Some(vibrometer)), of_thirty);
    for (clock_sd_micros, filter) in [(100, FilterKind::Twin), (101, FilterKind::ConstantRate)] {
        assert_eq!(best(CameraDescription { clock_sd_micros, ..camera }, Some(vibrometer)), filter);
    }
    for (changed, filter) in [
        (vibrometer, FilterKind::Twin),
        (VibrometerDescription { noise_m_s: 1e-3, ..vibrometer }, FilterKind::Twin),
        (VibrometerDescription { noise_m_s: 2e-3, ..vibrometer }, FilterKind::ImpactAided),
        (VibrometerDescription { noise_m_s: 1e-2, ..vibrometer }, FilterKind::ConstantRate),
        (VibrometerDescription { resolution_m_s: 7.8e-3, ..vibrometer }, FilterKind::ImpactAided),
        (VibrometerDescription { period_nanos: 2_000, ..vibrometer }, FilterKind::Twin),
        (VibrometerDescription { period_nanos: 50_000, ..vibrometer }, FilterKind::ImpactAided),
        (VibrometerDescription { range_m_s: 0.02, ..vibrometer }, FilterKind::ImpactAided),
    ] {
        assert_eq!(best(camera, Some(changed)), filter, "{changed:?}");
    }
}

#[test]
fn exact_bounds_name_the_key() {
    assert!(Instruments::default().checked().is_ok());
    let camera = CameraDescription::default();
    for (bad, key) in [
        (CameraDescription { period_nanos: 9_000, ..camera }, "camera.frame_rate_hz"),
        (CameraDescription { period_nanos: 0, ..camera }, "camera.frame_rate_hz"),
        (CameraDescription { exposure_nanos: 100_001, ..camera }, "camera.exposure_frames"),
        (CameraDescription { latency_nanos: u64::MAX, ..camera }, "camera.latency_s"),
        (CameraDescription { noise_m: f64::NAN, ..camera }, "camera.noise_m"),
        (CameraDescription { resolution_m: -1e-6, ..camera }, "camera.resolution_m"),
        (CameraDescription { radius_m: 0.0, ..camera }, "camera.tracking_radius_m"),
        (CameraDescription { mark_bias_m: f64::INFINITY, ..camera }, "camera.mark_bias_m"),
        (CameraDescription { mark_bias_m: -1e-9, ..camera }, "camera.mark_bias_m"),
        (CameraDescription { shift_m: 1.1e-3, ..camera }, "camera.shift_m"),
        (CameraDescription { stamp_sd_s: f32::NAN, ..camera }, "camera.stamp_jitter_s"),
        (CameraDescription { stamp_sd_s: -1e-6, ..camera }, "camera.stamp_jitter_s"),
        (CameraDescription { clock_sd_micros: 10_001, ..camera }, "camera.clock_error_s"),
    ] {
        assert_eq!(bad.checked().unwrap_err().key, key);
    }
    let vibrometer = VibrometerDescription::default();
    for (bad, key) in [
        (VibrometerDescription { period_nanos: 0, ..vibrometer }, "ldv.sample_rate_hz"),
        (VibrometerDescription { noise_m_s: f64::INFINITY, ..vibrometer }, "ldv.noise_m_s"),
        (VibrometerDescription { bias_max_m_s: -1.0, ..vibrometer }, "ldv.bias_m_s"),
        (VibrometerDescription { range_m_s: 101.0, ..vibrometer }, "ldv.range_m_s"),
        (VibrometerDescription { resolution_m_s: 2.0, ..vibrometer }, "ldv.resolution_m_s"),
    ] {
        let instruments = Instruments { vibrometer: Some(bad), ..Instruments::default() };
        assert_eq!(instruments.checked().unwrap_err().key, key);
    }
}
