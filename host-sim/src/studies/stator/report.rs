//! The reports on a stator and on an ensemble.

use super::SolvedStator;
use super::driven::DrivenStator;
use super::members::Ensemble;
use super::quantities::{QUANTITIES, Quantity};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;

/// How sure a figure of finite elements is.
const SURE: &str = "The mesh costs half a per cent of a frequency at most. What is not known of the drawing costs \
                    more: the ensemble of `host-sim stator --ensemble 30` shows it. Damping does not come from the \
                    drawing.";

impl SolvedStator {
    /// The report on one stator.
    pub(crate) fn report(&self) -> StudyReport {
        let f = &self.figures;
        StudyReport {
            title: "The stator by finite elements".to_owned(),
            verdict: format!(
                "A {:.0} Hz, tilt {:.0} and {:.0} Hz, B {:.0} Hz, C {:.0} Hz; the inner rim is {:.0} um higher than \
                 the outer one.",
                f.a.frequency_hz,
                f.tilt[0].frequency_hz,
                f.tilt[1].frequency_hz,
                f.b.frequency_hz,
                f.c.frequency_hz,
                1e6 * f.bow_m
            ),
            asked: Vec::new(),
            pictures: vec![("stator_modes.svg".to_owned(), self.shapes())],
            document: self.document(),
            key_figures: self.key_figures(),
            sure: vec![SURE.to_owned()],
            motor_s: None,
        }
    }

    fn key_figures(&self) -> Vec<KeyFigure> {
        let f = &self.figures;
        let [t1, t2] = f.tilt;
        let modes = [("A", f.a), ("tilt 1", t1), ("tilt 2", t2), ("B", f.b), ("C", f.c)];
        let of = |(name, mode): (&str, stator::modes::ModeFigures)| {
            let figures = [
                KeyFigure::single("frequency", "Hz", mode.frequency_hz),
                KeyFigure::single("modal mass", "kg", mode.modal_mass_kg),
                KeyFigure::single("exponent at the teeth", "", mode.exponent),
            ];
            figures.map(|figure| figure.of(name))
        };
        let mut figures: Vec<KeyFigure> = modes.into_iter().flat_map(of).collect();
        figures.push(KeyFigure::single("mode shift", "deg", f.mode_shift_deg[0]).of("B"));
        figures.push(KeyFigure::single("mode shift", "deg", f.mode_shift_deg[1]).of("C"));
        figures.push(KeyFigure::single("bow", "m", f.bow_m));
        figures.push(KeyFigure::single("stator mass", "kg", f.stator_mass_kg));
        if let Some(driven) = DrivenStator::of(self) {
            for (name, drive) in ["B", "C"].into_iter().zip(driven.modes) {
                figures.push(KeyFigure::single("force per strain", "N", drive.force_per_strain_n).of(name));
                figures.push(KeyFigure::single("best field", "deg", drive.best_field_deg).of(name));
            }
        }
        figures
    }

    /// The scene file of its drawing.
    pub fn drawing_scene(&self) -> String {
        self.drawing_toml()
    }
}

impl Ensemble {
    /// The report on an ensemble.
    pub(crate) fn report(&self) -> StudyReport {
        let has_values = |quantity: &&Quantity| self.spread(**quantity).mean.is_finite();
        let figures = QUANTITIES.iter().filter(has_values).map(|quantity| {
            KeyFigure::mean(quantity.name, quantity.unit, self.met().map(|member| (quantity.of)(member)))
        });
        StudyReport {
            title: "Stators that meet the frequencies".to_owned(),
            verdict: format!(
                "{} of {} drawn stators meet the frequencies; their tilting modes lie at {:.0} +- {:.0} Hz.",
                self.met().count(),
                self.members.len(),
                self.spread(QUANTITIES[1]).mean,
                self.spread(QUANTITIES[1]).sd
            ),
            asked: vec![("stators", self.members.len().to_string())],
            pictures: vec![("stator_ensemble.svg".to_owned(), self.picture())],
            document: self.document(),
            key_figures: figures.collect(),
            sure: vec![
                "The spread is over what was drawn, within the ranges that are assumed for it; it is not a spread of \
                 motors that were made."
                    .to_owned(),
            ],
            motor_s: None,
        }
    }

    /// The result for programs: one object with the rows.
    pub fn json(&self) -> String {
        serde_json::json!({ "met": self.met().count(), "members": self.members }).to_string()
    }
}
