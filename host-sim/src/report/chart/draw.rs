//! Drawing a figure through `plotters`.
//!
//! The backend rounds to whole pixels; slanted lines would look like staircases. The canvas is therefore [`FINE`]
//! times the size at which the picture is shown.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Scale;
use super::thinning::{distinct, thinned};
use super::{Colour, Figure, Mark, Panel, Series};
use crate::report::OutputError;

/// Canvas pixels per pixel shown.
const FINE: i32 = 3;
/// Width shown.
const WIDTH: u32 = 860;
/// Room for the title of the figure, and for its caption.
const TITLE_HEIGHT: u32 = 34;
const CAPTION_HEIGHT: u32 = 20;
/// Room for the title of a panel and a legend beside it, and for each row of a legend below it.
const PANEL_TITLE_HEIGHT: u32 = 26;
const LEGEND_ROW_HEIGHT: u32 = 19;
/// Size of a legend's words, width of its swatches, and the room after a swatch and between entries.
const LEGEND_SIZE: f64 = 13.5;
const SWATCH: (f64, f64, f64) = (20.0, 7.0, 18.0);
/// Room for tick labels and axis labels; at the right the least.
const LEFT: i32 = 60;
const BOTTOM: i32 = 36;
const RIGHT: i32 = 18;
/// Room at the right at most: a text of a wild value has hundreds of digits.
const RIGHT_MAX: f64 = 60.0;
/// Free space at the left and below, where `plotters` puts labels at the very edge.
const MARGIN: i32 = 10;
const FONT: &str = "Helvetica, Arial, 'DejaVu Sans', sans-serif";
/// Mean width of a character in that font, as a part of its size as `plotters` counts it.
const CHARACTER_WIDTH: f64 = 0.45;

const INK: RGBColor = RGBColor(34, 34, 34);
const FAINT: RGBColor = RGBColor(228, 228, 228);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Coordinate = Cartesian2d<Scale, Scale>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Coordinate>;
type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<<SVGBackend<'static> as DrawingBackend>::ErrorType>>;

/// The picture as a complete SVG document.
pub(super) fn svg(figure: &Figure) -> Result<String, OutputError> {
    let caption_height = CAPTION_HEIGHT * u32::try_from(caption_lines(figure).len()).unwrap_or(0);
    let height = TITLE_HEIGHT + caption_height + figure.panels.iter().map(|panel| panel.height).sum::<u32>();
    let (fine_width, fine_height) = (WIDTH * FINE.unsigned_abs(), height * FINE.unsigned_abs());
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (fine_width, fine_height)).into_drawing_area();
        draw_figure(figure, &root, caption_height)
            .map_err(|error| OutputError::Drawing(error.to_string()))?;
    }
    // Shown at its size, drawn on the fine canvas that the viewBox keeps.
    let canvas = format!("width=\"{fine_width}\" height=\"{fine_height}\"");
    let shown = format!("width=\"{WIDTH}\" height=\"{height}\"");
    Ok(text.replacen(&canvas, &shown, 1).replace("<polyline ", "<polyline stroke-linejoin=\"round\" "))
}

fn draw_figure(figure: &Figure, root: &Area<'_>, caption_height: u32) -> Drawn {
    root.fill(&WHITE)?;
    let bold = TextStyle::from((FONT, fine(19.0), FontStyle::Bold)).color(&INK);
    root.draw(&Text::new(figure.title.clone(), (fine(14.0), fine(10.0)), bold))?;
    let soft = INK.mix(0.75);
    let style = TextStyle::from((FONT, fine(14.0))).color(&soft);
    for (line, row) in caption_lines(figure).into_iter().zip(0_u32..) {
        let top = f64::from(TITLE_HEIGHT + CAPTION_HEIGHT * row);
        root.draw(&Text::new(line, (fine(14.0), fine(top)), style.clone()))?;
    }
    let (_, mut rest) = root.split_vertically((TITLE_HEIGHT + caption_height) * FINE.unsigned_abs());
    for panel in &figure.panels {
        let (area, below) = rest.split_vertically(panel.height * FINE.unsigned_abs());
        draw_panel(panel, &area)?;
        rest = below;
    }
    root.present()
}

