//! A million steps of lightly damped modes under a nearly perfect sensor.
//!
//! A steady filter forgets in some `sqrt(R / Q)` = 300 steps: a million are 3,000 times that, so that an error of the
//! covariance that grows would have grown.
//!
//! The yardstick's covariance is the textbook's in 200 bits ([`PreciseFilter`]) until its gain stands still: from then
//! on, by the model's constancy, it is that gain for good. Its state recursion runs in `f64` throughout, whose rounding
//! is some 1e-8 of the figures judged here.
#![expect(
    clippy::disallowed_methods,
    clippy::cast_precision_loss,
    reason = "a yardstick's own model, and counts as numbers"
)]

use benches::matrix_covariance::{Conventional, CovarianceForm, Joseph};
use motor_model::Real;
use nalgebra::{Matrix2, SMatrix, SVector};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use ud_filter::{Blocks2, NoiseSource, Transition, UdCovariance};

use crate::support::precise_filter::PreciseFilter;

/// Variance of a measurement.
const R: f64 = 1e-14;
/// Process noise of each mode's velocity over a step, in the same unit.
const Q: f64 = 1e-5 * R;

/// Runs of which the rounding is averaged.
const SEEDS: u64 = 16;

/// B modes in whitened units, `(g, v / w)`, seen in M combinations of their displacements.
struct Modes<T, const N: usize, const B: usize, const M: usize> {
    transition: Blocks2<T, B>,
    noise: [NoiseSource<T, N>; B],
    rows: [SVector<T, N>; M],
    start_variance: T,
}

impl<T: Real, const N: usize, const B: usize, const M: usize> Modes<T, N, B, M> {
    /// Phase advances by 0.1 to 0.5 rad a step, damping ratio 0.001.
    fn new(start_over_r: f64) -> Self {
        let block = |b: usize| {
            let (angle, zeta): (f64, f64) = (0.1 * (1.0 + b as f64), 1e-3);
            let damped = angle * (1.0 - zeta * zeta).sqrt();
            let (sin, cos) = damped.sin_cos();
            let (decay, ratio) = ((-zeta * angle).exp(), angle / damped);
            let free =
                Matrix2::new(cos + zeta * ratio * sin, ratio * sin, -ratio * sin, cos - zeta * ratio * sin);
            (free * decay).map(T::from_f64)
        };
        let velocity = |b: usize| SVector::from_fn(|i, _| if i == 2 * b + 1 { T::one() } else { T::zero() });
        let displacements = |m: usize| {
            SVector::from_fn(|i, _| T::from_f64(if i % 2 == 0 { 1.0 - 0.3 * (i * m) as f64 } else { 0.0 }))
        };
        Self {
            transition: Blocks2(std::array::from_fn(block)),
            noise: std::array::from_fn(|b| NoiseSource { gain: velocity(b), variance: T::from_f64(Q) }),
            rows: std::array::from_fn(displacements),
            start_variance: T::from_f64(start_over_r * R),
        }
    }
}

/// Gains of each measurement and standard errors after it, up to where they stand still.
struct Reference<const N: usize, const M: usize> {
    steps: Vec<([SVector<f64, N>; M], SVector<f64, N>)>,
}

impl<const N: usize, const M: usize> Reference<N, M> {
    fn new<T: Real, const B: usize>(modes: &Modes<T, N, B, M>) -> Self {
        let start = SMatrix::from_diagonal(&SVector::repeat(modes.start_variance.to_f64()));
        let mut filter = PreciseFilter::<N>::new(&start);
        let f = modes.transition.matrix::<N>();
        let mut steps: Vec<([SVector<f64, N>; M], SVector<f64, N>)> = Vec::new();
        loop {
            filter.predict(&f, &modes.noise);
            let gains = modes.rows.map(|row| filter.update(&row, T::from_f64(R), T::zero()).0);
            let moved = steps.last().map_or(f64::INFINITY, |(before, _)| {
                gains.iter().zip(before).map(|(new, old)| (new - old).norm() / old.norm()).fold(0.0, f64::max)
            });
            steps.push((gains, filter.sigma()));
            // Convergence is geometric with a ratio of about 1 - sqrt(Q / R): what is still to come is some 300 times
            // the last move.
            if moved < 1e-14 {
                return Self { steps };
            }
            assert!(steps.len() < 100_000, "no steady state");
        }
    }

