//! Speed against error, in one table: `cargo bench -p benches --bench kalman_table`. `host-sim results filter-core`
//! puts it, and the figures below it, into `docs/results/filter-core.md`.
//!
//! Speed is measured in `f64` on the problems of the benchmark `kalman`. All filters take turns, and of many turns the
//! quickest of each counts, so that the other work of the machine falls on none of them alone.
//!
//! Error is measured in `f32`, where it shows, on problems that are ill-conditioned: the largest distance from the
//! state of the factors in `f64`, in standard deviations. The tests hold these factors to the textbook's filter in 200
//! bits. A filter has broken down from the step at which it is a standard deviation off, refuses a plain measurement
//! or panics.

mod counted;
#[allow(dead_code, reason = "some forms are timed by the benchmark `kalman` alone")]
mod ours;
mod peers;
#[allow(dead_code, reason = "some parts serve the benchmark `kalman` alone")]
mod problem;

use std::hint::black_box;
use std::panic::{self, AssertUnwindSafe};
use std::time::Instant;

use motor_model::{Real, math};
use nalgebra::{SMatrix, SVector};
use ud_filter::{Blocks2, Dense, KalmanFilter, UdCovariance, UpperTriangular};

use ours::{MeasuredState, NoiseDrivenFirst, Ours};
use problem::{Filter, Problem, measurements};

/// Steps of a turn, and turns.
const STEPS: u32 = 200;
const TURNS: usize = 1500;

/// What the table says of a filter that breaks down, before the step at which it does.
const BREAKS: &str = "breaks at";

/// One filter on one problem, taking its turns.
type Turn = Box<dyn FnMut() -> f64>;

/// Time of a step in ns, over one turn.
fn turn<F: Filter<T, N, M>, T: Real, const N: usize, const M: usize>(problem: &Problem<T, N, M>) -> Turn {
    let (problem, measured) = (*problem, measurements::<T, M>(STEPS));
    Box::new(move || {
        let mut filter = F::new(black_box(&problem));
        let start = Instant::now();
        for z in black_box(&measured) {
            filter.step(z);
        }
        let passed = start.elapsed();
        black_box(filter.state());
        passed.as_secs_f64() * 1e9 / f64::from(STEPS)
    })
}

/// The quickest turn of each.
fn times(mut filters: Vec<Turn>) -> Vec<f64> {
    let mut quickest = vec![f64::INFINITY; filters.len()];
    for _ in 0..TURNS {
        for (best, filter) in quickest.iter_mut().zip(&mut filters) {
            *best = best.min(filter());
        }
    }
    quickest
}

/// A problem with the states and standard deviations that a filter should reach, step by step.
struct Judge<const N: usize, const M: usize> {
    problem: Problem<f32, N, M>,
    measured: Vec<[f32; M]>,
    expected: Vec<(SVector<f64, N>, SVector<f64, N>)>,
}

impl<const N: usize, const M: usize> Judge<N, M> {
    /// The motion from `start`, without process noise, measured with deviations of up to 1.
    fn new(problem: Problem<f32, N, M>, start: f64, steps: u32) -> Self {
        let wide = |x: f32| f64::from(x);
        let transition = Dense(problem.transition.map(wide));
        let noise = problem.sources::<N>().map(|source| ud_filter::NoiseSource {
            gain: source.gain.map(wide),
            variance: wide(source.variance),
        });
        let rows: [SVector<f64, N>; M] = std::array::from_fn(|m| problem.rows.row(m).transpose().map(wide));
        let mut truth = SVector::<f64, N>::repeat(start);
        let prior = UdCovariance::from_diagonal(&SVector::repeat(wide(problem.start_variance)));
        let mut filter = KalmanFilter::new(SVector::zeros(), prior);
        let (mut measured, mut expected) = (Vec::new(), Vec::new());
        for deviation in measurements::<f64, M>(steps) {
            truth = transition.0 * truth;
            let z: [f32; M] = std::array::from_fn(|m| f32::from_f64(rows[m].dot(&truth) + deviation[m]));
            filter.predict(&transition, &noise).expect("a plain model");
            for (row, &z) in rows.iter().zip(&z) {
                filter.update(row, 1.0, wide(z)).expect("a plain measurement");
            }
            measured.push(z);
            expected.push((filter.state, filter.covariance.variances().map(math::sqrt)));
        }
        Self { problem, measured, expected }
    }

