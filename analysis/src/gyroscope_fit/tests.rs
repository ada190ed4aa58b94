//! The fit against closed forms.

use rand_distr::{Distribution, StandardNormal};
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::{binomial_bounds, chi_square_mean_bounds};
use simulation::world::instruments::gyroscope::WarmUp;

use super::*;

pub(super) const NOISE: GyroscopeNoise = GyroscopeNoise {
    period_s: 2e-3,
    walk_deg_rs: 2.5e-3,
    drift_deg_s: 0.0,
    drift_time_s: 200.0,
    resolution_deg: 0.0,
};

/// Intervals of 1 s, turned by `turned_deg` each, of a gyroscope without noise.
pub(super) fn intervals(
    turned_deg: &[f64],
    scale: f64,
    bias_deg_s: f64,
    reference_deg2: f64,
) -> Vec<FitInterval> {
    let of = |(index, &turned_deg): (u32, &f64)| FitInterval {
        span: TimeSpan { from_s: f64::from(index), until_s: f64::from(index + 1) },
        shown_deg: (1.0 + scale) * turned_deg + bias_deg_s,
        turned_deg,
        variances_deg2: (reference_deg2, reference_deg2),
        cubed_deg: 0.0,
        angles_turn: (0.0, 0.0),
        drive: 0,
    };
    (0..).zip(turned_deg).map(of).collect()
}

/// Nothing is unknown but scale factor and bias.
pub(super) fn unknowns() -> Unknowns {
    let warm_up = WarmUp { scale: 0.0, bias_deg_s: 0.0, time_s: 100.0 };
    Unknowns { nonlinearity: 0.0, warm_up, camera_deg: 0.0, at_s: 0.0 }
}

fn fitted(intervals: &[FitInterval], noise: &GyroscopeNoise) -> Option<CalibrationFit> {
    CalibrationFit::to(intervals, noise, &unknowns())
}

/// Random walk alone, rates 0, 100 and -50 deg/s: the textbook's straight line through three points, slope and
/// intercept.
#[test]
fn exact_a_line_through_three_points() {
    let fit = fitted(&intervals(&[0.0, 100.0, -50.0], 3e-4, 0.02, 0.0), &NOISE).unwrap();
    assert!((fit.scale / 3e-4 - 1.0).abs() < 1e-9 && (fit.bias_deg_s / 0.02 - 1.0).abs() < 1e-9);
    assert!(fit.chi_square < 1e-12 && fit.degrees_of_freedom == 1);
    // Mean 50 / 3, sum of squares 12,500: S = 12,500 - 3 (50 / 3)^2.
    let squares = 12_500.0 - 2500.0 / 3.0;
    let (scale, bias) = (2.5e-3 / math::sqrt(squares), 2.5e-3 * math::sqrt(12_500.0 / (3.0 * squares)));
    assert!((fit.scale_sigma() / scale - 1.0).abs() < 1e-9, "{} {scale}", fit.scale_sigma());
    assert!((fit.bias_sigma_deg_s() / bias - 1.0).abs() < 1e-9);
    let correlation = -50.0 / math::sqrt(3.0 * 12_500.0);
    assert!((fit.correlation() / correlation - 1.0).abs() < 1e-9);
}

/// With a constant drift the bias is no better known than the drift, however long the run. The scale factor does not
/// depend on it.
#[test]
fn exact_a_drift_that_does_not_change_adds_to_the_bias_alone() {
    let turned: Vec<f64> = (0..100_u32).map(|k| if k % 2 == 0 { 80.0 } else { -80.0 }).collect();
    let sigma = |drift_deg_s| {
        let noise = GyroscopeNoise { drift_deg_s, drift_time_s: 1e9, ..NOISE };
        let fit = fitted(&intervals(&turned, 0.0, 0.0, 0.0), &noise).unwrap();
        (fit.scale_sigma(), fit.bias_sigma_deg_s())
    };
    let (still, drifting) = (sigma(0.0), sigma(1e-3));
    assert!((drifting.0 / still.0 - 1.0).abs() < 1e-6);
    let sum = math::sqrt(still.1 * still.1 + 1e-6);
    assert!((drifting.1 / sum - 1.0).abs() < 1e-4, "{drifting:?} {sum}");
}

