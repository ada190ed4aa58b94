use motor_model::{AmplitudeVariation, Stator, StatorState};

use super::*;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::world::plant::Plant;

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

fn course(schedule: &str) -> DriveCourse {
    DriveCourse::of(&schedule.parse().unwrap(), &MotorParams::nominal()).unwrap()
}

/// Every sample of a recording with the drive at the end of its tick.
fn recorded(sets: &[&str]) -> Vec<(DriveCommand, LdvSample)> {
    let scene = scene(sets);
    let mut samples = Vec::new();
    let ended = run_course(
        &scene,
        &DriveCourse::of(&scene.schedule("record.schedule"), &scene.motor_params()).unwrap(),
        &mut |record: &RunRecord| {
            samples.extend(record.ldv_samples.iter().map(|sample| (record.applied, *sample)));
            ControlFlow::Continue(())
        },
    );
    assert!(ended.unwrap().is_continue());
    samples
}

#[test]
fn exact_changes_of_a_schedule() {
    let of = |nanos, command| DriveChange { from: Time::from_nanos(nanos), command };
    let b = DriveCommand::try_new(DriveMode::B, 0.5).unwrap();
    let expected = DriveCourse {
        changes: vec![
            of(10_000, b),
            of(1_010_000, DriveCommand::OFF),
            of(1_020_000, DriveCommand::full(DriveMode::C).with_frequency_offset(-5.0).unwrap()),
            of(2_020_000, DriveCommand::full(DriveMode::C).with_frequency_offset(5.0).unwrap()),
            of(3_020_000, DriveCommand::OFF),
        ],
        until: Time::from_nanos(3_020_000),
    };
    assert_eq!(course("b:0.5 for 0.001, off for 1e-5, c:1@7450..7470 for 0.002"), expected);
}

#[test]
fn exact_a_frequency_too_far_from_the_design_is_refused_with_its_bounds() {
    let schedule = "b:1@6000..8400 for 1".parse().unwrap();
    let refused = DriveCourse::of(&schedule, &MotorParams::nominal()).unwrap_err().one_line();
    let expected = "error: record.schedule: b:1@6000..8400 is more than 2000 Hz from motor.mode_b.frequency_hz; hint: \
                    4300 to 8300 Hz";
    assert_eq!(refused, expected);
}

#[test]
fn exact_a_recording_without_an_instrument_is_refused() {
    let scene = scene(&["record.model=stator", "ldv.installed=no"]);
    let refused = run(&scene, &mut ()).unwrap_err().to_string();
    assert_eq!(refused, "record.model = stator with ldv.installed = no measures nothing");
}

/// With the drive off a tooth rings at `w_d = w sqrt(1 - zeta^2)` and decays by `exp(-zeta w t)`. Sampled at distance h
/// it obeys `v(t + h) = 2 q cos(w_d h) v(t) - q^2 v(t - h)` with `q = exp(-zeta w h)`.
#[test]
fn exact_a_bare_stator_rings_down_at_its_frequency_and_damping() {
    let (hz, zeta, step_s) = (6312.0, 0.004, 5e-6);
    let samples = recorded(&[
        "record.model=stator",
        "record.schedule=b:1 for 0.01, off for 0.002",
        "plant.motor.mode_b.frequency_hz=6312",
        "plant.motor.mode_b.damping_ratio=0.004",
        "ldv.noise_m_s=0",
    ]);
    let ringing: Vec<f64> =
        samples.iter().skip(2010).map(|(_, sample)| f64::from(sample.velocity_m_s)).collect();
    let natural = std::f64::consts::TAU * hz;
    let q = motor_model::math::exp(-zeta * natural * step_s);
    let (_, cosine) =
        motor_model::math::sin_cos(natural * motor_model::math::sqrt(1.0 - zeta * zeta) * step_s);
    assert!(ringing.len() > 300 && ringing.iter().any(|v| v.abs() > 0.1));
    for [before, now, after] in ringing.windows(3).map(|three| [three[0], three[1], three[2]]) {
        let expected = 2.0 * q * cosine * now - q * q * before;
        // Samples are f32: three of them, of at most 1 m/s.
        assert!((after - expected).abs() < 4.0 * f64::from(f32::EPSILON), "{after} {expected}");
    }
}

