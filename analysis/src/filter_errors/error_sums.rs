//! The sums of a filter's errors and innovations in one phase.

use estimator::{Estimate, Health, ImpactInnovation, Innovation, Source, Verdict};
use motor_model::{Angle, Real, math};
use serde::{Deserialize, Serialize};

use simulation::math::count::real;
use simulation::math::statistics::upper_quantile;
use simulation::runs::stated_errors::{StatedErrorCounts, StatedErrors, is_falsely_valid};

/// Sums over one phase of one or more runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorSums {
    /// Magnitudes of the angle's errors, for their quantile.
    errors_mdeg: Vec<f32>,
    square_mdeg2: f64,
    square_rad2_s2: f64,
    /// Squared errors of angle and rate, each per its variance, and of both together, `e' P^-1 e / 2`.
    normalised: [f64; 3],
    missing: u64,
    /// Samples at which the health was good, degraded, unusable.
    health: [u64; 3],
    /// Samples at which the health was good and the estimate wrong.
    false_valid: u64,
    stated: StatedErrorCounts,
    camera: InnovationSums,
    /// Of gap and approach at impacts.
    contact: [InnovationSums; 2],
    /// Impacts that the filter's model was asked about, and those whose kick it did not take.
    impacts: [u64; 2],
    /// Measurements of either instrument of which the filter returned an innovation.
    offered: u64,
    rejected: u64,
    /// How often the filter started anew, its first start included.
    pub restarts: u64,
}

/// Sums over innovations that were used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct InnovationSums {
    count: u64,
    square: f64,
    /// Sum of the products of neighbours, and of the squares of those that have a later neighbour.
    lagged: f64,
    squares_before: f64,
    last: Option<f64>,
}

impl ErrorSums {
    /// Adds an estimate, `None` where the filter had none, and the filter's health.
    pub fn estimate<T: Real>(
        &mut self,
        estimate: Option<&Estimate<T>>,
        health: Health,
        angle: Angle,
        rate_rad_s: f64,
    ) {
        self.health[match health {
            Health::Good => 0,
            Health::Degraded(_) => 1,
            Health::Waiting | Health::Unusable(_) => 2,
        }] += 1;
        let Some(estimate) = estimate else { return self.no_estimate() };
        let off = estimate.angle.minus(angle);
        let (off_mdeg, off_rad) = (1e3 * off.degrees(), off.radians_since::<f64>(Angle::ZERO));
        let off_rad_s = estimate.rate_rad_s.to_f64() - rate_rad_s;
        #[expect(clippy::cast_possible_truncation, reason = "7 digits are enough for a quantile")]
        self.errors_mdeg.push(off_mdeg.abs() as f32);
        self.square_mdeg2 += off_mdeg * off_mdeg;
        self.square_rad2_s2 += off_rad_s * off_rad_s;
        let [p11, p12, p22] =
            [estimate.angle_rad2, estimate.angle_rate_rad2_s, estimate.rate_rad2_s2].map(Real::to_f64);
        let joint = p22 * off_rad * off_rad - 2.0 * p12 * off_rad * off_rad_s + p11 * off_rad_s * off_rad_s;
        let of_angle = off_rad * off_rad / p11;
        self.normalised[0] += of_angle;
        self.normalised[1] += off_rad_s * off_rad_s / p22;
        // The moments are rounded to f32, after which those of a rate that is hardly known may be no covariance.
        let least = 4.0 * f64::from(f32::EPSILON) * p11 * p22;
        self.normalised[2] += 0.5 * joint.max(0.0) / (p11 * p22 - p12 * p12).max(least);
        self.stated.add_error(off_mdeg, of_angle, health);
        self.false_valid += u64::from(is_falsely_valid(off_mdeg, of_angle, health));
    }

    /// Adds that there was no estimate, of a filter that has no health.
    pub fn no_estimate(&mut self) {
        self.missing += 1;
    }

