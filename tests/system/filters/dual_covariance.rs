//! The factorised covariance against the textbook's filter in 200 bits, where rounding is worst.
#![expect(
    clippy::disallowed_methods,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "test data, spread over decades"
)]

mod pair;
mod random_systems;

use benches::matrix_covariance::{Conventional, CovarianceForm, Joseph};
use motor_model::Real;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};
use ud_filter::{Blocks2, Dense, NoiseSource, Refusal, UdCovariance, UpperTriangular};

use crate::support::precise_filter::PreciseFilter;
use pair::{Pair, all_positive, distance, rounded};

/// Bierman's example: `h = [1, e]` and then `[1, 1]` with e^2 lost to rounding, at a variance of 1 / e^2. The
/// conventional form ends with a negative variance; here Joseph's still holds.
#[test]
fn dual_ill_conditioned_updates_stay_definite() {
    let e = 2.0_f64.powi(-13);
    let (start, rows) = ([1.0 / (e * e); 2], [[1.0, e], [1.0, 1.0]]);
    let mut pair = Pair::<f32, 2>::new(start);
    let mut conventional = Conventional::<f32, 2>::from_diagonal(&Vector2::from(start).map(|x| x as f32));
    let mut joseph = Joseph::<f32, 2>::from_diagonal(&Vector2::from(start).map(|x| x as f32));
    for row in rows {
        pair.update(row, 1.0, 0.5);
        let row = Vector2::from(row).map(|x| x as f32);
        assert!(conventional.take_in(&row, 1.0, 0.5, &mut Vector2::zeros()));
        assert!(joseph.take_in(&row, 1.0, 0.5, &mut Vector2::zeros()));
    }
    let exact = pair.precise.covariance();
    println!(
        "factors {:e}, conventional {:e}, Joseph {:e}",
        pair.distance(),
        distance(&conventional.0, &exact),
        distance(&joseph.0, &exact)
    );
    assert!(all_positive(&pair.factors) && pair.distance() < 1e-5, "{}", pair.distance());
    assert!(UdCovariance::from_covariance(&conventional.0.map(f64::from)).is_err(), "{}", conventional.0);
}

/// Verhaegen and Van Dooren's kind of system: three states, two of them seen almost alike.
#[test]
fn dual_nearly_equal_sensors_stay_definite() {
    let d = 1e-4;
    let mut pair = Pair::<f32, 3>::new([1.0; 3]);
    let mut conventional = Conventional::<f32, 3>::from_diagonal(&Vector3::repeat(1.0));
    for row in [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + d]] {
        pair.update(row, d * d, 0.5);
        let row = Vector3::from(row).map(|x| x as f32);
        conventional.take_in(&row, (d * d) as f32, 0.5, &mut Vector3::zeros());
    }
    println!("factors {:e}", pair.distance());
    assert!(all_positive(&pair.factors) && pair.distance() < 1e-3, "{}", pair.distance());
    assert!(UdCovariance::from_covariance(&conventional.0.map(f64::from)).is_err(), "{}", conventional.0);
}

fn assert_repeated_measurements<T: Real>(bound: f64) {
    let mut pair = Pair::<T, 3>::new([1.0, 2.0, 3.0]);
    for _ in 0..3000 {
        pair.update([1.0, 0.5, -0.25], 1e-2, 0.7);
        assert!(all_positive(&pair.factors));
    }
    println!("{:e} {:e}", pair.distance(), pair.sigmas());
    assert!(pair.distance() < bound && pair.sigmas() < bound, "{:e} {:e}", pair.distance(), pair.sigmas());
}

/// The same combination measured three thousand times, without process noise.
#[test]
fn dual_identical_measurements_do_not_wear_the_factors() {
    assert_repeated_measurements::<f64>(1e-11);
    assert_repeated_measurements::<f32>(1e-3);
}

