//! The profile of a scene: how the rate goes, and when it counts as settled.

use controller::rate::Profile;

use super::SETTLE_S;
use crate::runs::RunError;
use crate::scene::{Scene, SceneError};

/// Steps of a staircase.
const STEPS: u16 = 5;
/// Shortest staircase in s: a half of each step counts as settled.
const LEAST_STAIRCASE_S: f64 = 2.0 * SETTLE_S * 5.0;
/// Steps of a staircase both ways.
const STEPS_BOTH_WAYS: u16 = 2;
/// Length of a rest of a staircase both ways in s.
const REST_S: f64 = 0.25;

/// The profile of a scene.
///
/// # Errors
/// When the controller refuses the rate, or the run is too short to judge each step of its profile.
#[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
pub fn profile(scene: &Scene) -> Result<Profile, RunError> {
    let Profile::Dwell { rate_rad_s } = Profile::dwell(scene.number("rate.deg_s"))? else {
        unreachable!("a dwell")
    };
    let length_s = scene.number("rate.duration_s") as f32;
    let too_short = |what: &str, least_s: f64| {
        let conflict = format!("rate.duration_s = {length_s} s leaves no time for {what}");
        Err(SceneError::Conflict { conflict, hint: format!("{least_s} s and more do") }.into())
    };
    Ok(match scene.choice("rate.profile") {
        "staircase" if f64::from(length_s) < LEAST_STAIRCASE_S => {
            return too_short("five steps of which a half counts as settled", LEAST_STAIRCASE_S);
        }
        "staircase" => Profile::Staircase { rate_rad_s, steps: STEPS, step_s: length_s / f32::from(STEPS) },
        "both_ways" if side_s(f64::from(length_s)) < 2.0 * (REST_S + SETTLE_S) => {
            let what = format!("four turns after rests of {REST_S} s");
            return too_short(&what, REST_S + 8.0 * (REST_S + SETTLE_S));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Five steps of twice 0.25 s, and four turns of 0.75 s at least after five rests of 0.25 s.
    #[test]
    fn exact_a_profile_whose_steps_cannot_be_judged_is_refused_with_a_length_that_can() {
        for (name, long_s, short_s) in
            [("staircase", "2.5", "2.4"), ("staircase", "2.5", "1"), ("both_ways", "4.25", "4.2")]
        {
            let of = |duration_s: &str| {
                let sets = [format!("rate.profile={name}"), format!("rate.duration_s={duration_s}")];
                profile(&Scene::of_sets(&sets).unwrap())
            };
            assert!(of(long_s).is_ok(), "{name}");
            let refusal = of(short_s).unwrap_err().one_line();
            assert!(refusal.contains(&format!("{short_s} s leaves no time for")), "{refusal}");
            assert!(refusal.contains(&format!("hint: {long_s} s and more do")), "{refusal}");
        }
    }
}
