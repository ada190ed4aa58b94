//! A camera whose frames are stamped by a clock of its own, which is off by 0.1 s and drifts by 50 ppm against the
//! board's. What its computer makes of the stamps is off by up to half of a round trip, the same in all frames. Told of
//! it, the filters are as far off as they say, in motion and at rest, on the default motor and on set F. Not told, they
//! are surer than right in motion.

use std::path::Path;

use host_sim::scene_files::load;
use host_sim::studies::filter_errors::{FilterErrorsPlan, FilterErrorsRow};
use simulation::Scene;
use simulation::runs::filter::FILTERS;

use crate::support::consistency_rows::{Asked, Row, assert_family_within, outside_if_variances_were};
use crate::support::plant_step::CONVERGED;

/// The error of the clock is one number of a run.
const MOTORS: u64 = 4;
const ONE: f64 = 1.0;

const CLOCK: [(&str, &str); 2] = [("camera.clock_offset_s", "0.1"), ("camera.clock_drift_ppm", "50")];
const NOT_TOLD: (&str, &str) = ("estimator.assumed.camera.clock_error_s", "0");

fn is_rest(row: &Row) -> bool {
    row.name.ends_with("rest_1_s")
}

/// Rows of the angle in steady motion and after a second of rest, in both modes.
fn rows(motor: &str, scene: &Scene, sets: &[(&str, &str)]) -> Vec<Row> {
    let mut scene = scene.clone();
    for (key, value) in CLOCK.iter().chain(&[CONVERGED]).chain(sets) {
        scene.set(key, value).expect("a key and its value");
    }
    let plan = FilterErrorsPlan::new(&scene, MOTORS).expect("a plan").without_genies().without_smoothers();
    let run = plan.run(&|_| ()).expect("a run");
    let row = |row: &FilterErrorsRow| Row {
        name: format!("{motor}, {}, {}, {}", row.filter, row.drive, row.phase),
        asked: Asked::Right,
        means: row.of_runs.angle_anees.clone(),
        independent: ONE,
    };
    let is_judged =
        |row: &&FilterErrorsRow| FILTERS.contains(&row.filter) && ["steady", "rest_1_s"].contains(&row.phase);
    let rows: Vec<Row> = run.rows.iter().filter(is_judged).map(row).collect();
    assert_eq!(rows.len(), 2 * 2 * FILTERS.len());
    rows
}

/// Fault B2: camera stamps on another clock that drifts by 50 ppm are estimated, and what is left is covered.
#[test]
fn law_stamps_of_another_clock_are_estimated_and_covered() {
    let set_f = load(Some(Path::new("set_f_plant")), &[]).expect("a scene of the gallery");
    let mut all = rows("default", &Scene::default(), &[]);
    all.extend(rows("set f", &set_f, &[]));
    assert_family_within("another clock", &all, &[]);
    let mut not_told = rows("default", &Scene::default(), &[NOT_TOLD]);
    not_told.retain(|row| !is_rest(row));
    assert_eq!(outside_if_variances_were(1.0, &not_told, not_told.len()), not_told.len(), "{not_told:?}");
}
