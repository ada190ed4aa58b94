//! The profile of a scene: how the rate goes, and when it counts as settled.

use controller::rate::Profile;

use super::SETTLE_S;
use crate::runs::RunError;
use crate::scene::{Scene, SceneError};

/// Steps of a staircase.
const STEPS: u16 = 5;
/// Steps of a staircase both ways.
const STEPS_BOTH_WAYS: u16 = 2;
/// Length of a rest of a staircase both ways in s.
const REST_S: f64 = 0.25;

/// The profile of a scene.
///
/// # Errors
/// When the controller refuses the rate.
#[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
pub fn profile(scene: &Scene) -> Result<Profile, RunError> {
    let Profile::Dwell { rate_rad_s } = Profile::dwell(scene.number("rate.deg_s"))? else {
        unreachable!("a dwell")
    };
    let length_s = scene.number("rate.duration_s") as f32;
    Ok(match scene.choice("rate.profile") {
        "staircase" => Profile::Staircase { rate_rad_s, steps: STEPS, step_s: length_s / f32::from(STEPS) },
        "both_ways" if side_s(f64::from(length_s)) < 2.0 * (REST_S + SETTLE_S) => {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "rate.duration_s = {length_s} s leaves no time for four turns after rests of {REST_S} s"
                ),
                hint: format!("{} s and more do", REST_S + 8.0 * (REST_S + SETTLE_S)),
            }
            .into());
        }
        "both_ways" => Profile::BothWays {
            clockwise_rad_s: rate_rad_s.abs(),
            counter_clockwise_rad_s: -rate_rad_s.abs(),
            steps: STEPS_BOTH_WAYS,
            turn_s: (side_s(f64::from(length_s)) - REST_S) as f32,
            rest_s: REST_S as f32,
        },
        "sweep" => Profile::Sweep {
            mean_rad_s: rate_rad_s,
            amplitude_rad_s: 0.25 * rate_rad_s,
            frequency_hz: (1.0, 5.0),
            length_s,
        },
        _ => Profile::Dwell { rate_rad_s },
    })
}

/// Time from one rest of a staircase both ways to the next; it ends with one.
fn side_s(duration_s: f64) -> f64 {
    (duration_s - REST_S) / (2.0 * f64::from(STEPS_BOTH_WAYS))
}

/// Whether the rate counts as settled `time_s` after the start, under the profile of that name.
pub(super) fn settled(profile: &str, time_s: f64, duration_s: f64) -> bool {
    match profile {
        "staircase" => time_s % (duration_s / f64::from(STEPS)) >= SETTLE_S,
        "both_ways" => time_s % side_s(duration_s) >= REST_S + SETTLE_S && time_s < duration_s - REST_S,
        _ => time_s >= SETTLE_S,
    }
}
