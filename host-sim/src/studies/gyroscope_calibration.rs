//! `host-sim calibrate`: scale factor and bias of a gyroscope on the rotor, found in closed loop, against the truth.
//!
//! In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | [`schedule`] | the plan: rests, and turns to either side at a staircase of rates |
//! | [`turning`] | the motor led through it by the rate controller; the reference is what its estimator says |
//! | [`crate::world::instruments::gyroscope`] | what the gyroscope makes of the rotor's true angle meanwhile |
//! | [`fit`] | generalised least squares: scale factor and bias with their covariance |
//!
//! The reference is good to some 5 milli-degrees as the rotor turns and to 0.5 at rest, and every interval shares it with the next, so that in a minute the gyroscope's random walk is what counts:
//! 0.15 deg/sqrt(h) are 19 milli-degrees then, 1.2 deg/h of bias. Nothing in the fit knows the truth; it knows the gyroscope's data sheet (its noise, not its errors) and the filter's variances.
//!
//! # Many calibrations
//!
//! The gyroscope does not act back on the motor, so that any number of gyroscopes can be looked at on one run of a motor: run `i` of `n` is the gyroscope with serial `i / m` on motor `i mod m`, of `m` motors that the
//! seed and those that follow it name. What they share is the error of the reference, a small part of the whole.

pub mod fit;
mod picture;
pub mod schedule;
mod tables;
pub mod turning;

use motor_model::{Angle, math};
use rayon::prelude::*;
use serde::Serialize;

use crate::math::allan_deviation;
use crate::math::statistics::{NORMAL_95, binomial_bounds, root_mean_square};
use crate::scene::{Scene, SceneError};
use crate::studies::StudyError;
use crate::world::instruments::gyroscope::{Errors, Gyroscope, Noise, noise::SECONDS_PER_HOUR, noise::Span};
use fit::{Fit, Interval};
pub use schedule::Schedule;
use turning::Turning;

/// 95 % of chi-square with two degrees of freedom: `-2 ln 0.05`.
const PAIR_95: f64 = 5.991_465;
/// Length of the record at rest behind the picture's Allan deviation.
const AT_REST_S: f64 = 3600.0;

/// What became of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Seed of the run: the motor.
    pub seed: u64,
    /// Which gyroscope (`gyroscope.serial`).
    pub serial: u64,
    /// Motor time.
    pub motor_time_s: f64,
    /// Scale-factor error found.
    pub scale_factor_ppm: f64,
    /// Found less true.
    pub scale_factor_error_ppm: f64,
    /// Its standard deviation; 1.96 of it to either side are the 95 % interval.
    pub scale_factor_sigma_ppm: f64,
    /// Bias found.
    pub bias_deg_h: f64,
    /// Found less true.
    pub bias_error_deg_h: f64,
    /// Its standard deviation.
    pub bias_sigma_deg_h: f64,
    /// Correlation of the two errors, as the fit states it.
    pub correlation: f64,
    /// Square of the distance of the true pair in standard deviations, correlation included.
    pub pair_distance_square: f64,
    /// Standard deviation of the bias that the gyroscope's random walk allows in this time, at rest.
    pub walk_bias_sigma_deg_h: f64,
    /// Standard deviation of the scale factor that the gyroscope's random walk allows at the rates that were turned, if the reference were exact and nothing saturated: see [`schedule`].
    pub walk_scale_factor_sigma_ppm: f64,
    /// Factor by which the filter's variances of the reference had to be raised for the residuals to be as large as they should; 1 where they need not be.
    pub reference_factor: f64,
    /// Intervals fitted.
    pub intervals: usize,
    /// Intervals left out, because a sample in them was saturated.
    pub saturated_intervals: usize,
    /// Root mean square error of the reference at the ends of the intervals.
    pub reference_rms_mdeg: f64,
}

impl Outcome {
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

/// A calibration with all that led to it.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// What became of it.
    pub outcome: Outcome,
    /// Between the anchors, in order: fitted, and (with `true`) left out.
    pub intervals: Vec<(Interval, bool)>,
    /// The gyroscope's mean rate over each twentieth of a second: middle in s, deg/s.
    pub rates_deg_s: Vec<(f64, f64)>,
    fit: Fit,
    noise: Noise,
}

/// Calibrations to be made.
#[derive(Clone, Debug)]
pub struct Plan {
    scene: Scene,
    schedule: Schedule,
    motors: u64,
    runs: u64,
}

