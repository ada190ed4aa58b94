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
use crate::tasks::FeedPace;

/// Periods of 32 kHz / 4 in 10 ms, longer than construction of a filter.
const PERIODS: u16 = 80;
/// The window that is always open.
const OPEN: u16 = 4095;

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
    pace: FeedPace,
}

impl Watchdog {
    pub(super) fn new(device: pac::IWDG) -> Self {
        Self { device, pace: FeedPace::new() }
    }

    /// Starts it. From now on it must be fed.
    pub fn start(&mut self) {
        self.device.kr().write(|w| w.key().start());
        self.device.kr().write(|w| w.key().unlock());
        self.wait_for(&RUNNING);
    }

    /// To be called once a tick that the loop has run.
    #[inline]
    pub fn feed(&mut self) {
        if self.pace.is_due() {
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
        self.pace = FeedPace::new();
    }
}
