//! The coasts after a cruise: how far the rotor turns on per rate at the cut, and how well that is known.
//!
//! # Model (C10)
//!
//! A rotor of the rate `x` at the cut turns by `y` until rest. The map says `y = c x + e` with the coast per rate `c`
//! and `e ~ N(0, s^2)`. The filter tells rate and angle at the cut, and the angle at rest, with errors of which its
//! covariance at these instants is `P`. The turn is a difference of two angles. With the error `u` of the rate at the
//! cut and `v` of the turn:
//!
//! ```text
//! Var u = P_cut[rate, rate],   Var v = P_cut[angle, angle] + P_rest[angle, angle],   Cov(v, u) = -P_cut[angle, rate]
//! turn - c rate = e + v - c u,     variance  s^2 + n,     n = Var v - 2 c Cov(v, u) + c^2 Var u
//! c = sum rate turn / sum rate^2,  variance  (s^2 + mean n) / sum rate^2
//! ```
//!
//! Between the frames of a slow camera angle and rate are predicted. Both errors come from how the rate has fluctuated
//! since the last frame, and act in one direction: so the covariance counts. For `c` in `n` stands the prior map's.
//!
//! # Assumptions
//!
//! - The error of the angle at rest is independent of those at the cut: it is that of the frames after it. What the
//!   filter keeps of its angle at the cut makes both errors alike: the sum of variances is too large then.
//! - The filter's rate is the mean of the true one given the frames. The error is then independent of the estimate, and
//!   least squares on the estimated rates are without bias.
//! - Errors of different runs are independent: there are some correlation times of the rate between two cuts.

use estimator::Estimate;

/// The coast after a cruise, in the direction of the mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coast {
    /// Rate at the cut in rad/s.
    pub rate_rad_s: f32,
    /// Its variance in rad^2/s^2.
    pub rate_rad2_s2: f32,
    /// Turn from the cut until rest in rad.
    pub turned_rad: f32,
    /// Its variance in rad^2.
    pub turned_rad2: f32,
    /// Covariance of turn and rate in rad^2/s.
    pub turned_rate_rad2_s: f32,
}

impl Coast {
    /// Of a rotor that turns in the direction `along`, 1 clockwise or -1: from the estimate at the cut to that at rest.
    pub(super) fn between(along: f32, cut: &Estimate<f32>, rest: &Estimate<f32>) -> Self {
        Self {
            rate_rad_s: along * cut.rate_rad_s,
            rate_rad2_s2: cut.rate_rad2_s2,
            turned_rad: along * rest.angle.radians_since::<f32>(cut.angle),
            turned_rad2: cut.angle_rad2 + rest.angle_rad2,
            turned_rate_rad2_s: -cut.angle_rate_rad2_s,
        }
    }

    /// Variance `n` in rad^2 by which the measurement adds to the spread of the turn about `coast_s` times the rate.
    pub fn noise_rad2(&self, coast_s: f32) -> f32 {
        let Self { turned_rad2, turned_rate_rad2_s, rate_rad2_s2, .. } = *self;
        // Not negative but by rounding.
        (turned_rad2 - 2.0 * coast_s * turned_rate_rad2_s + coast_s * coast_s * rate_rad2_s2).max(0.0)
    }
}

/// Coasts after a cruise: sums of rates at the cut and of turns, both in the direction of the mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coasts {
    count: u16,
    /// Sum of squared rates in rad^2/s^2.
    rate2: f32,
    /// Sum of rate times turn in rad^2/s.
    rate_coast: f32,
    /// Sum of squared turns in rad^2.
    coast2: f32,
    /// Mean of `n` in rad^2.
    noise_rad2: f32,
}

impl Coasts {
    /// Adds a coast of `coast_rad` after a cut at `rate_rad_s`, measured with the variance `noise_rad2` about the coast
    /// per rate ([`Coast::noise_rad2`]). No more than 65,535 are counted.
    pub fn add(&mut self, rate_rad_s: f32, coast_rad: f32, noise_rad2: f32) {
        let Some(count) = self.count.checked_add(1) else { return };
        self.count = count;
        self.rate2 += rate_rad_s * rate_rad_s;
        self.rate_coast += rate_rad_s * coast_rad;
        self.coast2 += coast_rad * coast_rad;
        self.noise_rad2 += (noise_rad2 - self.noise_rad2) / f32::from(count);
    }

    /// How many.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Coast per rate in s, by least squares, and the variance per that of a coast; `None` where the rotor stood still.
    pub fn per_rate_s(&self) -> Option<(f32, f32)> {
        (self.rate2 > 0.0).then(|| (self.rate_coast / self.rate2, 1.0 / self.rate2))
    }

    /// Sum of squares in rad^2 about `coast_s` times the rate.
    pub fn squares_rad2(&self, coast_s: f32) -> f32 {
        (self.coast2 - 2.0 * coast_s * self.rate_coast + coast_s * coast_s * self.rate2).max(0.0)
    }

    /// Mean variance in rad^2 of the measurement itself, about the coast per rate; 0 of none.
    pub fn noise_rad2(&self) -> f32 {
        self.noise_rad2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{Angle, Time};

    /// Coasts of 2 and 5 rad after 1 and 2 rad/s: 12 / 5 s, and squares of 0.16 and 0.04.
    #[test]
    fn exact_least_squares_of_the_coast() {
        let mut coasts = Coasts::default();
        assert_eq!((coasts.per_rate_s(), coasts.noise_rad2()), (None, 0.0));
        coasts.add(1.0, 2.0, 0.3);
        coasts.add(2.0, 5.0, 0.1);
        let (coast_s, per) = coasts.per_rate_s().unwrap();
        assert!((coast_s - 2.4).abs() < 1e-6 && (per - 0.2).abs() < 1e-6 && coasts.count() == 2);
        assert!((coasts.squares_rad2(coast_s) - 0.2).abs() < 1e-5);
        assert!((coasts.noise_rad2() - 0.2).abs() < 1e-6);
    }

    /// A rate that was constant since the last frame, `age_s` before the cut, and is known to `sigma`: the angle at the
    /// cut is wrong by `age_s` times its error, the coast by `coast_s` times, and both add up. In either direction.
    #[test]
    fn exact_errors_of_rate_and_angle_add_up() {
        let (age_s, sigma, coast_s, rest_rad2) = (0.03_f32, 4.0_f32, 0.01_f32, 1e-6);
        for along in [1.0, -1.0] {
            let cut = Estimate {
                at: Time::ZERO,
                angle: Angle::from_degrees(1.0),
                rate_rad_s: along * 15.0,
                angle_rad2: age_s * age_s * sigma * sigma,
                angle_rate_rad2_s: age_s * sigma * sigma,
                rate_rad2_s2: sigma * sigma,
                resting: false,
            };
            let angle = cut.angle.plus(Angle::from_degrees(f64::from(along) * 9.0));
            let rest = Estimate { angle, angle_rad2: rest_rad2, ..cut };
            let coast = Coast::between(along, &cut, &rest);
            assert!((coast.turned_rad - 9_f32.to_radians()).abs() < 1e-5 && coast.rate_rad_s > 0.0);
            let expected = ((age_s + coast_s) * sigma).powi(2) + rest_rad2;
            assert!((coast.noise_rad2(coast_s) / expected - 1.0).abs() < 1e-5, "{coast:?}");
        }
    }
}
