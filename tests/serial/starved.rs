//! Attempts that a busy machine has spoilt, and no others, are made again.
//!
//! The emulated line takes a byte whenever the emulator's other thread wakes, and the emulated processor comes after
//! all other threads of the machine. So a busy machine can cause what [`SIGNS`] says, and so can one that leaves the
//! command without a processor. Linux tells for how long threads were ready to run and had none. An attempt is made
//! again only where those of the emulator, or those of the command, have waited for as long as its sign takes.
//! Otherwise the board, the line or the host has failed, and the test does.
//!
//! On a machine that is often busy this lets a defect pass that shows by a sign now and then. So attempts in which both
//! had a processor for most of the time are made again [`SHARED_MAX`] times by all tests together. A defect that spoils
//! one attempt in two spoils about as many as there are attempts, some twenty: of twenty-four, four or fewer are spoilt
//! once in a thousand times. Where one of them had no processor for most of the time its attempts tell nothing, and a
//! test makes [`ATTEMPTS_MAX`].

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{read_dir, read_to_string};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

use rustix::process::Pid;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use crate::cabled_board::WAIT_MAX;

/// What the command says of a board that missed its host, or of a host that missed its board, and how long the threads
/// of either have to have waited for a processor at least.
///
/// A board that is armed misses its host after 10 ms of its time, which is never faster than that of the host, and a
/// frame is old for a self-test after as long. As long without its processor, and the watchdog starts a board anew. The
/// other times are half of the command's: a board that had a processor for the other half of it has had the time to
/// answer.
const SIGNS: [(&str, Duration); 8] = [
    ("the host was silent", Duration::from_millis(10)),
    ("it has started anew", Duration::from_millis(10)),
    (" ms old; hint: ", Duration::from_millis(10)),
    ("took no byte", Duration::from_millis(100)),
    // Eight round trips of 17 ms and more before the run: the clock's error is more than a filter can be told.
    ("clock_error_s = ", Duration::from_millis(68)),
    ("the board was silent", Duration::from_millis(500)),
    ("no board answers", Duration::from_secs(1)),
    ("the board does not answer to", Duration::from_millis(1500)),
];

/// Attempts of a test.
const ATTEMPTS_MAX: u32 = 6;

/// Attempts that all tests together may make again, of those that had a processor for most of the time.
const SHARED_MAX: u32 = 4;

/// Those that were made again.
static SHARED: AtomicU32 = AtomicU32::new(0);

/// An attempt that a busy machine has spoilt.
#[derive(Debug)]
pub struct Starved {
    /// Whether emulator or command had no processor for most of the time.
    mostly: bool,
}

/// The first attempt that was not spoilt.
///
/// # Panics
/// When too many were.
pub fn not_starved<T>(attempt: impl FnMut() -> Result<T, Starved>) -> T {
    repeated(&SHARED, attempt)
}

fn repeated<T>(shared: &AtomicU32, mut attempt: impl FnMut() -> Result<T, Starved>) -> T {
    for _ in 0..ATTEMPTS_MAX {
        match attempt() {
            Ok(made) => return made,
            Err(Starved { mostly: true }) => {}
            Err(Starved { mostly: false }) => assert!(
                shared.fetch_add(1, Ordering::Relaxed) < SHARED_MAX,
                "more than {SHARED_MAX} attempts with a processor were spoilt: a defect"
            ),
        }
    }
    panic!("a machine that is too busy for emulator and command");
}

/// A wait for a processor, and the time of which it is a part.
#[derive(Clone, Copy, Debug, Default)]
struct Wait {
    waited: Duration,
    passed: Duration,
}

/// How long an emulator, and the command that talks to its board, have waited for a processor.
pub struct Waits {
    /// The emulator's process.
    emulator: u32,
    /// Its wait at the last look, and when that was.
    before: Cell<(Duration, Instant)>,
    /// The last command.
    command: RefCell<Option<Watched>>,
}

