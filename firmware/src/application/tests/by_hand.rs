//! The drive by hand, and the look at the board itself.

use link::{CameraAges, Jog, JogReport, MotorParameterRecord, SelfTestReport, VelocitySums};
use motor_model::Parameter;

use super::rate::RATE;
use super::*;

const TICKS: u32 = 50;

fn half(mode: DriveMode) -> DriveCommand {
    DriveCommand::try_new(mode, 0.5).unwrap()
}

/// A jog for `ticks`.
fn jog(command: DriveCommand, ticks: u32) -> HostMessage {
    let duration_nanos = u64::from(ticks) * PositionLoop::TICK_NANOS;
    HostMessage::Jog(Jog { command: command.into(), duration_nanos })
}

/// A board that is jogged in mode B for a second, at its first tick.
fn jogged() -> Bench {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&jog(half(DriveMode::B), 100_000)), [BoardMessage::Jogging]);
    assert!(bench.off(), "from the next tick on");
    assert_eq!(bench.board.tick(), None);
    assert_eq!(bench.driven(), half(DriveMode::B));
    bench
}

/// Either mode is on for as many ticks as were asked for, and then off; the board tells what it applied. It is neither
/// armed nor latched, and takes the next.
#[test]
fn exact_a_jog_lasts_for_its_duration() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    for mode in [DriveMode::B, DriveMode::C] {
        assert_eq!(bench.exchange(&jog(half(mode), TICKS)), [BoardMessage::Jogging]);
        for tick in 1..=TICKS {
            assert_eq!((bench.board.tick(), bench.board.take_news()), (None, None), "{tick}");
            assert_eq!(bench.driven(), half(mode), "{tick}");
        }
        bench.board.tick();
        assert!(bench.off() && !bench.board.is_driving());
        let applied = half(mode).into();
        let report = JogReport { ticks: TICKS, applied, velocity: VelocitySums::default() };
        assert_eq!(bench.board.take_news(), Some(BoardMessage::Jogged(report)));
        assert_eq!(bench.board.take_news(), None, "told once");
        assert_eq!(bench.exchange(&HostMessage::Step), fault(BoardFault::NotReady));
    }
}

/// A stop and a new session end it at once. Nothing else is told of it.
#[test]
fn law_a_stop_and_a_new_session_end_a_jog() {
    let welcome = BoardMessage::Welcome { tick_nanos: PositionLoop::TICK_NANOS };
    for (message, answer) in [(HostMessage::Stop, BoardMessage::Stopped), (HostMessage::Hello, welcome)] {
        let mut bench = jogged();
        bench.session += u32::from(message == HostMessage::Hello);
        assert_eq!(bench.exchange(&message), [answer]);
        assert!(bench.off() && !bench.board.is_driving());
        for _ in 0..100_001 {
            bench.board.tick();
            assert!(bench.off());
        }
        assert_eq!(bench.board.take_news(), None);
    }
}

/// What ends a jog.
type End<'a> = &'a dyn Fn(&mut Bench);

/// A silent host, missed deadlines and a failed amplifier end it, and latch until a stop.
#[test]
fn law_what_latches_an_armed_board_latches_a_jogged_one() {
    let silent = |bench: &mut Bench| {
        for tick in 2..=SILENT_TICKS {
            bench.board.tick();
            assert!(!bench.off(), "{tick}");
        }
        bench.board.tick();
    };
    let late = |bench: &mut Bench| (0..OVERRUNS_MAX).for_each(|_| bench.board.record_deadline(false));
    let failed = |bench: &mut Bench| bench.board.stop_for_amplifier();
    let ends: [(BoardFault, End<'_>); 3] = [
        (BoardFault::HostSilent, &silent),
        (BoardFault::Overrun, &late),
        (BoardFault::AmplifierFailed, &failed),
    ];
    for (why, end) in ends {
        let mut bench = jogged();
        end(&mut bench);
        assert!(bench.off() && !bench.board.is_driving(), "{why:?}");
        assert_eq!(bench.board.take_news(), Some(BoardMessage::Fault(why.clone())));
        bench.board.tick();
        assert!(bench.off() && bench.board.take_news().is_none(), "{why:?}");
        let again = jog(half(DriveMode::C), TICKS);
        assert_eq!(bench.exchange(&again), fault(why));
        bench.board.tick();
        assert!(bench.off());
        assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
        assert_eq!(bench.exchange(&again), [BoardMessage::Jogging]);
        bench.board.tick();
        assert_eq!(bench.driven(), half(DriveMode::C));
    }
}

/// Another jog takes the place of the one under way, with its own duration: repeated, it keeps the drive on.
#[test]
fn law_another_jog_replaces_the_one_under_way() {
    let mut bench = jogged();
    for _ in 0..10 {
        assert_eq!(bench.exchange(&jog(half(DriveMode::C), TICKS)), [BoardMessage::Jogging]);
        for _ in 0..TICKS {
            bench.board.tick();
            assert_eq!(bench.driven(), half(DriveMode::C));
        }
    }
    bench.board.tick();
    assert!(bench.off());
    assert!(matches!(bench.board.take_news(), Some(BoardMessage::Jogged(JogReport { ticks: TICKS, .. }))));
    assert_eq!(bench.board.take_news(), None, "the last one alone");
}

/// An armed board refuses it, and its loop drives on.
#[test]
fn law_an_armed_board_is_not_jogged() {
    let mut bench = Bench::driving();
    let before = bench.driven();
    for message in [jog(half(DriveMode::C), TICKS), HostMessage::SelfTest] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::Armed));
        bench.measure();
        assert!(bench.step().is_some() && bench.driven() == before);
    }
}

