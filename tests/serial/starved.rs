//! Attempts that a busy machine has spoilt, and no others, are made again.
//!
//! The emulated line takes a byte whenever the emulator's other thread wakes, and the emulated processor comes after
//! all other threads of the machine. So a busy machine can cause what [`SIGNS`] says. Linux tells for how long threads
//! were ready to run and had no processor. An attempt is made again only where those of the emulator have waited for as
//! long as its sign takes. Otherwise the board, the line or the host has failed, and the test does.
//!
//! On a machine that is often busy this lets a defect pass that shows by a sign now and then. So attempts in which the
//! emulator had a processor for most of the time are made again [`SHARED_MAX`] times by all tests together. A defect
//! that spoils one attempt in two spoils about as many as there are attempts, some twenty: of twenty-four, four or
//! fewer are spoilt once in a thousand times. Where the emulator had no processor for most of the time its attempts
//! tell nothing, and a test makes [`ATTEMPTS_MAX`].

use std::cell::Cell;
use std::fs::{read_dir, read_to_string};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// What the command says of a board that missed its host, or of a host that missed its board, and how long the threads
/// of the emulator have to have waited for a processor at least.
///
/// A board that is armed misses its host after 10 ms of its time, which is never faster than that of the host, and a
/// frame is old for a self-test after as long. The other times are half of the command's: a board that had a processor
/// for the other half of it has had the time to answer.
const SIGNS: [(&str, Duration); 6] = [
    ("the host was silent", Duration::from_millis(10)),
    (" ms old; hint: ", Duration::from_millis(10)),
    ("took no byte", Duration::from_millis(100)),
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
    /// Whether the emulator had no processor for most of the time.
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
                "more than {SHARED_MAX} attempts of an emulator with a processor were spoilt: a defect"
            ),
        }
    }
    panic!("a machine that is too busy for the emulator");
}

/// How long an emulator has waited for a processor.
pub struct WaitOfEmulator {
    /// Its process.
    id: u32,
    /// At the last look, and when that was.
    before: Cell<(Duration, Instant)>,
}

impl WaitOfEmulator {
    /// Of the process `id`.
    pub fn new(id: u32) -> Self {
        Self { id, before: Cell::new((Duration::ZERO, Instant::now())) }
    }

    /// Whether the machine has spoilt the attempt whose command says `text`, in the time since the last look.
    ///
    /// # Panics
    /// When it says a sign, and the emulator had a processor.
    pub fn check(&self, text: &str) -> Result<(), Starved> {
        let (total, now) = (self.total(), Instant::now());
        let (before, looked_at) = self.before.replace((total, now));
        let (waited, passed) = (total.saturating_sub(before), now - looked_at);
        let Some((_, least)) = SIGNS.iter().find(|(sign, _)| text.contains(sign)) else { return Ok(()) };
        let last = text.lines().last().unwrap_or_default();
        assert!(
            waited >= *least,
            "the emulator waited for a processor for {waited:?} alone, and {least:?} are needed for this: {last}"
        );
        // For whoever reads why a test was slow or failed.
        println!("starved, the emulator waited for {waited:?} of {passed:?}: {last}");
        Err(Starved { mostly: 2 * waited > passed })
    }

    /// The time in which its threads were ready to run and had no processor, since they began.
    fn total(&self) -> Duration {
        let threads = read_dir(format!("/proc/{}/task", self.id)).expect("the emulator runs");
        let waited = threads.flatten().filter_map(|thread| {
            // Time on a processor and time of waiting for one in ns, and how often it had one.
            let times = read_to_string(thread.path().join("schedstat")).ok()?;
            times.split_whitespace().nth(1)?.parse::<u64>().ok()
        });
        Duration::from_nanos(waited.sum::<u64>())
    }
}

/// A sign is no excuse where the emulator has not waited. Nothing is left of the wait of this process, which is no
/// emulator, where an hour of it was before.
#[test]
fn exact_a_sign_is_no_excuse_on_an_idle_machine() {
    let wait = WaitOfEmulator::new(std::process::id());
    assert!(wait.check("error: the response map is refused").is_ok());
    for (sign, _) in SIGNS {
        wait.before.set((Duration::from_secs(3600), Instant::now()));
        let check = std::panic::AssertUnwindSafe(|| wait.check(&format!("error: {sign} for 1 s")));
        assert!(std::panic::catch_unwind(check).is_err(), "{sign}");
    }
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
