//! Pictures: panels one under the other that share a look, as SVG.
//!
//! A [`Figure`] is made of [`Panel`]s, a panel of [`Series`] over two [`Axis`]. A series may have any length: lines are
//! thinned to the lowest and highest point of each pixel column, which does not change the picture.
//!
//! ```
//! use host_sim::report::chart::{Axis, Colour, Figure, Panel, Series};
//!
//! let rate = vec![(0.0, 0.0), (0.1, -1.2), (0.2, -1.5)];
//! let svg = Figure::new("Spin-up")
//!     .panel(
//!         Panel::new("Mode C", Axis::new("time (s)"), Axis::new("rate (rad/s)"))
//!             .series(Series::line(rate).colour(Colour::Blue).label("simulated")),
//!     )
//!     .svg()?;
//! assert!(svg.starts_with("<svg"));
//! # Ok::<(), host_sim::report::OutputError>(())
//! ```

mod axis;
mod draw;
mod panel_html;
mod thinning;

use std::ops::Range;

use crate::report::OutputError;

/// A picture: a title and panels from top to bottom.
#[derive(Clone, Debug)]
pub struct Figure {
    title: String,
    caption: Option<String>,
    panels: Vec<Panel>,
}

/// One pair of axes and what is drawn on them.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    height: u32,
}

/// An axis: its label with the unit, what it spans, and how.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    range: Option<Range<f64>>,
    logarithmic: bool,
    /// Of categories, which stand at 1, 2, 3 and so on.
    names: Vec<String>,
}

/// Something drawn on a panel.
#[derive(Clone, Debug)]
pub struct Series {
    label: Option<String>,
    colour: Colour,
    opacity: f64,
    width: f64,
    mark: Mark,
}

#[derive(Clone, Debug)]
enum Mark {
    Line(Vec<(f64, f64)>),
    Dashes(Vec<(f64, f64)>),
    Steps(Vec<(f64, f64)>),
    Points(Vec<(f64, f64)>),
    /// x, middle, half length.
    ErrorBars(Vec<(f64, f64, f64)>),
    /// x, lower, upper.
    Band(Vec<(f64, f64, f64)>),
    /// x, y, words.
    Names(Vec<(f64, f64, String)>),
    /// Full height, from x to x.
    Spans(Vec<(f64, f64)>),
}

/// Colours that every kind of colour vision can tell apart (Okabe and Ito), also in print.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// For the first thing on a panel.
    Blue,
    /// For what the first thing is compared with.
    Vermilion,
    /// For a third thing.
    Green,
    /// For a fourth.
    Purple,
    /// For a fifth.
    Orange,
    /// For a sixth.
    Sky,
    /// For a seventh.
    Brown,
    /// For targets and published figures.
    Black,
    /// For the background.
    Grey,
}

impl Colour {
    /// The colours of series that are alike, in the order of use; black is left for what they are compared with.
    pub const SERIES: [Self; 8] = [
        Self::Blue,
        Self::Vermilion,
        Self::Green,
        Self::Purple,
        Self::Orange,
        Self::Sky,
        Self::Brown,
        Self::Grey,
    ];
}

impl Figure {
    /// A picture with nothing on it.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), caption: None, panels: Vec::new() }
    }

    /// One line under the title.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }

    /// Adds a panel below the others.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The picture as a complete SVG document.
    ///
    /// # Errors
    /// When the backend cannot lay it out.
    pub fn svg(&self) -> Result<String, OutputError> {
        self.check();
        draw::svg(self)
    }

    /// Stops a build with checks where two things in a legend have one colour, or an axis of numbers has no unit: slips
    /// in the program. So every picture that a test makes is checked.
    fn check(&self) {
        for panel in &self.panels {
            debug_assert_eq!(panel.drawn_alike(), None, "one colour twice in the panel {:?}", panel.title);
            debug_assert_eq!(panel.without_unit(), None, "no unit in the panel {:?}", panel.title);
        }
    }
}

impl Panel {
    /// An empty panel of the usual height.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, series: Vec::new(), height: 230 }
    }

    /// Draws `series` over those before it.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Two things in the legend that have one colour, if there are any.
    fn drawn_alike(&self) -> Option<(&str, &str)> {
        let labelled: Vec<(Colour, &str)> =
            self.series.iter().filter_map(|series| Some((series.colour, series.label.as_deref()?))).collect();
        let pairs = labelled
            .iter()
            .enumerate()
            .flat_map(|(index, a)| labelled[index + 1..].iter().map(move |b| (a, b)));
        pairs.filter(|(a, b)| a.0 == b.0 && a.1 != b.1).map(|(a, b)| (a.1, b.1)).next()
    }

    /// The label of an axis of numbers that has no unit in brackets, if there is one.
    fn without_unit(&self) -> Option<&str> {
        let of_numbers = [&self.x, &self.y].into_iter().filter(|axis| axis.names.is_empty());
        of_numbers
            .map(|axis| axis.label.as_str())
            .find(|label| !(label.contains(" (") && label.contains(')')))
    }

    /// The panel's height in pixels, axes and title included.
    #[must_use]
    pub fn height(mut self, height: u32) -> Self {
        self.height = height;
        self
    }
}

