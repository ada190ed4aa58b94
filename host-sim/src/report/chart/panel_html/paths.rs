//! Series as paths of an SVG, in whole numbers, each point as its distance from the one before.

use std::fmt::Write as _;

use super::SIDE;
use crate::report::chart::Mark;
use crate::report::chart::axis::{Scale, power_of_ten};
use crate::report::chart::draw::staircase;
use crate::report::chart::thinning::thinned;

/// Columns that a line is thinned to.
const COLUMNS: u32 = 1000;
/// Half length of the end of an error bar.
const BAR_END: i64 = 60;

/// A point of the SVG.
type Point = (i64, i64);

/// The plot between two axes.
pub(super) struct Canvas<'a> {
    pub(super) x: &'a Scale,
    pub(super) y: &'a Scale,
}

impl Canvas<'_> {
    /// A line at each tick.
    pub(super) fn grid(&self) -> String {
        let side = side();
        let across = self.x.ticks.iter().map(|tick| format!("M{} 0v{side}", along(self.x, *tick)));
        let up = self.y.ticks.iter().map(|tick| format!("M0 {}h{side}", side - along(self.y, *tick)));
        across.chain(up).collect()
    }

    /// What draws a mark: class and path of each part.
    pub(super) fn paths(&self, mark: &Mark) -> Vec<(&'static str, String)> {
        match mark {
            Mark::Line(points) => vec![("line", line(&self.thinned(points)))],
            Mark::Dashes(points) => vec![("line dashes", line(&self.thinned(points)))],
            Mark::Steps(points) => vec![("line", line(&self.thinned(&staircase(points))))],
            Mark::Points(points) => vec![("dots", dots(&self.all(points)))],
            Mark::ErrorBars(bars) => {
                let middles: Vec<(f64, f64)> = bars.iter().map(|&(at, middle, _)| (at, middle)).collect();
                vec![("bar", self.bars(bars)), ("dots", dots(&self.all(&middles)))]
            }
            Mark::Band(edges) => vec![("band", self.band(edges))],
            Mark::Spans(spans) => vec![("band", self.spans(spans))],
            Mark::Names(_) => Vec::new(),
        }
    }

    /// The corners of a line, thinned to what columns of pixels show.
    fn thinned(&self, points: &[(f64, f64)]) -> Vec<Point> {
        let places: Vec<(f64, f64)> =
            points.iter().filter_map(|&(x, y)| Some((self.x.place(x)?, self.y.place(y)?))).collect();
        let kept = thinned(&places, &self.x.span, COLUMNS);
        kept.into_iter().map(|(x, y)| (along(self.x, x), side() - along(self.y, y))).collect()
    }

    fn all(&self, points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().filter_map(|&(x, y)| self.point(x, y)).collect()
    }

    fn point(&self, x: f64, y: f64) -> Option<Point> {
        Some((along(self.x, self.x.place(x)?), side() - along(self.y, self.y.place(y)?)))
    }

    fn bars(&self, bars: &[(f64, f64, f64)]) -> String {
        let bar = |&(x, middle, half): &(f64, f64, f64)| {
            let (_, bottom) = self.point(x, self.lowest(middle - half))?;
            let (x, top) = self.point(x, middle + half)?;
            let (left, right) = (x - BAR_END, x + BAR_END);
            Some(format!("M{left} {bottom}H{right}M{x} {bottom}V{top}M{left} {top}H{right}"))
        };
        bars.iter().filter_map(bar).collect()
    }

    /// A value, or the lower end of a logarithmic axis where it has no place.
    fn lowest(&self, value: f64) -> f64 {
        let least = if self.y.logarithmic { power_of_ten(self.y.span.start) } else { f64::NEG_INFINITY };
        value.max(least)
    }

    fn band(&self, edges: &[(f64, f64, f64)]) -> String {
        let lower: Vec<(f64, f64)> = edges.iter().map(|&(x, low, _)| (x, self.lowest(low))).collect();
        let upper: Vec<(f64, f64)> = edges.iter().map(|&(x, _, high)| (x, high)).collect();
        let mut outline = self.thinned(&lower);
        outline.extend(self.thinned(&upper).into_iter().rev());
        if outline.is_empty() { String::new() } else { line(&outline) + "z" }
    }

    fn spans(&self, spans: &[(f64, f64)]) -> String {
        let side = side();
        let span = |&(from, to): &(f64, f64)| {
            let (from, to) = (along(self.x, self.x.place(from)?), along(self.x, self.x.place(to)?));
            Some(format!("M{from} 0H{to}V{side}H{from}z"))
        };
        spans.iter().filter_map(span).collect()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a whole number")]
const fn side() -> i64 {
    SIDE as i64
}

/// A place on an axis in coordinates of the SVG. What lies far outside is brought near, which moves no visible line by
/// a pixel.
#[expect(clippy::cast_possible_truncation, reason = "bounded by the clamp")]
fn along(scale: &Scale, place: f64) -> i64 {
    let part = (place - scale.span.start) / (scale.span.end - scale.span.start);
    (SIDE * part).round().clamp(-100.0 * SIDE, 100.0 * SIDE) as i64
}

/// A line from point to point.
fn line(points: &[Point]) -> String {
    let Some(&(x, y)) = points.first() else { return String::new() };
    let mut path = format!("M{x} {y}");
    let mut command = "l";
    for (&(x0, y0), &(x, y)) in points.iter().zip(points.iter().skip(1)) {
        let (dx, dy) = (x - x0, y - y0);
        if (dx, dy) == (0, 0) {
            continue;
        }
        let before_x = if command.is_empty() && dx >= 0 { " " } else { command };
        let before_y = if dy >= 0 { " " } else { "" };
        let _ = write!(path, "{before_x}{dx}{before_y}{dy}");
        command = "";
    }
    path
}

/// A line without length at each point: with round ends it is a dot.
fn dots(points: &[Point]) -> String {
    points.iter().fold(String::new(), |mut path, (x, y)| {
        let _ = write!(path, "M{x} {y}h0");
        path
    })
}
