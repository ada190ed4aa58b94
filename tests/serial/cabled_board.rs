//! The emulated board behind a pseudo-terminal that carries bytes no faster than its baud rate, and whose cable can be
//! pulled, put back, and disturbed. The rate is that of the host's time; the board's own line holds to it in the
//! board's time.

use std::fs::{DirEntry, File, read_dir, read_to_string};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

use link::{BoardMessage, Deframer, Header, LINE_BAUD, decode};
use motor_model::Angle;
use rustix::fs::{Mode, OFlags};
use rustix::pipe::fcntl_setpipe_size;
use rustix::process::{Pid, setpriority_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use tempfile::TempDir;

use crate::programs::{elf, elf_with, host_sim};
use crate::starved::{Starved, Waits};

/// The rate of the line: that of the firmware.
pub const BAUD: u32 = LINE_BAUD;

/// Instruments that the line carries.
pub const INSTRUMENTS: [&str; 4] = ["--set", "camera.frame_rate_hz=1000", "--set", "ldv.installed=no"];

/// Longest wait for anything. An emulated board takes some ten times the time of a real one.
pub const WAIT_MAX: Duration = Duration::from_secs(60);

/// Bytes on their way to the board, the fewest that a pipe keeps.
const LINE_BYTES: usize = 4096;

/// Niceness of the emulated processor: a tenth of a thread of niceness 0.
const NICE: i32 = 10;

/// Name of the socket of the emulator's control.
const CONTROL: &str = "control";

/// Held by the test whose board runs: an emulated board on its own clock needs a processor of this machine.
static ONE_BOARD: Mutex<()> = Mutex::new(());

/// A pseudo-terminal: the end of the cable, and the port that the command opens. No other program inherits either.
pub struct PseudoTerminal {
    pub end: File,
    pub name: String,
    /// Open here as well, so that there is a line before the command opens it.
    pub port: File,
}

impl PseudoTerminal {
    pub fn open() -> Self {
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

/// Bytes of a cable in which a bit flips, by their numbers.
#[derive(Clone, Copy, Default)]
pub struct Disturbance {
    pub to_board: &'static [usize],
    pub from_board: &'static [usize],
}

/// One direction of a cable.
struct Wire {
    disturbed: &'static [usize],
    carried: usize,
}

impl Wire {
    fn new(disturbed: &'static [usize]) -> Self {
        Self { disturbed, carried: 0 }
    }

    /// Carries `block`: waits as long as it takes on the line, and flips a bit of each of its disturbed bytes.
    fn carry(&mut self, block: &mut [u8]) {
        sleep(Duration::from_nanos(block.len() as u64 * 10_000_000_000 / u64::from(BAUD)));
        for (number, byte) in (self.carried..).zip(&mut *block) {
            if self.disturbed.contains(&number) {
                // Of a byte that is not 1, no byte becomes the end of a frame.
                *byte ^= if *byte == 1 { 2 } else { 1 };
            }
        }
        self.carried += block.len();
    }
}

/// The host's end of a cable.
struct HostEnd {
    terminal: File,
    wire: Wire,
}

/// A cable in its place.
struct Cable {
    /// The port's name, and the port held open.
    port: (String, File),
    pulled: Arc<AtomicBool>,
    /// Gives the board's end back when the cable is pulled.
    to_board: JoinHandle<ChildStdin>,
}

/// The emulated board, and a cable to a port of this machine.
pub struct CabledBoard {
    qemu: Child,
    waits: Waits,
    cable: Option<Cable>,
    /// The board's end of the cable, while none is in its place. The emulator ends with its input.
    loose_end: Option<ChildStdin>,
    /// The host's end of the cable.
    to_host: Arc<Mutex<Option<HostEnd>>>,
    said: Receiver<(Header, BoardMessage)>,
    /// Holds the socket of the emulator's control.
    folder: TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl CabledBoard {
    pub fn start() -> Self {
        Self::start_disturbed(Disturbance::default())
    }

    /// A board whose time passes no faster than that of the host while it waits for the next tick. One that is not
    /// armed has little to do in a tick, and would outrun its host.
    pub fn start_in_real_time() -> Self {
        Self::start_with(&elf("board"), Disturbance::default(), "on")
    }

    /// A board whose cable is disturbed.
    pub fn start_disturbed(disturbance: Disturbance) -> Self {
        Self::start_with(&elf("board"), disturbance, "off")
    }

    /// A board whose firmware has one filter alone.
    pub fn start_with_filter(filter: &str) -> Self {
        Self::start_with(&elf_with(&["board", filter]), Disturbance::default(), "off")
    }

    fn start_with(elf: &str, disturbance: Disturbance, sleep: &str) -> Self {
        let alone = ONE_BOARD.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a folder");
        let control = format!("unix:{},server=on,wait=off", folder.path().join(CONTROL).display());
        let mut qemu = Command::new("qemu-system-arm")
            .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "stdio"])
            .args([
                "-icount",
                &format!("shift=0,sleep={sleep}"),
                "-name",
                "debug-threads=on",
                "-qmp",
                &control,
            ])
            .args(["-semihosting-config", "enable=on,target=native,arg=firmware,arg=link=uart"])
            .args(["-kernel", elf])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("qemu-system-arm starts");
        let (to_qemu, from_qemu) = (qemu.stdin.take().expect("a pipe"), qemu.stdout.take().expect("a pipe"));
        // A line keeps no more than a few bytes: what a pipe keeps would be old when the board hears it.
        fcntl_setpipe_size(&to_qemu, LINE_BYTES).expect("a small pipe");
        let (hear, said) = channel();
        let to_host = Arc::new(Mutex::new(None));
        let host_end = Arc::clone(&to_host);
        spawn(move || carry_from_board(from_qemu, &host_end, &hear));
        let waits = Waits::new(qemu.id());
        let mut board =
            Self { qemu, waits, cable: None, loose_end: Some(to_qemu), to_host, said, folder, _alone: alone };
        board.put_processor_last();
        board.plug(disturbance);
        board
    }

    /// Lets the thread of the emulated processor come after all others. The board misses a host that is silent for 10
    /// ms of its time. On a busy machine that time passes slowly, while the emulator's line and the host come first.
    fn put_processor_last(&self) {
        let begun = Instant::now();
        let threads = format!("/proc/{}/task", self.qemu.id());
        let is_processor = |thread: &DirEntry| {
            read_to_string(thread.path().join("comm")).is_ok_and(|name| name.trim_end().ends_with("/TCG"))
        };
        let thread = loop {
            let threads = read_dir(&threads).expect("the emulator runs");
            if let Some(thread) = threads.flatten().find(is_processor) {
                break thread.file_name();
            }
            assert!(begun.elapsed() < WAIT_MAX, "an emulator without a processor");
            sleep(Duration::from_millis(1));
        };
        let thread = thread.to_str().and_then(|name| Pid::from_raw(name.parse().ok()?)).expect("a number");
        setpriority_process(Some(thread), NICE).expect("a thread of this user's");
    }

    /// Puts a cable in its place.
    pub fn plug(&mut self, Disturbance { to_board, from_board }: Disturbance) {
        let to_qemu = self.loose_end.take().expect("no cable is in its place");
        let PseudoTerminal { end: host_side, name, port } = PseudoTerminal::open();
        let from_host = host_side.try_clone().expect("a second handle");
        let host_end = HostEnd { terminal: host_side, wire: Wire::new(from_board) };
        *self.to_host.lock().expect("a thread that has not panicked") = Some(host_end);
        let pulled = Arc::new(AtomicBool::new(false));
        let is_pulled = Arc::clone(&pulled);
        let wire = Wire::new(to_board);
        let to_board = spawn(move || carry_to_board(from_host, to_qemu, &is_pulled, wire));
        self.cable = Some(Cable { port: (name, port), pulled, to_board });
    }

    /// Pulls the cable: the port is gone, and the board hears nothing. To be called while bytes go to the board.
    pub fn pull(&mut self) {
        let Cable { pulled, to_board, .. } = self.cable.take().expect("a cable");
        pulled.store(true, Ordering::Relaxed);
        self.loose_end = Some(to_board.join().expect("a thread that has not panicked"));
        *self.to_host.lock().expect("a thread that has not panicked") = None;
    }

    /// Starts the board anew, as its reset pin does: processor and devices, and not its memory. What it has said so far
    /// is passed over.
    pub fn reset(&self) {
        let control = UnixStream::connect(self.folder.path().join(CONTROL)).expect("the emulator listens");
        control.set_read_timeout(Some(WAIT_MAX)).expect("a timeout");
        let mut lines = BufReader::new(&control).lines().map(|line| line.expect("a line"));
        for (command, answer) in
            [("qmp_capabilities", r#""return""#), ("system_reset", r#""event": "RESET""#)]
        {
            writeln!(&control, r#"{{"execute": "{command}"}}"#).expect("the emulator listens");
            assert!(lines.any(|line| line.contains(answer)), "{command}");
        }
        while self.said.try_recv().is_ok() {}
    }

    /// What it has said since the last look or reset.
    pub fn said_so_far(&self) -> Vec<BoardMessage> {
        self.said.try_iter().map(|(_, message)| message).collect()
    }

    /// The same, each with its place in the session and the board's time.
    pub fn numbered_so_far(&self) -> Vec<(Header, BoardMessage)> {
        self.said.try_iter().collect()
    }

    /// Whether a busy machine has spoilt the attempt whose command says `text`, to be asked once of each attempt.
    pub fn check_starved(&self, text: &[u8]) -> Result<(), Starved> {
        self.waits.check(&String::from_utf8_lossy(text))
    }

    /// Whether its cable is pulled.
    pub fn is_unplugged(&self) -> bool {
        self.cable.is_none()
    }

    /// `host-sim run` on its port.
    pub fn run(&self, arguments: &[&str]) -> Child {
        self.command("run", arguments)
    }

    /// A command of `host-sim` on its port.
    pub fn command(&self, command: &str, arguments: &[&str]) -> Child {
        let Cable { port: (name, _), .. } = self.cable.as_ref().expect("a cable");
        let child = host_sim()
            .args([command, "--port", name, "--baud", &BAUD.to_string()])
            .args(INSTRUMENTS)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("host-sim starts");
        self.waits.watch(child.id());
        child
    }

    /// The next message for which `take` has a value.
    pub fn hears<T>(&self, take: impl Fn(&BoardMessage) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            let (_, message) = self.said.recv_timeout(WAIT_MAX).expect("the board speaks");
            if let Some(value) = take(&message) {
                return value;
            }
            assert!(begun.elapsed() < WAIT_MAX, "the board says other things");
        }
    }

    /// Waits until the drive is on, while `run` runs.
    pub fn drives(&self, run: &mut Child) -> Result<(), Starved> {
        self.says(run, |message| match message {
            BoardMessage::Report(report) => report.applied.mode.value().flatten().is_some(),
            _ => false,
        })
    }

    /// Waits until it says what `is_awaited`, while `run` runs.
    pub fn says(&self, run: &mut Child, is_awaited: impl Fn(BoardMessage) -> bool) -> Result<(), Starved> {
        let begun = Instant::now();
        while !self.said.try_iter().any(|(_, message)| is_awaited(message)) {
            if let Some(status) = run.try_wait().expect("a child") {
                let mut stderr = String::new();
                let pipe = run.stderr.as_mut().expect("a pipe");
                pipe.read_to_string(&mut stderr).expect("text");
                self.waits.check(&stderr)?;
                panic!("it does not say so: {status} {stderr}");
            }
            assert!(begun.elapsed() < WAIT_MAX, "it does not say so");
            sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    /// Whether it has reported an estimate within a degree of `degrees`.
    pub fn has_an_estimate_near(&self, degrees: f64) -> bool {
        self.said.try_iter().any(|(_, message)| match message {
            BoardMessage::Report(report) => report.estimate.is_some_and(|estimate| {
                (Angle::from_units(estimate.angle_units).degrees() - degrees).abs() < 1.0
            }),
            _ => false,
        })
    }
}

impl Drop for CabledBoard {
    fn drop(&mut self) {
        if let Some(cable) = &self.cable {
            cable.pulled.store(true, Ordering::Relaxed);
        }
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

/// Carries bytes until the cable is pulled; then the board's end.
fn carry_to_board(
    mut from_host: File,
    mut to_qemu: ChildStdin,
    pulled: &AtomicBool,
    mut wire: Wire,
) -> ChildStdin {
    let mut block = [0; 64];
    while !pulled.load(Ordering::Relaxed) {
        let Ok(length) = from_host.read(&mut block) else { break };
        wire.carry(&mut block[..length]);
        if to_qemu.write_all(&block[..length]).and_then(|()| to_qemu.flush()).is_err() {
            break;
        }
    }
    to_qemu
}

fn carry_from_board(
    mut from_qemu: ChildStdout,
    to_host: &Mutex<Option<HostEnd>>,
    hear: &Sender<(Header, BoardMessage)>,
) {
    let (mut deframer, mut block) = (Deframer::default(), [0; 64]);
    while let Ok(length @ 1..) = from_qemu.read(&mut block) {
        // What the board says is heard before the line disturbs it.
        for &byte in &block[..length] {
            if let Some(Ok(numbered)) = deframer.push(byte).map(decode::<BoardMessage>) {
                let _ = hear.send(numbered);
            }
        }
        if let Some(HostEnd { terminal, wire }) =
            to_host.lock().expect("a thread that has not panicked").as_mut()
        {
            wire.carry(&mut block[..length]);
            let _ = terminal.write_all(&block[..length]);
        }
    }
}
