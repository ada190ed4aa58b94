//! Statistics of the vibrometer's samples: of flight and impacts.

use motor_model::math;

use super::{Taker, shortest, windows_since, within};
use crate::identification::measured::Measured;
use crate::identification::parts::Span;
use simulation::math::statistics::{Accumulator, Line};

/// Times of the structure function in s.
const LAGS_S: [f64; 11] = [5e-6, 1e-5, 2.5e-5, 5e-5, 1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2];
/// A rise of the velocity within a sample by more than this many standard deviations of noise, and [`JUMP_M_S`], is a
/// jump.
const JUMP_SIGMAS: f64 = 8.0;
/// Smallest jump.
const JUMP_M_S: f64 = 0.5e-3;
/// Samples of half a stretch of flight.
const HALF: usize = 10;
/// Largest acceleration of a flight less that of gravity: more is no flight.
const FLIGHT_M_S2: f64 = 15.0;

pub(super) fn driven(spans: &[Span], measured: &Measured, noise_m_s: f64, taker: &mut Taker) {
    let all: Vec<(&[f64], &[f64])> = spans
        .iter()
        .map(|span| {
            let at_s = &measured.at_s;
            (within(at_s, at_s, *span), within(at_s, &measured.velocity_m_s, *span))
        })
        .collect();
    size(&all, taker);
    structure(&all, taker);
    impacts(&all, JUMP_M_S + JUMP_SIGMAS * noise_m_s, taker);
}

/// Size and shape of the velocity.
fn size(all: &[(&[f64], &[f64])], taker: &mut Taker) {
    let (mut count, mut sums) = (0.0, [0.0; 4]);
    for v in all.iter().flat_map(|(_, velocity)| velocity.iter()) {
        count += 1.0;
        for (sum, power) in sums.iter_mut().zip([*v, v.abs(), v * v, v * v * v]) {
            *sum += power;
        }
    }
    let [mean, magnitude, square, cube] = sums.map(|sum| sum / count);
    let rms = math::sqrt(square);
    taker.take("ln velocity", math::ln(rms + 1e-5));
    taker.take("mean velocity", mean / rms);
    taker.take("flatness", magnitude / rms);
    taker.take("skewness", cube / (square * rms));
}

/// Structure function, and the skewness of the differences.
fn structure(all: &[(&[f64], &[f64])], taker: &mut Taker) {
    let period_s = all
        .iter()
        .find_map(|(at_s, _)| Some((at_s.last()? - at_s.first()?) / count(at_s.len().checked_sub(1)?)))
        .unwrap_or(LAGS_S[0]);
    for lag_s in LAGS_S {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 1e4; a cast saturates"
        )]
        let lag = ((lag_s / period_s).round() as usize).max(1);
        let (mut pairs, mut squares, mut cubes) = (0.0, 0.0, 0.0);
        for (_, velocity) in all {
            for (before, after) in velocity.iter().zip(velocity.iter().skip(lag)) {
                let rise = after - before;
                pairs += 1.0;
                squares += rise * rise;
                cubes += rise * rise * rise;
            }
        }
        let square = squares / pairs;
        taker.take(&format!("ln structure at {} ms", 1e3 * lag_s), math::ln(square + 1e-10));
        taker.take(
            &format!("skewness at {} ms", 1e3 * lag_s),
            cubes / pairs / (square * math::sqrt(square) + 1e-15),
        );
    }
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn count(number: usize) -> f64 {
    number as f64
}

/// Impacts, one by one, and the flights between them.
fn impacts(all: &[(&[f64], &[f64])], least_m_s: f64, taker: &mut Taker) {
    let (mut time_s, mut jumps, mut intervals) = (0.0, Accumulator::default(), Accumulator::default());
    let (mut before_after, mut flights) = (Vec::new(), Vec::new());
    let mut number = 0.0;
    for (at_s, velocity) in all {
        time_s += at_s.last().unwrap_or(&0.0) - at_s.first().unwrap_or(&0.0);
        let rises: Vec<f64> = velocity.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // An impact whose step has a sample in it rises in two samples.
        let (mut index, mut last_s) = (0, None);
        let mut flown = 0;
        while index < rises.len() {
            if rises[index] <= least_m_s {
                flown += 1;
                if flown == 2 * HALF {
                    flown = 0;
                    flights.extend(flight(at_s, velocity, index + 1 - 2 * HALF));
                }
                index += 1;
                continue;
            }
            let first = index;
            while index < rises.len() && rises[index] > least_m_s {
                index += 1;
            }
            flown = 0;
            let jump = velocity[index] - velocity[first];
            number += 1.0;
            jumps.add(math::ln(jump));
            before_after.push((velocity[first], velocity[index]));
            if let Some(last_s) = last_s {
                intervals.add(math::ln(at_s[index] - last_s));
            }
            last_s = Some(at_s[index]);
        }
    }
    let (jump, interval) = (jumps.spread(), intervals.spread());
    taker.take("ln impacts a second", math::ln(number / time_s + 1.0));
    taker.take("mean ln jump", jump.mean);
    taker.take("spread of ln jump", jump.sd);
    taker.take("mean ln interval", interval.mean);
    taker.take("spread of ln interval", interval.sd);
    let slope = |line: Option<Line>| line.map_or(0.0, |line| line.slope);
    let after = Line::through(&before_after);
    taker.take("velocity after per before", slope(after));
    taker.take("velocity after, of no velocity before", after.map_or(0.0, |line| line.intercept));
    let flight = Line::through(&flights);
    taker.take("damping in flight", slope(flight));
    taker.take("fall in flight", flight.map_or(0.0, |line| line.intercept));
}

/// Mean velocity and acceleration over a stretch of flight from `first` on; `None` where it is none.
fn flight(at_s: &[f64], velocity: &[f64], first: usize) -> Option<(f64, f64)> {
    let mean = |from: usize| {
        let half = velocity.get(from..from + HALF)?;
        Some(half.iter().sum::<f64>() / count(HALF))
    };
    let (begin, end) = (mean(first)?, mean(first + HALF)?);
    let time_s = at_s.get(first + HALF)? - at_s.get(first)?;
    let acceleration = (end - begin) / time_s;
    ((acceleration + 9.81).abs() < FLIGHT_M_S2).then_some((0.5 * (begin + end), acceleration))
}

/// Energy of the vertical motion since the drive ended.
pub(super) fn coasting(spans: &[Span], measured: &Measured, taker: &mut Taker) {
    for (_, (since_s, until_s)) in windows_since(shortest(spans)) {
        let (mut count, mut squares) = (0.0, 0.0);
        for (from, _) in spans {
            let window = (from + since_s, from + until_s);
            for v in within(&measured.at_s, &measured.velocity_m_s, window) {
                count += 1.0;
                squares += v * v;
            }
        }
        taker.take(&format!("ln energy until {} ms", 1e3 * until_s), math::ln(squares / count + 1e-9));
    }
}