/// What is out of bounds is refused by name, at rest and during a jog, which goes on.
#[test]
fn law_a_jog_out_of_bounds_is_refused_by_name() {
    let off = Jog { command: DriveCommand::OFF.into(), duration_nanos: 10_000 };
    let too_long = Jog { command: half(DriveMode::B).into(), duration_nanos: 1_000_000_001 };
    for (asked, key) in [(off, "jog.mode"), (too_long, "jog.duration_s")] {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        let mut bench = Bench::new();
        bench.exchange(&HostMessage::Hello);
        assert_eq!(bench.exchange(&HostMessage::Jog(asked)), refused);
        bench.board.tick();
        assert!(bench.off() && !bench.board.is_driving());
        let mut bench = jogged();
        assert_eq!(bench.exchange(&HostMessage::Jog(asked)), refused);
        bench.board.tick();
        assert_eq!(bench.driven(), half(DriveMode::B));
    }
}

/// What takes longer than a tick, or would drive, waits for the end of a jog.
#[test]
fn law_a_jogged_board_is_not_configured_armed_or_tested() {
    let mut bench = jogged();
    for message in [
        HostMessage::Configure(MOVE),
        HostMessage::ConfigureRate(RATE),
        HostMessage::Instruments(estimator::Instruments::default()),
        HostMessage::MapBegin,
        HostMessage::Forecast(MOVE),
        HostMessage::Arm,
        HostMessage::Hold,
        HostMessage::SelfTest,
        HostMessage::Zero { angle_units: None },
        HostMessage::Zero { angle_units: Some(0) },
    ] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::Jogging), "{message:?}");
        bench.board.tick();
        assert_eq!(bench.driven(), half(DriveMode::B));
    }
}

/// The amplifier drives the motor that was described, without the latency of a loop, and what was configured is
/// forgotten: it was for what the amplifier followed before.
#[test]
fn law_a_jog_is_of_the_motor_described_and_forgets_the_configuration() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::Timing { latency_ticks: 7, decision_ticks: 1 });
    bench.exchange(&HostMessage::Configure(MOVE));
    let index = Parameter::ALL.iter().position(|other| *other == Parameter::ModeBFrequency).unwrap();
    let frequency = MotorParameterRecord { index: index as u8, value: 6400.0 };
    assert_eq!(bench.exchange(&HostMessage::MotorParameter(frequency)), [BoardMessage::Described]);
    assert_eq!(bench.board.amplifier().timing.latency_ticks, 7);
    bench.exchange(&jog(half(DriveMode::B), TICKS));
    let amplifier = bench.board.amplifier();
    assert_eq!(
        (amplifier.design.get(Parameter::ModeBFrequency), amplifier.timing.latency_ticks),
        (6400.0, 0)
    );
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
}

/// Sends two samples that differ by 2 mm/s about `mean_m_s`.
fn samples(bench: &mut Bench, mean_m_s: f32) {
    let sample = |velocity_m_s| LdvRecord { taken_nanos: 1, velocity_m_s };
    bench.exchange(&HostMessage::Ldv(
        [sample(mean_m_s + 1e-3), sample(mean_m_s - 1e-3)].into_iter().collect(),
    ));
}