    /// Adds the innovation of a measurement.
    pub fn innovation<T: Real>(&mut self, innovation: &Innovation<T>) {
        self.offered += 1;
        match innovation.verdict {
            Verdict::Rejected(_) => self.rejected += 1,
            Verdict::Restarted => self.restarts += 1,
            Verdict::Used => {}
        }
        if innovation.source == Source::Camera {
            let squared = innovation.normalised_squared().filter(|_| innovation.verdict == Verdict::Used);
            match squared.map(Real::to_f64) {
                Some(squared) => {
                    let sign = if innovation.innovation_rad < T::zero() { -1.0 } else { 1.0 };
                    self.camera.add(sign * math::sqrt(squared));
                }
                None => self.camera.last = None,
            }
        }
    }

    /// Adds the innovations of an impact. What comes between two impacts that were used does not separate them.
    pub fn impact<T: Real>(&mut self, innovation: &ImpactInnovation<T>) {
        let refused = innovation.verdict != Verdict::Used;
        let [all, not_used] = &mut self.impacts;
        *all += 1;
        *not_used += u64::from(refused);
        if refused {
            return;
        }
        let contact = &innovation.contact;
        let values = [contact.gap_m, contact.approach_m_s].map(Real::to_f64);
        let squares = contact.normalised_squared().map(Real::to_f64);
        for ((sums, value), squared) in self.contact.iter_mut().zip(values).zip(squares) {
            sums.add(math::sqrt(squared).copysign(value));
        }
    }

    /// Ends a phase: the next innovation is no neighbour of the last one.
    pub fn interrupt(&mut self) {
        self.camera.last = None;
        self.contact.iter_mut().for_each(|sums| sums.last = None);
    }

    /// Adds the sums of another run.
    pub fn absorb(&mut self, other: &Self) {
        self.errors_mdeg.extend_from_slice(&other.errors_mdeg);
        self.square_mdeg2 += other.square_mdeg2;
        self.square_rad2_s2 += other.square_rad2_s2;
        (self.normalised.iter_mut().zip(other.normalised)).for_each(|(sum, more)| *sum += more);
        self.missing += other.missing;
        (self.health.iter_mut().zip(other.health)).for_each(|(sum, more)| *sum += more);
        self.false_valid += other.false_valid;
        self.stated.absorb(&other.stated);
        self.camera.absorb(&other.camera);
        (self.contact.iter_mut().zip(&other.contact)).for_each(|(sums, more)| sums.absorb(more));
        (self.impacts.iter_mut().zip(other.impacts)).for_each(|(sum, more)| *sum += more);
        self.offered += other.offered;
        self.rejected += other.rejected;
        self.restarts += other.restarts;
    }

    /// Root mean square of the angle's error in milli-degrees.
    pub fn rms_angle_mdeg(&self) -> f64 {
        math::sqrt(self.square_mdeg2 / self.samples())
    }

    /// Magnitude of the angle's error in milli-degrees that 99.9 % of the samples do not exceed.
    pub fn p999_angle_mdeg(&self) -> f64 {
        upper_quantile(&mut self.errors_mdeg.clone(), 999).unwrap_or(f64::NAN)
    }

    /// Root mean square of the rate's error in rad/s.
    pub fn rms_rate_rad_s(&self) -> f64 {
        math::sqrt(self.square_rad2_s2 / self.samples())
    }

    /// Shares of the time in which the health was good, degraded, unusable (waiting included), and in which it was good
    /// and the estimate wrong by more than six standard deviations and 50 milli-degrees; no numbers without any health.
    pub fn health(&self) -> ([f64; 3], f64) {
        let all = real(self.health.iter().sum::<u64>());
        (self.health.map(|count| real(count) / all), real(self.false_valid) / all)
    }

    /// Errors of the angle beside what is stated of them.
    pub fn stated(&self) -> StatedErrors {
        self.stated.figures()
    }

    /// Mean squared error of angle and of rate, each per its variance, and of both together, `e' P^-1 e / 2`: 1 each in
    /// a consistent filter.
    pub fn normalised(&self) -> [f64; 3] {
        self.normalised.map(|sum| sum / self.samples())
    }

    /// Share of the samples for which there was no estimate.
    pub fn missing(&self) -> f64 {
        let missing = real(self.missing);
        missing / (missing + self.samples())
    }

    /// Mean square per variance of the camera's innovations that were used, and the correlation of neighbours.
    pub fn innovations(&self) -> (f64, f64) {
        self.camera.figures()
    }