/// The caption in lines that fit.
fn caption_lines(figure: &Figure) -> Vec<String> {
    let lines =
        figure.caption.iter().flat_map(|caption| lines_within(caption, f64::from(WIDTH) - 28.0, 14.0));
    lines.collect()
}

/// Words of a size in lines of at most a width in pixels.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred characters")]
fn lines_within(words: &str, width: f64, size: f64) -> Vec<String> {
    let characters = (width / (CHARACTER_WIDTH * size)) as usize;
    textwrap::wrap(words, characters.max(1)).into_iter().map(Into::into).collect()
}

/// Size of ticks' texts, and height of a line of them.
const TICK_SIZE: f64 = 13.0;
const TICK_LINE: f64 = 14.0;

/// The names of categories along x, each in lines as wide as its place.
fn x_names(x: &Scale, left: i32) -> Vec<Vec<String>> {
    let count = u32::try_from(x.names.len()).unwrap_or(1).max(1);
    let place = (f64::from(WIDTH) - f64::from(left + MARGIN + RIGHT)) / f64::from(count);
    x.names.iter().map(|name| lines_within(name, place - 8.0, TICK_SIZE)).collect()
}

/// Room at the right of a plot: half of the longest text below the axis, which may stand at its end.
fn right_of(x: &Scale) -> i32 {
    if !x.names.is_empty() {
        return RIGHT;
    }
    let texts = x.ticks.iter().map(|tick| width(&x.tick_text(*tick), TICK_SIZE));
    fine((0.5 * texts.fold(0.0, f64::max) + 2.0).clamp(f64::from(RIGHT), RIGHT_MAX)) / FINE
}

fn draw_panel(panel: &Panel, area: &Area<'_>) -> Drawn {
    let (x, y) = panel.scales();
    let longest = y.names.iter().map(|name| width(name, TICK_SIZE)).fold(0.0, f64::max);
    let left = LEFT.max(fine(longest + 40.0) / FINE);
    let names = x_names(&x, left);
    let lines = names.iter().map(Vec::len).max().unwrap_or(1).max(1);
    let bottom = BOTTOM + fine(TICK_LINE * f64::from(u32::try_from(lines - 1).unwrap_or(0))) / FINE;

    let title = TextStyle::from((FONT, fine(15.0), FontStyle::Bold)).color(&INK);
    area.draw(&Text::new(panel.title.clone(), (fine(f64::from(LEFT + MARGIN)), fine(6.0)), title))?;
    let rows = draw_legend(panel, area)?;

    let (_, plot) =
        area.split_vertically((PANEL_TITLE_HEIGHT + LEGEND_ROW_HEIGHT * rows) * FINE.unsigned_abs());
    let mut chart = ChartBuilder::on(&plot)
        .margin_left(MARGIN * FINE)
        .margin_right(right_of(&x) * FINE)
        .margin_bottom(MARGIN * FINE)
        .set_label_area_size(LabelAreaPosition::Left, left * FINE)
        .set_label_area_size(LabelAreaPosition::Bottom, bottom * FINE)
        .build_cartesian_2d(x.clone(), y.clone())?;
    let small = TextStyle::from((FONT, fine(TICK_SIZE))).color(&INK);
    let label = TextStyle::from((FONT, fine(14.0))).color(&INK);
    let thin = ShapeStyle::from(&FAINT).stroke_width(FINE.unsigned_abs());
    chart
        .configure_mesh()
        .bold_line_style(thin)
        .light_line_style(TRANSPARENT)
        .axis_style(ShapeStyle::from(&INK).stroke_width(FINE.unsigned_abs()))
        .set_all_tick_mark_size(4 * FINE)
        .label_style(small.clone())
        .axis_desc_style(label)
        .x_label_formatter(&|tick| if names.is_empty() { x.tick_text(*tick) } else { String::new() })
        .x_desc(panel.x.label.clone())
        .y_desc(panel.y.label.clone())
        .draw()?;
    panel.series.iter().try_for_each(|series| draw_series(series, &mut chart, &x, &y))?;
    let (base_x, base_y) = plot.get_base_pixel();
    let centred = small.pos(Pos::new(HPos::Center, VPos::Top));
    for (tick, lines) in x.ticks.iter().zip(&names) {
        let (at, below) = chart.plotting_area().map_coordinate(&(*tick, y.span.start));
        for (line, row) in lines.iter().zip(0_u32..) {
            let top = below - base_y + fine(8.0 + TICK_LINE * f64::from(row));
            plot.draw(&Text::new(line.clone(), (at - base_x, top), centred.clone()))?;
        }
    }
    Ok(())
}

