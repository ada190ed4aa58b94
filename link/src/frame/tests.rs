extern crate std;

use core::fmt::Write as _;
use std::string::String;
use std::vec::Vec;

use controller::rate::RateStop;
use estimator::{CameraDescription, Health, Instruments, Source, Verdict};
use motor_model::DriveMode;
use proptest::prelude::*;
use rand_core::Rng;
use rand_pcg::Pcg64;

use super::*;
use crate::{
    BoardFault, BoardIdentity, BoardMessage, CameraAges, CameraRecord, Coded, CommandRecord, Configuration,
    Counters, Deframer, DescriptionDigests, EstimateRecord, ExperimentDrive, ExperimentRecord,
    ExperimentsConfiguration, FilterKind, ForecastRecord, HostMessage, InnovationRecord, Jog, JogReport,
    KeptDescription, LdvRecord, LdvRecords, LearntRecord, MotorParameterRecord, PhaseRecord,
    RateConfiguration, RateLimitsRecord, RatePhase, RateRecord, ResetCause, ResponseRecord, SelfTestReport,
    ShownRecord, TargetRecord, TickRecord, UnreachableRecord, VelocitySums, encode_camera, map_messages,
};

pub(super) const HEADER: Header = Header { session: 0x0102_0304, sequence: 7, ticks: 1 << 40 };

pub(super) fn framed<M: Serialize>(header: Header, message: &M) -> Vec<u8> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode(header, message, &mut frame).unwrap();
    frame[..length].to_vec()
}

fn ldv(samples: usize) -> HostMessage {
    let sample = |n| LdvRecord { taken_nanos: u64::MAX - n, velocity_m_s: -0.1 };
    HostMessage::Ldv((0..samples as u64).map(sample).collect::<LdvRecords>())
}

const MOVE: Configuration = Configuration {
    filter: FilterKind::ImpactAided,
    target_deg: -90.0,
    tolerance_deg: 0.02,
    deadline_nanos: 30_000_000_000,
};

const RATE: RateConfiguration = RateConfiguration {
    filter: FilterKind::Twin,
    rate_deg_s: -160.0,
    duration_nanos: 20_000_000_000,
    limits: RateLimitsRecord { travel_deg: None, on_max_nanos: None, progress_window_nanos: None },
};

/// Mode B at half level.
const COMMAND: CommandRecord =
    CommandRecord { mode: Coded::from_number(1), amplitude: 0.5, frequency_offset_hz: 12.5 };

const LEARNT: LearntRecord = LearntRecord {
    factors: [[1.25, 1e-3]; 7],
    step_walk_covariance: -5e-4,
    resonances: [[31.5, 40.0], [-20.0, 90.0]],
};

const VELOCITY: VelocitySums = VelocitySums {
    samples: 20_000,
    reference_m_s: -1e-4,
    sum_m_s: 0.25,
    sum_squares_m2_s2: 0.5,
    largest_m_s: 0.03,
};

const LIMITS: RateLimitsRecord = RateLimitsRecord {
    travel_deg: Some((-90.0, 180.0)),
    on_max_nanos: Some(10_000_000_000),
    progress_window_nanos: Some(150_000_000),
};

fn experiment(drive: ExperimentDrive) -> HostMessage {
    let mode = Some(DriveMode::C).into();
    HostMessage::Experiment(ExperimentRecord { number: 300, mode, amplitude: 0.75, offset_hz: -62.5, drive })
}

fn response(shown: ShownRecord) -> BoardMessage {
    BoardMessage::Response(ResponseRecord { number: 300, shown })
}