fn assert_spans_decades<T: Real>(bound: f64) {
    let mut pair = Pair::<T, 4>::new([1e-12, 1e12, 1e-4, 1e4]);
    let f = Dense(rounded::<T, 4, 4>(&SMatrix::<f64, 4, 4>::from_fn(|i, j| {
        if i == j { 1.0 } else { 0.01 * ((3 * i + 5 * j) % 7) as f64 - 0.03 }
    })));
    for (k, r) in [1e-14, 1e10, 1e-6, 1.0, 1e-14, 1e6].into_iter().cycle().take(60).enumerate() {
        pair.predict(&f, &f.0, &[]);
        let row = [1.0, 0.1 * (k % 3) as f64, -0.5, (k % 2) as f64];
        pair.update(row, r, 0.3);
        assert!(all_positive(&pair.factors), "{k}");
    }
    println!("{:e}", pair.distance());
    assert!(pair.distance() < bound, "{:e}", pair.distance());
}

/// Start variances of 1e-12 to 1e12, sensors of 1e-14 to 1e10 in turn, no process noise: standard errors thirteen
/// decades apart, so that `f32` can say no more than that all is positive.
#[test]
fn dual_variances_twenty_four_decades_apart() {
    assert_spans_decades::<f64>(1e-11);
    let mut p = UdCovariance::<f32, 2>::from_diagonal(&Vector2::new(1e12, 1e-12));
    for _ in 0..100 {
        p.predict(&Dense(Matrix2::new(1.0, 0.5, 0.25, 1.0)), &[]).expect("a plain model");
        p.update(&Vector2::new(1.0, 1.0), 1e-14, 0.0, &mut Vector2::zeros()).expect("a plain measurement");
        p.update(&Vector2::new(1.0, -1.0), 1e12, 0.0, &mut Vector2::zeros()).expect("a plain measurement");
        assert!(all_positive(&p));
    }
}

fn assert_intervals<T: Real>(bound: f64) {
    let mut pair = Pair::<T, 2>::new([1e-6, 1e2]);
    let (mut gain, mut worst) = (0.0_f64, 0.0_f64);
    for (k, dt) in [1e-6, 10.0, 1e-3, 1e-6, 1e-6, 0.1].into_iter().cycle().take(600).enumerate() {
        let f = UpperTriangular(rounded::<T, 2, 2>(&Matrix2::new(1.0, dt, 0.0, 1.0)));
        let sources = [([dt / 2.0, 1.0], dt), ([1.0, 0.0], dt * dt * dt / 12.0)];
        let noise = sources
            .map(|(g, v)| NoiseSource { gain: rounded(&Vector2::from(g)), variance: T::from_f64(1e-3 * v) });
        pair.predict(&f, &f.0, &noise);
        gain = gain.max(pair.update([1.0, 0.0], 1e-8, 1e-3 * (k % 5) as f64));
        worst = worst.max(pair.distance());
        assert!(all_positive(&pair.factors));
    }
    println!("{worst:e} {gain:e}");
    assert!(worst < bound && gain < bound, "{worst:e} {gain:e}");
}

/// One microsecond and ten seconds between the same measurements.
#[test]
fn dual_intervals_seven_decades_apart() {
    assert_intervals::<f64>(1e-12);
    assert_intervals::<f32>(1e-3);
}

fn assert_two_sensors<T: Real>(bound: f64) {
    let mut pair = Pair::<T, 2>::new([1.0, 1.0]);
    let f = Blocks2([rounded::<T, 2, 2>(&Matrix2::new(0.99, 0.1, -0.1, 0.99))]);
    let noise = [NoiseSource { gain: rounded(&Vector2::new(0.0, 1.0)), variance: T::from_f64(1e-6) }];
    let mut worst = 0.0_f64;
    for k in 0..2000 {
        pair.predict(&f, &f.matrix(), &noise);
        pair.update([1.0, 0.0], 1e-12, 1e-3 * f64::from(k % 7));
        pair.update([0.3, 1.0], 1e12, 1e5);
        worst = worst.max(pair.distance());
        assert!(all_positive(&pair.factors));
    }
    println!("{worst:e} {:e}", pair.sigmas());
    assert!(worst < bound && pair.sigmas() < bound, "{worst:e} {:e}", pair.sigmas());
}