impl Waits {
    /// Of the emulator of the process `emulator`.
    pub fn new(emulator: u32) -> Self {
        let before = Cell::new((Duration::ZERO, Instant::now()));
        Self { emulator, before, command: RefCell::default() }
    }

    /// From now on the command is that of the process `id`, which has just begun.
    pub fn watch(&self, id: u32) {
        self.command.replace(Some(Watched::new(id)));
    }

    /// Whether the machine has spoilt the attempt whose command says `text`, in the time since the last look.
    ///
    /// # Panics
    /// When it says a sign, and emulator and command had a processor.
    pub fn check(&self, text: &str) -> Result<(), Starved> {
        let (total, now) = (total(self.emulator).expect("the emulator runs"), Instant::now());
        let (before, looked_at) = self.before.replace((total, now));
        let emulator = Wait { waited: total.saturating_sub(before), passed: now - looked_at };
        let command = self.command.borrow().as_ref().map(Watched::wait).unwrap_or_default();
        let Some((_, least)) = SIGNS.iter().find(|(sign, _)| text.contains(sign)) else { return Ok(()) };
        let told = text.lines().find(|line| SIGNS.iter().any(|(sign, _)| line.contains(sign)));
        let told = told.unwrap_or_default();
        let of_both = [("emulator", emulator), ("command", command)];
        assert!(
            of_both.iter().any(|(_, wait)| wait.waited >= *least),
            "emulator and command waited for a processor for {:?} and {:?} alone, and {least:?} are needed for this: \
             {told}",
            emulator.waited,
            command.waited
        );
        // For whoever reads why a test was slow or failed.
        for (name, Wait { waited, passed }) in of_both {
            println!("starved, the {name} waited for {waited:?} of {passed:?}: {told}");
        }
        let mostly = of_both.iter().any(|(_, wait)| 2 * wait.waited > wait.passed);
        Err(Starved { mostly })
    }
}

/// A process whose wait is looked at while it runs: nothing tells of it afterwards.
struct Watched {
    begun: Instant,
    waited: Arc<Mutex<Duration>>,
}

impl Watched {
    /// Time between two looks. The wait between the last of them and the end is not seen.
    const LOOK_EVERY: Duration = Duration::from_millis(2);

    fn new(id: u32) -> Self {
        let waited = Arc::new(Mutex::new(Duration::ZERO));
        let seen = Arc::clone(&waited);
        spawn(move || {
            // A thread that has ended has waited as long as it had at the last look.
            let mut of_threads = BTreeMap::new();
            while let Some(threads) = waits_of_threads(id) {
                of_threads.extend(threads);
                *seen.lock().expect("a thread that has not panicked") = of_threads.values().sum();
                sleep(Self::LOOK_EVERY);
            }
        });
        Self { begun: Instant::now(), waited }
    }

    fn wait(&self) -> Wait {
        let waited = *self.waited.lock().expect("a thread that has not panicked");
        Wait { waited, passed: self.begun.elapsed() }
    }
}

/// The time in which the threads of a process were ready to run and had no processor, since they began; `None` when it
/// has ended.
fn total(id: u32) -> Option<Duration> {
    waits_of_threads(id).map(|threads| threads.into_iter().map(|(_, waited)| waited).sum())
}

/// That time by the name of each thread's folder.
fn waits_of_threads(id: u32) -> Option<Vec<(OsString, Duration)>> {
    let threads = read_dir(format!("/proc/{id}/task")).ok()?;
    let wait = |thread: std::fs::DirEntry| {
        // Time on a processor and time of waiting for one in ns, and how often it had one.
        let times = read_to_string(thread.path().join("schedstat")).ok()?;
        let waited = times.split_whitespace().nth(1)?.parse().ok()?;
        Some((thread.file_name(), Duration::from_nanos(waited)))
    };
    Some(threads.flatten().filter_map(wait).collect())
}

