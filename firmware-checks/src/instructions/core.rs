//! The bare core of the filters: a prediction and a measurement of two states, and nothing else.
//!
//! This is what other crates' filters do (`firmware-checks/src/instructions/peers.rs`); what a camera frame takes more is spent on what they leave to
//! their user: times, the order of frames, gate, rest, a stuck camera, the record.

use core::hint::black_box;

use estimator::{AngleRateCovariance, NoiseSource, Transition, UdCovariance, UpperTriangular};
use nalgebra::{Matrix2, Vector2};

use super::{Count, InstructionTimer, Meter};

/// Angle and rate, the rate a random walk, the angle measured: numbers near 1, so that none of the filters refuses them.
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

/// Steps that are counted, of a filter that has settled.
const STEPS: u16 = 1000;
const SETTLING_STEPS: u16 = 100;

/// Counts `step`, a prediction and a measurement of the value that it is given.
pub(super) fn counted(
    meter: &Meter<'_, impl InstructionTimer>,
    operation: &'static str,
    mut step: impl FnMut(f32),
) -> Count {
    let mut count = Count::of(operation);
    for n in 0..SETTLING_STEPS + STEPS {
        let measured = black_box(f32::from(n % 16) - 7.5);
        let ((), instructions) = meter.instructions(|| step(measured));
        if n >= SETTLING_STEPS {
            count.add(instructions);
        }
    }
    count
}

/// The two states that the filters of angle and rate have.
struct Written {
    dt: f32,
    intensity: f32,
    measured_variance: f32,
    angle: f32,
    rate: f32,
    covariance: AngleRateCovariance<f32>,
}

#[inline(never)]
fn step_written(filter: &mut Written, measured: f32) {
    filter.angle += filter.dt * filter.rate;
    filter.covariance.predict(filter.dt, filter.intensity);
    let innovation = measured - filter.angle;
    let gain = filter.covariance.update_angle(filter.measured_variance);
    filter.angle += gain.angle * innovation;
    filter.rate += gain.rate * innovation;
}

/// The core for any number of states, at two.
struct General {
    transition: UpperTriangular<f32, 2>,
    sources: [NoiseSource<f32, 2>; 2],
    measured_variance: f32,
    state: Vector2<f32>,
    covariance: UdCovariance<f32, 2>,
}

#[inline(never)]
fn step_general(filter: &mut General, measured: f32) {
    filter.state = filter.transition.carry(&filter.state);
    filter.covariance.predict(&filter.transition, &filter.sources);
    let innovation = measured - filter.state.x;
    // Never refused: the measurements are plain.
    let _ = filter.covariance.update_state::<0>(filter.measured_variance, innovation, &mut filter.state);
}

impl Written {
    fn new(problem: &Problem) -> Self {
        let Problem { dt, intensity, measured_variance, start_variance } = *problem;
        let covariance = AngleRateCovariance::diagonal(start_variance, start_variance);
        black_box(Self { dt, intensity, measured_variance, angle: 0.0, rate: 0.0, covariance })
    }
}

/// Steps of the written core.
pub(super) fn rehearse() {
    let mut written = Written::new(&Problem::constant_rate());
    for n in 0..100_u8 {
        step_written(&mut written, black_box(f32::from(n % 16) - 7.5));
    }
    black_box((written.angle, written.rate));
}

#[inline(never)]
pub(super) fn count(meter: &Meter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let problem = Problem::constant_rate();
    let Problem { measured_variance, start_variance, .. } = problem;
    let mut written = Written::new(&problem);
    report(counted(meter, "core_2_predict_and_update", |measured| step_written(&mut written, measured)));
    black_box((written.angle, written.rate));
    let mut general = black_box(General {
        transition: UpperTriangular(problem.transition()),
        sources: problem.sources(),
        measured_variance,
        state: Vector2::zeros(),
        covariance: UdCovariance::from_diagonal(&Vector2::repeat(start_variance)),
    });
    report(counted(meter, "general_core_2_predict_and_update", |measured| {
        step_general(&mut general, measured);
    }));
    black_box(general.state);
}