/// A nearly perfect sensor and a nearly useless one on the same states.
#[test]
fn dual_good_and_useless_sensors_together() {
    assert_two_sensors::<f64>(1e-12);
    assert_two_sensors::<f32>(1e-3);
}

/// Distance from the exact covariance after 2^`doublings` predictions one by one.
fn drift<T: Real>(f: &Matrix2<f64>, doublings: u32) -> f64 {
    let f = rounded::<T, 2, 2>(f);
    let mut p = UdCovariance::<T, 2>::from_diagonal(&rounded(&Vector2::new(1.0, 4.0)));
    for _ in 0..1_u32 << doublings {
        p.predict(&Blocks2([f]), &[]).expect("a plain model");
        assert!(all_positive(&p));
    }
    let mut exact = PreciseFilter::<2>::new(&Matrix2::new(1.0, 0.0, 0.0, 4.0));
    exact.predict_power_of_two(&f.map(Real::to_f64), doublings);
    distance(&p.covariance(), &exact.covariance())
}

/// A billion predictions without noise or measurement. A million (2^20) are made one by one and compared with the exact
/// power of the transition, from twenty squarings in 200 bits; so are 2^16, and the error has grown no faster than the
/// count. A billion (2^30) are then within 2^10 times the error of a million, and the thirty squarings in one map are
/// what the factors carry at once.
#[test]
fn dual_a_billion_predictions_drift_by_rounding_only() {
    // Nearly a rotation: over 2^30 steps the determinant's rounding changes the scale by 1e-7.
    let f = Matrix2::new(0.8, 0.6, -0.6, 0.8);
    let (few, many) = (drift::<f64>(&f, 16), drift::<f64>(&f, 20));
    println!("f64 {few:e} {many:e}");
    assert!(many < 32.0 * few && many * 1024.0 < 1e-6, "{few:e} {many:e}");
    let (few, many) = (drift::<f32>(&f, 16), drift::<f32>(&f, 20));
    println!("f32 {few:e} {many:e}");
    assert!(many < 32.0 * few, "{few:e} {many:e}");

    let mut exact = PreciseFilter::<2>::new(&Matrix2::new(1.0, 0.0, 0.0, 4.0));
    let map = exact.predict_power_of_two(&f, 30);
    let mut at_once = UdCovariance::<f64, 2>::from_diagonal(&Vector2::new(1.0, 4.0));
    at_once.transform(&map).expect("a plain model");
    assert!(distance(&at_once.covariance(), &exact.covariance()) < 1e-14);
}

fn assert_refuses<T: Real, const N: usize>(huge: f64, denormal: f64) {
    let mut p =
        UdCovariance::<T, N>::from_diagonal(&SVector::from_fn(|i, _| T::from_f64(1.0 + 3.0 * i as f64)));
    let mut x = SVector::<T, N>::from_fn(|i, _| T::from_f64(0.5 - i as f64));
    let (before, row) = ((p, x), SVector::repeat(T::one()));
    let (nan, infinite) = (T::from_f64(f64::NAN), T::from_f64(f64::INFINITY));
    let cases = [
        (T::one(), nan, Refusal::Innovation),
        (T::one(), infinite, Refusal::Innovation),
        (T::one(), -infinite, Refusal::Innovation),
        (T::one(), T::from_f64(huge), Refusal::Innovation),
        (nan, T::one(), Refusal::Noise),
        (-T::one(), T::one(), Refusal::Noise),
        (infinite, T::one(), Refusal::Uncertain),
    ];
    for (noise, innovation, why) in cases {
        assert_eq!(p.update(&row, noise, innovation, &mut x), Err(why), "{noise} {innovation}");
        assert_eq!(p.update_state::<1>(noise, innovation, &mut x), Err(why), "{noise} {innovation}");
        assert_eq!((p, x), before);
    }
    let poisoned = SVector::from_fn(|i, _| if i == 1 { nan } else { T::one() });
    assert_eq!(p.update(&poisoned, T::one(), T::one(), &mut x), Err(Refusal::Uncertain));
    let nothing = SVector::zeros();
    assert_eq!(p.update(&nothing, T::zero(), T::one(), &mut x), Err(Refusal::Certain));
    assert_eq!((p, x), before);
    // A denormal measurement is a measurement like any other, and so is a large one within range.
    for innovation in [denormal, -denormal, huge.sqrt() * 1e-3] {
        let correction = p.update(&row, T::one(), T::from_f64(innovation), &mut x).expect("a measurement");
        assert!(correction.normalised_squared.to_f64().is_finite());
        assert!(x.iter().all(|x| x.to_f64().is_finite()) && all_positive(&p));
    }
}

