//! The modes of a motor's stator: A, the tilting pair, B and C, and what the parametric modal model takes of them.
//!
//! | mode | nodal diameters | shape at the teeth |
//! |---|---|---|
//! | A | 0 | up and down |
//! | tilt | 1 | two, across each other |
//! | B | 2 | near sin 2 theta: antinodes between the springs |
//! | C | 2 | near cos 2 theta: antinodes at the springs |
//!
//! The antinodes of B and C are turned by a few degrees. The parametric modal model adds a mode shift `theta_m` to the
//! teeth's angle `theta_t`: a turn of the antinodes towards rising angles is a mode shift of the opposite sign.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::drive::ModeDrive;
use crate::solution::{Mode, Solution, StatorError};
use crate::solver::Solver;

/// What a mode is to the parametric modal model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeFigures {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Modal mass of the coordinate that is the amplitude at the teeth's radius, kg.
    pub modal_mass_kg: f64,
    /// Exponent of the amplitude as a power of the radius, at the teeth.
    pub exponent: f64,
}

/// What is known of a stator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatorFigures {
    /// Mode A.
    pub a: ModeFigures,
    /// The lower and the higher tilting mode.
    pub tilt: [ModeFigures; 2],
    /// Mode B.
    pub b: ModeFigures,
    /// Mode C.
    pub c: ModeFigures,
    /// Mode shifts `theta_m` of B and C, degrees: the turn of the antinodes, its sign changed.
    pub mode_shift_deg: [f64; 2],
    /// Levers of B and C: motion of a tooth's tip along the rim over the amplitude, without the shape's cosine or sine;
    /// `(t_s + 2 h_t) / R_t` in the parametric modal model. 0 without teeth.
    pub lever: [f64; 2],
    /// Mass against which a tooth is struck, kg: one over the sum of `phi(tooth)^2 / M` over A, B and C.
    pub effective_tooth_mass_kg: f64,
    /// The same with both tilting modes.
    pub effective_tooth_mass_with_tilt_kg: f64,
    /// Largest deflection on the circle of the teeth over that of a tooth, of B and C.
    pub antinode_over_tooth: [f64; 2],
    /// How the field drives B and C; `None` of a stressed stator.
    pub drive: Option<[ModeDrive; 2]>,
    /// Height of the inner rim over the outer one after cooling, m.
    pub bow_m: f64,
    /// Mass, springs and teeth included, kg.
    pub stator_mass_kg: f64,
    /// Moment of inertia about an axis across, kg m2.
    pub transverse_inertia_kg_m2: f64,
}

/// A stator's modes, by their place in [`Solution::modes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// Mode A.
    pub a: usize,
    /// Both tilting modes.
    pub tilt: [usize; 2],
    /// Mode B.
    pub b: usize,
    /// Mode C.
    pub c: usize,
}

impl Places {
    /// Which mode is which.
    ///
    /// # Errors
    /// When one is not among those that were found.
    pub fn of(solution: &Solution) -> Result<Self, StatorError> {
        let found = solution.modes.len();
        let of_order = |order: usize| (0..found).filter(move |place| solution.modes[*place].order == order);
        let missing = |mode| StatorError::NoMode { mode, found };
        let a = of_order(0).next().ok_or(missing("A"))?;
        let mut tilts = of_order(1);
        let tilt = [tilts.next().ok_or(missing("tilt"))?, tilts.next().ok_or(missing("tilt"))?];
        let mut plates = of_order(2);
        let two = [plates.next().ok_or(missing("B"))?, plates.next().ok_or(missing("C"))?];
        // B has the larger sine. The two shapes are across each other, so that one comparison decides.
        let sine = |place: usize| {
            let [c, s] = solution.parts_at_teeth(&solution.modes[place]);
            s.abs() / libm::hypot(c, s)
        };
        let [b, c] = if sine(two[0]) >= sine(two[1]) { two } else { [two[1], two[0]] };
        Ok(Self { a, tilt, b, c })
    }
}

