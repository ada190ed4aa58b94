//! The whole program on the emulated board, over its serial line; and what becomes of the drive when the program fails.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use controller::{LoopTiming, ResponseMap};
use estimator::{CameraDescription, Instruments};
use host_sim::board::pil::FreeRunningBoard;
use host_sim::board::telemetry::{LogDictionary, LogEntry, LogReader};
use link::{
    BoardFault, BoardMessage, Configuration, Counters, DescriptionDigest, DescriptionDigests,
    FRAME_BYTES_MAX, FilterKind, HostMessage, KeptDescription, MoveLimitsRecord, TargetRecord, VERSION,
    description_messages, encode,
};
use motor_model::{Angle, MotorParams};

const MOVE: Configuration = Configuration {
    filter: FilterKind::Twin,
    target_deg: 90.0,
    tolerance_deg: 0.02,
    deadline_nanos: 30_000_000_000,
    limits: MoveLimitsRecord { travel_deg: None, on_max_nanos: None, amplitude_max: None },
};

/// A board, and what it has said.
struct Board(FreeRunningBoard);

impl Board {
    fn start(log: Option<&Path>) -> Self {
        Self::start_slower(log, 0)
    }

    fn start_slower(log: Option<&Path>, halvings: u32) -> Self {
        let live = FreeRunningBoard::start_slower(Path::new(&crate::elf("board")), log, halvings);
        Self(live.expect("QEMU starts, tests/run.sh installs it"))
    }

    fn send(&mut self, bytes: &[u8]) {
        self.0.send_bytes(bytes).expect("the board listens");
    }

    /// The next thing said that is no report.
    fn hears(&mut self) -> BoardMessage {
        self.0.receive_answer().expect("the board answers")
    }

    #[track_caller]
    fn answers(&mut self, message: &HostMessage, expected: &BoardMessage) {
        self.0.send(message).expect("the board listens");
        assert_eq!(self.hears(), *expected, "to {message:?}");
    }

    fn counters(&mut self) -> Counters {
        self.0.counters().expect("counters")
    }

    fn arm(&mut self) {
        self.arm_with(MOVE.filter);
    }

    fn arm_with(&mut self, filter: FilterKind) {
        self.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
        let configuration = Configuration { filter, ..MOVE };
        self.answers(&HostMessage::Configure(configuration), &BoardMessage::Configured);
        self.answers(&HostMessage::Arm, &BoardMessage::Armed);
    }
}

/// L5: the host says nothing more; the board notices by its own clock, says so, and is not to be armed before a stop.
#[test]
fn tool_board_latches_off_when_the_host_falls_silent() {
    let mut board = Board::start(None);
    board.arm();
    let silent = BoardMessage::Fault(BoardFault::HostSilent);
    assert_eq!(board.hears(), silent);
    board.answers(&HostMessage::Arm, &silent);
    board.answers(&HostMessage::Stop, &BoardMessage::Stopped);
    board.answers(&HostMessage::Arm, &BoardMessage::Armed);
    // No tick was late in all that time.
    let counters = board.counters();
    assert_eq!((counters.overruns, counters.damaged, counters.lost), (0, 0, 0), "{counters:?}");
    // Interrupts nest on the same stack, of 35 KiB; building the twin's filter goes deepest here. The gauge looks at a
    // word a tick, and knows nothing before it has looked at all of them, 0.1 s after the start.
    let stack_bytes_max = (0..10_000).map(|_| board.counters().stack_bytes_max).find(|bytes| *bytes > 0);
    assert!(stack_bytes_max.is_some_and(|bytes| (4096..32 * 1024).contains(&bytes)), "{stack_bytes_max:?}");
}

/// A target that comes while a move is under way is taken, and one where the rotor is needs to know where that is. The
/// frames come in one block: the board's time does not wait for the host.
#[test]
fn tool_board_moves_on_to_another_target_while_armed() {
    let mut board = Board::start(None);
    board.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
    board.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
    let target = TargetRecord { target_deg: -30.0, tolerance_deg: 0.02 };
    let frames: Vec<u8> = [HostMessage::Arm, HostMessage::Retarget(target), HostMessage::Hold]
        .iter()
        .flat_map(|message| board.0.frame(message).expect("it fits"))
        .collect();
    board.send(&frames);
    assert_eq!(board.hears(), BoardMessage::Armed);
    let target_units = Angle::from_degrees(-30.0).units();
    assert_eq!(board.hears(), BoardMessage::Retargeted { target_units });
    assert_eq!(board.hears(), BoardMessage::Fault(BoardFault::NoEstimate));
}

