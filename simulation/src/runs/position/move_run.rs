//! A move that is run tick by tick.

use controller::{LoopTiming, PositioningPhase, PositioningTuning, StopReason, TICK_NANOS, Target};
use motor_model::{DriveCommand, Time};

use super::{FrameCounts, MoveOutcome, MoveSums, MoveTick, reach};
use crate::runs::RunError;
use crate::runs::closed_loop::{self, ClosedLoop, PositioningMoment};
use crate::runs::limits;
use crate::scene::{Scene, SceneError};
use crate::world::instruments;

/// A scene's motor and closed loop, and the move under way. After its first move it goes on: with another target, other
/// faults, or driven by hand.
pub struct MoveRun {
    pub(super) closed_loop: ClosedLoop,
    scene: Scene,
    tuning: PositioningTuning,
    hold_nanos: u64,
    sums: MoveSums,
    frames: FrameCounts,
    /// Up to this instant reports are of the move before, whose commands were under way when this one began.
    decides_after: Time,
}

impl MoveRun {
    /// The move of `scene`, before its first tick, under a controller of this tuning.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene, tuning: PositioningTuning) -> Result<Self, RunError> {
        let target = target(scene)?;
        check(scene, &tuning, target.angle().degrees())?;
        Ok(Self {
            closed_loop: closed_loop::positioning(scene, target, tuning)?,
            hold_nanos: scene.nanos("position.hold_s"),
            sums: MoveSums::new(target),
            frames: FrameCounts::default(),
            decides_after: Time::ZERO,
            scene: scene.clone(),
            tuning,
        })
    }

    /// Motor, instruments and loop.
    pub fn closed_loop(&self) -> &ClosedLoop {
        &self.closed_loop
    }

    /// The scene, with the target and the faults of the present.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Runs to the end of the next tick.
    pub fn next_tick(&mut self) -> PositioningMoment {
        self.closed_loop.next_tick()
    }

    /// Adds the tick to the move: what became of it, if it has ended with this tick or ended earlier.
    pub fn add(&mut self, moment: &PositioningMoment) -> Option<MoveOutcome> {
        let decided = moment.at > self.decides_after;
        let tick = MoveTick::of(moment);
        let tick = if decided { tick } else { tick.undecided() };
        self.sums.add(&tick);
        if let Some(innovation) = &moment.report.camera {
            self.frames.add(innovation);
        }
        let outcome = || MoveOutcome {
            frames: Some(self.frames),
            marks: self.closed_loop.mark_counts(),
            ..self.sums.outcome(&tick, &self.scene)
        };
        match moment.report.phase {
            _ if !decided => None,
            PositioningPhase::Stopped(why) => Some(outcome().stopped(why, &self.scene)),
            PositioningPhase::Holding if self.sums.held_nanos(moment.at) >= self.hold_nanos => {
                Some(outcome())
            }
            // A target that is lost again and again before it has been held for long enough: the controller begins a
            // move of its own each time.
            _ if !tick.holding && self.sums.elapsed_nanos(moment.at) > self.longest_nanos() => {
                Some(outcome().stopped(StopReason::TimedOut, &self.scene))
            }
            _ => None,
        }
    }

    /// Time after which a move that does not hold its target is over, in ns: the deadline, and the time for which it
    /// would have to be held.
    fn longest_nanos(&self) -> u64 {
        self.tuning.limits.deadline_nanos.saturating_add(self.hold_nanos)
    }

    /// Begins the move of `scene` from where the rotor is. Target and tolerance are those of `scene`, all else
    /// stays: a scene that differs in more needs a run of its own.
    ///
    /// # Errors
    /// When the scene is refused; then all is as it was.
    pub fn go_on(&mut self, scene: &Scene) -> Result<(), RunError> {
        let target = target(scene)?;
        let rotor = self.closed_loop.plant().rotor();
        check(scene, &self.tuning, target.angle().minus(rotor.angle).degrees())?;
        self.closed_loop.drive_by_hand(None);
        self.closed_loop.program_mut().begin(target, self.tuning, rotor.at);
        self.sums = MoveSums::begun(target, rotor.at, rotor.angle);
        self.frames = FrameCounts::default();
        let LoopTiming { latency_ticks, decision_ticks } = closed_loop::timing(scene);
        let undecided_ticks = u64::from(latency_ticks) + u64::from(decision_ticks) - 1;
        self.decides_after = rotor.at.plus_nanos(TICK_NANOS * undecided_ticks);
        self.scene = scene.clone();
        Ok(())
    }

    /// Takes the faults of `scene`, see [`ClosedLoop::change_faults`].
    ///
    /// # Errors
    /// When a fault is refused; then all is as it was.
    pub fn change_faults(&mut self, scene: &Scene) -> Result<(), RunError> {
        self.closed_loop.change_faults(scene)?;
        self.scene = scene.clone();
        Ok(())
    }

    /// Ends the move, and drives by hand until another one begins.
    pub fn drive_by_hand(&mut self, command: DriveCommand) {
        self.closed_loop.program_mut().cancel();
        self.closed_loop.drive_by_hand(Some(command));
    }
}

