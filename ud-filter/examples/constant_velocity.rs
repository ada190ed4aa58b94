//! Position and velocity from measured positions, with a gate; and the same smoothed, once all are measured.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | x | m | position | 0, standard deviation 10 m |
//! | 1 | v | m/s | velocity | 0, standard deviation 10 m/s |
//!
//! ```text
//! x+ = x + dt v + dt^2/2 a,   v+ = v + dt a,   a: white noise, standard deviation 0.5 m/s^2,   z = x + 0.2 m of noise
//! ```
//!
//! `cargo run -p ud-filter --example constant_velocity`

use nalgebra::{Matrix2, Vector2};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use ud_filter::{
    KalmanFilter, NoiseSource, Outcome, SmootherStep, Transition, UdCovariance, UpperTriangular, smooth,
};

/// Variance of a measured position, in m^2.
const MEASURED_M2: f64 = 0.04;
/// A measurement is left out when its innovation squared exceeds this many times its variance: three standard
/// deviations.
const GATE: f64 = 9.0;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let dt_s = 0.1;
    let transition = UpperTriangular(Matrix2::new(1.0, dt_s, 0.0, 1.0));
    let noise = [NoiseSource { gain: Vector2::new(0.5 * dt_s * dt_s, dt_s), variance: 0.25 }];
    let row = Vector2::new(1.0, 0.0);
    let covariance = UdCovariance::from_diagonal(&Vector2::new(100.0, 100.0));
    let mut filter = KalmanFilter::new(Vector2::zeros(), covariance);

    let mut rng = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut truth = Vector2::new(3.0, 2.0);
    // What the smoother needs of each step. Memory of fixed size serves as well.
    let (mut steps, mut truths) = (Vec::new(), Vec::new());

    println!("time_s  position_m  error_m  sigma_m  velocity_m_s");
    for step in 1..=100_u32 {
        truths.push(truth);
        truth = transition.carry(&truth) + Vector2::new(0.5 * dt_s * dt_s, dt_s) * (0.5 * normal());
        let outlier = if step % 25 == 0 { 5.0 } else { 0.0 };
        let measured_m = truth.x + 0.2 * normal() + outlier;

        let before = filter;
        filter.predict(&transition, &noise)?;
        steps.push(SmootherStep { filter: before, transition, noise, predicted: filter.state });
        let record = filter.update_gated(&row, MEASURED_M2, measured_m, GATE);
        if record.outcome != Outcome::Used {
            println!("{:6.1}  refused: {:.2} m off", f64::from(step) * dt_s, record.innovation);
        }
        if step % 10 == 0 {
            print(f64::from(step) * dt_s, &filter, &truth);
        }
    }

    smooth(&mut steps, &filter)?;
    println!("smoothed");
    for (index, (step, truth)) in (0_u32..).zip(steps.iter().zip(&truths)).step_by(10).skip(1) {
        print(f64::from(index) * dt_s, &step.filter, truth);
    }
    Ok(())
}

fn print(time_s: f64, filter: &KalmanFilter<f64, 2>, truth: &Vector2<f64>) {
    let (state, sigma_m) = (&filter.state, libm::sqrt(filter.covariance.variance::<0>()));
    println!("{time_s:6.1}  {:10.2}  {:7.2}  {sigma_m:7.2}  {:12.2}", state.x, state.x - truth.x, state.y);
}
