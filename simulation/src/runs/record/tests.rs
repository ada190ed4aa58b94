//! Records of short runs.

use estimator::AngleFilter as _;

use super::*;
use crate::runs::filter::AnyFilter;
use crate::runs::{position, rate};
use crate::scene::Scene;

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

/// A filter that is given what the records say the loop's filter took in, beside the loop's own estimates.
struct Beside {
    filter: AnyFilter,
    ticks: u64,
    frames: u64,
    samples: u64,
}

impl Beside {
    fn new(scene: &Scene) -> Self {
        Self { filter: AnyFilter::of(scene).unwrap(), ticks: 0, frames: 0, samples: 0 }
    }
}

impl Observer for Beside {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        for sample in record.ldv_samples {
            self.filter.update_ldv(sample);
        }
        let innovation = record.camera_frame.map(|frame| self.filter.update_camera(&frame));
        assert_eq!(innovation, record.innovation);
        assert_eq!((record.estimate, record.health), self.filter.assess(record.at));
        self.filter.drive(record.at, record.applied);
        self.ticks += 1;
        self.frames += u64::from(innovation.is_some());
        self.samples += record.ldv_samples.len() as u64;
        ControlFlow::Continue(())
    }
}

/// A move with late and lost frames, a weak drive and a vibrometer that fails for a while; a rate, with a rotor that
/// tilts.
#[test]
fn dual_a_filter_that_is_given_the_records_computes_the_loops_bits() {
    let of_move = scene(&[
        "position.to_deg=5",
        "camera.late_probability=0.05",
        "camera.drop_probability=0.05",
        "camera.outlier_probability=0.02",
        "camera.outlier_m=1e-3",
    ]);
    let mut beside = Beside::new(&of_move);
    let mut refused = 0;
    let outcome = position::run_with(&of_move, |run, moment| {
        let record = run.record(moment);
        refused += u32::from(record.is_refused());
        assert_eq!(record.error_mdeg(), moment.estimate_error_mdeg());
        beside.observe(&record)
    });
    assert!(outcome.unwrap().is_continue() && refused > 0);
    assert!(beside.frames > 500 && beside.samples > 10 * beside.frames, "{} frames", beside.frames);

    let of_rate = scene(&["plant.rotor=tilting", "rate.duration_s=1", "rate.deg_s=200"]);
    let mut beside = Beside::new(&of_rate);
    let outcome = rate::run_with(
        &of_rate,
        |_| (),
        |run, moment| {
            let record = run.record(moment);
            assert!(matches!(record.task, Task::Rate { .. }) && record.truth.unwrap().tilt.is_some());
            beside.observe(&record)?;
            if beside.ticks < 20_000 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        },
    );
    assert!(outcome.unwrap().is_break());
    assert_eq!(beside.ticks, 20_000);
}

/// What is observed changes nothing, and an observer that breaks ends the run.
#[test]
fn exact_a_run_has_the_same_outcome_with_observers_and_without() {
    let scene = scene(&["position.to_deg=-3"]);
    let alone = position::run(&scene, |_| ()).unwrap();
    let mut beside = (Beside::new(&scene), Some(Beside::new(&scene)));
    let observed = position::run_with(&scene, |run, moment| beside.observe(&run.record(moment))).unwrap();
    assert_eq!(observed, ControlFlow::Continue(alone));
    assert_eq!(beside.0.ticks, beside.1.unwrap().ticks);
    let mut none: (Option<Beside>, ()) = (None, ());
    assert!(
        position::run_with(&scene, |run, moment| none.observe(&run.record(moment))).unwrap().is_continue()
    );
}

/// A tooth pushes up: an impact leaves the rotor faster upwards than it found it, but for the fall in its step. In
/// flight the rate changes by damping alone, so that all kicks together are the change of the rate.
#[test]
fn law_impacts_push_up_and_their_kicks_are_the_change_of_the_rate() {
    let scene = scene(&["position.to_deg=90"]);
    let (mut kicks_rad_s, mut rate_rad_s, mut impacts) = (0.0, 0.0, 0);
    let ended = position::run_with(&scene, |run, moment| {
        for impact in run.impacts() {
            let [before, after] = impact.velocity_m_s;
            assert!(after > before - 1e-4, "{impact:?}");
            assert!(impact.at <= moment.at && moment.at.nanos_since(impact.at) < 10_000);
            kicks_rad_s += impact.kick_rad_s();
            impacts += 1;
        }
        rate_rad_s = moment.rate_rad_s;
        if moment.seconds() < 0.05 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert!(ended.unwrap().is_break() && impacts > 10, "{impacts}");
    assert!((kicks_rad_s / rate_rad_s - 1.0).abs() < 0.05, "{kicks_rad_s} {rate_rad_s}");
}

/// A rate that is held no more says why in the record.
#[test]
fn exact_a_rate_that_has_stopped_says_so() {
    let report = |stopped| Task::Rate { wanted_rad_s: 1.0, reference: None, stopped };
    assert_eq!(report(None).word(), "Rate");
    assert_eq!(report(Some(RateStop::WrongWay)).word(), "Stopped(WrongWay)");
}
