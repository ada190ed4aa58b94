//! A filter over a recording: its errors, and what it costs.
//!
//! An operation takes less time than a look at the clock, so [`COPIES`] of the filter do it one after the other between two looks, and what two looks with
//! nothing between them show is taken off. Every variant is timed in turn, round after round, and the least of each counts: what else the machine
//! does can only add.

use std::hint::black_box;
use std::time::Instant;

use estimator::AngleFilter as _;
use motor_model::{DriveCommand, OutOfBounds, Real, Time};
use serde::Serialize;

use super::Variant;
use super::recording::{Event, Recording};
use crate::runs::filter::AnyFilter;
use crate::runs::simulate::Precision;
use crate::studies::filter_errors::account::Account;

/// Copies of the filter that do the same.
const COPIES: usize = 16;

/// Looks at the truth, at the end of the recording, over which costs are averaged: 5 ms of motor time.
const TIMED_TRUTHS: usize = 71;

/// Camera frames in 10 us.
const FRAMES_PER_TICK: f64 = 0.1;

/// What a filter's operations take: in ns, or in instructions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// A camera update.
    pub camera_frame: f64,
    /// A vibrometer update, averaged over samples with impacts and without.
    pub vibrometer_sample: f64,
    /// An estimate at the present.
    pub prediction: f64,
    /// All that 10 us of motor time bring.
    pub tick: f64,
}

impl Cost {
    /// Of the three operations, with samples at this rate in Hz.
    pub fn new(camera_frame: f64, vibrometer_sample: f64, prediction: f64, sample_rate_hz: f64) -> Self {
        let samples_per_tick = 1e-5 * sample_rate_hz;
        let tick = FRAMES_PER_TICK * camera_frame + samples_per_tick * vibrometer_sample + prediction;
        Self { camera_frame, vibrometer_sample, prediction, tick }
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

/// What the errors of `filter` in steady motion add up to.
pub fn account<T: Real>(mut filter: AnyFilter<T>, recording: &Recording) -> Account {
    filter.drive(Time::ZERO, recording.command);
    let mut account = Account::default();
    for event in &recording.events {
        match event {
            Event::Sample(sample) => {
                filter.update_ldv(sample);
            }
            Event::Frame(frame) => account.innovation(&filter.update_camera(frame)),
            Event::Truth { at, angle, rate_rad_s } => {
                let (estimate, health) = (filter.estimate(*at), filter.health(*at));
                account.estimate(estimate.as_ref(), health, *angle, *rate_rad_s);
            }
        }
    }
    account
}

/// What the operations of each variant take on this machine, in ns.
///
/// # Errors
/// As of [`AnyFilter::named`].
pub fn costs(variants: &[Variant], recording: &Recording, rounds: u32) -> Result<Vec<Cost>, OutOfBounds> {
    let (settling, timed) = recording.events.split_at(timed_from(&recording.events));
    let settled = variants.iter().map(|variant| Settled::new(variant, recording.command, settling));
    let settled: Vec<Settled> = settled.collect::<Result<_, _>>()?;
    let endless = Cost::new(f64::INFINITY, f64::INFINITY, f64::INFINITY, 1.0);
    let mut least = vec![endless; variants.len()];
    for _ in 0..rounds.max(1) {
        for ((variant, settled), least) in variants.iter().zip(&settled).zip(&mut least) {
            *least = least.least(settled.cost(timed, variant.sample_rate_hz), variant.sample_rate_hz);
        }
    }
    Ok(least)
}

/// A filter that has followed the motor into steady motion.
enum Settled {
    F32(AnyFilter<f32>),
    F64(AnyFilter<f64>),
}

impl Settled {
    fn new(variant: &Variant, command: DriveCommand, events: &[Event]) -> Result<Self, OutOfBounds> {
        Ok(match variant.precision {
            Precision::F32 => Self::F32(settle(AnyFilter::named(variant.filter)?, command, events)),
            Precision::F64 => Self::F64(settle(AnyFilter::named(variant.filter)?, command, events)),
        })
    }

    fn cost(&self, events: &[Event], sample_rate_hz: f64) -> Cost {
        match self {
            Self::F32(filter) => cost(filter, events, sample_rate_hz),
            Self::F64(filter) => cost(filter, events, sample_rate_hz),
        }
    }
}

/// The filter after `events` under a drive.
fn settle<T: Real>(mut filter: AnyFilter<T>, command: DriveCommand, events: &[Event]) -> AnyFilter<T> {
    filter.drive(Time::ZERO, command);
    for event in events {
        match event {
            Event::Sample(sample) => {
                filter.update_ldv(sample);
            }
            Event::Frame(frame) => {
                filter.update_camera(frame);
            }
            Event::Truth { .. } => (),
        }
    }
    filter
}

/// Times taken by one operation.
#[derive(Clone, Copy, Debug, Default)]
struct Stopwatch {
    taken_ns: f64,
    operations: f64,
}

impl Stopwatch {
    /// Every copy does `operation`.
    fn time<F, R>(&mut self, copies: &mut [F], mut operation: impl FnMut(&mut F) -> R) {
        let start = Instant::now();
        for copy in copies.iter_mut() {
            black_box(operation(copy));
        }
        self.taken_ns += 1e9 * start.elapsed().as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "sixteen")]
        let done = copies.len() as f64;
        self.operations += done;
    }

