//! From a drawing to a motor: the stator by finite elements, `host-sim stator`.
//!
//! The crate `stator` makes the mesh, runs CalculiX and reads the modes; here are its scene, its ensemble in parts, and
//! what is shown of both.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the drawing of a scene; one stator, fitted or as drawn |
//! | `members`, `quantities` | stators drawn over what is not published: the tables that are committed, their spreads |
//! | `motor_scene` | the keys `motor.` that follow from a stator or an ensemble, as a scene file |
//! | `driven` | the field: strain and direction that give the amplitudes that were measured |
//! | `measured_mode`, `damping`, `free_response` | what was measured of B, C; what damps; sweep, ring-down, impulse |
//! | `tables`, `pictures`, `report` | what is shown of them |
//! | `sweeps`, `page` | one value changed at a time; the page of results |

mod damping;
mod driven;
mod error;
mod free_response;
mod measured_mode;
pub mod members;
mod motor_scene;
pub mod page;
mod pictures;
pub mod quantities;
mod report;
pub mod sweeps;
mod tables;

pub use error::StatorStudyError;
pub use measured_mode::MeasuredMode;

use driven::DrivenStator;
use measured_mode::measured;
use serde_json::json;
use stator::drawing::table::{NUMBERS, SPREAD_SEED_KEY, WORDS};
use stator::fit::{self, Fitted, Wanted};
use stator::modes::StatorFigures;
use stator::solution::{Solution, StatorError};
use stator::solver::Solver;
pub use stator::{Drawing, solver};

use simulation::scene::{Kind, Scene, registry};

/// By which part a fit may miss a frequency: a tenth of what the mesh costs.
const FIT_TOLERANCE: f64 = 5e-4;

/// The drawing that a scene describes.
pub fn drawing(scene: &Scene) -> Drawing {
    let mut drawing = Drawing { spread_seed: scene.integer(SPREAD_SEED_KEY), ..Drawing::default() };
    for field in NUMBERS {
        if let Some(value) = drawing.numbers.value_mut(field.key) {
            *value = scene.number(field.key);
        }
    }
    for field in WORDS {
        drawing.set_word(field.key, scene.choice(field.key));
    }
    drawing
}

/// The frequencies of the design: its modes A, B and C.
pub fn wanted(scene: &Scene) -> Wanted {
    let keys = ["motor.mode_a.frequency_hz", "motor.mode_b.frequency_hz", "motor.mode_c.frequency_hz"];
    Wanted { frequencies_hz: keys.map(|key| scene.number(key)), tolerance: FIT_TOLERANCE }
}

/// What a scene says of the motor itself: the keys `motor.` that it sets.
pub fn given_motor(scene: &Scene) -> Vec<(&'static str, f64)> {
    let numbers = registry().filter(|setting| setting.key.starts_with("motor."));
    let numbers = numbers.filter(|setting| matches!(setting.kind, Kind::Number { .. }));
    let values = numbers.map(|setting| (setting.key, scene.number(setting.key)));
    values.filter(|(key, _)| scene.is_set(key)).collect()
}

/// One stator.
#[derive(Clone, Debug)]
pub struct SolvedStator {
    /// Its drawing, with what a fit has found.
    pub drawing: Drawing,
    /// What is known of it.
    pub figures: StatorFigures,
    /// Its modes, with their shapes.
    pub solution: Solution,
    /// Modes B and C of the design, as they were measured: damping and amplitude do not follow from a drawing.
    pub measured: [MeasuredMode; 2],
    /// Rounds of a fit; `None` of a stator as it was drawn.
    pub fit_rounds: Option<usize>,
}

impl SolvedStator {
    /// The stator as it is drawn.
    ///
    /// # Errors
    /// When the drawing is refused, the solver gives no result, or a mode is missing.
    pub fn as_drawn(drawing: &Drawing, solver: &Solver) -> Result<Self, StatorError> {
        let solution = Solution::of(drawing, solver)?;
        let figures = StatorFigures::read(&solution, drawing)?;
        let measured = measured(&Scene::default());
        Ok(Self { drawing: *drawing, figures, solution, measured, fit_rounds: None })
    }

    /// The stator whose thickness and springs meet `wanted`. `progress` is called after each solution.
    ///
    /// # Errors
    /// The same, and when no such stator is found.
    pub fn fitted(
        drawing: &Drawing,
        wanted: &Wanted,
        solver: &Solver,
        progress: &mut dyn FnMut(),
    ) -> Result<Self, StatorError> {
        let Fitted { drawing, rounds, .. } = fit::fit(drawing, wanted, solver, progress)?.met(wanted)?;
        Ok(Self { fit_rounds: Some(rounds), ..Self::as_drawn(&drawing, solver)? })
    }

    /// The same, of the design of a scene.
    #[must_use]
    pub fn of_design(self, scene: &Scene) -> Self {
        Self { measured: measured(scene), ..self }
    }

    /// The result for programs: one object.
    pub fn json(&self) -> String {
        let f = &self.figures;
        let [t1, t2] = f.tilt;
        let of = |value: fn(&stator::modes::ModeFigures) -> f64| {
            json!({
                "a": value(&f.a),
                "tilt_1": value(&t1),
                "tilt_2": value(&t2),
                "b": value(&f.b),
                "c": value(&f.c),
            })
        };
        let pair = |pair: [f64; 2]| json!({ "b": pair[0], "c": pair[1] });
        let fitted: serde_json::Map<_, _> = fit::fitted_values(&self.drawing)
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value.into()))
            .collect();
        json!({
            "stressed": self.drawing.stressed,
            "frequencies_hz": of(|mode| mode.frequency_hz),
            "modal_mass_kg": of(|mode| mode.modal_mass_kg),
            "tooth_exponent": of(|mode| mode.exponent),
            "mode_shift_deg": pair(f.mode_shift_deg),
            "lever": pair(f.lever),
            "antinode_over_tooth": pair(f.antinode_over_tooth),
            "effective_tooth_mass_kg": f.effective_tooth_mass_kg,
            "effective_tooth_mass_with_tilt_kg": f.effective_tooth_mass_with_tilt_kg,
            "drive": DrivenStator::of(self).map(|driven| driven.json(self.drawing.numbers.field_angle_deg)),
            "bow_m": f.bow_m,
            "stator_mass_kg": f.stator_mass_kg,
            "transverse_inertia_kg_m2": f.transverse_inertia_kg_m2,
            "nodes": self.solution.mesh.nodes.len(),
            "fit_rounds": self.fit_rounds,
            "drawing": fitted,
        })
        .to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene that sets nothing is the default drawing, and every key of a scene changes the drawing.
    #[test]
    fn exact_a_scene_describes_a_drawing() {
        let scene = Scene::default();
        assert_eq!(drawing(&scene), Drawing::default());
        let differs = |key: &str, value: &str| {
            let mut scene = Scene::default();
            scene.set(key, value).unwrap();
            assert_ne!(drawing(&scene), Drawing::default(), "{key}");
        };
        for field in NUMBERS {
            differs(
                field.key,
                &format!("{:e}", if field.default > field.min { field.min } else { field.max }),
            );
        }
        for field in WORDS {
            let other = field.of.iter().find(|word| **word != field.default).unwrap();
            differs(field.key, other);
        }
        differs(SPREAD_SEED_KEY, "3");
        let bits = |wanted: Wanted| wanted.frequencies_hz.map(f64::to_bits);
        assert_eq!(bits(wanted(&scene)), bits(Wanted::PAPER));
    }
}
