//! Moves that are replaced or cancelled on the way, on a rotor that only rises and on rotors that tilt.

use std::path::Path;

use controller::{PositioningPhase, StopReason, Target};
use host_sim::scene_files::load;
use motor_model::{DriveCommand, Time};
use simulation::Scene;
use simulation::runs::closed_loop::{self, ClosedLoop, PositioningMoment};

use crate::support::plant_step::CONVERGED;

/// A true motor of a scene, or of the default one, under way to 200 degrees.
fn under_way(scene: Option<&str>, seed: &str) -> ClosedLoop {
    let mut scene = match scene {
        Some(name) => load(Some(Path::new(name)), &[]).expect("a scene of the gallery"),
        None => Scene::default(),
    };
    for (key, value) in [CONVERGED, ("seed", seed)] {
        scene.set(key, value).expect("a key and its value");
    }
    closed_loop::positioning(&scene, target(200.0), closed_loop::tuning(&scene)).expect("a loop")
}

fn target(deg: f64) -> Target {
    Target::try_new(deg, 0.001).expect("a target")
}

/// Runs until a tick's report is as asked for, which takes less than `within_s`.
#[track_caller]
fn run_until(
    closed_loop: &mut ClosedLoop,
    within_s: f64,
    is_there: impl Fn(&PositioningMoment) -> bool,
) -> PositioningMoment {
    let mut first: Option<Time> = None;
    loop {
        let moment = closed_loop.next_tick();
        if is_there(&moment) {
            return moment;
        }
        let phase = moment.report.phase;
        assert!(!matches!(phase, PositioningPhase::Stopped(_)), "{phase:?} after {} s", moment.seconds());
        let begun = *first.get_or_insert(moment.at);
        assert!(moment.at.seconds_since::<f64>(begun) < within_s, "{phase:?} at {} s", moment.seconds());
    }
}

/// Runs for `seconds`, which the move has not ended before.
#[track_caller]
fn run_for(closed_loop: &mut ClosedLoop, seconds: f64) -> PositioningMoment {
    let from = closed_loop.next_tick().at;
    run_until(closed_loop, 2.0 * seconds, |moment| moment.at.seconds_since::<f64>(from) >= seconds)
}

/// The move arrives within 5 s, three times what the slowest of these takes by its forecast. One in 20 is allowed to
/// end beyond its tolerance, and none by three times that.
#[track_caller]
fn arrives(closed_loop: &mut ClosedLoop, at_deg: f64) {
    let there = run_until(closed_loop, 5.0, |moment| moment.report.phase == PositioningPhase::Holding);
    let off_mdeg = 1e3 * (there.angle.degrees() - at_deg);
    assert!(off_mdeg.abs() < 3.0, "{at_deg} deg: {off_mdeg} mdeg off");
}

fn is_cruising(moment: &PositioningMoment) -> bool {
    matches!(moment.report.phase, PositioningPhase::Cruise { .. })
}

/// Replaced by a target behind it and by one farther on, cancelled, and begun again: it ends where it was told last.
fn interrupt(mut closed_loop: ClosedLoop) {
    run_until(&mut closed_loop, 0.1, is_cruising);
    let now = run_for(&mut closed_loop, 0.12).at;
    closed_loop.program_mut().retarget(target(-30.0), now);
    arrives(&mut closed_loop, -30.0);

    let now = closed_loop.next_tick().at;
    closed_loop.program_mut().retarget(target(5.0), now);
    run_until(&mut closed_loop, 0.1, is_cruising);
    let now = run_for(&mut closed_loop, 0.02).at;
    closed_loop.program_mut().retarget(target(60.0), now);
    arrives(&mut closed_loop, 60.0);

    let now = closed_loop.next_tick().at;
    closed_loop.program_mut().retarget(target(150.0), now);
    run_until(&mut closed_loop, 0.1, is_cruising);
    run_for(&mut closed_loop, 0.05);
    closed_loop.program_mut().cancel();
    // The rotor runs out and rests within 0.3 s, as after every cruise, and is left alone.
    let mut stays = None;
    for tick in 0..60_000 {
        let moment = closed_loop.next_tick();
        assert_eq!(moment.report.phase, PositioningPhase::Stopped(StopReason::Cancelled));
        assert_eq!(moment.report.applied, DriveCommand::OFF);
        if tick >= 30_000 {
            let rests_deg = *stays.get_or_insert(moment.angle.degrees());
            assert!((moment.angle.degrees() - rests_deg).abs() < 1e-3, "it turns");
        }
    }
    let now = closed_loop.next_tick().at;
    closed_loop.program_mut().retarget(target(40.0), now);
    arrives(&mut closed_loop, 40.0);
}

#[test]
fn law_an_interrupted_move_ends_where_it_was_told_last() {
    for seed in ["71", "72"] {
        interrupt(under_way(None, seed));
    }
}

#[test]
fn law_an_interrupted_move_of_set_f_ends_where_it_was_told_last() {
    interrupt(under_way(Some("set_f_plant"), "71"));
}

#[test]
fn law_an_interrupted_move_of_set_g_ends_where_it_was_told_last() {
    interrupt(under_way(Some("set_g_plant"), "71"));
}