    /// Mean time of an operation beyond that of a look at the clock.
    fn mean_ns(&self, look_ns: f64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "sixteen")]
        let looks = self.operations / COPIES as f64;
        ((self.taken_ns - looks * look_ns) / self.operations).max(0.0)
    }
}

/// What two looks at the clock with nothing between them show, in ns: the least of a thousand.
fn look_ns() -> f64 {
    let looks = (0..1000).map(|_| {
        let start = Instant::now();
        1e9 * start.elapsed().as_secs_f64()
    });
    looks.fold(f64::INFINITY, f64::min)
}

fn cost<T: Real>(settled: &AnyFilter<T>, events: &[Event], sample_rate_hz: f64) -> Cost {
    let mut copies: [AnyFilter<T>; COPIES] = std::array::from_fn(|_| settled.clone());
    let mut watches = [Stopwatch::default(); 3];
    for event in events {
        take(event, &mut copies, &mut watches);
    }
    let look_ns = look_ns();
    let [camera, vibrometer, prediction] = watches.map(|watch| watch.mean_ns(look_ns));
    Cost::new(camera, vibrometer, prediction, sample_rate_hz)
}

/// Where the events begin that are timed.
fn timed_from(events: &[Event]) -> usize {
    let truths = events.iter().enumerate().rev().filter(|(_, event)| matches!(event, Event::Truth { .. }));
    truths.take(TIMED_TRUTHS).last().map_or(0, |(index, _)| index)
}

/// Every copy takes the event, and the watch of its kind the time.
fn take<T: Real>(event: &Event, copies: &mut [AnyFilter<T>], watches: &mut [Stopwatch; 3]) {
    let [camera, vibrometer, prediction] = watches;
    match event {
        Event::Frame(frame) => camera.time(copies, |filter| filter.update_camera(black_box(frame))),
        Event::Sample(sample) => vibrometer.time(copies, |filter| filter.update_ldv(black_box(sample))),
        Event::Truth { at, .. } => {
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
        let cost = Cost::new(100.0, 7.0, 30.0, 200e3);
        assert!((cost.tick - (10.0 + 14.0 + 30.0)).abs() < 1e-12);
        let least = cost.least(Cost::new(200.0, 3.0, 30.0, 200e3), 200e3);
        assert!((least.tick - (10.0 + 6.0 + 30.0)).abs() < 1e-12);
    }

    /// Sleeping copies: the mean is that of one of them, whatever a look costs.
    #[test]
    fn law_a_stopwatch_shows_what_one_copy_takes() {
        let mut watch = Stopwatch::default();
        let nap = std::time::Duration::from_micros(200);
        watch.time(&mut [(); COPIES], |()| std::thread::sleep(nap));
        assert!(watch.mean_ns(look_ns()) >= 199e3, "{watch:?}");
        assert!(watch.mean_ns(1e12) <= 0.0, "never negative");
    }
}
