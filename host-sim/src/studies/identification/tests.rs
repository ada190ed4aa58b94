//! Identification beside independent calculations: closed forms, motors drawn and forgotten.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use motor_model::Time;
use tempfile::TempDir;

use super::*;
use crate::log::{Ending, LogOptions, LogRecorder};
use simulation::runs::recording;
use simulation::scene::Scene;

const NOTHING: &(dyn Fn() + Sync) = &|| ();
const SHORT: &str = "b:1 for 0.06, off for 0.02";
const RINGING: &str = "b:1 for 0.02, off for 0.012";

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

/// A log of a recording of `sets`.
fn logged(folder: &TempDir, name: &str, sets: &[&str]) -> PathBuf {
    let (scene, path) = (scene(sets), folder.path().join(name));
    let options = LogOptions { every: 10 };
    let mut log =
        LogRecorder::create(&path, options, "record", &scene, Arc::new(AtomicBool::new(false))).unwrap();
    assert!(recording::run(&scene, &mut log).unwrap().is_continue());
    log.finish(Ending::Whole("{}")).unwrap();
    path
}

fn effort(motors: u64) -> Effort {
    Effort { motors, advice: false, ..Effort::default() }
}

/// A rotor that turns by more than half a turn: what the frames add up to is what the rotor turned by.
#[test]
fn exact_a_recording_keeps_every_turn_and_drive() {
    let folder = TempDir::new().unwrap();
    let path = logged(&folder, "turn.mcap", &["record.schedule=b:1 for 0.3, off for 0.05"]);
    let recorded = Recorded::read(&path).unwrap();
    let ControlFlow::Continue(outcome) = recording::run(&recorded.scene, &mut ()).unwrap() else {
        panic!("whole")
    };
    let turned_deg = recorded.measured.frames.last().unwrap().angle_rad.to_degrees();
    let truth_deg = outcome.turned_deg.unwrap();
    assert!(truth_deg > 200.0, "{truth_deg}");
    // A frame has an error of some millidegrees; the last one is exposed before the end, when the rotor rests.
    assert!((turned_deg - truth_deg).abs() < 0.1, "{turned_deg} {truth_deg}");
    assert_eq!(recorded.course.until, Time::from_nanos(350_010_000));
    assert_eq!((recorded.command.as_str(), recorded.damage), ("record", None));
}

/// A ring-down tells the frequency of its mode as exactly as its samples allow, and says nothing of the rotor.
#[test]
fn law_a_bare_stator_tells_its_frequency_and_not_the_rotor() {
    let folder = TempDir::new().unwrap();
    let truth_hz = 6294.5;
    let log = logged(
        &folder,
        "ring.mcap",
        &[
            "record.model=stator",
            &format!("record.schedule={RINGING}"),
            "plant.motor.mode_b.frequency_hz=6294.5",
            "plant.parameters=nominal",
        ],
    );
    let plan = IdentificationPlan::new(vec![Recorded::read(&log).unwrap()], effort(150)).unwrap();
    let found = plan.run(&NOTHING).unwrap();
    let of = |key: &str| found.parameters.iter().find(|parameter| parameter.key == key).unwrap();
    let hz = of("motor.mode_b.frequency_hz");
    let (mean, sd) = (hz.mean.unwrap(), hz.sd.unwrap());
    // 0.2 mm/s of 0.8 m/s in a ring-down of 4 ms at 200,000 samples a second: the bound of
    // `analysis::least_squares` is 0.3 mHz. What the emulator adds stays below a hundredth of the resonance's width.
    assert!((mean - truth_hz).abs() < 5.0 * sd && sd < 0.8 && sd > 1e-4, "{mean} {sd}");
    for key in ["motor.friction", "motor.rotor_mass_kg", "motor.mode_c.frequency_hz"] {
        let parameter = of(key);
        assert!(
            !parameter.told && parameter.interval.is_none() && parameter.advice.is_some(),
            "{parameter:?}"
        );
    }
    // What was identified is a scene that every command takes.
    let mut identified = Scene::default();
    identified.set_all(&found.scene(), &log).unwrap();
    assert!((identified.number("motor.mode_b.frequency_hz") - mean).abs() < 1e-3);
    assert!(
        identified
            .tolerance("motor.mode_b.frequency_hz")
            .is_some_and(|t| (t / (2.0 * sd) - 1.0).abs() < 1e-3)
    );
}

