extern crate std;

use std::boxed::Box;
use std::vec::Vec;

use controller::{Drive, LoopTiming, ResponseMap};
use link::{CameraRecord, Configuration, Header, LdvRecord, VERSION, decode, map_messages};
use motor_model::{DriveCommand, DriveMode, MotorParams, OutOfBounds};

mod by_hand;
mod description;
#[cfg(feature = "commissioning")]
mod experiments;
mod kept;
mod latency;
mod learnt;
mod limits;
mod rate;
mod reports;
mod retarget;
mod short_camera_frames;
mod zero;

use super::*;
use crate::test_support::{MOVE, framed};

/// An amplifier that shows its command, and applies none when it is broken.
struct RecordingAmplifier {
    command: DriveCommand,
    design: MotorParams,
    broken: bool,
    timing: LoopTiming,
}

impl Drive for RecordingAmplifier {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.command = command;
        if self.broken { DriveCommand::OFF } else { command }
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

impl DesignedDrive for RecordingAmplifier {
    type Design = MotorParams;

    fn design(motor: &MotorParams) -> Result<MotorParams, OutOfBounds> {
        Ok(*motor)
    }

    fn follow(&mut self, design: MotorParams) {
        self.design = design;
    }

    fn keep_time(&mut self, timing: LoopTiming) {
        self.timing = timing;
    }

    fn works(&self) -> bool {
        !self.broken
    }
}

/// A board that has just started, with the drive on.
fn board() -> Application<'static, RecordingAmplifier> {
    let design = MotorParams::nominal();
    let command = DriveCommand::full(DriveMode::C);
    let amplifier = RecordingAmplifier { command, design, broken: false, timing: LoopTiming::default() };
    Application::new(amplifier, Box::leak(Box::default()))
}

/// A host and its board: a test bench.
struct Bench {
    board: Application<'static, RecordingAmplifier>,
    session: u32,
    sequence: u32,
    ticks: u64,
}

impl Bench {
    fn new() -> Self {
        Self { board: board(), session: 5, sequence: 0, ticks: 0 }
    }

    /// A board whose motor turns.
    fn driving() -> Self {
        let mut bench = Self::new();
        bench.begin();
        bench.drive();
        bench
    }

