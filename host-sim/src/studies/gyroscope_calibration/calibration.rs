//! One calibration: a gyroscope on the run of a motor, and what became of it.

use motor_model::math;

use super::outcome::CalibrationOutcome;
use super::parts::PartsByTruth;
use super::schedule::TurnSchedule;
use super::turning::{Anchor, TurningRun};
use analysis::gyroscope_fit::{CalibrationFit, FitInterval, StatedBudget, Unknowns, unknowns};
use simulation::math::count::real;
use simulation::math::statistics::root_mean_square;
use simulation::scene::Scene;
use simulation::world::instruments::gyroscope::noise::{SECONDS_PER_HOUR, TimeSpan};
use simulation::world::instruments::gyroscope::{
    Gyroscope, GyroscopeErrors, GyroscopeNoise, GyroscopeSample,
};

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
    pub(super) unknowns: Unknowns,
}

/// The bench on which gyroscopes are calibrated.
pub(super) struct Bench<'a> {
    pub schedule: &'a TurnSchedule,
    pub turning: &'a TurningRun,
    pub unknowns: Unknowns,
    /// Standard deviation of the misalignment along an axis, in rad.
    pub misalignment_rad: f64,
}

impl<'a> Bench<'a> {
    /// The bench of a scene, on which a motor has turned through a schedule.
    pub fn new(scene: &Scene, schedule: &'a TurnSchedule, turning: &'a TurningRun) -> Self {
        Self {
            schedule,
            turning,
            unknowns: Unknowns::of(scene, schedule.duration_s),
            misalignment_rad: GyroscopeErrors::sizes(scene).misalignment_rad[0],
        }
    }
}

impl Calibration {
    /// Calibration `number`: of `gyroscope`, whose serial is given, on a bench; `None` where scale factor and bias
    /// cannot be told apart.
    pub(super) fn of(gyroscope: &mut Gyroscope, (number, serial): (u64, u64), bench: &Bench) -> Option<Self> {
        let Bench { turning, unknowns, .. } = bench;
        let noise = gyroscope.noise();
        let samples: Vec<_> = turning.turns().map(|turn| gyroscope.sample(&turn)).collect();
        let intervals = intervals(gyroscope, &samples, bench);
        let kept: Vec<FitInterval> =
            intervals.iter().filter(|(_, saturated)| !saturated).map(|(interval, _)| *interval).collect();
        let fit = CalibrationFit::to(&kept, &noise, unknowns)?;
        let budget = fit.budget(&kept, &noise, unknowns);
        let is_kept: Vec<bool> = intervals.iter().map(|(_, saturated)| !saturated).collect();
        let parts = PartsByTruth::of(gyroscope, bench, &is_kept, &fit);
        let mut outcome = outcome(gyroscope, bench, &fit, &parts, &budget);
        (outcome.number, outcome.serial) = (number, serial);
        outcome.intervals = kept.len();
        outcome.saturated_intervals = intervals.len() - kept.len();
        outcome.walk_scale_factor_sigma_ppm = 1e6 * walk_scale_sigma(&intervals, &noise);
        let rates_deg_s = mean_rates(&samples, noise.period_s);
        Some(Self { outcome, intervals, rates_deg_s, fit, noise, unknowns: *unknowns })
    }
}

/// The intervals between the anchors, and whether a sample in them was saturated.
pub(super) fn intervals(
    gyroscope: &Gyroscope,
    samples: &[GyroscopeSample],
    bench: &Bench,
) -> Vec<(FitInterval, bool)> {
    let (period_s, limit_deg) = (gyroscope.noise().period_s, gyroscope.limit_deg());
    let interval = |pair: &[Anchor]| {
        let [from, until] = [pair[0], pair[1]];
        let within = &samples[from.sample..until.sample];
        let [from_s, until_s] = [from, until].map(|anchor| real(anchor.sample) * period_s);
        let span = TimeSpan { from_s, until_s };
        let part = |anchor: Anchor| anchor.angle.wrapped().degrees() / 360.0;
        let cubed = |sample: &GyroscopeSample| {
            let part = sample.turned_deg / limit_deg;
            part * part * part
        };
        let interval = FitInterval {
            span,
            shown_deg: within.iter().map(|sample| sample.turned_deg).sum(),
            turned_deg: until.angle.minus(from.angle).degrees(),
            variances_deg2: (from.variance_deg2, until.variance_deg2),
            cubed_deg: limit_deg * within.iter().map(cubed).sum::<f64>(),
            angles_turn: (part(from), part(until)),
            drive: bench.schedule.drive_in(span),
        };
        (interval, within.iter().any(|sample| sample.saturated))
    };
    bench.turning.anchors.windows(2).map(interval).collect()
}

/// The mean rate over each twentieth of a second: middle in s, deg/s.
fn mean_rates(samples: &[GyroscopeSample], period_s: f64) -> Vec<(f64, f64)> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
    let chunk = (0.05 / period_s).round().max(1.0) as usize;
    let mean = |(index, chunk_of): (usize, &[GyroscopeSample])| {
        let turned_deg: f64 = chunk_of.iter().map(|sample| sample.turned_deg).sum();
        let length_s = real(chunk_of.len()) * period_s;
        (real(index * chunk) * period_s + 0.5 * length_s, turned_deg / length_s)
    };
    samples.chunks(chunk).enumerate().map(mean).collect()
}

