//! A MEMS gyroscope on the rotor, its axis along the rotor's.
//!
//! It integrates: each sample is the angle turned since the last one.
//!
//! ```text
//! sample = round(shown + d T + N sqrt(T) w),   clamped to +- range T
//!
//! shown: with scale factor, bias, misalignment, non-linearity and what warming up changes, see `errors`
//! d: the bias's instability, see `noise`      N: angle random walk      T: sample period
//! w: standard normal number
//! ```
//!
//! A sample at the range is marked as saturated, as by the status byte of the parts. The turn beyond the range is lost.
//! The mean over a sample saturates. It also stands for the bandwidth: that of a mean over 2 ms is 221 Hz.
//!
//! Defaults: a tactical part, after Sensonor's STIM300: angle random walk 0.15 deg/sqrt(h), bias instability 0.5 deg/h,
//! scale factor within 500 ppm, bias within 10 deg/h over temperature, +-400 deg/s, bandwidth 262 Hz, increments in
//! units of 2^-21 degrees, non-linearity 25 ppm. Misalignment, 2 mrad, is that of a part set on the rotor by hand, and
//! warming up is of one kelvin in two minutes, of a part with 500 ppm over 60 kelvin: both are assumed. A seed draws
//! the errors from normal distributions with these standard deviations. Left out: shocks and acceleration.
//!
//! The gyroscope does not act on the motor, so that several can be simulated on one run. `gyroscope.serial` names them.

mod errors;
pub mod noise;

use motor_model::math;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::math::count::real;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::scene::SceneError;
use crate::world::body_turn::BodyTurn;
pub use errors::{GyroscopeErrors, WarmUp};
pub use noise::GyroscopeNoise;

/// A sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeSample {
    /// Angle turned since the last sample, as measured, in degrees.
    pub turned_deg: f64,
    /// Whether it is at the limit of the range.
    pub saturated: bool,
}

/// A gyroscope.
#[derive(Clone, Debug)]
pub struct Gyroscope {
    errors: GyroscopeErrors,
    noise: GyroscopeNoise,
    limit_deg: f64,
    walk: Pcg64,
    instability: Pcg64,
    drift_deg_s: f64,
    /// Samples made.
    samples: u64,
}

/// Seed of the scene's gyroscope by a seed of the scene: far apart for neighbours in seed or serial.
fn seed_of(seed: u64, scene: &Scene) -> u64 {
    seed.wrapping_add(scene.integer("gyroscope.serial").wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

impl Gyroscope {
    /// The gyroscope of a scene. Its instability is stationary from the first sample on.
    pub fn new(scene: &Scene) -> Self {
        let seed = seed_of(scene.noise_seed(), scene);
        let noise = GyroscopeNoise::of(scene);
        let mut instability = random_streams::stream(seed, RandomSource::GyroscopeInstability);
        let first: f64 = StandardNormal.sample(&mut instability);
        Self {
            errors: GyroscopeErrors::of(scene),
            noise,
            limit_deg: scene.number("gyroscope.range_deg_s") * noise.period_s,
            walk: random_streams::stream(seed, RandomSource::GyroscopeWalk),
            drift_deg_s: noise.drift_deg_s * first,
            instability,
            samples: 0,
        }
    }

    /// Its errors: what a calibration should find.
    pub fn errors(&self) -> GyroscopeErrors {
        self.errors
    }

    /// Its noise, as a data sheet gives it.
    pub fn noise(&self) -> GyroscopeNoise {
        self.noise
    }

    /// The turn of a sample at the end of the range, in degrees.
    pub fn limit_deg(&self) -> f64 {
        self.limit_deg
    }

    /// The sample at the end of a period in which the rotor turned by `turn`.
    pub fn sample(&mut self, turn: &BodyTurn) -> GyroscopeSample {
        let GyroscopeNoise { period_s, walk_deg_rs, drift_deg_s, drift_time_s, resolution_deg } = self.noise;
        let walk: f64 = StandardNormal.sample(&mut self.walk);
        let increment: f64 = StandardNormal.sample(&mut self.instability);
        let middle_s = (real(self.samples) + 0.5) * period_s;
        self.samples += 1;
        let shown_deg = self.errors.shown_deg(turn, middle_s, period_s, self.limit_deg)
            + self.drift_deg_s * period_s
            + walk_deg_rs * math::sqrt(period_s) * walk;
        let kept = math::exp(-period_s / drift_time_s);
        self.drift_deg_s = kept * self.drift_deg_s + drift_deg_s * math::sqrt(1.0 - kept * kept) * increment;
        let coded_deg = if resolution_deg > 0.0 {
            resolution_deg * (shown_deg / resolution_deg).round()
        } else {
            shown_deg
        };
        GyroscopeSample {
            turned_deg: coded_deg.clamp(-self.limit_deg, self.limit_deg),
            saturated: coded_deg.abs() >= self.limit_deg,
        }
    }
}

/// The time between two samples as a whole number of the loop's ticks.
///
/// # Errors
/// When it is not whole.
pub fn ticks_per_sample(scene: &Scene) -> Result<u64, SceneError> {
    let rate_hz = scene.number("gyroscope.sample_rate_hz");
    #[expect(clippy::cast_precision_loss, reason = "10,000 ns")]
    let ticks = 1e9 / (rate_hz * controller::TICK_NANOS as f64);
    if ticks >= 1.0 && (ticks - ticks.round()).abs() < 1e-9 * ticks {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 1e5")]
        return Ok(ticks.round() as u64);
    }
    Err(SceneError::Conflict {
        conflict: format!("gyroscope.sample_rate_hz = {rate_hz} does not go into the loop's ticks of 10 us"),
        hint: "125, 250, 500, 1000 and 2000 Hz do".to_owned(),
    })
}

#[cfg(test)]
mod tests;