/// The log tells of arming and of the fault, in the loop's ticks, and how long a tick takes.
#[test]
fn tool_board_logs_its_fault_and_its_timing() {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let mut board = Board::start(Some(log.path()));
    board.arm();
    assert_eq!(board.hears(), BoardMessage::Fault(BoardFault::HostSilent));
    // Long enough for an account of the time: every tenth of a second.
    for _ in 0..3 {
        board.answers(&HostMessage::Stop, &BoardMessage::Stopped);
        board.answers(&HostMessage::Arm, &BoardMessage::Armed);
        assert_eq!(board.hears(), BoardMessage::Fault(BoardFault::HostSilent));
    }
    let dictionary = LogDictionary::read(Path::new(&crate::elf("board"))).expect("a program that logs");
    let mut reader = LogReader::open(&dictionary, log.path()).expect("a log");
    let mut entries = Vec::new();
    while !entries.iter().any(|entry: &LogEntry| entry.kind() == "timing") {
        entries.extend(reader.entries().expect("a log that its ELF explains"));
    }
    let at = |text: &str| entries.iter().find(|entry| entry.text.starts_with(text)).map(|entry| entry.tick);
    let armed = at("state armed").expect("it was armed");
    let silent = at("fault host_silent").expect("the host was silent");
    // A thousand ticks after the last frame, which was the one that armed; either is told a few ticks late.
    assert!((980..=1020).contains(&(silent - armed)), "{armed} {silent}: {:?}", texts(&entries));
    let timing = entries.iter().find(|entry| entry.kind() == "timing").expect("waited for");
    let clocks: u32 = timing.field("clocks_max").expect("a number");
    // Of 250 in a tick of 10 us, at 40 instructions a clock.
    assert!((3..250).contains(&clocks), "{timing:?}");
    assert_eq!((timing.field("overruns"), timing.field("damaged")), (Some(0), Some(0)), "{timing:?}");
}

/// Ticks and texts of the first entries.
fn texts(entries: &[LogEntry]) -> Vec<(u64, &str)> {
    entries.iter().take(20).map(|entry| (entry.tick, entry.text.as_str())).collect()
}

/// L1, L2: 30 kB of noise without pause; the loop goes on in time, and the next frame is understood.
#[test]
fn tool_board_survives_a_flood_in_time() {
    let mut board = Board::start(None);
    board.arm();
    let noise: Vec<u8> = (0..30_000_u32).map(|n| (n * n / 7 % 251) as u8).collect();
    board.send(&noise);
    board.send(&[0]);
    assert_eq!(board.hears(), BoardMessage::Fault(BoardFault::HostSilent), "noise is no word of the host");
    board.answers(&HostMessage::Stop, &BoardMessage::Stopped);
    let counters = board.counters();
    assert!(counters.damaged > 50, "{counters:?}");
    assert_eq!(counters.overruns, 0, "{counters:?}");
}

/// In the board's time no direction of the emulated line is faster than that of a real one, 2 bytes a tick: the host
/// asks a question again and again, whose answer is longer than it is. Some answers find no room.
#[test]
fn law_the_emulated_line_is_no_faster_than_a_real_one() {
    const QUESTIONS: usize = 1000;
    const ANSWERS: usize = 60;
    // Of an answer it is known when it was made, and not when it was sent.
    const WAITING_BYTES: u64 = 2 * FRAME_BYTES_MAX as u64;
    let mut board = Board::start(None);
    board.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
    board.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
    let questions = [(); QUESTIONS].map(|()| board.0.frame(&HostMessage::Learnt).expect("it fits"));
    board.send(&questions.concat());
    let answers = [(); ANSWERS].map(|()| board.0.receive().expect("the board answers"));
    let [(first, _), after @ .., (last, _)] = &answers;
    let ticks = last.ticks - first.ticks;
    let asked = (last.sequence - first.sequence) as usize;
    let to_board: usize = questions[1..=asked].iter().map(Vec::len).sum();
    let from_board = after.iter().map(|(header, answer)| {
        assert!(matches!(answer, BoardMessage::Learnt(_)), "{answer:?}");
        encode(*header, answer, &mut [0; FRAME_BYTES_MAX]).expect("it fits")
    });
    for (bytes, way) in [(to_board, "to the board"), (from_board.sum(), "from the board")] {
        assert!(bytes as u64 <= 2 * ticks + WAITING_BYTES, "{way}: {bytes} bytes in {ticks} ticks");
    }
}

/// A filter is built when it is configured, in double precision, beside the interrupts: that takes a slow processor
/// long, but is no hang.
#[test]
fn tool_board_builds_any_filter_before_the_watchdog_loses_patience() {
    for filter in [FilterKind::ConstantRate, FilterKind::ImpactAided, FilterKind::Twin] {
        Board::start_slower(None, 2).arm_with(filter);
    }
}

