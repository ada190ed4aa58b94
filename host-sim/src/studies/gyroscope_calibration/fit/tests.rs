use super::*;

const NOISE: Noise =
    Noise { period_s: 2e-3, walk_deg_rs: 2.5e-3, drift_deg_s: 0.0, drift_time_s: 200.0, resolution_deg: 0.0 };

/// Intervals of 1 s, turned by `turned_deg` each, of a gyroscope without noise.
fn intervals(turned_deg: &[f64], scale: f64, bias_deg_s: f64, reference_deg2: f64) -> Vec<Interval> {
    let of = |(index, &turned_deg): (u32, &f64)| Interval {
        span: Span { from_s: f64::from(index), until_s: f64::from(index + 1) },
        shown_deg: (1.0 + scale) * turned_deg + bias_deg_s,
        turned_deg,
        variances_deg2: (reference_deg2, reference_deg2),
    };
    (0..).zip(turned_deg).map(of).collect()
}

/// Random walk alone, rates 0, 100 and -50 deg/s: the textbook's straight line through three points, slope and intercept.
#[test]
fn exact_a_line_through_three_points() {
    let fit = Fit::to(&intervals(&[0.0, 100.0, -50.0], 3e-4, 0.02, 0.0), &NOISE).unwrap();
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

/// At a constant drift the bias is no better than the drift, however long it is looked at; and the scale factor does not mind.
#[test]
fn exact_a_drift_that_does_not_change_adds_to_the_bias_alone() {
    let turned: Vec<f64> = (0..100_u32).map(|k| if k % 2 == 0 { 80.0 } else { -80.0 }).collect();
    let sigma = |drift_deg_s| {
        let noise = Noise { drift_deg_s, drift_time_s: 1e9, ..NOISE };
        let fit = Fit::to(&intervals(&turned, 0.0, 0.0, 0.0), &noise).unwrap();
        (fit.scale_sigma(), fit.bias_sigma_deg_s())
    };
    let (still, drifting) = (sigma(0.0), sigma(1e-3));
    assert!((drifting.0 / still.0 - 1.0).abs() < 1e-6);
    let sum = math::sqrt(still.1 * still.1 + 1e-6);
    assert!((drifting.1 / sum - 1.0).abs() < 1e-4, "{drifting:?} {sum}");
}

/// An uncertain reference in the middle cancels, as neighbours share it: only both ends count.
#[test]
fn exact_the_reference_counts_at_the_ends() {
    let quiet = Noise { walk_deg_rs: 1e-9, ..NOISE };
    let one_way = [90.0; 20];
    let mut turned = one_way.to_vec();
    turned.extend([-90.0; 20]);
    let fit = Fit::to(&intervals(&turned, 1e-4, 0.0, 25e-6), &quiet).unwrap();
    // Three anchors matter: both ends and the reversal. Out by 1,800 degrees and back, s and b have (e1 - e0) and (e2 - e1) to live by:
    // 1800 s + 20 b = e1 - e0, -1800 s + 20 b = e2 - e1, so 3600 s = 2 e1 - e0 - e2, variance 6 of 25e-6 deg^2. Weighting the anchors between does better, not worse.
    let ends_alone = math::sqrt(6.0 * 25e-6) / 3600.0;
    assert!(
        fit.scale_sigma() < ends_alone && fit.scale_sigma() > 0.2 * ends_alone,
        "{} {ends_alone}",
        fit.scale_sigma()
    );
    assert!((fit.scale / 1e-4 - 1.0).abs() < 1e-9);
}

/// Residuals of one standard deviation each: two intervals more than unknowns, off by + and - so that the fit cannot follow.
#[test]
fn exact_chi_square() {
    let mut seen = intervals(&[50.0, 50.0, -50.0, -50.0], 0.0, 0.0, 0.0);
    for (interval, sign) in seen.iter_mut().zip([1.0, -1.0, 1.0, -1.0]) {
        interval.shown_deg += sign * NOISE.walk_deg_rs;
    }
    let fit = Fit::to(&seen, &NOISE).unwrap();
    assert!((fit.chi_square - 4.0).abs() < 1e-9 && fit.degrees_of_freedom == 2);
    assert!(fit.scale.abs() < 1e-12 && fit.bias_deg_s.abs() < 1e-12);
    assert!((fit.distance_square(fit.scale_sigma(), 0.0) - 1.0).abs() < 1e-9, "uncorrelated here");
}

/// A reference four times as uncertain as it says, and a gyroscope that hardly counts: the variances are raised until the residuals are as they should be, and sigma doubles.
#[test]
fn exact_an_overconfident_reference_is_found_out() {
    let quiet = Noise { walk_deg_rs: 1e-7, ..NOISE };
    let turned: Vec<f64> = (0..200_u32).map(|k| if k % 4 < 2 { 80.0 } else { -80.0 }).collect();
    let fit = |stated_deg2: f64| {
        let mut seen = intervals(&turned, 0.0, 0.0, stated_deg2);
        // Errors of the anchors of 1e-3 deg rms, without pattern: the fractional parts of multiples of the golden ratio, uniform.
        let error = |anchor: usize| {
            #[expect(clippy::cast_precision_loss, reason = "200")]
            let part = (anchor as f64 * 0.618_033_988_75).fract() - 0.5;
            1e-3 * part * math::sqrt(12.0)
        };
        for (index, interval) in seen.iter_mut().enumerate() {
            interval.turned_deg += error(index + 1) - error(index);
        }
        Fit::to(&seen, &quiet).unwrap()
    };
    let (honest, sure, modest) = (fit(1e-6), fit(0.25e-6), fit(4e-6));
    assert!(
        (sure.reference_factor / honest.reference_factor / 4.0 - 1.0).abs() < 0.03,
        "{sure:?} {honest:?}"
    );
    assert!((sure.scale_sigma() / honest.scale_sigma() - 1.0).abs() < 0.02);
    assert!((modest.reference_factor - 1.0).abs() < 1e-12 && modest.chi_square < 0.5 * 198.0);
}

#[test]
fn exact_what_cannot_be_told_apart_is_refused() {
    assert_eq!(Fit::to(&intervals(&[30.0; 10], 0.0, 0.0, 0.0), &NOISE), None, "one rate");
    assert_eq!(Fit::to(&intervals(&[30.0], 0.0, 0.0, 0.0), &NOISE), None);
    let silent = Noise { walk_deg_rs: 0.0, ..NOISE };
    assert_eq!(
        Fit::to(&intervals(&[30.0, 0.0, -30.0], 0.0, 0.0, 0.0), &silent),
        None,
        "no noise, no weights"
    );
}