pub(super) fn host_messages() -> Vec<HostMessage> {
    let camera = HostMessage::Camera(CameraRecord {
        exposed_nanos: 123_456_789,
        angle_units: -5,
        marks_used: 2,
        residual: 12,
    });
    let shared = CameraDescription { mark_bias_m: 3e-7, shift_m: 7e-6, ..CameraDescription::default() };
    let camera_told = CameraDescription { stamp_sd_s: 1e-4, clock_sd_micros: 292, ..shared };
    let instruments = HostMessage::Instruments(Instruments { camera: camera_told, ..Instruments::default() });
    let parameter = HostMessage::MotorParameter(MotorParameterRecord { index: 7, value: -0.5 });
    let arm = HostMessage::Arm;
    let short = [
        HostMessage::Hello,
        HostMessage::Configure(MOVE),
        HostMessage::Forecast(MOVE),
        HostMessage::ConfigureRate(RATE),
        HostMessage::ConfigureRate(RateConfiguration { limits: LIMITS, ..RATE }),
        HostMessage::Retarget(TargetRecord { target_deg: 12.5, tolerance_deg: 0.01 }),
        HostMessage::Hold,
        HostMessage::Latency { ticks: 12 },
        HostMessage::Identify,
        HostMessage::Keep,
        HostMessage::Forget,
        HostMessage::Digest,
        HostMessage::DescriptionBegin,
        HostMessage::Jog(Jog { command: COMMAND, duration_nanos: 200_000_000 }),
        HostMessage::SelfTest,
        HostMessage::Zero { angle_units: None },
        HostMessage::Zero { angle_units: Some(-1 << 33) },
        HostMessage::ConfigureExperiments(ExperimentsConfiguration {
            filter: FilterKind::ConstantRate,
            time_max_nanos: 60_000_000_000,
        }),
        experiment(ExperimentDrive::Sweep),
        experiment(ExperimentDrive::Cruise),
        experiment(ExperimentDrive::Train { ticks: 300, count: 8 }),
        HostMessage::Response,
        HostMessage::MapLearnt(LEARNT),
        HostMessage::Learnt,
        arm,
        HostMessage::Step,
        camera,
        ldv(2),
        ldv(16),
        instruments,
        parameter,
    ];
    // Begin and end of a map, and of rows the longest and the shortest.
    let map: Vec<_> = map_messages(controller::ResponseMap::table_1()).collect();
    short
        .into_iter()
        .chain([map[0].clone(), map[1].clone(), map[4].clone(), map[map.len() - 1].clone()])
        .collect()
}

/// The bytes of a frame, computed by hand: CRC-32 by zlib, no zero byte to hide but those shown.
#[test]
fn exact_bytes_of_a_frame() {
    let header = Header { session: 0x1111_1111, sequence: 0x2222_2222, ticks: 0x3333_3333_3333_3333 };
    let content = [&[VERSION][..], &[0x11; 4], &[0x22; 4], &[0x33; 8], &[2]].concat();
    assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926, "the check value of CRC-32/ISO-HDLC");
    let crc = CRC.checksum(&content).to_le_bytes();
    assert!(!crc.contains(&0));
    let expected = [&[23][..], &content, &crc, &[0]].concat();
    assert_eq!(framed(header, &HostMessage::Arm), expected);
}

/// Every message comes back from its frame, which has one zero byte.
#[test]
fn exact_every_message_comes_back() {
    for message in host_messages() {
        let mut frame = framed(HEADER, &message);
        assert_eq!(frame.iter().filter(|&&byte| byte == 0).count(), 1, "{frame:?}");
        assert_eq!(decode::<HostMessage>(&mut frame), Ok((HEADER, message)));
    }
    for message in board_messages() {
        assert_eq!(decode(&mut framed(HEADER, &message)), Ok((HEADER, message)));
    }
}

fn digests(kept: KeptDescription) -> BoardMessage {
    BoardMessage::Digests(DescriptionDigests { in_force: 0xfedc_ba98_7654_3210, kept })
}

