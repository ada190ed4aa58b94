//! A MEMS gyroscope on the rotor, its axis along the rotor's.
//!
//! It integrates: each sample is the angle turned since the last one.
//!
//! ```text
//! sample = round((1 + s) turned + (b + d) T + N sqrt(T) w),   clamped to +- range T
//!
//! s: scale-factor error     b: bias     d: the bias's instability, see `noise`
//! N: angle random walk      T: sample period      w: standard normal number
//! ```
//!
//! A sample at the range is marked as saturated, as by the status byte of the parts. The turn beyond the range is lost.
//! The mean over a sample saturates. It also stands for the bandwidth: that of a mean over 2 ms is 221 Hz.
//!
//! Defaults: a tactical part, after Sensonor's STIM300: angle random walk 0.15 deg/sqrt(h), bias instability 0.5 deg/h,
//! scale factor within 500 ppm, bias within 10 deg/h over temperature, +-400 deg/s, bandwidth 262 Hz, increments in
//! units of 2^-21 degrees. A seed draws scale factor and bias from normal distributions with these standard deviations.
//! Left out: non-linearity (25 ppm within 200 deg/s), misalignment, temperature, shocks and acceleration.
//!
//! The gyroscope does not act on the motor, so that several can be simulated on one run. `gyroscope.serial` names them.

pub mod noise;

use motor_model::math;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::scene::SceneError;
pub use noise::GyroscopeNoise;

/// The systematic errors of a gyroscope, which a calibration finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeErrors {
    /// Scale-factor error, 1e-6 for 1 ppm.
    pub scale: f64,
    /// Bias in deg/s.
    pub bias_deg_s: f64,
}

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
}

/// Seed of the scene's gyroscope in the run: far apart for neighbours in seed or serial.
fn seed_of(scene: &Scene) -> u64 {
    scene.seed().wrapping_add(scene.integer("gyroscope.serial").wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

impl GyroscopeErrors {
    /// Of the gyroscope that the scene names.
    fn of(scene: &Scene) -> Self {
        let mut draw = random_streams::stream(seed_of(scene), RandomSource::GyroscopeDraw);
        let mut factor = || match scene.choice("gyroscope.parameters") {
            "drawn" => StandardNormal.sample(&mut draw),
            _ => 1.0,
        };
        Self {
            scale: 1e-6 * scene.number("gyroscope.scale_factor_ppm") * factor(),
            bias_deg_s: scene.number("gyroscope.bias_deg_h") * factor() / noise::SECONDS_PER_HOUR,
        }
    }
}

impl Gyroscope {
    /// The gyroscope of a scene. Its instability is stationary from the first sample on.
    pub fn new(scene: &Scene) -> Self {
        let seed = seed_of(scene);
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
        }
    }

    /// The errors that a calibration should find.
    pub fn errors(&self) -> GyroscopeErrors {
        self.errors
    }

    /// Its noise, as a data sheet gives it.
    pub fn noise(&self) -> GyroscopeNoise {
        self.noise
    }

    /// The sample at the end of a period in which the rotor turned by `turned_deg`.
    pub fn sample(&mut self, turned_deg: f64) -> GyroscopeSample {
        let GyroscopeNoise { period_s, walk_deg_rs, drift_deg_s, drift_time_s, resolution_deg } = self.noise;
        let walk: f64 = StandardNormal.sample(&mut self.walk);
        let increment: f64 = StandardNormal.sample(&mut self.instability);
        let shown_deg = (1.0 + self.errors.scale) * turned_deg
            + (self.errors.bias_deg_s + self.drift_deg_s) * period_s
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
