//! The independent watchdog of real boards, with its window.
//!
//! | step | register of RM0440 and RM0433, chapter of the IWDG |
//! |---|---|
//! | it starts, and cannot be stopped | `IWDG_KR` |
//! | it counts 32 kHz over four, and over 256 while the flash works | `IWDG_PR` |
//! | a change acts once its flag is clear | `IWDG_SR`: `PVU`, `RVU`, `WVU` |
//! | fed above the window it restarts the board too; to write the window feeds | `IWDG_WINR` |

use super::hardware::{STORING_PERIODS, pac};
use super::wait::wait_until;

/// Periods of 32 kHz / 4 in 10 ms, longer than construction of a filter.
const PERIODS: u16 = 80;
/// The window that is always open.
const OPEN: u16 = 4095;

/// Interrupts of the timer from one feed to the next: 1 ms, and a quarter less where the loop makes up for all the
/// ticks that can wait. Ticks that were lost count too: a feed soon follows work of some ms in the main loop.
const TICKS_PER_FEED: u64 = 100;
/// From when on it may be fed: 0.5 ms after the last time, and less by the 6 % that its clock may be fast. Ticks that
/// come twice as fast as they should restart the board.
const WINDOW: u16 = PERIODS - 4;

/// How long the watchdog waits, in periods of its clock, and from when on it may be fed.
struct Wait {
    /// Whether a period is 8 ms, instead of 125 us.
    is_slow: bool,
    periods: u16,
    window: u16,
}

/// While ticks run.
const RUNNING: Wait = Wait { is_slow: false, periods: PERIODS, window: WINDOW };
/// While the flash works.
const STORING: Wait = Wait { is_slow: true, periods: STORING_PERIODS, window: OPEN };

/// Longest time until a change acts: at most six periods of the slower clock, 48 ms.
const CHANGE_MICROS: u32 = 100_000;

/// Restarts the board when it is not fed for 10 ms, or too often. It cannot be stopped.
#[derive(Debug)]
pub struct Watchdog {
    device: pac::IWDG,
    /// The interrupt at the last feed, as far as the loop has followed; `None` before the first.
    fed_at: Option<u64>,
}

impl Watchdog {
    pub(super) fn new(device: pac::IWDG) -> Self {
        Self { device, fed_at: None }
    }

    /// Starts it. From now on it must be fed.
    pub fn start(&mut self) {
        self.device.kr().write(|w| w.key().start());
        self.device.kr().write(|w| w.key().unlock());
        self.wait_for(&RUNNING);
    }

    /// To be called once a tick, with the number of the timer's interrupt that made it.
    #[inline]
    pub fn feed(&mut self, interrupt: u64) {
        let fed_at = *self.fed_at.get_or_insert(interrupt);
        if interrupt.saturating_sub(fed_at) >= TICKS_PER_FEED {
            self.fed_at = Some(interrupt);
            self.device.kr().write(|w| w.key().feed());
        }
    }

    /// Does `work` of the store, for which the watchdog waits longer: the flash may hold the processor.
    pub fn while_storing<T>(&mut self, work: impl FnOnce() -> T) -> T {
        self.wait_for(&STORING);
        let done = work();
        self.wait_for(&RUNNING);
        done
    }

    /// From now on it waits as `wait` says. Fed before its clock changes, it has at least 50 periods of either clock
    /// left then.
    fn wait_for(&mut self, wait: &Wait) {
        let device = &self.device;
        device.kr().write(|w| w.key().unlock());
        device.winr().write(|w| w.win().set(OPEN));
        let _ = wait_until(CHANGE_MICROS, || device.sr().read().wvu().bit_is_clear());
        device.kr().write(|w| w.key().feed());
        device.kr().write(|w| w.key().unlock());
        device.pr().write(|w| if wait.is_slow { w.pr().divide_by256() } else { w.pr().divide_by4() });
        let _ = wait_until(CHANGE_MICROS, || device.sr().read().pvu().bit_is_clear());
        device.rlr().write(|w| w.rl().set(wait.periods));
        let _ = wait_until(CHANGE_MICROS, || device.sr().read().rvu().bit_is_clear());
        device.kr().write(|w| w.key().feed());
        device.kr().write(|w| w.key().unlock());
        device.winr().write(|w| w.win().set(wait.window));
        let _ = wait_until(CHANGE_MICROS, || device.sr().read().wvu().bit_is_clear());
        self.fed_at = None;
    }
}
