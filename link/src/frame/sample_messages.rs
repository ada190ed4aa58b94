//! Messages of every kind, with numbers of every length.

extern crate std;

use std::vec::Vec;

use controller::rate::RateStop;
use estimator::{CameraDescription, Health, Instruments, Source, Verdict};
use motor_model::DriveMode;

use crate::{
    BoardFault, BoardIdentity, BoardMessage, CameraAges, CameraRecord, Coded, CommandRecord, Configuration,
    Counters, DescriptionDigests, EstimateRecord, ExperimentDrive, ExperimentRecord,
    ExperimentsConfiguration, FilterKind, ForecastRecord, HostMessage, InnovationRecord, Jog, JogReport,
    KeptDescription, LdvRecord, LdvRecords, LearntRecord, MotorParameterRecord, MoveLimitsRecord,
    PhaseRecord, RateConfiguration, RateLimitsRecord, RatePhase, RateRecord, ResetCause, ResponseRecord,
    SelfTestReport, ShownRecord, TargetRecord, TickRecord, UnreachableRecord, VelocitySums, map_messages,
};

fn ldv(samples: usize) -> HostMessage {
    let sample = |n| LdvRecord { taken_nanos: u64::MAX - n, velocity_m_s: -0.1 };
    HostMessage::Ldv((0..samples as u64).map(sample).collect::<LdvRecords>())
}

const MOVE: Configuration = Configuration {
    filter: FilterKind::ImpactAided,
    target_deg: -90.0,
    tolerance_deg: 0.02,
    deadline_nanos: 30_000_000_000,
    limits: MoveLimitsRecord { travel_deg: None, on_max_nanos: None, amplitude_max: None },
};

const MOVE_LIMITS: MoveLimitsRecord = MoveLimitsRecord {
    travel_deg: Some((-270.0, 45.5)),
    on_max_nanos: Some(2_000_000_000),
    amplitude_max: Some(0.625),
};

const RATE: RateConfiguration = RateConfiguration {
    filter: FilterKind::Twin,
    rate_deg_s: -160.0,
    duration_nanos: 20_000_000_000,
    limits: RateLimitsRecord {
        travel_deg: None,
        on_max_nanos: None,
        amplitude_max: None,
        progress_window_nanos: None,
    },
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

const RATE_LIMITS: RateLimitsRecord = RateLimitsRecord {
    travel_deg: Some((-90.0, 180.0)),
    on_max_nanos: Some(10_000_000_000),
    amplitude_max: Some(0.75),
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
        HostMessage::Configure(Configuration { limits: MOVE_LIMITS, ..MOVE }),
        HostMessage::Forecast(MOVE),
        HostMessage::ConfigureRate(RATE),
        HostMessage::ConfigureRate(RateConfiguration { limits: RATE_LIMITS, ..RATE }),
        HostMessage::Retarget(TargetRecord { target_deg: 12.5, tolerance_deg: 0.01 }),
        HostMessage::Hold,
        HostMessage::Timing { latency_ticks: 12, decision_ticks: 4 },
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
            travel_deg: None,
            amplitude_max: None,
        }),
        HostMessage::ConfigureExperiments(ExperimentsConfiguration {
            filter: FilterKind::Twin,
            time_max_nanos: 50_000_000_000,
            travel_deg: Some((-36_000.0, 1e5)),
            amplitude_max: Some(1.0),
        }),
        experiment(ExperimentDrive::Sweep),
        experiment(ExperimentDrive::Cruise),
        experiment(ExperimentDrive::Train { ticks: 300, count: 8 }),
        HostMessage::Response,
        HostMessage::MapLearnt(LEARNT),
        HostMessage::Learnt,
        HostMessage::ReportPeriod { ticks: 0 },
        HostMessage::ReportPeriod { ticks: 2_000 },
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

fn digests(kept: KeptDescription) -> BoardMessage {
    BoardMessage::Digests(DescriptionDigests { in_force: 0xfedc_ba98_7654_3210, kept })
}

/// Messages of the board, one of each kind.
pub(super) fn board_messages() -> Vec<BoardMessage> {
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
        BoardMessage::ReportPeriod { ticks: 10_000 },
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
fn experiment_messages() -> [BoardMessage; 8] {
    [
        BoardMessage::ExperimentTaken { number: 300 },
        response(ShownRecord::Lost),
        response(ShownRecord::Unmoved([-1e-6, 1e-9, 0.25])),
        response(ShownRecord::Sweep([[-25.0, 1e-6, 0.25]; 16].into_iter().collect())),
        response(ShownRecord::Cruise {
            windows: [[0.5, 1e-9, 0.05]; 8].into_iter().collect(),
            coast: [16.0, 1e-3, 0.125, 1e-8, -1e-6],
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
