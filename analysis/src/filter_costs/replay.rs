//! A filter replayed over a recording: its errors, and its costs.
//!
//! An operation takes less time than to read the clock. So [`COPIES`] copies of the filter do it one after the other
//! between two readings, and the time between two readings with nothing between them is subtracted. Every variant is
//! timed in turn, round after round, and the least time of each counts: other work of the machine can only add to it.

use std::hint::black_box;
use std::time::Instant;

use estimator::AngleFilter;
use motor_model::{DriveCommand, OutOfBounds, Real, Time};
use serde::Serialize;

use super::FilterVariant;
use super::recording::{RecordedEvent, Recording};
use crate::filter_errors::error_sums::ErrorSums;
use simulation::math::count::real;
use simulation::runs::filter::AnyFilter;
use simulation::runs::simulate::Precision;

/// Copies of the filter that do an operation between two readings of the clock.
const COPIES: usize = 16;

/// Records of the truth, at the end of the recording, over which costs are averaged: 5 ms of motor time.
const TIMED_TRUTHS: usize = 71;

/// Camera frames in 10 us.
const FRAMES_PER_TICK: f64 = 0.1;

/// The costs of a filter's operations, in ns or in instructions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OperationCosts {
    /// A camera update.
    pub camera_frame: f64,
    /// A vibrometer update, averaged over samples with impacts and without.
    pub vibrometer_sample: f64,
    /// An estimate at the present.
    pub prediction: f64,
    /// All operations in 10 us of motor time.
    pub tick: f64,
}

impl OperationCosts {
    /// From the costs of the three operations, with samples at this rate in Hz.
    pub fn new(camera_frame: f64, vibrometer_sample: f64, prediction: f64, sample_rate_hz: f64) -> Self {
        let samples_per_tick = 1e-5 * sample_rate_hz;
        let tick = FRAMES_PER_TICK * camera_frame + samples_per_tick * vibrometer_sample + prediction;
        Self { camera_frame, vibrometer_sample, prediction, tick }
    }

    /// Frame, sample, prediction, tick.
    pub fn each(&self) -> [f64; 4] {
        [self.camera_frame, self.vibrometer_sample, self.prediction, self.tick]
    }

    fn least(self, other: Self, sample_rate_hz: f64) -> Self {
        Self::new(
            self.camera_frame.min(other.camera_frame),
            self.vibrometer_sample.min(other.vibrometer_sample),
            self.prediction.min(other.prediction),
            sample_rate_hz,
        )
    }
}

/// `filter` after the events of a recording under the drive `command`, and its error sums in steady motion.
fn replayed<T: Real>(
    mut filter: AnyFilter<T>,
    command: DriveCommand,
    events: &[RecordedEvent],
) -> (AnyFilter<T>, ErrorSums)
where
    AnyFilter<T>: AngleFilter<T>,
{
    filter.drive(Time::ZERO, command);
    let mut error_sums = ErrorSums::default();
    for event in events {
        match event {
            RecordedEvent::Sample(sample) => drop(filter.update_ldv(sample)),
            RecordedEvent::Frame(frame) => error_sums.innovation(&filter.update_camera(frame)),
            RecordedEvent::Truth { at, angle, rate_rad_s } => {
                let (estimate, health) = (filter.estimate(*at), filter.health(*at));
                error_sums.estimate(estimate.as_ref(), health, *angle, *rate_rad_s);
            }
        }
    }
    (filter, error_sums)
}

/// The error sums of `filter` in steady motion.
pub fn error_sums<T: Real>(filter: AnyFilter<T>, recording: &Recording) -> ErrorSums
where
    AnyFilter<T>: AngleFilter<T>,
{
    replayed(filter, recording.command, &recording.events).1
}

/// The costs of each variant on this machine, in ns.
///
/// # Errors
/// When the model refuses the motor.
pub fn costs(
    variants: &[FilterVariant],
    recording: &Recording,
    sample_rate_hz: f64,
    rounds: u32,
) -> Result<Vec<OperationCosts>, OutOfBounds> {
    let timing = |variant: &FilterVariant| {
        Ok(match variant.precision {
            Precision::F32 => timing::<f32>(recording.filter(variant.filter)?, recording, sample_rate_hz),
            Precision::F64 => timing::<f64>(recording.filter(variant.filter)?, recording, sample_rate_hz),
        })
    };
    let timings: Vec<Box<dyn Fn() -> OperationCosts>> =
        variants.iter().map(timing).collect::<Result<_, _>>()?;
    let unmeasured = OperationCosts::new(f64::INFINITY, f64::INFINITY, f64::INFINITY, 1.0);
    let mut least = vec![unmeasured; variants.len()];
    for _ in 0..rounds.max(1) {
        for (timing, least) in timings.iter().zip(&mut least) {
            *least = least.least(timing(), sample_rate_hz);
        }
    }
    Ok(least)
}

