//! The budget of the scale factor as a table and as a panel: by cause what the fit states, and what the cause made of
//! the error in the simulation.

use super::{CalibrationOutcome, CalibrationSummary, Calibrations};
use crate::report::chart::{Axis, Colour, Panel, Series};
use crate::report::document::Table;
use analysis::gyroscope_fit::CAUSES;

/// What the lines mean.
pub(super) const ABOUT: &str = "The first two columns of numbers are of the first run's gyroscope, the others root \
    mean squares over all. Stated: the standard deviation by that cause, as the fit states it without the truth. Made: \
    what the cause made of the error, simulated. Random walk and drift make one noise, which stands in the first line. \
    Misalignment shows turns across the rotor's axis, which only a rotor that tilts makes; the fit cannot tell them \
    from coning, and its strength of coning has both. The camera's errors by angle are part of the reference's.";

/// Name of the line of misalignment, after that of coning.
const MISALIGNMENT: &str = "misalignment";
/// Errors and deviations below this are drawn at it, in ppm.
const SHOWN_MIN_PPM: f64 = 0.01;

/// A line: its cause, the deviation stated and the error made, in ppm.
struct BudgetLine {
    cause: &'static str,
    stated_ppm: Option<f64>,
    made_ppm: Option<f64>,
}

/// Lines from the deviations stated, in the order of [`CAUSES`], and the errors made by noise, reference, coning,
/// non-linearity, temperature and misalignment; then the line of the whole deviation and error.
fn lines(stated: [f64; CAUSES.len()], made: [f64; 6], [sigma, error]: [f64; 2]) -> Vec<BudgetLine> {
    let [noise, reference, coning, nonlinearity, temperature, misalignment] = made;
    let made =
        [Some(noise), None, Some(reference), Some(coning), Some(nonlinearity), Some(temperature), None];
    let mut lines: Vec<BudgetLine> = (CAUSES.into_iter().zip(stated).zip(made))
        .map(|((cause, stated), made_ppm)| BudgetLine { cause, stated_ppm: Some(stated), made_ppm })
        .collect();
    lines.insert(4, BudgetLine { cause: MISALIGNMENT, stated_ppm: None, made_ppm: Some(misalignment) });
    lines.push(BudgetLine { cause: "all", stated_ppm: Some(sigma), made_ppm: Some(error) });
    lines
}

impl CalibrationOutcome {
    fn budget(&self) -> Vec<BudgetLine> {
        let made = [
            self.scale_factor_noise_ppm,
            self.scale_factor_reference_ppm,
            self.scale_factor_coning_ppm,
            self.scale_factor_nonlinearity_ppm,
            self.scale_factor_temperature_ppm,
            self.scale_factor_misalignment_ppm,
        ];
        lines(self.stated_ppm(), made, [self.scale_factor_sigma_ppm, self.scale_factor_error_ppm])
    }
}

impl CalibrationSummary {
    fn budget(&self) -> Vec<BudgetLine> {
        let made = [
            self.scale_factor_noise_ppm,
            self.scale_factor_reference_ppm,
            self.scale_factor_coning_rms_ppm,
            self.scale_factor_nonlinearity_ppm,
            self.scale_factor_temperature_ppm,
            self.scale_factor_misalignment_ppm,
        ];
        lines(self.scale_factor_budget_ppm, made, [self.scale_factor_stated_ppm, self.scale_factor_rms_ppm])
    }
}

impl Calibrations {
    /// The budget of the first calibration, and of all root mean squares.
    pub(super) fn budget_table(&self) -> Table {
        let mut table = Table::new(&[
            "cause",
            "stated, ppm",
            "made, ppm (simulated)",
            "stated rms of all",
            "made rms of all (simulated)",
        ]);
        let shown = |value: Option<f64>, signed: bool| match value {
            Some(value) if signed => format!("{value:+.2}"),
            Some(value) => format!("{value:.2}"),
            None => String::new(),
        };
        for (first, all) in self.first.outcome.budget().iter().zip(self.summary().budget()) {
            table.push(vec![
                first.cause.to_owned(),
                shown(first.stated_ppm, false),
                shown(first.made_ppm, true),
                shown(all.stated_ppm, false),
                shown(all.made_ppm, false),
            ]);
        }
        table
    }

    /// The same over all calibrations as a panel, the first cause highest.
    pub(super) fn budget_panel(&self) -> Panel {
        let lines = self.summary().budget();
        let names = lines.iter().rev().map(|line| line.cause.to_owned()).collect();
        let points = |of: fn(&BudgetLine) -> Option<f64>| {
            let places = (1_u32..).map(f64::from).zip(lines.iter().rev());
            places
                .filter_map(|(place, line)| Some((of(line)?.abs().max(SHOWN_MIN_PPM), place)))
                .collect::<Vec<_>>()
        };
        Panel::new(
            "Budget of the scale factor, root mean square over all runs",
            Axis::new(format!("scale factor (ppm); at {SHOWN_MIN_PPM}: that or less")).logarithmic(),
            Axis::of_names("cause", names),
        )
        .height(300)
        .series(Series::points(points(|line| line.stated_ppm)).colour(Colour::Blue).label("stated"))
        .series(
            Series::points(points(|line| line.made_ppm)).colour(Colour::Vermilion).label("made, simulated"),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each cause has its own numbers: those stated in the order of the causes, those made by their names.
    #[test]
    fn exact_lines_are_of_their_causes() {
        let lines =
            lines([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], [10.0, 30.0, 40.0, 50.0, 60.0, 45.0], [8.0, 80.0]);
        let found: Vec<_> = lines.iter().map(|line| (line.cause, line.stated_ppm, line.made_ppm)).collect();
        let expected = [
            ("random walk", Some(1.0), Some(10.0)),
            ("drift of the bias", Some(2.0), None),
            ("reference", Some(3.0), Some(30.0)),
            ("tilt and coning", Some(4.0), Some(40.0)),
            ("misalignment", None, Some(45.0)),
            ("non-linearity", Some(5.0), Some(50.0)),
            ("temperature", Some(6.0), Some(60.0)),
            ("camera's errors by angle", Some(7.0), None),
            ("all", Some(8.0), Some(80.0)),
        ];
        assert_eq!(found, expected);
    }
}
