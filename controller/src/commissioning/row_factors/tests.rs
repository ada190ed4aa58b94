use super::*;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

fn row(own: f32, measured: Option<(f32, f32)>) -> RowMeasured {
    leant(own, 0.0, measured)
}

fn leant(own: f32, lever: f32, measured: Option<(f32, f32)>) -> RowMeasured {
    RowMeasured { own, lever, measured: measured.map(|(mean, variance)| Normal { mean, variance }) }
}

/// The same by the conditional law of a joint normal in `f64`, written out as matrices.
#[test]
fn dual_rows_are_conditioned_on_what_was_measured() {
    let spread = 0.04;
    let rows = [
        leant(0.01, -0.1, Some((1.10, 0.004))),
        leant(0.02, -0.2, None),
        leant(0.0036, 0.0, Some((1.25, 0.001))),
        leant(0.05, 0.15, Some((0.9, 0.01))),
    ];
    let factors = RowFactors::of(spread, rows.iter().copied());
    assert!(!factors.has_other_shape());
    let measured = [0, 2, 3];
    let prior = |i: usize, j: usize| {
        let slope = f64::from(rows[i].lever) * f64::from(rows[j].lever);
        f64::from(spread) + slope + if i == j { f64::from(rows[i].own) } else { 0.0 }
    };
    let noise = |i: usize| f64::from(rows[i].measured.unwrap().variance);
    let of_measured = Matrix3::from_fn(|a, b| {
        prior(measured[a], measured[b]) + if a == b { noise(measured[a]) } else { 0.0 }
    });
    let inverse = of_measured.try_inverse().unwrap();
    let off = Vector3::from_iterator(measured.map(|row| f64::from(rows[row].measured.unwrap().mean) - 1.0));
    for (i, row) in rows.iter().enumerate() {
        let across = Vector3::from_iterator(measured.map(|j| prior(i, j)));
        let mean = 1.0 + (across.transpose() * inverse * off)[0];
        let variance = prior(i, i) - (across.transpose() * inverse * across)[0];
        let found = factors.row(row);
        assert!((f64::from(found.mean) - mean).abs() < 1e-5, "{i} {found:?} {mean}");
        assert!((f64::from(found.variance) / variance - 1.0).abs() < 1e-4, "{i} {found:?} {variance}");
    }
}

#[test]
fn exact_nothing_measured_is_the_prior() {
    let factors = RowFactors::of(0.04, [row(0.01, None); 3].into_iter());
    assert_eq!(factors.common(), Normal { mean: 1.0, variance: 0.04 });
    assert_eq!(factors.row(&row(0.0, None)), factors.common());
    assert_eq!(factors.reduced_chi_square(), None);
}

/// A related table that is known exactly, fully correlated and as wide: both factors are the same.
#[test]
fn exact_a_related_table_tells_the_factor() {
    let known = RowFactors::of(0.04, [row(0.0, Some((1.3, 1e-9)))].into_iter());
    let other = RowFactors::of(0.04, [row(0.0, None)].into_iter()).related(&known, 0.04);
    assert!((other.common().mean - 1.3).abs() < 1e-4 && other.common().variance < 1e-6, "{other:?}");
    let apart = RowFactors::of(0.04, [row(0.0, None)].into_iter()).related(&known, 0.0);
    assert_eq!(apart.common(), Normal { mean: 1.0, variance: 0.04 });
}

/// A motor of a fifteenth of the prior's rate: the measurement decides, not the prior.
#[test]
fn law_a_level_far_outside_the_prior_is_believed() {
    let rows = [row(0.0025, Some((0.066, 4e-4))), row(0.0025, Some((0.07, 4e-4)))];
    let factors = RowFactors::of(0.0064, rows.into_iter());
    assert!((factors.common().mean - 0.068).abs() < 0.01, "{factors:?}");
    assert!((factors.row(&rows[0]).mean - 0.067).abs() < 0.01);
}

/// Rows that contradict one another beyond 1 % each keep what was measured, and the rows that were not measured are
/// widened by the variance between rows.
#[test]
fn law_another_shape_frees_the_rows() {
    let rows =
        [row(0.0025, Some((2.5, 0.01))), row(0.0025, Some((0.5, 0.001))), row(0.0025, Some((0.06, 0.001)))];
    let factors = RowFactors::of(0.0064, rows.into_iter());
    assert!(factors.has_other_shape());
    for row in &rows {
        let Normal { mean, .. } = row.measured.unwrap();
        assert!((factors.row(row).mean - mean).abs() < 0.05, "{:?}", factors.row(row));
    }
    assert!(factors.row(&row(0.0025, None)).variance > 0.5);
}

