//! One calibration: a gyroscope on the run of a motor, and what became of it.

use motor_model::{Angle, math};
use serde::{Deserialize, Serialize};

use super::fit::{CalibrationFit, FitInterval};
use super::turning::{Anchor, TurningRun};
use simulation::math::count::real;
use simulation::math::statistics::NORMAL_95;
use simulation::world::instruments::gyroscope::noise::{SECONDS_PER_HOUR, TimeSpan};
use simulation::world::instruments::gyroscope::{Gyroscope, GyroscopeNoise, GyroscopeSample};

/// 95 % of chi-square with two degrees of freedom: `-2 ln 0.05`.
const PAIR_95: f64 = 5.991_465;

/// What became of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationOutcome {
    /// Seed of the run: the motor.
    pub seed: u64,
    /// Which gyroscope (`gyroscope.serial`).
    pub serial: u64,
    /// Motor time.
    pub motor_time_s: f64,
    /// Scale-factor error found.
    pub scale_factor_ppm: f64,
    /// Found less true. True is the scale factor at the middle of the plan: it changes while the gyroscope warms up.
    pub scale_factor_error_ppm: f64,
    /// Its standard deviation; 1.96 of it to either side are the 95 % interval.
    pub scale_factor_sigma_ppm: f64,
    /// What coning makes of that error: the gyroscope turns about the rotor's own axis, the reference is the angle seen
    /// from above.
    pub scale_factor_coning_ppm: f64,
    /// What the error of the reference makes of it.
    pub scale_factor_reference_ppm: f64,
    /// What the gyroscope's noise and its other errors make of it: the rest.
    pub scale_factor_noise_ppm: f64,
    /// Bias found.
    pub bias_deg_h: f64,
    /// Found less true.
    pub bias_error_deg_h: f64,
    /// Its standard deviation.
    pub bias_sigma_deg_h: f64,
    /// What coning, the error of the reference and the gyroscope's noise make of that error.
    pub bias_coning_deg_h: f64,
    /// See above.
    pub bias_reference_deg_h: f64,
    /// See above.
    pub bias_noise_deg_h: f64,
    /// Correlation of both errors, as the fit states it.
    pub correlation: f64,
    /// Square of the distance of the true pair in standard deviations, correlation included.
    pub pair_distance_square: f64,
    /// Standard deviation of the bias that the gyroscope's random walk allows in this time, at rest.
    pub walk_bias_sigma_deg_h: f64,
    /// Standard deviation of the scale factor that the gyroscope's random walk allows at these rates, with an exact
    /// reference and without saturation: see [`super::schedule`].
    pub walk_scale_factor_sigma_ppm: f64,
    /// Factor on the filter's variances of the reference that makes the residuals as large as the fit says, at least 1.
    pub reference_factor: f64,
    /// Intervals fitted.
    pub intervals: usize,
    /// Intervals left out because a sample in them was saturated.
    pub saturated_intervals: usize,
    /// Root mean square error of the reference at the ends of the intervals.
    pub reference_rms_mdeg: f64,
    /// Share of the ends of the intervals at which the reference is off by more than three standard deviations that the
    /// filter states.
    pub reference_beyond_3_sigma: f64,
    /// Ends at which it is called good and is off by more than five.
    pub reference_good_beyond_5_sigma: u64,
    /// The largest error of these.
    pub reference_good_beyond_5_sigma_worst_mdeg: f64,
    /// Its place among all calibrations.
    pub number: u64,
}

impl CalibrationOutcome {
    /// Error of the scale factor in its standard deviations.
    pub fn scale_factor_sigmas(&self) -> f64 {
        self.scale_factor_error_ppm.abs() / self.scale_factor_sigma_ppm
    }

    /// Whether the 95 % interval of the scale factor holds the truth.
    pub fn covers_scale_factor(&self) -> bool {
        self.scale_factor_error_ppm.abs() <= NORMAL_95 * self.scale_factor_sigma_ppm
    }

    /// Whether that of the bias does.
    pub fn covers_bias(&self) -> bool {
        self.bias_error_deg_h.abs() <= NORMAL_95 * self.bias_sigma_deg_h
    }

