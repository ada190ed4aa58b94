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
use simulation::scene::{Origin, RotorModel, Scene};

/// What every move is asked: tolerance in degrees, time after which it is given up and time for which a target is held
/// before the error counts, in s.
pub(super) const OF_EVERY_MOVE: [(&str, &str); 3] =
    [("position.tolerance_deg", "0.001"), ("position.deadline_s", "10"), ("position.hold_s", "0.1")];

/// An estimate of good health is wrong unawares if it is off by more than this,
pub(super) const UNAWARE_MDEG: f64 = 100.0;
/// for longer than this in a run: a filter needs some frames to see that they have gone wrong.
pub(super) const UNAWARE_NANOS: u64 = 10_000_000;

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
    /// All the time for which an estimate of good health was off by more than [`UNAWARE_MDEG`], in s, with breaks or
    /// without; 0 if it is no longer than [`UNAWARE_NANOS`].
    pub unaware_s: f64,
    /// The largest error in that time; 0 if there is none.
    pub unaware_mdeg: f64,
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
    let (unaware_s, unaware_mdeg) = watch.unaware();
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
        unaware_s,
        unaware_mdeg,
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
    /// Time for which a good estimate was far off, and the largest error in it.
    far_off_nanos: u64,
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
        let off = estimate.map(|estimate| 1e3 * estimate.angle.minus(angle).degrees().abs());
        if let Some(off_mdeg) = off.filter(|off_mdeg| health == Health::Good && *off_mdeg > UNAWARE_MDEG) {
            self.far_off_nanos += tick_nanos;
            self.worst_mdeg = self.worst_mdeg.max(off_mdeg);
        }
    }

    /// [`FaultRun::unaware_s`] and [`FaultRun::unaware_mdeg`].
    fn unaware(&self) -> (f64, f64) {
        if self.far_off_nanos > UNAWARE_NANOS {
            (1e-9 * simulation::math::count::real(self.far_off_nanos), self.worst_mdeg)
        } else {
            (0.0, 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of a millisecond on the way to 1 degree; the rotor passes it by 0.5. Of 10 ms in spells of 6 and 4 ms
    /// nothing is said. With one more they count, breaks left out. 20 ms of 0.09 degrees do not, nor do 20 ms that are
    /// told.
    #[test]
    fn exact_times_errors_and_excursion() {
        let mut watch = Watch::default();
        let mut tick = 0;
        let mut add = |ticks: u64, off_deg: f64, angle_deg: f64, health| {
            for _ in 0..ticks {
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
                tick += 1;
                watch.add(Time::from_micros(1000 * tick), Some(&estimate), health, angle, 1.0);
            }
            watch
        };
        for (ticks, off_deg) in [(5, 0.0), (6, 0.15), (1, 0.05), (4, -0.2), (20, 0.09)] {
            assert_eq!(add(ticks, off_deg, 0.5, Health::Good).unaware(), (0.0, 0.0));
        }
        add(20, 0.4, 1.5, Health::Unusable(estimator::Reason::CameraSilent));
        add(1, 0.0, -0.2, Health::Good);
        let watch = add(1, 0.12, 0.5, Health::Good);
        let (unaware_s, unaware_mdeg) = watch.unaware();
        // To a unit of the angle, 8.4e-8 degrees, and its rounding.
        assert!((unaware_s - 0.011).abs() < 1e-12 && (unaware_mdeg - 200.0).abs() < 2e-4, "{watch:?}");
        assert!((watch.excursion_deg - 0.5).abs() < 2e-7, "{watch:?}");
    }
}