impl Axis {
    /// A linear axis that spans all that is drawn.
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, logarithmic: false, names: Vec::new() }
    }

    /// Makes the axis span exactly `range`. Dots outside are left out; a line outside is cut off in a page, and runs
    /// along the border in a file.
    #[must_use]
    pub fn within(mut self, range: Range<f64>) -> Self {
        self.range = Some(range);
        self
    }

    /// An axis of categories: each name stands at its number, from 1.
    pub fn of_names(label: impl Into<String>, names: Vec<String>) -> Self {
        let last = f64::from(u32::try_from(names.len()).unwrap_or(u32::MAX)) + 0.5;
        Self { names, ..Self::new(label).within(0.5..last) }
    }

    /// Makes the axis logarithmic; points that are not positive are left out.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }
}

impl Series {
    fn of(mark: Mark, opacity: f64) -> Self {
        Self { label: None, colour: Colour::Blue, opacity, width: 1.3, mark }
    }

    /// Straight from point to point, in order of x.
    pub fn line(points: Vec<(f64, f64)>) -> Self {
        Self::of(Mark::Line(points), 1.0)
    }

    /// Dashes from point to point.
    pub fn dashes(points: Vec<(f64, f64)>) -> Self {
        Self::of(Mark::Dashes(points), 1.0)
    }

    /// Level from each point to the next, then a step.
    pub fn steps(points: Vec<(f64, f64)>) -> Self {
        Self::of(Mark::Steps(points), 1.0)
    }

    /// Dots.
    pub fn points(points: Vec<(f64, f64)>) -> Self {
        Self::of(Mark::Points(points), 1.0)
    }

    /// Bars from `mean - sd` to `mean + sd` with a dot at the mean, from `(x, mean, sd)`; the dot alone where `sd` is
    /// NaN.
    pub fn error_bars(points: Vec<(f64, f64, f64)>) -> Self {
        Self::of(Mark::ErrorBars(points), 1.0)
    }

    /// The area between `(x, lower, upper)`.
    pub fn band(points: Vec<(f64, f64, f64)>) -> Self {
        Self::of(Mark::Band(points), 0.18)
    }

    /// Words above and to the right of `(x, y, words)`.
    pub fn names(names: Vec<(f64, f64, String)>) -> Self {
        Self::of(Mark::Names(names), 1.0)
    }

    /// The full height of the panel between pairs of x.
    pub fn spans(spans: Vec<(f64, f64)>) -> Self {
        Self::of(Mark::Spans(spans), 0.13)
    }

    /// Its words in the legend; a series without them is not in the legend.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Its colour.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// From 0, invisible, to 1, solid.
    #[must_use]
    pub fn opacity(mut self, opacity: f64) -> Self {
        self.opacity = opacity;
        self
    }