    /// Whether the 95 % ellipse of both does.
    pub fn covers_pair(&self) -> bool {
        self.pair_distance_square <= PAIR_95
    }
}

/// A calibration with its intervals and its fit.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// What became of it.
    pub outcome: CalibrationOutcome,
    /// The intervals between the anchors, in order, and whether each is left out.
    pub intervals: Vec<(FitInterval, bool)>,
    /// The gyroscope's mean rate over each twentieth of a second: middle in s, deg/s.
    pub rates_deg_s: Vec<(f64, f64)>,
    pub(super) fit: CalibrationFit,
    pub(super) noise: GyroscopeNoise,
}

impl Calibration {
    /// Calibration `number`: of `gyroscope`, whose serial is given, on the run of a motor; `None` where scale factor
    /// and bias cannot be told apart.
    pub(super) fn of(
        gyroscope: &mut Gyroscope,
        (number, serial): (u64, u64),
        turning: &TurningRun,
        motor_time_s: f64,
    ) -> Option<Self> {
        let noise = gyroscope.noise();
        let samples: Vec<_> = turning.turns().map(|turn| gyroscope.sample(&turn)).collect();
        let time_s = |sample: usize| real(sample) * noise.period_s;
        let interval = |pair: &[Anchor]| {
            let [from, until] = [pair[0], pair[1]];
            let within = &samples[from.sample..until.sample];
            let interval = FitInterval {
                span: TimeSpan { from_s: time_s(from.sample), until_s: time_s(until.sample) },
                shown_deg: within.iter().map(|sample| sample.turned_deg).sum(),
                turned_deg: until.angle.minus(from.angle).degrees(),
                variances_deg2: (from.variance_deg2, until.variance_deg2),
            };
            (interval, within.iter().any(|sample| sample.saturated))
        };
        let intervals: Vec<_> = turning.anchors.windows(2).map(interval).collect();
        let kept_intervals: Vec<FitInterval> =
            intervals.iter().filter(|(_, saturated)| !saturated).map(|(interval, _)| *interval).collect();
        let fit = CalibrationFit::to(&kept_intervals, &noise)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
        let chunk = (0.05 / noise.period_s).round().max(1.0) as usize;
        let mean = |(index, chunk_of): (usize, &[GyroscopeSample])| {
            let turned_deg: f64 = chunk_of.iter().map(|sample| sample.turned_deg).sum();
            let length_s = time_s(chunk_of.len());
            (time_s(index * chunk) + 0.5 * length_s, turned_deg / length_s)
        };
        let rates_deg_s = samples.chunks(chunk).enumerate().map(mean).collect();
        let (ppm, deg_h) = (1e6, SECONDS_PER_HOUR);
        let (true_scale, true_bias_deg_s) = {
            let (errors, middle_s) = (gyroscope.errors(), 0.5 * motor_time_s);
            (errors.scale_at(middle_s), errors.bias_deg_s_at(middle_s))
        };
        let differences = differences(turning);
        let part = |of: fn(&TurnDifference) -> f64| {
            let kept = differences.iter().zip(&intervals).filter(|(_, (_, saturated))| !saturated);
            fit.part(&kept_intervals, &noise, kept.map(|(difference, _)| (1.0 + true_scale) * of(difference)))
        };
        let [coning, reference] = [part(|turn| turn.coning_deg)?, part(|turn| turn.reference_deg)?];
        let errors = [fit.scale - true_scale, fit.bias_deg_s - true_bias_deg_s];
        let rest = [0, 1].map(|of| errors[of] - coning[of] - reference[of]);
        let stated = turning.reference_stated();
        let outcome = CalibrationOutcome {
            number,
            seed: turning.seed,
            serial,
            motor_time_s,
            scale_factor_ppm: ppm * fit.scale,
            scale_factor_error_ppm: ppm * errors[0],
            scale_factor_coning_ppm: ppm * coning[0],
            scale_factor_reference_ppm: ppm * reference[0],
            scale_factor_noise_ppm: ppm * rest[0],
            scale_factor_sigma_ppm: ppm * fit.scale_sigma(),
            bias_deg_h: deg_h * fit.bias_deg_s,
            bias_error_deg_h: deg_h * errors[1],
            bias_coning_deg_h: deg_h * coning[1],
            bias_reference_deg_h: deg_h * reference[1],
            bias_noise_deg_h: deg_h * rest[1],
            bias_sigma_deg_h: deg_h * fit.bias_sigma_deg_s(),
            correlation: fit.correlation(),
            pair_distance_square: fit.distance_square(true_scale, true_bias_deg_s),
            walk_bias_sigma_deg_h: deg_h * noise.walk_bias_deg_s(motor_time_s),
            walk_scale_factor_sigma_ppm: ppm * walk_scale_sigma(&intervals, &noise),
            reference_factor: fit.reference_factor,
            intervals: kept_intervals.len(),
            saturated_intervals: intervals.len() - kept_intervals.len(),
            reference_rms_mdeg: turning.reference_rms_mdeg(),
            reference_beyond_3_sigma: stated.beyond_3_sigma,
            reference_good_beyond_5_sigma: stated.good_beyond_5_sigma,
            reference_good_beyond_5_sigma_worst_mdeg: stated.good_beyond_5_sigma_worst_mdeg,
        };
        Some(Self { outcome, intervals, rates_deg_s, fit, noise })
    }
}

