//! The table behind a panel.

use super::{Mark, Panel, Series};
use crate::report::chart::axis::{Scale, power_of_ten};
use crate::report::table::Table;
use simulation::math::plain_number::plain;

/// Rows at most; more points are sampled.
const ROWS_MAX: usize = 40;
/// Rows of a sample.
const SAMPLES: u32 = 25;

/// The values of a panel.
pub(super) struct Values {
    pub(super) table: Table,
    /// Whether it holds a sample of what is drawn.
    pub(super) sampled: bool,
}

/// The values of the series that have some: all of them where they are few, a sample over the axis otherwise.
pub(super) fn table(panel: &Panel, x: &Scale) -> Values {
    let is_labelled = panel.series.iter().any(|series| series.label.is_some());
    let columns: Vec<Column> = panel
        .series
        .iter()
        .filter(|series| !is_labelled || series.label.is_some())
        .filter_map(|series| Column::of(series, &panel.y.label))
        .collect();
    let mut header = vec![panel.x.label.as_str()];
    header.extend(columns.iter().map(|column| column.title.as_str()));
    let mut table = Table::new(&header);
    let mut places: Vec<f64> =
        columns.iter().flat_map(|column| column.points.iter().map(|point| point.0)).collect();
    places.retain(|place| x.place(*place).is_some());
    places.sort_by(f64::total_cmp);
    places.dedup();
    let sampled = places.len() > ROWS_MAX;
    if sampled {
        let wide = x.span.end - x.span.start;
        let value = |place: f64| if x.logarithmic { power_of_ten(place) } else { place };
        let steps = (0..SAMPLES).map(|step| f64::from(step) / f64::from(SAMPLES - 1));
        places = steps.map(|part| value(x.span.start + part * wide)).collect();
    }
    for place in places {
        let mut row = vec![name(&panel.x.names, place)];
        row.extend(columns.iter().map(|column| {
            let found = if sampled { column.nearest(place) } else { column.at(place) };
            let (first, last) = (found.first(), found.last());
            let [low, high] =
                [first, last].map(|end| end.map_or_else(String::new, |y| name(&panel.y.names, *y)));
            if low == high { low } else { format!("{low} to {high}, {} values", found.len()) }
        }));
        table.push(row);
    }
    Values { table, sampled }
}

/// The values of a series.
struct Column {
    title: String,
    points: Vec<(f64, f64)>,
}

impl Column {
    /// Those of a series that has values; bands have their upper edge.
    fn of(series: &Series, otherwise: &str) -> Option<Self> {
        let title = series.label.clone().unwrap_or_else(|| otherwise.to_owned());
        let (title, mut points) = match &series.mark {
            Mark::Line(points) | Mark::Dashes(points) | Mark::Steps(points) | Mark::Points(points) => {
                (title, points.clone())
            }
            Mark::ErrorBars(bars) => (title, bars.iter().map(|&(x, middle, _)| (x, middle)).collect()),
            Mark::Band(edges) => {
                (format!("{title}, upper edge"), edges.iter().map(|&(x, _, high)| (x, high)).collect())
            }
            Mark::Names(_) | Mark::Spans(_) => return None,
        };
        points.retain(|(x, y)| x.is_finite() && y.is_finite());
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Self { title, points })
    }

    /// The values at `x`, the lowest first.
    fn at(&self, x: f64) -> Vec<f64> {
        let here = self.points.iter().filter(|point| point.0.total_cmp(&x).is_eq());
        let mut values: Vec<f64> = here.map(|point| point.1).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// The value nearest to `x`.
    fn nearest(&self, x: f64) -> Vec<f64> {
        let after = self.points.partition_point(|point| point.0 < x);
        let around = [after.checked_sub(1), Some(after)];
        let points = around.into_iter().flatten().filter_map(|index| self.points.get(index));
        let nearest = points.min_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs()));
        nearest.map(|point| point.1).into_iter().collect()
    }
}

/// The name of a category; of a number, four significant digits.
fn name(names: &[String], value: f64) -> String {
    let place = (1_u32..).map(f64::from).zip(names).find(|(place, _)| (place - value).abs() < 0.01);
    place.map_or_else(
        || format!("{value:.3e}").parse().map_or_else(|_| String::new(), plain),
        |(_, name)| name.clone(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Axis;

    fn rows(series: Vec<Series>) -> (Vec<Vec<String>>, bool) {
        let panel = Panel::new("", Axis::new("time (s)"), Axis::new("rate"));
        let panel = series.into_iter().fold(panel, Panel::series);
        let Values { table, sampled } = table(&panel, &panel.scales().0);
        (
            std::iter::once(table.header())
                .chain(table.rows().iter().map(Vec::as_slice))
                .map(<[_]>::to_vec)
                .collect(),
            sampled,
        )
    }

    #[test]
    fn exact_few_points_are_all_there_and_a_missing_one_is_empty() {
        let (rows, sampled) = rows(vec![
            Series::line(vec![(0.0, 1.0), (0.5, 2.0)]).label("truth"),
            Series::points(vec![(0.5, 1.234_56), (0.5, 3.0)]).label("estimate"),
            Series::spans(vec![(0.0, 0.1)]).label("on"),
        ]);
        assert!(!sampled);
        assert_eq!(
            rows,
            [["time (s)", "truth", "estimate"], ["0", "1", ""], ["0.5", "2", "1.235 to 3, 2 values"]]
        );
    }

    #[test]
    fn exact_many_points_are_sampled_from_end_to_end() {
        let points = (0..=1000_u32).map(|i| (f64::from(i), 2.0 * f64::from(i))).collect();
        let (rows, sampled) = rows(vec![Series::line(points)]);
        assert!(sampled);
        assert_eq!(rows.len(), 1 + 25);
        assert_eq!(rows[0], ["time (s)", "rate"]);
        assert_eq!((rows[1][1].as_str(), rows[25][1].as_str()), ("0", "2000"));
        assert_eq!(rows[13], ["500", "1000"]);
    }
}
