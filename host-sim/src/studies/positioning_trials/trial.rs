//! One trial: its target, what became of it, and the least time that it could take.

use controller::MoveForecast;
use controller::response_map::direction;
use motor_model::DriveMode;
use rand_distr::{Distribution, Uniform};
use serde::{Deserialize, Serialize};

use super::TOLERANCE_DEG;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::runs::position::{MoveEnding, MoveOutcome};
use simulation::scene::Scene;
use simulation::world::instruments::Camera;

/// A trial that claims success has failed if its true error exceeds this.
pub(super) const FAILED_MDEG: f64 = 3.0;

/// The kind of a trial's move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MoveKind {
    /// Uniform in +-360 degrees.
    Long,
    /// Log-uniform from 1 milli-degree to 1 degree.
    Short,
    /// 90 degrees either way.
    QuarterTurn,
}

/// A trial and what became of it, as it is written and read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositioningTrial {
    /// Seed of motor, noise and target.
    pub seed: u64,
    /// Target.
    pub target_deg: f64,
    /// True angle at the end less the target.
    pub final_error_mdeg: f64,
    /// When the controller began to hold the target that it held to the end; empty if it did not.
    pub settle_s: Option<f64>,
    /// The least time that any controller needs.
    pub bound_s: f64,
    /// Largest true angle beyond the target, at least 0.
    pub overshoot_deg: f64,
    /// How often the drive changed between off, mode B and mode C.
    pub switches: u32,
    /// Time with the drive on.
    pub drive_on_s: f64,
    /// Its place among all trials.
    pub number: u64,
    /// The kind of move.
    pub kind: MoveKind,
    /// How it ended.
    pub ending: MoveEnding,
    /// Simulated time.
    pub duration_s: f64,
    /// Root mean square error of the estimate over the whole run; empty without an estimate.
    pub rms_estimate_error_mdeg: Option<f64>,
    /// Share of the estimates whose angle is off by more than three of their standard deviations; empty likewise.
    pub beyond_3_sigma: Option<f64>,
    /// Estimates of good health whose angle is off by more than five.
    pub good_beyond_5_sigma: u64,
    /// The largest error of these; 0 if there is none.
    pub good_beyond_5_sigma_worst_mdeg: f64,
    /// Time that was expected before the move; empty if the tolerance cannot be met before the deadline.
    #[serde(default)]
    pub promised_s: Option<f64>,
    /// Time within which 95 % of such moves were promised to end; empty likewise.
    #[serde(default)]
    pub promised_95_s: Option<f64>,
}

impl PositioningTrial {
    /// Trial `number`, a move of `kind` that ended as `outcome`, with what was `promised` before it.
    pub(super) fn new(
        number: u64,
        kind: MoveKind,
        outcome: &MoveOutcome,
        bound_s: f64,
        promised: Option<MoveForecast>,
    ) -> Self {
        Self {
            number,
            seed: outcome.seed,
            kind,
            target_deg: outcome.target_deg,
            ending: outcome.ending(),
            final_error_mdeg: outcome.final_error_mdeg,
            settle_s: outcome.settle_time_s,
            bound_s,
            duration_s: outcome.duration_s,
            overshoot_deg: outcome.overshoot_deg,
            switches: outcome.drive_switches,
            drive_on_s: outcome.drive_on_s,
            rms_estimate_error_mdeg: outcome.rms_estimate_error_mdeg,
            beyond_3_sigma: outcome.stated.beyond_3_sigma,
            good_beyond_5_sigma: outcome.stated.good_beyond_5_sigma,
            good_beyond_5_sigma_worst_mdeg: outcome.stated.good_beyond_5_sigma_worst_mdeg,
            promised_s: promised.map(|promised| promised.time_s.into()),
            promised_95_s: promised.map(|promised| promised.time_95_s().into()),
        }
    }

    /// Whether it settled, and later than was promised to 95 % of such moves.
    pub fn late(&self) -> bool {
        self.settle_s.zip(self.promised_95_s).is_some_and(|(settle_s, promised_s)| settle_s > promised_s)
    }

    /// Whether the controller says that the target is reached although the rotor is further off than three tolerances.
    pub fn reached_but_off(&self) -> bool {
        self.ending == MoveEnding::Wrong
    }

