//! Cost against error, in one picture.

use super::{DRIVES, FilterCosts, FilterCostsRow};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::runs::filter::FILTERS;
use simulation::runs::simulate::Precision;

const COLOURS: [Colour; 4] = [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple];

impl FilterCosts {
    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let figure = Figure::new("What each filter costs, and how far it is off").caption(
            "A line joins vibrometer rates of 50, 100 and 200 kHz; dashed in f64. Steady motion at full drive; error \
             at the present.",
        );
        let figure = DRIVES.iter().fold(figure, |figure, (_, drive)| figure.panel(self.time_panel(drive)));
        if self.rows.iter().all(|row| row.instructions.is_none()) {
            return figure;
        }
        figure.panel(self.instructions_panel())
    }

    fn time_panel(&self, drive: &str) -> Panel {
        let label = "cost (ns per 10 us of motor time, on this machine): cheaper to the left";
        let x = cost_axis(label, self.rows.iter().map(|row| row.ns.tick));
        let title = format!("Mode {}", drive.to_uppercase());
        let panel = Panel::new(title, x, self.error_axis()).height(260);
        FILTERS.iter().zip(COLOURS).fold(panel, |panel, (filter, colour)| {
            let of = |precision| self.curve(filter, drive, precision);
            let (single, double) = (of(Precision::F32), of(Precision::F64));
            panel
                .series(Series::line(single.clone()).colour(colour).label(filter.replace('_', " ")))
                .series(Series::points(single).colour(colour))
                .series(Series::dashes(double.clone()).colour(colour))
                .series(Series::points(double).colour(colour).opacity(0.5))
        })
    }

    fn instructions_panel(&self) -> Panel {
        let ticks = self.rows.iter().filter_map(|row| Some(row.instructions?.tick));
        let x = cost_axis("cost (Cortex-M4F instructions per 10 us of motor time)", ticks);
        let panel = Panel::new("On the microcontroller, both modes", x, self.error_axis()).height(230);
        FILTERS.iter().zip(COLOURS).fold(panel, |panel, (filter, colour)| {
            let rows = self.rows.iter().filter(|row| row.filter == *filter);
            let point = |row: &FilterCostsRow| {
                Some((row.instructions?.tick, row.rms_angle_mdeg, row.drive.to_uppercase()))
            };
            let named: Vec<_> = rows.filter_map(point).collect();
            let bare = named.iter().map(|&(x, y, _)| (x, y)).collect();
            panel
                .series(Series::points(bare).colour(colour).label(filter.replace('_', " ")))
                .series(Series::names(named).colour(colour))
        })
    }

    /// Cost and error of a filter by rate.
    fn curve(&self, filter: &str, drive: &str, precision: Precision) -> Vec<(f64, f64)> {
        let rows = self
            .rows
            .iter()
            .filter(|row| (row.filter, row.drive, row.precision) == (filter, drive, precision));
        rows.map(|row| (row.ns.tick, row.rms_angle_mdeg)).collect()
    }

    /// From 0 to a little more than the largest error.
    fn error_axis(&self) -> Axis {
        let largest = self.rows.iter().map(|row| row.rms_angle_mdeg).fold(0.0, f64::max);
        Axis::new("error (mdeg rms)").within(0.0..1.15 * largest)
    }
}

/// Logarithmic, with room for the names beside the points.
fn cost_axis(label: &str, costs: impl Iterator<Item = f64>) -> Axis {
    let (least, most) =
        costs.fold((f64::INFINITY, 0.0_f64), |(least, most), cost| (least.min(cost), most.max(cost)));
    Axis::new(label).logarithmic().within(0.7 * least..1.6 * most)
}
