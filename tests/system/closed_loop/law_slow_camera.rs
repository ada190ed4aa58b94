//! A camera of 60 frames a second that come 20 ms late, beside a vibrometer: when a frame arrives, the next one's
//! exposure is 37 ms ago, and in that time up to 160 impacts have kicked the rotor.

use std::path::Path;

use host_sim::scene_files::load;
use motor_model::math;
use rayon::prelude::*;
use simulation::math::count::real;
use simulation::runs::rate;

const CAMERA: [(&str, &str); 2] = [("camera.frame_rate_hz", "60"), ("camera.latency_s", "0.02")];

/// Root mean square error of the angle in degrees, over motors, while a rate is held for a second.
fn rms_deg(filter: &str, deg_s: &str, motor: Option<&Path>, seeds: &[&str]) -> f64 {
    let square_mdeg2 = |seed: &&str| {
        let mut scene = load(motor, &[]).expect("a scene of the gallery");
        let of_run =
            [("estimator.filter", filter), ("rate.deg_s", deg_s), ("rate.duration_s", "1"), ("seed", *seed)];
        for (key, value) in of_run.iter().chain(&CAMERA) {
            scene.set(key, value).expect("a key and its value");
        }
        let rms_mdeg = rate::run(&scene, |_| ()).expect("a run").estimate_rms_mdeg.expect("estimates");
        rms_mdeg * rms_mdeg
    };
    let sum_mdeg2: f64 = seeds.par_iter().map(square_mdeg2).sum();
    1e-3 * math::sqrt(sum_mdeg2 / real(seeds.len()))
}

/// The filter that is called best is the most accurate one, and the twin is. By the camera alone the rotor may have
/// gained `sqrt(q t)` of rate, 10 rad/s by the kicks' 3000 rad^2/s^3 of mode B in 37 ms: more than 10 degrees. The twin
/// knows a kick to a tenth: a degree.
#[test]
fn law_the_twin_bridges_the_time_between_late_frames() {
    let seeds = ["61", "62", "63", "64"];
    for deg_s in ["50", "200"] {
        let [best, alone] = ["best", "constant_rate"].map(|filter| rms_deg(filter, deg_s, None, &seeds));
        assert!(best < 1.0 && alone > 5.0, "{deg_s} deg/s: {best} and {alone} degrees");
    }
}

/// Of a rotor that tilts fewer kicks are those of the model: where they are not taken the twin has the camera alone, as
/// the other filter, and elsewhere it has more.
#[test]
fn law_of_a_tilting_rotor_the_twin_knows_no_less_than_the_camera() {
    let tilting = Some(Path::new("set_f_plant"));
    let [best, alone] =
        ["best", "constant_rate"].map(|filter| rms_deg(filter, "200", tilting, &["61", "62"]));
    assert!(best < alone, "{best} and {alone} degrees");
}
