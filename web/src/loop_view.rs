//! A motor in closed loop, run some ticks at a time, with what the page shows of it.

use motor_model::{DriveCommand, DriveMode, Parameter, TiltingParameter};
use serde_json::{Map, Value, json};
use simulation::Scene;
use simulation::runs::closed_loop::{self, PositioningMoment};
use simulation::runs::position::{MoveOutcome, MoveRun};
use simulation::runs::record::{Task, mode_word};
use simulation::runs::{RunError, filter, health_words};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::rows::Rows;

/// A motor in closed loop.
#[wasm_bindgen]
pub struct LoopView {
    run: MoveRun,
    /// What became of the move, once it has ended.
    outcome: Option<MoveOutcome>,
    last: Option<PositioningMoment>,
    rows: Rows,
    /// Driven by hand: there is no move that could end.
    by_hand: bool,
}

/// The scene of lines of `key=value`.
fn scene(assignments: &str) -> Result<Scene, RunError> {
    let lines = assignments.lines().filter(|line| !line.trim().is_empty());
    Ok(Scene::of_sets(&lines.map(str::to_owned).collect::<Vec<_>>())?)
}

/// A refusal as the command prints it.
fn refusal(error: &RunError) -> String {
    error.one_line()
}

#[wasm_bindgen]
impl LoopView {
    /// The motor of a scene, which `assignments` describes, one `key=value` a line, at rest before its move.
    ///
    /// # Errors
    /// The refusal, when the scene is refused.
    #[wasm_bindgen(constructor)]
    pub fn new(assignments: &str) -> Result<Self, String> {
        Self::of(assignments).map_err(|error| refusal(&error))
    }

    fn of(assignments: &str) -> Result<Self, RunError> {
        let scene = scene(assignments)?;
        let run = MoveRun::new(&scene, closed_loop::tuning(&scene))?;
        Ok(Self { run, outcome: None, last: None, rows: Rows::new(), by_hand: false })
    }

    /// Runs `ticks` ticks of 10 us and adds a row after each `every` of them, and after the last.
    pub fn advance(&mut self, ticks: u32, every: u32) {
        for number in 1..=ticks {
            let moment = self.run.next_tick();
            if self.outcome.is_none() && !self.by_hand {
                self.outcome = self.run.add(&moment);
            }
            let closed_loop = self.run.closed_loop();
            self.rows.add(closed_loop, &moment);
            if number % every.max(1) == 0 || number == ticks {
                self.rows.end_row(closed_loop.plant(), &moment);
            }
            self.last = Some(moment);
        }
    }

    /// The rows since the last call, one after the other.
    pub fn rows(&mut self) -> Vec<f64> {
        self.rows.take_rows()
    }

    /// The impacts since the last call, the last ones of many.
    pub fn impacts(&mut self) -> Vec<f64> {
        self.rows.take_impacts()
    }

    /// Begins the move of `assignments` from where the rotor is: only the target may differ.
    ///
    /// # Errors
    /// The refusal, when the scene is refused; then all is as it was.
    pub fn go_on(&mut self, assignments: &str) -> Result<(), String> {
        scene(assignments).and_then(|scene| self.run.go_on(&scene)).map_err(|error| refusal(&error))?;
        (self.outcome, self.by_hand) = (None, false);
        Ok(())
    }

    /// Takes the faults of `assignments` from now on: only what happens later may differ.
    ///
    /// # Errors
    /// The refusal, when the scene is refused; then all is as it was.
    pub fn change_faults(&mut self, assignments: &str) -> Result<(), String> {
        scene(assignments).and_then(|scene| self.run.change_faults(&scene)).map_err(|error| refusal(&error))
    }

    /// Drives by hand: mode `b`, `c`, or anything else for off, until the next move begins.
    pub fn drive_by_hand(&mut self, mode: &str, amplitude: f32) {
        let command = match mode {
            "b" => DriveCommand::saturating(DriveMode::B, amplitude),
            "c" => DriveCommand::saturating(DriveMode::C, amplitude),
            _ => DriveCommand::OFF,
        };
        self.run.drive_by_hand(command);
        (self.outcome, self.by_hand) = (None, true);
    }

    /// Steps of the plant so far.
    #[expect(clippy::cast_precision_loss, reason = "2^53 steps are years")]
    pub fn steps(&self) -> f64 {
        self.run.closed_loop().plant().steps() as f64
    }

    /// What the controller does, what it knows of its estimate, and what became of the move, as JSON.
    pub fn status(&self) -> String {
        let scene = self.run.scene();
        let Some(last) = &self.last else { return "{}".to_owned() };
        let report = &last.report;
        json!({
            "t_s": last.seconds(),
            "target_deg": scene.number("position.to_deg"),
            "tolerance_deg": scene.number("position.tolerance_deg"),
            "phase": Task::Position(report.phase).word(),
            "health": health_words::words(report.health),
            "why": health_words::why_not_good(std::iter::once(report.health)),
            "mode": mode_word(report.applied),
            "amplitude": report.applied.amplitude(),
            "filter": filter::chosen(scene),
            "outcome": self.outcome,
            "verdict": self.outcome.as_ref().map(MoveOutcome::verdict),
        })
        .to_string()
    }

    /// The values of the true motor, by their keys, as JSON.
    pub fn true_motor(&self) -> String {
        let plant = self.run.closed_loop().plant();
        let mut values = Map::new();
        for parameter in Parameter::ALL {
            let key = format!("plant.{}", parameter.spec().key);
            values.insert(key, plant.params().get(parameter).into());
        }
        if let Some(params) = plant.tilting_params() {
            for parameter in TiltingParameter::ALL {
                values.insert(format!("plant.{}", parameter.spec().key), params.get(parameter).into());
            }
        }
        let scene = self.run.scene();
        for (name, key) in [
            ("camera_radius_m", "camera.tracking_radius_m"),
            ("camera_noise_m", "camera.noise_m"),
            ("camera_resolution_m", "camera.resolution_m"),
        ] {
            values.insert(name.to_owned(), scene.number(key).into());
        }
        values.insert("camera_marks".to_owned(), scene.integer("camera.marks").into());
        values.insert("tooth_angle_deg".to_owned(), plant.params().effective_tooth_angle_deg().into());
        values.insert("tilting".to_owned(), plant.tilting_params().is_some().into());
        Value::from(values).to_string()
    }
}

#[cfg(test)]
mod tests;
