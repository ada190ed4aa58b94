//! The whole program on the emulated board, over its serial line; and what becomes of the drive when the program fails.

use std::io::{Read as _, Write as _};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use link::{
    BoardMessage, Configuration, Counters, Deframer, FRAME_BYTES_MAX, Fault, FilterKind, Header, HostMessage,
    VERSION, decode, encode,
};

const MOVE: Configuration = Configuration {
    filter: FilterKind::Twin,
    target_deg: 90.0,
    tolerance_deg: 0.02,
    deadline_nanos: 30_000_000_000,
};

/// Real time: far more than any answer takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// A board, and what it has said.
struct Board {
    child: Child,
    line: ChildStdin,
    said: Receiver<BoardMessage>,
    sequence: u32,
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Board {
    /// An instruction takes a nanosecond, and time in which the board waits passes at once.
    fn start() -> Self {
        let elf = crate::elf("board");
        let mut child = Command::new("qemu-system-arm")
            .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "stdio"])
            .args(["-icount", "shift=0,sleep=off", "-semihosting-config", "enable=on,target=native"])
            .args(["-kernel", &elf])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("QEMU starts, tests/run.sh installs it");
        let line = child.stdin.take().expect("a pipe");
        let mut from_board = child.stdout.take().expect("a pipe");
        let (to_test, said) = channel();
        std::thread::spawn(move || {
            let (mut deframer, mut block) = (Deframer::default(), [0; 4096]);
            while let Ok(length @ 1..) = from_board.read(&mut block) {
                for &byte in &block[..length] {
                    let frame = deframer.push(byte).map(decode::<BoardMessage>);
                    let Some(frame) = frame else { continue };
                    let (_, message) = frame.expect("the board sends frames only");
                    if to_test.send(message).is_err() {
                        return;
                    }
                }
            }
        });
        Self { child, line, said, sequence: 0 }
    }

    fn send(&mut self, bytes: &[u8]) {
        self.line.write_all(bytes).and_then(|()| self.line.flush()).expect("the board listens");
    }

    fn say(&mut self, message: &HostMessage) {
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session: 9, sequence: self.sequence, ticks: 0 };
        self.sequence += 1;
        let length = encode(header, message, &mut frame).expect("it fits");
        self.send(&frame[..length]);
    }

    /// The next thing said that is no report.
    fn hears(&self) -> BoardMessage {
        loop {
            match self.said.recv_timeout(PATIENCE).expect("the board answers") {
                BoardMessage::Report(_) => (),
                message => return message,
            }
        }
    }

    #[track_caller]
    fn answers(&mut self, message: &HostMessage, expected: &BoardMessage) {
        self.say(message);
        assert_eq!(self.hears(), *expected, "to {message:?}");
    }

    fn counters(&mut self) -> Counters {
        self.say(&HostMessage::Count);
        match self.hears() {
            BoardMessage::Counters(counters) => counters,
            other => panic!("no counters: {other:?}"),
        }
    }

    fn arm(&mut self) {
        self.answers(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos: 10_000 });
        self.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
        self.answers(&HostMessage::Arm, &BoardMessage::Armed);
    }
}

/// L5: the host says nothing more; the board notices by its own clock, says so, and is not to be armed before a stop.
#[test]
fn tool_board_latches_off_when_the_host_falls_silent() {
    let mut board = Board::start();
    board.arm();
    let silent = BoardMessage::Fault(Fault::HostSilent);
    assert_eq!(board.hears(), silent);
    board.answers(&HostMessage::Arm, &silent);
    board.answers(&HostMessage::Stop, &BoardMessage::Stopped);
    board.answers(&HostMessage::Arm, &BoardMessage::Armed);
    // No tick was late in all that time.
    let counters = board.counters();
    assert_eq!((counters.overruns, counters.damaged, counters.lost), (0, 0, 0), "{counters:?}");
    // Interrupts nest on the same stack, of 40 KiB; building the twin's filter goes deepest here.
    assert!((4096..32 * 1024).contains(&counters.stack_bytes_max), "{counters:?}");
}

/// L1, L2: 30 kB of noise without pause; the loop goes on in time, and the next frame is understood.
#[test]
fn tool_board_survives_a_flood_in_time() {
    let mut board = Board::start();
    board.arm();
    let noise: Vec<u8> = (0..30_000_u32).map(|n| (n * n / 7 % 251) as u8).collect();
    board.send(&noise);
    board.send(&[0]);
    assert_eq!(board.hears(), BoardMessage::Fault(Fault::HostSilent), "noise is no word of the host");
    board.answers(&HostMessage::Stop, &BoardMessage::Stopped);
    let counters = board.counters();
    assert!(counters.damaged > 50, "{counters:?}");
    assert_eq!(counters.overruns, 0, "{counters:?}");
}

/// L4: both versions in one line.
#[test]
fn tool_board_names_both_versions() {
    let mut board = Board::start();
    let mut content = vec![VERSION + 7; 20];
    content.extend(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content).to_le_bytes());
    let mut frame = cobs::encode_vec(&content);
    frame.push(0);
    board.send(&frame);
    assert_eq!(board.hears(), BoardMessage::Fault(Fault::Version { theirs: VERSION + 7, ours: VERSION }));
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

/// L7: the register, read after the handler's first store, says off, and the emulator's exit code says failure.
#[test]
fn tool_panics_and_faults_switch_the_drive_off_first() {
    for (word, reason) in [
        ("panic", "drive off; panicked at "),
        ("undefined", "drive off; HardFault"),
        ("overflow", "drive off; HardFault"),
    ] {
        let (said, well) = fault(word);
        assert!(said.starts_with("start, drive off\ndrive on\n"), "{word}: {said}");
        assert!(said.contains(reason) && !well, "{word}: {said}");
    }
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
    assert!(well && depths[1] >= depths[0] + 21 * 64 && depths[1] < 40 * 1024, "{said}");
}
