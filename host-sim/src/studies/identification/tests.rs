//! Identification beside independent calculations: closed forms, direct simulation, motors drawn and forgotten.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use motor_model::{DriveCommand, DriveMode, Time};
use tempfile::TempDir;

use super::emulator::Emulator;
use super::measured::Measured;
use super::parts::{Kind, Parts};
use super::statistics::{Statistic, statistics};
use super::training::{Setting, draw_motors};
use super::*;
use crate::log::{Ending, LogOptions, LogRecorder};
use crate::math::count::real;
use crate::runs::recording::{self, DriveChange, DriveCourse};
use crate::scene::Scene;

const NOTHING: &(dyn Fn() + Sync) = &|| ();
const SHORT: &str = "b:1 for 0.06, off for 0.02";
const RINGING: &str = "b:1 for 0.02, off for 0.012";

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::load(None, &sets).unwrap()
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

fn value(found: &[Statistic], name: &str) -> f64 {
    found.iter().find(|statistic| statistic.name == name).unwrap_or_else(|| panic!("{name}: {found:?}")).value
}

/// A ball that falls with drag and is thrown up again: `v' = -g - c v`, thrown by an impact of 30 mm/s every 5 ms. The
/// regression over flights finds `-c` and `-g`, and every impact is counted.
#[test]
fn exact_statistics_of_a_ball_that_is_thrown_up() {
    let (g, c, h): (f64, f64, f64) = (9.81, 60.0, 5e-6);
    let mut measured = Measured::default();
    let (mut v, decay) = (0.03, math::exp(-c * h));
    for sample in 0..80_000_u32 {
        if sample % 1000 == 999 {
            v += 0.03;
        }
        v = (v + g / c) * decay - g / c;
        measured.at_s.push(f64::from(sample) * h);
        measured.velocity_m_s.push(v);
    }
    let course = DriveCourse {
        changes: vec![DriveChange { from: Time::ZERO, command: DriveCommand::full(DriveMode::B) }],
        until: Time::from_micros(400_000),
    };
    let parts = Parts::of(&course, &measured);
    let found = statistics(&Scene::default(), &parts, &measured);
    assert!((value(&found, "b:1 damping in flight") / -c - 1.0).abs() < 1e-3, "{found:?}");
    assert!((value(&found, "b:1 fall in flight") / -g - 1.0).abs() < 1e-3);
    // 200 a second; 0.03 s to settle leaves 74 impacts of 0.37 s.
    assert!((value(&found, "b:1 ln impacts a second") - math::ln(201.0)).abs() < 0.02);
    let jump = math::ln(0.03 + (-g - c * v) * h);
    assert!((value(&found, "b:1 mean ln jump") - jump).abs() < 5e-3);
    assert!((value(&found, "b:1 mean ln interval") - math::ln(5e-3)).abs() < 1e-6);
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
    // `math::least_squares` is 0.3 mHz. What the emulator adds stays below a hundredth of the resonance's width.
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