    /// Hello, configuration, arming.
    fn begin(&mut self) {
        let tick_nanos = PositionLoop::TICK_NANOS;
        assert_eq!(self.exchange(&HostMessage::Hello), [BoardMessage::Welcome { tick_nanos }]);
        assert_eq!(self.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
        assert_eq!(self.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    }

    /// Sends `map`.
    fn describe_map(&mut self, map: &ResponseMap) {
        for message in map_messages(map) {
            assert_eq!(self.exchange(&message), [BoardMessage::Described], "{message:?}");
        }
    }

    /// Measures a rotor at rest, far from the target, until the loop drives.
    fn drive(&mut self) {
        for _ in 0..3000 {
            self.measure();
            if self.step().is_some_and(|report| report.applied.mode.value() != Some(None)) {
                assert!(!self.off());
                return;
            }
        }
        panic!("the loop does not drive");
    }

    /// Sends a sample of a rotor at rest, and every tenth tick a frame of a dithered camera.
    fn measure(&mut self) {
        self.ticks += 1;
        let now = self.board.elapsed_ticks * PositionLoop::TICK_NANOS;
        // Neighbouring samples differ: equal ones would mean a vibrometer without signal.
        let velocity_m_s = if now.is_multiple_of(20_000) { 1e-5 } else { -1e-5 };
        let sample = LdvRecord { taken_nanos: now + 1, velocity_m_s };
        assert!(self.exchange(&HostMessage::Ldv([sample].into_iter().collect())).is_empty());
        if self.ticks.is_multiple_of(10) {
            let angle_units = 350_546 * (self.ticks / 10 % 2) as i32;
            let frame = CameraRecord { exposed_nanos: now + 1, angle_units, marks_used: 0, residual: 0 };
            assert!(self.exchange(&HostMessage::Camera(frame)).is_empty());
        }
    }

    fn step(&mut self) -> Option<TickRecord> {
        match self.exchange(&HostMessage::Step).as_slice() {
            [BoardMessage::Report(report)] => Some(*report),
            _ => None,
        }
    }

    fn frame(&mut self, message: &HostMessage) -> Vec<u8> {
        let header = Header { session: self.session, sequence: self.sequence, ticks: 0 };
        self.sequence = self.sequence.wrapping_add(1);
        framed(header, message)
    }

    fn exchange(&mut self, message: &HostMessage) -> Vec<BoardMessage> {
        let frame = self.frame(message);
        self.exchange_bytes(&frame)
    }

    fn exchange_bytes(&mut self, bytes: &[u8]) -> Vec<BoardMessage> {
        let mut answers = Vec::new();
        self.board.receive(bytes, &mut |frame| answers.push(decode(&mut frame.to_vec()).unwrap().1));
        answers
    }

    fn driven(&self) -> DriveCommand {
        self.board.amplifier().command
    }

    fn off(&self) -> bool {
        self.driven() == DriveCommand::OFF
    }

    /// Whether it drives within a thousand ticks of the same measurements.
    fn drives_again(&mut self) -> bool {
        (0..1000).any(|_| {
            self.measure();
            self.board.tick();
            !self.off()
        })
    }
}

fn fault(fault: BoardFault) -> [BoardMessage; 1] {
    [BoardMessage::Fault(fault)]
}

/// The program switches the drive off before all else.
#[test]
fn law_the_drive_is_off_from_the_start() {
    let mut bench = Bench::new();
    assert!(bench.off());
    bench.board.amplifier_mut().command = DriveCommand::full(DriveMode::B);
    assert_eq!(bench.board.tick(), None);
    assert!(bench.off(), "not armed");
}

#[test]
fn law_nothing_drives_before_it_is_configured_and_armed() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    assert_eq!(bench.exchange(&HostMessage::Step), fault(BoardFault::NotReady));
    bench.exchange(&HostMessage::Configure(MOVE));
    assert_eq!(bench.exchange(&HostMessage::Step), fault(BoardFault::NotReady));
    assert!(!bench.drives_again());
}

/// L1: noise between frames, cut frames and damaged frames stop nothing and start nothing.
#[test]
fn law_damaged_frames_change_nothing_but_their_counter() {
    let mut bench = Bench::driving();
    let before = bench.driven();
    for place in 0..20 {
        let mut frame = bench.frame(&HostMessage::Stop);
        bench.sequence -= 1;
        frame[place] ^= 0x40;
        assert!(bench.exchange_bytes(&frame).is_empty(), "byte {place}");
        let frame = bench.frame(&HostMessage::Stop);
        bench.sequence -= 1;
        assert!(bench.exchange_bytes(&[&frame[..place], &[0]].concat()).is_empty());
    }
    assert!(bench.board.is_armed());
    assert_eq!(bench.driven(), before);
    // One of the cut frames is empty and thus none.
    assert!(bench.board.counters().damaged >= 39, "{:?}", bench.board.counters());
    assert_eq!(bench.board.counters().lost, 0);
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
}

/// L2: bytes without the end of a frame take no memory and do not stop the loop.
#[test]
fn law_oversize_frames_are_dropped_and_counted() {
    let mut bench = Bench::driving();
    assert!(bench.exchange_bytes(&std::vec![1; 100_000]).is_empty());
    assert!(bench.exchange_bytes(&[0]).is_empty());
    assert_eq!(bench.board.counters().oversize, 1);
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
}

/// L2: when more measurements arrive than ticks take, the oldest are dropped.
#[test]
fn law_a_flood_drops_the_oldest_measurements() {
    let mut bench = Bench::driving();
    let now = bench.board.elapsed_ticks * PositionLoop::TICK_NANOS;
    for n in 0..1000 {
        let frame = CameraRecord { exposed_nanos: now + n, angle_units: 0, marks_used: 0, residual: 0 };
        bench.exchange(&HostMessage::Camera(frame));
    }
    assert_eq!(bench.board.counters().dropped, 1000 - 8);
    let report = bench.board.tick().unwrap();
    assert_eq!(report.camera.unwrap().taken_nanos, now + 1000 - 8);
}

/// A board that waits takes no measurements: none is dropped, and none is old when the loop begins.
#[test]
fn law_measurements_before_a_loop_are_not_kept() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    for _ in 0..1000 {
        bench.measure();
        bench.board.push_ldv_sample(LdvRecord { taken_nanos: 1, velocity_m_s: 1.0 }.into());
    }
    assert_eq!(bench.board.counters().dropped, 0);
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    let report = bench.step().expect("a report");
    assert!(report.camera.is_none() && report.estimate.is_none(), "{report:?}");
}

