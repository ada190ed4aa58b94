//! Whether the filters know how wrong they are: normalised errors and innovations, phase by phase, over drawn motors, through the camera's quantisation.
//!
//! ANEES is held to the two-sided 95 % bounds of chi-square for one instant over so many motors. Where the rotor lies still its rate is exactly zero and any variance of it too
//! large: there the angle alone is judged, and of the stop, which is mostly rest, the upper bound. NIS would have to be within half a percent of 1 if every innovation were independent
//! of every other; but all of one motor share its friction, and kicks are not Gaussian: 4 % more are allowed, twice what 24 motors showed.

use host_sim::Scene;
use host_sim::estimate::{Estimation, Plan, Row};

const MOTORS: u64 = 5;

fn estimation() -> Estimation {
    Plan::new(&Scene::default(), MOTORS).expect("a plan").run(&|_| ()).expect("a run")
}

fn within(value: f64, (low, high): (f64, f64)) -> bool {
    value >= low && value <= high
}

#[track_caller]
fn assert_consistent(row: &Row) {
    let Row { anees, angle_anees, nis, whiteness, .. } = *row;
    let name = format!("{} {} {}", row.filter, row.drive, row.phase);
    let honest = match row.phase {
        "stop" => anees <= row.anees_bounds.1,
        "rest_100_ms" | "rest_1_s" => within(angle_anees, row.angle_anees_bounds),
        _ => within(anees, row.anees_bounds),
    };
    assert!(honest, "{name}: ANEES {anees} {:?}, of the angle {angle_anees}", row.anees_bounds);
    if !row.filter.ends_with("smoothed") {
        let (low, high) = row.nis_bounds;
        assert!(within(nis, (low - 0.04, high + 0.04)), "{name}: NIS {nis} {low} {high}");
        // The correlation of n white innovations is known to 1 / sqrt n; the bounds of their mean square are 2.8 times that wide to either side.
        assert!(whiteness.abs() < 0.04 + 0.5 * (high - low), "{name}: correlation {whiteness}");
    }
}

#[test]
fn law_filters_are_consistent_in_every_phase() {
    let estimation = estimation();
    let of_filters = estimation.rows.iter().filter(|row| !row.filter.starts_with("genie"));
    assert_eq!(of_filters.clone().count(), 5 * 6 * 2);
    of_filters.for_each(assert_consistent);
}