    /// Width of its lines in pixels.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = width;
        self
    }

    /// Points between which the series lies; spans have no y.
    fn extent(&self) -> Vec<(f64, Option<f64>)> {
        match &self.mark {
            Mark::Line(points) | Mark::Dashes(points) | Mark::Steps(points) | Mark::Points(points) => {
                points.iter().map(|&(x, y)| (x, Some(y))).collect()
            }
            Mark::ErrorBars(bars) => {
                let ends = |&(x, y, half): &(f64, f64, f64)| [y - half, y, y + half].map(|y| (x, Some(y)));
                bars.iter().flat_map(ends).collect()
            }
            Mark::Band(edges) => {
                edges.iter().flat_map(|&(x, low, high)| [(x, Some(low)), (x, Some(high))]).collect()
            }
            Mark::Names(names) => names.iter().map(|&(x, y, _)| (x, Some(y))).collect(),
            Mark::Spans(spans) => spans.iter().flat_map(|&(from, to)| [(from, None), (to, None)]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(points: Vec<(f64, f64)>) -> String {
        let panel = Panel::new("a < b", Axis::new("time (s)"), Axis::new("height (um)"));
        Figure::new("title & more").panel(panel.series(Series::line(points).label("line"))).svg().unwrap()
    }

    #[test]
    fn exact_nothing_one_point_and_wild_points_are_drawn() {
        for points in [
            vec![],
            vec![(1.0, 1.0)],
            vec![(f64::NAN, 0.0), (0.0, f64::INFINITY), (1.0, 2.0)],
            vec![(-1e300, 1e300), (1e300, -1e300)],
        ] {
            let svg = picture(points);
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }

    /// A digit is at most 0.6 of the size of its font wide in the fonts of the pictures.
    #[test]
    fn exact_a_long_text_at_the_end_of_an_axis_is_on_the_canvas() {
        let axis = Axis::new("frequency (Hz)").within(6296.05..6296.10);
        let svg = Figure::new("").panel(Panel::new("", axis, Axis::new("density (1)"))).svg().unwrap();
        let at = svg.find("\n6296.10\n").expect("the last tick");
        let text = &svg[svg[..at].rfind("<text").unwrap()..at];
        let number = |name: &str| -> f64 {
            let value = text.split_once(&format!("{name}=\"")).unwrap().1;
            value.split('"').next().unwrap().parse().unwrap()
        };
        let canvas: f64 =
            svg.split_once("viewBox=\"0 0 ").unwrap().1.split(' ').next().unwrap().parse().unwrap();
        assert!(text.contains("text-anchor=\"middle\""), "{text}");
        assert!(number(" x") + 0.5 * 7.0 * 0.6 * number("font-size") < canvas, "{text}, {canvas} wide");
    }

    #[test]
    fn exact_text_is_escaped() {
        let svg = picture(vec![(0.0, 0.0), (1.0, 1.0)]);
        assert!(svg.contains("a &lt; b") && svg.contains("title &amp; more"));
    }

    #[test]
    fn exact_one_colour_for_two_things_is_found() {
        let panel = || Panel::new("", Axis::new("time (s)"), Axis::new("angle (deg)"));
        let series = |label: &str, colour| Series::line(vec![]).label(label).colour(colour);
        let alike =
            panel().series(series("a", Colour::Sky)).series(Series::points(vec![]).colour(Colour::Sky));
        assert_eq!(alike.drawn_alike(), None, "a line and its points are one thing");
        let alike = alike.series(series("b", Colour::Blue)).series(series("c", Colour::Sky));
        assert_eq!(alike.drawn_alike(), Some(("a", "c")));
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "one colour twice in the panel \"errors\"")]
    fn exact_a_picture_with_one_colour_for_two_things_is_refused() {
        let panel = Panel::new("errors", Axis::new("time (s)"), Axis::new("error (mdeg)"));
        let series = |label: &str| Series::line(vec![]).label(label);
        let _ = Figure::new("").panel(panel.series(series("a")).series(series("b"))).svg();
    }

    #[test]
    fn exact_an_axis_without_unit_is_found_and_categories_need_none() {
        let panel = |x: Axis, y: &str| Panel::new("", x, Axis::new(y));
        assert_eq!(panel(Axis::new("time (s)"), "cost (ns): cheaper below").without_unit(), None);
        assert_eq!(
            panel(Axis::of_names("phase", vec!["rest".to_owned()]), "error (mdeg)").without_unit(),
            None
        );
        assert_eq!(panel(Axis::new("time (s)"), "amplitude").without_unit(), Some("amplitude"));
        assert_eq!(panel(Axis::new("run"), "error (mdeg)").without_unit(), Some("run"));
    }

    #[test]
    fn law_a_million_points_make_a_small_picture() {
        let points = (0..1_000_000_u32).map(|i| (f64::from(i), f64::from(i % 977))).collect();
        let svg = picture(points);
        assert!(svg.len() < 200_000, "{}", svg.len());
    }

    /// Both lie on the axis: 3 is its middle.
    #[test]
    fn exact_an_error_bar_without_a_length_is_a_dot() {
        for (sd, bars) in [(1.0, 2), (f64::NAN, 0)] {
            let panel = Panel::new("", Axis::new("step (us)"), Axis::new("rate (rad/s)"));
            let panel = panel.series(Series::error_bars(vec![(1.0, 2.0, sd), (2.0, 4.0, sd)]));
            let (_, y) = panel.scales();
            assert!((0.5 * (y.span.start + y.span.end) - 3.0).abs() < 1e-12, "{:?}", y.span);
            let html = Figure::new("").panel(panel.clone()).html().into_string();
            let drawn = html.split_once("class=\"bar").unwrap().1.split_once(" d=\"").unwrap().1;
            assert_eq!(drawn.split('"').next().unwrap().matches('V').count(), bars, "{html}");
            let svg = Figure::new("").panel(panel).svg().unwrap();
            // A bar has a dot of its own.
            assert_eq!(svg.matches("<circle").count(), 2 + bars);
        }
    }

    #[test]
    fn exact_what_is_not_positive_is_left_out_of_a_logarithmic_axis() {
        let panel = Panel::new("", Axis::new("step (us)").logarithmic(), Axis::new("rate (rad/s)"));
        let svg = Figure::new("")
            .panel(panel.series(Series::points(vec![(0.0, 5.0), (-1.0, 3.0), (0.1, 1.0), (10.0, 2.0)])))
            .svg()
            .unwrap();
        assert_eq!(svg.matches("<circle").count(), 2);
    }
}