/// What became of a calibration, but for what its intervals say.
fn outcome(
    gyroscope: &Gyroscope,
    bench: &Bench,
    fit: &CalibrationFit,
    parts: &PartsByTruth,
    StatedBudget(stated): &StatedBudget,
) -> CalibrationOutcome {
    let (ppm, deg_h) = (1e6, SECONDS_PER_HOUR);
    let Bench { turning, unknowns: known, schedule, misalignment_rad } = bench;
    let (truth, noise) = (gyroscope.errors(), gyroscope.noise());
    let (true_scale, true_bias_deg_s) = (truth.scale_at(known.at_s), truth.bias_deg_s_at(known.at_s));
    let errors = [fit.scale - true_scale, fit.bias_deg_s - true_bias_deg_s];
    let rest = [0, 1].map(|of| errors[of] - parts.sum(of));
    let stated_by_filter = turning.reference_stated();
    let (nonlinearity, nonlinearity_sigma) = fit.unknown(unknowns::NONLINEARITY);
    let [cosine, sine, cosine_twice, sine_twice] = unknowns::CAMERA.map(|unknown| fit.unknown(unknown));
    let camera_mdeg = 1e3 * known.camera_deg;
    let amplitude = |one: (f64, f64), other: (f64, f64)| camera_mdeg * one.0.hypot(other.0);
    let camera_sigmas = [cosine, sine, cosine_twice, sine_twice].map(|(_, sigma)| sigma);
    CalibrationOutcome {
        number: 0,
        seed: turning.seed,
        serial: 0,
        motor_time_s: schedule.duration_s,
        scale_factor_ppm: ppm * fit.scale,
        scale_factor_error_ppm: ppm * errors[0],
        scale_factor_sigma_ppm: ppm * fit.scale_sigma(),
        scale_factor_coning_ppm: ppm * parts.coning[0],
        scale_factor_reference_ppm: ppm * parts.reference[0],
        scale_factor_misalignment_ppm: ppm * parts.misalignment[0],
        scale_factor_nonlinearity_ppm: ppm * parts.nonlinearity[0],
        scale_factor_temperature_ppm: ppm * parts.temperature[0],
        scale_factor_noise_ppm: ppm * rest[0],
        stated_random_walk_ppm: ppm * stated[0],
        stated_drift_ppm: ppm * stated[1],
        stated_reference_ppm: ppm * stated[2],
        stated_coning_ppm: ppm * stated[3],
        stated_nonlinearity_ppm: ppm * stated[4],
        stated_temperature_ppm: ppm * stated[5],
        stated_camera_ppm: ppm * stated[6],
        nonlinearity_ppm: ppm * known.nonlinearity * nonlinearity,
        nonlinearity_error_ppm: ppm * (known.nonlinearity * nonlinearity - truth.nonlinearity),
        nonlinearity_sigma_ppm: ppm * known.nonlinearity.abs() * nonlinearity_sigma,
        misalignment_first_error_mrad: -1e3 * truth.misalignment_rad[0],
        misalignment_second_error_mrad: -1e3 * truth.misalignment_rad[1],
        misalignment_sigma_mrad: 1e3 * misalignment_rad.abs(),
        camera_once_mdeg: amplitude(cosine, sine),
        camera_twice_mdeg: amplitude(cosine_twice, sine_twice),
        camera_sigma_mdeg: camera_mdeg * root_mean_square(camera_sigmas),
        bias_deg_h: deg_h * fit.bias_deg_s,
        bias_error_deg_h: deg_h * errors[1],
        bias_sigma_deg_h: deg_h * fit.bias_sigma_deg_s(),
        bias_coning_deg_h: deg_h * parts.coning[1],
        bias_reference_deg_h: deg_h * parts.reference[1],
        bias_noise_deg_h: deg_h * rest[1],
        correlation: fit.correlation(),
        pair_distance_square: fit.distance_square(true_scale, true_bias_deg_s),
        walk_bias_sigma_deg_h: deg_h * noise.walk_bias_deg_s(schedule.duration_s),
        walk_scale_factor_sigma_ppm: 0.0,
        reference_factor_clockwise: fit.strengths.reference_factors[0],
        reference_factor_counter_clockwise: fit.strengths.reference_factors[1],
        intervals: 0,
        saturated_intervals: 0,
        reference_rms_mdeg: turning.reference_rms_mdeg(),
        reference_beyond_3_sigma: stated_by_filter.beyond_3_sigma.unwrap_or(f64::NAN),
        reference_good_beyond_5_sigma: stated_by_filter.good_beyond_5_sigma,
        reference_good_beyond_5_sigma_worst_mdeg: stated_by_filter.good_beyond_5_sigma_worst_mdeg,
    }
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
            cubed_deg: 0.0,
            angles_turn: (0.0, 0.0),
            drive: 0,
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