/// The vibrometer sees a tooth of the first pair, upwards positive, with the amplitude that this run has.
#[test]
fn exact_a_bare_stator_shows_a_tooth_of_its_first_pair() {
    let sets = [
        "record.model=stator",
        "record.schedule=b:1 for 0.003",
        "plant.parameters=nominal",
        "plant.motor.amplitude_variation=0.05",
        "plant.step_s=1e-6",
        "ldv.noise_m_s=0",
    ];
    let scene = scene(&sets);
    let plant = Plant::draw(&scene).unwrap();
    let mut draw = random_streams::stream(scene.seed(), RandomSource::AmplitudeVariation);
    let [first, _] = AmplitudeVariation::draw(plant.params(), &mut draw).pairs;
    assert!(first.abs() > 1e-3, "{first}");
    let stator = Stator::<f64>::try_new(plant.params(), plant.tuning(), 1e-6).unwrap();
    let mut state = StatorState::default();
    let [tooth, _] = stator.teeth();
    let velocity_m_s: Vec<f64> = (0..=3010)
        .map(|step| {
            let before = (1.0 + first) * tooth.vertical_velocity(&state.modes);
            stator.step(
                &mut state,
                if step < 10 { DriveCommand::OFF } else { DriveCommand::full(DriveMode::B) },
            );
            before
        })
        .collect();
    let samples = recorded(&sets);
    assert!(samples.len() > 600);
    for (_, LdvSample { taken_at, velocity_m_s: seen }) in samples {
        let step = usize::try_from(taken_at.nanos() / 1000).unwrap();
        let expected = velocity_m_s[step];
        // A sample is f32, of at most 1 m/s.
        assert!((f64::from(seen) - expected).abs() < f64::from(f32::EPSILON), "{step}: {seen} {expected}");
    }
}

/// A drive that is swept through the resonance moves the tooth most where its frequency is that of the motor.
#[test]
fn law_a_sweep_is_largest_at_the_resonance() {
    let samples = recorded(&[
        "record.model=stator",
        "record.schedule=b:0.2@6200..6400 for 0.5",
        "plant.motor.mode_b.frequency_hz=6260",
    ]);
    let largest = samples.iter().max_by(|a, b| a.1.velocity_m_s.total_cmp(&b.1.velocity_m_s)).unwrap().0;
    let hz = 6300.0 + f64::from(largest.frequency_offset_hz());
    // The answer lags by 1 / (zeta w) = 4 ms of 400 Hz/s, and is flat within a tenth of its width of 80 Hz.
    assert!((hz - 6260.0).abs() < 10.0, "{hz}");
}

#[test]
fn exact_a_stator_has_no_camera_and_no_faults_of_a_motor() {
    for set in ["camera.marks=3", "fault.drive_gain=0.5", "faults=drive:dead"] {
        let refused = BareStator::new(&scene(&["record.model=stator", set])).unwrap_err().one_line();
        assert!(refused.starts_with("error: record.model = stator does not use "), "{refused}");
    }
    assert!(BareStator::new(&scene(&["record.model=stator", "faults=ldv:inverted"])).is_ok());
}

/// Both rotors: mode B turns clockwise, mode C counter-clockwise; and the stator has samples without frames.
#[test]
fn law_a_recording_has_what_was_asked_for() {
    for rotor in ["height_only", "tilting"] {
        for (schedule, sign) in [("b:0.3 for 0.15", 1.0), ("c:1 for 0.1", -1.0)] {
            let scene = scene(&[
                &format!("plant.rotor={rotor}"),
                &format!("record.schedule={schedule}"),
                "plant.step_s=5e-6",
            ]);
            let ControlFlow::Continue(outcome) = run(&scene, &mut ()).unwrap() else { panic!("whole") };
            assert!(sign * outcome.turned_deg.unwrap() > 0.5, "{outcome:?}");
            let frames = outcome.duration_s * 10_000.0;
            assert!((real(outcome.camera_frames) - frames).abs() < 3.0, "{outcome:?}");
        }
    }
    let scene = scene(&["record.model=stator", "record.schedule=b:0.3 for 0.01"]);
    let ControlFlow::Continue(outcome) = run(&scene, &mut ()).unwrap() else { panic!("whole") };
    assert_eq!((outcome.camera_frames, outcome.turned_deg), (0, None));
    assert_eq!(outcome.vibrometer_samples, 2002);
}