    fn at(&self, step: usize) -> &([SVector<f64, N>; M], SVector<f64, N>) {
        &self.steps[step.min(self.steps.len() - 1)]
    }
}

/// What came of a run.
#[derive(Debug, Default)]
struct Endurance {
    refused: u64,
    /// First step whose covariance was no longer positive definite.
    indefinite_at: Option<usize>,
    /// Largest distance from the reference's state, in its standard errors; infinite once NaN.
    worst_sigma: f64,
    /// The same of a state of this precision under the reference's gains: what the covariance has no part in.
    worst_sigma_exact_gain: f64,
    /// Mean squares of these distances, over states and steps.
    squared_sigma: f64,
    squared_sigma_exact_gain: f64,
}

/// Runs the form `C` beside the reference; `definite` says whether a covariance is.
fn endure<T: Real, C: CovarianceForm<T, N>, const N: usize, const B: usize, const M: usize>(
    modes: &Modes<T, N, B, M>,
    reference: &Reference<N, M>,
    (steps, start, seed): (usize, f64, u64),
    definite: impl Fn(&C) -> bool,
) -> Endurance {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let f = Blocks2(modes.transition.0.map(|block| block.map(Real::to_f64)));
    let rows = modes.rows.map(|row| row.map(Real::to_f64));
    let mut truth = SVector::<f64, N>::from_fn(|_, _| start * normal());
    let (mut expected, mut state) = (SVector::<f64, N>::zeros(), SVector::<T, N>::zeros());
    let mut floor = state;
    let mut form = C::from_diagonal(&SVector::repeat(modes.start_variance));
    let mut outcome = Endurance::default();
    for step in 0..steps {
        truth = f.carry(&truth);
        (0..B).for_each(|b| truth[2 * b + 1] += Q.sqrt() * normal());
        expected = f.carry(&expected);
        state = modes.transition.carry(&state);
        floor = modes.transition.carry(&floor);
        form.predict(&modes.transition, &modes.noise);
        let (gains, sigma) = reference.at(step);
        for ((row, exact_row), gain) in modes.rows.iter().zip(&rows).zip(gains) {
            let measured = T::from_f64(exact_row.dot(&truth) + R.sqrt() * normal());
            expected += gain * (measured.to_f64() - exact_row.dot(&expected));
            floor += gain.map(T::from_f64) * (measured - row.dot(&floor));
            let innovation = measured - row.dot(&state);
            outcome.refused += u64::from(!form.take_in(row, T::from_f64(R), innovation, &mut state));
        }
        outcome.worst_sigma = outcome.worst_sigma.max(distance(&state, &expected, sigma));
        outcome.worst_sigma_exact_gain =
            outcome.worst_sigma_exact_gain.max(distance(&floor, &expected, sigma));
        outcome.squared_sigma += squared_distance(&state, &expected, sigma) / steps as f64;
        outcome.squared_sigma_exact_gain += squared_distance(&floor, &expected, sigma) / steps as f64;
        if outcome.indefinite_at.is_none() && !definite(&form) {
            outcome.indefinite_at = Some(step);
        }
    }
    outcome
}

/// Largest difference of two states in standard errors; infinite when NaN.
fn distance<T: Real, const N: usize>(
    state: &SVector<T, N>,
    expected: &SVector<f64, N>,
    sigma: &SVector<f64, N>,
) -> f64 {
    let errors = (state.map(Real::to_f64) - expected).component_div(sigma);
    errors
        .iter()
        .fold(0.0, |worst: f64, error| if error.is_nan() { f64::INFINITY } else { worst.max(error.abs()) })
}

/// Mean square of the difference of two states in standard errors.
fn squared_distance<T: Real, const N: usize>(
    state: &SVector<T, N>,
    expected: &SVector<f64, N>,
    sigma: &SVector<f64, N>,
) -> f64 {
    (state.map(Real::to_f64) - expected).component_div(sigma).norm_squared() / N as f64
}

/// A matrix of `f32` is exact in `f64`, whose factorisation then tells.
fn matrix_is_definite<T: Real, C: CovarianceForm<T, N>, const N: usize>(form: &C) -> bool {
    let factors = UdCovariance::from_covariance(&form.covariance().map(Real::to_f64));
    factors.is_ok_and(|factors| factors.weights.iter().all(|&weight| weight > 0.0))
}

