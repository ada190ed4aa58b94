//! A rate that the rotor does not follow is given up, with the drive off; one that it follows late is not.

use std::path::Path;

use host_sim::scene_files::load;
use simulation::Scene;
use simulation::runs::rate::{self, RateOutcome};

use crate::support::plant_step::CONVERGED;

/// The outcome of a rate of a true motor, and the strongest drive after `since_s`.
fn held(plant: Option<&str>, sets: &[(&str, &str)], since_s: f64) -> (RateOutcome, f64) {
    let mut scene = match plant {
        Some(name) => load(Some(Path::new(name)), &[]).expect("a scene of the gallery"),
        None => Scene::default(),
    };
    for (key, value) in [CONVERGED].iter().chain(sets) {
        scene.set(key, value).expect("a key and its value");
    }
    let mut strongest = 0.0_f64;
    let outcome = rate::run(&scene, |point| {
        if point.time_s > since_s {
            strongest = strongest.max(point.drive.abs());
        }
    });
    (outcome.expect("a run"), strongest)
}

/// The plants and rates that are tried: both rotors, both directions.
const CASES: [(Option<&str>, &str); 4] =
    [(None, "300"), (None, "-100"), (Some("set_g_plant"), "50"), (Some("set_f_plant"), "-100")];

/// A rotor that sticks for good is given up after two windows of 0.15 s with the drive on, and what was left of the one
/// before: 0.3 to 0.45 s. The estimate of a rotor that is struck and does not turn is lost now and then, with the drive
/// off meanwhile: within twice that. The drive then stays off.
#[test]
fn law_a_rotor_that_sticks_for_good_is_given_up() {
    for (plant, deg_s) in CASES {
        let sets = [("rate.deg_s", deg_s), ("rate.duration_s", "2"), ("faults", "rotor:stuck@1..9")];
        let (outcome, strongest) = held(plant, &sets, 1.91);
        assert_eq!(outcome.stopped.as_deref(), Some("Stuck"), "{plant:?}, {deg_s}: {outcome}");
        let at_s = outcome.stopped_s.expect("a time");
        assert!((1.3..1.9).contains(&at_s), "{plant:?}, {deg_s}: {at_s}");
        assert!(strongest <= 0.0, "{plant:?}, {deg_s}: {strongest}");
        assert!(outcome.to_string().contains("it does not turn the rotor"), "{outcome}");
    }
}

/// A rotor that sticks for 50 ms now and then is driven on.
#[test]
fn law_a_rotor_that_sticks_now_and_then_is_driven_on() {
    for (plant, deg_s) in CASES {
        let faults = "rotor:stuck@0.6..0.65, rotor:stuck@0.9..0.95, rotor:stuck@1.1..1.15";
        let sets = [("rate.deg_s", deg_s), ("rate.duration_s", "2"), ("faults", faults)];
        let (outcome, strongest) = held(plant, &sets, 1.6);
        assert_eq!(outcome.stopped, None, "{plant:?}, {deg_s}: {outcome}");
        assert!(strongest > 0.0, "{plant:?}, {deg_s}");
    }
}
