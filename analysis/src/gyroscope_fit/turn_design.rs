//! Which rates, and for how long, tell the scale factor best: the c-optimal design of a calibration.
//!
//! With the rates `r`, the means `c` of the cubed rate as a gyroscope shows them, `q` the non-linearity, `N` the random
//! walk and `W` the strength of coning,
//!
//! ```text
//! M = sum over the rates of t / (N^2 + W) (r, 1, q c)(r, 1, q c)'  +  diag(0, 0, 1),      sigma = sqrt((M^-1)_11)
//! ```
//!
//! All shares of a rest, one rate clockwise and one the other way in steps of a twentieth are tried, and the least
//! sigma is taken. What was turned already counts. The reference and the drift of the bias are left out: they cost
//! little, and nearly the same in all plans.
//!
//! Source: Elfving, Annals of Mathematical Statistics 23 (1952) 255-262.

use motor_model::math;
use nalgebra::{Matrix3, Vector3};
use simulation::math::statistics::NORMAL_95;

/// The share of the time is a whole number of these parts.
const PARTS: u32 = 20;
/// Longest plan for which the need of time is sought, in s.
const NEEDED_MAX_S: f64 = 1e5;

/// A rate at which the rotor has turned, or may turn; rest too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnRate {
    /// The rate asked for, in deg/s, clockwise positive.
    pub asked_deg_s: f64,
    /// The rate turned, in deg/s.
    pub rate_deg_s: f64,
    /// Non-linearity of one standard deviation at this rate, in deg/s.
    pub nonlinear_deg_s: f64,
    /// Variance of the noise, random walk and coning, in deg^2 per s.
    pub noise_deg2_s: f64,
    /// Time turned already, in s.
    pub turned_s: f64,
}

impl TurnRate {
    /// What a second at this rate tells of scale factor, bias and non-linearity.
    fn information(&self) -> Matrix3<f64> {
        let row = Vector3::new(self.rate_deg_s, 1.0, self.nonlinear_deg_s);
        row * row.transpose() / self.noise_deg2_s
    }
}

/// Where the time goes: a rate each way, as places in the list of rates, and their shares; the rest of the time is
/// rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnShares {
    /// Clockwise and the other way.
    pub rates: [usize; 2],
    /// Their shares.
    pub shares: [f64; 2],
}

/// Standard deviation of the scale factor by an information.
fn sigma(information: &Matrix3<f64>) -> f64 {
    information.try_inverse().map_or(f64::INFINITY, |inverse| math::sqrt(inverse.m11))
}

/// The best shares of `time_s`, and the standard deviation that they promise. The first rate is rest; without one to
/// either side there is no deviation.
pub fn best(rates: &[TurnRate], time_s: f64) -> (TurnShares, f64) {
    let of_side = |clockwise: bool| {
        let is_of_side = move |place: &usize| (rates[*place].asked_deg_s > 0.0) == clockwise;
        (1..rates.len()).filter(is_of_side)
    };
    let a_second: Vec<Matrix3<f64>> = rates.iter().map(TurnRate::information).collect();
    let known = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0));
    let turned = rates.iter().zip(&a_second).fold(known, |sum, (rate, second)| sum + second * rate.turned_s);
    let mut found = (TurnShares { rates: [0, 0], shares: [0.0, 0.0] }, f64::INFINITY);
    for clockwise in of_side(true) {
        for counter_clockwise in of_side(false) {
            for one in 0..PARTS {
                for other in 0..PARTS - one {
                    let shares = [one, other].map(|parts| f64::from(parts) / f64::from(PARTS));
                    let rest = a_second[0] * (1.0 - shares[0] - shares[1]);
                    let turns = a_second[clockwise] * shares[0] + a_second[counter_clockwise] * shares[1];
                    let sigma = sigma(&(turned + (rest + turns) * time_s));
                    if sigma < found.1 {
                        found = (TurnShares { rates: [clockwise, counter_clockwise], shares }, sigma);
                    }
                }
            }
        }
    }
    found
}