#[test]
fn law_measurements_that_are_no_numbers_change_nothing() {
    assert_refuses::<f64, 2>(1e200, 5e-324);
    assert_refuses::<f32, 2>(1e30, 1e-45);
    assert_refuses::<f64, 6>(1e200, 5e-324);
    assert_refuses::<f32, 6>(1e30, 1e-45);
}

/// A perfect measurement takes one direction out of P; a second of the same is refused as certain; noise brings the
/// direction back.
#[test]
fn exact_perfect_measurements_leave_a_semidefinite_covariance() {
    let mut p = UdCovariance::<f64, 2>::from_diagonal(&Vector2::new(1.0, 4.0));
    let mut x = Vector2::zeros();
    p.update(&Vector2::new(1.0, 0.0), 0.0, 3.0, &mut x).expect("informative");
    assert_eq!((p.covariance(), x), (Matrix2::new(0.0, 0.0, 0.0, 4.0), Vector2::new(3.0, 0.0)));
    assert_eq!(p.update(&Vector2::new(1.0, 0.0), 0.0, 1.0, &mut x), Err(Refusal::Certain));
    p.update(&Vector2::new(0.0, 1.0), 0.0, 1.0, &mut x).expect("informative");
    assert_eq!(p.covariance(), Matrix2::zeros());
    // Nothing is left to carry, whatever the shape of the map.
    let f = Matrix2::new(0.8, 0.6, -0.6, 0.8);
    p.predict(&Blocks2([f]), &[]).expect("a plain model");
    assert_eq!(p.covariance(), Matrix2::zeros());
    p.predict(&Dense(f), &[]).expect("a plain model");
    assert_eq!(p.covariance(), Matrix2::zeros());
    p.predict(
        &UpperTriangular(Matrix2::new(1.0, 0.5, 0.0, 1.0)),
        &[NoiseSource { gain: Vector2::new(0.5, 1.0), variance: 2.0 }],
    )
    .expect("a plain model");
    assert!((p.covariance() - Matrix2::new(0.5, 1.0, 1.0, 2.0)).abs().max() < 1e-15, "{}", p.covariance());
    p.update(&Vector2::new(1.0, 1.0), 1.0, 1.0, &mut x).expect("informative");
    assert!(p.covariance().iter().all(|entry| entry.is_finite()));
}

/// A saltation matrix that forgets one combination of states: the transform is singular, the covariance semidefinite,
/// and nothing is NaN.
#[test]
fn exact_a_singular_map_is_carried() {
    let map = SMatrix::<f64, 3, 3>::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 2.0, 1.0);
    let start = SMatrix::<f64, 3, 3>::new(4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0);
    let mut p = UdCovariance::from_covariance(&start).expect("positive definite");
    assert!((p.covariance() - start).abs().max() < 1e-15);
    p.transform(&map).expect("a plain model");
    assert!((p.covariance() - map * start * map.transpose()).abs().max() < 1e-13, "{}", p.covariance());
    assert!(p.weights()[1].abs() < f64::MIN_POSITIVE);
    let indefinite = Matrix2::new(1.0, 2.0, 2.0, 1.0);
    assert_eq!(UdCovariance::from_covariance(&indefinite).map_err(|error| error.state), Err(0));
}
