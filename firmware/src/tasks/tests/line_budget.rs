//! What a move at full speed, and a rate, bring to the line, either way: messages of every kind, each as long as it can
//! be.

use std::vec;

use link::{BoardIdentity, Configuration, Counters, LdvRecords, ResetCause, encode_camera};

use super::*;

/// Bits a second that either direction may carry, 70 % of the line: a repeated frame or a step of the host finds room.
const BITS_PER_S_MAX: u64 = LINE_BAUD as u64 / 10 * 7;

/// Bits of a byte on the line, start and stop included.
const BITS_PER_BYTE: u64 = 10;

/// Ticks between two frames of a camera of 10 kHz.
const TICKS_PER_FRAME: u64 = 10;

/// Ticks between two messages by which `host-sim run` says that it is there. It sends none where there are frames.
const TICKS_PER_KEEP_ALIVE: u64 = 400;

/// Ticks between two of its questions for the time, after the first ones, which follow each other.
const TICKS_PER_QUESTION: u64 = 10_000;
const FIRST_QUESTIONS: u64 = 16;

/// Ticks over which a load is a mean: the time in which all that is periodic comes once.
const WINDOW_TICKS: usize = TICKS_PER_QUESTION as usize;

/// The most bytes of a window.
const WINDOW_BYTES_MAX: u64 =
    BITS_PER_S_MAX * WINDOW_TICKS as u64 * PositionLoop::TICK_NANOS / 1_000_000_000 / BITS_PER_BYTE;

/// A header whose numbers have as many bytes as they can have.
const LONGEST: Header = Header { session: u32::MAX, sequence: u32::MAX, ticks: u64::MAX };

/// Bytes of a message of the board on the line.
fn length(message: &BoardMessage) -> u64 {
    encode(LONGEST, message, &mut [0; FRAME_BYTES_MAX]).unwrap() as u64
}

/// Bytes of the longest report in a year after the start.
fn longest_report(phase: PhaseRecord, rate: Option<RateRecord>) -> u64 {
    let longest = f32::MAX;
    let command =
        CommandRecord { mode: Some(DriveMode::C).into(), amplitude: longest, frequency_offset_hz: longest };
    // A byte of postcard's carries seven bits.
    let nanos = 1 << 55;
    let estimate = EstimateRecord {
        at_nanos: nanos,
        angle_units: i64::MAX,
        rate_rad_s: longest,
        angle_rad2: longest,
        angle_rate_rad2_s: longest,
        rate_rad2_s2: longest,
        resting: true,
    };
    let innovation = InnovationRecord {
        source: Source::Camera.into(),
        taken_nanos: nanos,
        innovation_rad: longest,
        variance_rad2: longest,
        verdict: Verdict::Used.into(),
    };
    length(&BoardMessage::Report(TickRecord {
        estimate: Some(estimate),
        health: Health::Good.into(),
        camera: Some(innovation),
        command,
        applied: command,
        phase: phase.into(),
        since_nanos: nanos,
        rate,
    }))
}

/// Bytes of the longest message of the kind of `message` in a move.
fn longest(message: &BoardMessage) -> u64 {
    match message {
        BoardMessage::Report(_) => longest_report(PhaseRecord::Burst, None),
        BoardMessage::Counters(_) => {
            let most = u32::MAX;
            length(&BoardMessage::Counters(Counters {
                taken: most,
                damaged: most,
                oversize: most,
                other_version: most,
                other_session: most,
                duplicates: most,
                late: most,
                lost: most,
                dropped: most,
                overruns: most,
                stack_bytes_max: most,
            }))
        }
        BoardMessage::Identity(BoardIdentity { reset_cause, .. }) => {
            length(&BoardMessage::Identity(BoardIdentity {
                loop_digest: u64::MAX,
                reset_cause: *reset_cause,
            }))
        }
        other => length(other),
    }
}

/// The host of a move: what it sends with each tick.
struct FullSpeed {
    bench: Bench,
    questions: u64,
    /// Bytes of each tick, to the board and from it.
    bytes: [Vec<u64>; 2],
    /// Messages of the board.
    said: Vec<BoardMessage>,
}

impl FullSpeed {
    /// One tick of a rotor at rest, by a dithered camera.
    fn tick(&mut self, tick: u64) {
        let mut sent = Vec::new();
        if tick.is_multiple_of(TICKS_PER_FRAME) {
            let exposed_nanos = tick * PositionLoop::TICK_NANOS;
            let angle_units = 350_546 * i32::from(tick.is_multiple_of(2 * TICKS_PER_FRAME));
            let record = CameraRecord { exposed_nanos, angle_units, marks_used: 0, residual: 0 };
            let mut frame = [0; FRAME_BYTES_MAX];
            let length = encode_camera(self.header(tick), record, &mut frame).unwrap();
            assert_eq!(length, SHORT_FRAME_BYTES);
            sent.push(frame[..length].to_vec());
        }
        if tick.is_multiple_of(TICKS_PER_KEEP_ALIVE) {
            sent.push(framed(self.header(tick), &HostMessage::Ldv(LdvRecords::new())));
        }
        if self.questions < FIRST_QUESTIONS || tick.is_multiple_of(TICKS_PER_QUESTION) {
            let questions = [HostMessage::Arm, HostMessage::Count, HostMessage::Identify];
            let question = &questions[self.questions as usize % questions.len()];
            self.questions += 1;
            sent.push(framed(self.header(tick), question));
        }
        let mut said = Vec::new();
        for bytes in &sent {
            let mut take = |frame: &[u8]| said.push(decode(&mut frame.to_vec()).unwrap().1);
            self.bench.loop_task.receive(bytes, &mut take);
        }
        self.bench.timer_task.interrupt();
        self.bench.run_tick();
        said.append(&mut self.bench.received);
        self.bytes[0].push(sent.iter().map(|bytes| bytes.len() as u64).sum());
        self.bytes[1].push(said.iter().map(longest).sum());
        self.said.append(&mut said);
    }