/// Motor time in s after which the best plan promises 95 % of scale factors within `within_ppm`, found by halving
/// between powers of two; `None` where no time is enough.
pub fn needed_s(rates: &[TurnRate], within_ppm: f64) -> Option<f64> {
    let turned_s: f64 = rates.iter().map(|rate| rate.turned_s).sum();
    let wanted = 1e-6 * within_ppm / NORMAL_95;
    let enough = |time_s: f64| best(rates, time_s).1 <= wanted;
    let mut high_s = turned_s.max(1.0);
    while !enough(high_s) {
        high_s *= 2.0;
        if high_s > NEEDED_MAX_S {
            return None;
        }
    }
    let mut low_s = if high_s > turned_s.max(1.0) { 0.5 * high_s } else { 0.0 };
    while high_s - low_s > 0.02 * high_s {
        let middle_s = 0.5 * (low_s + high_s);
        if enough(middle_s) { high_s = middle_s } else { low_s = middle_s }
    }
    Some(turned_s + high_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(rate_deg_s: f64, noise_deg2_s: f64) -> TurnRate {
        TurnRate { asked_deg_s: rate_deg_s, rate_deg_s, nonlinear_deg_s: 0.0, noise_deg2_s, turned_s: 1e-9 }
    }

    /// Rest and one rate, noises `N` and `k N`: the deviation is `N sqrt(1 / t + k^2 / u) / r`, the least with times as
    /// the noises: `sigma = N (1 + k) / (r sqrt(t + u))`. With k = 3 that is a quarter of the time at rest. A rate the
    /// other way with a thousand times the noise is left.
    #[test]
    fn exact_times_are_as_the_noises() {
        let n2 = 6.25e-6;
        let rates = [rate(0.0, n2), rate(160.0, 1e6 * n2), rate(-100.0, 9.0 * n2)];
        let (found, sigma) = best(&rates, 60.0);
        assert!(found.shares[0] < 1e-9 && (found.shares[1] - 0.75).abs() < 1e-9, "{found:?}");
        let expected = math::sqrt(n2) * 4.0 / (100.0 * math::sqrt(60.0));
        assert!((sigma / expected - 1.0).abs() < 1e-3, "{sigma} {expected}");
        // 10 ppm at 1.96 sigma.
        let needed = needed_s(&rates, 10.0).unwrap();
        let closed_form_s = n2 * 16.0 / (100.0 * 10e-6 / 1.96_f64) / (100.0 * 10e-6 / 1.96);
        assert!((needed / closed_form_s - 1.0).abs() < 0.03, "{needed} {closed_form_s}");
    }

    /// Without coning half of the time goes to either side, and the deviation is `N / (mean rate sqrt(t))`.
    #[test]
    fn exact_a_level_rotor_turns_to_both_sides() {
        let n2 = 6.25e-6;
        let rates = [rate(0.0, n2), rate(160.0, n2), rate(-88.0, n2), rate(80.0, n2), rate(-40.0, n2)];
        let (found, sigma) = best(&rates, 60.0);
        assert_eq!(found.rates, [1, 2]);
        let spread = 0.5 * 248.0;
        let expected = math::sqrt(n2) / (spread * math::sqrt(60.0));
        // A twentieth of rest is the least.
        assert!(sigma > expected && sigma < 1.06 * expected, "{sigma} {expected}");
    }

    /// What was turned counts, also where no time is left: `N / (r sqrt(t))` of `t` at the rates r and -r. Half of the
    /// error takes four times as long, to 2 %.
    #[test]
    fn exact_time_turned_counts() {
        let n2 = 6.25e-6;
        let turned = |rate_deg_s, turned_s| TurnRate { turned_s, ..rate(rate_deg_s, n2) };
        let (_, sigma) = best(&[turned(0.0, 20.0), turned(100.0, 10.0), turned(-100.0, 10.0)], 0.0);
        let expected = math::sqrt(n2) / (100.0 * math::sqrt(20.0));
        assert!((sigma / expected - 1.0).abs() < 1e-9, "{sigma} {expected}");
        let none = [0.0, 100.0, -100.0].map(|rate_deg_s| turned(rate_deg_s, 1e-9));
        let [four_s, one_s] = [10.0, 20.0].map(|within_ppm| needed_s(&none, within_ppm).unwrap());
        assert!((four_s / one_s / 4.0 - 1.0).abs() < 0.03, "{four_s} {one_s}");
    }

    /// A gyroscope whose non-linearity is as large as the error that is wanted needs more than time.
    #[test]
    fn exact_no_time_is_enough_where_non_linearity_stays() {
        let mut rates = [rate(0.0, 6.25e-6), rate(160.0, 6.25e-6), rate(-160.0, 6.25e-6)];
        for rate in &mut rates {
            // 100 ppm of the rate, which two equal rates do not tell from the scale factor.
            rate.nonlinear_deg_s = 1e-4 * rate.rate_deg_s;
        }
        assert_eq!(needed_s(&rates, 10.0), None);
    }
}