fn factors_are_positive<T: Real, const N: usize>(factors: &UdCovariance<T, N>) -> bool {
    factors.weights().iter().all(|&weight| weight > T::zero())
}

/// Root mean squares of the state's distance from the reference, and of that under exact gains, over the first steps of
/// runs with other random numbers.
fn root_mean_squares<T: Real, const N: usize, const B: usize, const M: usize>(
    modes: &Modes<T, N, B, M>,
    reference: &Reference<N, M>,
    amplitude: f64,
) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for seed in 100..100 + SEEDS {
        let run = endure(modes, reference, (20_000, amplitude, seed), factors_are_positive::<T, N>);
        assert_eq!((run.refused, run.indefinite_at), (0, None), "seed {seed}");
        for (sum, square) in squares.iter_mut().zip([run.squared_sigma, run.squared_sigma_exact_gain]) {
            *sum += square / SEEDS as f64;
        }
    }
    squares.map(f64::sqrt)
}

/// A million steps of `T` from near rest, then a hundred thousand from an amplitude as large as the start variance
/// allows, of every form.
///
/// Returned are the conventional and Joseph's form in the second run. There the state itself is too large for `f32` to
/// hold to a hundredth of a standard error, so the factors are judged by what they add; and since the worst moment of
/// one run is luck, by its root mean square over other runs ([`root_mean_squares`]), too.
fn assert_endures<T: Real, const N: usize, const B: usize, const M: usize>(
    start_over_r: f64,
    bound_sigma: f64,
) -> [Endurance; 2] {
    let modes = Modes::<T, N, B, M>::new(start_over_r);
    let reference = Reference::new(&modes);
    let seed = N as u64;
    let long = endure(&modes, &reference, (1_000_000, R.sqrt(), seed), factors_are_positive::<T, N>);
    let amplitude = (start_over_r * R).sqrt();
    let wide = (100_000, amplitude, seed);
    let factors = endure(&modes, &reference, wide, factors_are_positive::<T, N>);
    let conventional = endure(&modes, &reference, wide, matrix_is_definite::<T, Conventional<T, N>, N>);
    let joseph = endure(&modes, &reference, wide, matrix_is_definite::<T, Joseph<T, N>, N>);
    println!(
        "n = {N}, m = {M}, {}, steady after {} steps",
        std::any::type_name::<T>(),
        reference.steps.len()
    );
    println!("  factors, 1e6 steps {long:?}\n  factors {factors:?}");
    println!("  conventional {conventional:?}\n  Joseph {joseph:?}");
    let [rms, rms_exact_gain] = root_mean_squares(&modes, &reference, amplitude);
    println!("  factors, {SEEDS} runs: rms {rms:e}, exact gain {rms_exact_gain:e}");
    for run in [&long, &factors] {
        assert_eq!((run.refused, run.indefinite_at), (0, None));
    }
    assert!(long.worst_sigma < bound_sigma, "{long:?}");
    assert!(factors.worst_sigma < factors.worst_sigma_exact_gain + bound_sigma, "{factors:?}");
    // The worst of a hundred thousand normal numbers is near five times their root mean square.
    assert!(rms < rms_exact_gain + bound_sigma / 5.0, "{rms:e} {rms_exact_gain:e}");
    [conventional, joseph]
}

#[test]
fn law_factors_endure_in_f32() {
    let [conventional, _] = assert_endures::<f32, 2, 1, 1>(1e8, 2e-2);
    assert!(conventional.indefinite_at.is_some(), "{conventional:?}");
    let [conventional, joseph] = assert_endures::<f32, 6, 3, 2>(1e6, 2e-2);
    assert!(
        conventional.indefinite_at.is_some() && joseph.indefinite_at.is_some(),
        "{conventional:?} {joseph:?}"
    );
    let [conventional, joseph] = assert_endures::<f32, 10, 5, 1>(1e6, 2e-2);
    assert!(conventional.refused > 0 && joseph.refused > 0, "{conventional:?} {joseph:?}");
}

#[test]
fn law_factors_endure_in_f64() {
    assert_endures::<f64, 2, 1, 1>(1e8, 1e-7);
    assert_endures::<f64, 6, 3, 2>(1e6, 1e-7);
    assert_endures::<f64, 10, 5, 1>(1e6, 1e-7);
}
