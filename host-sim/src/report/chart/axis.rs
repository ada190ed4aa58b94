//! From values to places on an axis, and the places of its ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::Axis;
use simulation::math::plain_number::plain;

/// An axis with its span, in its own coordinate: the value, or its decadic logarithm.
#[derive(Clone)]
pub(super) struct Scale {
    pub(super) span: Range<f64>,
    pub(super) ticks: Vec<f64>,
    pub(super) logarithmic: bool,
    /// `None` where a tick's text has one significant digit.
    decimals: Option<usize>,
    /// Of categories, which stand at 1, 2, 3 and so on.
    pub(super) names: Vec<String>,
}

impl Scale {
    /// The scale of `axis` for points at `values`, with about `count` ticks. The part `margin` of the span is left
    /// free at both ends.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>, margin: f64, count: f64) -> Self {
        let logarithmic = axis.logarithmic;
        let place = |value: f64| if logarithmic { value.log10() } else { value };
        let span = if let Some(range) = &axis.range {
            place(range.start)..place(range.end)
        } else {
            // Beyond 1e150 a span may be infinite.
            let drawn = values.map(place).filter(|value| value.abs() < 1e150);
            let (low, high) = drawn.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            let free = margin * (high - low);
            low - free..high + free
        };
        let span = if span.start < span.end && span.start.is_finite() && span.end.is_finite() {
            span
        } else if span.start.is_finite() && span.start.to_bits() == span.end.to_bits() {
            let free = 0.5 * span.start.abs().max(1.0);
            span.start - free..span.end + free
        } else {
            0.0..1.0
        };
        let (ticks, decimals) = match (!axis.names.is_empty(), logarithmic) {
            (true, _) => ((1_u32..).map(f64::from).take(axis.names.len()).collect(), None),
            (false, true) => logarithmic_ticks(&span, count),
            (false, false) => round_numbers(&span, count),
        };
        Self { span, ticks, logarithmic, decimals, names: axis.names.clone() }
    }

    /// The place of `value`; `None` where it has none on this axis.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let place = if self.logarithmic { value.log10() } else { value };
        place.is_finite().then_some(place)
    }

    /// The place of `value`, clamped to the span.
    pub(super) fn place_inside(&self, value: f64) -> Option<f64> {
        self.place(value).map(|place| place.clamp(self.span.start, self.span.end))
    }

    /// The text at a tick.
    pub(super) fn tick_text(&self, tick: f64) -> String {
        let category =
            (1_u32..).map(f64::from).zip(&self.names).find(|(place, _)| place.total_cmp(&tick).is_eq());
        if let Some((_, name)) = category {
            return name.clone();
        }
        let value = if self.logarithmic { power_of_ten(tick) } else { tick };
        let Some(decimals) = self.decimals else {
            let text = format!("{value:.0e}");
            return text.parse().map_or(text, plain);
        };
        let text = format!("{value:.decimals$}");
        let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
        if is_zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") }
    }
}

/// The axis for `plotters`.
impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first, last): (i32, i32)) -> i32 {
        let part = (place - self.span.start) / (self.span.end - self.span.start);
        #[expect(clippy::cast_possible_truncation, reason = "what is drawn lies on the canvas")]
        let offset = (part.clamp(0.0, 1.0) * f64::from(last - first)).round() as i32;
        first + offset
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.span.clone()
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, tick: &f64) -> String {
        self.tick_text(*tick)
    }
}

pub(super) fn power_of_ten(exponent: f64) -> f64 {
    motor_model::math::exp(exponent * core::f64::consts::LN_10)
}

/// Multiples of 1, 2 or 5 times a power of ten, about `count` of them, and the decimals that distinguish them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few ticks, a few decimals")]
fn round_numbers(span: &Range<f64>, count: f64) -> (Vec<f64>, Option<usize>) {
    let rough = (span.end - span.start) / count;
    let decade = power_of_ten(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade).into_iter().find(|step| *step >= rough * 0.9);
    let step = step.unwrap_or(rough);
    let first = (span.start / step - 1e-9).ceil();
    let ticks = (0..64_u8).map(|index| (first + f64::from(index)) * step);
    let ticks = ticks.take_while(|tick| *tick <= span.end + 1e-9 * step).collect();
    (ticks, Some((-(step * 1.001).log10().floor()).clamp(0.0, 12.0) as usize))
}