    /// Whether the controller did not reach the target, or says so although the rotor is far off.
    pub fn failed(&self) -> bool {
        self.settle_s.is_none() || self.final_error_mdeg.abs() > FAILED_MDEG
    }
}

/// The move that a seed names: its kind and its target in degrees, rounded to a micro-degree so that it can be typed.
pub fn target(seed: u64) -> (MoveKind, f64) {
    let mut rng = stream(seed, RandomSource::Target);
    let mut unit = || Uniform::new(0.0, 1.0).map_or(0.5, |unit| unit.sample(&mut rng));
    let (kind, size, sign) = (unit(), unit(), if unit() < 0.5 { 1.0 } else { -1.0 });
    let (kind, degrees) = if kind < 0.4 {
        (MoveKind::Long, 360.0 * size)
    } else if kind < 0.8 {
        // Three decades.
        (MoveKind::Short, 1e-3 * motor_model::math::exp(size * core::f64::consts::LN_10 * 3.0))
    } else {
        (MoveKind::QuarterTurn, 90.0)
    };
    (kind, sign * (degrees * 1e6).round() / 1e6)
}

/// The least time that any controller needs.
pub(super) fn bound_s(scene: &Scene, target_deg: f64) -> f64 {
    let mode = if target_deg > 0.0 { DriveMode::B } else { DriveMode::C };
    let rate = scene
        .response_map()
        .ok()
        .and_then(|map| map.strongest_cruise(mode, 1.0))
        .map_or(f64::INFINITY, |cruise| f64::from(direction(mode) * cruise.rate_rad_s));
    target_deg.abs().to_radians() / rate + measuring_s(scene)
}

/// Tolerance of the trials of `scene`, in degrees: its own, or [`TOLERANCE_DEG`] if it sets none.
pub fn tolerance_deg(scene: &Scene) -> f64 {
    const KEY: &str = "position.tolerance_deg";
    let own_deg = scene.number(KEY);
    if scene.is_set(KEY) { own_deg } else { TOLERANCE_DEG }
}

/// Time at rest after which the tolerance is 1.96 standard deviations of the mean of the frames.
pub fn measuring_s(scene: &Scene) -> f64 {
    let wanted_rad = tolerance_deg(scene).to_radians() / 1.96;
    Camera::variance_rad2(scene) / (wanted_rad * wanted_rad) / scene.number("camera.frame_rate_hz")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.179 milli-degrees from frames of two marks of 17 each: (2e-6 / 3.9e-3)^2 (1/4 + 1/12) / 2 rad^2 at 10 kHz.
    #[test]
    fn exact_measuring_time_of_the_default_camera() {
        let frame_mdeg = 1e3 * (2e-6_f64 / 3.9e-3).to_degrees() / motor_model::math::sqrt(6.0);
        let ratio = frame_mdeg / (0.35 / 1.96);
        let expected = ratio * ratio / 1e4;
        assert!((measuring_s(&Scene::default()) / expected - 1.0).abs() < 1e-9, "{expected}");
    }

    /// Two sevenths of the tolerance take 3.5 squared times as long to measure.
    #[test]
    fn exact_a_finer_tolerance_is_measured_longer() {
        let fine = Scene::of_sets(&["position.tolerance_deg=0.0001".to_owned()]).unwrap();
        assert!((measuring_s(&fine) / measuring_s(&Scene::default()) / 12.25 - 1.0).abs() < 1e-9);
    }

    /// Shares, ranges and signs of 4,000 targets, within four standard deviations.
    #[test]
    fn law_targets_are_drawn_as_stated() {
        let targets: Vec<(MoveKind, f64)> = (0..4000).map(target).collect();
        let share = |kind| targets.iter().filter(|(k, _)| *k == kind).count();
        assert!(
            share(MoveKind::Long).abs_diff(1600) < 124 && share(MoveKind::QuarterTurn).abs_diff(800) < 102
        );
        assert!(targets.iter().filter(|(_, deg)| *deg > 0.0).count().abs_diff(2000) < 127);
        for (kind, deg) in targets {
            let (low, high) = match kind {
                MoveKind::Long => (0.0, 360.0),
                MoveKind::Short => (0.001, 1.0),
                MoveKind::QuarterTurn => (90.0, 90.0),
            };
            assert!((low..=high).contains(&deg.abs()), "{kind:?} {deg}");
        }
    }
}
