//! Error by filter and phase, with the bound, in one picture.

use super::tables::title;
use super::{DRIVES, FilterErrors};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use analysis::filter_errors::comparison::{GENIES, names};
use analysis::filter_errors::timeline::TimelinePhase;

impl FilterErrors {
    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let figure = Figure::new("How far the filters are off the truth").caption(
            "Root mean square error of the angle by phase. Dashed: the lower bound of a filter that is given every \
             kick of the rate.",
        );
        DRIVES.iter().fold(figure, |figure, (_, drive)| figure.panel(self.panel(drive)))
    }

    fn panel(&self, drive: &str) -> Panel {
        let x = Axis::of_names("phase", TimelinePhase::ALL.map(|phase| title(phase).to_owned()).to_vec());
        let y = Axis::new("error (mdeg rms)").logarithmic();
        let panel = Panel::new(format!("Mode {}", drive.to_uppercase()), x, y).height(290);
        let bound = Series::dashes(self.curve(GENIES[0].0, drive)).colour(Colour::Black).label("bound");
        let others = names().filter(|name| *name != GENIES[0].0);
        others.zip(Colour::SERIES).fold(panel.series(bound), |panel, (name, colour)| {
            let curve = self.curve(name, drive);
            // Solid: a pale blue is the sky blue of another filter.
            panel
                .series(Series::line(curve.clone()).colour(colour).label(name.replace('_', " ")))
                .series(Series::points(curve).colour(colour))
        })
    }

    /// Error of a filter over the places of the phases.
    fn curve(&self, filter: &str, drive: &str) -> Vec<(f64, f64)> {
        let places = (1_u32..).map(f64::from).zip(TimelinePhase::ALL);
        let point = |(x, phase)| Some((x, self.row(filter, drive, phase)?.rms_angle_mdeg));
        places.filter_map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pale blue and sky blue are one colour to a reader, so are pale vermilion and orange: no line is pale.
    #[test]
    fn exact_lines_have_the_colours_of_their_dots() {
        let errors = FilterErrors {
            rows: Vec::new(),
            told: Vec::new(),
            walk: None,
            totals: Vec::new(),
            rig_s_per_s: [0.0; 2],
            numbers: Vec::new(),
            beside: Vec::new(),
        };
        let svg = errors.figure().svg().unwrap();
        let legend: Vec<&str> =
            svg.split("<polyline ").skip(1).filter(|line| line.contains("stroke-width=\"5\"")).collect();
        // The dashes of the bound are two.
        assert_eq!(legend.len(), 2 * (names().count() + 1));
        assert!(legend.iter().all(|line| line.contains("opacity=\"1\"")), "{legend:?}");
    }
}
