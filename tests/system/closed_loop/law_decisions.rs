//! A loop that decides in one of several ticks.

use std::path::Path;

use host_sim::scene_files::GalleryScene;
use simulation::runs::position;
use simulation::scene::Scene;

use crate::support::plant_step::CONVERGED;

/// Standard deviations of the time that is expected before a move by which it may take longer: one move in 700 does.
const LATE_SIGMAS: f64 = 3.0;

/// With the most ticks from one decision to the next, and the longest latency, moves end within the same tolerance and
/// in the time that is expected of a loop that decides in each tick: far and near, both ways, of a rotor that only
/// rises and falls and of one that tilts.
#[test]
fn law_moves_of_a_loop_that_decides_in_one_of_eight_ticks_are_as_exact_and_as_fast() {
    let tilting = GalleryScene::named("set_f_plant").expect("a scene of the gallery");
    for (filter, tilts, to_deg) in [
        ("constant_rate", false, "37"),
        ("constant_rate", false, "-90"),
        ("constant_rate", true, "-20"),
        ("twin", false, "0.01"),
        ("twin", false, "-37"),
        ("twin", true, "0.1"),
    ] {
        let mut scene = Scene::default();
        if tilts {
            scene.set_all(tilting.text, Path::new("set_f_plant")).expect("settings");
        } else {
            scene.set(CONVERGED.0, CONVERGED.1).expect("a key and its value");
        }
        for (key, value) in [
            ("estimator.filter", filter),
            ("board.decision_ticks", "8"),
            ("board.latency_ticks", "16"),
            ("position.to_deg", to_deg),
            ("position.tolerance_deg", "0.0005"),
            ("seed", "41"),
        ] {
            scene.set(key, value).expect("a key and its value");
        }
        let outcome = position::run(&scene, |_| ()).expect("a run");
        assert!(outcome.ok, "{filter} {tilts} {to_deg}: {outcome}");
        let times = outcome.settle_time_s.zip(outcome.expected_s).zip(outcome.expected_sd_s);
        let ((settle_s, expected_s), sd_s) = times.expect("a move that settles, and was expected to");
        let latest_s = expected_s + LATE_SIGMAS * sd_s;
        assert!(settle_s < latest_s, "{filter} {tilts} {to_deg}: {settle_s} s, latest {latest_s}");
    }
}
