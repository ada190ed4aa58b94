//! Instruments whose periods do not divide the plant's step, on a motor that turns.

use motor_model::{Angle, DriveMode};

use super::*;

fn rig(sets: &[&str]) -> Rig {
    let exact = ["camera.noise_m=0", "camera.resolution_m=0", "camera.latency_frames=0", "ldv.noise_m_s=0"];
    let sets: Vec<String> = exact.iter().chain(sets).map(|&set| set.to_owned()).collect();
    Rig::new(&Scene::of_sets(&sets).unwrap()).unwrap()
}

/// What a run of some ticks measured, and the angle and the velocity at every step, from the start on.
struct Record {
    frames: Vec<CameraFrame>,
    samples: Vec<LdvSample>,
    steps: Vec<(Angle, f64)>,
}

fn run(mut rig: Rig, command: DriveCommand, ticks: u32) -> Record {
    let rotor = |rotor: &RotorPoint| (rotor.angle, rotor.velocity_m_s);
    let mut record = Record { frames: vec![], samples: vec![], steps: vec![rotor(&rig.plant().rotor())] };
    for _ in 0..ticks {
        rig.tick_in_steps(command, &mut |step, _| record.steps.push(rotor(&step.after)));
        record.frames.extend(std::iter::from_fn(|| rig.camera_frame()));
        record.samples.extend(std::iter::from_fn(|| rig.ldv_sample()));
    }
    record
}

/// The values at the steps of 1 us on either side of an instant.
fn around<T: Copy>(steps: &[T], at: Time) -> [T; 2] {
    let nanos = usize::try_from(at.nanos()).unwrap();
    [steps[nanos / 1000], steps[nanos.div_ceil(1000)]]
}

/// 0.1 s at 3,000 frames and 30,000 samples a second: every instant is that of its number, and what it shows lies
/// between the rotor's states at the steps on either side.
#[test]
fn exact_instruments_measure_between_two_steps() {
    let rig = rig(&["camera.frame_rate_hz=3000", "ldv.sample_rate_hz=30000"]);
    let record = run(rig, DriveCommand::full(DriveMode::B), 10_000);
    let instant = |n: usize, rate: usize| Time::from_nanos(((2_000_000_000 * n / rate).div_ceil(2)) as u64);
    assert_eq!((record.frames.len(), record.samples.len()), (300, 3000));
    let mut turned = 0;
    for (n, frame) in record.frames.iter().enumerate() {
        assert_eq!(frame.exposed_at, instant(n + 1, 3000));
        let angles = around(&record.steps, frame.exposed_at).map(|(angle, _)| angle);
        // The camera's arc and back is within a unit.
        let [after, before] = angles.map(|angle| frame.angle.minus(angle).wrapped().units());
        assert!(after >= -1 && before <= 1 || after <= 1 && before >= -1, "{n}: {after} {before}");
        turned += u32::from(angles[0] != angles[1]);
    }
    assert!(turned > 150, "{turned}: the rotor turns while frames are exposed");
    for (n, sample) in record.samples.iter().enumerate() {
        assert_eq!(sample.taken_at, instant(n + 1, 30_000));
        let [before, after] = around(&record.steps, sample.taken_at).map(|(_, velocity)| velocity);
        let shown = f64::from(sample.velocity_m_s);
        assert!(shown > before.min(after) - 1e-7 && shown < before.max(after) + 1e-7, "{n}: {shown}");
    }
}

/// Where periods are whole steps, measurements are the plant's own states.
#[test]
fn exact_instruments_at_steps_show_the_plant_itself() {
    let record = run(rig(&[]), DriveCommand::full(DriveMode::C), 1000);
    assert_eq!((record.frames.len(), record.samples.len()), (100, 2000));
    for sample in &record.samples {
        let [(_, velocity), _] = around(&record.steps, sample.taken_at);
        #[expect(clippy::cast_possible_truncation, reason = "the instrument delivers f32")]
        let expected = velocity as f32;
        assert_eq!(sample.velocity_m_s.to_bits(), expected.to_bits());
    }
}