/// An angle of antinodes, which come again after a quarter turn, within an eighth of a turn of 0.
pub(crate) fn wrapped(angle: f64) -> f64 {
    (angle + 0.5 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.5 * FRAC_PI_2
}

impl StatorFigures {
    /// Of a stator that has no result: every figure is NaN.
    pub(crate) const NONE: Self = {
        let none = ModeFigures { frequency_hz: f64::NAN, modal_mass_kg: f64::NAN, exponent: f64::NAN };
        Self {
            a: none,
            tilt: [none; 2],
            b: none,
            c: none,
            mode_shift_deg: [f64::NAN; 2],
            lever: [f64::NAN; 2],
            effective_tooth_mass_kg: f64::NAN,
            effective_tooth_mass_with_tilt_kg: f64::NAN,
            antinode_over_tooth: [f64::NAN; 2],
            drive: None,
            bow_m: f64::NAN,
            stator_mass_kg: f64::NAN,
            transverse_inertia_kg_m2: f64::NAN,
        }
    };

    /// Frequencies of A, B and C, Hz.
    pub fn abc_hz(&self) -> [f64; 3] {
        [self.a, self.b, self.c].map(|mode| mode.frequency_hz)
    }

    /// Solves a drawing and reads its modes.
    ///
    /// # Errors
    /// When the drawing is refused, the solver gives no result, or a mode is not among those found.
    pub fn of(drawing: &Drawing, solver: &Solver) -> Result<Self, StatorError> {
        Self::read(&Solution::of(drawing, solver)?, drawing)
    }

    /// Reads the modes of the solution of a drawing.
    ///
    /// # Errors
    /// When one is not among those that were found.
    pub fn read(solution: &Solution, drawing: &Drawing) -> Result<Self, StatorError> {
        let places = Places::of(solution)?;
        let mode = |place: usize| &solution.modes[place];
        let figures = |place: usize| ModeFigures {
            frequency_hz: mode(place).frequency_hz,
            modal_mass_kg: solution.modal_mass_kg(mode(place)),
            exponent: solution.exponent(mode(place)),
        };
        // B = sin 2 (theta - turn): its antinode is a half quarter turn from that of the cosine.
        let antinode = |place: usize| {
            let [c, s] = solution.parts_at_teeth(mode(place));
            0.5 * libm::atan2(s, c)
        };
        let turns = [wrapped(antinode(places.b) - 0.25 * PI), wrapped(antinode(places.c))];
        let softness = |places: &[usize]| -> f64 {
            let squares =
                |place: &usize| solution.at_tips(mode(*place)).map(|(_, [_, _, w])| w * w).sum::<f64>() / 4.0;
            places.iter().map(squares).sum()
        };
        let three = softness(&[places.a, places.b, places.c]);
        let two_places = [places.b, places.c];
        Ok(Self {
            a: figures(places.a),
            tilt: places.tilt.map(figures),
            b: figures(places.b),
            c: figures(places.c),
            mode_shift_deg: turns.map(|turn| -turn.to_degrees()),
            lever: two_places.map(|place| lever(solution, mode(place))),
            effective_tooth_mass_kg: inverse(three),
            effective_tooth_mass_with_tilt_kg: inverse(three + softness(&places.tilt)),
            antinode_over_tooth: two_places.map(|place| antinode_over_tooth(solution, mode(place))),
            drive: (!drawing.stressed).then(|| {
                [(places.b, 0.25 * PI), (places.c, 0.0)]
                    .map(|(place, axis)| ModeDrive::of(solution, drawing, mode(place), axis))
            }),
            bow_m: solution.bow_m,
            stator_mass_kg: solution.mass.mass_kg,
            transverse_inertia_kg_m2: solution.mass.transverse_kg_m2,
        })
    }
}

/// One over a value; 0 where there is none, for want of teeth.
fn inverse(value: f64) -> f64 {
    if value > 0.0 { 1.0 / value } else { 0.0 }
}

/// The lever of a mode of order 2, from the motion of the tips along the rim. With `w = c cos 2 theta + s sin 2 theta`
/// a tip moves by `-lever / 2 dw/dtheta`; the lever is that of least squares over the teeth.
fn lever(solution: &Solution, mode: &Mode) -> f64 {
    let [c, s] = solution.parts_at_teeth(mode);
    let (mut product, mut square) = (0.0, 0.0);
    for (theta, [x, y, _]) in solution.at_tips(mode) {
        let (sin, cos) = libm::sincos(theta);
        let along = y * cos - x * sin;
        let (sin_2, cos_2) = libm::sincos(2.0 * theta);
        let half_slope = s * cos_2 - c * sin_2;
        product -= along * half_slope;
        square += half_slope * half_slope;
    }
    if square > 0.0 { product / square } else { 0.0 }
}

/// Largest deflection on the circle of the teeth over the mean size at their tips.
fn antinode_over_tooth(solution: &Solution, mode: &Mode) -> f64 {
    let tips: Vec<f64> = solution.at_tips(mode).map(|(_, [_, _, w])| w * w).collect();
    let circles = solution.deflections(mode);
    let largest = circles[solution.mesh.tooth_circle].iter().fold(0.0_f64, |largest, w| largest.max(w.abs()));
    if tips.is_empty() {
        return 0.0;
    }
    #[expect(clippy::cast_precision_loss, reason = "four")]
    let mean = libm::sqrt(tips.iter().sum::<f64>() / tips.len() as f64);
    largest / mean
}
