//! One run: a move with its faults, watched for what nobody should trust.

use std::convert::Infallible;
use std::ops::ControlFlow;

use estimator::{Estimate, Health};
use motor_model::{Angle, Time};
use serde::{Deserialize, Serialize};

use super::draw::{self, Faulty};
use crate::studies::beside::BesideScene;
use crate::studies::positioning_trials::target;
use simulation::runs::RunError;
use simulation::runs::filter::FILTERS;
use simulation::runs::position::{self, MoveEnding};
use simulation::runs::stated_errors::is_falsely_valid;
use simulation::scene::{Origin, RotorModel, Scene};

/// What every move is asked: tolerance in degrees, time after which it is given up and time for which a target is held
/// before the error counts, in s.
pub(super) const OF_EVERY_MOVE: [(&str, &str); 3] =
    [("position.tolerance_deg", "0.001"), ("position.deadline_s", "10"), ("position.hold_s", "0.1")];

/// A run, as it is written and read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaultRun {
    /// Its place among all runs.
    pub number: u64,
    /// Name of its scene.
    pub scene: String,
    /// Seed of motor, noise, target and faults.
    pub seed: u64,
    /// The filter.
    pub filter: String,
    /// Target.
    pub target_deg: f64,
    /// Words of the faults, with blanks between them.
    pub faults: String,
    /// How the move ended.
    pub ending: MoveEnding,
    /// Why, where it gave up.
    pub reason: String,
    /// True angle at the end less the target.
    pub error_mdeg: f64,
    /// Simulated time in s.
    pub time_s: f64,
    /// Time in s during which the estimate was falsely valid.
    pub false_valid_s: f64,
    /// The longest such time without a break, in s.
    pub false_valid_longest_s: f64,
    /// The largest error of such an estimate; 0 if there is none.
    pub false_valid_mdeg: f64,
    /// How far the rotor was from the way between start and target at most, in degrees.
    pub excursion_deg: f64,
}

/// Makes run `number` of a scene.
///
/// # Errors
/// When the scene is refused.
pub(super) fn made(number: u64, of: &BesideScene) -> Result<FaultRun, RunError> {
    let mut scene = of.scene.of_run(number)?;
    let seed = scene.seed();
    let (_, target_deg) = target(seed);
    let filter = filter_of(seed);
    let to_deg = target_deg.to_string();
    let own = [("estimator.filter", filter), ("position.to_deg", to_deg.as_str())];
    for (key, value) in own.into_iter().chain(OF_EVERY_MOVE) {
        scene.set(key, value)?;
    }
    let faulty = Faulty {
        marks: scene.integer("camera.marks"),
        has_hub: RotorModel::of(&scene)?.has_hub(),
        expected_s: position::plan(&scene)?.expected_s,
    };
    let words = draw::words(seed, faulty);
    for word in &words {
        scene.add_fault(word, &|_| Ok(()), Origin::Program)?;
    }
    let (outcome, watch) = watched(&scene, target_deg)?;
    Ok(FaultRun {
        number,
        scene: of.name.clone(),
        seed,
        filter: filter.to_owned(),
        target_deg,
        faults: words.join(" "),
        ending: outcome.ending(),
        reason: outcome.stopped.clone().unwrap_or_default(),
        error_mdeg: outcome.final_error_mdeg,
        time_s: outcome.duration_s,
        false_valid_s: 1e-9 * simulation::math::count::real(watch.false_nanos),
        false_valid_longest_s: 1e-9 * simulation::math::count::real(watch.longest_nanos),
        false_valid_mdeg: watch.worst_mdeg,
        excursion_deg: watch.excursion_deg,
    })
}

/// The filters in turn.
fn filter_of(seed: u64) -> &'static str {
    let place = usize::try_from(seed / 2 % FILTERS.len() as u64).unwrap_or(0);
    FILTERS[place]
}

fn watched(scene: &Scene, target_deg: f64) -> Result<(position::MoveOutcome, Watch), RunError> {
    let mut watch = Watch::default();
    let ControlFlow::Continue(outcome) = position::run_with(scene, |_, moment| {
        watch.add(moment.at, moment.report.estimate.as_ref(), moment.report.health, moment.angle, target_deg);
        ControlFlow::<Infallible>::Continue(())
    })?;
    Ok((outcome, watch))
}

/// What is watched over the ticks of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Watch {
    last: Option<Time>,
    false_nanos: u64,
    /// Time that the present falsely valid spell has lasted.
    spell_nanos: u64,
    longest_nanos: u64,
    worst_mdeg: f64,
    excursion_deg: f64,
}

impl Watch {
    fn add(
        &mut self,
        at: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
        angle: Angle,
        target_deg: f64,
    ) {
        let tick_nanos = self.last.map_or(0, |last| at.nanos_since(last));
        self.last = Some(at);
        let (angle_deg, low, high) = (angle.degrees(), target_deg.min(0.0), target_deg.max(0.0));
        self.excursion_deg = self.excursion_deg.max(low - angle_deg).max(angle_deg - high);
        let off_mdeg = estimate.and_then(|estimate| {
            let off = estimate.angle.minus(angle);
            let off_rad: f64 = off.radians_since(Angle::ZERO);
            let off_mdeg = 1e3 * off.degrees();
            is_falsely_valid(off_mdeg, off_rad * off_rad / f64::from(estimate.angle_rad2), health)
                .then_some(off_mdeg)
        });
        let Some(off_mdeg) = off_mdeg else {
            self.spell_nanos = 0;
            return;
        };
        self.false_nanos += tick_nanos;
        self.spell_nanos += tick_nanos;
        self.longest_nanos = self.longest_nanos.max(self.spell_nanos);
        self.worst_mdeg = self.worst_mdeg.max(off_mdeg.abs());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two spells of two and three ticks, of 0.1 and 0.2 degrees, on the way to 1 degree; the rotor passes it by 0.5.
    #[test]
    fn exact_spells_errors_and_excursion() {
        let mut watch = Watch::default();
        let mut add = |tick: u64, off_deg: f64, angle_deg: f64, health| {
            let angle = Angle::from_degrees(angle_deg);
            let estimate = Estimate::<f32> {
                at: Time::ZERO,
                angle: Angle::from_degrees(angle_deg + off_deg),
                rate_rad_s: 0.0,
                angle_rad2: 1e-10,
                angle_rate_rad2_s: 0.0,
                rate_rad2_s2: 1.0,
                resting: false,
            };
            watch.add(Time::from_nanos(10_000 * tick), Some(&estimate), health, angle, 1.0);
        };
        let offs = [0.0, 0.1, 0.1, 0.0, 0.2, 0.2, 0.2, 0.0];
        for (tick, off_deg) in (0..).zip(offs) {
            add(tick, off_deg, 0.5, Health::Good);
        }
        add(8, 0.3, 1.5, Health::Unusable(estimator::Reason::CameraSilent));
        add(9, 0.0, -0.2, Health::Good);
        assert_eq!((watch.false_nanos, watch.longest_nanos), (50_000, 30_000));
        // To a unit of the angle, 8.4e-8 degrees, and its rounding.
        assert!((watch.worst_mdeg - 200.0).abs() < 2e-4, "{watch:?}");
        assert!((watch.excursion_deg - 0.5).abs() < 2e-7, "{watch:?}");
    }
}
