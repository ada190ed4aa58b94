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
//!
//! # Spread of the motor
//!
//! The motor's own spread has the variance `t s^2` in all rows of a mode. A row has `k` coasts with the sum of squares
//! `q` about `c rate`; there are `K` coasts in all. `t` is the mode of its posterior, with the prior of
//! [`super::repeats`] (`nu0` repeats at 1), by the iteration of Dempster, Laird and Rubin (J. R. Stat. Soc. B 39
//! (1977) 1): the expected own squares, given `t`, make the next `t`. One degree of freedom has gone into the factor.
//!
//! ```text
//! p = t s^2 / (t s^2 + n),   t <- (nu0 + sum (p^2 q + p n k (K - 1) / K) / s^2) / (nu0 + K - 1)
//! ```
//!
//! Without noise it is the scale of all repeats ([`spread_scale`]). Scatter that is the camera's leaves `t` at 1. Below
//! 1 squares count as far as they are the motor's: with the part `p` at `t = 1` they have `p^2` of the information.

use estimator::Estimate;
use motor_model::math;

use super::commissioned_map::spread_scale;
use super::repeats::EXPECTED_REPEATS;
use crate::response_map::CRUISES_MAX;

/// Steps of the iteration. Where the spread is far above the noise a few suffice; where it is far below, it stays at 1.
const SCALE_STEPS: usize = 40;

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

/// How far the coasts of a row lie apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoastScatter {
    /// Variance in rad^2 that the prior expects of the motor, `s^2`, above 0.
    pub own_rad2: f32,
    /// Variance in rad^2 of the measurement, `n`.
    pub noise_rad2: f32,
    /// Sum of squares in rad^2 about the coast per rate, `q`.
    pub squares_rad2: f32,
    /// How many coasts, `k`.
    pub count: f32,
}

impl CoastScatter {
    /// Part of the variance that is the motor's, where it is `scale2` times the prior's.
    fn part(&self, scale2: f32) -> f32 {
        let own_rad2 = scale2 * self.own_rad2;
        own_rad2 / (own_rad2 + self.noise_rad2)
    }
}

/// Scale of the spread of a mode whose rows scatter by `rows`; 1 of fewer than two coasts.
pub(super) fn scatter_scale(rows: &heapless::Vec<CoastScatter, CRUISES_MAX>) -> f32 {
    let count: f32 = rows.iter().map(|row| row.count).sum();
    let freedom = count - 1.0;
    if freedom < 1.0 {
        return 1.0;
    }
    let mut scale2 = 1.0;
    for _ in 0..SCALE_STEPS {
        let own = |row: &CoastScatter| {
            let part = row.part(scale2);
            let left = part * row.noise_rad2 * row.count * freedom / count;
            (part * part * row.squares_rad2 + left) / row.own_rad2
        };
        let squares: f32 = rows.iter().map(own).sum();
        scale2 = (EXPECTED_REPEATS + squares) / (EXPECTED_REPEATS + freedom);
    }
    if scale2 >= 1.0 {
        return math::sqrt_f32(scale2);
    }
    let (squares, count) = rows.iter().fold((0.0, 0.0), |(squares, count), row| {
        let part = row.part(1.0);
        (squares + part * part * part * row.squares_rad2 / row.own_rad2, count + part * part * row.count)
    });
    spread_scale(squares, count - 1.0).min(1.0)
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

    /// Rows of `count` coasts in all that scatter as a motor of `scale` times the prior's spread does, under a camera
    /// of `noise` times that spread.
    fn scatters(scale: f32, noise: f32, rows: &[f32]) -> heapless::Vec<CoastScatter, CRUISES_MAX> {
        let row = |count: &f32| {
            let (own_rad2, count) = (1e-4, *count);
            let squares_rad2 = count * (scale * scale + noise * noise) * own_rad2;
            CoastScatter { own_rad2, noise_rad2: noise * noise * own_rad2, squares_rad2, count }
        };
        rows.iter().map(row).collect()
    }

    /// An exact camera leaves the scale of all repeats. One that explains all squares, or more than there are, leaves
    /// the prior's spread.
    #[test]
    fn exact_the_scale_of_an_exact_and_of_a_poor_camera() {
        for scale in [3.0_f32, 1.5, 0.3, 0.0] {
            let found = scatter_scale(&scatters(scale, 0.0, &[3.0, 5.0]));
            assert!((found / spread_scale(8.0 * scale * scale, 7.0) - 1.0).abs() < 1e-5, "{scale}: {found}");
        }
        for scale in [0.0, 1.0, 3.0] {
            let found = scatter_scale(&scatters(scale, 30.0, &[3.0, 5.0]));
            assert!((found - 1.0).abs() < 0.02, "{scale}: {found}");
        }
        assert!((scatter_scale(&scatters(9.0, 0.0, &[1.0])) - 1.0).abs() < f32::EPSILON);
    }

    /// Coasts that agree shrink the spread as far as they are the motor's: those under a poor camera count for next to
    /// nothing, and what is left of the noise never grows it.
    #[test]
    fn exact_the_spread_shrinks_by_what_is_the_motors() {
        let exact = scatter_scale(&scatters(0.3, 0.0, &[8.0]));
        let mut rows = scatters(0.3, 0.0, &[8.0]);
        rows.extend(scatters(1.0, 30.0, &[8.0]));
        let both = scatter_scale(&rows);
        assert!(exact < 0.8 && (both / exact - 1.0).abs() < 0.02, "{both} {exact}");
        let squares_rad2 = 8.7e-4;
        let row = CoastScatter { own_rad2: 1e-4, noise_rad2: 0.25e-4, squares_rad2, count: 8.0 };
        assert!((scatter_scale(&[row].into_iter().collect()) - 1.0).abs() < f32::EPSILON);
    }

    /// A motor of 20 times the spread, under a camera of up to six times the prior's, as a tilting motor is: what is
    /// found lies within a tenth of what an exact camera shows. With the camera in one of two rows alone as well.
    #[test]
    fn exact_a_wide_motor_is_seen_through_the_noise() {
        let exact = scatter_scale(&scatters(20.0, 0.0, &[4.0, 4.0]));
        for noise in [1.0, 3.0, 6.0] {
            let mut rows = scatters(20.0, noise, &[4.0, 4.0]);
            let both = scatter_scale(&rows);
            rows[1] = scatters(20.0, 0.0, &[4.0])[0];
            let one = scatter_scale(&rows);
            assert!(
                (both / exact - 1.0).abs() < 0.1 && (one / exact - 1.0).abs() < 0.1,
                "{noise}: {both} {one}"
            );
        }
    }

    /// The iteration ends where another round of it changes nothing: the mode of the posterior, where its density is
    /// larger than to both sides.
    #[test]
    fn exact_the_scale_is_the_mode_of_its_posterior() {
        for (scale, noise) in [(4.0, 2.0), (10.0, 3.0), (3.0, 1.0)] {
            let rows = scatters(scale, noise, &[8.0]);
            let CoastScatter { own_rad2, noise_rad2, squares_rad2, .. } = rows[0];
            // Seven squares' worth, one degree of freedom being the factor's.
            let log_density = |t: f32| {
                let own = noise_rad2 / own_rad2;
                let q = squares_rad2 / own_rad2;
                -0.5 * (4.0 * (libm::logf(t) + 1.0 / t) + 7.0 * libm::logf(t + own) + q / (t + own))
            };
            let found = scatter_scale(&rows).powi(2);
            let [below, at, above] = [0.9, 1.0, 1.1].map(|part| log_density(part * found));
            assert!(at > below && at > above, "{scale} {noise}: {found}");
        }
    }
}
