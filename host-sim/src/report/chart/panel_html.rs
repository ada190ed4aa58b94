//! A panel as HTML: axes and legend are text that the page lays out at any width, the series are SVG that stretches
//! between them.
//!
//! The SVG's coordinates run from 0 to [`SIDE`] along both axes, y downwards. Lines keep their width however it is
//! stretched. The attributes `data-x` and `data-y` have both ends of an axis and 1 if it is logarithmic (the ends are
//! then decadic logarithms), so that a script can tell the value of a place.

mod paths;
mod values;

use maud::{Markup, html};

use super::axis::Scale;
use super::{Colour, Figure, Mark, Panel, Series};
use paths::Canvas;

/// Length of both axes in the coordinates of the SVG.
const SIDE: f64 = 10_000.0;
/// Pixels of a panel's height that title and axes take in a picture of its own.
const AROUND_PLOT: u32 = 60;
/// Characters of a name at the left in a line on a phone, and the height of such a line.
const PHONE_CHARACTERS: usize = 18;
const PHONE_LINE_PIXELS: usize = 15;
/// Characters of a tick's text at most; a longer name is broken.
const TICK_CHARACTERS_MAX: usize = 32;

impl Figure {
    /// The figure as HTML: its title and its caption, and one figure for each panel with its table behind it.
    pub(crate) fn html(&self) -> Markup {
        self.check();
        html! {
            @if !self.title.is_empty() { h3.title { (self.title) } }
            @if let Some(caption) = &self.caption { p.caption { (caption) } }
            @for panel in &self.panels { (panel.html()) }
        }
    }
}

impl Panel {
    fn html(&self) -> Markup {
        let (x, y) = self.scales();
        let table = values::table(self, &x);
        let pixels = self.height.saturating_sub(AROUND_PLOT).max(names_pixels(&y));
        html! {
            figure {
                figcaption { h3 { (self.title) } }
                (self.legend_html())
                .chart data-x=(data(&x)) data-y=(data(&y)) data-unit=(self.x.label) style=(beyond(&x)) {
                    .y-label { (self.y.label) }
                    (y_ticks(&y))
                    .plot style={ "height:" (pixels) "px" } { (self.svg_html(&x, &y)) (self.names_html(&x, &y)) }
                    (x_ticks(&x))
                    .x-label { (self.x.label) }
                }
                details {
                    summary { "Values of this picture" }
                    @if table.sampled { p { "At evenly spaced places, the nearest value that is drawn." } }
                    (crate::report::html::table(&table.table, &self.title))
                }
            }
        }
    }

    fn legend_html(&self) -> Markup {
        let entries = || self.series.iter().filter_map(|series| Some((series, series.label.as_ref()?)));
        html! {
            @if entries().next().is_some() {
                ul.legend {
                    @for (series, label) in entries() {
                        li { span class=(format!("swatch {} {}", series.kind(), series.colour.class())) {} (label) }
                    }
                }
            }
        }
    }

    fn svg_html(&self, x: &Scale, y: &Scale) -> Markup {
        let canvas = Canvas { x, y };
        html! {
            svg viewBox=(format!("0 0 {SIDE} {SIDE}")) preserveAspectRatio="none" role="img"
                aria-label=(format!("{}: {} over {}", self.title, self.y.label, self.x.label)) {
                path.grid d=(canvas.grid()) {}
                @for series in &self.series {
                    @for (class, path) in canvas.paths(&series.mark) {
                        path class=(format!("{class} {}", series.colour.class())) d=(path)
                            data-label=[series.label.as_ref()]
                            style=(stroke(class, series)) {}
                    }
                }
            }
        }
    }

    /// The words of [`Mark::Names`].
    fn names_html(&self, x: &Scale, y: &Scale) -> Markup {
        let named = self.series.iter().filter_map(|series| match &series.mark {
            Mark::Names(names) => Some((series.colour, names)),
            _ => None,
        });
        html! {
            @for (colour, names) in named {
                @for (at, height, words) in names {
                    @if let (Some(left), Some(top)) = (part(x, *at), part(y, *height)) {
                        span class={ "name " (colour.class()) (if left > 0.6 { " before" } else { "" }) }
                            style=(format!("left:{:.2}%;top:{:.2}%", 100.0 * left, 100.0 * (1.0 - top))) { (words) }
                    }
                }
            }
        }
    }

    /// Both axes with their spans.
    pub(super) fn scales(&self) -> (Scale, Scale) {
        let extent: Vec<(f64, Option<f64>)> = self.series.iter().flat_map(Series::extent).collect();
        let x = Scale::new(&self.x, extent.iter().map(|point| point.0), 0.02, 9.0);
        let y = Scale::new(&self.y, extent.iter().filter_map(|point| point.1), 0.06, 5.0);
        (x, y)
    }
}

/// Height in which the names of categories at the left do not meet, even on a phone.
fn names_pixels(y: &Scale) -> u32 {
    let longest = y.names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let line = PHONE_LINE_PIXELS * longest.div_ceil(PHONE_CHARACTERS) + 4;
    u32::try_from(y.names.len() * line).unwrap_or(0)
}

/// Place of a value on an axis, from 0 to 1; `None` outside.
fn part(scale: &Scale, value: f64) -> Option<f64> {
    let part = (scale.place(value)? - scale.span.start) / (scale.span.end - scale.span.start);
    (-1e-9..=1.0 + 1e-9).contains(&part).then_some(part)
}