    /// The largest distance of F in standard deviations, or the step at which it breaks down.
    fn error<F: Filter<f32, N, M>>(&self) -> String {
        let (mut worst, mut step) = (0.0_f64, 0);
        let run = panic::catch_unwind(AssertUnwindSafe(|| {
            let mut filter = F::new(&self.problem);
            for (z, (state, sigma)) in self.measured.iter().zip(&self.expected) {
                step += 1;
                filter.step(z);
                let found = SVector::from(filter.state()).map(f64::from);
                let sigmas = (found - state).component_div(sigma);
                // Not `f64::max`, which leaves NaN out.
                worst = sigmas.iter().fold(worst, |worst, x| if x.abs() <= worst { worst } else { x.abs() });
                if !holds(worst) {
                    return;
                }
            }
        }));
        if run.is_ok() && holds(worst) { format!("{worst:.0e}") } else { format!("{BREAKS} {step}") }
    }
}

/// Whether a distance, in standard deviations, is one of a filter that works. NaN is none.
fn holds(sigmas: f64) -> bool {
    sigmas < 1.0
}

/// Two states measured by two sensors that differ in the last bits: Bierman's example.
fn two_alike() -> Judge<2, 2> {
    let e = 1.0 / 8192.0;
    let problem = Problem {
        transition: SMatrix::identity(),
        noise_gain: SMatrix::identity(),
        noise_variance: SVector::zeros(),
        rows: SMatrix::<f32, 2, 2>::new(1.0, e, 1.0, 1.0),
        start_variance: 1.0 / (e * e),
    };
    Judge::new(problem, 1000.0, 1000)
}

/// Three states, of which two sensors see almost the same: of Verhaegen and Van Dooren's kind.
fn three_alike() -> Judge<3, 2> {
    let d = 1e-4;
    let problem = Problem {
        transition: SMatrix::identity(),
        noise_gain: SMatrix::identity(),
        noise_variance: SVector::zeros(),
        rows: SMatrix::<f32, 2, 3>::new(1.0, 1.0, 1.0, 1.0, 1.0, 1.0 + d),
        start_variance: 1.0 / (d * d),
    };
    Judge::new(problem, 1000.0, 1000)
}

/// Lightly damped modes under sensors whose variance is a millionth of the prior's.
fn precise_sensors<const N: usize, const M: usize>() -> Judge<N, M> {
    let mut problem = Problem::<f32, N, M>::modal();
    problem.noise_variance *= 0.01;
    problem.start_variance = 1e6;
    Judge::new(problem, 1000.0, 20_000)
}

/// All filters on a problem of N states, in the order of [`NAMES`].
macro_rules! turns {
    ($structured:ty, $n:literal, $s:literal, $m:literal, $problem:expr) => {{
        let p = &$problem;
        times(vec![
            turn::<$structured, f64, $n, $m>(p),
            turn::<Ours<f64, UdCovariance<f64, $n>, Dense<f64, $n>, $n, $s, $m>, f64, $n, $m>(p),
            turn::<peers::Adskalman<f64, $n, $m, true>, f64, $n, $m>(p),
            turn::<peers::Adskalman<f64, $n, $m, false>, f64, $n, $m>(p),
            turn::<peers::Minikalman<f64, $n, $m>, f64, $n, $m>(p),
            turn::<peers::Kfilter<f64, $n, $m>, f64, $n, $m>(p),
            turn::<peers::Kalmanfilt<f64, $n, $m>, f64, $n, $m>(p),
            turn::<peers::KalmanFilters<f64, $n, $m>, f64, $n, $m>(p),
            turn::<peers::BayesMatrix<f64, $n, $m>, f64, $n, $m>(p),
            turn::<peers::BayesFactors<f64, $n, $s, $m>, f64, $n, $m>(p),
        ])
    }};
}

