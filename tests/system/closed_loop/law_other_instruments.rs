//! Moves of 37 degrees with instruments and motors other than the default ones. Each arrives, is refused beforehand, or
//! ends with a reason; none is held as on target far off it, and none waits for its deadline.

use simulation::Scene;
use simulation::math::statistics::binomial_bounds;
use simulation::runs::{position, rate};

use crate::support::built_command::{folder, json, number, refuses, succeeds};

/// A move that is held as on target is wrong from so many tolerances on: errors are normal, and three tolerances are
/// more than six of the standard deviations at which a target counts as reached.
const WRONG_TOLERANCES: f64 = 3.0;

/// The seeds at which the defects were seen.
const SEEDS: [&str; 2] = ["905", "906"];

fn scene(seed: &str, sets: &[&str]) -> Scene {
    let all = ["position.to_deg=37"].iter().chain(sets).map(|&set| set.to_owned());
    let mut scene = Scene::of_sets(&all.collect::<Vec<_>>()).expect("a scene");
    scene.set("seed", seed).expect("a seed");
    scene
}

/// What is wrong with moves that must arrive, all on two threads.
fn wrong(rows: &[&[&str]]) -> Vec<String> {
    let cases: Vec<(&str, &[&str])> =
        rows.iter().flat_map(|row| SEEDS.into_iter().map(move |seed| (seed, *row))).collect();
    let (even, odd): (Vec<_>, Vec<_>) = cases.iter().enumerate().partition(|(index, _)| index % 2 == 0);
    let check = |part: Vec<(usize, &(&str, &[&str]))>| -> Vec<String> {
        part.into_iter().filter_map(|(_, (seed, sets))| arrives(seed, sets).err()).collect()
    };
    std::thread::scope(|scope| {
        let other = scope.spawn(|| check(odd));
        let mut found = check(even);
        found.extend(other.join().expect("no panic"));
        found
    })
}

fn arrives(seed: &str, sets: &[&str]) -> Result<(), String> {
    let outcome = position::run(&scene(seed, sets), |_| ()).map_err(|error| error.one_line())?;
    let what = format!("seed {seed}, {sets:?}: {:.3} mdeg off", outcome.final_error_mdeg);
    match (&outcome.stopped, outcome.settle_time_s) {
        (Some(why), _) => Err(format!("{what}, gave up: {why}")),
        (None, Some(_))
            if 1e-3 * outcome.final_error_mdeg.abs() <= WRONG_TOLERANCES * outcome.tolerance_deg =>
        {
            Ok(())
        }
        _ => Err(format!("{what}, held as on target")),
    }
}