/// L3: a frame that comes twice is executed once.
#[test]
fn law_duplicates_are_executed_once() {
    let mut bench = Bench::driving();
    let ticks = bench.board.elapsed_ticks;
    let step = bench.frame(&HostMessage::Step);
    assert_eq!(bench.exchange_bytes(&step).len(), 1);
    assert!(bench.exchange_bytes(&step).is_empty());
    assert_eq!(bench.board.elapsed_ticks, ticks + 1);
    assert_eq!(bench.board.counters().duplicates, 1);
}

/// L3: a lost frame is counted, a late frame is not executed.
#[test]
fn law_gaps_are_counted_and_late_frames_refused() {
    let mut bench = Bench::driving();
    let late = bench.frame(&HostMessage::Stop);
    let _lost = bench.frame(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Step).len(), 1);
    assert!(bench.exchange_bytes(&late).is_empty());
    assert!(bench.board.is_armed());
    let counters = bench.board.counters();
    assert_eq!((counters.lost, counters.late), (2, 1));
}

/// L3: after a restart of the host the drive is off, and the host has to configure and arm again.
#[test]
fn law_a_new_session_has_to_arm_again() {
    let mut bench = Bench::driving();
    (bench.session, bench.sequence) = (6, 0);
    assert_eq!(bench.exchange(&HostMessage::Step), fault(BoardFault::UnknownSession { session: 6 }));
    assert!(bench.board.is_armed(), "a frame of another session stops nothing");
    bench.exchange(&HostMessage::Hello);
    assert!(bench.off() && !bench.board.is_armed());
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    bench.begin();
    bench.drive();
}

/// L4: the answer names both versions, and nothing else happens.
#[test]
fn law_another_version_is_refused_by_name() {
    let mut bench = Bench::new();
    let frame = bench.frame(&HostMessage::Hello);
    let mut content = std::vec![0; frame.len()];
    let length = cobs::decode(&frame[..frame.len() - 1], &mut content).unwrap().frame_size();
    content.truncate(length);
    content[0] = VERSION + 1;
    let checked = length - 4;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content[..checked]);
    content[checked..].copy_from_slice(&crc.to_le_bytes());
    let mut other = cobs::encode_vec(&content);
    other.push(0);
    let refused = BoardFault::Version { theirs: VERSION + 1, ours: VERSION };
    assert_eq!(std::format!("{refused}"), "the host speaks protocol version 18, the board version 17");
    assert_eq!(bench.exchange_bytes(&other), fault(refused));
    assert_eq!(bench.board.counters().other_version, 1);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::UnknownSession { session: 5 }));
}

/// The board says which loop it was built of and why it started, also while it is armed; the loop goes on.
#[test]
fn exact_the_board_says_what_it_is() {
    let mut bench = Bench::driving();
    for cause in [ResetCause::Unknown, ResetCause::Watchdog, ResetCause::Power] {
        bench.board.record_reset(cause);
        let identity = BoardIdentity { loop_digest: LOOP_DIGEST, reset_cause: cause.into() };
        assert_eq!(bench.exchange(&HostMessage::Identify), [BoardMessage::Identity(identity)]);
    }
    assert!(bench.board.is_armed());
}

