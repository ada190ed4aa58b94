//! The pictures of a sweep: which key moves a figure most, and how the figure follows each key.

use super::{KeyIndices, Response, Slice, SweepSummary};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;
use simulation::scene::registry;

/// Panels of a picture, at most.
const PANELS_MAX: usize = 24;

/// What the error bars of a response are.
const RESPONSES: &str = "Mean over the rows of a slice of the key's values, and one standard deviation of the rows to \
    either side, which the other keys, the seeds and the slice's width make; a dot alone: one row, which has none.";

/// What the bars of a tornado are.
const TORNADO: &str =
    "From the least to the largest mean of a slice of each key's values; a dot where they are the same.";

/// What indices are.
const INDICES: &str = "Share of the variance by each key alone, and by it alone and together with the others; lines: \
    intervals of 95 %.";

impl SweepSummary {
    /// The pictures, each with the name of its file: none of a sweep whose rows have all failed.
    pub(crate) fn pictures(&self) -> Vec<(String, Figure)> {
        let drawn: Vec<&Response> =
            self.responses.iter().filter(|response| !response.slices.is_empty()).collect();
        if drawn.is_empty() {
            return Vec::new();
        }
        let mut pictures = vec![
            ("tornado.svg".to_owned(), tornado(&drawn)),
            ("responses.svg".to_owned(), responses(&drawn)),
        ];
        if !self.indices.is_empty() {
            pictures.push(("indices.svg".to_owned(), shares(&self.indices)));
        }
        pictures
    }
}

/// Units by the ends of the names of figures, a longer end before a shorter one.
const UNITS: [(&str, &str); 13] = [
    ("_rad_s", "rad/s"),
    ("_deg_s", "deg/s"),
    ("_mm_s", "mm/s"),
    ("_m_s", "m/s"),
    ("_hz", "Hz"),
    ("_mdeg", "mdeg"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_percent", "%"),
    ("_ppm", "ppm"),
    ("_kg", "kg"),
    ("_m", "m"),
    ("_s", "s"),
];

/// A key or a figure with its unit: that of the key, or that in which the name ends; 1 without one.
fn labelled(name: &str) -> String {
    let of_key = registry().find(|setting| setting.key == name && !setting.unit.is_empty());
    let of_name = || UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit);
    format!("{name} ({})", of_key.map(|setting| setting.unit).or_else(of_name).unwrap_or("1"))
}

/// The figures of some items in their order, each once.
fn figures_of<'a>(of: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut figures: Vec<&str> = Vec::new();
    of.for_each(|figure| {
        if !figures.contains(&figure) {
            figures.push(figure);
        }
    });
    figures.truncate(PANELS_MAX);
    figures
}

/// A panel of horizontal bars, one or several for each name, the first name at the top.
fn bars(title: &str, x: &str, names: &[&str]) -> Panel {
    let from_below = names.iter().rev().map(|name| (*name).to_owned()).collect();
    let height = 90 + 30 * u32::try_from(names.len()).unwrap_or(30);
    Panel::new(title, Axis::new(labelled(x)), Axis::of_names("key", from_below)).height(height)
}

fn tornado(responses: &[&Response]) -> Figure {
    let panel = |figure: &str| {
        let of_figure = responses.iter().filter(|response| response.figure == figure);
        let mut ranges: Vec<(&str, (f64, f64))> =
            of_figure.filter_map(|response| Some((response.key.as_str(), response.range()?))).collect();
        let width = |range: &(f64, f64)| range.1 - range.0;
        ranges.sort_by(|a, b| width(&b.1).total_cmp(&width(&a.1)));
        let names: Vec<&str> = ranges.iter().map(|(key, _)| *key).collect();
        let bar = |(place, (_, (low, high))): (usize, &(&str, (f64, f64)))| {
            let y = real(ranges.len() - place);
            // A bar without length would not be seen.
            let mark = if low < high {
                Series::line(vec![(*low, y), (*high, y)])
            } else {
                Series::points(vec![(*low, y)])
            };
            mark.colour(Colour::Blue).width(9.0)
        };
        ranges.iter().enumerate().map(bar).fold(bars(figure, figure, &names), Panel::series)
    };
    let figures = figures_of(responses.iter().map(|response| response.figure.as_str()));
    figures
        .into_iter()
        .map(panel)
        .fold(Figure::new("Which key moves a figure most").caption(TORNADO), Figure::panel)
}