#[test]
fn exact_without_a_vibrometer_no_sample_comes() {
    let record = run(rig(&["ldv.installed=no"]), DriveCommand::full(DriveMode::B), 1000);
    assert_eq!((record.frames.len(), record.samples.len()), (100, 0));
}

/// Long steps at rest change nothing of when instruments measure, and each lasts as long as it is counted: the teeth
/// still ring after a burst, and the vibrometer sees as much of it. A long step is of second order: of 5 us in mode C
/// it has an error of `(w h)^2 / 12`, half a percent. A step that lasted longer than it is counted would have the
/// ringing decay faster.
#[test]
fn exact_instants_are_the_same_at_rest() {
    let burst = |sets: &[&str]| {
        let mut rig = rig(sets);
        for _ in 0..300 {
            rig.tick_in_steps(DriveCommand::saturating(DriveMode::C, 0.05), &mut |_, _| ());
            while rig.ldv_sample().is_some() {}
            while rig.camera_frame().is_some() {}
        }
        rig
    };
    for sets in [
        &["camera.frame_rate_hz=3000", "ldv.sample_rate_hz=30000"][..],
        &["camera.frame_rate_hz=29.97", "camera.exposure_frames=1", "ldv.installed=no"],
        &["camera.frame_rate_hz=700", "camera.phase_frames=0.3"],
    ] {
        let in_steps = run(burst(sets), DriveCommand::OFF, 10_000);
        let mut rig = burst(sets);
        let (mut frames, mut samples) = (vec![], vec![]);
        for _ in 0..10_000 {
            rig.tick(DriveCommand::OFF, &mut |_| ());
            frames.extend(std::iter::from_fn(|| rig.camera_frame()));
            samples.extend(std::iter::from_fn(|| rig.ldv_sample()));
        }
        let stamps = |frames: &[CameraFrame]| frames.iter().map(|f| f.exposed_at).collect::<Vec<_>>();
        let taken = |samples: &[LdvSample]| samples.iter().map(|s| s.taken_at).collect::<Vec<_>>();
        assert!(!frames.is_empty() && stamps(&frames) == stamps(&in_steps.frames), "{sets:?}");
        assert_eq!(taken(&samples), taken(&in_steps.samples), "{sets:?}");
        let seen = |samples: &[LdvSample]| {
            samples.iter().map(|s| f64::from(s.velocity_m_s)).map(|v| v * v).sum::<f64>()
        };
        let (long, single) = (seen(&samples), seen(&in_steps.samples));
        assert!((long - single).abs() <= 0.01 * single, "{sets:?}: {long:e} {single:e}");
    }
}

/// Only the loop's tick needs to be a whole number of steps.
#[test]
fn exact_a_step_that_does_not_divide_a_tick_is_refused() {
    for (step_s, steps) in [(1e-5, 1), (5e-6, 2), (2e-6, 5), (1e-6, 10), (2.5e-7, 40)] {
        assert_eq!(tick_steps(step_s).unwrap(), steps);
    }
    let line = tick_steps(3e-6).unwrap_err().one_line();
    assert!(line.contains("plant.step_s = 3e-6 s does not divide the period of the loop"), "{line}");
    assert_eq!([(1e-5, 1), (5e-6, 2), (2e-6, 5), (1e-6, 10)].map(|(s, n)| rest_steps(s, n)), [1, 1, 1, 5]);
}

