//! Time of a step of a Kalman filter, a prediction and its measurements: this project's filters, with and without the
//! structure of the model, and other crates' filters, on the same numbers.
//!
//! Before it is timed, each filter must reach the state of a reference, to rounding. Model and measurements are opaque
//! to the compiler. A step depends on the one before, as in use, so its latency is measured.
//!
//! "Noise-driven states first" is the same problem with the two states of each mode exchanged, in the order that
//! [`ud_filter::NoiseSource`] advises. The measurements are the same bytes, and the state is compared in the common
//! order.

mod ours;
mod peers;
mod problem;

use std::hint::black_box;

use benches::matrix_covariance::{Conventional, Joseph};
use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use motor_model::Real;
use ud_filter::{Blocks2, Dense, UdCovariance, UpperTriangular};

use ours::{AngleAndRate, MeasuredState, NoiseDrivenFirst, Ours};
use problem::{Filter, Problem, measurements};

/// Steps of a batch.
const STEPS: u32 = 200;

/// Steps after which the states are compared.
const COMPARED: u32 = 2000;

/// Times a filter, after a check that its state equals the reference: Joseph's form in `f64` on the same bytes.
fn time<F: Filter<T, N, M>, T: Real, const N: usize, const M: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    problem: &Problem<T, N, M>,
    name: &str,
) {
    let problem = black_box(problem);
    let measured = measurements::<T, M>(COMPARED);
    let mut filter = F::new(problem);
    for z in &measured {
        filter.step(z);
    }
    let expected = problem.reference(&measured);
    let error = filter.state().iter().zip(&expected).map(|(x, y)| (x.to_f64() - y).abs()).fold(0.0, f64::max);
    let scale = expected.iter().fold(0.0, |scale: f64, x| scale.max(x.abs()));
    let rounding = if size_of::<T>() == 4 { 2e-4 } else { 1e-9 };
    assert!(error <= rounding * scale, "{name}: off by {error:e} of {scale:e}");

    let batch = &measured[..STEPS as usize];
    group.bench_function(name, |bencher| {
        bencher.iter_batched(
            || F::new(problem),
            |mut filter| {
                for z in black_box(batch) {
                    filter.step(z);
                }
                filter
            },
            BatchSize::SmallInput,
        );
    });
}

macro_rules! peers_of {
    ($group:expr, $problem:expr, $t:ty, $n:literal, $s:literal, $m:literal) => {
        time::<peers::Adskalman<$t, $n, $m, true>, $t, $n, $m>($group, $problem, "adskalman, Joseph");
        time::<peers::Adskalman<$t, $n, $m, false>, $t, $n, $m>($group, $problem, "adskalman, conventional");
        time::<peers::Minikalman<$t, $n, $m>, $t, $n, $m>($group, $problem, "minikalman, conventional");
        time::<peers::Kfilter<$t, $n, $m>, $t, $n, $m>($group, $problem, "kfilter, conventional");
        time::<peers::Kalmanfilt<$t, $n, $m>, $t, $n, $m>($group, $problem, "kalmanfilt, Joseph");
        time::<peers::KalmanFilters<$t, $n, $m>, $t, $n, $m>(
            $group,
            $problem,
            "kalman_filters, conventional",
        );
        time::<peers::BayesMatrix<$t, $n, $m>, $t, $n, $m>($group, $problem, "bayes_estimate, conventional");
        time::<peers::BayesFactors<$t, $n, $s, $m>, $t, $n, $m>($group, $problem, "bayes_estimate, UD");
    };
}

macro_rules! modal {
    ($criterion:expr, $t:ty, $n:literal, $b:literal, $m:literal) => {{
        type Structured<C> = Ours<$t, C, Blocks2<$t, $b>, $n, $b, $m>;
        let mut group = $criterion.benchmark_group(format!("n = {}, m = {}, {}", $n, $m, stringify!($t)));
        group.throughput(Throughput::Elements(u64::from(STEPS)));
        let problem = Problem::<$t, $n, $m>::modal();
        time::<Structured<UdCovariance<$t, $n>>, _, $n, $m>(&mut group, &problem, "ours, UD, 2 x 2 blocks");
        time::<NoiseDrivenFirst<Structured<UdCovariance<$t, $n>>>, _, $n, $m>(
            &mut group,
            &problem,
            "ours, UD, 2 x 2 blocks, noise-driven states first",
        );
        time::<Ours<$t, UdCovariance<$t, $n>, Dense<$t, $n>, $n, $b, $m>, _, $n, $m>(
            &mut group,
            &problem,
            "ours, UD, dense",
        );
        time::<Structured<Joseph<$t, $n>>, _, $n, $m>(&mut group, &problem, "ours for comparison, Joseph");
        time::<Structured<Conventional<$t, $n>>, _, $n, $m>(
            &mut group,
            &problem,
            "ours for comparison, conventional",
        );
        peers_of!(&mut group, &problem, $t, $n, $b, $m);
        group.finish();
    }};
}

macro_rules! constant_rate {
    ($criterion:expr, $t:ty) => {{
        type Structured<C> = Ours<$t, C, UpperTriangular<$t, 2>, 2, 2, 1>;
        let mut group = $criterion.benchmark_group(format!("n = 2, m = 1, {}", stringify!($t)));
        group.throughput(Throughput::Elements(u64::from(STEPS)));
        let problem = Problem::<$t, 2, 1>::constant_rate();
        time::<AngleAndRate<$t>, _, 2, 1>(&mut group, &problem, "ours, UD, angle and rate");
        time::<MeasuredState<$t>, _, 2, 1>(&mut group, &problem, "ours, UD, triangular, state measured");
        time::<Structured<UdCovariance<$t, 2>>, _, 2, 1>(&mut group, &problem, "ours, UD, triangular");
        time::<Ours<$t, UdCovariance<$t, 2>, Dense<$t, 2>, 2, 2, 1>, _, 2, 1>(
            &mut group,
            &problem,
            "ours, UD, dense",
        );
        time::<Structured<Joseph<$t, 2>>, _, 2, 1>(&mut group, &problem, "ours for comparison, Joseph");
        time::<Structured<Conventional<$t, 2>>, _, 2, 1>(
            &mut group,
            &problem,
            "ours for comparison, conventional",
        );
        peers_of!(&mut group, &problem, $t, 2, 2, 1);
        group.finish();
    }};
}

fn kalman(criterion: &mut Criterion) {
    constant_rate!(criterion, f64);
    constant_rate!(criterion, f32);
    modal!(criterion, f64, 6, 3, 2);
    modal!(criterion, f32, 6, 3, 2);
    modal!(criterion, f64, 10, 5, 1);
    modal!(criterion, f32, 10, 5, 1);
}

criterion_group!(benches, kalman);
criterion_main!(benches);
