//! The fit against closed forms.

use super::*;

const NOISE: GyroscopeNoise = GyroscopeNoise {
    period_s: 2e-3,
    walk_deg_rs: 2.5e-3,
    drift_deg_s: 0.0,
    drift_time_s: 200.0,
    resolution_deg: 0.0,
};

/// Intervals of 1 s, turned by `turned_deg` each, of a gyroscope without noise.
fn intervals(turned_deg: &[f64], scale: f64, bias_deg_s: f64, reference_deg2: f64) -> Vec<FitInterval> {
    let of = |(index, &turned_deg): (u32, &f64)| FitInterval {
        span: TimeSpan { from_s: f64::from(index), until_s: f64::from(index + 1) },
        shown_deg: (1.0 + scale) * turned_deg + bias_deg_s,
        turned_deg,
        variances_deg2: (reference_deg2, reference_deg2),
    };
    (0..).zip(turned_deg).map(of).collect()
}

/// Random walk alone, rates 0, 100 and -50 deg/s: the textbook's straight line through three points, slope and
/// intercept.
#[test]
fn exact_a_line_through_three_points() {
    let fit = CalibrationFit::to(&intervals(&[0.0, 100.0, -50.0], 3e-4, 0.02, 0.0), &NOISE).unwrap();
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
        let fit = CalibrationFit::to(&intervals(&turned, 0.0, 0.0, 0.0), &noise).unwrap();
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
    let fit = CalibrationFit::to(&intervals(&turned, 1e-4, 0.0, 25e-6), &quiet).unwrap();
    // Three anchors matter: both ends and the reversal. Out by 1,800 degrees and back: 1800 s + 20 b = e1 - e0,
    // -1800 s + 20 b = e2 - e1, so 3600 s = 2 e1 - e0 - e2, variance 6 of 25e-6 deg^2. The weighted anchors between can
    // only lower it.
    let ends_alone = math::sqrt(6.0 * 25e-6) / 3600.0;
    assert!(
        fit.scale_sigma() < ends_alone && fit.scale_sigma() > 0.2 * ends_alone,
        "{} {ends_alone}",
        fit.scale_sigma()
    );
    assert!((fit.scale / 1e-4 - 1.0).abs() < 1e-9);
}

/// Residuals of one standard deviation each, with alternating signs that the fit cannot follow.
#[test]
fn exact_chi_square() {
    let mut seen = intervals(&[50.0, 50.0, -50.0, -50.0], 0.0, 0.0, 0.0);
    for (interval, sign) in seen.iter_mut().zip([1.0, -1.0, 1.0, -1.0]) {
        interval.shown_deg += sign * NOISE.walk_deg_rs;
    }
    let fit = CalibrationFit::to(&seen, &NOISE).unwrap();
    assert!((fit.chi_square - 4.0).abs() < 1e-9 && fit.degrees_of_freedom == 2);
    assert!(fit.scale.abs() < 1e-12 && fit.bias_deg_s.abs() < 1e-12);
    assert!((fit.distance_square(fit.scale_sigma(), 0.0) - 1.0).abs() < 1e-9, "uncorrelated here");
}

/// A reference whose true variance is four times the stated one, and a gyroscope with little noise: the variances are
/// raised until the residuals fit, and sigma doubles.
#[test]
fn exact_an_overconfident_reference_is_detected() {
    let quiet = GyroscopeNoise { walk_deg_rs: 1e-7, ..NOISE };
    let turned: Vec<f64> = (0..200_u32).map(|k| if k % 4 < 2 { 80.0 } else { -80.0 }).collect();
    let fit = |stated_deg2: f64| {
        let mut seen = intervals(&turned, 0.0, 0.0, stated_deg2);
        // Errors of the anchors of 1e-3 deg rms, without pattern: the fractional parts of multiples of the
        // golden ratio, uniform.
        let error = |anchor: usize| {
            #[expect(clippy::cast_precision_loss, reason = "200")]
            let part = (anchor as f64 * 0.618_033_988_75).fract() - 0.5;
            1e-3 * part * math::sqrt(12.0)
        };
        for (index, interval) in seen.iter_mut().enumerate() {
            interval.turned_deg += error(index + 1) - error(index);
        }
        CalibrationFit::to(&seen, &quiet).unwrap()
    };
    let (exact, too_small, too_large) = (fit(1e-6), fit(0.25e-6), fit(4e-6));
    assert!(
        (too_small.reference_factor / exact.reference_factor / 4.0 - 1.0).abs() < 0.03,
        "{too_small:?} {exact:?}"
    );
    assert!((too_small.scale_sigma() / exact.scale_sigma() - 1.0).abs() < 0.02);
    assert!((too_large.reference_factor - 1.0).abs() < 1e-12 && too_large.chi_square < 0.5 * 198.0);
}

#[test]
fn exact_what_cannot_be_told_apart_is_refused() {
    assert_eq!(CalibrationFit::to(&intervals(&[30.0; 10], 0.0, 0.0, 0.0), &NOISE), None, "one rate");
    assert_eq!(CalibrationFit::to(&intervals(&[30.0], 0.0, 0.0, 0.0), &NOISE), None);
    let silent = GyroscopeNoise { walk_deg_rs: 0.0, ..NOISE };
    assert_eq!(
        CalibrationFit::to(&intervals(&[30.0, 0.0, -30.0], 0.0, 0.0, 0.0), &silent),
        None,
        "no noise, no weights"
    );
}