fn draw_series(series: &Series, chart: &mut Chart<'_, '_>, x: &Scale, y: &Scale) -> Drawn {
    let colour = series.colour.rgb().mix(series.opacity);
    let stroke = colour.stroke_width(fine(series.width).unsigned_abs().max(1));
    let shown = |points: &[(f64, f64)]| {
        let placed: Vec<_> =
            points.iter().filter_map(|&(a, b)| Some((x.place(a)?, y.place_inside(b)?))).collect();
        let within = |point: (f64, f64)| (point.0.clamp(x.span.start, x.span.end), point.1);
        thinned(&placed, &x.span, WIDTH).into_iter().map(within).collect::<Vec<_>>()
    };
    match &series.mark {
        Mark::Line(points) => chart.draw_series(LineSeries::new(shown(points), stroke)).map(drop),
        Mark::Dashes(points) => {
            let dashes = DashedLineSeries::new(shown(points), fine(6.0), fine(4.0), stroke);
            chart.draw_series(dashes).map(drop)
        }
        Mark::Steps(points) => {
            chart.draw_series(LineSeries::new(shown(&staircase(points)), stroke)).map(drop)
        }
        Mark::Points(points) => {
            let places: Vec<_> =
                points.iter().filter_map(|&(a, b)| Some((x.place(a)?, y.place_inside(b)?))).collect();
            let dots = distinct(&places, &x.span, &y.span, WIDTH).into_iter();
            chart.draw_series(dots.map(|dot| Circle::new(dot, fine(2.6), colour.filled()))).map(drop)
        }
        Mark::ErrorBars(bars) => {
            let bar = |&(a, middle, half): &(f64, f64, f64)| {
                let (low, high) = (y.place_inside(middle - half)?, y.place_inside(middle + half)?);
                let width = fine(7.0).unsigned_abs();
                Some(ErrorBar::new_vertical(
                    x.place_inside(a)?,
                    low,
                    y.place_inside(middle)?,
                    high,
                    stroke,
                    width,
                ))
            };
            chart.draw_series(bars.iter().filter_map(bar))?;
            let dots =
                bars.iter().filter_map(|&(a, middle, _)| Some((x.place_inside(a)?, y.place_inside(middle)?)));
            chart.draw_series(dots.map(|point| Circle::new(point, fine(3.2), colour.filled()))).map(drop)
        }
        Mark::Band(edges) => {
            let lower: Vec<_> = edges.iter().map(|&(a, low, _)| (a, low)).collect();
            let upper: Vec<_> = edges.iter().map(|&(a, _, high)| (a, high)).collect();
            let mut outline = shown(&lower);
            outline.extend(shown(&upper).into_iter().rev());
            chart.draw_series(std::iter::once(Polygon::new(outline, colour))).map(drop)
        }
        Mark::Names(names) => {
            let style = TextStyle::from((FONT, fine(12.0))).color(&colour);
            let name = |(a, b, words): &(f64, f64, String)| {
                let place = (x.place_inside(*a)?, y.place_inside(*b)?);
                // At the right a name would be cut off: it stands before its point.
                let part = (place.0 - x.span.start) / (x.span.end - x.span.start);
                let (side, right) = if part > 0.6 { (HPos::Right, -3.0) } else { (HPos::Left, 3.0) };
                let style = style.pos(Pos::new(side, VPos::Center));
                let text = Text::new(words.clone(), (fine(right), fine(-9.0)), style);
                Some(EmptyElement::at(place) + text)
            };
            chart.draw_series(names.iter().filter_map(name)).map(drop)
        }
        Mark::Spans(spans) => {
            let span = |&(from, to): &(f64, f64)| {
                let corners = [(x.place_inside(from)?, y.span.start), (x.place_inside(to)?, y.span.end)];
                Some(Rectangle::new(corners, colour.filled()))
            };
            chart.draw_series(spans.iter().filter_map(span)).map(drop)
        }
    }
}