/// Messages of the board, one of each kind.
fn board_messages() -> Vec<BoardMessage> {
    let command =
        CommandRecord { mode: Some(DriveMode::C).into(), amplitude: 0.5, frequency_offset_hz: -1.5 };
    let estimate = EstimateRecord {
        at_nanos: 123_456_789,
        angle_units: -1 << 33,
        rate_rad_s: 1.5,
        angle_rad2: 1e-9,
        angle_rate_rad2_s: -1e-9,
        rate_rad2_s2: 1e-3,
        resting: false,
    };
    let camera = InnovationRecord {
        source: Source::Camera.into(),
        taken_nanos: 123_400_000,
        innovation_rad: 1e-4,
        variance_rad2: 1e-8,
        verdict: Verdict::Used.into(),
    };
    let report = TickRecord {
        estimate: Some(estimate),
        health: Health::Good.into(),
        camera: Some(camera),
        command,
        applied: command,
        phase: PhaseRecord::Burst.into(),
        since_nanos: 123_000_000,
        rate: None,
    };
    let rate = RateRecord { wanted_rad_s: -2.5, reference_units: Some(-1 << 34) };
    let phase = PhaseRecord::Rate(RatePhase::Stopped(RateStop::NoEstimate)).into();
    let of_rate = TickRecord { phase, rate: Some(rate), ..report };
    let forecast = ForecastRecord {
        error_rad: 1e-5,
        time_s: 4.0,
        time_sd_s: 0.5,
        measuring_s: 3.0,
        frames: 600.0,
        drives: u32::MAX,
    };
    [
        BoardMessage::Welcome { tick_nanos: 10_000 },
        BoardMessage::Configured,
        BoardMessage::Armed,
        BoardMessage::Stopped,
        BoardMessage::Report(report),
        BoardMessage::Report(of_rate),
        BoardMessage::Counters(Counters { taken: 300, damaged: 2, ..Counters::default() }),
        BoardMessage::Fault(BoardFault::OutOfBounds { key: "position.to_deg".try_into().unwrap() }),
        BoardMessage::Fault(BoardFault::UnknownSession { session: 300 }),
        BoardMessage::Described,
        BoardMessage::Retargeted { target_units: -1 << 31 },
        BoardMessage::Fault(BoardFault::NoMove),
        BoardMessage::Fault(BoardFault::NoEstimate),
        BoardMessage::Identity(BoardIdentity {
            loop_digest: 0x0123_4567_89ab_cdef,
            reset_cause: ResetCause::Watchdog.into(),
        }),
        BoardMessage::Learnt(LEARNT),
        BoardMessage::Kept,
        BoardMessage::Forgotten,
        digests(KeptDescription::Nothing),
        digests(KeptDescription::Whole { digest: 0x0123_4567_89ab_cdef }),
        digests(KeptDescription::OtherVersion { version: 9 }),
        BoardMessage::Fault(BoardFault::KeepsNothing),
        BoardMessage::Fault(BoardFault::NotStored),
        BoardMessage::Jogging,
        BoardMessage::Jogged(JogReport { ticks: 20_000, applied: COMMAND, velocity: VELOCITY }),
        BoardMessage::SelfTest(SelfTestReport {
            amplifier_works: true,
            has_converter: true,
            ticks: 10_000,
            late_ticks: 2,
            velocity: VELOCITY,
            camera: CameraAges { frames: 100, youngest_nanos: -5, oldest_nanos: 1_500_000 },
            stack_bytes_max: 5_000,
            stack_bytes: 36_864,
        }),
        BoardMessage::Zeroed { angle_units: -1 << 33 },
        BoardMessage::Fault(BoardFault::Jogging),
        BoardMessage::Forecast(Ok(forecast)),
        BoardMessage::Forecast(Err(UnreachableRecord { tolerance_rad: 1e-5, least_rad: None, time_s: 0.1 })),
        BoardMessage::Forecast(Err(UnreachableRecord {
            tolerance_rad: 1e-5,
            least_rad: Some(0.17),
            time_s: 0.1,
        })),
    ]
    .into_iter()
    .chain(experiment_messages())
    .collect()
}

