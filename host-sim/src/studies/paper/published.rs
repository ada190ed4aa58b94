//! The published figures, as printed. They stand in this file only.
//!
//! Source: Qu, Tang, Gianchandani, Oldham, Green, "Dynamic modeling of a bidirectional magnetoelastic rotary
//! micro-motor", Sensors and Actuators A 223 (2015) 49-60. It prints magnitudes of rates. The sense of rotation is
//! compared apart.

use std::fmt;

use motor_model::Parameter::{
    Friction, Restitution, StatorMass, StatorThickness, ToothAngle, ToothHeight, VerticalDamping,
};
use motor_model::{DriveMode, Parameter};
use serde::Serializer;

/// A quantity of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Frequency of the largest line of the vertical velocity below 5 kHz.
    CollisionFrequency,
    /// Amplitude of that line.
    CollisionAmplitude,
    /// Magnitude of the rotor's mean rate.
    Rate,
}

impl Quantity {
    /// The unit in which it is printed.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::CollisionFrequency => "Hz",
            Self::CollisionAmplitude => "mm/s",
            Self::Rate => "rad/s",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::CollisionFrequency => "collision frequency",
            Self::CollisionAmplitude => "collision amplitude",
            Self::Rate => "rate",
        })
    }
}

/// Serializes a value as the text that `Display` gives.
pub fn as_words<S: Serializer>(value: &impl fmt::Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

/// A printed mean, with its standard deviation where one is printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    /// Mean, in the quantity's unit.
    pub mean: f64,
    /// Standard deviation of five runs.
    pub sd: Option<f64>,
}

impl Printed {
    /// Decimals with which it is printed. Only the frequency of mode B has a tenth of a hertz.
    pub fn decimals(&self, quantity: Quantity) -> usize {
        match quantity {
            Quantity::CollisionFrequency => usize::from(self.mean.fract() != 0.0),
            Quantity::CollisionAmplitude | Quantity::Rate => 2,
        }
    }
}

/// One published figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedFigure {
    /// The quantity.
    pub quantity: Quantity,
    /// What the paper's model gave.
    pub paper: Printed,
    /// What the paper's experiment gave, where the paper prints it.
    pub experiment: Option<Printed>,
}

/// The part of the paper that prints a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperSection {
    /// Model and experiment in both modes, `theta_m` = -2.635.
    Table3,
    /// One uncertain parameter changed at a time, mode C, `theta_m` = -2.5.
    Table2,
    /// Tooth angle, both modes, `theta_m` = -2.5, no spread printed.
    ToothAngle,
}

impl fmt::Display for PaperSection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Table3 => "Table 3: both modes (mode shift -2.635 deg)",
            Self::Table2 => "Table 2: one parameter changed, mode C (mode shift -2.5 deg)",
            Self::ToothAngle => "Tooth angle: theta_t + theta_m varied (mode shift -2.5 deg)",
        })
    }
}

/// A motor that the paper simulated, and the printed figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedCase {
    /// The part of the paper that prints it.
    pub place: PaperSection,
    /// The change, in words.
    pub label: &'static str,
    /// Mode driven.
    pub mode: DriveMode,
    /// Parameters that are not nominal.
    pub changes: &'static [(Parameter, f64)],
    /// The printed figures.
    pub figures: &'static [PublishedFigure],
}

const fn printed(mean: f64, sd: f64) -> Printed {
    Printed { mean, sd: Some(sd) }
}

const fn without_spread(mean: f64) -> Printed {
    Printed { mean, sd: None }
}

const fn figure(quantity: Quantity, paper: Printed, experiment: Option<Printed>) -> PublishedFigure {
    PublishedFigure { quantity, paper, experiment }
}

/// Frequency and rate of a row of Table 2.
const fn row(frequency: (f64, f64), rate: (f64, f64)) -> [PublishedFigure; 2] {
    [
        figure(Quantity::CollisionFrequency, printed(frequency.0, frequency.1), None),
        figure(Quantity::Rate, printed(rate.0, rate.1), None),
    ]
}

/// Frequency and rate of a tooth angle.
const fn angle(frequency: f64, rate: f64) -> [PublishedFigure; 2] {
    [
        figure(Quantity::CollisionFrequency, without_spread(frequency), None),
        figure(Quantity::Rate, without_spread(rate), None),
    ]
}

/// Mode shift of Tables 1 and 2, of the tooth angles and of the trends.
pub const SHIFT: (Parameter, f64) = (Parameter::ModeShift, -2.5);

/// Relative spread of Table 2's first row. It is used for a figure without a printed spread.
pub const fn borrowed_relative_sd(quantity: Quantity) -> f64 {
    match quantity {
        Quantity::CollisionFrequency | Quantity::CollisionAmplitude => 22.0 / 448.0,
        Quantity::Rate => 0.09 / 1.72,
    }
}

const fn table_2(
    label: &'static str,
    changes: &'static [(Parameter, f64)],
    figures: &'static [PublishedFigure],
) -> PublishedCase {
    PublishedCase { place: PaperSection::Table2, label, mode: DriveMode::C, changes, figures }
}

const fn tooth_angle(
    label: &'static str,
    mode: DriveMode,
    changes: &'static [(Parameter, f64)],
    figures: &'static [PublishedFigure],
) -> PublishedCase {
    PublishedCase { place: PaperSection::ToothAngle, label, mode, changes, figures }
}