fn data(scale: &Scale) -> String {
    format!("{} {} {}", scale.span.start, scale.span.end, u8::from(scale.logarithmic))
}

fn stroke(class: &str, series: &Series) -> String {
    let width = if class == "dots" { 4.0 + series.width } else { series.width };
    format!("opacity:{};stroke-width:{}", series.opacity, width.max(1.0))
}

/// The texts along an axis: place from 0 to 1, and words.
fn texts(scale: &Scale) -> Vec<(f64, String)> {
    let wide = scale.span.end - scale.span.start;
    let text = |tick: &f64| ((tick - scale.span.start) / wide, scale.tick_text(*tick));
    scale.ticks.iter().map(text).collect()
}

fn y_ticks(scale: &Scale) -> Markup {
    let texts = texts(scale);
    let longest = texts.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
    let characters = longest.min(TICK_CHARACTERS_MAX);
    html! {
        .y-ticks.named[!scale.names.is_empty()] style=(format!("width:calc({characters}ch + 0.7rem)")) {
            @for (part, text) in &texts { span style=(format!("top:{:.3}%", 100.0 * (1.0 - part))) { (text) } }
        }
    }
}

/// Half of the longest text below an axis: so far one at its end reaches beyond the plot.
fn beyond(scale: &Scale) -> String {
    if !scale.names.is_empty() {
        return "--beyond:calc(0ch / 2)".to_owned();
    }
    let longest = texts(scale).iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
    format!("--beyond:calc({}ch / 2)", longest.min(TICK_CHARACTERS_MAX))
}

fn x_ticks(scale: &Scale) -> Markup {
    let texts = texts(scale);
    html! {
        @if scale.names.is_empty() {
            .x-ticks {
                @for (part, text) in &texts { span style=(format!("left:{:.3}%", 100.0 * part)) { (text) } }
            }
        } @else {
            .x-ticks.named { @for (_, text) in &texts { span { (text) } } }
        }
    }
}

impl Series {
    /// What its swatch in a legend looks like.
    fn kind(&self) -> &'static str {
        match self.mark {
            Mark::Line(_) | Mark::Steps(_) => "line",
            Mark::Dashes(_) => "dashes",
            Mark::Points(_) | Mark::ErrorBars(_) | Mark::Names(_) => "dots",
            Mark::Band(_) | Mark::Spans(_) => "band",
        }
    }
}

impl Colour {
    /// Its class in the style of a page.
    fn class(self) -> &'static str {
        match self {
            Self::Blue => "blue",
            Self::Vermilion => "vermilion",
            Self::Green => "green",
            Self::Purple => "purple",
            Self::Orange => "orange",
            Self::Sky => "sky",
            Self::Brown => "brown",
            Self::Black => "black",
            Self::Grey => "grey",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Axis;

    fn html(series: Series) -> String {
        let panel = Panel::new("a < b", Axis::new("time (s)"), Axis::new("<script> (um)"));
        Figure::new("").panel(panel.series(series)).html().into_string()
    }

    #[test]
    fn exact_text_is_escaped() {
        let html = html(Series::line(vec![(0.0, 0.0), (1.0, 1.0)]).label("</svg><script>"));
        assert!(!html.contains("<script") && html.contains("a &lt; b"), "{html}");
    }

    /// Of an axis from 0 to 1, drawn with 2 % and 6 % left free at both ends.
    #[test]
    fn exact_a_line_runs_from_corner_to_corner_of_what_it_spans() {
        let html = html(Series::line(vec![(0.0, 0.0), (1.0, 1.0)]));
        assert!(
            html.contains("data-x=\"-0.02 1.02 0\"") && html.contains("data-y=\"-0.06 1.06 0\""),
            "{html}"
        );
        assert!(html.contains("d=\"M192 9464l9616-8928\""), "{html}");
    }

    /// The first and the last of the texts "6296.05" and "6296.10" stand at the ends of the axis.
    #[test]
    fn exact_there_is_room_for_half_of_a_text_at_the_end() {
        let panel = |axis: Axis| Panel::new("", axis, Axis::new("density (1)")).html().into_string();
        let long = panel(Axis::new("frequency (Hz)").within(6296.05..6296.10));
        assert!(long.contains("6296.10") && long.contains("--beyond:calc(7ch / 2)"), "{long}");
        let named = panel(Axis::of_names("phase", vec!["a long name of a phase".to_owned()]));
        assert!(named.contains("--beyond:calc(0ch / 2)"), "{named}");
    }

    #[test]
    fn exact_categories_stand_by_their_names() {
        let names = vec!["spin-up".to_owned(), "rest".to_owned()];
        let panel = Panel::new("", Axis::of_names("phase", names), Axis::new("error (mdeg)"));
        let html = Figure::new("")
            .panel(panel.series(Series::points(vec![(1.0, 3.0), (2.0, 4.0)]).label("twin")))
            .html()
            .into_string();
        assert!(html.contains("<span>spin-up</span><span>rest</span>"), "{html}");
        assert!(html.contains("<th scope=\"row\">rest</th><td>4</td>"), "{html}");
    }

    #[test]
    fn exact_nothing_and_wild_points_are_drawn() {
        for points in
            [vec![], vec![(f64::NAN, 0.0), (0.0, f64::INFINITY)], vec![(-1e300, 1e300), (1e300, 0.0)]]
        {
            let html = html(Series::line(points));
            assert!(!html.contains("NaN") && !html.contains("inf"), "{html}");
        }
    }
}