/// The same of experiments.
fn experiment_messages() -> [BoardMessage; 7] {
    [
        BoardMessage::ExperimentTaken { number: 300 },
        response(ShownRecord::Lost),
        response(ShownRecord::Sweep([[-25.0, 1e-6, 0.25]; 16].into_iter().collect())),
        response(ShownRecord::Cruise {
            windows: [[0.5, 1e-9, 0.05]; 8].into_iter().collect(),
            rate_rad_s: 16.0,
            coast_rad: 0.125,
            to_rest_s: 0.03,
        }),
        response(ShownRecord::Train {
            turned_rad: 1e-3,
            turned_rad2: 1e-10,
            independent: true,
            to_rest_s: 0.01,
        }),
        BoardMessage::Fault(BoardFault::NoExperiments),
        BoardMessage::Fault(BoardFault::NotInOrder),
    ]
}

/// The versions whose frames have a file, and the digest of that file, a CRC-64. A line here is never changed: a board
/// of that version speaks so. Other frames are another version, with a file and a line of its own.
const LANDED: [(u8, u64); 3] =
    [(11, 0x3615_77cd_ce3f_ae57), (12, 0x7e01_c39b_7b1d_da43), (13, 0x3550_c079_968d_874d)];

/// The frames of this version are those of its file, byte for byte. Where they have to change, [`VERSION`] goes up and
/// the new frames get a file of their own.
#[test]
fn exact_frames_are_those_of_the_version_s_file() {
    let path = std::format!("{}/fixtures/version_{VERSION}.txt", env!("CARGO_MANIFEST_DIR"));
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let mut short = [0; FRAME_BYTES_MAX];
    let record = CameraRecord { exposed_nanos: 5_000_000, angle_units: -5, marks_used: 2, residual: 12 };
    let length = encode_camera(Header { ticks: 520, ..HEADER }, record, &mut short).unwrap();
    let frames = host_messages()
        .into_iter()
        .map(|message| framed(HEADER, &message))
        .chain(board_messages().into_iter().map(|message| framed(HEADER, &message)))
        .chain([short[..length].to_vec()]);
    let mut text = String::new();
    for frame in frames {
        for byte in frame {
            write!(text, "{byte:02x}").unwrap();
        }
        text.push('\n');
    }
    assert!(text == kept, "{path}: other frames raise VERSION, and get a file of their own:\n{text}");
}

/// A file keeps the digest that it landed with. Files of earlier versions need not be kept.
#[test]
fn regress_the_file_of_a_version_stays_as_it_landed() {
    let newest = LANDED.map(|(version, _)| version).into_iter().max();
    assert_eq!(newest, Some(VERSION), "a version has a line in LANDED");
    for (version, landed) in LANDED {
        let path = std::format!("{}/fixtures/version_{version}.txt", env!("CARGO_MANIFEST_DIR"));
        if let Ok(file) = std::fs::read(path) {
            let digest = Crc::<u64>::new(&crc::CRC_64_XZ).checksum(&file);
            assert_eq!(
                digest, landed,
                "version {version} has {digest:#018x}: raise VERSION for other frames"
            );
        }
    }
}

/// Every single bit flip.
#[test]
fn law_no_flipped_bit_passes() {
    for message in host_messages() {
        let frame = framed(HEADER, &message);
        for bit in 0..8 * (frame.len() - 1) {
            let mut spoilt = frame.clone();
            spoilt[bit / 8] ^= 1 << (bit % 8);
            let mut deframer = Deframer::default();
            for byte in spoilt {
                if let Some(frame) = deframer.push(byte) {
                    assert!(decode::<HostMessage>(frame).is_err(), "bit {bit} of {message:?}");
                }
            }
        }
    }
}

#[test]
fn law_no_truncated_frame_passes_and_the_next_one_does() {
    for message in host_messages() {
        let frame = framed(HEADER, &message);
        for length in 0..frame.len() - 1 {
            let mut bytes = frame[..length].to_vec();
            bytes.push(0);
            bytes.extend_from_slice(&frame);
            let mut deframer = Deframer::default();
            let decoded: Vec<_> = bytes
                .iter()
                .filter_map(|&byte| deframer.push(byte).map(decode::<HostMessage>))
                .filter_map(Result::ok)
                .collect();
            assert_eq!(decoded, [(HEADER, message.clone())], "{length}");
        }
    }
}