/// What a move will take is computed between two feeds of the watchdog: the least tolerance of slow and coarse frames,
/// which are searched, and the longest way there is.
#[test]
fn tool_board_forecasts_any_move_before_the_watchdog_loses_patience() {
    let mut board = Board::start_slower(None, 2);
    board.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
    let camera =
        CameraDescription { period_nanos: 100_000_000, noise_m: 20e-6, ..CameraDescription::default() };
    let slow = HostMessage::Instruments(Instruments { camera, vibrometer: None });
    board.answers(&slow, &BoardMessage::Described);
    for target_deg in [-360_000.0, 360_000.0, -0.5] {
        for tolerance_deg in [1e-3, 1.0] {
            let question = Configuration { target_deg, tolerance_deg, ..MOVE };
            board.0.send(&HostMessage::Forecast(question)).expect("the board listens");
            let answer = board.hears();
            assert!(matches!(answer, BoardMessage::Forecast(_)), "{target_deg} {tolerance_deg}: {answer:?}");
        }
    }
    // It knows its session: it has not started anew.
    board.counters();
}

/// The largest map is kept and restored between two feeds of the watchdog, which waits longer for that.
#[test]
fn tool_board_keeps_and_restores_before_the_watchdog_loses_patience() {
    let mut board = Board::start_slower(None, 2);
    let welcome = BoardMessage::Welcome { tick_nanos: 10_000 };
    board.answers(&HostMessage::Hello, &welcome);
    let nominal = MotorParams::nominal();
    let description = || {
        description_messages(
            &nominal,
            Instruments::default(),
            LoopTiming { latency_ticks: 3, decision_ticks: 2 },
            Some(ResponseMap::table_1()),
        )
    };
    for message in description() {
        board.answers(&message, &BoardMessage::Described);
    }
    board.answers(&HostMessage::Keep, &BoardMessage::Kept);
    let digest = DescriptionDigest::of(description()).expect("each message fits");
    let restored = BoardMessage::Digests(DescriptionDigests {
        in_force: digest,
        kept: KeptDescription::Whole { digest },
    });
    board.answers(&HostMessage::Digest, &restored);
    // It knows its session: it has not started anew.
    board.counters();
    board.answers(&HostMessage::DescriptionBegin, &BoardMessage::Described);
    board.answers(&HostMessage::Hello, &welcome);
    board.answers(&HostMessage::Digest, &restored);
    board.answers(&HostMessage::Forget, &BoardMessage::Forgotten);
    assert!(board.counters().taken > 20, "since its first start");
}

/// Questions for the counters cost an armed board no deadline: the stack is looked at a few words a tick. A look at all
/// of its ten thousand words at once takes five ticks of this processor.
#[test]
fn tool_board_counts_in_time_while_armed() {
    let mut board = Board::start(None);
    board.arm();
    let counters: Vec<Counters> = (0..20).map(|_| board.counters()).collect();
    let armed = BoardMessage::Fault(BoardFault::Armed);
    board.answers(&HostMessage::Configure(MOVE), &armed);
    assert!(counters.iter().all(|counters| counters.overruns == 0), "{counters:?}");
}

/// L1: a stop with a flipped bit, wherever it strikes, is no stop, although session and sequence are right.
#[test]
fn tool_board_obeys_no_damaged_frame() {
    let mut board = Board::start(None);
    board.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
    let before = board.counters();
    let whole = board.0.frame(&HostMessage::Stop).expect("it fits");
    let bits = 8 * (whole.len() - 1);
    let mut zeros = 0;
    for bit in 0..bits {
        let mut spoilt = whole.clone();
        spoilt[bit / 8] ^= 1 << (bit % 8);
        zeros += u32::from(spoilt[bit / 8] == 0);
        board.send(&spoilt);
    }
    let after = board.counters();
    // A bit that makes a zero cuts the frame in two, both damaged, or at its beginning takes nothing but an empty one
    // from it.
    let damaged = u32::try_from(bits).expect("small");
    assert!((damaged..=damaged + zeros).contains(&(after.damaged - before.damaged)), "{after:?}");
    assert_eq!(
        (after.taken, after.lost),
        (before.taken + 1, before.lost + 1),
        "only the question: {after:?}"
    );
}

/// L6: a board that has started anew, as the watchdog makes it, knows neither the session nor the configuration, and
/// says so.
#[test]
fn tool_board_that_starts_anew_knows_no_session() {
    let mut board = Board::start(None);
    for message in [HostMessage::Count, HostMessage::Step, HostMessage::Arm] {
        let unknown = BoardFault::UnknownSession { session: FreeRunningBoard::SESSION };
        board.answers(&message, &BoardMessage::Fault(unknown));
    }
    board.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
    board.answers(&HostMessage::Arm, &BoardMessage::Fault(BoardFault::NotReady));
    board.arm();
}

