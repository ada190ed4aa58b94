//! Identification beside independent calculations: direct simulation, motors drawn and forgotten.

use super::emulator::{Emulator, of_told};
use super::measured::Measured;
use super::parameters;
use super::parts::{Kind, Parts};
use super::training::{DrawnMotor, Setting, draw_motors};
use simulation::math::count::real;
use simulation::math::statistics::Spread;
use simulation::runs::recording::DriveCourse;
use simulation::scene::Scene;

const NOTHING: &(dyn Fn() + Sync) = &|| ();
const RINGING: &str = "b:1 for 0.02, off for 0.012";

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

/// A motor that is drawn has nothing of the true motor whose recording is identified.
#[test]
fn exact_a_drawn_motor_has_nothing_of_the_true_one() {
    let truth = [
        "plant.motor.amplitude_variation=0.05",
        "plant.motor.friction=0.55",
        "plant.motor.hub.friction=0.45",
    ];
    let own = scene(&[&truth[..], &["plant.rotor=tilting", "seed=77", "ldv.noise_m_s=3e-4"]].concat());
    let other = scene(&["plant.rotor=tilting", "seed=5", "ldv.noise_m_s=3e-4"]);
    let unknowns = parameters::unknowns(&own, 1.5).unwrap();
    let values: Vec<f64> = unknowns.iter().map(|unknown| unknown.prior.mean()).collect();
    let drawn = |scene: &Scene| parameters::motor_scene(scene, &unknowns, &values, 9).unwrap();
    let (of_own, of_other) = (drawn(&own), drawn(&other));
    assert_eq!(of_own.text(&|_| true, false), of_other.text(&|_| true, false));
    assert_eq!((of_own.seed(), of_own.number("ldv.noise_m_s")), (9, 3e-4));
}

/// Drives of one kind are pooled, short ones are left out, and a coast belongs to the drive before it.
#[test]
fn exact_parts_of_a_recording() {
    let schedule = "b:1 for 0.1, off for 0.05, b:1 for 0.04, off for 0.005, c:0.5 for 0.015, off for 0.02";
    let course = DriveCourse::of(&schedule.parse().unwrap(), &Scene::default().motor_params()).unwrap();
    let parts = Parts::of(&course, &Measured::default());
    let spans = |kinds: &[Kind]| -> Vec<(String, usize)> {
        kinds.iter().map(|kind| (kind.name.clone(), kind.spans.len())).collect()
    };
    assert_eq!(spans(&parts.driven), [("b:1".to_owned(), 2)]);
    assert_eq!(spans(&parts.coasting), [("after b:1".to_owned(), 1), ("after c:0.5".to_owned(), 1)]);
    let [(from, until), (second, _)] = parts.driven[0].spans[..] else { panic!("two") };
    assert!((from - 0.030_01).abs() < 1e-12 && (until - 0.100_01).abs() < 1e-12);
    // Of a drive of 0.04 s half is left out.
    assert!((second - 0.170_01).abs() < 1e-12);
    assert!(parts.is_empty(false) && parts.is_empty(true), "nothing is measured");
}

/// Summaries of motors that are simulated with these parameters scatter about what the emulator says of them as much as
/// it says: of n motors the mean is off by its standard deviation over sqrt(n), beside the emulator's own error.
#[test]
fn dual_the_emulator_and_direct_simulation_agree() {
    let scene = scene(&["record.model=stator", &format!("record.schedule={RINGING}")]);
    let unknowns = parameters::unknowns(&scene, 1.5).unwrap();
    let settings = [Setting::planned(scene, &unknowns, 0).unwrap()];
    let motors = draw_motors(&settings, &unknowns, 1, 200, &NOTHING).unwrap();
    let emulator = Emulator::learn(&motors).unwrap();
    let told: Vec<&str> = emulator.told.iter().map(|number| unknowns[*number].key).collect();
    for key in ["motor.mode_b.frequency_hz", "motor.mode_b.damping_ratio", "motor.mode_b.tooth_amplitude_m"] {
        assert!(told.contains(&key), "{told:?}");
    }
    assert!(!told.contains(&"motor.friction") && !told.contains(&"motor.mode_c.frequency_hz"), "{told:?}");
    let others = draw_motors(&settings, &unknowns, 2, 100, &NOTHING).unwrap();
    let whitened = others.iter().map(|motor| {
        let told = of_told(&emulator.told, &motor.standard);
        let error = emulator.summary(&motor.statistics) - emulator.mean(&told);
        emulator.whitened(&error).norm_squared() / real(emulator.told.len())
    });
    // The covariance of a t distribution with 10 degrees of freedom is 1.25 of its scale matrix, 1.1 of normal errors.
    // Of 100 motors with three values or more a mean square is known to sqrt(2 / 300) for normal errors; twice that for
    // heavier tails.
    let mean: Spread = whitened.collect();
    assert!((0.6..2.0).contains(&mean.mean), "{mean:?}");
}

/// Two recordings of a motor under the same drives are of one motor, with noise of their own.
#[test]
fn exact_recordings_of_a_drawn_motor_have_noise_of_their_own() {
    let scene = scene(&["record.model=stator", &format!("record.schedule={RINGING}")]);
    let unknowns = parameters::unknowns(&scene, 1.5).unwrap();
    let at = |place| Setting::planned(scene.clone(), &unknowns, place).unwrap();
    let drawn = |settings: &[Setting]| draw_motors(settings, &unknowns, 1, 2, &NOTHING).unwrap();
    let (both, first, second) = (drawn(&[at(0), at(1)]), drawn(&[at(0)]), drawn(&[at(1)]));
    assert_eq!(first[0].beside(&second[0]), both[0]);
    assert_eq!(first[0].standard, second[0].standard);
    assert_ne!(first[0].statistics, second[0].statistics);
    assert_ne!(first[0].standard, first[1].standard);
    // The noise moves a frequency by far less than motors differ.
    let hz = |motors: &[DrawnMotor], number: usize| motors[number].statistics[0];
    assert!((hz(&first, 0) - hz(&second, 0)).abs() < 0.1 && (hz(&first, 0) - hz(&first, 1)).abs() > 0.1);
}
