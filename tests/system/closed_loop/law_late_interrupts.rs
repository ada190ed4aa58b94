//! Interrupts that are late by up to 4 us, the most that `firmware/BRINGUP.md` allows: what they cost, and whether the
//! filters are as honest as without. The twin is told that bound, the others know nothing.
//!
//! In 2 us, their mean, a rotor at 600 deg/s turns by 1.2 milli-degrees, a tenth of a frame's noise. A drive that
//! changes its mode late has another phase from then on, by up to 0.03 rad: to hold 600 deg/s the loop brakes by mode C
//! now and then.

use rayon::prelude::*;
use simulation::math::count::real;
use simulation::runs::filter::FILTERS;
use simulation::runs::position;
use simulation::runs::rate::{self, RateOutcome};
use simulation::scene::Scene;

const LATE: (&str, &str) = ("board.interrupt_late_s", "4e-6");

/// Most estimates that may be off by more than three of their standard deviations: of 80 independent errors in a second
/// more than four are beyond three at a chance of 3e-6.
const BEYOND_3_SIGMA: f64 = 4.0 / 80.0;

/// Most that the error of the estimate may grow: by the quarter within which a standard deviation is to be right.
const COST: f64 = 1.25;

/// The motors, of which the twin gets all: one alone has luck.
const SEEDS: [&str; 8] = ["41", "42", "43", "44", "45", "46", "47", "48"];

fn scene(sets: &[(&str, &str)]) -> Scene {
    let mut scene = Scene::default();
    for (key, value) in sets {
        scene.set(key, value).expect("a key and its value");
    }
    scene
}

/// Runs that hold a rate for a second.
fn held(filter: &str, deg_s: &str, sets: &[(&str, &str)]) -> Vec<RateOutcome> {
    let of_run = |seed: &str| {
        let of_run =
            [("estimator.filter", filter), ("rate.deg_s", deg_s), ("rate.duration_s", "1"), ("seed", seed)];
        rate::run(&scene(&[&of_run, sets].concat()), |_| ()).expect("a run")
    };
    let motors = if filter == "twin" { SEEDS.len() } else { 1 };
    SEEDS[..motors].par_iter().map(|seed| of_run(seed)).collect()
}

/// Mean over runs of the squared error of the angle in mdeg^2, and of the share beyond three standard deviations.
fn means(runs: &[RateOutcome]) -> [f64; 2] {
    let mean = |of: &dyn Fn(&RateOutcome) -> Option<f64>| {
        runs.iter().map(|run| of(run).expect("estimates")).sum::<f64>() / real(runs.len())
    };
    [mean(&|run| run.estimate_rms_mdeg.map(|rms| rms * rms)), mean(&|run| run.stated.beyond_3_sigma)]
}

/// Samples are taken by a timer, on time. Where the interrupt takes them, as late as it is, the twin's kicks are wrong:
/// it takes them from the tooth's velocity at the instant of an impact, of whose period 4 us are nine degrees. The
/// frames show it, and it takes none: it is honest, and no better than the camera.
#[test]
fn law_late_interrupts_leave_estimates_honest() {
    for (filter, deg_s) in FILTERS.iter().flat_map(|&filter| [(filter, "600"), (filter, "-60")]) {
        let [on_time_mdeg2, _] = means(&held(filter, deg_s, &[]));
        for sampling in ["timer", "interrupt"] {
            let [late_mdeg2, beyond] = means(&held(filter, deg_s, &[LATE, ("board.sampling", sampling)]));
            let case = format!("{filter}, {deg_s}, {sampling}: {late_mdeg2} for {on_time_mdeg2}, {beyond}");
            let (honest, cheap) = (beyond < BEYOND_3_SIGMA, late_mdeg2 < COST * COST * on_time_mdeg2);
            match (filter, deg_s, sampling) {
                ("twin", "600", "interrupt") => assert!(honest && !cheap, "{case}"),
                _ => assert!(honest && cheap, "{case}"),
            }
        }
    }
}

/// A move ends at its target all the same.
#[test]
fn law_a_move_by_late_interrupts_ends_at_its_target() {
    for to_deg in ["20", "-5"] {
        let outcome = position::run(&scene(&[LATE, ("position.to_deg", to_deg)]), |_| ()).expect("a run");
        assert_eq!(outcome.stopped, None, "{to_deg}: {outcome}");
    }
}
