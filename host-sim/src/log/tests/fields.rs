//! One tick whose every value is another: each stands in its own field and its own column, in the unit of its name.

use estimator::{CameraFrame, Estimate, Health, Innovation, LdvSample, Source, Verdict};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::read;
use crate::log::table::{COLUMNS, Cell, RowMaker};
use crate::log::{Ending, LogMessage, LogOptions, LogRecorder};
use simulation::runs::record::{Impact, Observer as _, RunRecord, Task, Truth};
use simulation::scene::Scene;
use simulation::world::instruments::camera::MarkedPose;
use simulation::world::pose::{Pose, RotorTilt};

const IMPACT: Impact =
    Impact { at: Time::from_nanos(3_000), velocity_m_s: [-0.25, 0.125], rate_rad_s: [2.0, 3.5] };
const SAMPLE: LdvSample = LdvSample { taken_at: Time::from_nanos(5_000), velocity_m_s: 0.5 };

/// A tick that ends at 10 us, with a frame of 2 us.
fn record() -> RunRecord<'static> {
    let taken_at = Time::from_nanos(2_000);
    let pose = Pose { shift_m: [1e-6, 2e-6], slope: [3e-3, 4e-3], slope_rate_s: [5.0, 6.0] };
    RunRecord {
        at: Time::from_nanos(10_000),
        truth: Some(Truth {
            angle: Angle::from_degrees(10.0),
            own_axis_angle: Angle::from_degrees(11.0),
            rate_rad_s: 12.0,
            height_m: 13e-6,
            velocity_m_s: 0.375,
            tilt: Some(RotorTilt { pose, height_m: 14e-6 }),
        }),
        impacts: &[IMPACT],
        ldv_samples: &[SAMPLE],
        camera_frame: Some(CameraFrame {
            exposed_at: taken_at,
            angle: Angle::from_degrees(9.0),
            marks_used: 2,
            residual: 7,
        }),
        marked: Some(MarkedPose {
            angle: Angle::from_degrees(8.0),
            angle_sd_rad: 0.0625,
            shift_m: [7e-6, 8e-6],
            residual_m: 9e-6,
            marks_used: 3,
        }),
        innovation: Some(Innovation {
            source: Source::Camera,
            taken_at,
            innovation_rad: 0.25,
            variance_rad2: 0.015_625,
            verdict: Verdict::Used,
        }),
        estimate: Some(Estimate {
            at: Time::from_nanos(9_000),
            angle: Angle::from_degrees(10.5),
            rate_rad_s: 15.0,
            angle_rad2: 0.25,
            angle_rate_rad2_s: 0.5,
            rate_rad2_s2: 16.0,
            resting: true,
        }),
        health: Health::Good,
        asked: DriveCommand::saturating(DriveMode::B, 1.0),
        applied: DriveCommand::saturating(DriveMode::C, 0.75).with_frequency_offset(30.0).unwrap(),
        task: Task::Rate { wanted_rad_s: 17.0, reference: Some(Angle::from_degrees(18.0)), stopped: None },
    }
}

/// Degrees to angles round to 2^-32 turn.
#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-6 * expected.abs().max(0.1), "{found}, not {expected}");
}

