//! Cost against error, as a picture.

use motor_model::ImpactRule;

use super::comparison::StepAccuracy;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::peers::PeerRow;
use simulation::runs::simulate::Precision;

/// The four curves: rule, precision, label.
const CURVES: [(ImpactRule, Precision, &str); 4] = [
    (ImpactRule::EndOfStep, Precision::F64, "end of step, f64"),
    (ImpactRule::EndOfStep, Precision::F32, "end of step, f32"),
    (ImpactRule::Located, Precision::F64, "located, f64"),
    (ImpactRule::Located, Precision::F32, "located, f32"),
];
const COST: &str = "cost (ns per simulated ms): cheaper to the left";
/// Steps that are named, of located impacts in `f64`: so far apart that the names do not meet.
const MARKED_S: [f64; 2] = [1e-6, 20e-6];
/// Lowest error of steady motion that is drawn, in per cent.
const LOWEST: f64 = 0.1;
/// Where the first of the crates' names stands: cost and error.
const FIRST_NAME: (f64, f64) = (8e4, 1e-6);

/// A point of a method: step in s, cost in ns per ms, error.
type Point = (f64, f64, f64);

impl StepAccuracy {
    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let finest_s = self.rows.first().map_or(0.0, |row| row.method.step_s);
        Figure::new("What a simulated millisecond costs, and how far off it is")
            .caption(format!(
                "Points: steps from 50 us (left) to {} us (right). Grey: errors below the resolution of these runs.",
                1e6 * finest_s
            ))
            .panel(self.plate_panel())
            .panel(self.rate_panel("Mode B: mean rate in steady motion", 0))
            .panel(self.rate_panel("Mode C: mean rate in steady motion", 1))
            .panel(self.burst_panel())
    }

    fn rate_panel(&self, title: &str, index: usize) -> Panel {
        let y = Axis::new("error (%)").logarithmic().within(LOWEST..150.0);
        let rate = |row: &MethodRow| (row.cost[index].ns_per_ms, row.steady[index].rate);
        let resolution = self.curve(ImpactRule::Located, Precision::F64).map(rate);
        let resolution = resolution.map(|(cost, rate)| (cost, LOWEST, 100.0 * rate.half_width)).collect();
        let panel = Panel::new(title, Axis::new(COST).logarithmic(), y).height(250);
        curves(panel.series(Series::band(resolution).colour(Colour::Grey).opacity(0.3)), |rule, precision| {
            let point = |row: &MethodRow| {
                let (cost, rate) = rate(row);
                (row.method.step_s, cost, 100.0 * rate.resolved())
            };
            self.curve(rule, precision).map(point).collect()
        })
    }

    fn burst_panel(&self) -> Panel {
        let y = Axis::new("error (%)").logarithmic().within(1e-3..1e4);
        let title = "Bursts of 2 to 10 cycles: worst net displacement";
        let panel = curves(Panel::new(title, Axis::new(COST).logarithmic(), y), |rule, precision| {
            let point = |row: &MethodRow| {
                let cost = 0.5 * (row.cost[0].ns_per_ms + row.cost[1].ns_per_ms);
                (row.method.step_s, cost, 100.0 * row.worst_burst())
            };
            self.curve(rule, precision).map(point).collect()
        });
        panel.height(250)
    }

    fn plate_panel(&self) -> Panel {
        let y = Axis::new("first impact off by (ns)").logarithmic().within(1e-12..1e7);
        let x = Axis::new(COST).logarithmic().within(150.0..2e8);
        let title = "Ball on a vibrating plate, with others' integrators";
        let mut panel = curves(Panel::new(title, x, y), |rule, precision| {
            let place = |row: &PeerRow| place(row).map(|(x, y)| (row.step_s, x, y));
            self.plate_curve(rule, precision).filter_map(place).collect()
        });
        let others = self.peers.iter().filter(|row| row.method.is_none());
        let mut others: Vec<_> = others.filter_map(|row| Some((place(row)?, row))).collect();
        others.sort_by(|a, b| a.0.0.total_cmp(&b.0.0));
        let colours = [Colour::Green, Colour::Purple, Colour::Brown, Colour::Black, Colour::Grey];
        let mut name_y = FIRST_NAME.1;
        for ((point, row), colour) in others.into_iter().zip(colours) {
            let (x, y) = if row.is_crate { (FIRST_NAME.0, name_y) } else { point };
            name_y /= 20.0;
            panel = panel
                .series(Series::points(vec![point]).colour(colour))
                .series(Series::names(vec![(x, y, row.name.clone())]).colour(colour));
        }
        panel.height(340)
    }
}

/// The point of an integrator on the plate's panel.
fn place(row: &PeerRow) -> Option<(f64, f64)> {
    Some((row.cost?.ns_per_ms, 1e9 * row.first_impact_rms_s?))
}

/// The four curves of the fixed-step model, with the names of some steps.
fn curves(mut panel: Panel, points: impl Fn(ImpactRule, Precision) -> Vec<Point>) -> Panel {
    for (rule, precision, label) in CURVES {
        let points = points(rule, precision);
        let bare: Vec<(f64, f64)> = points.iter().map(|&(_, x, y)| (x, y)).collect();
        let line = match precision {
            Precision::F64 => Series::line(bare.clone()),
            Precision::F32 => Series::dashes(bare.clone()),
        };
        let colour = colour(rule, precision);
        panel = panel.series(line.colour(colour).label(label)).series(Series::points(bare).colour(colour));
        if (rule, precision) == (ImpactRule::Located, Precision::F64) {
            let marked =
                points.iter().filter(|point| MARKED_S.iter().any(|s| (point.0 / s - 1.0).abs() < 1e-9));
            let names = marked.map(|&(step_s, x, y)| (x, y, format!("{:.0} us", 1e6 * step_s)));
            panel = panel.series(Series::names(names.collect()).colour(colour));
        }
    }
    panel
}

const fn colour(rule: ImpactRule, precision: Precision) -> Colour {
    match (rule, precision) {
        (ImpactRule::EndOfStep, Precision::F64) => Colour::Vermilion,
        (ImpactRule::EndOfStep, Precision::F32) => Colour::Orange,
        (ImpactRule::Located, Precision::F64) => Colour::Blue,
        (ImpactRule::Located, Precision::F32) => Colour::Sky,
    }
}