/// Rows that lie apart by less than a test of the shape tells, at a level that no motor of the prior has: each
/// follows what was measured of it. Of rows of equal weight the variance between them is that of their means, 0.03,
/// less what each explains by itself.
#[test]
fn exact_another_level_frees_the_rows() {
    let rows = [0.35, 0.05, 0.05].map(|mean| row(0.0025, Some((mean, 0.01))));
    let factors = RowFactors::of(0.0064, rows.into_iter());
    assert!(!factors.has_other_shape() && factors.has_other_level(), "{factors:?}");
    let own = 0.01 + 0.0025 * 0.15 * 0.15;
    assert!((factors.extra - (0.03 - own)).abs() < 1e-5, "{factors:?}");
    assert!(factors.row(&rows[0]).mean > 0.2 && factors.row(&rows[1]).mean < 0.12);
    let alike = [0.15, 0.16, 0.14].map(|mean| row(0.0025, Some((mean, 0.01))));
    let extra = RowFactors::of(0.0064, alike.into_iter()).extra;
    assert!(extra.abs() < 1e-9, "nothing is left to explain: {extra}");
}

/// Rows of equal weight: the variance between rows is that of the means less what each row explains by itself.
#[test]
fn exact_the_variance_between_rows_is_what_is_not_explained() {
    let rows = [0.5, 1.5, 2.5].map(|mean| row(0.0025, Some((mean, 0.0075))));
    let factors = RowFactors::of(0.0064, rows.into_iter());
    assert!((factors.extra - (1.0 - 0.01)).abs() < 1e-5, "{factors:?}");
}

/// Rows on a line: where the motors of the map may have a slope they have its shape, where they have none they do
/// not.
#[test]
fn law_a_slope_is_no_other_shape() {
    let of = |lever: f32| {
        let rows = [-1.0, -0.5, 0.0, 0.5].map(|x| leant(1e-4, lever * x, Some((0.5 + 0.1 * x, 1e-4))));
        RowFactors::of(0.04, rows.into_iter())
    };
    assert!(!of(0.2).has_other_shape() && of(0.0).has_other_shape());
}

/// A motor of half the level has half the slope and half the deviations: the variance of a row that was not
/// measured, by the conditional law of a joint normal.
#[test]
fn dual_a_slow_motor_has_less_of_a_slope() {
    let (own, noise, spread) = (0.01_f64, 0.001_f64, 0.04_f64);
    let levers = [-0.2_f64, 0.2];
    let rows = levers.map(|lever| leant(0.01, lever as f32, Some((0.5, 0.001))));
    let found = RowFactors::of(0.04, rows.into_iter()).row(&leant(0.01, -0.4, None));
    let prior = |a: f64, b: f64| spread + 0.25 * a * b;
    let of_measured =
        Matrix2::from_fn(|a, b| prior(levers[a], levers[b]) + if a == b { 0.25 * own + noise } else { 0.0 });
    let across = Vector2::from(levers.map(|lever| prior(lever, -0.4)));
    let known = (across.transpose() * of_measured.try_inverse().unwrap() * across)[0];
    let variance = prior(-0.4, -0.4) + 0.25 * own - known;
    assert!((f64::from(found.variance) / variance - 1.0).abs() < 1e-4, "{found:?} {variance}");
}

/// The same with a slope, by matrices in `f64`: added to the deviations it would make Q what is expected of it, as
/// far as weights stay the same.
#[test]
fn dual_the_variance_between_rows_leaves_out_the_slope() {
    let rows = [(0.5_f32, -0.3_f32), (2.5, 0.0), (1.5, 0.2)]
        .map(|(mean, lever)| leant(0.0025, lever, Some((mean, 0.0075))));
    let factors = RowFactors::of(0.04, rows.into_iter());
    let of_rows = Matrix3::from_fn(|i, j| {
        f64::from(rows[i].lever) * f64::from(rows[j].lever) + if i == j { 0.01 } else { 0.0 }
    });
    let m = of_rows.try_inverse().unwrap();
    let (ones, y) =
        (Vector3::repeat(1.0), Vector3::from_fn(|i, _| f64::from(rows[i].measured.unwrap().mean)));
    let precision = (m * ones).sum();
    let off = y - ones * ((m * y).sum() / precision);
    let extra = (off.dot(&(m * off)) - 2.0) / (m.trace() - (m * ones).norm_squared() / precision);
    assert!((f64::from(factors.extra) / extra - 1.0).abs() < 1e-4, "{} {extra}", factors.extra);
}

/// 1,000 motors of the prior, by the inverse of the normal law at even places: about 1 % are told to have another
/// shape. The bound is four standard deviations of a count of 1,000 at 1 %.
#[test]
fn law_motors_of_the_prior_keep_its_shape() {
    let mut state = 1_u64;
    let mut normal = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        quantiles::normal(((state >> 40) as f32 + 0.5) / (1_u64 << 24) as f32)
    };
    let mut told = 0;
    for _ in 0..1000 {
        let (common, slope) = (1.0 + 0.2 * normal(), normal());
        let rows = [(0.01_f32, -0.2), (0.02, -0.1), (0.005, 0.0), (0.03, 0.1)].map(|(own, lever)| {
            let mean = common + lever * slope + (own + 0.01).sqrt() * normal();
            leant(own, lever, Some((mean, 0.01)))
        });
        told += u32::from(RowFactors::of(0.04, rows.into_iter()).has_other_shape());
    }
    assert!(told <= 10 + 13, "{told}");
}