#[test]
fn exact_every_value_stands_in_its_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = LogOptions { every: 1 };
    let mut recorder =
        LogRecorder::create(&path, options, "rate", &Scene::default(), std::sync::Arc::default()).unwrap();
    assert!(recorder.observe(&record()).is_continue());
    recorder.finish(Ending::Whole("{}")).unwrap();
    let (messages, _) = read(&std::fs::read(&path).unwrap());
    let mut seen = 0;
    for (at, message) in messages {
        seen += 1;
        let at = at.nanos();
        match message {
            LogMessage::Impact(impact) => {
                assert_eq!(at, 3_000);
                let velocities = [impact.velocity_before_m_s, impact.velocity_after_m_s];
                assert_eq!((velocities, impact.rate_before_rad_s), (IMPACT.velocity_m_s, 2.0));
                near(impact.rate_after_rad_s, 3.5);
            }
            LogMessage::VibrometerSample(sample) => {
                assert_eq!((at, sample.velocity_m_s, sample.arrived_after_ns), (5_000, 0.5, 5_000));
            }
            LogMessage::CameraFrame(frame) => {
                let found = (frame.marks_used, frame.arrived_after_ns, frame.residual_steps);
                assert_eq!((at, found), (2_000, (2, 8_000, 7)));
                near(frame.angle_deg, 9.0);
            }
            LogMessage::Marks(marks) => {
                near(marks.angle_deg, 8.0);
                near(marks.angle_sd_deg, 0.0625_f64.to_degrees());
                let found = (marks.shift_x_m, marks.shift_y_m, marks.residual_m, marks.marks_used);
                assert_eq!(found, (7e-6, 8e-6, 9e-6, 3));
            }
            LogMessage::Innovation(innovation) => {
                let found =
                    (innovation.innovation_rad, innovation.variance_rad2, innovation.normalised_squared);
                assert_eq!((at, found), (2_000, (0.25, 0.015_625, 4.0)));
                assert_eq!((innovation.verdict.as_str(), innovation.used), ("Used", true));
                assert_eq!(innovation.arrived_after_ns, 8_000);
            }
            LogMessage::Truth(truth) => {
                near(truth.angle_deg, 10.0);
                near(truth.own_axis_angle_deg, 11.0);
                assert_eq!(
                    (at, truth.rate_rad_s, truth.height_m, truth.velocity_m_s),
                    (10_000, 12.0, 13e-6, 0.375)
                );
            }
            LogMessage::Tilt(tilt) => {
                assert_eq!(
                    (tilt.slope_x, tilt.slope_y, tilt.shift_x_m, tilt.shift_y_m),
                    (3e-3, 4e-3, 1e-6, 2e-6)
                );
                near(tilt.tilt_mrad, 5.0);
            }
            LogMessage::Estimate(estimate) => {
                near(estimate.angle_deg, 10.5);
                near(estimate.angle_sd_mdeg, 1e3 * 0.5_f64.to_degrees());
                near(estimate.error_mdeg, 500.0);
                let variances = (estimate.angle_rad2, estimate.angle_rate_rad2_s, estimate.rate_rad2_s2);
                assert_eq!((estimate.rate_rad_s, variances), (15.0, (0.25, 0.5, 16.0)));
                assert_eq!((estimate.resting, estimate.age_ns), (true, 1_000));
            }
            LogMessage::Reference(reference) => {
                near(reference.angle_deg, 18.0);
                near(reference.wanted_rad_s.into(), 17.0);
            }
            LogMessage::Health(health) => assert_eq!((health.health.as_str(), health.level), ("Good", 0)),
            LogMessage::Task(task) => assert_eq!(task.phase, "Rate"),
            LogMessage::Drive(drive) => {
                assert_eq!(
                    (drive.mode.as_str(), drive.amplitude, drive.frequency_offset_hz),
                    ("C", 0.75, 30.0)
                );
                assert_eq!((drive.asked_mode.as_str(), drive.asked_amplitude), ("B", 1.0));
            }
        }
    }
    assert_eq!(seen, 12);
}

/// Of ten ticks every third has truth and estimate. Samples of all and the frame of the sixth are there, and the drive
/// that changes at the eighth.
#[test]
fn exact_every_third_tick_is_logged_and_nothing_else_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = LogOptions { every: 3 };
    let mut recorder =
        LogRecorder::create(&path, options, "rate", &Scene::default(), std::sync::Arc::default()).unwrap();
    for tick in 1..=10 {
        let at = Time::from_micros(10 * tick);
        let samples = [LdvSample { taken_at: at, velocity_m_s: 0.5 }];
        let applied = if tick < 8 { DriveCommand::OFF } else { record().applied };
        let camera_frame = record().camera_frame.filter(|_| tick == 6);
        let of_tick =
            RunRecord { at, impacts: &[], ldv_samples: &samples, camera_frame, applied, ..record() };
        assert!(recorder.observe(&of_tick).is_continue());
    }
    recorder.finish(Ending::Whole("{}")).unwrap();
    let (messages, _) = read(&std::fs::read(&path).unwrap());
    let micros = |is: fn(&LogMessage) -> bool| -> Vec<u64> {
        messages.iter().filter(|(_, message)| is(message)).map(|(at, _)| at.nanos() / 1000).collect()
    };
    let every_tick: Vec<u64> = (1..=10).map(|tick| 10 * tick).collect();
    assert_eq!(micros(|message| matches!(message, LogMessage::VibrometerSample(_))), every_tick);
    assert_eq!(micros(|message| matches!(message, LogMessage::Truth(_))), [10, 40, 70, 100]);
    assert_eq!(micros(|message| matches!(message, LogMessage::Estimate(_))), [10, 40, 70, 100]);
    assert_eq!(micros(|message| matches!(message, LogMessage::CameraFrame(_))), [2]);
    assert_eq!(micros(|message| matches!(message, LogMessage::Drive(_))), [10, 80]);
    assert_eq!(micros(|message| matches!(message, LogMessage::Health(_))), [10]);
}