/// Every case with printed figures, in the order in which they are shown.
pub const CASES: &[PublishedCase] = &[
    PublishedCase {
        place: PaperSection::Table3,
        label: "mode C",
        mode: DriveMode::C,
        changes: &[],
        figures: &[
            figure(Quantity::CollisionFrequency, printed(422.0, 52.0), Some(printed(400.0, 104.0))),
            figure(Quantity::CollisionAmplitude, printed(1.48, 0.26), Some(printed(0.88, 0.28))),
            figure(Quantity::Rate, printed(1.72, 0.22), Some(without_spread(1.4))),
        ],
    },
    PublishedCase {
        place: PaperSection::Table3,
        label: "mode B",
        mode: DriveMode::B,
        changes: &[],
        figures: &[
            figure(Quantity::CollisionFrequency, printed(88.8, 7.1), Some(printed(76.0, 20.0))),
            figure(Quantity::CollisionAmplitude, printed(4.08, 1.17), Some(printed(3.94, 0.57))),
            figure(Quantity::Rate, printed(8.16, 0.80), Some(without_spread(1.0))),
        ],
    },
    table_2("nothing", &[SHIFT], &row((448.0, 22.0), (1.72, 0.09))),
    table_2("stator mass 9.7 mg", &[SHIFT, (StatorMass, 9.7e-6)], &row((591.0, 170.0), (1.36, 0.17))),
    table_2("stator mass 11.7 mg", &[SHIFT, (StatorMass, 11.7e-6)], &row((402.0, 36.0), (1.96, 0.15))),
    table_2("stator thickness 60 um", &[SHIFT, (StatorThickness, 60e-6)], &row((434.0, 72.0), (1.67, 0.13))),
    table_2("stator thickness 80 um", &[SHIFT, (StatorThickness, 80e-6)], &row((440.0, 42.0), (1.72, 0.10))),
    table_2("tooth height 250 um", &[SHIFT, (ToothHeight, 250e-6)], &row((440.0, 32.0), (1.67, 0.13))),
    table_2("tooth height 270 um", &[SHIFT, (ToothHeight, 270e-6)], &row((432.0, 52.0), (1.75, 0.16))),
    table_2("restitution 0.57", &[SHIFT, (Restitution, 0.57)], &row((450.0, 37.0), (1.73, 0.15))),
    table_2("restitution 0.642", &[SHIFT, (Restitution, 0.642)], &row((413.0, 55.0), (1.64, 0.07))),
    table_2("friction 0.03", &[SHIFT, (Friction, 0.03)], &row((430.0, 49.0), (1.80, 0.07))),
    table_2("friction 0.69", &[SHIFT, (Friction, 0.69)], &row((430.0, 20.0), (1.68, 0.18))),
    table_2(
        "vertical damping 0.6 mN s/m",
        &[SHIFT, (VerticalDamping, 0.6e-3)],
        &row((416.0, 59.0), (1.72, 0.13)),
    ),
    table_2(
        "vertical damping 3.6 mN s/m",
        &[SHIFT, (VerticalDamping, 3.6e-3)],
        &row((448.0, 22.0), (1.72, 0.09)),
    ),
    tooth_angle("mode C, 62.135 deg", DriveMode::C, &[SHIFT, (ToothAngle, 64.635)], &angle(705.0, 0.75)),
    tooth_angle("mode C, 58.135 deg", DriveMode::C, &[SHIFT, (ToothAngle, 60.635)], &angle(314.0, 3.03)),
    tooth_angle("mode B, 62.135 deg", DriveMode::B, &[SHIFT, (ToothAngle, 64.635)], &angle(101.0, 9.05)),
    tooth_angle("mode B, 58.135 deg", DriveMode::B, &[SHIFT, (ToothAngle, 60.635)], &angle(85.0, 7.14)),
];

/// The influence of a parameter that the paper shows in a picture without printed numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedTrend {
    /// Number of the picture.
    pub picture: u8,
    /// The varied parameter, in words.
    pub label: &'static str,
    /// The unit in which it is shown, and the number of these units in an SI unit.
    pub unit: (&'static str, f64),
    /// The varied parameter.
    pub parameter: Parameter,
    /// Least and largest value here, about the nominal one.
    pub range: (f64, f64),
    /// Each quantity, and whether it rises with the parameter.
    pub rises: [(Quantity, bool); 2],
}

/// Figs 10 and 11, mode C: each "roughly linear".
pub const TRENDS: [PublishedTrend; 2] = [
    PublishedTrend {
        picture: 10,
        label: "rotor mass",
        unit: ("mg", 1e6),
        parameter: Parameter::RotorMass,
        range: (38e-6, 54e-6),
        rises: [(Quantity::CollisionFrequency, true), (Quantity::Rate, false)],
    },
    PublishedTrend {
        picture: 11,
        label: "tooth amplitude",
        unit: ("um", 1e6),
        parameter: Parameter::ModeCToothAmplitude,
        range: (1.41e-6, 2.21e-6),
        rises: [(Quantity::CollisionFrequency, false), (Quantity::Rate, true)],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::MotorParams;

    #[test]
    fn exact_every_row_of_the_tables_is_here_and_can_be_run() {
        let count = |place| CASES.iter().filter(|case| case.place == place).count();
        assert_eq!(
            [PaperSection::Table3, PaperSection::Table2, PaperSection::ToothAngle].map(count),
            [2, 13, 4]
        );
        for case in CASES {
            let changed = case
                .changes
                .iter()
                .try_fold(MotorParams::nominal(), |params, &(p, value)| params.with(p, value));
            let params = changed.unwrap();
            let angle_deg = params.get(ToothAngle) + params.get(Parameter::ModeShift);
            match case.place {
                PaperSection::ToothAngle => assert!(case.label.ends_with(&format!("{angle_deg:.3} deg"))),
                PaperSection::Table2 => assert!((angle_deg - 60.135).abs() < 1e-9),
                PaperSection::Table3 => assert!((angle_deg - 60.0).abs() < 1e-9),
            }
        }
    }
}