#[test]
fn exact_any_number_of_threads_gives_the_same() {
    let folder = TempDir::new().unwrap();
    let log = logged(&folder, "run.mcap", &[&format!("record.schedule={SHORT}"), "ldv.installed=no"]);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let plan = IdentificationPlan::new(vec![Recorded::read(&log).unwrap()], effort(40)).unwrap();
        pool.install(|| plan.run(&NOTHING)).unwrap()
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one, two);
    // Without a vibrometer there is nothing of flight and impacts.
    assert!(one.fit.iter().all(|statistic| !statistic.name.contains("velocity")), "{:?}", one.fit);
}

#[test]
fn exact_what_cannot_be_identified_is_refused() {
    let folder = TempDir::new().unwrap();
    let log = |name: &str, sets: &[&str]| logged(&folder, name, sets);
    let refused = |paths: &[&PathBuf]| {
        let recordings: Result<Vec<Recorded>, _> = paths.iter().map(|path| Recorded::read(path)).collect();
        let error = recordings.and_then(|recordings| IdentificationPlan::new(recordings, effort(10)));
        error.unwrap_err()
    };
    let short = log("short.mcap", &["record.schedule=b:1 for 0.015"]);
    assert!(matches!(refused(&[&short]), IdentificationError::TooShort { .. }));
    let blind =
        log("blind.mcap", &["record.schedule=b:1 for 0.03", "ldv.installed=no", "faults=camera:lost"]);
    assert!(matches!(refused(&[&blind]), IdentificationError::TooShort { .. }));
    let nan = log("nan.mcap", &["record.schedule=b:1 for 0.03", "faults=ldv:not_a_number@0.01.."]);
    let error = refused(&[&nan]);
    assert!(error.to_string().contains("/vibrometer has a message at 0.010"), "{error}");
    let one = log("one.mcap", &["record.schedule=b:1 for 0.03"]);
    let other = log("other.mcap", &["record.schedule=b:1 for 0.03", "motor.friction=0.3"]);
    assert!(matches!(refused(&[&one, &other]), IdentificationError::OtherDesign { .. }));
    let again = folder.path().join(".").join("one.mcap");
    assert!(matches!(refused(&[&one, &again]), IdentificationError::Twice { .. }));
    assert!(matches!(refused(&[]), IdentificationError::NoRecordings));
}

/// Of 40 motors that were drawn and forgotten the 90 % intervals hold the truth in 90 %, and errors are as large as the
/// posterior says. Were all parameters of a motor wrong together, the share of 40 would have a standard deviation of
/// `sqrt(0.09 / 40)`, and a mean square of normal errors one of `sqrt(2 / 40)`: three of these either way.
#[test]
fn law_intervals_hold_the_truth() {
    let plan = CalibrationPlan::under(&Scene::default(), [SHORT, RINGING], 40, effort(300)).unwrap();
    let found = plan.run(&NOTHING).unwrap();
    assert!(found.parameters.len() >= 3, "{found:?}");
    let (covered, all) = found.coverage();
    let share = f64::from(covered) / f64::from(all);
    assert!((share - 0.9).abs() < 3.0 * 0.0474 && share < 0.995, "{share} {found:?}");
    let squares: Spread = found
        .parameters
        .iter()
        .map(|parameter| {
            parameter.error.mean * parameter.error.mean + parameter.error.sd * parameter.error.sd
        })
        .collect();
    assert!((squares.mean - 1.0).abs() < 3.0 * 0.2236, "{squares:?} {found:?}");
    for parameter in &found.parameters {
        assert_eq!(parameter.ranks.iter().sum::<u32>(), parameter.motors);
    }
}