/// A sign is no excuse where the emulator has not waited. Nothing is left of the wait of this process, which is no
/// emulator, where an hour of it was before.
#[test]
fn exact_a_sign_is_no_excuse_on_an_idle_machine() {
    let waits = Waits::new(std::process::id());
    assert!(waits.check("error: the response map is refused").is_ok());
    for (sign, _) in SIGNS {
        waits.before.set((Duration::from_secs(3600), Instant::now()));
        let check = std::panic::AssertUnwindSafe(|| waits.check(&format!("error: {sign} for 1 s")));
        assert!(std::panic::catch_unwind(check).is_err(), "{sign}");
    }
}

/// Two programs that compute without end.
struct Busy([Child; 2]);

impl Busy {
    /// Both on one processor, of which each has a half.
    fn on_one_processor() -> Self {
        let allowed = sched_getaffinity(None).expect("the processors of this thread");
        let first = (0..CpuSet::MAX_CPU).find(|&cpu| allowed.is_set(cpu)).expect("a processor");
        let mut one = CpuSet::new();
        one.set(first);
        Self([(); 2].map(|()| {
            let child = Command::new("sh").args(["-c", "while :; do :; done"]).spawn().expect("a shell");
            let id = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
            sched_setaffinity(id, &one).expect("a child of this process");
            child
        }))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.iter_mut().for_each(|child| {
            let _ = child.kill();
            let _ = child.wait();
        });
    }
}

/// A command that shares its processor has waited, also after its end: that excuses what the host has missed, though
/// the emulator has not waited. A command that has not waited excuses nothing.
#[test]
fn law_a_starved_command_is_an_excuse() {
    let mut busy = Busy::on_one_processor();
    let waits = Waits::new(std::process::id());
    waits.watch(busy.0[0].id());
    let waited = || waits.command.borrow().as_ref().expect("a command").wait().waited;
    let begun = Instant::now();
    while waited() < Duration::from_millis(50) {
        assert!(begun.elapsed() < WAIT_MAX, "two programs on one processor: {:?}", waited());
        sleep(Watched::LOOK_EVERY);
    }
    busy.0[0].kill().and_then(|()| busy.0[0].wait()).expect("a child");
    // The thread that looks at it has ended.
    let is_watched = || Arc::strong_count(&waits.command.borrow().as_ref().expect("a command").waited) > 1;
    while is_watched() {
        assert!(begun.elapsed() < WAIT_MAX, "nothing is left to look at");
        sleep(Watched::LOOK_EVERY);
    }
    // The process that stands for the emulator has other tests.
    let check = |text: &str| {
        waits.before.set((Duration::from_secs(3600), Instant::now()));
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| waits.check(text)))
    };
    let frame = "camera FAIL: a frame is 12 ms old; hint: the host is slow\nother verdicts";
    assert!(matches!(check(frame), Ok(Err(Starved { .. }))));
    waits.command.borrow_mut().as_mut().expect("a command").waited = Arc::default();
    assert!(check(frame).is_err(), "a command that has not waited");
}

/// A test makes six attempts where the emulator had no processor, and all of them together make four again where it
/// had one.
#[test]
fn exact_an_attempt_is_made_again_a_few_times() {
    let (shared, attempts) = (AtomicU32::new(0), AtomicU32::new(0));
    let made_after = |spoilt: u32, mostly| {
        attempts.store(0, Ordering::Relaxed);
        std::panic::catch_unwind(|| {
            repeated(&shared, || {
                let number = attempts.fetch_add(1, Ordering::Relaxed);
                if number < spoilt { Err(Starved { mostly }) } else { Ok(number) }
            })
        })
    };
    assert_eq!((made_after(5, true).ok(), made_after(6, true).ok()), (Some(5), None));
    assert_eq!((made_after(3, false).ok(), made_after(1, false).ok()), (Some(3), Some(1)));
    assert_eq!((made_after(0, false).ok(), made_after(1, false).ok()), (Some(0), None));
}