/// Those of [`decades`], or round numbers where fewer than two of them are in the span.
fn logarithmic_ticks(span: &Range<f64>, count: f64) -> (Vec<f64>, Option<usize>) {
    let ticks = decades(span);
    if ticks.len() >= 2 {
        return (ticks, None);
    }
    let (ticks, decimals) = round_numbers(&(power_of_ten(span.start)..power_of_ten(span.end)), count);
    (ticks.into_iter().map(f64::log10).collect(), decimals)
}

/// 1, 2 and 5 times each power of ten; only the powers where they are many, and every third where they are very many.
fn decades(span: &Range<f64>) -> Vec<f64> {
    let wide = span.end - span.start;
    let (apart, digits): (f64, &[f64]) = match wide {
        _ if wide > 8.0 => (3.0, &[1.0]),
        _ if wide > 3.5 => (1.0, &[1.0]),
        _ => (1.0, &[1.0, 2.0, 5.0]),
    };
    let first = (span.start / apart).floor() * apart;
    let ticks = (0..40_u8)
        .flat_map(|index| digits.iter().map(move |digit| first + apart * f64::from(index) + digit.log10()));
    let inside = |tick: &f64| *tick >= span.start - 1e-9 && *tick <= span.end + 1e-9;
    ticks.filter(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis, values: &[f64]) -> Vec<String> {
        let scale = Scale::new(axis, values.iter().copied(), 0.0, 5.0);
        scale.ticks.iter().map(|tick| scale.tick_text(*tick)).collect()
    }

    #[test]
    fn exact_ticks_are_round_numbers() {
        assert_eq!(texts(&Axis::new(""), &[-1.0, 1.0]), ["\u{2212}1.0", "\u{2212}0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(
            texts(&Axis::new("").within(0.0..0.02), &[]),
            ["0.000", "0.005", "0.010", "0.015", "0.020"]
        );
        assert_eq!(texts(&Axis::new(""), &[0.0, 1000.0]), ["0", "200", "400", "600", "800", "1000"]);
    }

    #[test]
    fn exact_categories_have_their_names() {
        let axis = Axis::of_names("phase", vec!["spin-up".to_owned(), "rest".to_owned()]);
        assert_eq!(texts(&axis, &[]), ["spin-up", "rest"]);
        assert_eq!(Scale::new(&axis, [].into_iter(), 0.02, 5.0).span, 0.5..2.5);
    }

    #[test]
    fn exact_logarithmic_ticks() {
        assert_eq!(
            texts(&Axis::new("").logarithmic(), &[0.1, 10.0]),
            ["0.1", "0.2", "0.5", "1", "2", "5", "10"]
        );
    }

    /// Less than a factor of two has one of 1, 2 and 5 times a power of ten, or none: no scale could be read off it.
    #[test]
    fn exact_a_narrow_logarithmic_axis_has_round_numbers() {
        assert_eq!(texts(&Axis::new("").logarithmic(), &[1.0, 1.9]), ["1.0", "1.2", "1.4", "1.6", "1.8"]);
        assert_eq!(texts(&Axis::new("").logarithmic(), &[210.0, 340.0]), ["250", "300"]);
    }

    #[test]
    fn exact_a_span_for_one_value_and_for_none() {
        let span = |values: &[f64]| Scale::new(&Axis::new(""), values.iter().copied(), 0.05, 5.0).span;
        assert_eq!(span(&[4.0]), 2.0..6.0);
        assert_eq!(span(&[]), 0.0..1.0);
        assert_eq!(span(&[f64::NAN, f64::INFINITY]), 0.0..1.0);
    }
}