#[test]
fn exact_every_value_stands_in_its_column() {
    let mut rows: Vec<Vec<(&str, Cell)>> = Vec::new();
    let mut maker = RowMaker::new();
    let mut take = |row: &crate::log::table::Row| -> Result<(), ()> {
        rows.push(row.filled().map(|(column, cell)| (COLUMNS[column].0, cell.clone())).collect());
        Ok(())
    };
    maker.of_samples(&[IMPACT], &[SAMPLE], &mut take).unwrap();
    maker.of_tick(&record(), false, &mut take).unwrap();
    // Nothing changed and it is no logged tick.
    let quiet = RunRecord { camera_frame: None, ..record() };
    maker.of_tick(&quiet, false, &mut take).unwrap();
    let numbers: [&[(&str, f64)]; 4] = [
        &[
            ("time_s", 3e-6),
            ("impact_kick_rad_s", 1.5),
            ("impact_velocity_before_m_s", -0.25),
            ("impact_velocity_after_m_s", 0.125),
        ],
        &[("time_s", 5e-6), ("vibrometer_m_s", 0.5)],
        &[
            ("time_s", 2e-6),
            ("camera_angle_deg", 9.0),
            ("camera_marks_used", 2.0),
            ("marks_shift_x_m", 7e-6),
            ("marks_shift_y_m", 8e-6),
            ("marks_residual_m", 9e-6),
            ("innovation_mdeg", 14_323.944_878_270_58),
            ("innovation_sd_mdeg", 7_161.972_439_135_29),
        ],
        &[
            ("time_s", 1e-5),
            ("truth_angle_deg", 10.0),
            ("truth_rate_rad_s", 12.0),
            ("truth_height_m", 13e-6),
            ("truth_velocity_m_s", 0.375),
            ("truth_tilt_mrad", 5.0),
            ("truth_shift_x_m", 1e-6),
            ("truth_shift_y_m", 2e-6),
            ("estimate_angle_deg", 10.5),
            ("estimate_angle_sd_mdeg", 28_647.889_756_541_16),
            ("estimate_rate_rad_s", 15.0),
            ("estimate_rate_sd_rad_s", 4.0),
            ("estimate_resting", 1.0),
            ("wanted_rate_rad_s", 17.0),
            ("reference_angle_deg", 18.0),
            ("drive_amplitude", 0.75),
            ("drive_frequency_offset_hz", 30.0),
        ],
    ];
    let words: [&[(&str, &str)]; 4] =
        [&[], &[], &[("verdict", "Used")], &[("health", "Good"), ("phase", "Rate"), ("drive_mode", "C")]];
    assert_eq!(rows.len(), 4);
    for ((row, numbers), words) in rows.iter().zip(numbers).zip(words) {
        assert_eq!(row.len(), numbers.len() + words.len(), "{row:?}");
        let cell = |name: &str| row.iter().find(|(column, _)| *column == name).map(|(_, cell)| cell.clone());
        for (name, expected) in numbers {
            let Some(Cell::Number(found)) = cell(name) else { panic!("{name} in {row:?}") };
            assert!((found - expected).abs() <= 1e-7 * expected.abs(), "{name}: {found}, not {expected}");
        }
        for (name, expected) in words {
            assert_eq!(cell(name), Some(Cell::from(*expected)), "{name}");
        }
    }
}