/// A frame with something after its message, CRC and all, is no frame.
#[test]
fn exact_nothing_may_be_left_over() {
    let mut with_more = framed(HEADER, &(HostMessage::Stop, 0_u8));
    assert_eq!(decode::<HostMessage>(&mut with_more), Err(FrameError::Message));
    assert_eq!(decode::<HostMessage>(&mut framed(HEADER, &99_u8)), Err(FrameError::Message));
}

#[test]
fn exact_another_version_is_told_from_damage() {
    let mut content = [VERSION + 1; 32];
    let crc = CRC.checksum(&content[..28]);
    content[28..].copy_from_slice(&crc.to_le_bytes());
    let mut frame = [0; 40];
    let length = cobs::encode(&content, &mut frame);
    let decoded = decode::<HostMessage>(&mut frame[..length]);
    assert_eq!(decoded, Err(FrameError::Version { theirs: VERSION + 1 }));
    assert_eq!(std::format!("{}", decoded.unwrap_err()), "protocol version 14, expected 13");
}

/// A million frames, each damaged in one of five ways, on one line: none but whole ones are accepted.
#[test]
fn law_no_wrong_frame_among_a_million_mutated_ones() {
    let mut random = Pcg64::new(1, 2);
    let messages = host_messages();
    let mut deframer = Deframer::default();
    let (mut whole, mut refused) = (0, 0);
    for n in 0..1_000_000_u32 {
        let message = &messages[n as usize % messages.len()];
        let header = Header { sequence: n, ..HEADER };
        let mut bytes = framed(header, message);
        let mut draw = |below: usize| random.next_u64() as usize % below;
        let place = draw(bytes.len() - 1);
        match draw(5) {
            0 => bytes[place] ^= 1 << draw(8),
            1 => drop(bytes.drain(place..=place)),
            2 => bytes.insert(place, draw(256) as u8),
            3 => {
                let end = bytes.len() - 1;
                bytes[place..end].iter_mut().for_each(|byte| *byte = draw(256) as u8);
            }
            _ => bytes.swap(place, 0),
        }
        for byte in bytes {
            match deframer.push(byte).map(decode::<HostMessage>) {
                None => (),
                Some(Ok(decoded)) => {
                    assert_eq!(decoded, (header, message.clone()), "frame {n}");
                    // A zero inserted before it leaves a frame whole.
                    whole += 1;
                }
                Some(Err(_)) => refused += 1,
            }
        }
    }
    assert!(refused > 900_000 && whole > 1000, "{refused} {whole}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes that were never a frame.
    #[test]
    fn law_garbage_is_refused(mut bytes in prop::collection::vec(any::<u8>(), 0..FRAME_BYTES_MAX)) {
        prop_assert!(decode::<HostMessage>(&mut bytes.clone()).is_err());
        prop_assert!(decode::<BoardMessage>(&mut bytes).is_err());
    }

    /// Numbers of any bits, as many samples as there may be.
    #[test]
    fn law_any_measurements_come_back(
        samples in prop::collection::vec((any::<u64>(), any::<u32>()), 0..=16),
        session: u32, sequence: u32, ticks: u64
    ) {
        let record = |&(taken_nanos, bits): &(u64, u32)| LdvRecord {
            taken_nanos,
            velocity_m_s: f32::from_bits(bits),
        };
        let message = HostMessage::Ldv(samples.iter().map(record).collect());
        let header = Header { session, sequence, ticks };
        let frame = framed(header, &message);
        let (read, message) = decode::<HostMessage>(&mut frame.clone()).unwrap();
        prop_assert_eq!(read, header);
        // Compared as bytes: NaN is not itself.
        prop_assert_eq!(framed(read, &message), frame);
    }
}