/// A rotor that sticks does not turn, and goes up and down as before; before and after it turns.
#[test]
fn law_a_stuck_rotor_does_not_turn() {
    for rotor in ["height_only", "tilting"] {
        let rig = rig(&[&format!("plant.rotor={rotor}"), "faults=rotor:stuck@0.02..0.03"]);
        let record = run(rig, DriveCommand::full(DriveMode::C), 6000);
        let turned =
            |from: usize, to: usize| record.steps[to].0.minus(record.steps[from].0).units().unsigned_abs();
        // What a tilting rotor's axis sweeps is seen as an angle: at most its tilt squared, of a milliradian or two.
        let swept = if rotor == "tilting" { 4_294_967_296_u64 / 1_000_000 } else { 0 };
        let still = (20_000..30_000).map(|step| turned(20_000, step)).max();
        assert!(still.is_some_and(|units| units <= swept), "{rotor}: {still:?}");
        assert!(turned(0, 20_000) > 100 * swept.max(1000) && turned(30_000, 60_000) > 100 * swept.max(1000));
        let fastest = record.steps[20_000..30_000].iter().map(|(_, v)| v.abs()).fold(0.0, f64::max);
        assert!(fastest > 1e-3, "{rotor}: {fastest}");
    }
}

/// A tight hub that rubs changes the motion from then on, and not before; a rotor without a hub has no such fault.
#[test]
fn law_a_hub_rubs_from_its_time_on() {
    let tilting = |fault: &str| {
        let tight = "plant.motor.hub.clearance_m=2e-6";
        let rig = rig(&["plant.rotor=tilting", tight, &format!("faults={fault}")]);
        run(rig, DriveCommand::full(DriveMode::B), 10_000).steps
    };
    let (smooth, rough) = (tilting(""), tilting("hub:rub:2@0.05..0.06"));
    assert!(smooth[..50_000] == rough[..50_000]);
    assert!(smooth[50_000..] != rough[50_000..]);
    for rotor in ["height_only", "tilting_without_shift"] {
        let sets = [format!("plant.rotor={rotor}"), "faults=hub:rub:2".to_owned()];
        let refused = Rig::new(&Scene::of_sets(&sets).unwrap()).unwrap_err().one_line();
        assert!(refused.contains("hub:rub") && refused.contains("plant.rotor=tilting has one"), "{refused}");
    }
}

/// Faults that begin and end during a run, taken when they do: the run is that of the scene that has them from the
/// start, to the last bit.
#[test]
fn exact_faults_taken_during_a_run_are_those_of_a_scene() {
    let words = [
        "camera:lost@0.01..0.012",
        "camera:outliers:0.5@0.003..0.02",
        "camera:intermittent:0.3@0.003..",
        "mark1:stuck@0.015..",
        "ldv:inverted@0.01..0.02",
        "ldv:outliers:0.1@0.003..",
        "drive:weak:0.5@0.005..0.02",
        "stator:drift:-1@0.005..0.015",
        "rotor:jolt:3@0.012",
        "rotor:stuck@0.02..0.021",
        "hub:rub:0.8@0.01..0.015",
    ];
    let base = ["plant.rotor=tilting", "plant.step_s=1e-5"];
    let scene = |words: &[&str]| {
        let sets: Vec<String> = base.iter().map(|&set| set.to_owned()).collect();
        let mut scene = Scene::of_sets(&sets).unwrap();
        scene.set("faults", &words.join(",")).unwrap();
        scene
    };
    let observe = |rig: &mut Rig, seen: &mut Vec<_>| {
        rig.tick(DriveCommand::full(DriveMode::C), &mut |_| ());
        seen.extend(
            std::iter::from_fn(|| rig.camera_frame()).map(|frame| (frame.exposed_at, frame.angle.units())),
        );
        let samples = std::iter::from_fn(|| rig.ldv_sample());
        seen.extend(samples.map(|sample| (sample.taken_at, i64::from(sample.velocity_m_s.to_bits()))));
    };
    let (mut at_once, mut expected) = (Rig::new(&scene(&words)).unwrap(), Vec::new());
    let (mut one_by_one, mut seen) = (Rig::new(&scene(&[])).unwrap(), Vec::new());
    for tick in 0..3000 {
        // Each fault is added a tick before it begins: at that instant instruments have measured already.
        let known: Vec<&str> = words
            .iter()
            .copied()
            .filter(|word| {
                let from = word.split('@').nth(1).unwrap().split("..").next().unwrap();
                from.parse::<f64>().unwrap() < 1e-5 * f64::from(tick) + 1.5e-5
            })
            .collect();
        one_by_one.change_faults(&scene(&known)).unwrap();
        observe(&mut at_once, &mut expected);
        observe(&mut one_by_one, &mut seen);
    }
    let differs = seen.iter().zip(&expected).find(|(seen, expected)| seen != expected);
    assert!(differs.is_none() && seen.len() == expected.len(), "{differs:?}");
    // Without the faults it is another run.
    let (mut without, mut other) = (Rig::new(&scene(&[])).unwrap(), Vec::new());
    (0..3000).for_each(|_| observe(&mut without, &mut other));
    assert!(other != expected);
}