/// L5: without a frame for ten milliseconds the drive goes off, and stays off until a stop and a new arming.
#[test]
fn law_a_silent_host_latches_the_drive_off() {
    let mut bench = Bench::driving();
    bench.exchange(&HostMessage::Count);
    for tick in 1..=SILENT_TICKS {
        assert!(bench.board.tick().is_some(), "{tick}");
    }
    assert_eq!(bench.board.tick(), None);
    assert!(bench.off());
    // Frames of the host alone change nothing.
    assert!(!bench.drives_again());
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::HostSilent));
    assert_eq!(bench.exchange(&HostMessage::Step), fault(BoardFault::HostSilent));
    assert!(bench.off());
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert!(!bench.drives_again(), "a stop does not arm");
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
}

/// L5: ticks that were lost are time, in which the host was as silent.
#[test]
fn law_a_host_is_silent_through_lost_ticks() {
    let mut bench = Bench::driving();
    bench.exchange(&HostMessage::Count);
    bench.board.record_lost_ticks(5);
    assert!((5..SILENT_TICKS).all(|_| bench.board.tick().is_some()));
    assert_eq!(bench.board.tick(), None);
}

/// The counters tell how deep the stack was.
#[test]
fn exact_the_counters_tell_the_stack() {
    let mut bench = Bench::new();
    bench.begin();
    bench.board.record_stack(12_345);
    let [BoardMessage::Counters(counters)] = bench.exchange(&HostMessage::Count)[..] else {
        panic!("no counters")
    };
    assert_eq!(counters.stack_bytes_max, 12_345);
}

/// L5: a frame of any kind within the time keeps the loop going.
#[test]
fn law_a_host_that_sends_frames_is_not_silent() {
    let mut bench = Bench::driving();
    for _ in 0..5 {
        bench.exchange(&HostMessage::Count);
        assert!((0..SILENT_TICKS).all(|_| bench.board.tick().is_some()));
    }
    assert!(bench.board.is_armed());
}

/// L6: after a restart the board has no session: its answers say so, and it does not drive.
#[test]
fn law_a_restarted_board_says_so_and_does_not_drive() {
    let mut bench = Bench::driving();
    bench.board = board();
    assert!(bench.off());
    let session = bench.session;
    for message in [HostMessage::Step, HostMessage::Arm, HostMessage::Configure(MOVE)] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::UnknownSession { session }));
    }
    assert_eq!(bench.board.counters().other_session, 3);
    bench.begin();
    bench.drive();
}

/// L8: an armed loop keeps its configuration.
#[test]
fn law_a_configuration_is_not_changed_while_armed() {
    let mut bench = Bench::driving();
    let clockwise = bench.driven().mode();
    let back = Configuration { target_deg: -90.0, ..MOVE };
    assert_eq!(bench.exchange(&HostMessage::Configure(back)), fault(BoardFault::Armed));
    bench.measure();
    assert_eq!(bench.step().unwrap().applied.mode, Some(DriveMode::B).into());
    assert_eq!(bench.driven().mode(), clockwise);
    bench.exchange(&HostMessage::Stop);
    assert!(bench.off());
    assert_eq!(bench.exchange(&HostMessage::Configure(back)), [BoardMessage::Configured]);
}

/// K9: single late ticks are counted, ten in a row switch off.
#[test]
fn law_missed_deadlines_are_counted_and_latch_when_they_last() {
    let mut bench = Bench::driving();
    for n in 1..=5 * OVERRUNS_MAX {
        bench.board.record_deadline(n % OVERRUNS_MAX == 0);
    }
    assert_eq!(bench.board.counters().overruns, 5 * (OVERRUNS_MAX - 1));
    assert!(bench.board.is_armed() && !bench.off());
    (0..OVERRUNS_MAX).for_each(|_| bench.board.record_deadline(false));
    assert!(bench.off());
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::Overrun));
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
}