/// What came out, by run.
#[derive(Clone, Debug)]
pub struct Calibrations {
    /// The first, with all that led to it.
    pub first: Calibration,
    /// The motor's run behind it.
    pub turning: Turning,
    /// Allan deviation of the first gyroscope, an hour at rest: span in s, deg/h seen, deg/h of the model.
    pub allan_deg_h: Vec<(f64, f64, f64)>,
    /// All outcomes, the first's included.
    pub outcomes: Vec<Outcome>,
    /// Motors that they are spread over.
    pub motors: u64,
    schedule: Schedule,
}

impl Plan {
    /// `runs` calibrations over `motors` motors, at most one motor a calibration.
    ///
    /// # Errors
    /// When the plan of the scene is refused.
    pub fn new(scene: &Scene, runs: u64, motors: u64) -> Result<Self, StudyError> {
        Ok(Self { scene: scene.clone(), schedule: Schedule::of(scene)?, motors: motors.min(runs), runs })
    }

    /// Motors that will run: what progress is measured in.
    pub fn motors(&self) -> u64 {
        self.motors
    }

    /// Runs everything, telling `progress` of each motor done with; the order of the threads does not show.
    ///
    /// # Errors
    /// When a scene is refused, or a run tells nothing.
    pub fn run(&self, progress: &(impl Fn() + Sync)) -> Result<Calibrations, StudyError> {
        let motor = |number: u64| {
            let mut scene = self.scene.clone();
            scene.set("seed", &self.scene.seed().wrapping_add(number).to_string())?;
            let turning = Turning::run(&scene, &self.schedule)?;
            let runs = (number..self.runs).step_by(usize::try_from(self.motors).unwrap_or(usize::MAX));
            let calibrations = runs.map(|run| self.calibrate(&mut scene, run, &turning));
            let mut calibrations = calibrations.collect::<Result<Vec<_>, StudyError>>()?;
            progress();
            let outcomes: Vec<Outcome> = calibrations.iter().map(|c| c.outcome.clone()).collect();
            Ok((outcomes, (number == 0).then(|| (calibrations.swap_remove(0), turning))))
        };
        let numbers: Vec<u64> = (0..self.motors).collect();
        let of_motors: Result<Vec<_>, StudyError> =
            numbers.into_par_iter().with_max_len(1).map(motor).collect();
        let mut of_motors = of_motors?;
        let first = of_motors.first_mut().and_then(|(_, first)| first.take());
        // There is a motor, and the first has a run.
        let (first, turning) = first.ok_or_else(nothing_told)?;
        let mut by_motor: Vec<_> = of_motors.into_iter().map(|(outcomes, _)| outcomes.into_iter()).collect();
        let mut outcomes = Vec::new();
        while let Some(round) =
            by_motor.iter_mut().map(Iterator::next).take_while(Option::is_some).collect::<Option<Vec<_>>>()
            && !round.is_empty()
        {
            outcomes.extend(round);
        }
        Ok(Calibrations {
            first,
            turning,
            allan_deg_h: at_rest(&self.scene),
            outcomes,
            motors: self.motors,
            schedule: self.schedule,
        })
    }

    /// The calibration of the gyroscope of `run` on its motor.
    fn calibrate(&self, scene: &mut Scene, run: u64, turning: &Turning) -> Result<Calibration, StudyError> {
        let serial = self.scene.integer("gyroscope.serial") + run / self.motors;
        scene.set("gyroscope.serial", &serial.to_string())?;
        let mut gyroscope = Gyroscope::new(scene);
        Calibration::of(&mut gyroscope, serial, turning, self.schedule.duration_s()).ok_or_else(nothing_told)
    }
}

fn nothing_told() -> StudyError {
    SceneError::Conflict {
        conflict: "this run does not tell scale factor from bias".to_owned(),
        hint: "it needs intervals of different rates without saturation, and a gyroscope or a camera with noise: see calibrate. and gyroscope. in `host-sim keys`"
            .to_owned(),
    }
    .into()
}

