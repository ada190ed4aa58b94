//! Motors that the map's authors did not foresee: of a mode that turns at a fifteenth or a fifth of the map's rate, and
//! one that sticks for 50 ms now and then.

use std::path::Path;

use controller::ResponseMap;
use controller::commissioning::findings::{Finding, FindingKind};
use controller::commissioning::{CommissioningEnd, Unfit};
use controller::response_map::Family;
use host_sim::scene_files::load;
use motor_model::{DriveMode, Time};
use simulation::Scene;
use simulation::runs::commission::{self, CommissionedMotor, CommissioningRun, Planned};
use simulation::runs::position;

use crate::support::plant_step::CONVERGED;

/// A true motor with what is set of it.
fn motor(plant: Option<&str>, sets: &[(&str, &str)]) -> Scene {
    let mut scene = match plant {
        Some(name) => load(Some(Path::new(name)), &[]).expect("a scene of the gallery"),
        None => Scene::default(),
    };
    for (key, value) in [CONVERGED].iter().chain(sets) {
        scene.set(key, value).expect("a key and its value");
    }
    scene
}

/// A rotor that sticks for 50 ms every `period_s`, from the start until a minute.
fn sticks(period_s: f64) -> String {
    let word = |number: u32| {
        let at_s = period_s * f64::from(number);
        (at_s < 60.0).then(|| format!("rotor:stuck@{at_s:.2}..{:.2}", at_s + 0.05))
    };
    (0..).map_while(word).collect::<Vec<_>>().join(", ")
}

/// Moves the motor of `scene` by `map`, and expects that it arrives or says why not, before the deadline. A move may
/// end beyond its tolerance, as one in 20 is allowed to, but by less than 3 milli-degrees. Whether it has arrived.
fn ends(scene: &Scene, map: &ResponseMap, to_deg: &str) -> bool {
    let mut scene = scene.clone().with_response_map(*map);
    scene.set("position.to_deg", to_deg).expect("a target");
    let made = position::run(&scene, |_| ()).expect("a run");
    let bound_s = scene.number("position.deadline_s") + scene.number("position.hold_s");
    assert!(made.duration_s < bound_s + 0.001, "{to_deg}: {made}");
    if made.stopped.is_some() {
        assert!(made.reason.is_some() && made.hint.is_some(), "{to_deg}: {made}");
        return false;
    }
    assert!(made.settle_time_s.is_some() && made.final_error_mdeg.abs() < 3.0, "{to_deg}: {made}");
    true
}

/// The same, and expects that it arrives.
#[track_caller]
fn arrives(scene: &Scene, map: &ResponseMap, to_deg: &str) {
    assert!(ends(scene, map, to_deg), "{to_deg} was given up");
}

fn commissioned(scene: &Scene) -> CommissionedMotor {
    commission::run(scene, |_| ()).expect("a run")
}

/// Mode B of 1 rad/s for 15, and mode C of 0.3 rad/s for 1.5. Both ways, by the map of Table 1 and by that of its own.
#[test]
fn tool_a_motor_with_a_slow_mode_arrives() {
    for (key, amplitude_m, mode) in [
        ("plant.motor.mode_b.tooth_amplitude_m", "4.9e-6", DriveMode::B),
        ("plant.motor.mode_c.tooth_amplitude_m", "1.2e-6", DriveMode::C),
    ] {
        let scene = motor(None, &[(key, amplitude_m)]);
        let found = commissioned(&scene).commissioned;
        let strongest = ResponseMap::table_1().cruises().iter().rposition(|cruise| cruise.mode == mode);
        let strongest = strongest.expect("a cruise");
        let part = found.evidence.cruise(strongest).windows.mean();
        assert!((0.03..0.3).contains(&part), "{mode:?} turns at {part} of the map's rate");
        let own = found.map.expect("a map");
        for map in [ResponseMap::table_1(), &own] {
            for to_deg in ["90", "-90"] {
                arrives(&scene, map, to_deg);
            }
        }
    }
}

/// A mode C of a fortieth of the map's rate does not come round in time. The reason is told, before the move or at its
/// deadline, and the other way it arrives.
#[test]
fn tool_a_motor_that_is_too_slow_says_why() {
    let mut scene = motor(None, &[("plant.motor.mode_c.tooth_amplitude_m", "0.9e-6")]);
    let own = commissioned(&scene).commissioned.map.expect("a map");
    arrives(&scene, &own, "90");
    scene.set("position.to_deg", "-360").expect("a target");
    match position::run(&scene.with_response_map(own), |_| ()) {
        Ok(made) => {
            assert_eq!(made.stopped.as_deref(), Some("TimedOut"), "{made}");
            assert!(made.reason.is_some_and(|why| why.contains("the deadline is over")));
        }
        Err(refused) => assert!(refused.to_string().contains("longer than the deadline"), "{refused}"),
    }
}