/// The errors of all filters on a problem, in the order of [`NAMES`].
macro_rules! errors {
    ($structured:ty, $n:literal, $s:literal, $m:literal, $judge:expr) => {{
        let judge = $judge;
        [
            judge.error::<$structured>(),
            judge.error::<Ours<f32, UdCovariance<f32, $n>, Dense<f32, $n>, $n, $s, $m>>(),
            judge.error::<peers::Adskalman<f32, $n, $m, true>>(),
            judge.error::<peers::Adskalman<f32, $n, $m, false>>(),
            judge.error::<peers::Minikalman<f32, $n, $m>>(),
            judge.error::<peers::Kfilter<f32, $n, $m>>(),
            judge.error::<peers::Kalmanfilt<f32, $n, $m>>(),
            judge.error::<peers::KalmanFilters<f32, $n, $m>>(),
            judge.error::<peers::BayesMatrix<f32, $n, $m>>(),
            judge.error::<peers::BayesFactors<f32, $n, $s, $m>>(),
        ]
    }};
}

/// So many of [`NAMES`] are ours; the peers follow.
const OURS: usize = 2;
const NAMES: [&str; 10] = [
    "ud-filter, UD, structured",
    "ud-filter, UD, dense",
    "adskalman, Joseph",
    "adskalman, conventional",
    "minikalman, conventional",
    "kfilter, conventional",
    "kalmanfilt, Joseph",
    "kalman_filters, conventional",
    "bayes_estimate, conventional",
    "bayes_estimate, UD",
];

/// States as structure saves work on them.
type Triangular<T, const N: usize, const S: usize, const M: usize> =
    Ours<T, UdCovariance<T, N>, UpperTriangular<T, N>, N, S, M>;
type Modes<T, const N: usize, const B: usize, const M: usize> =
    NoiseDrivenFirst<Ours<T, UdCovariance<T, N>, Blocks2<T, B>, N, B, M>>;

fn main() {
    // What breaks down by a panic is told in the table.
    panic::set_hook(Box::new(|_| ()));
    let errors = [
        errors!(Triangular<f32, 2, 2, 2>, 2, 2, 2, two_alike()),
        errors!(Triangular<f32, 3, 3, 2>, 3, 3, 2, three_alike()),
        errors!(Modes<f32, 6, 3, 2>, 6, 3, 2, precise_sensors::<6, 2>()),
        errors!(Modes<f32, 10, 5, 1>, 10, 5, 1, precise_sensors::<10, 1>()),
    ];
    let times = [
        turns!(MeasuredState<f64>, 2, 2, 1, Problem::<f64, 2, 1>::constant_rate()),
        turns!(Modes<f64, 6, 3, 2>, 6, 3, 2, Problem::<f64, 6, 2>::modal()),
        turns!(Modes<f64, 10, 5, 1>, 10, 5, 1, Problem::<f64, 10, 1>::modal()),
    ];
    println!(
        "| filter | ns, n = 2 | ns, n = 6 | ns, n = 10 | two alike | three alike | six modes | ten modes |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (index, name) in NAMES.iter().enumerate() {
        let time = |of: usize| format!("~{:.0}", times[of][index]);
        let error = |of: usize| &errors[of][index];
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} | {} |",
            time(0),
            time(1),
            time(2),
            error(0),
            error(1),
            error(2),
            error(3)
        );
    }
    let over_quickest_peer = |ours: usize| {
        let [a, b, c] = times.each_ref().map(|times| {
            let quickest = times[OURS..].iter().copied().fold(f64::INFINITY, f64::min);
            times[ours] / quickest
        });
        format!("~{a:.2}, ~{b:.2} and ~{c:.2}")
    };
    let broken = (OURS..NAMES.len()).filter(|&peer| errors.iter().any(|of| of[peer].starts_with(BREAKS)));
    println!("\nstructured: {}\ndense: {}", over_quickest_peer(0), over_quickest_peer(1));
    println!("broken: {} of {}", broken.count(), NAMES.len() - OURS);
    let needs = [counted::of_two_states(), counted::of_modes::<6, 3, 2>(), counted::of_modes::<10, 5, 1>()];
    let of_each = |needed: fn(&counted::Needs) -> u64| {
        let [a, b, c] = needs.each_ref().map(needed);
        format!("{a}, {b} and {c}")
    };
    println!("products: {}", of_each(|needs| needs.products));
    println!("divisions: {}", of_each(|needs| needs.divisions));
    println!("chain: {}", of_each(|needs| needs.chain_cycles));
}