impl Calibration {
    /// Of `gyroscope` on the motor that turned; `None` where that does not tell scale factor from bias.
    fn of(gyroscope: &mut Gyroscope, serial: u64, turning: &Turning, motor_time_s: f64) -> Option<Self> {
        let noise = gyroscope.noise();
        let samples: Vec<_> =
            turning.truth.windows(2).map(|pair| gyroscope.sample(pair[1].minus(pair[0]).degrees())).collect();
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let time_s = |sample: usize| sample as f64 * noise.period_s;
        let interval = |pair: &[turning::Anchor]| {
            let [from, until] = [pair[0], pair[1]];
            let within = &samples[from.sample..until.sample];
            let interval = Interval {
                span: Span { from_s: time_s(from.sample), until_s: time_s(until.sample) },
                shown_deg: within.iter().map(|sample| sample.turned_deg).sum(),
                turned_deg: until.angle.minus(from.angle).degrees(),
                variances_deg2: (from.variance_deg2, until.variance_deg2),
            };
            (interval, within.iter().any(|sample| sample.saturated))
        };
        let intervals: Vec<_> = turning.anchors.windows(2).map(interval).collect();
        let kept: Vec<Interval> =
            intervals.iter().filter(|(_, saturated)| !saturated).map(|(interval, _)| *interval).collect();
        let fit = Fit::to(&kept, &noise)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
        let chunk = (0.05 / noise.period_s).round().max(1.0) as usize;
        let mean = |(index, chunk_of): (usize, &[crate::world::instruments::gyroscope::Sample])| {
            let turned_deg: f64 = chunk_of.iter().map(|sample| sample.turned_deg).sum();
            let length_s = time_s(chunk_of.len());
            (time_s(index * chunk) + 0.5 * length_s, turned_deg / length_s)
        };
        let rates_deg_s = samples.chunks(chunk).enumerate().map(mean).collect();
        let outcome = Outcome::of(&fit, gyroscope.errors(), &noise, motor_time_s);
        let outcome = Outcome {
            seed: turning.seed,
            serial,
            walk_scale_factor_sigma_ppm: 1e6 * walk_scale_sigma(&intervals, &noise),
            intervals: kept.len(),
            saturated_intervals: intervals.len() - kept.len(),
            reference_rms_mdeg: turning.reference_rms_mdeg(),
            ..outcome
        };
        Some(Self { outcome, intervals, rates_deg_s, fit, noise })
    }
}

impl Outcome {
    fn of(fit: &Fit, truth: Errors, noise: &Noise, motor_time_s: f64) -> Self {
        let (ppm, deg_h) = (1e6, SECONDS_PER_HOUR);
        Self {
            seed: 0,
            serial: 0,
            motor_time_s,
            scale_factor_ppm: ppm * fit.scale,
            scale_factor_error_ppm: ppm * (fit.scale - truth.scale),
            scale_factor_sigma_ppm: ppm * fit.scale_sigma(),
            bias_deg_h: deg_h * fit.bias_deg_s,
            bias_error_deg_h: deg_h * (fit.bias_deg_s - truth.bias_deg_s),
            bias_sigma_deg_h: deg_h * fit.bias_sigma_deg_s(),
            correlation: fit.correlation(),
            pair_distance_square: fit.distance_square(truth.scale, truth.bias_deg_s),
            walk_bias_sigma_deg_h: deg_h * noise.walk_bias_deg_s(motor_time_s),
            walk_scale_factor_sigma_ppm: 0.0,
            reference_factor: fit.reference_factor,
            intervals: 0,
            saturated_intervals: 0,
            reference_rms_mdeg: 0.0,
        }
    }
}

/// Standard deviation of the scale factor that random walk alone allows at the rates of all intervals.
fn walk_scale_sigma(intervals: &[(Interval, bool)], noise: &Noise) -> f64 {
    let sum = |of: fn(&Interval) -> f64| intervals.iter().map(|(interval, _)| of(interval)).sum::<f64>();
    let (length_s, turned_deg) = (sum(|i| i.span.length_s()), sum(|i| i.turned_deg));
    let squares = sum(|i| i.turned_deg * i.turned_deg / i.span.length_s());
    noise.walk_deg_rs / math::sqrt(squares - turned_deg * turned_deg / length_s)
}

/// Allan deviation of the scene's gyroscope at rest: span in s, deg/h seen, deg/h of the model.
fn at_rest(scene: &Scene) -> Vec<(f64, f64, f64)> {
    let mut gyroscope = Gyroscope::new(scene);
    let noise = gyroscope.noise();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 3.6e7")]
    let count = (AT_REST_S / noise.period_s) as usize;
    let still = Angle::ZERO.degrees();
    let angles: Vec<f64> = (0..count)
        .scan(0.0, |angle_deg, _| {
            *angle_deg += gyroscope.sample(still).turned_deg;
            Some(*angle_deg)
        })
        .collect();
    let of = |samples: usize| {
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let span_s = samples as f64 * noise.period_s;
        let seen = allan_deviation::deviation_deg_s(&angles, noise.period_s, samples)?;
        Some((span_s, SECONDS_PER_HOUR * seen, SECONDS_PER_HOUR * noise.allan_deviation_deg_s(span_s)))
    };
    allan_deviation::spans(angles.len(), 8).into_iter().filter_map(of).collect()
}