/// L4: both versions in one line.
#[test]
fn tool_board_names_both_versions() {
    let mut board = Board::start(None);
    let mut content = vec![VERSION + 7; 20];
    content.extend(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content).to_le_bytes());
    let mut frame = cobs::encode_vec(&content);
    frame.push(0);
    board.send(&frame);
    assert_eq!(
        board.hears(),
        BoardMessage::Fault(BoardFault::Version { theirs: VERSION + 7, ours: VERSION })
    );
}

/// What the program `faults` says when told `word`, and whether it ends well.
fn fault(word: &str) -> (String, bool) {
    let mut child = Command::new("timeout")
        .arg(crate::RUN_LIMIT_S)
        .arg(crate::repository().join("firmware/qemu.sh"))
        .arg(crate::elf("faults"))
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("timeout (coreutils) starts");
    child.stdin.take().expect("a pipe").write_all(word.as_bytes()).expect("it listens");
    let output = child.wait_with_output().expect("it ends");
    (String::from_utf8_lossy(&output.stderr).into_owned(), output.status.success())
}

/// L7: the register, read after the handler's first store, says off, and the emulator's exit code says failure. The
/// instruction of a fault is in the flash; where the frame of an overflow would be there is no memory.
#[test]
fn tool_panics_and_faults_switch_the_drive_off_first() {
    for (word, reason) in [
        ("panic", "drive off; panicked at "),
        ("undefined", "drive off; HardFault at 0x"),
        ("overflow", "drive off; HardFault at 0x0\n"),
    ] {
        let (said, well) = fault(word);
        assert!(said.starts_with("start, drive off\ndrive on\n"), "{word}: {said}");
        assert!(said.contains(reason) && !well, "{word}: {said}");
        let at = said.split_once("HardFault at 0x").map_or("1", |(_, at)| at.trim_end());
        let at = u32::from_str_radix(at, 16).expect("an address");
        assert!((word == "overflow") == (at == 0) && at < 1 << 20, "{word}: {said}");
    }
}

/// What a fault's handler keeps is told after the restart: the instruction that is none, in the
/// flash; a return address in an odd function of it; and the registers' bits for an undefined instruction (16 of CFSR)
/// that became a hard fault (30 of HFSR). An overflow leaves no frame to read. A panic's handler keeps what it said.
#[test]
fn tool_a_crash_is_kept_over_a_restart() {
    const HEAD: &str = "start, drive off\ndrive on\nstart, drive off\nkept ";
    let kept = |word: &str| {
        let (said, well) = fault(&format!("alone {word}"));
        assert!(well, "{word}: {said}");
        said.strip_prefix(HEAD).unwrap_or_else(|| panic!("{word}: {said}")).trim_end().to_owned()
    };
    let register = |record: &str, name: &str| -> u32 {
        let after = record.split_once(&format!("{name}: ")).unwrap_or_else(|| panic!("{name}: {record}")).1;
        after.split([',', ' ']).next().and_then(|number| number.parse().ok()).expect("a number")
    };
    let record = kept("undefined");
    assert!(record.starts_with("Fault FaultRegisters {"), "{record}");
    let [pc, lr, cfsr, hfsr] = ["pc", "lr", "cfsr", "hfsr"].map(|name| register(&record, name));
    assert!((1..1 << 20).contains(&pc) && (1..1 << 20).contains(&lr) && lr % 2 == 1, "{record}");
    assert_eq!((cfsr, hfsr), (1 << 16, 1 << 30), "{record}");
    let record = kept("overflow");
    assert!(record.starts_with("Fault ") && register(&record, "hfsr") == 1 << 30, "{record}");
    assert_eq!((register(&record, "pc"), register(&record, "lr")), (0, 0), "{record}");
    let record = kept("panic");
    assert!(record.starts_with("Panic ") && record.ends_with("as requested"), "{record}");
}

/// A program that hangs with the drive on is started anew with the drive off.
#[test]
fn tool_a_hanging_program_is_started_anew_with_the_drive_off() {
    let (said, _) = fault("hang");
    assert!(said.starts_with("start, drive off\ndrive on\nstart, drive off\n"), "{said}");
}

/// The gauge sees at least the 21 frames of 64 bytes that were put on the stack, and no more than the stack has.
#[test]
fn tool_the_stack_gauge_sees_the_deepest_call() {
    let (said, well) = fault("stack");
    let line = said.lines().find_map(|line| line.strip_prefix("stack ")).expect("two depths");
    let depths: Vec<u32> = line.split(' ').map(|depth| depth.parse().expect("a number")).collect();
    assert!(well && depths[1] >= depths[0] + 21 * 64 && depths[1] < 35 * 1024, "{said}");
}
