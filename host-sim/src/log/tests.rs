//! What is written is read back, whatever it is, and up to wherever the file is cut.

mod fields;

use std::path::Path;
use std::sync::Arc;

use estimator::{CameraFrame, Estimate, Health, Innovation, LdvSample, Source, Verdict};
use motor_model::{Angle, DriveCommand, DriveMode};
use proptest::prelude::*;

use super::*;
use simulation::runs::record::{Observer as _, Task, Truth};

/// The content of a tick: samples, frame, estimate, drive.
type Drawn = (Vec<f32>, Option<(i32, u32)>, Option<(i64, [f32; 4])>, f32);

fn drawn() -> impl Strategy<Value = Drawn> {
    let number = || any::<f32>().prop_map(|number| if number.is_nan() { 0.5 } else { number });
    (
        proptest::collection::vec(number(), 0..4),
        proptest::option::of((any::<i32>(), 0_u32..200_000)),
        proptest::option::of((any::<i64>(), [number(), number(), number(), number()])),
        0.0_f32..=1.0,
    )
}

/// The records of what is drawn, tick by tick, each given to `take`.
fn records(drawn: &[Drawn], mut take: impl FnMut(&RunRecord)) {
    for ((samples, frame, estimate, amplitude), tick) in drawn.iter().zip(1..) {
        let at = Time::from_micros(10 * tick);
        let sample = |&velocity_m_s: &f32| LdvSample { taken_at: at, velocity_m_s };
        let samples: Vec<LdvSample> = samples.iter().map(sample).collect();
        let camera_frame = frame.map(|(units, early_nanos)| {
            let exposed_at = Time::from_nanos(at.nanos().saturating_sub(early_nanos.into()));
            CameraFrame::new(exposed_at, Angle::from_units(units.into()))
        });
        let estimate = estimate.map(|(units, [rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2])| {
            let (angle, resting) = (Angle::from_units(units), units % 2 == 0);
            Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting }
        });
        let drive = DriveCommand::saturating(DriveMode::B, *amplitude);
        take(&RunRecord {
            at,
            truth: Some(Truth::default()),
            impacts: &[],
            ldv_samples: &samples,
            camera_frame,
            marked: None,
            innovation: camera_frame.map(|frame| Innovation {
                source: Source::Camera,
                taken_at: frame.exposed_at,
                innovation_rad: *amplitude,
                variance_rad2: 1.0,
                verdict: Verdict::Used,
            }),
            estimate,
            health: Health::Good,
            asked: drive,
            applied: drive,
            task: Task::None,
        });
    }
}

fn written(path: &Path, drawn: &[Drawn]) {
    let options = LogOptions { every: 1 };
    let scene = Scene::default();
    let mut recorder = LogRecorder::create(path, options, "position", &scene, Arc::default()).unwrap();
    records(drawn, |record| assert!(recorder.observe(record).is_continue()));
    recorder.finish(Ending::Whole("{}")).unwrap();
}

/// A run that is refused after its log was opened leaves nothing, neither the log nor the file that would become it.
#[test]
fn exact_a_log_that_is_not_finished_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["run.mcap", "run.parquet", "run.csv"] {
        let (path, options) = (folder.path().join(name), LogOptions { every: 1 });
        let scene = Scene::default();
        let recorder = LogRecorder::create(&path, options, "position", &scene, Arc::default()).unwrap();
        drop(recorder);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{name}");
    }
}

/// The messages of a log whose bytes are `bytes`, up to its end or to why no more of it is read.
fn read(bytes: &[u8]) -> (Vec<(Time, LogMessage)>, Option<LogError>) {
    let mut reader = LogReader::new(Path::new("run.mcap"), bytes);
    let mut messages = Vec::new();
    loop {
        match reader.next_part() {
            Ok(Some(LogPart::Message(at, message))) => messages.push((at, message)),
            Ok(Some(_)) => {}
            Ok(None) => return (messages, None),
            Err(error) => return (messages, Some(error)),
        }
    }
}

/// The best for the instruments alone is the twin. A board may have another, and a recording has none.
#[test]
fn exact_a_log_names_the_filter_that_is_known_when_it_begins() {
    for (command, scene_says, expected) in [
        ("position", "best", "twin"),
        ("run", "best", "best"),
        ("run", "impact_aided", "impact_aided"),
        ("record", "best", "none"),
    ] {
        let scene = Scene::of_sets(&[format!("estimator.filter={scene_says}")]).unwrap();
        assert_eq!(Stated::of(command, &scene).filter, expected, "{command}");
    }
}