    /// The same of gap and of approach at impacts.
    pub fn contact_innovations(&self) -> [(f64, f64); 2] {
        self.contact.each_ref().map(InnovationSums::figures)
    }

    /// Share of the impacts that the filter's model did not explain; not a number where it was not asked.
    pub fn impacts_refused(&self) -> f64 {
        let [all, refused] = self.impacts.map(real);
        refused / all
    }

    /// Share of the measurements that were rejected.
    pub fn rejected(&self) -> f64 {
        real(self.rejected) / real(self.offered.max(1))
    }

    fn samples(&self) -> f64 {
        real(self.errors_mdeg.len())
    }
}

impl InnovationSums {
    /// Mean square, and the correlation of neighbours.
    fn figures(&self) -> (f64, f64) {
        (self.square / real(self.count), self.lagged / self.squares_before)
    }

    fn add(&mut self, normalised: f64) {
        self.count += 1;
        self.square += normalised * normalised;
        if let Some(last) = self.last.replace(normalised) {
            self.lagged += last * normalised;
            self.squares_before += last * last;
        }
    }

    fn absorb(&mut self, other: &Self) {
        self.count += other.count;
        self.square += other.square;
        self.lagged += other.lagged;
        self.squares_before += other.squares_before;
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator::{ContactInnovation, Reason, Rejection};
    use motor_model::Time;

    fn estimate(degrees: f64, rate_rad_s: f64) -> Estimate<f64> {
        Estimate {
            at: Time::ZERO,
            angle: Angle::from_degrees(degrees),
            rate_rad_s,
            angle_rad2: 1e-6,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 4.0,
            resting: false,
        }
    }

    fn innovation(innovation_rad: f64, verdict: Verdict) -> Innovation<f64> {
        Innovation {
            source: Source::Camera,
            taken_at: Time::ZERO,
            innovation_rad,
            variance_rad2: 4.0,
            verdict,
        }
    }

    /// Errors of 3 and -4 milli-degrees, of 1 and 3 rad/s.
    #[test]
    fn exact_root_mean_squares_and_normalised_errors() {
        let mut sums = ErrorSums::default();
        sums.estimate::<f64>(None, Health::Waiting, Angle::ZERO, 0.0);
        sums.estimate(Some(&estimate(90.003, 1.0)), Health::Good, Angle::from_degrees(90.0), 0.0);
        sums.estimate(Some(&estimate(-720.004, -5.0)), Health::Good, Angle::from_degrees(-720.0), -2.0);
        assert!((sums.rms_angle_mdeg() - math::sqrt(12.5)).abs() < 1e-3);
        assert!((sums.rms_rate_rad_s() - math::sqrt(5.0)).abs() < 1e-12);
        let [angle, rate, _] = sums.normalised();
        let mdeg_rad = 1e-3_f64.to_radians();
        assert!((angle - 12.5 * mdeg_rad * mdeg_rad / 1e-6).abs() < 1e-6, "{angle}");
        assert!((rate - 5.0 / 4.0).abs() < 1e-12);
        assert!((sums.missing() - 1.0 / 3.0).abs() < 1e-12);
    }

    /// An error of half a standard deviation of the angle, none of the rate, correlated by 0.6: `0.25 / (1 - 0.36) /
    /// 2`.
    #[test]
    fn exact_joint_error_includes_the_correlation() {
        let mut sums = ErrorSums::default();
        let off = 0.5e-3_f64.to_degrees();
        let correlated = Estimate { angle_rate_rad2_s: 0.6 * 1e-3 * 2.0, ..estimate(off, 0.0) };
        sums.estimate(Some(&correlated), Health::Good, Angle::ZERO, 0.0);
        let [.., joint] = sums.normalised();
        assert!((joint - 0.25 / 0.64 / 2.0).abs() < 1e-5, "{joint}");
    }

    /// Moments whose correlation rounding in f32 has made more than 1: the square of an error is not negative.
    #[test]
    fn exact_moments_that_are_rounded_to_no_covariance_have_a_square() {
        for off_rad_s in [-2.0, 0.0, 2.0] {
            let mut sums = ErrorSums::default();
            let above_one = 1.0 + f64::from(f32::EPSILON);
            let rounded = Estimate { angle_rate_rad2_s: above_one * 1e-3 * 2.0, ..estimate(0.05, off_rad_s) };
            sums.estimate(Some(&rounded), Health::Good, Angle::ZERO, 0.0);
            let [.., joint] = sums.normalised();
            assert!(joint >= 0.0 && joint.is_finite(), "{joint}");
        }
    }

    /// Wrong is beyond six standard deviations (of 57.3 milli-degrees here). A wrong estimate without good health is
    /// not falsely valid.
    #[test]
    fn exact_shares_of_health() {
        let mut sums = ErrorSums::default();
        for (degrees, health) in [
            (0.34, Health::Good),
            (0.35, Health::Good),
            (0.35, Health::Degraded(Reason::CameraSilent)),
            (0.35, Health::Unusable(Reason::Uncertain)),
        ] {
            sums.estimate(Some(&estimate(degrees, 0.0)), health, Angle::ZERO, 0.0);
        }
        let ([good, degraded, unusable], wrong) = sums.health();
        for (share, expected) in [(good, 0.5), (degraded, 0.25), (unusable, 0.25), (wrong, 0.25)] {
            assert!((share - expected).abs() < 1e-12, "{share} {expected}");
        }
    }

    /// A filter that never had an estimate, nor a health, has neither shares nor errors.
    #[test]
    fn exact_without_an_estimate_nothing_is_good() {
        let mut sums = ErrorSums::default();
        sums.no_estimate();
        let ([good, ..], wrong) = sums.health();
        assert!(good.is_nan() && wrong.is_nan() && sums.rms_angle_mdeg().is_nan());
        assert_eq!((sums.stated().beyond_3_sigma, sums.missing()), (None, 1.0));
    }

    /// Of 2,000 errors, two are larger than the 99.9 % quantile.
    #[test]
    fn exact_quantile() {
        let mut sums = ErrorSums::default();
        for n in 1..=2000_u32 {
            sums.estimate(Some(&estimate(1e-3 * f64::from(n), 0.0)), Health::Good, Angle::ZERO, 0.0);
        }
        assert!((sums.p999_angle_mdeg() - 1999.0).abs() < 1e-2, "{}", sums.p999_angle_mdeg());
    }

    /// Gaps of 2, -2, 4 over a deviation of 2 and approaches of 1 over 1, with an impact that was not explained between
    /// them: it counts as refused, and in no mean.
    #[test]
    fn exact_innovations_of_impacts() {
        let mut sums = ErrorSums::default();
        let impact = |gap_m: f64, verdict| ImpactInnovation {
            taken_at: Time::ZERO,
            contact: ContactInnovation { gap_m, gap_m2: 4.0, approach_m_s: 1.0, approach_m2_s2: 1.0 },
            verdict,
        };
        for gap_m in [2.0, -2.0] {
            sums.impact(&impact(gap_m, Verdict::Used));
        }
        sums.impact(&impact(100.0, Verdict::Rejected(Rejection::Gate)));
        sums.impact(&impact(4.0, Verdict::Used));
        let [gap, approach] = sums.contact_innovations();
        assert_eq!(gap, ((1.0 + 1.0 + 4.0) / 3.0, (-1.0 - 2.0) / (1.0 + 1.0)));
        assert_eq!(approach, (1.0, 1.0));
        assert!((sums.impacts_refused() - 0.25).abs() < 1e-12);
        assert!(ErrorSums::default().impacts_refused().is_nan());
    }

    /// 2, -2, 4 over a deviation of 2: squares 1, 1, 4, neighbours -1 - 2 over 1 + 1. A rejected frame separates
    /// neighbours.
    #[test]
    fn exact_innovations() {
        let mut sums = ErrorSums::default();
        for value in [2.0, -2.0, 4.0] {
            sums.innovation(&innovation(value, Verdict::Used));
        }
        sums.innovation(&innovation(50.0, Verdict::Rejected(Rejection::Gate)));
        sums.innovation(&innovation(2.0, Verdict::Used));
        let (nis, whiteness) = sums.innovations();
        assert!((nis - 7.0 / 4.0).abs() < 1e-12);
        assert!((whiteness + 1.5).abs() < 1e-12, "{whiteness}");
        assert!((sums.rejected() - 0.2).abs() < 1e-12);
    }
}