    fn header(&mut self, ticks: u64) -> Header {
        let sequence = self.bench.sequence;
        self.bench.sequence += 1;
        Header { session: 1, sequence, ticks }
    }

    fn count(&self, is: fn(&BoardMessage) -> bool) -> usize {
        self.said.iter().filter(|said| is(said)).count()
    }
}

/// A move in bursts, of a rotor that never moves: each begins as soon as the filter says that the rotor rests, which a
/// rotor that has to stop first does not do sooner. To the board go frames, messages that keep the line alive, and
/// questions; from it come reports each millisecond and at each change of the drive, and answers.
#[test]
fn law_all_traffic_of_a_move_is_at_most_70_percent_of_the_line() {
    let near = Configuration { target_deg: 0.1, ..MOVE };
    let mut bench = Bench::new();
    for message in [HostMessage::Hello, HostMessage::Configure(near), HostMessage::Arm] {
        bench.exchange(&message);
    }
    let mut run = FullSpeed { bench, questions: 0, bytes: [vec![], vec![]], said: vec![] };
    let ticks = 20 * WINDOW_TICKS as u64;
    (1..=ticks).for_each(|tick| run.tick(tick));
    let reports = run.count(|said| matches!(said, BoardMessage::Report(_)));
    let changes = reports - (ticks / u64::from(REPORT_TICKS)) as usize;
    assert!(changes >= 8, "four bursts begin and end: {changes}");
    for (is, kind) in [
        ((|said| *said == BoardMessage::Armed) as fn(&BoardMessage) -> bool, "armed"),
        (|said| matches!(said, BoardMessage::Counters(_)), "counters"),
        (|said| matches!(said, BoardMessage::Identity(_)), "identity"),
    ] {
        assert!(run.count(is) >= 5, "{kind}: {:?}", run.said.last());
    }
    for (bytes, way) in run.bytes.iter().zip(["to the board", "from the board"]) {
        let most = bytes.windows(WINDOW_TICKS).map(|window| window.iter().sum::<u64>()).max().unwrap();
        assert!(most <= WINDOW_BYTES_MAX, "{way}: {most} bytes, bounds 0 to {WINDOW_BYTES_MAX}");
    }
}

/// Reports every 20 ms, as a host without a log asks for them, take 3 % of the line, and those of a host that asks for
/// changes alone 1 %. All changes of health or phase that a board may report take no more than reports every
/// millisecond.
#[test]
fn exact_reports_by_need_leave_the_line_free() {
    let report = longest_report(PhaseRecord::Burst, None);
    // Rounded.
    let percent = |ticks: u16| {
        let reports_per_s = 1_000_000_000 / PositionLoop::TICK_NANOS / u64::from(ticks);
        (100 * reports_per_s * report * BITS_PER_BYTE + u64::from(LINE_BAUD) / 2) / u64::from(LINE_BAUD)
    };
    assert_eq!((percent(2000), percent(REPORT_TICKS_MAX)), (3, 1));
    assert!(percent(CHANGE_TICKS) == percent(REPORT_TICKS) && percent(CHANGE_TICKS) <= 62);
}

/// The longest reports are those of a rate, which come each millisecond and not at changes of the drive. Answers come
/// beside them.
#[test]
fn exact_the_line_carries_the_reports_of_a_rate() {
    let rate = RateRecord { wanted_rad_s: f32::MAX, reference_units: Some(i64::MAX) };
    let report = longest_report(PhaseRecord::Rate(RatePhase::Following), Some(rate));
    let reports = WINDOW_TICKS as u64 / u64::from(REPORT_TICKS) * report;
    let answers = [
        BoardMessage::Armed,
        BoardMessage::Counters(Counters::default()),
        BoardMessage::Identity(BoardIdentity { loop_digest: 0, reset_cause: ResetCause::Power.into() }),
    ];
    let answer = answers.iter().map(longest).max().unwrap();
    let bytes = reports + (FIRST_QUESTIONS + 1) * answer;
    assert!(bytes <= WINDOW_BYTES_MAX, "{bytes} bytes, bounds 0 to {WINDOW_BYTES_MAX}; {report} of a report");
}
