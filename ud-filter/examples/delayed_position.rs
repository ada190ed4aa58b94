//! A vehicle with positions that arrive late, as those of a satellite receiver do, and a commanded acceleration.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | x | m | position | 0, standard deviation 10 m |
//! | 1 | v | m/s | velocity | 0, standard deviation 5 m/s |
//!
//! ```text
//! x+ = F x + B u,   F = [1 dt; 0 1],   B = [dt^2/2; dt],   u: commanded acceleration, white noise of 0.05 m^2/s^3
//! ```
//!
//! Positions are taken once a second and arrive 0.6 s later. The filter keeps state and covariance of each step since,
//! with the command that followed. It fuses a late position where it belongs, and repeats the steps after it.
//!
//! `cargo run -p ud-filter --example delayed_position`

use std::collections::VecDeque;

use nalgebra::{Matrix2, Vector1, Vector2};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use ud_filter::{
    DiscreteModel, KalmanFilter, NoiseSource, PredictionRefusal, Transition, UdCovariance, UpperTriangular,
};

const DT_S: f64 = 0.1;
/// Steps from a position to its arrival.
const DELAY: usize = 6;
/// Variance of a measured position, in m^2.
const MEASURED_M2: f64 = 4.0;
/// Three standard deviations.
const GATE: f64 = 9.0;

/// What is known at a step.
#[derive(Clone, Copy)]
struct Known {
    filter: KalmanFilter<f64, 2>,
    /// The acceleration commanded from here on.
    command_m_s2: f64,
}

struct Vehicle {
    transition: UpperTriangular<f64, 2>,
    input: Vector2<f64>,
    noise: [NoiseSource<f64, 2>; 2],
}

impl Vehicle {
    fn new() -> Result<Self, PredictionRefusal> {
        let source = NoiseSource { gain: Vector2::new(0.0, 1.0), variance: 0.05 };
        let model = DiscreteModel::new(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &[source], DT_S)?;
        let input = Vector2::new(0.5 * DT_S * DT_S, DT_S);
        Ok(Self { transition: UpperTriangular(model.transition), input, noise: model.noise })
    }

    fn after(&self, mut known: Known, command_m_s2: f64) -> Result<Known, PredictionRefusal> {
        let control = Vector1::new(known.command_m_s2);
        known.filter.predict_with_input(&self.transition, &self.input, &control, &self.noise)?;
        known.command_m_s2 = command_m_s2;
        Ok(known)
    }
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let vehicle = Vehicle::new()?;
    let covariance = UdCovariance::from_diagonal(&Vector2::new(100.0, 25.0));
    let filter = KalmanFilter::new(Vector2::zeros(), covariance);
    let mut known = VecDeque::from([Known { filter, command_m_s2: 0.0 }]);

    let mut rng = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut truth, mut positions) = (Vector2::new(4.0, 1.0), VecDeque::new());

    println!("time_s  position_m  error_m  sigma_m");
    for step in 1..=300_u32 {
        let command_m_s2 = if step % 100 < 50 { 0.5 } else { -0.5 };
        let newest = *known.back().ok_or("the history is never empty")?;
        let pushes = vehicle.noise.map(|source| source.gain * (libm::sqrt(source.variance) * normal()));
        truth = vehicle.transition.carry(&truth) + vehicle.input * newest.command_m_s2;
        truth += pushes[0] + pushes[1];
        known.push_back(vehicle.after(newest, command_m_s2)?);
        if known.len() > DELAY + 1 {
            known.pop_front();
        }

        positions.push_back((step % 10 == 0).then(|| truth.x + libm::sqrt(MEASURED_M2) * normal()));
        let arrived = if positions.len() > DELAY { positions.pop_front().flatten() } else { None };
        if let Some(position_m) = arrived {
            // The oldest step kept is the one at which the position was taken.
            known[0].filter.update_gated(&Vector2::new(1.0, 0.0), MEASURED_M2, position_m, GATE);
            for later in 1..known.len() {
                known[later] = vehicle.after(known[later - 1], known[later].command_m_s2)?;
            }
        }

        let now = known[known.len() - 1].filter;
        if step % 30 == 0 {
            let (time, sigma) = (f64::from(step) * DT_S, libm::sqrt(now.covariance.variance::<0>()));
            println!("{time:6.1}  {:10.2}  {:7.2}  {sigma:7.2}", now.state.x, now.state.x - truth.x);
        }
    }
    let now = known[known.len() - 1].filter;
    let sigmas = (now.state.x - truth.x) / libm::sqrt(now.covariance.variance::<0>());
    assert!(sigmas.abs() < 4.0, "the filter has lost the vehicle: {sigmas} standard deviations");
    Ok(())
}
