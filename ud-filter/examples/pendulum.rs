//! An extended Kalman filter: angle and rate of a pendulum from its shadow, the sine of the angle.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | a | rad | angle | 1, standard deviation 0.5 rad |
//! | 1 | r | rad/s | rate | 0, standard deviation 1 rad/s |
//!
//! ```text
//! r+ = r - dt (k sin a + c r) + noise,   a+ = a + dt r+,   z = sin a + noise       k = 9.81 / s^2, c = 0.1 / s
//! F = [1 - dt^2 k cos a,  dt (1 - dt c);  -dt k cos a,  1 - dt c],                  h' = [cos a, 0]
//! ```
//!
//! `cargo run -p ud-filter --example pendulum`

use nalgebra::{Matrix2, Vector2};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use ud_filter::{Dense, KalmanFilter, NoiseSource, UdCovariance};

const DT_S: f64 = 0.01;
/// Gravity over length, in 1/s^2.
const STIFFNESS: f64 = 9.81;
/// In 1/s.
const DAMPING: f64 = 0.1;
/// Standard deviation of the rate's noise in a step, in rad/s.
const PUSH_RAD_S: f64 = 0.01;
/// Standard deviation of a measurement.
const NOISE: f64 = 0.05;
/// Four standard deviations.
const GATE: f64 = 16.0;

/// A step of the pendulum, and its Jacobian.
fn swing(state: &Vector2<f64>) -> (Vector2<f64>, Dense<f64, 2>) {
    let (pull, kept) = (DT_S * STIFFNESS * libm::cos(state.x), 1.0 - DT_S * DAMPING);
    let rate = kept * state.y - DT_S * STIFFNESS * libm::sin(state.x);
    let jacobian = Matrix2::new(1.0 - DT_S * pull, DT_S * kept, -pull, kept);
    (Vector2::new(state.x + DT_S * rate, rate), Dense(jacobian))
}

/// Its shadow, and its Jacobian.
fn shadow(state: &Vector2<f64>) -> (f64, Vector2<f64>) {
    (libm::sin(state.x), Vector2::new(libm::cos(state.x), 0.0))
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let noise = [NoiseSource { gain: Vector2::new(DT_S, 1.0), variance: PUSH_RAD_S * PUSH_RAD_S }];
    let covariance = UdCovariance::from_diagonal(&Vector2::new(0.25, 1.0));
    let mut filter = KalmanFilter::new(Vector2::new(1.0, 0.0), covariance);

    let mut rng = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut truth = Vector2::new(1.4, 0.3);
    let (mut squares, mut last) = (0.0, 0.0);

    println!("time_s  angle_rad  error_rad  sigma_rad");
    for step in 1..=1000_u32 {
        truth = swing(&truth).0 + Vector2::new(DT_S, 1.0) * (PUSH_RAD_S * normal());
        let measured = libm::sin(truth.x) + NOISE * normal();

        filter.predict_extended(swing, &noise)?;
        filter.update_extended(shadow, NOISE * NOISE, measured, GATE);

        last = filter.state.x - truth.x;
        squares += last * last / filter.covariance.variance::<0>();
        if step % 100 == 0 {
            let (time, sigma) = (f64::from(step) * DT_S, libm::sqrt(filter.covariance.variance::<0>()));
            println!("{time:6.1}  {:9.3}  {last:9.4}  {sigma:9.4}", filter.state.x);
        }
    }
    println!("error squared over its variance: {:.2} on average", squares / 1000.0);
    assert!(last.abs() < 0.1, "the filter has lost the pendulum");
    Ok(())
}