/// Runs `filter` up to steady motion. Each call of the result then times its operations.
fn timing<T: Real>(
    filter: AnyFilter<T>,
    recording: &Recording,
    sample_rate_hz: f64,
) -> Box<dyn Fn() -> OperationCosts + '_>
where
    AnyFilter<T>: AngleFilter<T>,
{
    let (settling, timed) = recording.events.split_at(timed_from(&recording.events));
    let (settled, _) = replayed(filter, recording.command, settling);
    Box::new(move || cost(&settled, timed, sample_rate_hz))
}

/// Times taken by one operation.
#[derive(Clone, Copy, Debug, Default)]
struct Stopwatch {
    taken_ns: f64,
    operations: f64,
}

impl Stopwatch {
    /// Times `operation`, done by every copy.
    fn time<F, R>(&mut self, copies: &mut [F], mut operation: impl FnMut(&mut F) -> R) {
        let start = Instant::now();
        for copy in copies.iter_mut() {
            black_box(operation(copy));
        }
        self.taken_ns += 1e9 * start.elapsed().as_secs_f64();
        self.operations += real(copies.len());
    }

    /// Mean time of an operation, less the time to read the clock.
    fn mean_ns(&self, reading_ns: f64) -> f64 {
        let readings = self.operations / real(COPIES);
        ((self.taken_ns - readings * reading_ns) / self.operations).max(0.0)
    }
}

/// Time between two readings of the clock with nothing between them, in ns: the least of a thousand.
fn reading_ns() -> f64 {
    let readings = (0..1000).map(|_| {
        let start = Instant::now();
        1e9 * start.elapsed().as_secs_f64()
    });
    readings.fold(f64::INFINITY, f64::min)
}

fn cost<T: Real>(settled: &AnyFilter<T>, events: &[RecordedEvent], sample_rate_hz: f64) -> OperationCosts
where
    AnyFilter<T>: AngleFilter<T>,
{
    let mut copies: [AnyFilter<T>; COPIES] = std::array::from_fn(|_| settled.clone());
    let mut stopwatches = [Stopwatch::default(); 3];
    for event in events {
        time_event(event, &mut copies, &mut stopwatches);
    }
    let reading_ns = reading_ns();
    let [camera, vibrometer, prediction] = stopwatches.map(|stopwatch| stopwatch.mean_ns(reading_ns));
    OperationCosts::new(camera, vibrometer, prediction, sample_rate_hz)
}

/// Index of the first event that is timed.
fn timed_from(events: &[RecordedEvent]) -> usize {
    let truths =
        events.iter().enumerate().rev().filter(|(_, event)| matches!(event, RecordedEvent::Truth { .. }));
    truths.take(TIMED_TRUTHS).last().map_or(0, |(index, _)| index)
}

/// Every copy handles the event, timed by the stopwatch of its kind.
fn time_event<T: Real>(event: &RecordedEvent, copies: &mut [AnyFilter<T>], stopwatches: &mut [Stopwatch; 3])
where
    AnyFilter<T>: AngleFilter<T>,
{
    let [camera, vibrometer, prediction] = stopwatches;
    match event {
        RecordedEvent::Frame(frame) => camera.time(copies, |filter| filter.update_camera(black_box(frame))),
        RecordedEvent::Sample(sample) => {
            vibrometer.time(copies, |filter| filter.update_ldv(black_box(sample)));
        }
        RecordedEvent::Truth { at, .. } => {
            let now: Time = black_box(*at);
            prediction.time(copies, |filter| filter.estimate(now));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_what_ten_microseconds_bring() {
        let cost = OperationCosts::new(100.0, 7.0, 30.0, 200e3);
        assert!((cost.tick - (10.0 + 14.0 + 30.0)).abs() < 1e-12);
        let least = cost.least(OperationCosts::new(200.0, 3.0, 30.0, 200e3), 200e3);
        assert!((least.tick - (10.0 + 6.0 + 30.0)).abs() < 1e-12);
    }

    /// Copies that sleep: the mean is the time of one of them, whatever a reading of the clock costs.
    #[test]
    fn law_a_stopwatch_shows_what_one_copy_takes() {
        let mut stopwatch = Stopwatch::default();
        let nap = std::time::Duration::from_micros(200);
        stopwatch.time(&mut [(); COPIES], |()| std::thread::sleep(nap));
        assert!(stopwatch.mean_ns(reading_ns()) >= 199e3, "{stopwatch:?}");
        assert!(stopwatch.mean_ns(1e12) <= 0.0, "never negative");
    }
}
