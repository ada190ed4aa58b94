//! The motors of Tables 2 and 3 with the stator that finite elements give, in the place of the paper's reading of it.
//!
//! The stator's values stand in the scene `stator_fem`. A row of Table 2 changes them as it changes the paper's: the
//! stator's mass by the same part. Its mode shift is that of finite elements throughout.

use std::path::Path;

use motor_model::{DriveMode, MotorParams, Parameter};
use serde::Serialize;

use super::comparison::FigureComparison;
use super::published::{CASES, PaperSection, PublishedCase, Quantity};
use super::runs::Ensemble;
use simulation::math::statistics::Spread;
use simulation::scene::{Scene, SceneError};

const STATOR_FEM: &str = include_str!("../../../scenes/stator_fem.toml");

/// Parameters and their values.
type Changes = Vec<(Parameter, f64)>;

/// What the stator of finite elements changes of Table 1.
///
/// # Errors
/// When the scene is refused, which a test excludes.
pub fn stator() -> Result<Changes, SceneError> {
    let mut scene = Scene::default();
    scene.set_all(STATOR_FEM, Path::new("stator_fem.toml"))?;
    Ok(scene.motor_overrides().collect())
}

/// The cases that are simulated with it.
pub fn cases() -> impl Iterator<Item = &'static PublishedCase> {
    CASES.iter().filter(|case| case.place != PaperSection::ToothAngle)
}

/// What `case` changes of Table 1 with this stator.
pub fn changes(case: &PublishedCase, stator: &[(Parameter, f64)]) -> Changes {
    let of_case = case.changes.iter().filter(|(parameter, _)| *parameter != Parameter::ModeShift);
    let own = |&(parameter, value): &(Parameter, f64)| {
        let of_stator = stator.iter().find(|(of, _)| *of == parameter);
        let part = value / MotorParams::nominal().get(parameter);
        (parameter, of_stator.map_or(value, |(_, stator)| part * stator))
    };
    stator.iter().copied().chain(of_case.map(own)).collect()
}

/// A group of the stator's values that is changed alone, and its parameters.
type Part = (&'static str, &'static [Parameter]);

/// Groups of the stator's values, in the order of the table.
pub const PARTS: [Part; 5] = [
    ("none: the published reading", &[]),
    ("mass", &[Parameter::StatorMass]),
    (
        "modal masses",
        &[Parameter::ModeAMassFraction, Parameter::ModeBMassFraction, Parameter::ModeCMassFraction],
    ),
    ("mode shifts", &[Parameter::ModeShift, Parameter::ModeBExtraShift]),
    (
        "all",
        &[
            Parameter::StatorMass,
            Parameter::ModeAMassFraction,
            Parameter::ModeBMassFraction,
            Parameter::ModeCMassFraction,
            Parameter::ModeShift,
            Parameter::ModeBExtraShift,
        ],
    ),
];

/// Both modes, in the order of the table.
pub const MODES: [DriveMode; 2] = [DriveMode::B, DriveMode::C];

/// The values of `part` alone.
pub fn part_of(stator: &[(Parameter, f64)], (_, parameters): &Part) -> Changes {
    stator.iter().copied().filter(|(parameter, _)| parameters.contains(parameter)).collect()
}

/// Mode shifts of C that finite elements leave open, in degrees: what the teeth's plan size decides, which is not
/// published.
pub const SHIFTS_DEG: [f64; 8] = [-4.0, -3.5, -3.0, -2.5, -2.0, -1.5, -1.0, -0.5];

/// Mode C of Table 3.
pub fn mode_c() -> impl Iterator<Item = &'static PublishedCase> {
    cases().filter(|case| case.place == PaperSection::Table3 && case.mode == DriveMode::C)
}

/// The stator with another mode shift.
pub fn with_shift(stator: &[(Parameter, f64)], shift_deg: f64) -> Changes {
    stator.iter().copied().chain([(Parameter::ModeShift, shift_deg)]).collect()
}

/// Mode C of Table 3 with this stator and another mode shift.
#[derive(Clone, Debug, Serialize)]
pub struct ShiftedStator {
    /// The mode shift.
    pub mode_shift_deg: f64,
    /// The published figures and ours.
    pub figures: Vec<FigureComparison>,
}

