//! `host-sim run`: the whole program on the emulated board, behind a pseudo-terminal that carries bytes no faster than
//! its baud rate.

#[path = "../qemu/programs.rs"]
#[allow(dead_code, reason = "the tests on the emulated board use the rest of it")]
mod programs;

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use link::{BoardFault, BoardMessage, Deframer, VERSION, decode};
use motor_model::Angle;
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde_json::Value;

use programs::{elf, host_sim};

/// The rate of the line: that of an STM32G474's firmware.
const BAUD: u32 = 921_600;

/// Instruments that the line carries.
const INSTRUMENTS: [&str; 4] = ["--set", "camera.frame_rate_hz=1000", "--set", "ldv.installed=no"];

/// Longest wait for anything. An emulated board takes some ten times the time of a real one.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// The emulated line takes a byte whenever the emulator's other thread wakes. On a busy machine 10 ms of the board's
/// time can pass in between: then the board misses the host, as it should. Or the emulator takes more than 2 s to
/// start.
#[derive(Debug)]
struct Starved;

impl Starved {
    fn check(stderr: &str) -> Result<(), Self> {
        let signs = ["the host was silent", "no board answers"];
        if signs.iter().any(|sign| stderr.contains(sign)) { Err(Self) } else { Ok(()) }
    }
}

/// The first of a few attempts whose board was not starved.
fn not_starved<T>(mut attempt: impl FnMut() -> Result<T, Starved>) -> T {
    (0..6).find_map(|_| attempt().ok()).expect("a machine that is not too busy for the emulator")
}

/// Held by the test whose board runs: an emulated board on its own clock needs a processor of this machine.
static ONE_BOARD: Mutex<()> = Mutex::new(());

/// A pseudo-terminal: the end of the cable, and the port that the command opens. No other program inherits either.
struct PseudoTerminal {
    end: File,
    name: String,
    /// Open here as well, so that there is a line before the command opens it.
    port: File,
}

impl PseudoTerminal {
    fn open() -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let end = openpt(flags).expect("a pseudo-terminal");
        grantpt(&end).and_then(|()| unlockpt(&end)).expect("its port");
        let name = ptsname(&end, Vec::new()).expect("a name").into_string().expect("a name in UTF-8");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let port = rustix::fs::open(&name, flags, Mode::empty()).expect("it opens");
        let mut attributes = tcgetattr(&port).expect("a terminal");
        attributes.make_raw();
        tcsetattr(&port, OptionalActions::Now, &attributes).expect("a terminal");
        Self { end: end.into(), name, port: port.into() }
    }
}

/// The emulated board, and a cable to a port of this machine.
struct CabledBoard {
    qemu: Child,
    /// The port's name, and the port held open.
    port: (String, File),
    pulled: Arc<AtomicBool>,
    to_board: Option<JoinHandle<()>>,
    said: Receiver<BoardMessage>,
    _alone: MutexGuard<'static, ()>,
}

impl CabledBoard {
    fn start() -> Self {
        let alone = ONE_BOARD.lock().unwrap_or_else(PoisonError::into_inner);
        // The board misses a host that is silent for 10 ms of its time. On a busy machine it comes last, and its time
        // passes with its instructions alone.
        let mut qemu = Command::new("nice")
            .args([
                "-n",
                "19",
                "qemu-system-arm",
                "-M",
                "mps2-an386",
                "-display",
                "none",
                "-monitor",
                "none",
                "-serial",
                "stdio",
            ])
            .args(["-icount", "shift=0,sleep=off"])
            .args(["-semihosting-config", "enable=on,target=native,arg=firmware,arg=link=uart"])
            .args(["-kernel", &elf("board")])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("nice (coreutils) starts");
        let (to_qemu, from_qemu) = (qemu.stdin.take().expect("a pipe"), qemu.stdout.take().expect("a pipe"));
        let PseudoTerminal { end: host_side, name, port: port_held } = PseudoTerminal::open();
        let from_host = host_side.try_clone().expect("a second handle");
        let pulled = Arc::new(AtomicBool::new(false));
        let (hear, said) = channel();
        let to_board = {
            let pulled = Arc::clone(&pulled);
            spawn(move || carry_to_board(from_host, to_qemu, &pulled))
        };
        let cable = Arc::clone(&pulled);
        spawn(move || carry_from_board(from_qemu, host_side, &cable, &hear));
        Self { qemu, port: (name, port_held), pulled, to_board: Some(to_board), said, _alone: alone }
    }

