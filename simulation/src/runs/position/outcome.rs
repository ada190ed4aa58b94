//! What became of a move, in numbers and in words.

use std::collections::BTreeMap;
use std::fmt;

use controller::StopReason;
use estimator::{Innovation, Verdict};
use serde::{Deserialize, Serialize};

use super::reason;
use crate::runs::rotor_tilt::TiltFigures;
use crate::runs::stated_errors::{StatedErrors, hundredths_or_dash};
use crate::scene::Scene;
use crate::world::instruments::camera::MarkCounts;

/// What became of a move.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MoveOutcome {
    /// Target angle.
    pub target_deg: f64,
    /// Tolerance asked for.
    pub tolerance_deg: f64,
    /// True angle at the end.
    pub final_angle_true_deg: f64,
    /// True angle at the end less the target.
    pub final_error_mdeg: f64,
    /// When the controller began to hold the target that it held to the end; `null` if it did not.
    pub settle_time_s: Option<f64>,
    /// Simulated time.
    pub duration_s: f64,
    /// How often the drive changed between off, mode B and mode C.
    pub drive_switches: u32,
    /// Time with the drive on.
    pub drive_on_s: f64,
    /// Root mean square of estimated less true angle over the whole run; `null` without an estimate.
    pub rms_estimate_error_mdeg: Option<f64>,
    /// The same while the rotor moved; `null` if it did not.
    pub rms_estimate_error_moving_mdeg: Option<f64>,
    /// Errors of the estimate beside what the filter states, over the whole run.
    #[serde(flatten)]
    pub stated: StatedErrors,
    /// Tilt and shift; left out of a rotor that does not tilt.
    #[serde(flatten)]
    pub tilt: Option<TiltFigures>,
    /// Largest true angle beyond the target, seen from where the move began; at least 0.
    pub overshoot_deg: f64,
    /// The filter that ran.
    pub filter: &'static str,
    /// Why the controller gave up; `null` if it did not.
    pub stopped: Option<String>,
    /// The same as a sentence; `null` if it did not.
    pub reason: Option<String>,
    /// Time that was expected before the move; `null` if the tolerance cannot be met before the deadline.
    pub expected_s: Option<f64>,
    /// Standard deviation of that; `null` as well.
    pub expected_sd_s: Option<f64>,
    /// What to change; `null` if it did not give up.
    pub hint: Option<String>,
    /// Time that the controller waited with the drive off, by what it waited for.
    pub waited_s: BTreeMap<&'static str, f64>,
    /// Share of the time, 0 to 1, per health of the estimate.
    pub health: BTreeMap<String, f64>,
    /// What became of the camera's frames; left out where the loop does not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<FrameCounts>,
    /// Pictures that were not made of all marks; left out of a camera that tracks a single mark.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marks: Option<MarkCounts>,
    /// Whether the controller holds the target and the true angle is within the tolerance.
    pub ok: bool,
    /// The seed of the run.
    pub seed: u64,
}

/// What became of the camera's frames in the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FrameCounts {
    /// Frames that arrived.
    pub arrived: u64,
    /// Those that the filter did not use.
    pub refused: u64,
}

impl FrameCounts {
    /// Adds the innovation of a frame.
    pub(super) fn add<T>(&mut self, innovation: &Innovation<T>) {
        self.arrived += 1;
        self.refused += u64::from(matches!(innovation.verdict, Verdict::Rejected(_)));
    }
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MoveEnding {
    /// Held as on target, and the true angle is within three tolerances.
    Reached,
    /// Held as on target, and it is not.
    Wrong,
    /// Ended with a reason.
    GaveUp,
    /// Ended by the deadline.
    TimedOut,
}

/// A move that is held as on target is wrong from so many tolerances on.
const WRONG_TOLERANCES: f64 = 3.0;

impl MoveOutcome {
    /// How it ended.
    pub fn ending(&self) -> MoveEnding {
        let wrong = 1e-3 * self.final_error_mdeg.abs() > WRONG_TOLERANCES * self.tolerance_deg;
        match (&self.stopped, self.settle_time_s) {
            (Some(why), _) if why == "TimedOut" => MoveEnding::TimedOut,
            (Some(_), _) | (None, None) => MoveEnding::GaveUp,
            (None, Some(_)) if wrong => MoveEnding::Wrong,
            (None, Some(_)) => MoveEnding::Reached,
        }
    }