#[track_caller]
fn all_arrive(rows: &[&[&str]]) {
    let found = wrong(rows);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A bench without a vibrometer, whichever filter runs, and one whose vibrometer delivers nothing of use.
#[test]
fn law_a_move_needs_no_vibrometer() {
    all_arrive(&[
        &["ldv.installed=no"],
        &["ldv.lost_until_s=99", "estimator.filter=constant_rate"],
        &["ldv.lost_until_s=99", "estimator.filter=impact_aided"],
        &["ldv.lost_until_s=99", "estimator.filter=twin"],
        &["ldv.fault=zeros"],
        &["ldv.fault=stuck"],
        &["ldv.fault=not_a_number"],
    ]);
}

/// Lost on the way, and back again.
#[test]
fn law_a_vibrometer_may_be_lost_on_the_way() {
    all_arrive(&[
        &["ldv.lost_from_s=0.05", "ldv.lost_until_s=99"],
        &["ldv.lost_from_s=0.05", "ldv.lost_until_s=0.2"],
    ]);
}

#[test]
fn law_a_vibrometer_may_be_biased_noisy_clipped_coarse_or_slow() {
    all_arrive(&[
        &["ldv.bias_m_s=1e-3"],
        &["ldv.bias_m_s=3e-3"],
        &["ldv.bias_m_s=1e-2"],
        &["ldv.bias_m_s=5e-2"],
        &["ldv.noise_m_s=1e-3", "estimator.filter=constant_rate"],
        &["ldv.noise_m_s=1e-3", "estimator.filter=impact_aided"],
        &["ldv.noise_m_s=1e-3", "estimator.filter=twin"],
        &["ldv.noise_m_s=2e-3"],
        &["ldv.noise_m_s=1e-2"],
        &["ldv.range_m_s=0.02"],
        &["ldv.range_m_s=1", "ldv.bits=8"],
        &["ldv.sample_rate_hz=20000"],
        &["ldv.sample_rate_hz=500000"],
    ]);
}

/// Frames that show the rotor as it was 9 to 17 ms before: the angle of a driven rotor is known to degrees only.
#[test]
fn law_a_camera_without_a_vibrometer_may_be_late() {
    all_arrive(&[
        &["camera.latency_s=0.009", "ldv.installed=no"],
        &["camera.latency_s=0.012", "ldv.installed=no", "position.to_deg=-37"],
        &["camera.latency_s=0.017", "ldv.installed=no", "position.to_deg=1"],
    ]);
}

/// 73 milli-degrees a frame are averaged to one, and so are 66 of a mark near the axis.
#[test]
fn law_a_camera_may_be_noisy_or_look_near_the_axis() {
    all_arrive(&[&["camera.noise_m=5e-6"], &["camera.tracking_radius_m=1e-3"], &["camera.latency_s=0.05"]]);
}

/// Noise assumed to be a half to four times what it is, a latency that is a frame off, a radius a hundredth off. Noise
/// assumed too small makes the floor of averages too high: then a wider tolerance is promised.
#[test]
fn law_what_is_assumed_of_the_camera_may_be_wrong() {
    all_arrive(&[
        &["estimator.assumed.camera.noise_m=2e-6"],
        &["estimator.assumed.camera.noise_m=4e-6"],
        &["estimator.assumed.camera.noise_m=5e-7", "position.tolerance_deg=0.01"],
        &["estimator.assumed.camera.latency_frames=0"],
        &["estimator.assumed.camera.latency_frames=2"],
        &["estimator.assumed.camera.tracking_radius_m=3.861e-3"],
        &["estimator.assumed.camera.tracking_radius_m=3.939e-3"],
    ]);
}

#[test]
fn law_a_camera_may_be_slow() {
    all_arrive(&[
        &["camera.frame_rate_hz=2000", "estimator.filter=twin"],
        &["camera.frame_rate_hz=1000", "estimator.filter=impact_aided"],
        &["camera.frame_rate_hz=1000", "estimator.filter=constant_rate"],
        &["camera.frame_rate_hz=3000"],
        &["camera.frame_rate_hz=60", "position.tolerance_deg=0.005"],
        &[
            "camera.frame_rate_hz=60",
            "ldv.installed=no",
            "position.to_deg=90",
            "position.tolerance_deg=0.003",
        ],
        &["camera.frame_rate_hz=50", "ldv.installed=no", "position.tolerance_deg=0.01"],
        &["camera.frame_rate_hz=10", "position.tolerance_deg=0.01"],
        &["camera.frame_rate_hz=10", "ldv.installed=no", "position.tolerance_deg=0.01"],
    ]);
}

/// What a camera cannot show is refused before anything moves, with the tolerance that it can.
#[test]
fn law_what_cannot_be_measured_is_refused_beforehand() {
    for resolution in ["4e-6", "6e-6", "1e-5"] {
        let scene = scene("905", &[&format!("camera.resolution_m={resolution}")]);
        let refusal = position::plan(&scene).expect_err("a floor above the tolerance").one_line();
        for word in ["position.tolerance_deg", "--tolerance"] {
            assert!(refusal.contains(word), "{refusal}");
        }
    }
    let slow = scene("905", &["camera.frame_rate_hz=10"]);
    assert!(position::plan(&slow).is_err(), "17 mdeg a frame are not averaged to 0.45 in 30 s of 10 frames");
}

/// A rotor without friction under teeth that stand still coasts on. It is braked, or given up with the reason.
#[test]
fn law_a_rotor_that_does_not_stop_is_braked() {
    for seed in SEEDS {
        let scene = scene(seed, &["plant.friction=paper"]);
        let outcome = position::run(&scene, |_| ()).expect("a scene that is taken");
        assert_ne!(outcome.stopped.as_deref(), Some("TimedOut"), "{outcome}");
        if outcome.stopped.is_none() {
            let off = 1e-3 * outcome.final_error_mdeg.abs() / outcome.tolerance_deg;
            assert!(off <= WRONG_TOLERANCES, "{outcome}");
        }
        // A turn at the fastest rate, 1000 deg/s, until the first brake works.
        assert!(outcome.overshoot_deg < 360.0, "{outcome}");
    }
}

/// A noisy camera holds a rate to what is promised of the mean, and says how often the reference began anew.
#[test]
fn law_a_rate_is_held_by_a_noisy_camera() {
    for seed in SEEDS {
        let sets = ["rate.deg_s=100", "rate.duration_s=6", "plant.step_s=5e-6", "camera.noise_m=5e-6"];
        let mut scene = Scene::of_sets(&sets.map(str::to_owned)).expect("a scene");
        scene.set("seed", seed).expect("a seed");
        let outcome = rate::run(&scene, |_| ()).expect("a scene that is taken");
        // The angle is off by half a degree at either end, of 575.
        assert!(outcome.mean_error_percent.is_some_and(|percent| percent.abs() < 0.2), "{outcome}");
        assert_eq!(outcome.reference_losses, 0, "{outcome}");
        let blind = ["rate.deg_s=100", "rate.duration_s=1", "plant.step_s=5e-6", "camera.lost_from_s=0.4"];
        let mut scene = Scene::of_sets(&blind.map(str::to_owned)).expect("a scene");
        scene.set("camera.lost_until_s", "0.7").expect("a time");
        let outcome = rate::run(&scene, |_| ()).expect("a scene that is taken");
        assert_eq!(outcome.reference_losses, 1, "{outcome}");
        assert!(outcome.to_string().contains("begun anew 1 times"), "{outcome}");
    }
}

/// Motors of half the size, with modes at 12 and 14 kHz, and of four times the mass, with their own twin, drive and
/// map, position; one whose mode B is too weak does so near by, and says what it cannot. None of eight moves is held as
/// on target far off it. As 95 % are promised within the tolerance, two may lie outside (the upper 97.5 % point) or end
/// with a reason: the shortest bursts of the modes at 12 and 14 kHz scatter by thirty tolerances, so that the drives
/// allowed may all miss.
#[test]
fn law_a_motor_of_ones_own_positions_or_says_what_it_can() {
    let folder = folder();
    let scene = |name: &str| format!("{}/../host-sim/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let map_of = |scene: &str| {
        succeeds(folder.path(), &["response-map", "--scene", scene, "--motors", "4", "--out", "map.toml"]);
    };
    let mut outside = Vec::new();
    for (name, targets) in [
        ("half_the_size", ["37", "1"]),
        ("higher_modes", ["37", "1"]),
        ("four_times_the_mass", ["37", "-37"]),
        ("weak_mode_b", ["1", "-37"]),
    ] {
        let scene = scene(name);
        map_of(&scene);
        for (seed, target) in SEEDS.into_iter().zip(targets) {
            let to = format!("--to={target}");
            let arguments =
                ["position", "--scene", &scene, "--map", "map.toml", &to, "--seed", seed, "--format", "json"];
            let outcome = json(folder.path(), &arguments);
            let [error_mdeg, tolerance_deg] =
                ["final_error_mdeg", "tolerance_deg"].map(|key| number(&outcome, key));
            let near = 1e-3 * error_mdeg.abs() <= WRONG_TOLERANCES * tolerance_deg;
            let held = outcome["stopped"].is_null() && !outcome["settle_time_s"].is_null();
            assert!(if held { near } else { outcome["reason"].is_string() }, "{name} {outcome}");
            outside.extend((outcome["ok"] != true).then(|| format!("{name} {outcome}")));
            // The way of the weak mode is gone by bursts that are not measured one by one: 150 take 3 s at most.
            let in_time = outcome["duration_s"].as_f64().is_some_and(|s| s < 3.0);
            assert!(in_time || name != "weak_mode_b", "{name} {outcome}");
        }
    }
    let (_, most) = binomial_bounds(8, 0.05);
    assert!(outside.len() <= most as usize, "{}", outside.join("\n"));
    let weak = scene("weak_mode_b");
    refuses(
        folder.path(),
        &["position", "--scene", &weak, "--map", "map.toml", "--to", "3637"],
        &["position.to_deg = 3637", "the other way round: --to -323"],
    );
    let half = scene("half_the_size");
    refuses(folder.path(), &["position", "--scene", &half, "--map", "map.toml"], &["map.toml", "motor."]);
}