    /// `host-sim run` on its port.
    fn run(&self, arguments: &[&str]) -> Child {
        host_sim()
            .args(["run", "--port", &self.port.0, "--baud", &BAUD.to_string()])
            .args(INSTRUMENTS)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("host-sim starts")
    }

    /// The next message for which `take` has a value.
    fn hears<T>(&self, take: impl Fn(&BoardMessage) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            let message = self.said.recv_timeout(WAIT_MAX).expect("the board speaks");
            if let Some(value) = take(&message) {
                return value;
            }
            assert!(begun.elapsed() < WAIT_MAX, "the board says other things");
        }
    }

    /// Waits until the drive is on, while `run` runs.
    fn drives(&self, run: &mut Child) -> Result<(), Starved> {
        let begun = Instant::now();
        let is_driven = |message| match message {
            BoardMessage::Report(report) => report.applied.mode.value().flatten().is_some(),
            _ => false,
        };
        while !self.said.try_iter().any(is_driven) {
            if let Some(status) = run.try_wait().expect("a child") {
                let mut stderr = String::new();
                let pipe = run.stderr.as_mut().expect("a pipe");
                pipe.read_to_string(&mut stderr).expect("text");
                Starved::check(&stderr)?;
                panic!("no drive: {status} {stderr}");
            }
            assert!(begun.elapsed() < WAIT_MAX, "no drive");
            sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    /// Whether it has reported an estimate within a degree of `degrees`.
    fn has_an_estimate_near(&self, degrees: f64) -> bool {
        self.said.try_iter().any(|message| match message {
            BoardMessage::Report(report) => report.estimate.is_some_and(|estimate| {
                (Angle::from_units(estimate.angle_units).degrees() - degrees).abs() < 1.0
            }),
            _ => false,
        })
    }

    /// Pulls the cable: the port is gone, and the board hears nothing.
    fn pull(&mut self) {
        self.pulled.store(true, Ordering::Relaxed);
        self.to_board.take().map(JoinHandle::join);
    }
}

impl Drop for CabledBoard {
    fn drop(&mut self) {
        self.pulled.store(true, Ordering::Relaxed);
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

/// Waits as long as `bytes` take on the line.
fn pace(bytes: usize) {
    sleep(Duration::from_nanos(bytes as u64 * 10_000_000_000 / u64::from(BAUD)));
}

fn carry_to_board(mut from_host: File, mut to_qemu: ChildStdin, pulled: &AtomicBool) {
    let mut block = [0; 64];
    while !pulled.load(Ordering::Relaxed) {
        let Ok(length) = from_host.read(&mut block) else { break };
        pace(length);
        if to_qemu.write_all(&block[..length]).and_then(|()| to_qemu.flush()).is_err() {
            return;
        }
    }
    // The emulator ends with its input: it is kept.
    std::mem::forget(to_qemu);
}

fn carry_from_board(
    mut from_qemu: ChildStdout,
    to_host: File,
    pulled: &AtomicBool,
    hear: &Sender<BoardMessage>,
) {
    let (mut deframer, mut block, mut to_host) = (Deframer::default(), [0; 64], Some(to_host));
    while let Ok(length @ 1..) = from_qemu.read(&mut block) {
        if pulled.load(Ordering::Relaxed) {
            to_host = None;
        }
        if let Some(to_host) = &mut to_host {
            pace(length);
            let _ = to_host.write_all(&block[..length]);
        }
        for &byte in &block[..length] {
            if let Some(Ok((_, message))) = deframer.push(byte).map(decode::<BoardMessage>) {
                let _ = hear.send(message);
            }
        }
    }
}

/// Ends with `code`, and one line on standard error that begins with `error: `; that line.
#[track_caller]
fn refusal(run: Child, code: i32) -> String {
    refused(&run.wait_with_output().expect("it ends"), code)
}

#[track_caller]
fn refused(Output { status, stdout, stderr }: &Output, code: i32) -> String {
    let stderr = String::from_utf8_lossy(stderr).into_owned();
    assert_eq!(status.code(), Some(code), "{stderr}");
    assert!(stdout.is_empty(), "{}", String::from_utf8_lossy(stdout));
    let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    let [error] = errors[..] else { panic!("{stderr}") };
    assert!(stderr.ends_with(&format!("{error}\n")), "{stderr}");
    error.to_owned()
}

/// What `host-sim explain` says of a log.
#[track_caller]
fn explained(log: &str) -> String {
    let output = host_sim().args(["explain", log]).output().expect("host-sim starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Hardware in the loop: the board moves the simulated motor to its target, and the drive is off at the end.
#[test]
fn tool_run_moves_a_simulated_motor_by_a_board_at_a_serial_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let log = log.to_str().expect("a name in UTF-8");
    let (board, Output { status, stdout, stderr }) = not_starved(|| {
        let board = CabledBoard::start();
        let run = board.run(&[
            "--to",
            "2",
            "--tolerance",
            "0.1",
            "--set",
            "position.hold_s=0.02",
            "--format",
            "json",
            "--log",
            log,
        ]);
        let output = run.wait_with_output().expect("it ends");
        Starved::check(&String::from_utf8_lossy(&output.stderr))?;
        Ok((board, output))
    });
    let stderr = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "{stderr}");
    let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert!(outcome["ok"] == true && outcome["stop_acknowledged"] == true, "{outcome}");
    assert_eq!(outcome["stopped"], Value::Null, "{outcome}");
    let number = |pointer: &str| outcome.pointer(pointer).and_then(Value::as_f64).expect("a number");
    let (angle, error) = (number("/final_angle_deg"), number("/final_error_true_mdeg"));
    assert!((angle - 2.0).abs() < 0.1 && error.abs() <= 100.0, "{outcome}");
    for load in ["/line/load_to_board", "/line/load_from_board"] {
        assert!(number(load) > 0.0 && number(load) <= 1.0, "{outcome}");
    }
    // The emulator is slower than the part: so is its clock, and this is told.
    assert!(number("/clock/drift_ppm") < 0.0 && number("/clock/uncertainty_us") > 0.0, "{outcome}");
    assert!(number("/line/frames_sent") > 100.0 && number("/counters/lost_or_damaged") == 0.0, "{outcome}");
    // Without a terminal the live view is plain lines.
    assert!(stderr.lines().count() >= 1 && stderr.lines().all(|line| line.starts_with("time ")), "{stderr}");
    let text = explained(log);
    assert!(text.contains("at the target") && text.contains("the run ends as it should"), "{text}");
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
}

/// The cable is pulled while the drive is on: the command says so, the log is readable up to there, and the board
/// switches its drive off by itself.
#[test]
fn tool_run_without_its_cable_ends_with_its_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let log = log.to_str().expect("a name in UTF-8");
    let (mut board, run) = not_starved(|| {
        // That of an attempt before.
        let _ = std::fs::remove_file(log);
        let board = CabledBoard::start();
        let mut run = board.run(&["--to", "90", "--tolerance", "0.1", "--log", log]);
        board.drives(&mut run)?;
        Ok((board, run))
    });
    board.pull();
    let error = refusal(run, 2);
    assert!(error.contains(" was closed after ") && error.contains("run.mcap has the run up to "), "{error}");
    assert!(error.contains("; hint: put the cable back"), "{error}");
    assert!(explained(log).contains("cruise"), "{}", explained(log));
    board.hears(|message| (*message == BoardMessage::Fault(BoardFault::HostSilent)).then_some(()));
}

/// Ctrl-C while the drive is on: the board acknowledges the stop.
#[test]
fn tool_run_interrupted_stops_the_drive() {
    let (board, run) = not_starved(|| {
        let board = CabledBoard::start();
        let mut run = board.run(&["--to", "90", "--tolerance", "0.1"]);
        board.drives(&mut run)?;
        Ok((board, run))
    });
    let sent = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
    assert!(sent.expect("kill starts").success());
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
    let error = refusal(run, 130);
    assert!(error.contains("interrupted; the drive is off: the board has acknowledged the stop"), "{error}");
}

/// Frames of a pipe, by the host's clock: the board takes them, and a bad line ends the move with the drive off.
#[test]
fn tool_run_takes_frames_of_a_pipe_up_to_a_bad_line() {
    let (board, lines, output) = not_starved(|| {
        let board = CabledBoard::start();
        let mut run = board.run(&["--camera", "-", "--to", "90", "--tolerance", "0.1"]);
        let mut frames = run.stdin.take().expect("a pipe");
        let begun = Instant::now();
        let mut lines = 0;
        let mut is_taken = true;
        // Until the board has an estimate of these frames.
        while is_taken && !board.has_an_estimate_near(12.0) {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
            is_taken = writeln!(frames, "{now:.6} {} 3", 12.0 + 1e-3 * f64::from(lines % 7)).is_ok();
            lines += 1;
            sleep(Duration::from_millis(2));
            assert!(begun.elapsed() < WAIT_MAX, "no estimate of {lines} frames");
        }
        let _ = writeln!(frames, "1 fast 3");
        let output = run.wait_with_output().expect("it ends");
        Starved::check(&String::from_utf8_lossy(&output.stderr))?;
        Ok((board, lines, output))
    });
    let error = refused(&output, 2);
    let line = lines + 1;
    let expected =
        format!("error: -:{line}: angle_deg = fast is no number, bounds -1e6 to 1e6 deg; the drive is off");
    assert!(error.starts_with(&expected), "{error}");
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
}

/// Instruments that the line does not carry, a port that is not there, one that is busy, one at which nobody answers,
/// and a board of another version.
#[test]
fn tool_run_without_a_board_says_why() {
    let run_with = |port: &str, instruments: &[&str]| {
        let run = host_sim()
            .args(["run", "--port", port])
            .args(instruments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        refusal(run.expect("host-sim starts"), 2)
    };
    let run = |port: &str| run_with(port, &INSTRUMENTS);
    let error = run_with("/dev/null", &[]);
    assert!(
        error.contains(": ldv.installed = yes: ") && error.contains("hint: --set ldv.installed=no"),
        "{error}"
    );
    let error = run_with("/dev/null", &["--set", "ldv.installed=no"]);
    let too_slow =
        "error: camera.frame_rate_hz = 10000 needs 5428571 baud, bounds 0 to 1698 Hz at 921600 baud; ";
    assert!(error.starts_with(too_slow), "{error}");
    let error = run("/dev/no-such-port");
    assert!(error.starts_with("error: there is no port /dev/no-such-port; hint: "), "{error}");

    let PseudoTerminal { end: mut other, name, port: _port } = PseudoTerminal::open();
    let error = run(&name);
    let silent = format!("error: no board answers on {name} at 921600 baud within 2 s; hint: ");
    assert!(error.starts_with(&silent), "{error}");

    // The bytes of the host's first message, but of another version, as a board of that version would answer.
    let mut content = vec![VERSION + 7; 20];
    content.extend(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content).to_le_bytes());
    let mut frame = cobs::encode_vec(&content);
    frame.push(0);
    let answering = spawn(move || {
        let _ = other.read(&mut [0; 64]);
        other.write_all(&frame).expect("the line is open");
        other
    });
    let error = run(&name);
    let versions = format!(
        "error: the board speaks protocol version {}, this program version {VERSION}; hint: ",
        VERSION + 7
    );
    assert!(error.starts_with(&versions), "{error}");
    drop(answering.join());

    let PseudoTerminal { end: _other, name, port: _port } = PseudoTerminal::open();
    let _holder = serialport::new(&name, BAUD).open().expect("the port is free");
    let error = run(&name);
    assert!(error.starts_with(&format!("error: port {name} is busy: ")), "{error}");
}
