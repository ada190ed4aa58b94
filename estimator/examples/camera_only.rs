//! Angle and rate from a camera alone: the constant-rate filter over simulated frames.
//!
//! A rotor turns at 10 rad/s, and its rate is a random walk. A camera of 10,000 frames a second shows its angle with
//! the noise that the filter assumes. Printed are angle, error and standard deviation every 10 ms.
//!
//! `cargo run -p micromotor-estimator --example camera_only`

use estimator::{AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Time between frames, in s.
const FRAME_S: f64 = 1e-4;

fn main() {
    let tuning = ConstantRateTuning::<f64>::default();
    let camera_rad = math::sqrt(tuning.track.camera_rad2);
    let kick_rad_s = math::sqrt(tuning.random_walk.impacted_b_rad2_s3 * FRAME_S);
    let mut filter = ConstantRate::new(&tuning);

    let mut rng = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut angle_rad, mut rate_rad_s) = (0.0, 10.0);

    println!("time_ms  angle_mdeg  error_mdeg  sigma_mdeg  rate_rad_s");
    for frame in 1..=1000_u32 {
        rate_rad_s += kick_rad_s * normal();
        angle_rad += rate_rad_s * FRAME_S;

        // In a real program: the drive at every tick, a frame whenever one arrives.
        let now = Time::from_micros(100 * u64::from(frame));
        filter.drive(now, DriveCommand::full(DriveMode::B));
        let shown = Angle::from_radians(angle_rad + camera_rad * normal()).wrapped();
        filter.update_camera(&CameraFrame::new(now, shown));

        if frame % 100 == 0
            && let Some(estimate) = filter.estimate(now)
        {
            let error_rad: f64 = estimate.angle.radians_since(Angle::from_radians(angle_rad));
            println!(
                "{:7.0}  {:10.1}  {:10.1}  {:10.1}  {:10.2}",
                f64::from(frame) * FRAME_S * 1e3,
                1e3 * estimate.angle.degrees(),
                1e3 * error_rad.to_degrees(),
                1e3 * math::sqrt(estimate.angle_rad2).to_degrees(),
                estimate.rate_rad_s,
            );
        }
    }
}
