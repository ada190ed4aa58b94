//! The noise of a gyroscope: the covariance of its integrated angle, and its Allan deviation.
//!
//! White noise of the rate gives a random walk of the angle. The bias's instability is a first-order Gauss-Markov
//! process, `E d(t) d(t + u) = D^2 exp(-u / C)`. With `m1(x) = (1 - exp(-x)) / x` and `m2(x) = (x - 1 + exp(-x)) / x^2`
//! ([`motor_model::math::decay_mean`] and [`motor_model::math::decay_second_mean`]):
//!
//! ```text
//! variance of the angle over a span T                 N^2 T + 2 D^2 T^2 m2(T / C)
//! covariance over spans T, U that are u apart         D^2 T m1(T / C) U m1(U / C) exp(-u / C)
//! Allan variance (half the mean square of the difference of two means over neighbouring spans T)
//!                                                     N^2 / T + D^2 (2 m2(T / C) - m1(T / C)^2)
//! ```
//!
//! The Allan deviation of the drift alone rises to 0.6174 D at T = 1.893 C and falls again. That plateau is the
//! instability of the data sheet. The units `q` of the samples, rounded one by one, add `q^2 / 12` a sample to the
//! random walk. Source: IEEE Std 952-1997, annex C, where the plateau is written `0.437 q_c sqrt(T_c)`, with `q_c = D
//! sqrt(2 / C)`.

use motor_model::math;

use crate::scene::Scene;

/// Seconds in an hour.
pub const SECONDS_PER_HOUR: f64 = 3600.0;
const ROOT_SECONDS_PER_ROOT_HOUR: f64 = 60.0;
/// Largest Allan deviation of a Gauss-Markov process per its standard deviation.
const PLATEAU: f64 = 0.617_362;

/// The noise of a gyroscope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeNoise {
    /// Time between samples in s.
    pub period_s: f64,
    /// Angle random walk in degrees per root second.
    pub walk_deg_rs: f64,
    /// Standard deviation of the drift in deg/s.
    pub drift_deg_s: f64,
    /// Its correlation time in s.
    pub drift_time_s: f64,
    /// Unit of a sample in degrees; 0 for none.
    pub resolution_deg: f64,
}

/// A span of time in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeSpan {
    /// Where it begins.
    pub from_s: f64,
    /// Where it ends, after that.
    pub until_s: f64,
}

impl TimeSpan {
    /// Its length in s.
    pub fn length_s(self) -> f64 {
        self.until_s - self.from_s
    }
}

impl GyroscopeNoise {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        Self {
            period_s: 1.0 / scene.number("gyroscope.sample_rate_hz"),
            walk_deg_rs: scene.number("gyroscope.random_walk_deg_rh") / ROOT_SECONDS_PER_ROOT_HOUR,
            drift_deg_s: scene.number("gyroscope.instability_deg_h") / PLATEAU / SECONDS_PER_HOUR,
            drift_time_s: scene.number("gyroscope.instability_time_s"),
            resolution_deg: scene.number("gyroscope.resolution_deg"),
        }
    }

    /// Variance of the rate's white noise per bandwidth: deg^2 per s, rounding included.
    pub fn white_deg2_s(&self) -> f64 {
        self.walk_deg_rs * self.walk_deg_rs
            + self.resolution_deg * self.resolution_deg / (12.0 * self.period_s)
    }

    /// Covariance in deg^2 of the angles over two spans, which are the same or do not overlap.
    pub fn covariance_deg2(&self, one: TimeSpan, other: TimeSpan) -> f64 {
        let variance = self.drift_deg_s * self.drift_deg_s;
        let per_time = |span: TimeSpan| span.length_s() / self.drift_time_s;
        if one == other {
            let length_s = one.length_s();
            let drift_deg2 = 2.0 * variance * length_s * length_s * math::decay_second_mean(per_time(one));
            return self.white_deg2_s() * length_s + drift_deg2;
        }
        let apart_s = (one.from_s - other.until_s).max(other.from_s - one.until_s);
        let mean = |span: TimeSpan| span.length_s() * math::decay_mean(per_time(span));
        variance * mean(one) * mean(other) * math::exp(-apart_s / self.drift_time_s)
    }

    /// Allan deviation in deg/s of means over `span_s`, a whole number of samples.
    pub fn allan_deviation_deg_s(&self, span_s: f64) -> f64 {
        let x = span_s / self.drift_time_s;
        let first = math::decay_mean(x);
        let drift = 2.0 * math::decay_second_mean(x) - first * first;
        math::sqrt(self.white_deg2_s() / span_s + self.drift_deg_s * self.drift_deg_s * drift)
    }

    /// Standard deviation in deg/s of a bias taken from the mean over `time_s` at rest, as random walk alone allows.
    pub fn walk_bias_deg_s(&self, time_s: f64) -> f64 {
        self.walk_deg_rs / math::sqrt(time_s)
    }
}
