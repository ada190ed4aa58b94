//! What a move will take, without moving: `host-sim position --plan`.

use std::fmt;

use controller::{MoveForecast, Unreachable};
use motor_model::math;
use serde::Serialize;

use super::reach;
use crate::runs::RunError;
use crate::runs::limits;
use crate::scene::{Scene, SceneError};
use crate::world::instruments::{self, assumed};

/// Time in s from which a move says before it starts what it takes long for.
const LONG_S: f64 = 5.0;

/// What a move will take.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MovePlan {
    /// Target angle.
    pub target_deg: f64,
    /// Error within which 95 % of the moves end.
    pub error_deg: f64,
    /// Expected time.
    pub expected_s: f64,
    /// Standard deviation of that over motors.
    pub expected_sd_s: f64,
    /// Part of the time that measures to the tolerance.
    pub measuring_s: f64,
    /// Frames that are measured for that.
    pub frames: f64,
    /// Standard deviation of the angle of one frame.
    pub frame_mdeg: f64,
    /// Drives until the target is near enough to be measured.
    pub drives: u32,
    /// Time after which the move is given up.
    pub deadline_s: f64,
}

/// The forecast of the move of `scene`, or why its tolerance cannot be met.
///
/// # Errors
/// When the scene is refused.
pub fn forecast(scene: &Scene) -> Result<Result<MoveForecast, Unreachable>, RunError> {
    forecast_of_way(scene, scene.number("position.to_deg"))
}

/// The same for a way of `way_deg` to the target, from wherever the rotor is.
pub(super) fn forecast_of_way(
    scene: &Scene,
    way_deg: f64,
) -> Result<Result<MoveForecast, Unreachable>, RunError> {
    let tolerance_deg = scene.number("position.tolerance_deg");
    let instruments = instruments::checked(scene)?;
    #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
    let [distance_rad, tolerance_rad] = [way_deg, tolerance_deg].map(|deg| deg.to_radians() as f32);
    limits::check_target(scene)?;
    let limits = limits::of_move(scene);
    let map = scene.response_map()?;
    reach::check(&instruments, &map, &limits, way_deg, tolerance_deg)?;
    Ok(MoveForecast::try_new(&instruments, &map, &limits, distance_rad, tolerance_rad))
}

/// The plan of the move of `scene`.
///
/// # Errors
/// When the scene is refused, or its tolerance cannot be met before its deadline.
pub fn plan(scene: &Scene) -> Result<MovePlan, RunError> {
    plan_of(scene, forecast(scene)?)
}

/// The plan of the move of `scene` by its forecast.
///
/// # Errors
/// When its tolerance cannot be met before its deadline.
pub fn plan_of(scene: &Scene, forecast: Result<MoveForecast, Unreachable>) -> Result<MovePlan, RunError> {
    let (target_deg, tolerance_deg) =
        (scene.number("position.to_deg"), scene.number("position.tolerance_deg"));
    let deadline_s = scene.number("position.deadline_s");
    let MoveForecast { time_s, time_sd_s, measuring_s, frames, drives, .. } =
        forecast.map_err(|unreachable| SceneError::Conflict {
            conflict: format!(
                "position.tolerance_deg = {tolerance_deg} and position.deadline_s = {deadline_s} with these \
                 instruments: {unreachable}"
            ),
            hint: match unreachable.least_rad {
                // Rounded up: the least tolerance itself has to be accepted.
                Some(least_rad) => {
                    let least_deg = (f64::from(least_rad).to_degrees() * 1e5).ceil() * 1e-5;
                    format!("--tolerance {least_deg:.5}, a later position.deadline_s, or another camera")
                }
                None => "a later position.deadline_s, or another camera".to_owned(),
            },
        })?;
    Ok(MovePlan {
        target_deg,
        error_deg: tolerance_deg,
        expected_s: time_s.into(),
        expected_sd_s: time_sd_s.into(),
        measuring_s: measuring_s.into(),
        frames: frames.into(),
        frame_mdeg: 1e3 * math::sqrt(assumed(scene).camera.variance_rad2()).to_degrees(),
        drives,
        deadline_s,
    })
}

impl MovePlan {
    /// What is to be said before a move: its time, and of one that takes long what for.
    pub fn note(&self) -> String {
        let Self { expected_s, expected_sd_s, measuring_s, frames, deadline_s, .. } = self;
        let late = if expected_s > deadline_s { ", longer than its deadline" } else { "" };
        let what_for = if *expected_s > LONG_S {
            format!(": {measuring_s:.1} s for {frames:.0} frames at rest")
        } else {
            String::new()
        };
        format!("note: this move takes about {expected_s:.2} s +- {expected_sd_s:.2} s{late}{what_for}")
    }
}

impl fmt::Display for MovePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "target             {:+.4} deg", self.target_deg)?;
        writeln!(f, "error              within {} deg in 95 % of the moves", self.error_deg)?;
        writeln!(
            f,
            "time expected      {:.3} s +- {:.3} s, deadline {} s",
            self.expected_s, self.expected_sd_s, self.deadline_s
        )?;
        writeln!(
            f,
            "measuring          {:.3} s of it, for {:.0} frames of {:.1} mdeg each",
            self.measuring_s, self.frames, self.frame_mdeg
        )?;
        writeln!(f, "drives             about {}", self.drives)
    }
}