fn responses(responses: &[&Response]) -> Figure {
    let panel = |response: &&Response| {
        let x = match (&response.words[..], response.log) {
            ([], true) => Axis::new(labelled(&response.key)).logarithmic(),
            ([], false) => Axis::new(labelled(&response.key)),
            (words, _) => Axis::of_names(&response.key, words.to_vec()),
        };
        let bar = |slice: &Slice| (slice.at, slice.mean, slice.sd.unwrap_or(f64::NAN));
        let points = response.slices.iter().map(bar).collect();
        Panel::new(&response.figure, x, Axis::new(labelled(&response.figure)))
            .height(200)
            .series(Series::error_bars(points).colour(Colour::Blue))
    };
    let panels = responses.iter().take(PANELS_MAX).map(panel);
    panels.fold(Figure::new("How figures follow keys").caption(RESPONSES), Figure::panel)
}

fn shares(indices: &[KeyIndices]) -> Figure {
    let panel = |figure: &str| {
        let mut of_figure: Vec<&KeyIndices> =
            indices.iter().filter(|of_key| of_key.figure == figure).collect();
        of_figure.sort_by(|a, b| b.total.estimate.total_cmp(&a.total.estimate));
        let names: Vec<&str> = of_figure.iter().map(|of_key| of_key.key.as_str()).collect();
        let mut panel = bars(figure, "share of the variance", &names);
        for (place, of_key) in of_figure.iter().enumerate() {
            let y = real(of_figure.len() - place);
            let is_first = place == 0;
            for (index, y, colour, label) in [
                (of_key.total, y + 0.15, Colour::Orange, "with the others"),
                (of_key.first, y - 0.15, Colour::Blue, "alone"),
            ] {
                let bar = Series::line(vec![(0.0, y), (index.estimate, y)]).colour(colour).width(6.0);
                let bar = if is_first { bar.label(label) } else { bar };
                let interval = Series::line(vec![(index.low, y), (index.high, y)]).colour(Colour::Black);
                panel = panel.series(bar).series(interval);
            }
        }
        panel
    };
    let figures = figures_of(indices.iter().map(|of_key| of_key.figure.as_str()));
    figures.into_iter().map(panel).fold(Figure::new("Which key decides").caption(INDICES), Figure::panel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A key that changes nothing has a bar of no length, and a dot.
    #[test]
    fn exact_a_key_without_effect_is_drawn_in_the_tornado() {
        let slice = |at: f64, mean: f64| Slice { at, rows: 1, mean, sd: None };
        let dots = |other: f64| {
            let slices = vec![slice(1.0, 1.0), slice(2.0, other)];
            let response = Response {
                figure: "ok".to_owned(),
                key: "motor.friction".to_owned(),
                log: false,
                words: Vec::new(),
                slices,
            };
            tornado(&[&response]).svg().unwrap().matches("<circle").count()
        };
        assert_eq!((dots(1.0), dots(0.0)), (1, 0));
    }

    #[test]
    fn exact_axes_have_the_units_of_keys_and_names() {
        for (name, expected) in [
            ("camera.noise_m", "camera.noise_m (m)"),
            ("motor.friction", "motor.friction (1)"),
            ("rotor_rate_mean_rad_s", "rotor_rate_mean_rad_s (rad/s)"),
            ("rms.final_error_mdeg", "rms.final_error_mdeg (mdeg)"),
            ("settle_time_s", "settle_time_s (s)"),
            ("share of the variance", "share of the variance (1)"),
        ] {
            assert_eq!(labelled(name), expected);
        }
    }
}
