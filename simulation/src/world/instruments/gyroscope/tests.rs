//! The gyroscope against its model and its data sheet.

use super::noise::{SECONDS_PER_HOUR, TimeSpan};
use super::*;
use crate::math::allan_deviation;
use crate::math::statistics::Spread;

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

/// No noise of any kind, and errors that are not drawn.
const PURE: [&str; 8] = [
    "gyroscope.parameters=nominal",
    "gyroscope.random_walk_deg_rh=0",
    "gyroscope.instability_deg_h=0",
    "gyroscope.resolution_deg=0",
    "gyroscope.misalignment_mrad=0",
    "gyroscope.nonlinearity_ppm=0",
    "gyroscope.warm_up_ppm=0",
    "gyroscope.warm_up_deg_h=0",
];

fn own_axis(turned_deg: f64) -> BodyTurn {
    BodyTurn::about_own_axis(turned_deg)
}

/// Angles of a gyroscope at rest.
fn at_rest(scene: &Scene, samples: usize) -> Vec<f64> {
    let mut gyroscope = Gyroscope::new(scene);
    let mut angle_deg = 0.0;
    let turned = (0..samples).map(|_| {
        angle_deg += gyroscope.sample(&own_axis(0.0)).turned_deg;
        angle_deg
    });
    std::iter::once(0.0).chain(turned).collect()
}

/// 0.1 degrees in 2 ms, that is 50 deg/s, with 500 ppm and 36 deg/h, that is 0.01 deg/s.
#[test]
fn exact_scale_factor_and_bias() {
    let pure = scene(&[&PURE[..], &["gyroscope.bias_deg_h=36"]].concat());
    let mut gyroscope = Gyroscope::new(&pure);
    for (turned_deg, expected_deg) in [(0.1, 0.100_05 + 2e-5), (-0.1, -0.100_05 + 2e-5), (0.0, 2e-5)] {
        let sample = gyroscope.sample(&own_axis(turned_deg));
        assert!((sample.turned_deg - expected_deg).abs() < 1e-15 && !sample.saturated, "{sample:?}");
    }
    let GyroscopeErrors { scale, bias_deg_s, .. } = gyroscope.errors();
    assert!((scale - 5e-4).abs() < 1e-18 && (bias_deg_s - 0.01).abs() < 1e-18);
}

/// 3 mrad: what turns across the rotor's axis shows by 0.003 of itself from either direction, and as much of the turn
/// about its own axis as without.
#[test]
fn exact_misalignment_shows_turns_across_the_axis() {
    let sets = ["gyroscope.scale_factor_ppm=0", "gyroscope.bias_deg_h=0", "gyroscope.misalignment_mrad=3"];
    let mut gyroscope = Gyroscope::new(&scene(&[&PURE[..], &sets].concat()));
    for (across_deg, more_deg) in [([0.2, 0.0], 6e-4), ([0.0, -0.3], -9e-4), ([0.1, 0.1], 6e-4)] {
        let sample = gyroscope.sample(&BodyTurn { own_axis_deg: 0.1, across_deg });
        assert!((sample.turned_deg - 0.1 - more_deg).abs() < 1e-15, "{sample:?}");
    }
}

/// 80 ppm of 400 deg/s at the end of the range, an eighth of that in the middle, and the other way the other sign.
#[test]
fn exact_non_linearity_grows_with_the_cube_of_the_rate() {
    let sets = ["gyroscope.scale_factor_ppm=0", "gyroscope.bias_deg_h=0", "gyroscope.nonlinearity_ppm=-80"];
    let mut gyroscope = Gyroscope::new(&scene(&[&PURE[..], &sets].concat()));
    for (turned_deg, more_deg) in [(0.8, -0.8 * 80e-6), (0.4, -0.8 * 10e-6), (-0.4, 0.8 * 10e-6), (0.0, 0.0)]
    {
        let sample = gyroscope.sample(&own_axis(turned_deg));
        assert!((sample.turned_deg - turned_deg - more_deg).abs() < 1e-15 && !sample.saturated, "{sample:?}");
    }
}

