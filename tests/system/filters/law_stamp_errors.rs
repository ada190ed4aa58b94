//! Errors of the time stamps of frames. Told of their standard deviation, a filter is as far off as it says: a frame's
//! variance is larger by the square of what the rotor turns by meanwhile (F21). Not told, it is surer than right.

use host_sim::studies::filter_errors::{FilterErrors, FilterErrorsPlan, FilterErrorsRow};
use simulation::Scene;
use simulation::runs::filter::FILTERS;
use simulation::runs::rate;

use crate::support::consistency_rows::{Asked, Row, assert_family_within, outside_if_variances_were};
use crate::support::plant_step::CONVERGED;

const MOTORS: u64 = 4;

/// A stamp's error of a frame's period. At 300 deg/s the rotor turns by 30 milli-degrees in it, at full drive in mode B
/// by 86: two and seven times the noise of a frame.
const JITTER: (&str, &str) = ("camera.stamp_jitter_s", "1e-4");
const NOT_TOLD: (&str, &str) = ("estimator.assumed.camera.stamp_jitter_s", "0");

/// Independent squares of the error of angle and rate in 0.5 s of steady motion: two in each memory of a filter. That
/// is 12 ms, and grows with the fourth root of a frame's variance: 50 times that of a frame without errors of stamps.
const STEADY: f64 = 80.0 / 2.66;

fn scene(sets: &[(&str, &str)]) -> Scene {
    let mut scene = Scene::default();
    for (key, value) in [CONVERGED, JITTER].iter().chain(sets) {
        scene.set(key, value).expect("a key and its value");
    }
    scene
}

/// Rows of the filters in steady motion, in both modes.
fn steady(sets: &[(&str, &str)]) -> Vec<Row> {
    let plan =
        FilterErrorsPlan::new(&scene(sets), MOTORS).expect("a plan").without_genies().without_smoothers();
    let run: FilterErrors = plan.run(&|_| ()).expect("a run");
    let row = |row: &FilterErrorsRow| Row {
        name: format!("{}, {}", row.filter, row.drive),
        asked: Asked::Right,
        means: row.of_runs.anees.clone(),
        independent: STEADY,
    };
    let is_judged = |row: &&FilterErrorsRow| FILTERS.contains(&row.filter) && row.phase == "steady";
    let rows: Vec<Row> = run.rows.iter().filter(is_judged).map(row).collect();
    assert_eq!(rows.len(), 2 * FILTERS.len());
    rows
}

#[test]
fn law_errors_of_stamps_that_are_told_are_covered() {
    assert_family_within("stamps told", &steady(&[]), &[]);
    // In mode C a rotor turns by less than a frame's noise meanwhile.
    let mut not_told = steady(&[NOT_TOLD]);
    not_told.retain(|row| row.name.ends_with(", b"));
    assert_eq!(not_told.len(), FILTERS.len());
    assert_eq!(outside_if_variances_were(1.0, &not_told, not_told.len()), not_told.len(), "{not_told:?}");
}

/// Share of the estimates beyond three of their standard deviations, of a rate of 300 deg/s.
fn beyond_3_sigma(filter: &str, sets: &[(&str, &str)]) -> f64 {
    let of_run = [("estimator.filter", filter), ("rate.deg_s", "300"), ("rate.duration_s", "1")];
    let outcome = rate::run(&scene(&[&of_run, sets].concat()), |_| ()).expect("a run");
    outcome.stated.beyond_3_sigma.expect("estimates")
}

/// Of 80 independent errors in a second, of which each exceeds three standard deviations at a chance of 0.27 %, more
/// than four do so at a chance of 3e-6. Of a filter that is not told an eighth do at least.
#[test]
fn law_a_rate_is_held_by_stamps_whose_errors_are_told() {
    for filter in FILTERS {
        let [told, not_told] = [&[][..], &[NOT_TOLD]].map(|sets| beyond_3_sigma(filter, sets));
        assert!(told <= 4.0 / 80.0, "{filter}: {told}");
        assert!(not_told > 1.0 / 8.0, "{filter}: {not_told}");
    }
}