/// The vibrometer's samples of the jog, and of no time before it, are in its report.
#[test]
fn exact_a_jog_tells_what_the_vibrometer_saw() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    samples(&mut bench, 5.0);
    bench.exchange(&jog(half(DriveMode::B), TICKS));
    for _ in 0..=TICKS {
        samples(&mut bench, 0.25);
        bench.board.tick();
    }
    let Some(BoardMessage::Jogged(JogReport { velocity, .. })) = bench.board.take_news() else {
        panic!("a report")
    };
    assert_eq!((velocity.samples, velocity.largest_m_s), (2 * TICKS, 0.251));
    // Sums of numbers as these have a few millionths of rounding.
    let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-6;
    assert!(near(velocity.mean_m_s(), 0.25) && near(velocity.sd_m_s(), 1e-3), "{velocity:?}");
}

/// Runs the ticks of a self-test with a frame of 30 us of age in every tenth, and a late tick; its report.
fn tested(bench: &mut Bench) -> SelfTestReport {
    for tick in 1..=SelfTestReport::TICKS {
        samples(bench, -0.1);
        if tick.is_multiple_of(10) {
            let exposed_nanos = (bench.board.elapsed_ticks - 2) * PositionLoop::TICK_NANOS;
            let frame = CameraRecord { exposed_nanos, angle_units: 7, marks_used: 0, residual: 0 };
            bench.exchange(&HostMessage::Camera(frame));
        }
        assert_eq!((bench.board.tick(), bench.board.take_news()), (None, None), "{tick}");
        assert!(bench.off());
        bench.board.record_deadline(tick != 5000);
    }
    bench.board.tick();
    match bench.board.take_news() {
        Some(BoardMessage::SelfTest(report)) => report,
        other => panic!("{other:?}"),
    }
}

/// After its time the board tells what it has seen, with the drive off throughout.
#[test]
fn exact_a_self_test_tells_what_the_board_has_seen() {
    let mut bench = Bench::new();
    bench.board.record_stack(4_000);
    bench.board.record_stack_size(8_000);
    bench.exchange(&HostMessage::Hello);
    samples(&mut bench, 5.0);
    assert!(bench.exchange(&HostMessage::SelfTest).is_empty());
    let report = tested(&mut bench);
    let ticks = SelfTestReport::TICKS as u32;
    let camera = CameraAges { frames: ticks / 10, youngest_nanos: 30_000, oldest_nanos: 30_000 };
    let expected = SelfTestReport {
        amplifier_works: true,
        has_converter: false,
        ticks,
        late_ticks: 1,
        velocity: report.velocity,
        camera,
        stack_bytes_max: 4_000,
        stack_bytes: 8_000,
    };
    assert_eq!((report, report.velocity.samples), (expected, 2 * ticks));
    assert!((report.velocity.mean_m_s().unwrap() + 0.1).abs() < 1e-5, "{report:?}");
    assert_eq!(bench.board.counters().overruns, 0, "the drive was off");
    bench.board.record_converter(true);
    bench.board.amplifier_mut().broken = true;
    bench.exchange(&HostMessage::SelfTest);
    let report = tested(&mut bench);
    assert!(report.has_converter && !report.amplifier_works);
}

/// A latched board tells of itself as well, and stays latched. A stop, a jog and arming end a test without an answer.
#[test]
fn law_a_self_test_clears_nothing_and_gives_way() {
    let mut bench = Bench::driving();
    bench.board.stop_for_amplifier();
    assert!(matches!(bench.board.take_news(), Some(BoardMessage::Fault(_))));
    assert!(bench.exchange(&HostMessage::SelfTest).is_empty());
    tested(&mut bench);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::AmplifierFailed));
    bench.exchange(&HostMessage::Stop);
    for message in [HostMessage::Stop, HostMessage::Arm, jog(half(DriveMode::B), TICKS)] {
        bench.exchange(&HostMessage::Stop);
        bench.exchange(&HostMessage::Configure(MOVE));
        bench.exchange(&HostMessage::SelfTest);
        bench.board.tick();
        let answers = bench.exchange(&message);
        assert!(!matches!(answers[..], [BoardMessage::Fault(_)]) && answers.len() == 1, "{answers:?}");
        for _ in 0..=SelfTestReport::TICKS {
            bench.exchange(&HostMessage::Count);
            bench.board.tick();
            assert!(!matches!(bench.board.take_news(), Some(BoardMessage::SelfTest(_))), "{message:?}");
        }
    }
}