/// After one time constant of 10 s, 1 - 1/e of 1,000 ppm and of 36 deg/h has come; in the first sample nearly nothing.
#[test]
fn exact_warming_up_changes_scale_factor_and_bias() {
    let sets = [
        "gyroscope.scale_factor_ppm=100",
        "gyroscope.bias_deg_h=-36",
        "gyroscope.warm_up_ppm=1000",
        "gyroscope.warm_up_deg_h=36",
        "gyroscope.warm_up_s=10",
    ];
    let mut gyroscope = Gyroscope::new(&scene(&[&PURE[..], &sets].concat()));
    let samples: Vec<f64> = (0..5001).map(|_| gyroscope.sample(&own_axis(0.1)).turned_deg).collect();
    // The middle of a sample of 2 ms.
    for (sample, part) in [(0, 1.0 - math::exp(-1e-4)), (5000, 1.0 - math::exp(-1.0001))] {
        let expected = 0.1 * (1.0 + 100e-6 + 1e-3 * part) + 2e-3 * 0.01 * (part - 1.0);
        assert!((samples[sample] - expected).abs() < 1e-14, "{sample}: {} {expected}", samples[sample]);
    }
    let errors = gyroscope.errors();
    let part = 1.0 - math::exp(-1.0);
    assert!((errors.scale_at(10.0) - 100e-6 - 1e-3 * part).abs() < 1e-15);
    assert!((errors.bias_deg_s_at(10.0) - 0.01 * (part - 1.0)).abs() < 1e-15);
}

/// +-400 deg/s are 0.8 degrees a sample; the mean over the sample saturates.
#[test]
fn exact_saturation_clamps_and_says_so() {
    let mut gyroscope = Gyroscope::new(&scene(
        &[&PURE[..], &["gyroscope.scale_factor_ppm=0", "gyroscope.bias_deg_h=0"]].concat(),
    ));
    for (turned_deg, shown_deg, saturated) in [
        (0.799, 0.799, false),
        (0.801, 0.8, true),
        (-0.9, -0.8, true),
        (0.5, 0.5, false),
        (-0.79, -0.79, false),
    ] {
        let sample = gyroscope.sample(&own_axis(turned_deg));
        assert!((sample.turned_deg - shown_deg).abs() < 1e-15, "{sample:?}");
        assert_eq!(sample.saturated, saturated);
    }
}

#[test]
fn exact_samples_are_whole_units() {
    let mut sets = PURE.to_vec();
    sets[3] = "gyroscope.resolution_deg=0.25";
    sets.extend(["gyroscope.scale_factor_ppm=0", "gyroscope.bias_deg_h=0"]);
    let mut gyroscope = Gyroscope::new(&scene(&sets));
    for (turned_deg, shown_deg) in [(0.12, 0.0), (0.13, 0.25), (-0.38, -0.5), (0.5, 0.5)] {
        assert!((gyroscope.sample(&own_axis(turned_deg)).turned_deg - shown_deg).abs() < 1e-15);
    }
}

/// The slope of random walk, the plateau of the instability, both, and coarse units: Allan deviation of four hours at
/// rest against the closed form.
///
/// An estimate over spans of m of N samples scatters by about sqrt(m / N); four times that is allowed. The drift is
/// constant over a sample, which matters where the span is of a few samples.
#[test]
fn dual_allan_deviation_is_the_closed_form() {
    let samples = 4 * 3600 * 10;
    for (sets, spans) in [
        (&["gyroscope.instability_deg_h=0"][..], [1, 10, 100, 1000]),
        (&["gyroscope.random_walk_deg_rh=0", "gyroscope.resolution_deg=0"], [10, 100, 378, 1000]),
        (&["gyroscope.instability_deg_h=20"], [1, 10, 100, 1000]),
        (&["gyroscope.instability_deg_h=0", "gyroscope.resolution_deg=0.001"], [1, 10, 100, 1000]),
    ] {
        let common = ["gyroscope.sample_rate_hz=10", "gyroscope.instability_time_s=20"];
        let scene = scene(&[&common[..], sets].concat());
        let noise = GyroscopeNoise::of(&scene);
        let angles = at_rest(&scene, samples);
        for span in spans {
            let seen = allan_deviation::deviation_deg_s(&angles, noise.period_s, span).unwrap();
            #[expect(clippy::cast_precision_loss, reason = "counts")]
            let (span, samples) = (span as f64, samples as f64);
            let expected = noise.allan_deviation_deg_s(span * noise.period_s);
            let within = 0.01 + 4.0 * math::sqrt(span / samples);
            assert!((seen / expected - 1.0).abs() < within, "{sets:?} {span}: {seen} for {expected}");
        }
    }
}

