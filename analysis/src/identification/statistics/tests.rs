//! Statistics of motions that have a closed form.

use motor_model::{DriveCommand, DriveMode, MotorParams, Time, math};

use super::*;
use crate::identification::measured::Frame;
use simulation::runs::recording::{DriveChange, DriveCourse};

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
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

/// Frames of a face that turns at 2 rad/s under the drive and at 1 rad/s after it, with marks that shift to either side
/// by up to 10 um, evenly, and residuals of 0.1 and 0.3 um.
#[test]
fn exact_statistics_of_frames_and_marks() {
    let course =
        DriveCourse::of(&"b:1 for 0.43, off for 0.02".parse().unwrap(), &MotorParams::nominal()).unwrap();
    let drive_end_s = 0.430_01;
    let mut measured = Measured::default();
    for frame in 0..4500_u32 {
        let at_s = 1e-4 * f64::from(frame);
        let angle_rad = 2.0 * at_s.min(drive_end_s) + (at_s - drive_end_s).max(0.0);
        let side = if frame % 2 == 0 { 1.0 } else { -1.0 };
        let shift_m = [side * 1e-8 * f64::from(frame % 1000), 3e-6];
        let marks_m = Some((shift_m, 1e-7 * (2.0 + side)));
        measured.frames.push(Frame { at_s, angle_rad, marks_m });
    }
    let found = statistics(&Scene::default(), &Parts::of(&course, &measured), &measured);
    let is_about = |name: &str, expected: f64, within: f64| {
        let found = value(&found, name);
        assert!((found - expected).abs() < within, "{name}: {found} {expected}");
    };
    is_about("b:1 mean rate", 2.0, 1e-9);
    is_about("b:1 ln spread of the rate", math::ln(1e-2), 1e-6);
    // Quantiles of an even spread over a thousand steps; the constants keep the logarithms finite.
    is_about("b:1 ln median shift", math::ln(5e-6 + 1e-7), 4e-3);
    is_about("b:1 ln large shift", math::ln(9.5e-6 + 1e-7), 4e-3);
    is_about("b:1 ln residual", math::ln(2e-7 + 1e-8), 1e-6);
    is_about("b:1 ln spread of the residual", math::ln(1e-7 + 1e-8), 1e-3);
    // A frame comes every 0.1 ms.
    is_about("after b:1 turned in 1 ms", 1e-3, 1.1e-4);
    is_about("after b:1 turned in 16 ms", 16e-3, 1.1e-4);
}

/// Resonance and amplitude of a bare stator as its closed form has them.
#[test]
fn exact_statistics_of_a_bare_stator() {
    let schedule = "record.schedule=b:0.2@6240..6360 for 0.5, off for 0.02, b:0.2 for 0.03, off for 0.02";
    let set =
        ["record.model=stator", schedule, "plant.parameters=nominal", "plant.motor.mode_b.frequency_hz=6310"];
    let scene = scene(&set);
    let course = DriveCourse::of(&scene.schedule("record.schedule"), &scene.motor_params()).unwrap();
    let measured = Measured::of_motor(&scene, &course).unwrap();
    let found = statistics(&scene, &Parts::of(&course, &measured), &measured);
    // The answer lags by 1 / (zeta w) = 4 ms of 240 Hz/s.
    assert!((value(&found, "sweep 1 frequency") - 6310.0).abs() < 2.0, "{found:?}");
    let decay = 0.0063 * std::f64::consts::TAU * 6310.0;
    assert!((value(&found, "sweep 1 decay") / decay - 1.0).abs() < 0.05, "{found:?}");
    // A tooth rings at w sqrt(1 - zeta^2), seen through noise of 0.2 mm/s.
    let ringing_hz = 6310.0 * math::sqrt(1.0 - 0.0063 * 0.0063);
    assert!((value(&found, "after b:0.2 frequency") - ringing_hz).abs() < 0.02, "{found:?}");
    assert!((value(&found, "after b:0.2 decay") / decay - 1.0).abs() < 1e-3, "{found:?}");
    // The oscillation is largest before the drive ends, and a period lasts 32 samples.
    let within = |from: f64, until: f64| {
        let samples = measured.at_s.iter().zip(&measured.velocity_m_s);
        samples
            .filter(move |(at, _)| (from..until).contains(*at))
            .fold(0.0, |most: f64, (_, v)| most.max(v.abs()))
    };
    let amplitude = value(&found, "after b:0.2 amplitude");
    assert!((amplitude / within(0.548, 0.55) - 1.0).abs() < 0.02, "{found:?}");
    assert!((value(&found, "sweep 1 amplitude") / within(0.0, 0.5) - 1.0).abs() < 0.05, "{found:?}");
}

/// Velocities of a rotor that comes to rest, level within each window of the time since the drive.
#[test]
fn exact_energies_of_a_rotor_that_comes_to_rest() {
    let course =
        DriveCourse::of(&"b:1 for 0.03, off for 0.02".parse().unwrap(), &MotorParams::nominal()).unwrap();
    let levels_m_s = [(1e-3, 0.05), (2e-3, 0.04), (4e-3, 0.03), (8e-3, 0.02), (16e-3, 0.01)];
    let mut measured = Measured::default();
    for sample in 0..10_000_u32 {
        let at_s = 5e-6 * (f64::from(sample) + 0.5);
        let since_s = at_s - 0.030_01;
        let level =
            levels_m_s.into_iter().find(|(until_s, _)| since_s < *until_s).map_or(0.0, |level| level.1);
        measured.at_s.push(at_s);
        measured.velocity_m_s.push(if sample % 2 == 0 { level } else { -level });
    }
    let found = statistics(&Scene::default(), &Parts::of(&course, &measured), &measured);
    for (until_s, level) in levels_m_s {
        let energy = value(&found, &format!("after b:1 ln energy until {} ms", 1e3 * until_s));
        assert!((energy - math::ln(level * level + 1e-9)).abs() < 1e-9, "{until_s}: {energy}");
    }
}
