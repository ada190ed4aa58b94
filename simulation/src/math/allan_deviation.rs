//! Allan deviation of a gyroscope's record: how far means over neighbouring spans differ, by the length of the span.
//!
//! ```text
//! sigma^2(m T) = sum over k of (theta(k + 2m) - 2 theta(k + m) + theta(k))^2 / (2 (m T)^2 (K - 2m))
//!
//! theta(k): angle at sample k of K       T: period       m: samples of a span
//! ```
//!
//! The spans overlap: this estimator varies least for a record of a given length. Sources: IEEE Std 952-1997, annex
//! C; the overlapping estimator: Riley, NIST Special Publication 1065, 5.2.4.

use super::count::real;
use motor_model::math;

/// Allan deviation in deg/s of means over spans of `samples` samples. The angles, in degrees, are `period_s` apart.
///
/// `None` unless the record is longer than two such spans.
pub fn deviation_deg_s(angles_deg: &[f64], period_s: f64, samples: usize) -> Option<f64> {
    let late = angles_deg.get(2 * samples..).filter(|late| samples > 0 && !late.is_empty())?;
    let middle = &angles_deg[samples..];
    let differences = late.iter().zip(middle).zip(angles_deg).map(|((c, b), a)| c - 2.0 * b + a);
    let (spans, span_s) = (real(late.len()), real(samples) * period_s);
    let mean_square = differences.map(|difference| difference * difference).sum::<f64>() / spans;
    Some(math::sqrt(0.5 * mean_square) / span_s)
}

/// Lengths of spans in samples, about `per_decade` a decade, up to a fifth of a record of `samples`. In longer spans
/// the deviation is mostly chance.
pub fn spans(samples: usize, per_decade: u32) -> Vec<usize> {
    let ratio = math::exp(core::f64::consts::LN_10 / f64::from(per_decade));
    let mut spans = Vec::new();
    let mut next = 1.0_f64;
    loop {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
        let span = next.round() as usize;
        if span * 5 > samples {
            return spans;
        }
        if spans.last() != Some(&span) {
            spans.push(span);
        }
        next *= ratio;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A constant rate has no deviation; a rate that rises by R a second has R tau / sqrt(2) (IEEE Std 952, rate ramp).
    #[test]
    fn exact_constant_rate_and_ramp() {
        let record = |of: fn(f64) -> f64| (0..1000_u32).map(|k| of(0.1 * f64::from(k))).collect::<Vec<f64>>();
        for samples in [1, 7, 400] {
            let still = deviation_deg_s(&record(|t| 3.0 + 2.0 * t), 0.1, samples).unwrap();
            assert!(still < 1e-10, "{still}");
            let ramp = deviation_deg_s(&record(|t| 0.5 * 0.3 * t * t), 0.1, samples).unwrap();
            #[expect(clippy::cast_precision_loss, reason = "400")]
            let expected = 0.3 * 0.1 * samples as f64 * core::f64::consts::FRAC_1_SQRT_2;
            assert!((ramp / expected - 1.0).abs() < 1e-9, "{ramp} {expected}");
        }
    }

    /// Angles that alternate by one unit, an extreme of rounding: sqrt(2) * 2 / T at one sample, nothing at two.
    #[test]
    fn exact_alternating_angles() {
        let angles: Vec<f64> = (0..100_u32).map(|k| f64::from(k % 2)).collect();
        let one = deviation_deg_s(&angles, 0.5, 1).unwrap();
        assert!((one - 2.0 * core::f64::consts::SQRT_2).abs() < 1e-12, "{one}");
        assert!(deviation_deg_s(&angles, 0.5, 2).unwrap() < 1e-12);
    }

    #[test]
    fn exact_records_too_short_and_no_span() {
        let angles = [0.0; 10];
        assert_eq!(deviation_deg_s(&angles, 1.0, 5), None);
        assert!(deviation_deg_s(&angles, 1.0, 4).is_some());
        assert_eq!(deviation_deg_s(&angles, 1.0, 0), None);
    }

    #[test]
    fn exact_spans_rise_and_stay_within_a_fifth() {
        let spans = spans(1000, 5);
        assert_eq!(spans, [1, 2, 3, 4, 6, 10, 16, 25, 40, 63, 100, 158]);
    }
}