/// Moves of a rotor that sticks now and then end, and most of them at the target. A rotor that tilts and sticks within
/// the first bursts of a move may be taken for one whose mode is lost.
#[test]
fn tool_moves_of_a_rotor_that_sticks_now_and_then_end() {
    let faults = sticks(0.5);
    let mut given_up = Vec::new();
    for (plant, to_deg) in
        [(None, ["90", "-90"]), (Some("set_f_plant"), ["5", "-5"]), (Some("set_g_plant"), ["5", "-5"])]
    {
        let scene = motor(plant, &[("faults", &faults)]);
        for to_deg in to_deg {
            if !ends(&scene, ResponseMap::table_1(), to_deg) {
                given_up.push((plant, to_deg));
            }
        }
    }
    assert!(given_up.len() < 2 && given_up.iter().all(|(plant, _)| plant.is_some()), "{given_up:?}");
}

/// Commissioning a rotor that sticks now and then keeps what it saw before the estimate was lost. It tells the losses,
/// and moves by the map arrive.
#[test]
fn tool_a_rotor_that_sticks_now_and_then_is_commissioned() {
    let scene = motor(None, &[("faults", &sticks(0.5)), ("seed", "3")]);
    let found = commissioned(&scene).commissioned;
    let told: Vec<String> = found.findings.iter().map(|finding| format!("{finding:?}")).collect();
    assert!(told.iter().any(|finding| finding.contains("Lost")), "{told:?}");
    let own = found.map.expect("a map");
    for to_deg in ["90", "-90"] {
        arrives(&scene, &own, to_deg);
    }
}

/// So is a rotor that tilts: within 6 s it has shown its rate in both modes, by a whole run or by parts of some.
#[test]
fn tool_a_tilting_rotor_that_sticks_now_and_then_is_measured() {
    let scene = motor(Some("set_g_plant"), &[("faults", &sticks(0.5)), ("ldv.installed", "no")]);
    let mut run = CommissioningRun::new(&scene).expect("a run");
    let over = Time::from_nanos(6_000_000_000);
    let time_s = loop {
        let moment = run.next_tick();
        if moment.at >= over {
            break moment.at.seconds_since(Time::ZERO);
        }
        assert!(!matches!(run.plan(), Planned::Ended(_)), "it ended at {:?}", moment.at);
    };
    let found = run.finish(&scene, CommissioningEnd::TimeOver, time_s).commissioned.evidence;
    for mode in [DriveMode::B, DriveMode::C] {
        let of_mode = ResponseMap::table_1().cruises().iter().enumerate();
        let windows = of_mode
            .filter(|(_, cruise)| cruise.mode == mode)
            .map(|(index, _)| found.cruise(index).windows.count())
            .sum::<u16>();
        assert!(windows >= 8, "{mode:?}: {windows}");
    }
}

/// A rotor that sticks every 0.2 s hardly turns for the spin-up of 0.15 s and two windows of 0.05 s. That its drives
/// lose the estimate is the reason, and not the instruments. A mode is not dead of which all that is seen are windows
/// in which the rotor stuck. Where the estimate follows for long enough there is a map, and the losses are told: those
/// of both modes, or of one where the filter has left the kicks in the other before it was lost.
#[test]
fn tool_a_rotor_that_is_lost_in_each_drive_is_refused_for_that() {
    let is_loss = |finding: &&Finding| matches!(finding.kind, FindingKind::Lost { .. });
    for seed in ["1", "2", "3", "4", "6"] {
        let found = commissioned(&motor(None, &[("faults", &sticks(0.2)), ("seed", seed)])).commissioned;
        let losses = found.findings.iter().filter(is_loss).count();
        match found.map {
            Ok(_) | Err(Unfit::LostWhenDriven { .. }) => {
                assert!((1..=2).contains(&losses), "{seed}: {:?}", found.findings);
            }
            Err(unfit) => panic!("{seed}: {unfit:?}"),
        }
    }
}

/// Without mode B a motor arrives counter-clockwise by a map of its own: from near and far, and never beyond its
/// target, from where nothing turns it back.
#[test]
fn tool_a_motor_without_mode_b_arrives_counter_clockwise() {
    for seed in ["1", "2", "3"] {
        let scene = motor(None, &[("faults", "drive:dead:b"), ("seed", seed)]);
        let own = commissioned(&scene).commissioned.map.expect("a map");
        assert!(Family::ALL.iter().all(|family| {
            (family.mode() == DriveMode::C && *family != Family::Stride) || own.bursts(*family).is_empty()
        }));
        for to_deg in ["-90", "-5", "-0.3", "-0.01"] {
            arrives(&scene, &own, to_deg);
        }
        let mut scene = scene.with_response_map(own);
        scene.set("position.to_deg", "37").expect("a target");
        let refused = position::run(&scene, |_| ()).expect_err("mode B is dead").to_string();
        assert!(refused.contains("mode B does not turn this motor"), "{refused}");
    }
}
