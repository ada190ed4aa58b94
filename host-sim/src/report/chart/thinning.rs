//! Thinning of a line to the points that a pixel column can show, and of dots to those that a pixel can.

use std::collections::HashSet;
use std::ops::Range;

/// The part of `points` within `span` and one neighbour at each side: at most the first, the lowest, the highest and
/// the last point of each column.
pub(super) fn thinned(points: &[(f64, f64)], span: &Range<f64>, columns: u32) -> Vec<(f64, f64)> {
    let column_width = (span.end - span.start) / f64::from(columns);
    let column = |x: f64| ((x - span.start) / column_width).floor();
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut rest = inside(points, span);
    while let Some(&(x, _)) = rest.first() {
        let here = column(x);
        let length = rest.iter().take_while(|point| column(point.0).total_cmp(&here).is_eq()).count().max(1);
        let (run, others) = rest.split_at(length);
        rest = others;
        let by_y = |a: &usize, b: &usize| run[*a].1.total_cmp(&run[*b].1);
        let lowest = (0..length).min_by(by_y).unwrap_or(0);
        let highest = (0..length).max_by(by_y).unwrap_or(0);
        let mut indices = [0, lowest.min(highest), lowest.max(highest), length - 1];
        indices.sort_unstable();
        let mut last = None;
        for index in indices {
            if last != Some(index) {
                kept.push(run[index]);
            }
            last = Some(index);
        }
    }
    kept
}

/// The points within `span` and one neighbour at each side. The points are in order of x.
fn inside<'a>(points: &'a [(f64, f64)], span: &Range<f64>) -> &'a [(f64, f64)] {
    let first = points.partition_point(|point| point.0 < span.start).saturating_sub(1);
    let last = (points.partition_point(|point| point.0 <= span.end) + 1).min(points.len());
    points.get(first..last).unwrap_or(points)
}

/// The dots within the spans, in any order, but for those of the same cell as one before: each span has `cells`.
pub(super) fn distinct(dots: &[(f64, f64)], x: &Range<f64>, y: &Range<f64>, cells: u32) -> Vec<(f64, f64)> {
    let cell = |value: f64, span: &Range<f64>| {
        ((value - span.start) / (span.end - span.start) * f64::from(cells)).floor().to_bits()
    };
    let mut taken = HashSet::new();
    let shown = |&&(a, b): &&(f64, f64)| {
        let inside = (x.start..=x.end).contains(&a) && (y.start..=y.end).contains(&b);
        inside && taken.insert((cell(a, x), cell(b, y)))
    };
    dots.iter().filter(shown).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three dots of one column and dots in falling order are all shown; one on another and one outside are not.
    #[test]
    fn exact_dots_that_are_apart_are_all_shown() {
        let dots = [(5.0, 1.0), (5.0, 2.0), (5.0, 3.0), (4.0, 2.0), (1.0, 9.0), (5.0, 2.000_1), (11.0, 2.0)];
        assert_eq!(distinct(&dots, &(0.0..10.0), &(0.0..10.0), 800), dots[..5]);
        assert_eq!(distinct(&[], &(0.0..10.0), &(0.0..10.0), 800), []);
    }

    #[test]
    fn exact_extremes_survive() {
        let mut points: Vec<(f64, f64)> = (0..100_000_u32).map(|i| (f64::from(i), 0.0)).collect();
        points[31_415].1 = 7.0;
        points[92_653].1 = -8.0;
        let kept = thinned(&points, &(0.0..100_000.0), 500);
        assert!(kept.len() <= 2000);
        assert!(kept.contains(&(31_415.0, 7.0)) && kept.contains(&(92_653.0, -8.0)));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn exact_a_few_points_stay_as_they_are() {
        let points = [(0.0, 1.0), (0.5, 3.0), (1.0, 2.0)];
        assert_eq!(thinned(&points, &(0.0..1.0), 800), points);
        assert_eq!(thinned(&[], &(0.0..1.0), 800), []);
    }

    #[test]
    fn exact_a_window_keeps_one_neighbour_at_each_side() {
        let points: Vec<(f64, f64)> = (0..10_u32).map(|i| (f64::from(i), 0.0)).collect();
        let kept = thinned(&points, &(3.5..5.5), 800);
        assert_eq!(kept.iter().map(|point| point.0).collect::<Vec<_>>(), [3.0, 4.0, 5.0, 6.0]);
    }
}
