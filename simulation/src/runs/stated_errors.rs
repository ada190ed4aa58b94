//! Errors of estimates beside the standard deviations that are stated with them, and what is called good and is not.

use estimator::{Estimate, Health};
use motor_model::{Angle, Real};
use serde::{Deserialize, Serialize};

use crate::math::count::real;

/// Of normal errors 0.27 % exceed three standard deviations,
const LARGE_SIGMAS: f64 = 3.0;
/// and one in 1.7 million exceeds five.
const WRONG_SIGMAS: f64 = 5.0;

/// An estimate of good health is falsely valid if the angle's error exceeds this, in milli-degrees,
const FALSE_VALID_MDEG: f64 = 50.0;
/// and this many standard deviations of the filter.
const FALSE_VALID_SIGMAS: f64 = 6.0;

/// Whether an estimate is falsely valid: its health is good, and its error of `off_mdeg`, whose square is `normalised`
/// of the variance stated, is large by either measure.
pub fn is_falsely_valid(off_mdeg: f64, normalised: f64, health: Health) -> bool {
    let wrong = off_mdeg.abs() > FALSE_VALID_MDEG && normalised > FALSE_VALID_SIGMAS * FALSE_VALID_SIGMAS;
    wrong && health == Health::Good
}

/// The figures of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StatedErrors {
    /// Share of the estimates whose angle is off by more than three of their standard deviations; `None` without
    /// estimates.
    pub beyond_3_sigma: Option<f64>,
    /// Estimates of good health whose angle is off by more than five.
    pub good_beyond_5_sigma: u64,
    /// The largest error of these; 0 if there is none.
    pub good_beyond_5_sigma_worst_mdeg: f64,
}

/// A value with two decimals, and a dash where there is none.
pub fn hundredths_or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

/// The counts from which they come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatedErrorCounts {
    estimates: u64,
    large: u64,
    good_and_wrong: u64,
    worst_mdeg: f64,
}

impl StatedErrorCounts {
    /// Adds an estimate and the true angle.
    pub fn add<T: Real>(&mut self, estimate: &Estimate<T>, health: Health, angle: Angle) {
        let off = estimate.angle.minus(angle);
        let off_rad: f64 = off.radians_since(Angle::ZERO);
        self.add_error(1e3 * off.degrees(), off_rad * off_rad / estimate.angle_rad2.to_f64(), health);
    }

    /// Adds an error of `off_mdeg` whose square is `normalised` of the variance stated.
    pub fn add_error(&mut self, off_mdeg: f64, normalised: f64, health: Health) {
        self.estimates += 1;
        self.large += u64::from(normalised > LARGE_SIGMAS * LARGE_SIGMAS);
        if health == Health::Good && normalised > WRONG_SIGMAS * WRONG_SIGMAS {
            self.good_and_wrong += 1;
            self.worst_mdeg = self.worst_mdeg.max(off_mdeg.abs());
        }
    }

    /// Adds the counts of another run.
    pub fn absorb(&mut self, other: &Self) {
        self.estimates += other.estimates;
        self.large += other.large;
        self.good_and_wrong += other.good_and_wrong;
        self.worst_mdeg = self.worst_mdeg.max(other.worst_mdeg);
    }

    /// The figures.
    pub fn figures(&self) -> StatedErrors {
        StatedErrors {
            beyond_3_sigma: (self.estimates > 0).then(|| real(self.large) / real(self.estimates)),
            good_beyond_5_sigma: self.good_and_wrong,
            good_beyond_5_sigma_worst_mdeg: self.worst_mdeg,
        }
    }
}

#[cfg(test)]
mod tests {
    use estimator::Reason;
    use motor_model::Time;

    use super::*;

    /// Errors of 2, 4, 6 and 8 standard deviations of a milli-degree; the largest is not called good.
    #[test]
    fn exact_errors_are_counted_by_what_is_stated_and_called_good() {
        let mut counts = StatedErrorCounts::default();
        let mut add = |sigmas: f64, health| {
            let mdeg_rad = 1e-3_f64.to_radians();
            let estimate = Estimate::<f64> {
                at: Time::ZERO,
                angle: Angle::from_degrees(90.0 - 1e-3 * sigmas),
                rate_rad_s: 0.0,
                angle_rad2: mdeg_rad * mdeg_rad,
                angle_rate_rad2_s: 0.0,
                rate_rad2_s2: 1.0,
                resting: false,
            };
            counts.add(&estimate, health, Angle::from_degrees(90.0));
        };
        for sigmas in [2.0, 4.0, 6.0] {
            add(sigmas, Health::Good);
        }
        add(8.0, Health::Degraded(Reason::CameraSilent));
        let mut twice = counts;
        twice.absorb(&counts);
        let figures = twice.figures();
        assert_eq!(figures.beyond_3_sigma, Some(0.75));
        assert_eq!(figures.good_beyond_5_sigma, 2);
        assert!((figures.good_beyond_5_sigma_worst_mdeg - 6.0).abs() < 1e-3, "{figures:?}");
        assert_eq!(StatedErrorCounts::default().figures(), StatedErrors::default());
    }
}
