//! What a move will take, without moving: `host-sim position --plan`.

use std::fmt;

use controller::{Limits, MoveForecast, Unreachable};
use motor_model::math;
use serde::Serialize;

use super::reach;
use crate::math::plain_number::plain;
use crate::runs::RunError;
use crate::runs::limits;
use crate::scene::{Scene, SceneError};
use crate::world::instruments::{self, assumed};

/// Time in s from which a move that measures for most of its time says so before it starts.
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
    let MoveForecast { time_s, time_sd_s, measuring_s, frames, drives, .. } = match forecast {
        Ok(forecast) => forecast,
        Err(Unreachable { least_rad: None, .. }) => return Err(way_too_long(scene)?.into()),
        Err(unreachable @ Unreachable { least_rad: Some(least_rad), .. }) => {
            // Rounded up: the least tolerance itself has to be accepted.
            let least_deg = (f64::from(least_rad).to_degrees() * 1e5).ceil() * 1e-5;
            let conflict = format!(
                "position.tolerance_deg = {tolerance_deg} and position.deadline_s = {deadline_s} with these \
                     instruments: {unreachable}"
            );
            let hint = format!("--tolerance {least_deg:.5}, a later position.deadline_s, or another camera");
            return Err(SceneError::Conflict { conflict, hint }.into());
        }
    };
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

/// What to change where the map has no drive.
const MORE_MOTORS: &str = "a map of more motors, `response-map --motors 40`";

/// Why the move of `scene` cannot be made to any tolerance: its way takes longer than the deadline, or no drive that
/// its limits allow leads to its target.
///
/// # Errors
/// When the scene is refused.
fn way_too_long(scene: &Scene) -> Result<SceneError, RunError> {
    let limits = Limits { deadline_nanos: u64::MAX, ..limits::of_move(scene) };
    let (instruments, map) = (instruments::checked(scene)?, scene.response_map()?);
    let [to_deg, tolerance_deg, deadline_s, amplitude_max] =
        ["position.to_deg", "position.tolerance_deg", "position.deadline_s", "limits.amplitude_max"]
            .map(|key| scene.number(key));
    #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
    let within = |limits: &Limits, tolerance_deg: f64| {
        let [way_rad, tolerance_rad] = [to_deg, tolerance_deg].map(|deg| deg.to_radians() as f32);
        MoveForecast::try_new(&instruments, &map, limits, way_rad, tolerance_rad)
    };
    Ok(match within(&limits, reach::WIDEST_DEG) {
        Ok(way) => {
            let whole_s = f64::from(within(&limits, tolerance_deg).unwrap_or(way).time_95_s());
            let uncut = within(&Limits { on_max_nanos: u64::MAX, ..limits }, reach::WIDEST_DEG);
            let is_cut = uncut.is_ok_and(|uncut| f64::from(uncut.time_95_s()) <= deadline_s);
            let longer = if is_cut { " a longer limits.drive_on_s," } else { "" };
            SceneError::Conflict {
                conflict: format!(
                    "position.to_deg = {}: the way takes about {} s; position.deadline_s = {}",
                    plain(to_deg),
                    reach::figure(way.time_s.into()),
                    plain(deadline_s)
                ),
                hint: format!("position.deadline_s={},{longer} or a nearer target", (1.01 * whole_s).ceil()),
            }
        }
        Err(_) => SceneError::Conflict {
            conflict: format!(
                "no drive of the map leads to position.to_deg = {}, limits.amplitude_max = {}",
                plain(to_deg),
                plain(amplitude_max)
            ),
            hint: if amplitude_max < 1.0 { "a higher limits.amplitude_max" } else { MORE_MOTORS }.to_owned(),
        },
    })
}

impl MovePlan {
    /// What is to be said before a move: its time, and of a long one that measures for most of it what for.
    pub fn note(&self) -> String {
        let Self { expected_s, expected_sd_s, measuring_s, frames, deadline_s, .. } = self;
        let late = if expected_s > deadline_s { ", longer than its deadline" } else { "" };
        let what_for = if *expected_s > LONG_S && 2.0 * measuring_s > *expected_s {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(sets: &[&str]) -> Scene {
        Scene::of_sets(&sets.iter().map(|&set| set.to_owned()).collect::<Vec<String>>()).unwrap()
    }

    /// 100,000 degrees take 115 s at the 15.14 rad/s of Table 1's map, 7200 degrees 82 s at its 1.539 rad/s the other
    /// way. No tolerance makes that shorter, and a move with the deadline that is named is not refused.
    #[test]
    fn exact_a_way_longer_than_the_deadline_is_named_with_its_time() {
        for (to_deg, said) in [("100000", "takes about 120 s"), ("-7200", "takes about 82 s")] {
            let mut scene = scene(&[&format!("position.to_deg={to_deg}")]);
            let refusal = plan(&scene).unwrap_err().one_line();
            let begun = format!("error: position.to_deg = {to_deg}: the way {said}");
            assert!(refusal.starts_with(&begun) && !refusal.contains("tolerance"), "{refusal}");
            let (_, named) = refusal.split_once("hint: position.deadline_s=").unwrap();
            scene.set("position.deadline_s", named.split(',').next().unwrap()).unwrap();
            assert!(plan(&scene).is_ok(), "{refusal}");
        }
    }

    /// 300 degrees take 3.4 s at 1.539 rad/s, and three thousand looks where the drive may be on for 1 ms at a time.
    #[test]
    fn exact_a_limit_that_makes_a_way_long_is_named() {
        let refusal =
            plan(&scene(&["position.to_deg=-300", "limits.drive_on_s=0.001"])).unwrap_err().one_line();
        assert!(refusal.contains(", a longer limits.drive_on_s, or a nearer target"), "{refusal}");
        let far = plan(&scene(&["position.to_deg=-7200", "limits.drive_on_s=0.001"])).unwrap_err().one_line();
        assert!(!far.contains("drive_on_s"), "{far}");
    }

    /// At 0.3 of full drive no cruise of Table 1's map turns the motor clockwise, and no throw.
    #[test]
    fn exact_a_limit_that_leaves_no_drive_is_named() {
        let weak = scene(&["position.to_deg=300", "limits.amplitude_max=0.3"]);
        let refusal = plan(&weak).unwrap_err().one_line();
        assert!(refusal.contains("limits.amplitude_max = 0.3"), "{refusal}");
        assert!(refusal.ends_with("a higher limits.amplitude_max"), "{refusal}");
    }

    /// What a move takes long for is its measuring where that is most of it: to an eighth of a milli-degree, and not on
    /// a way of 900 degrees.
    #[test]
    fn exact_measuring_is_named_where_it_is_most_of_the_time() {
        for (sets, measures) in [
            (["position.to_deg=5", "position.tolerance_deg=0.00013"], true),
            (["position.to_deg=-900", "position.tolerance_deg=0.001"], false),
        ] {
            let plan = plan(&scene(&sets)).unwrap();
            let note = plan.note();
            assert!(plan.expected_s > LONG_S, "{note}");
            assert_eq!(
                (note.contains("frames at rest"), 2.0 * plan.measuring_s > plan.expected_s),
                (measures, measures)
            );
        }
    }
}