impl ShiftedStator {
    /// The figures of Table 3 from the runs with a mode shift.
    pub fn new(mode_shift_deg: f64, ensemble: &Ensemble) -> Self {
        let figures = mode_c().flat_map(|case| case.figures).map(|figure| {
            FigureComparison::new(figure.quantity, figure.paper, ensemble.spread(figure.quantity))
        });
        Self { mode_shift_deg, figures: figures.collect() }
    }

    /// How many of the figures are within.
    pub fn within(&self) -> usize {
        self.figures.iter().filter(|figure| figure.within).count()
    }
}

/// A published figure beside the one with this stator.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OtherStator {
    /// The paper's figure and ours.
    pub comparison: FigureComparison,
    /// Whether every run turned in the sense of its mode.
    pub right_sense: bool,
}

/// Both modes with a group of the stator's values.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StatorPart {
    /// The group, in words.
    pub changed: &'static str,
    /// Rate and collision frequency, in rad/s and Hz, in mode B and in mode C.
    pub modes: [[Spread; 2]; 2],
}

impl StatorPart {
    /// The group `changed` from its runs in both modes.
    pub fn new(changed: &'static str, [b, c]: [&Ensemble; 2]) -> Self {
        let of = |ensemble: &Ensemble| {
            [Quantity::Rate, Quantity::CollisionFrequency].map(|quantity| ensemble.spread(quantity))
        };
        Self { changed, modes: [of(b), of(c)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The row of 9.7 mg of the paper's 10.7 is one of 9.7 / 10.7 of the stator's mass, with the stator's mode shift
    /// and modal masses.
    #[test]
    fn exact_a_row_changes_the_stator_s_mass_by_the_same_part_and_leaves_its_shifts() {
        let stator = stator().unwrap();
        let of = |changes: &[(Parameter, f64)], parameter| {
            changes.iter().rev().find(|(of, _)| *of == parameter).map(|(_, value)| *value)
        };
        let case = cases().find(|case| case.label == "stator mass 9.7 mg").unwrap();
        let changed = changes(case, &stator);
        let mass_kg = of(&stator, Parameter::StatorMass).unwrap();
        assert!((of(&changed, Parameter::StatorMass).unwrap() / mass_kg - 9.7 / 10.7).abs() < 1e-12);
        for parameter in [Parameter::ModeShift, Parameter::ModeBExtraShift, Parameter::ModeCMassFraction] {
            assert!(of(&stator, parameter).is_some() && of(&changed, parameter) == of(&stator, parameter));
        }
        let case = cases().find(|case| case.label == "friction 0.69").unwrap();
        assert_eq!(of(&changes(case, &stator), Parameter::Friction), Some(0.69));
    }

    /// A mode shift is set over that of the stator, and counts the figures that are within.
    #[test]
    fn exact_a_shift_in_the_place_of_the_stator_s() {
        let changed = with_shift(&stator().unwrap(), -1.0);
        let params = changed
            .iter()
            .try_fold(MotorParams::nominal(), |params, &(parameter, value)| params.with(parameter, value))
            .unwrap();
        assert!((params.get(Parameter::ModeShift) + 1.0).abs() < 1e-12);
        assert!((params.get(Parameter::StatorMass) / 12e-6 - 1.0).abs() < 1e-12);
        assert_eq!(mode_c().flat_map(|case| case.figures).count(), 3);
        let figure = |mean| {
            let printed = super::super::published::Printed { mean: 1.72, sd: Some(0.22) };
            FigureComparison::new(Quantity::Rate, printed, Spread { mean, sd: 0.03 })
        };
        let figures = vec![figure(1.7), figure(2.6), figure(1.9)];
        assert_eq!(ShiftedStator { mode_shift_deg: -1.0, figures }.within(), 2);
    }

    /// The groups together are the whole stator.
    #[test]
    fn exact_the_groups_are_the_stator() {
        let stator = stator().unwrap();
        let [none, mass, masses, shifts, all] = PARTS.each_ref().map(|part| part_of(&stator, part));
        assert!(none.is_empty());
        assert_eq!(all.len(), stator.len());
        assert_eq!(mass.len() + masses.len() + shifts.len(), all.len());
        assert!([mass, masses, shifts].iter().all(|part| !part.is_empty()));
    }
}