/// A fault that is refused changes nothing: a rotor that stays level has no hub.
#[test]
fn exact_a_refused_fault_leaves_the_rig_as_it_was() {
    let mut rig = rig(&["faults=drive:dead@0.001..", "plant.step_s=1e-5"]);
    let mut refused = Scene::default();
    refused.set("faults", "hub:rub:0.5@0.1..").unwrap();
    assert!(rig.change_faults(&refused).is_err());
    let turned = run(rig, DriveCommand::full(DriveMode::B), 2000).steps;
    let at_ms = |ms: usize| turned[100 * ms].0.degrees();
    // 2.5 ms of driving and ringing down, and nothing more.
    assert!((at_ms(20) - at_ms(19)).abs() < 0.2, "{} {}", at_ms(19), at_ms(20));
}

/// A rotor that is held does not turn, also with the drive off, where a free one takes long steps. One that tilts comes
/// to rest with its drive off, which to second order turns it by a quarter of the square of its tilt of 25 mrad: 9
/// milli-degrees.
#[test]
fn exact_a_rotor_that_is_held_does_not_turn() {
    let (off, b) = (DriveCommand::OFF, DriveCommand::full(DriveMode::B));
    let cases = [("plant.rotor=height_only", 0.0, &[off, b, off][..]), ("plant.rotor=tilting", 9e-3, &[off])];
    for (rotor, most_deg, commands) in cases {
        // No sample of the vibrometer is due within a long step.
        let mut rig = rig(&["faults=rotor:stuck@0.02..", "ldv.sample_rate_hz=10000", rotor]);
        (0..2000).for_each(|_| rig.tick(DriveCommand::full(DriveMode::C), &mut |_| ()));
        let angle = rig.plant().rotor().angle;
        assert!(angle != Angle::ZERO);
        for command in commands {
            (0..10_000).for_each(|_| rig.tick(*command, &mut |_| ()));
            let turned_deg = rig.plant().rotor().angle.minus(angle).degrees();
            assert!(turned_deg.abs() <= most_deg, "{rotor} {command:?}: {turned_deg}");
        }
    }
}

/// A repetition has noise of its own. The motor is that of the seed, and the first repetition has the seed's noise.
#[test]
fn exact_a_repetition_is_of_the_same_motor_with_other_noise() {
    let scene = |repetition: u32| Scene::of_sets(&[format!("plant.repetition={repetition}")]).unwrap();
    assert_eq!(scene(0).noise_seed(), scene(1).seed());
    let seen = |scene: &Scene| {
        let mut rig = Rig::new(scene).unwrap();
        for _ in 0..100 {
            rig.tick(DriveCommand::OFF, &mut |_| ());
        }
        let frames: Vec<Angle> = std::iter::from_fn(|| rig.camera_frame()).map(|frame| frame.angle).collect();
        let samples: Vec<f32> =
            std::iter::from_fn(|| rig.ldv_sample()).map(|sample| sample.velocity_m_s).collect();
        assert!(frames.len() > 5 && samples.len() > 100, "{} {}", frames.len(), samples.len());
        (*rig.plant().params(), frames, samples)
    };
    let [(params, frames, samples), (params_again, frames_again, samples_again)] =
        [0, 1].map(|of| seen(&scene(of)));
    assert_eq!(params, params_again);
    assert_ne!(frames, frames_again);
    assert_ne!(samples, samples_again);
}