/// What the data sheet says: 0.15 deg/h of means over an hour and sixty times that over a second; and 0.5 deg/h at the
/// plateau, 1.893 correlation times.
#[test]
fn exact_random_walk_and_plateau_are_those_of_the_data_sheet() {
    let of = |set: &str| GyroscopeNoise::of(&scene(&[set]));
    let walk = of("gyroscope.instability_deg_h=0");
    for (span_s, deg_h) in [(3600.0, 0.15), (1.0, 9.0), (100.0, 0.9)] {
        assert!((3600.0 * walk.allan_deviation_deg_s(span_s) / deg_h - 1.0).abs() < 1e-4);
    }
    let drift = of("gyroscope.random_walk_deg_rh=0");
    let deg_h = |per_time: f64| 3600.0 * drift.allan_deviation_deg_s(200.0 * per_time);
    assert!((deg_h(1.8926) / 0.5 - 1.0).abs() < 1e-4, "{}", deg_h(1.8926));
    assert!(deg_h(1.7) < deg_h(1.8926) && deg_h(2.1) < deg_h(1.8926));
}

/// The covariance of the angles over two spans is half of what joining them adds to the variance. Of two spans that are
/// apart it is the double integral of the drift's covariance.
#[test]
fn dual_covariance_of_spans() {
    let scene = scene(&["gyroscope.instability_time_s=3", "gyroscope.instability_deg_h=100"]);
    let noise = GyroscopeNoise::of(&scene);
    let span = |from_s, until_s| TimeSpan { from_s, until_s };
    let (one, two, both) = (span(1.0, 2.5), span(2.5, 6.0), span(1.0, 6.0));
    let sum = noise.covariance_deg2(one, one)
        + noise.covariance_deg2(two, two)
        + 2.0 * noise.covariance_deg2(one, two);
    assert!((sum / noise.covariance_deg2(both, both) - 1.0).abs() < 1e-12);
    assert!((noise.covariance_deg2(one, two) / noise.covariance_deg2(two, one) - 1.0).abs() < 1e-12);
    let three = span(8.0, 9.0);
    let rest = noise.covariance_deg2(one, three);
    // By the trapezoidal rule over both spans.
    let n = 200_u32;
    let at = |span: TimeSpan, i: u32| span.from_s + span.length_s() * (f64::from(i) + 0.5) / f64::from(n);
    let d2 = noise.drift_deg_s * noise.drift_deg_s / f64::from(n * n) * one.length_s() * three.length_s();
    let sum: f64 = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .map(|(i, j)| d2 * math::exp(-(at(three, j) - at(one, i)) / 3.0))
        .sum();
    assert!((rest / sum - 1.0).abs() < 1e-4, "{rest} {sum}");
}

/// Serial numbers and seeds name gyroscopes; the errors of 4,000 have the stated deviations, and do not depend on the
/// noise.
#[test]
fn law_gyroscopes_are_drawn_by_seed_and_serial() {
    let errors = |serial: u32, more: &str| {
        let serial = format!("gyroscope.serial={serial}");
        Gyroscope::new(&scene(&[&serial, more])).errors()
    };
    let scale: Spread = (0..4000).map(|serial| 1e6 * errors(serial, "seed=1").scale).collect();
    let bias: Spread = (0..4000).map(|serial| 3600.0 * errors(serial, "seed=1").bias_deg_s).collect();
    let of = |of: fn(GyroscopeErrors) -> f64| (0..4000).map(|s| of(errors(s, "seed=1"))).collect::<Spread>();
    let spreads = [
        (scale, 500.0),
        (bias, 10.0),
        (of(|errors| 1e3 * errors.misalignment_rad[0]), 2.0),
        (of(|errors| 1e3 * errors.misalignment_rad[1]), 2.0),
        (of(|errors| 1e6 * errors.nonlinearity), 25.0),
        (of(|errors| 1e6 * errors.warm_up.scale), 8.0),
        (of(|errors| SECONDS_PER_HOUR * errors.warm_up.bias_deg_s), 1.0),
    ];
    for (spread, sd) in spreads {
        assert!(spread.mean.abs() < 4.0 * sd / 63.0 && (spread.sd / sd - 1.0).abs() < 0.05, "{spread:?}");
    }
    assert_ne!(errors(0, "seed=1"), errors(0, "seed=2"));
    assert_eq!(errors(7, "seed=1"), errors(7, "gyroscope.random_walk_deg_rh=0"));
}

#[test]
fn exact_sample_rates_go_into_the_ticks() {
    for (rate, ticks) in [
        ("500", Some(200)),
        ("125", Some(800)),
        ("2000", Some(50)),
        ("10000", Some(10)),
        ("300", None),
        ("7", None),
    ] {
        let set = format!("gyroscope.sample_rate_hz={rate}");
        assert_eq!(ticks_per_sample(&scene(&[&set])).ok(), ticks, "{rate}");
    }
}