/// Figures over all runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Calibrations.
    pub runs: usize,
    /// Motors.
    pub motors: u64,
    /// Root mean square error of the scale factor.
    pub scale_factor_rms_ppm: f64,
    /// The same as the fits state it.
    pub scale_factor_stated_ppm: f64,
    /// The largest error.
    pub scale_factor_worst_ppm: f64,
    /// The same as random walk alone allows at the rates that were turned.
    pub scale_factor_walk_ppm: f64,
    /// Runs within 10 ppm of the truth.
    pub scale_factor_within_10_ppm: usize,
    /// Runs whose 95 % interval of the scale factor holds the truth.
    pub scale_factor_covered: usize,
    /// Root mean square error of the bias.
    pub bias_rms_deg_h: f64,
    /// The same as the fits state it.
    pub bias_stated_deg_h: f64,
    /// The largest error.
    pub bias_worst_deg_h: f64,
    /// Root mean square error of the bias per what random walk allows in the time.
    pub bias_over_walk: f64,
    /// Runs whose 95 % interval of the bias holds the truth.
    pub bias_covered: usize,
    /// Runs whose 95 % ellipse of both holds the truth.
    pub pair_covered: usize,
    /// Two-sided 95 % bounds of such counts, if the probability is 95 %.
    pub covered_bounds: (u32, u32),
    /// Mean of the factors by which the reference's variances were raised.
    pub reference_factor: f64,
    /// Intervals left out for saturation, of all.
    pub saturated: f64,
    /// Root mean square error of the reference.
    pub reference_rms_mdeg: f64,
}

impl Calibrations {
    /// Figures over all runs.
    pub fn summary(&self) -> Summary {
        let all = &self.outcomes;
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let count = all.len().max(1) as f64;
        let mean = |of: fn(&Outcome) -> f64| all.iter().map(of).sum::<f64>() / count;
        let rms = |of: fn(&Outcome) -> f64| root_mean_square(all.iter().map(of));
        let worst = |of: fn(&Outcome) -> f64| all.iter().map(|o| of(o).abs()).fold(0.0, f64::max);
        let those = |of: fn(&Outcome) -> bool| all.iter().filter(|o| of(o)).count();
        let bias_rms_deg_h = rms(|o| o.bias_error_deg_h);
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let part = |o: &Outcome| o.saturated_intervals as f64 / (o.intervals + o.saturated_intervals) as f64;
        Summary {
            runs: all.len(),
            motors: self.motors,
            scale_factor_rms_ppm: rms(|o| o.scale_factor_error_ppm),
            scale_factor_stated_ppm: rms(|o| o.scale_factor_sigma_ppm),
            scale_factor_worst_ppm: worst(|o| o.scale_factor_error_ppm),
            scale_factor_walk_ppm: rms(|o| o.walk_scale_factor_sigma_ppm),
            scale_factor_within_10_ppm: those(|o| o.scale_factor_error_ppm.abs() <= 10.0),
            scale_factor_covered: those(Outcome::covers_scale_factor),
            bias_rms_deg_h,
            bias_stated_deg_h: rms(|o| o.bias_sigma_deg_h),
            bias_worst_deg_h: worst(|o| o.bias_error_deg_h),
            bias_over_walk: bias_rms_deg_h / mean(|o| o.walk_bias_sigma_deg_h),
            bias_covered: those(Outcome::covers_bias),
            pair_covered: those(Outcome::covers_pair),
            covered_bounds: binomial_bounds(u32::try_from(all.len()).unwrap_or(u32::MAX), 0.95),
            reference_factor: mean(|o| o.reference_factor),
            saturated: all.iter().map(part).sum::<f64>() / count,
            reference_rms_mdeg: rms(|o| o.reference_rms_mdeg),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line through rates 0, 100 and -50 deg/s over 1, 2 and 1 s: `S = sum r^2 T - (sum r T)^2 / sum T = 22,500 - 150^2 / 4`, as it is about the mean rate of 37.5 deg/s:
    /// `37.5^2 + 2 62.5^2 + 87.5^2`. Intervals that were left out count too.
    #[test]
    fn exact_random_walk_bounds_the_scale_factor_by_the_spread_of_the_rates() {
        let noise = Noise {
            period_s: 2e-3,
            walk_deg_rs: 2.5e-3,
            drift_deg_s: 0.0,
            drift_time_s: 200.0,
            resolution_deg: 0.0,
        };
        let interval = |from_s: f64, until_s: f64, turned_deg: f64| Interval {
            span: Span { from_s, until_s },
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
