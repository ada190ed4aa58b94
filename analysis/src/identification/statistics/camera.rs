//! Statistics of the camera's frames.

use motor_model::math;

use super::{Taker, shortest, windows_since};
use crate::identification::measured::{Frame, Measured};
use crate::identification::parts::Span;
use simulation::math::statistics::{Accumulator, Spread, upper_quantile};

/// Time over which a rate is taken.
const RATE_WINDOW_S: f64 = 5e-3;

fn frames_within(measured: &Measured, (from, until): Span) -> &[Frame] {
    let frames = &measured.frames;
    let first = frames.partition_point(|frame| frame.at_s < from);
    let last = frames.partition_point(|frame| frame.at_s < until);
    frames.get(first..last).unwrap_or_default()
}

pub(super) fn driven(spans: &[Span], measured: &Measured, taker: &mut Taker) {
    let (mut turned_rad, mut time_s, mut rates) = (0.0, 0.0, Accumulator::default());
    for span in spans {
        let frames = frames_within(measured, *span);
        let (Some(mut begin), Some(last)) = (frames.first(), frames.last()) else { continue };
        turned_rad += last.angle_rad - begin.angle_rad;
        time_s += last.at_s - begin.at_s;
        for frame in frames {
            let passed_s = frame.at_s - begin.at_s;
            if passed_s >= RATE_WINDOW_S * (1.0 - 1e-9) {
                rates.add((frame.angle_rad - begin.angle_rad) / passed_s);
                begin = frame;
            }
        }
    }
    taker.take("mean rate", turned_rad / time_s);
    taker.take("ln spread of the rate", math::ln(rates.spread().sd + 1e-2));
}

/// Shift and residual that the marks show: play of the hub, and tilt.
pub(super) fn marks(spans: &[Span], measured: &Measured, taker: &mut Taker) {
    let all = spans.iter().flat_map(|span| frames_within(measured, *span)).filter_map(|frame| frame.marks_m);
    let marks: Vec<([f64; 2], f64)> = all.collect();
    let middle: [f64; 2] =
        [0, 1].map(|axis| marks.iter().map(|(shift, _)| shift[axis]).collect::<Spread>().mean);
    let mut off: Vec<f64> = marks
        .iter()
        .map(|([x, y], _)| {
            let (x, y) = (x - middle[0], y - middle[1]);
            math::sqrt(x * x + y * y)
        })
        .collect();
    let mut at = |per_mille: usize| upper_quantile(&mut off, per_mille).unwrap_or(0.0);
    let residual: Spread = marks.iter().map(|(_, residual)| *residual).collect();
    taker.take("ln median shift", math::ln(at(500) + 1e-7));
    taker.take("ln large shift", math::ln(at(950) + 1e-7));
    taker.take("ln residual", math::ln(residual.mean + 1e-8));
    taker.take("ln spread of the residual", math::ln(residual.sd + 1e-8));
}

/// The angle turned since the drive ended.
pub(super) fn coasting(spans: &[Span], measured: &Measured, taker: &mut Taker) {
    let length_s = shortest(spans);
    let at = |time_s: f64| {
        let after = measured.frames.partition_point(|frame| frame.at_s <= time_s);
        measured.frames.get(after.saturating_sub(1)).map_or(0.0, |frame| frame.angle_rad)
    };
    for (_, (_, until_s)) in windows_since(length_s) {
        let turned: Spread = spans.iter().map(|(from, _)| at(from + until_s) - at(*from)).collect();
        taker.take(&format!("turned in {} ms", 1e3 * until_s), turned.mean);
    }
}
