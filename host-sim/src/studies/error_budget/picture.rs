//! The picture of the page: errors in steady motion by what the twin is told.

use super::tables::{MODES, Told};
use super::{ErrorBudget, MARKS, RotorBudget};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use analysis::filter_errors::timeline::TimelinePhase;

impl ErrorBudget {
    /// The pictures by their files' names.
    pub(crate) fn pictures(&self) -> Vec<(String, Figure)> {
        let mut figure = Figure::new("What the twin's error is made of").caption(
            "Root mean square error of the angle in steady motion, by what of the truth the twin is told.",
        );
        for rotor in &self.rotors {
            for mode in MODES {
                figure = figure.panel(rotor.panel(mode));
            }
        }
        vec![("budget.svg".to_owned(), figure)]
    }
}

impl RotorBudget {
    fn panel(&self, (mode, drive): (&str, &str)) -> Panel {
        let told = self.told();
        let x = Axis::new("error (mdeg rms)").logarithmic();
        // Upwards: the first of the tables stands highest.
        let y = Axis::of_names("told", told.iter().rev().map(|told| told.shown.clone()).collect());
        let panel = Panel::new(format!("{}, mode {mode}", self.name()), x, y).height(360);
        MARKS.iter().zip(Colour::SERIES).fold(panel, |panel, (&marks, colour)| {
            let places = (1_u32..).map(f64::from).zip(told.iter().rev());
            let point = |(place, told): (f64, &Told)| {
                let row = self.of_marks(marks)?.budget_row(&told.name, drive, TimelinePhase::Steady)?;
                Some((row.rms_angle_mdeg, place))
            };
            let points: Vec<(f64, f64)> = places.filter_map(point).collect();
            let label = format!("{marks} {}", if marks == 1 { "mark" } else { "marks" });
            panel
                .series(Series::line(points.clone()).colour(colour).opacity(0.3))
                .series(Series::points(points).colour(colour).label(label))
        })
    }
}
