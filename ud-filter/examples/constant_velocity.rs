//! A filter of your own on the factorised core: position and velocity from measured positions, with a gate.
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
use ud_filter::{NoiseSource, Transition, UdCovariance, UpperTriangular};

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
    let mut covariance = UdCovariance::from_diagonal(&Vector2::new(100.0, 100.0));
    let mut state = Vector2::new(0.0, 0.0);

    let mut rng = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut truth = Vector2::new(3.0, 2.0);

    println!("time_s  position_m  error_m  sigma_m  velocity_m_s");
    for step in 1..=100_u32 {
        truth = transition.carry(&truth) + Vector2::new(0.5 * dt_s * dt_s, dt_s) * (0.5 * normal());
        let outlier = if step % 25 == 0 { 5.0 } else { 0.0 };
        let measured_m = truth.x + 0.2 * normal() + outlier;

        state = transition.carry(&state);
        covariance.predict(&transition, &noise)?;
        let innovation = measured_m - row.dot(&state);
        if innovation * innovation <= GATE * covariance.innovation_variance(&row, MEASURED_M2) {
            covariance.update(&row, MEASURED_M2, innovation, &mut state)?;
        } else {
            println!("{:6.1}  refused: {innovation:.2} m off", f64::from(step) * dt_s);
        }

        if step % 10 == 0 {
            println!(
                "{:6.1}  {:10.2}  {:7.2}  {:7.2}  {:12.2}",
                f64::from(step) * dt_s,
                state.x,
                state.x - truth.x,
                libm::sqrt(covariance.variance::<0>()),
                state.y,
            );
        }
    }
    Ok(())
}