/// The target of a scene.
fn target(scene: &Scene) -> Result<Target, SceneError> {
    Ok(Target::try_new(scene.number("position.to_deg"), scene.number("position.tolerance_deg"))?)
}

/// Refuses a move by `by_deg` that no drive can make.
fn check(scene: &Scene, tuning: &PositioningTuning, by_deg: f64) -> Result<(), RunError> {
    limits::check_target(scene)?;
    let map = scene.response_map()?;
    let tolerance_deg = scene.number("position.tolerance_deg");
    Ok(reach::check(&instruments::checked(scene)?, &map, &tuning.limits, by_deg, tolerance_deg)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::position::plan;

    fn scene(sets: &[&str]) -> Scene {
        let sets = ["estimator.filter=constant_rate", "plant.step_s=1e-5"].iter().chain(sets);
        Scene::of_sets(&sets.map(|&set| set.to_owned()).collect::<Vec<_>>()).unwrap()
    }

    fn begun(scene: &Scene) -> MoveRun {
        MoveRun::new(scene, closed_loop::tuning(scene)).unwrap()
    }

    /// Runs until the move has ended, at most 5 s.
    fn ended(run: &mut MoveRun) -> MoveOutcome {
        let tick = |_| {
            let moment = run.next_tick();
            run.add(&moment)
        };
        (0..500_000).find_map(tick).expect("the move does not end")
    }

    /// Back by half a degree: what lies beyond the target is on the other side than in a move from 0, and the way is
    /// as long as from 0 to -0.5 degrees.
    #[test]
    fn law_a_move_that_goes_on_has_its_own_way() {
        let mut run = begun(&scene(&["position.to_deg=2"]));
        ended(&mut run);
        run.go_on(&scene(&["position.to_deg=1.5"])).unwrap();
        let outcome = ended(&mut run);
        assert!(outcome.stopped.is_none() && outcome.overshoot_deg < 0.05, "{outcome}");
        let of_way = plan(&scene(&["position.to_deg=-0.5"])).unwrap().expected_s;
        let expected_s = outcome.expected_s.unwrap();
        assert!((expected_s / of_way - 1.0).abs() < 0.01, "{expected_s} {of_way}");
    }

    /// While commands of the move before are under way, its end does not end the next move.
    #[test]
    fn exact_the_end_of_a_move_does_not_end_the_next_one_with_a_latency() {
        let latency = "board.latency_ticks=16";
        let mut run = begun(&scene(&["position.to_deg=0.5", latency]));
        run.drive_by_hand(DriveCommand::OFF);
        for _ in 0..100 {
            run.next_tick();
        }
        run.go_on(&scene(&["position.to_deg=0.2", latency])).unwrap();
        let outcome = ended(&mut run);
        assert_eq!(outcome.stopped, None, "{outcome}");
    }
}