/// How the turn of an interval differs from that of the reference, but for the gyroscope's errors, in degrees.
struct TurnDifference {
    /// The turn about the rotor's own axis less the one seen from above.
    coning_deg: f64,
    /// The true turn seen from above less that of the reference.
    reference_deg: f64,
}

/// Those of all intervals.
fn differences(turning: &TurningRun) -> Vec<TurnDifference> {
    let turn = |of: &[Angle], pair: &[Anchor]| of[pair[1].sample].minus(of[pair[0].sample]).degrees();
    let difference = |pair: &[Anchor]| {
        let seen_deg = turn(&turning.truth, pair);
        TurnDifference {
            coning_deg: turn(&turning.sensed, pair) - seen_deg,
            reference_deg: seen_deg - pair[1].angle.minus(pair[0].angle).degrees(),
        }
    };
    turning.anchors.windows(2).map(difference).collect()
}

/// Standard deviation of the scale factor that random walk alone allows at the rates of all intervals.
fn walk_scale_sigma(intervals: &[(FitInterval, bool)], noise: &GyroscopeNoise) -> f64 {
    let sum = |of: fn(&FitInterval) -> f64| intervals.iter().map(|(interval, _)| of(interval)).sum::<f64>();
    let (length_s, turned_deg) = (sum(|i| i.span.length_s()), sum(|i| i.turned_deg));
    let squares = sum(|i| i.turned_deg * i.turned_deg / i.span.length_s());
    noise.walk_deg_rs / math::sqrt(squares - turned_deg * turned_deg / length_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line through rates 0, 100 and -50 deg/s over 1, 2 and 1 s: `S = sum r^2 T - (sum r T)^2 / sum T =
    /// 22,500 - 150^2 / 4`, which is `37.5^2 + 2 62.5^2 + 87.5^2` about the mean rate of 37.5 deg/s. Intervals that are
    /// left out count too.
    #[test]
    fn exact_random_walk_bounds_the_scale_factor_by_the_spread_of_the_rates() {
        let noise = GyroscopeNoise {
            period_s: 2e-3,
            walk_deg_rs: 2.5e-3,
            drift_deg_s: 0.0,
            drift_time_s: 200.0,
            resolution_deg: 0.0,
        };
        let interval = |from_s: f64, until_s: f64, turned_deg: f64| FitInterval {
            span: TimeSpan { from_s, until_s },
            shown_deg: turned_deg,
            turned_deg,
            variances_deg2: (0.0, 0.0),
        };
        let all = [
            (interval(0.0, 1.0, 0.0), false),
            (interval(1.0, 3.0, 200.0), true),
            (interval(3.0, 4.0, -50.0), false),
        ];
        let spread_deg2_s = 37.5_f64 * 37.5 + 2.0 * 62.5 * 62.5 + 87.5 * 87.5;
        let expected = 2.5e-3 / math::sqrt(spread_deg2_s);
        assert!((walk_scale_sigma(&all, &noise) / expected - 1.0).abs() < 1e-12);
    }
}