/// An uncertain reference between neighbours cancels, since they share it.
#[test]
fn exact_the_reference_counts_at_the_ends() {
    let quiet = GyroscopeNoise { walk_deg_rs: 1e-9, ..NOISE };
    let one_way = [90.0; 20];
    let mut turned = one_way.to_vec();
    turned.extend([-90.0; 20]);
    let strengths = NoiseStrengths { reference_factors: [1.0, 1.0], coning_deg2_s: vec![0.0] };
    let fit =
        LeastSquares::solve(&intervals(&turned, 1e-4, 0.0, 25e-6), &quiet, &unknowns(), &strengths).unwrap();
    // Three anchors matter: both ends and the reversal. Out by 1,800 degrees and back: 1800 s + 20 b = e1 - e0,
    // -1800 s + 20 b = e2 - e1, so 3600 s = 2 e1 - e0 - e2, variance 6 of 25e-6 deg^2. The weighted anchors between can
    // only lower it.
    let ends_alone = math::sqrt(6.0 * 25e-6) / 3600.0;
    let sigma = math::sqrt(fit.covariance[(SCALE, SCALE)]);
    assert!(sigma < ends_alone && sigma > 0.2 * ends_alone, "{sigma} {ends_alone}");
    assert!((fit.found[SCALE] / 1e-4 - 1.0).abs() < 1e-9);
}

/// Residuals of one standard deviation each, with alternating signs that the fit cannot follow.
#[test]
fn exact_chi_square() {
    let mut seen = intervals(&[50.0, 50.0, -50.0, -50.0], 0.0, 0.0, 0.0);
    for (interval, sign) in seen.iter_mut().zip([1.0, -1.0, 1.0, -1.0]) {
        interval.shown_deg += sign * NOISE.walk_deg_rs;
    }
    let fit = fitted(&seen, &NOISE).unwrap();
    assert!((fit.chi_square - 4.0).abs() < 1e-9 && fit.degrees_of_freedom == 2);
    assert!(fit.scale.abs() < 1e-12 && fit.bias_deg_s.abs() < 1e-12);
    assert!((fit.distance_square(fit.scale_sigma(), 0.0) - 1.0).abs() < 1e-9, "uncorrelated here");
}

