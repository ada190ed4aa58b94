//! Whether a plan begins with a pilot, and what is said of it.

use super::plan::{TurnPlan, WANTED_PPM};
use simulation::scene::{RotorModel, Scene, SceneError};

/// Length of a pilot where the scene sets none and the rotor tilts, in s.
const PILOT_S: f64 = 10.0;

const KEY: &str = "calibrate.pilot_s";

/// `scene` with the pilot of its plan. What the scene sets stays, 0 for none as well. Otherwise a rotor that tilts has
/// a pilot of ten seconds, where the plan is long enough for it and has no staircase: which rates cost little coning is
/// not known before. A level rotor has none: it has no coning.
///
/// # Errors
/// When the scene sets a key that its rotor does not use.
pub fn with_pilot(scene: &Scene) -> Result<Scene, SceneError> {
    let mut scene = scene.clone();
    let tilts = RotorModel::of(&scene)? != RotorModel::HeightOnly;
    let is_staircase = scene.integer("calibrate.steps") > 1;
    if tilts && !is_staircase && !scene.is_set(KEY) && goes_into_plan(&scene, PILOT_S) {
        scene.set(KEY, &PILOT_S.to_string())?;
    }
    Ok(scene)
}

/// Whether a pilot of `pilot_s` takes at most half of the plan of `scene`, and each of its five parts four intervals.
pub(super) fn goes_into_plan(scene: &Scene, pilot_s: f64) -> bool {
    pilot_s <= 0.5 * scene.number("calibrate.duration_s")
        && pilot_s / 5.0 >= 4.0 * scene.number("calibrate.interval_s")
}

impl TurnPlan {
    /// What the plan promises, and what 10 ppm would take: known before the rotor turns through it.
    pub fn forecast(&self) -> String {
        let needed = self.needed_s.map_or_else(
            || format!("no plan, however long, promises {WANTED_PPM:.0} ppm"),
            |needed_s| format!("a plan of {needed_s:.0} s promises {WANTED_PPM:.0} ppm"),
        );
        format!(
            "by the first {:.0} s of the first motor 95 % of its scale factors will be within {:.1} ppm after {:.0} s; \
             {needed}",
            self.seen_s, self.within_95_ppm, self.duration_s
        )
    }

    /// What the pilot chose.
    fn choice(&self) -> String {
        let share =
            |(rate_deg_s, share): (f64, f64)| format!("{rate_deg_s:+.0} deg/s for {:.0} %", 100.0 * share);
        format!(
            "A pilot chose rates and times: {} of the time that was left, {} of it, and rest.",
            share(self.clockwise),
            share(self.counter_clockwise)
        )
    }
}

/// What is said of a plan with a pilot of `pilot_s`, 0 for none, that led to `plan`.
pub(super) fn remarks(pilot_s: f64, plan: Option<&TurnPlan>) -> String {
    match plan {
        Some(plan) => format!("{} Told before the turns: {}.", plan.choice(), plan.forecast()),
        None if pilot_s > 0.0 => format!(
            "A pilot of {pilot_s:.0} s chose nothing: it does not tell scale factor from bias. Nearly half of the time \
             after it went to either side."
        ),
        None => {
            "No pilot chose rates and times: they are those of the keys. One does with calibrate.pilot_s=10."
                .to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pilot_s(sets: &[&str]) -> f64 {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        with_pilot(&Scene::of_sets(&sets).unwrap()).unwrap().number(KEY)
    }

    /// A rotor that tilts has a pilot where it goes into the plan, a level one has none, and what is set stays.
    #[test]
    fn tool_a_rotor_that_tilts_has_a_pilot() {
        let tilting = "plant.rotor=tilting";
        for (sets, expected_s) in [
            (&[][..], 0.0),
            (&["calibrate.pilot_s=5"], 5.0),
            (&[tilting], 10.0),
            (&["plant.rotor=tilting_without_shift"], 10.0),
            (&[tilting, "calibrate.pilot_s=0"], 0.0),
            (&[tilting, "calibrate.pilot_s=20"], 20.0),
            (&[tilting, "calibrate.duration_s=20"], 10.0),
            (&[tilting, "calibrate.duration_s=19.9"], 0.0),
            (&[tilting, "calibrate.interval_s=0.51"], 0.0),
            (&[tilting, "calibrate.steps=2"], 0.0),
        ] {
            assert!((pilot_s(sets) - expected_s).abs() < 1e-12, "{sets:?}: {}", pilot_s(sets));
        }
    }
}
