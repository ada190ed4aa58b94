//! The core of the filters alone: a prediction and a measurement of two states.
//!
//! Other crates' filters do the same (`firmware-checks/src/instructions/peers.rs`). A camera frame takes more
//! instructions, because the filter also handles what they leave to their user: times, the order of frames, the gate,
//! rest, a stuck camera, the record.

use core::hint::black_box;

use estimator::{AngleRateCovariance, TrackCovariance as _};
use nalgebra::{Matrix2, Vector2};
use ud_filter::{NoiseSource, Transition, UdCovariance, UpperTriangular};

use super::{Count, InstructionCounter, InstructionTimer};

/// States angle and rate; the rate is a random walk, and the angle is measured. All numbers are near 1, so that no
/// filter refuses them.
#[derive(Clone, Copy)]
pub(super) struct Problem {
    pub(super) dt: f32,
    /// Intensity of the noise that drives the rate.
    pub(super) intensity: f32,
    pub(super) measured_variance: f32,
    pub(super) start_variance: f32,
}

impl Problem {
    pub(super) fn constant_rate() -> Self {
        black_box(Self { dt: 0.1, intensity: 1.0, measured_variance: 1.0, start_variance: 10.0 })
    }

    /// `F`.
    pub(super) fn transition(&self) -> Matrix2<f32> {
        Matrix2::new(1.0, self.dt, 0.0, 1.0)
    }

    /// `Q`, the sum of [`Self::sources`].
    #[cfg(feature = "peers")]
    pub(super) fn noise(&self) -> Matrix2<f32> {
        let gained = |source: NoiseSource<f32, 2>| source.gain * source.gain.transpose() * source.variance;
        self.sources().map(gained).into_iter().sum()
    }

    /// `q dt^3 / 12` along (1, 0) and `q dt` along (dt / 2, 1) add up to `Q`.
    pub(super) fn sources(&self) -> [NoiseSource<f32, 2>; 2] {
        let Self { dt, intensity, .. } = *self;
        [
            NoiseSource { gain: Vector2::new(1.0, 0.0), variance: intensity * dt * dt * dt / 12.0 },
            NoiseSource { gain: Vector2::new(dt / 2.0, 1.0), variance: intensity * dt },
        ]
    }
}

/// Steps that are counted, and steps before them, in which the filter converges.
const STEPS: u16 = 1000;
const SETTLING_STEPS: u16 = 100;

/// Counts `step`: a prediction, and a measurement of its argument.
pub(super) fn counted(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    operation: &'static str,
    mut step: impl FnMut(f32),
) -> Count {
    let mut count = Count::new(operation);
    for n in 0..SETTLING_STEPS + STEPS {
        let measured = black_box(f32::from(n % 16) - 7.5);
        let ((), instructions) = counter.count(|| step(measured));
        if n >= SETTLING_STEPS {
            count.add(instructions);
        }
    }
    count
}

/// The covariance of the filters of angle and rate, written out for two states.
struct TwoStates {
    dt: f32,
    intensity: f32,
    measured_variance: f32,
    angle: f32,
    rate: f32,
    covariance: AngleRateCovariance<f32>,
}

#[inline(never)]
fn step_two_states(filter: &mut TwoStates, measured: f32) {
    filter.angle += filter.dt * filter.rate;
    filter.covariance.predict(filter.dt, filter.intensity);
    let innovation = measured - filter.angle;
    let [angle, rate] = filter.covariance.update_angle(filter.measured_variance);
    filter.angle += angle * innovation;
    filter.rate += rate * innovation;
}

/// The core for any number of states, with two.
struct AnyStates {
    transition: UpperTriangular<f32, 2>,
    sources: [NoiseSource<f32, 2>; 2],
    measured_variance: f32,
    state: Vector2<f32>,
    covariance: UdCovariance<f32, 2>,
}

#[inline(never)]
fn step_any_states(filter: &mut AnyStates, measured: f32) {
    filter.state = filter.transition.carry(&filter.state);
    // Neither is refused: the numbers are finite.
    let _ = filter.covariance.predict(&filter.transition, &filter.sources);
    let innovation = measured - filter.state.x;
    let _ = filter.covariance.update_state::<0>(filter.measured_variance, innovation, &mut filter.state);
}

impl TwoStates {
    fn new(problem: &Problem) -> Self {
        let Problem { dt, intensity, measured_variance, start_variance } = *problem;
        let covariance = AngleRateCovariance::diagonal(start_variance, start_variance);
        black_box(Self { dt, intensity, measured_variance, angle: 0.0, rate: 0.0, covariance })
    }
}

/// Steps of the core of two states.
pub(super) fn run_hot_operations() {
    let mut two_states = TwoStates::new(&Problem::constant_rate());
    for n in 0..100_u8 {
        step_two_states(&mut two_states, black_box(f32::from(n % 16) - 7.5));
    }
    black_box((two_states.angle, two_states.rate));
}

#[inline(never)]
pub(super) fn count(counter: &InstructionCounter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let problem = Problem::constant_rate();
    let Problem { measured_variance, start_variance, .. } = problem;
    let mut two_states = TwoStates::new(&problem);
    report(counted(counter, "core_2_predict_and_update", |measured| {
        step_two_states(&mut two_states, measured);
    }));
    black_box((two_states.angle, two_states.rate));
    let mut any_states = black_box(AnyStates {
        transition: UpperTriangular(problem.transition()),
        sources: problem.sources(),
        measured_variance,
        state: Vector2::zeros(),
        covariance: UdCovariance::from_diagonal(&Vector2::repeat(start_variance)),
    });
    report(counted(counter, "general_core_2_predict_and_update", |measured| {
        step_any_states(&mut any_states, measured);
    }));
    black_box(any_states.state);
}
