//! What the estimates at the cut and at rest leave unknown of a coast.

use super::*;

/// The errors of rate and angle at the cut, and of the angle at rest, are those of the estimates at these instants.
/// They count by the coast of the row that was ordered.
#[test]
fn exact_a_coast_brings_its_errors() {
    let (mut experimenter, mut now, rest) = ready();
    let map = ResponseMap::table_1();
    let mut commissioning = Commissioning::new(&Instruments { vibrometer: None, ..Instruments::default() });
    let experiment = commissioning.next(map).expect("a cruise is first");
    assert!(
        matches!(experiment, Experiment::Cruise { mode: DriveMode::B, .. }) && experimenter.order(experiment)
    );
    let (angle_rad2, angle_rate_rad2_s, rate_rad2_s2) = (4e-4, 0.03, 9.0);
    let errors = Estimate { angle_rad2, angle_rate_rad2_s, rate_rad2_s2, ..rest };
    let driven = Estimate { rate_rad_s: 15.0, resting: false, ..errors };
    let angle = rest.angle.plus(Angle::from_degrees(8.0));
    let still = Estimate { angle, angle_rad2: 1e-6, ..rest };
    while experimenter.phase() != ExperimentPhase::Ready || experimenter.response().is_none() {
        let is_driven = experimenter.phase() == ExperimentPhase::Cruising;
        let estimate = if is_driven { driven } else { still };
        experimenter.decide(now, Some(&estimate), Health::Good);
        now = now.plus_nanos(crate::TICK_NANOS);
    }
    commissioning.take(map, experimenter.response().unwrap());
    let (coasts, coast_s) = (commissioning.evidence().cruise(7).coasts, map.cruises()[7].coast_s);
    let expected_rad2 =
        angle_rad2 + 1e-6 + 2.0 * coast_s * angle_rate_rad2_s + coast_s * coast_s * rate_rad2_s2;
    assert_eq!(coasts.count(), 1);
    assert!((coasts.noise_rad2() / expected_rad2 - 1.0).abs() < 1e-5, "{coasts:?} {expected_rad2}");
}