/// The writer finds a channel by the place of its message.
#[test]
fn exact_channels_have_the_order_of_their_messages() {
    fn place<M: channels::Described>() -> (usize, &'static str) {
        (M::PLACE, M::NAME)
    }
    let places = [
        place::<channels::Impact>(),
        place::<channels::VibrometerSample>(),
        place::<channels::CameraFrame>(),
        place::<channels::Marks>(),
        place::<channels::Innovation>(),
        place::<channels::Truth>(),
        place::<channels::Tilt>(),
        place::<channels::Estimate>(),
        place::<channels::Reference>(),
        place::<channels::Health>(),
        place::<channels::Task>(),
        place::<channels::Drive>(),
    ];
    assert_eq!(places.len(), CHANNELS.len());
    for (place, name) in places {
        assert_eq!(CHANNELS[place].message, name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Samples, frames, estimates and drives come back to the last bit and in order; a log that is cut anywhere gives
    /// the first of its messages, and a log with a changed byte no message that was not written.
    #[test]
    fn law_what_is_written_is_read_back(
        drawn in proptest::collection::vec(drawn(), 1..60),
        cut in 0.0_f64..1.0,
        flip in 1_u8..,
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        written(&path, &drawn);
        let bytes = std::fs::read(&path).unwrap();
        let (messages, why) = read(&bytes);
        prop_assert!(why.is_none(), "{why:?}");
        let mut found = messages.iter();
        let mut next = |wanted: &str| {
            let is_it = |message: &&(Time, LogMessage)| format!("{:?}", message.1).starts_with(wanted);
            found.clone().find(is_it).inspect(|_| while found.next().is_some_and(|m| !is_it(&m)) {})
        };
        records(&drawn, |record| {
            for sample in record.ldv_samples {
                let Some((at, LogMessage::VibrometerSample(read))) = next("VibrometerSample") else {
                    panic!("{sample:?}")
                };
                assert_eq!((*at, read.velocity_m_s.to_bits()), (sample.taken_at, sample.velocity_m_s.to_bits()));
            }
            if let Some(frame) = record.camera_frame {
                let Some((at, LogMessage::CameraFrame(read))) = next("CameraFrame") else { panic!("{frame:?}") };
                assert_eq!((*at, read.angle_units), (frame.exposed_at, frame.angle.units()));
                let arrived = at.nanos().saturating_add_signed(read.arrived_after_ns);
                assert_eq!(arrived, record.at.nanos());
            }
            if let Some(estimate) = record.estimate {
                let Some((at, LogMessage::Estimate(read))) = next("Estimate") else { panic!("{estimate:?}") };
                let floats = [read.rate_rad_s, read.angle_rad2, read.angle_rate_rad2_s, read.rate_rad2_s2];
                let wanted = [
                    estimate.rate_rad_s,
                    estimate.angle_rad2,
                    estimate.angle_rate_rad2_s,
                    estimate.rate_rad2_s2,
                ];
                assert_eq!(floats.map(f32::to_bits), wanted.map(f32::to_bits));
                assert_eq!((*at, read.angle_units), (record.at, estimate.angle.units()));
                assert_eq!(read.resting, estimate.resting);
            }
        });
        let same = |part: &[(Time, LogMessage)]| format!("{part:?}") == format!("{:?}", &messages[..part.len()]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
        let cut = (cut * bytes.len() as f64) as usize;
        let (before, why) = read(&bytes[..cut]);
        prop_assert!(matches!(why, Some(LogError::Damaged { .. })) && same(&before), "{why:?}");
        let mut changed = bytes;
        changed[cut] ^= flip;
        let (unchanged, why) = read(&changed);
        prop_assert!(unchanged.len() <= messages.len() && same(&unchanged));
        // A byte of a name may make it a log of another kind.
        let of_the_file = matches!(
            why,
            None | Some(LogError::Damaged { .. } | LogError::OtherChannel { .. } | LogError::OtherFormat { .. }
                | LogError::NotALog { .. })
        );
        prop_assert!(of_the_file, "{why:?}");
    }
}