    /// The same of a controller that gave up.
    pub(super) fn stopped(self, why: StopReason, scene: &Scene) -> Self {
        let (reason, hint) = reason::sentences(why, &self, scene);
        Self { stopped: Some(format!("{why:?}")), reason: Some(reason), hint: Some(hint), ..self }
    }
}

impl MoveOutcome {
    /// How it ended, in a few words.
    pub fn verdict(&self) -> String {
        match (&self.stopped, self.ok) {
            (Some(why), _) => format!("gave up, {why}"),
            (None, true) => "on target".to_owned(),
            (None, false) => "held as on target, but off it".to_owned(),
        }
    }

    /// The outcome in words: what is said, and of what.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let time = match self.settle_time_s {
            Some(settle_time_s) => format!("{settle_time_s:.4} s, watched until {:.4} s", self.duration_s),
            None => format!("{:.4} s", self.duration_s),
        };
        let mut lines = vec![
            (
                "target",
                format!(
                    "{:+.4} deg, tolerance {} deg, seed {}",
                    self.target_deg, self.tolerance_deg, self.seed
                ),
            ),
            ("true final angle", format!("{:+.5} deg", self.final_angle_true_deg)),
            ("error", format!("{:+.3} mdeg: {}", self.final_error_mdeg, self.verdict())),
            ("time taken", time),
            ("drive", format!("{} switches, {:.4} s on", self.drive_switches, self.drive_on_s)),
            ("overshoot", format!("{:.4} deg", self.overshoot_deg)),
            ("filter", self.filter.to_owned()),
            (
                "estimator error",
                format!(
                    "{} mdeg rms, {} while moving",
                    hundredths_or_dash(self.rms_estimate_error_mdeg),
                    hundredths_or_dash(self.rms_estimate_error_moving_mdeg)
                ),
            ),
        ];
        let waits = self.waited_s.iter().map(|(what, seconds)| format!("{seconds:.2} s for {what}"));
        let waits = waits.collect::<Vec<_>>().join(", ");
        lines.extend((!waits.is_empty()).then_some(("drive off", waits)));
        let health = self.health.iter().map(|(health, share)| format!("{health} {:.0} %", 100.0 * share));
        let health = health.collect::<Vec<_>>().join(", ");
        lines.extend((!health.is_empty()).then_some(("estimate", health)));
        lines.extend(self.tilt.as_ref().map(|tilt| ("rotor", tilt.to_string())));
        lines.extend(self.frames.map(|FrameCounts { arrived, refused }| {
            ("frames", format!("{arrived} arrived, {refused} of them refused by the filter"))
        }));
        lines.extend(self.marks.map(|MarkCounts { frames, mark_lost, mark_left_out, refused }| {
            let counts = format!(
                "of {frames} pictures taken {mark_lost} missed a mark, {mark_left_out} left one out, {refused} were \
                 refused since their marks disagree"
            );
            ("marks", counts)
        }));
        lines.extend(self.reason.clone().map(|reason| ("reason", reason)));
        lines.extend(self.hint.clone().map(|hint| ("what to change", hint)));
        lines
    }
}

impl fmt::Display for MoveOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines().iter().try_for_each(|(what, said)| writeln!(f, "{what:<19}{said}"))
    }
}

#[cfg(test)]
mod tests {
    use crate::runs::position;
    use crate::scene::Scene;

    fn moved(sets: &[&str]) -> super::MoveOutcome {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        position::run(&Scene::of_sets(&sets).unwrap(), |_| ()).unwrap()
    }

    /// Without a frame there is no error of an estimate.
    #[test]
    fn exact_without_a_frame_no_error_is_told() {
        let outcome = moved(&["position.to_deg=1", "camera.drop_probability=1"]);
        assert_eq!(outcome.rms_estimate_error_mdeg, None);
        assert_eq!((outcome.rms_estimate_error_moving_mdeg, outcome.stated.beyond_3_sigma), (None, None));
        let text = outcome.to_string();
        assert!(text.contains("estimator error    - mdeg rms, - while moving"), "{text}");
        assert!(text.contains("frames             0 arrived, 0 of them refused"), "{text}");
    }

    /// A tenth of the frames is lost and a twentieth wrong: some arrive and are refused by the filter, while the marks
    /// of every picture agree.
    #[test]
    fn exact_frames_that_arrive_and_pictures_that_are_taken_are_told_apart() {
        let outcome =
            moved(&["position.to_deg=1", "camera.drop_probability=0.1", "camera.outlier_probability=0.05"]);
        let (frames, marks) = (outcome.frames.unwrap(), outcome.marks.unwrap());
        assert!(frames.refused > 0 && frames.refused < frames.arrived && frames.arrived < marks.frames);
        assert_eq!(marks.refused, 0);
    }
}
