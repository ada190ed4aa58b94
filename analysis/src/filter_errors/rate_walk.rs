//! The error of a rate that wanders, as a camera sees it: what a noise of the kicks costs in angle.
//!
//! The rate is a random walk of intensity `q`. A camera measures the angle every `T` with variance `R`. Where the
//! filter's time `(R T / q)^(1/4)` is many frames, the steady covariance of the Kalman filter is that of continuous
//! time (the Riccati equation of a double integrator; Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to
//! Tracking and Navigation", 2001, section 8.2), with `r = R T`:
//!
//! ```text
//! P11 = sqrt 2 q^(1/4) r^(3/4),    P12 = sqrt(q r),    P22 = sqrt 2 q^(3/4) r^(1/4)
//! variance at the present = P11 + 2 d P12 + d^2 P22 + q d^3 / 3        d: mean age of what the newest frame shows
//! ```
//!
//! The standard deviation goes as `q^(1/8)`, so that half the error takes a 256th of the noise.

use motor_model::math;
use serde::{Deserialize, Serialize};
use simulation::scene::Scene;
use simulation::world::instruments::{Camera, assumed};

/// A camera that sees a rate wander.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateWalk {
    /// `R T`, in rad^2 s.
    noise_rad2_s: f64,
    /// Mean age of the angle that the newest frame shows, in s.
    age_s: f64,
}

/// Intensities between which a walk is sought, in rad^2/s^3: the rate doubles its error in years, or in a frame.
const INTENSITIES: (f64, f64) = (1e-18, 1e12);

impl RateWalk {
    /// That of the camera of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let camera = assumed(scene).camera;
        let [period_s, latency_s] = [camera.period_nanos, camera.latency_nanos]
            .map(|nanos| 1e-9 * simulation::math::count::real(nanos));
        Self { noise_rad2_s: Camera::variance_rad2(scene) * period_s, age_s: latency_s + 0.5 * period_s }
    }

    /// Standard deviation of the angle at the present, in milli-degrees, where the walk has this intensity.
    pub fn error_mdeg(&self, intensity_rad2_s3: f64) -> f64 {
        let Self { noise_rad2_s: r, age_s: d } = *self;
        let q = intensity_rad2_s3;
        let root = |x: f64| math::sqrt(x);
        let (q4, r4) = (root(root(q)), root(root(r)));
        let p11 = root(2.0) * q4 * r4 * r4 * r4;
        let p12 = root(q * r);
        let p22 = root(2.0) * q4 * q4 * q4 * r4;
        1e3 * root(p11 + 2.0 * d * p12 + d * d * p22 + q * d * d * d / 3.0).to_degrees()
    }

    /// The intensity of a walk that costs this error, in rad^2/s^3.
    pub fn intensity_rad2_s3(&self, error_mdeg: f64) -> f64 {
        let (mut low, mut high) = INTENSITIES;
        // The error grows with the intensity. 200 halvings of the logarithm are more than a double has digits.
        for _ in 0..200 {
            let middle = math::sqrt(low * high);
            if self.error_mdeg(middle) < error_mdeg {
                low = middle;
            } else {
                high = middle;
            }
        }
        math::sqrt(low * high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recursion of the discrete Kalman filter, frame by frame, until it is steady: prediction over a period with
    /// the noise of the walk, then a frame. The variance is the mean of those before and after the frame; continuous
    /// time lies between them, to the square of the frame's share of the filter's time, here a hundredth.
    #[test]
    fn dual_the_error_is_that_of_the_discrete_filter() {
        let (q, t, r) = (0.1, 1e-4, 9e-8);
        let (mut p11, mut p12, mut p22) = (r, 0.0, 1.0);
        let mut before = p11;
        for _ in 0..100_000 {
            (p11, p12) =
                (p11 + 2.0 * t * p12 + t * t * p22 + q * t * t * t / 3.0, p12 + t * p22 + q * t * t / 2.0);
            p22 += q * t;
            before = p11;
            let (k1, k2) = (p11 / (p11 + r), p12 / (p11 + r));
            (p11, p12, p22) = ((1.0 - k1) * p11, (1.0 - k1) * p12, p22 - k2 * p12);
        }
        let walk = RateWalk { noise_rad2_s: r * t, age_s: 0.0 };
        let expected = 1e3 * math::sqrt(0.5 * (before + p11)).to_degrees();
        assert!((walk.error_mdeg(q) / expected - 1.0).abs() < 0.01, "{} {expected}", walk.error_mdeg(q));
        // And an age: the covariance predicted.
        let d = 1.5e-4;
        let ahead = 0.5 * (before + p11) + 2.0 * d * p12 + d * d * p22 + q * d * d * d / 3.0;
        let (late, expected) = (RateWalk { age_s: d, ..walk }, 1e3 * math::sqrt(ahead).to_degrees());
        assert!((late.error_mdeg(q) / expected - 1.0).abs() < 0.01, "{} {expected}", late.error_mdeg(q));
    }

    /// Without an age the error goes as the eighth root.
    #[test]
    fn exact_half_the_error_takes_a_256th_of_the_noise() {
        let walk = RateWalk { noise_rad2_s: 9e-12, age_s: 0.0 };
        assert!((walk.error_mdeg(0.1 / 256.0) / walk.error_mdeg(0.1) - 0.5).abs() < 1e-12);
        for error_mdeg in [0.1, 3.0, 20.0] {
            let again = walk.error_mdeg(walk.intensity_rad2_s3(error_mdeg));
            assert!((again / error_mdeg - 1.0).abs() < 1e-12, "{error_mdeg} {again}");
        }
    }
}