/// Width of words of a size.
fn width(words: &str, size: f64) -> f64 {
    let characters = u32::try_from(words.chars().count()).unwrap_or(u32::MAX);
    CHARACTER_WIDTH * size * f64::from(characters)
}

/// Draws the legend at the right of the panel's title, or in rows below it where it does not fit there. Returns the
/// number of rows below.
fn draw_legend(panel: &Panel, area: &Area<'_>) -> Drawn<u32> {
    let (swatch, after, between) = SWATCH;
    let entries: Vec<(&Series, &str, f64)> = panel
        .series
        .iter()
        .filter_map(|series| {
            let label = series.label.as_deref()?;
            Some((series, label, swatch + after + width(label, LEGEND_SIZE)))
        })
        .collect();
    let total: f64 = entries.iter().map(|(_, _, width)| width + between).sum::<f64>() - between;
    let (left, right) = (f64::from(LEFT + MARGIN), f64::from(WIDTH) - f64::from(RIGHT));
    // Bold words are wider.
    let beside = left + 1.2 * width(&panel.title, 15.0) + between + total <= right;
    let (mut at, mut row) = if beside { (right - total, 0) } else { (left, 1) };
    for (series, label, width) in entries {
        if !beside && at > left && at + width > right {
            (at, row) = (left, row + 1);
        }
        let middle = 14.0 + f64::from(LEGEND_ROW_HEIGHT * row);
        draw_entry(series, label, (at, middle), area)?;
        at += width + between;
    }
    Ok(row)
}

/// An entry of a legend: a swatch that begins at `left`, and its words.
fn draw_entry(series: &Series, label: &str, (left, middle): (f64, f64), area: &Area<'_>) -> Drawn {
    let (swatch, after, _) = SWATCH;
    let middle = fine(middle);
    let style =
        TextStyle::from((FONT, fine(LEGEND_SIZE))).color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(label.to_owned(), (fine(left + swatch + after), middle), style))?;
    let (from, to) = (fine(left), fine(left + swatch));
    let colour = series.colour.rgb().mix(series.opacity.max(0.3));
    let stroke = colour.stroke_width(fine(series.width.max(1.6)).unsigned_abs());
    match series.mark {
        Mark::Line(_) | Mark::Steps(_) => {
            area.draw(&PathElement::new([(from, middle), (to, middle)], stroke))
        }
        Mark::Dashes(_) => {
            let third = (to - from) / 5;
            area.draw(&PathElement::new([(from, middle), (from + 2 * third, middle)], stroke))?;
            area.draw(&PathElement::new([(to - 2 * third, middle), (to, middle)], stroke))
        }
        Mark::Points(_) | Mark::ErrorBars(_) | Mark::Names(_) => {
            area.draw(&Circle::new((i32::midpoint(from, to), middle), fine(3.2), colour.filled()))
        }
        Mark::Band(_) | Mark::Spans(_) => {
            let corners = [(from, middle - fine(5.0)), (to, middle + fine(5.0))];
            area.draw(&Rectangle::new(corners, colour.filled()))
        }
    }
}

/// The corners of a line that is level from each point to the next.
pub(super) fn staircase(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied()).collect()
}

/// Pixels shown to canvas pixels.
#[expect(clippy::cast_possible_truncation, reason = "a picture is far smaller than 2^31 pixels")]
fn fine(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

impl Colour {
    fn rgb(self) -> RGBColor {
        match self {
            Self::Blue => RGBColor(0, 114, 178),
            Self::Vermilion => RGBColor(213, 94, 0),
            Self::Green => RGBColor(0, 158, 115),
            Self::Purple => RGBColor(170, 80, 140),
            Self::Orange => RGBColor(230, 159, 0),
            Self::Sky => RGBColor(86, 180, 233),
            Self::Brown => RGBColor(120, 66, 18),
            Self::Black => RGBColor(20, 20, 20),
            Self::Grey => RGBColor(140, 140, 140),
        }
    }
}