/// A reference whose true variance is four times the stated one, or a fourth, and a gyroscope with little noise: the
/// variances are changed until the residuals fit, and sigma is the same. To either side there are `n = 400` intervals:
/// what is known before moves the logarithm of the factor by `ln 4 / (1 + n / 2)`, which is 0.7 %.
#[test]
fn exact_a_reference_of_wrong_variances_is_detected() {
    let quiet = GyroscopeNoise { walk_deg_rs: 1e-7, ..NOISE };
    let turned: Vec<f64> = (0..800_u32).map(|k| if k % 4 < 2 { 80.0 } else { -80.0 }).collect();
    let fit = |stated_deg2: f64| {
        let mut seen = intervals(&turned, 0.0, 0.0, stated_deg2);
        // Errors of the anchors of 1e-3 deg rms, without pattern: the fractional parts of multiples of the
        // golden ratio, uniform.
        let error = |anchor: usize| {
            #[expect(clippy::cast_precision_loss, reason = "800")]
            let part = (anchor as f64 * 0.618_033_988_75).fract() - 0.5;
            1e-3 * part * math::sqrt(12.0)
        };
        for (index, interval) in seen.iter_mut().enumerate() {
            interval.turned_deg += error(index + 1) - error(index);
        }
        fitted(&seen, &quiet).unwrap()
    };
    let (exact, too_small, too_large) = (fit(1e-6), fit(0.25e-6), fit(4e-6));
    for side in [0, 1] {
        let factor = |fit: &CalibrationFit| fit.strengths.reference_factors[side];
        for (fit, expected) in [(&too_small, 4.0), (&too_large, 0.25)] {
            let per_exact = factor(fit) / factor(&exact);
            assert!((per_exact / expected - 1.0).abs() < 0.01, "{side}: {per_exact}");
            assert!((fit.scale_sigma() / exact.scale_sigma() - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn exact_what_cannot_be_told_apart_is_refused() {
    assert_eq!(fitted(&intervals(&[30.0; 10], 0.0, 0.0, 0.0), &NOISE), None, "one rate");
    assert_eq!(fitted(&intervals(&[30.0], 0.0, 0.0, 0.0), &NOISE), None);
    let silent = GyroscopeNoise { walk_deg_rs: 0.0, ..NOISE };
    assert_eq!(fitted(&intervals(&[30.0, 0.0, -30.0], 0.0, 0.0, 0.0), &silent), None, "no noise, no weights");
}

/// One more unknown that is known before to 25 ppm, and intervals that tell it to as much: the variance is half, and
/// what is found half of what is seen. Its column is made orthogonal to those of scale factor and bias.
#[test]
fn exact_what_is_known_before_weighs_as_much_as_it_should() {
    let mut all = intervals(&[50.0, 50.0, -50.0, -50.0], 0.0, 0.0, 0.0);
    // Seen +-c in turn, 4 times: information 4 c^2 q^2 / N^2 = 1 at q = 25 ppm.
    let cubed_deg = 0.5 * NOISE.walk_deg_rs / 25e-6;
    for (interval, sign) in all.iter_mut().zip([1.0, -1.0, 1.0, -1.0]) {
        interval.cubed_deg = sign * cubed_deg;
        interval.shown_deg += sign * cubed_deg * 40e-6;
    }
    let known = Unknowns { nonlinearity: 25e-6, ..unknowns() };
    let fit = CalibrationFit::to(&all, &NOISE, &known).unwrap();
    let (found, sigma) = fit.unknown(unknowns::NONLINEARITY);
    assert!((25e-6 * found / 20e-6 - 1.0).abs() < 1e-9, "{found}");
    assert!((sigma * sigma / 0.5 - 1.0).abs() < 1e-9, "{sigma}");
}

/// An error of the camera of 3 milli-degrees once a turn and -2 twice, on a rotor that turns by a twelfth at a time:
/// found to what the walk allows, and not taken for a scale factor. Over whole turns it has no part in that.
#[test]
fn exact_errors_of_the_camera_that_turn_with_the_angle_are_found() {
    let quiet = GyroscopeNoise { walk_deg_rs: 1e-7, ..NOISE };
    let turned: Vec<f64> = (0..72_u32).map(|k| if k < 48 { 30.0 } else { -30.0 }).collect();
    let mut all = intervals(&turned, 2e-4, 0.0, 1e-12);
    let error_deg = |part: f64| {
        let angle = std::f64::consts::TAU * part;
        3e-3 * math::sin_cos(angle).1 - 2e-3 * math::sin_cos(2.0 * angle).0
    };
    let mut angle_deg = 0.0;
    for interval in &mut all {
        let (from, until) = (angle_deg / 360.0, (angle_deg + interval.turned_deg) / 360.0);
        angle_deg += interval.turned_deg;
        interval.angles_turn = (from, until);
        interval.turned_deg += error_deg(until) - error_deg(from);
    }
    let fit = CalibrationFit::to(&all, &quiet, &Unknowns { camera_deg: 0.01, ..unknowns() }).unwrap();
    let found = unknowns::CAMERA.map(|unknown| 10.0 * fit.unknown(unknown).0);
    for (found, expected) in found.into_iter().zip([3.0, 0.0, 0.0, -2.0]) {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    assert!((fit.scale / 2e-4 - 1.0).abs() < 1e-5, "{}", fit.scale);
}

/// 300 made-up calibrations with coning under one of two drives, twenty times the random walk, which the fit has to
/// find: its errors are as large as it states, neither more nor less, and its intervals hold the truth as often as
/// they say. The strength is known to 1 / sqrt(2 n) of itself, n = 50 intervals.
#[test]
fn law_intervals_hold_the_truth_whatever_the_coning() {
    let turned: Vec<f64> = (0..150_u32).map(|k| [0.0, 40.0, -30.0][k as usize / 10 % 3]).collect();
    let mut stream = stream(5, RandomSource::GyroscopeWalk);
    let mut draw = |sigma: f64| {
        let normal: f64 = StandardNormal.sample(&mut stream);
        sigma * normal
    };
    let (coning_deg_rs, scale, runs) = (0.05, 3e-4, 300_u32);
    let (mut squares, mut covered, mut strengths) = (0.0, 0_u32, 0.0);
    for _ in 0..runs {
        let mut all = intervals(&turned, scale, 1e-3, 9e-6);
        let mut error_deg = draw(3e-3);
        for interval in &mut all {
            let until_deg = draw(3e-3);
            let coning_deg = if interval.turned_deg > 1.0 { draw(coning_deg_rs) } else { 0.0 };
            interval.drive =
                if interval.turned_deg > 1.0 { 1 } else { usize::from(interval.turned_deg < 0.0) * 2 };
            interval.shown_deg += draw(NOISE.walk_deg_rs) + coning_deg;
            interval.turned_deg += until_deg - error_deg;
            error_deg = until_deg;
        }
        let fit = fitted(&all, &NOISE).unwrap();
        let sigmas = (fit.scale - scale) / fit.scale_sigma();
        squares += sigmas * sigmas;
        covered += u32::from(sigmas.abs() < 1.96);
        strengths += math::sqrt(fit.strengths.coning_deg2_s[1]) / coning_deg_rs;
    }
    // Beyond these once in 10,000 sets each.
    let (low, high) = chi_square_mean_bounds(f64::from(runs), 5e-5);
    let mean_square = squares / f64::from(runs);
    assert!((low..=high).contains(&mean_square), "{mean_square} within {low} to {high}");
    let (least, most) = binomial_bounds(runs, 0.95);
    assert!((least - 6..=most + 6).contains(&covered), "{covered} of {runs}, {least} to {most}");
    let strength = strengths / f64::from(runs);
    assert!((strength - 1.0).abs() < 0.03, "{strength}");
}

/// 300 made-up calibrations, whose errors are to be as large as stated. Of an interval of a second: the turn in
/// degrees, the drive, the random walk by coning in deg/sqrt(s). The reference is off by 3 milli-degrees, and is said
/// to have the variance `stated_deg2`.
fn errors_are_as_stated(seed: u64, stated_deg2: f64, turns: &[(f64, usize, f64)]) {
    let mut stream = stream(seed, RandomSource::GyroscopeWalk);
    let mut draw = |sigma: f64| {
        let normal: f64 = StandardNormal.sample(&mut stream);
        sigma * normal
    };
    let turned: Vec<f64> = turns.iter().map(|(turned_deg, ..)| *turned_deg).collect();
    let (scale, runs) = (3e-4, 300_u32);
    let mut squares = 0.0;
    for _ in 0..runs {
        let mut all = intervals(&turned, scale, 1e-3, stated_deg2);
        let mut error_deg = draw(3e-3);
        for (interval, (_, drive, coning_deg_rs)) in all.iter_mut().zip(turns) {
            let until_deg = draw(3e-3);
            interval.drive = *drive;
            interval.shown_deg += draw(NOISE.walk_deg_rs) + draw(*coning_deg_rs);
            interval.turned_deg += until_deg - error_deg;
            error_deg = until_deg;
        }
        let fit = fitted(&all, &NOISE).unwrap();
        let sigmas = (fit.scale - scale) / fit.scale_sigma();
        squares += sigmas * sigmas;
    }
    // Beyond these once in 10,000 sets each.
    let (low, high) = chi_square_mean_bounds(f64::from(runs), 5e-5);
    let mean_square = squares / f64::from(runs);
    assert!((low..=high).contains(&mean_square), "{mean_square} within {low} to {high}");
}

/// A reference that is said to be three times as uncertain as it is, and coning that this could hide.
#[test]
fn law_a_reference_of_too_large_variances_hides_no_coning() {
    let drives = [(40.0, 1, 6e-3), (-30.0, 2, 6e-3)];
    let turns: Vec<_> = (0..300_usize).map(|k| drives[k / 10 % 2]).collect();
    errors_are_as_stated(7, 81e-6, &turns);
}

/// The fastest turns are a pilot of three intervals, with coning of a hundred times the random walk, and the slow ones
/// have nearly none.
#[test]
fn law_a_short_pilot_with_strong_coning_weighs_little() {
    // Rates in deg/s, intervals, and the random walk by coning in deg/sqrt(s).
    let drives = [(0.0, 30, 0.0), (120.0, 3, 0.025), (-100.0, 3, 0.01), (40.0, 30, 2e-3), (-50.0, 30, 1e-3)];
    let of_drive =
        |(drive, (rate_deg_s, count, coning_deg_rs))| vec![(rate_deg_s, drive, coning_deg_rs); count];
    let turns: Vec<_> = (0..).zip(drives).flat_map(of_drive).collect();
    errors_are_as_stated(6, 9e-6, &turns);
}
