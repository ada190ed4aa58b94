//! The watchdog of a real board, which is fed by the ticks that the loop runs.

use super::*;

/// A watchdog that restarts the board when it is fed before its window opens, or after its time.
struct WindowWatchdog {
    pace: FeedPace,
    fed_at: u64,
    feeds: u32,
}

impl WindowWatchdog {
    /// When the window opens, in interrupts of 10 us: 0.5 ms, of a clock that is slow by 6 %.
    const OPENS: u64 = 54;
    /// When the board is restarted: 10 ms, of a clock that is fast by 6 %.
    const RESTARTS: u64 = 943;

    /// Fed at interrupt `now`.
    fn fed(now: u64) -> Self {
        Self { pace: FeedPace::new(), fed_at: now, feeds: 0 }
    }

    /// After a tick that the loop has run. `now` is the last interrupt.
    fn tick(&mut self, now: u64) {
        if self.pace.is_due() {
            let since = now - self.fed_at;
            assert!((Self::OPENS..Self::RESTARTS).contains(&since), "fed after {since} interrupts");
            (self.fed_at, self.feeds) = (now, self.feeds + 1);
        }
    }
}

/// So many interrupts while the main loop does something else.
fn hold_up(bench: &mut Bench, interrupts: u64) {
    (0..interrupts).for_each(|_| {
        bench.timer_task.interrupt();
    });
}

/// Runs a loop that does at most `per_interrupt` ticks from one interrupt to the next, for 400 interrupts.
fn run(bench: &mut Bench, watchdog: &mut WindowWatchdog, per_interrupt: u32) {
    for _ in 0..400 {
        for _ in 0..per_interrupt {
            if bench.run_tick() {
                watchdog.tick(bench.timer_task.interrupts);
            }
        }
        bench.timer_task.interrupt();
    }
}

/// Work of up to 8 ms in the main loop, at any time since the last feed, and a loop that runs the ticks that waited one
/// by one, or all at once: every feed is in the window.
#[test]
fn law_whatever_holds_the_loop_up_the_watchdog_is_fed_in_its_window() {
    for (held_up, per_interrupt) in
        [0, 10, 23, 24, 50, 100, 130, 300, 800].into_iter().flat_map(|held_up| [(held_up, 2), (held_up, 30)])
    {
        let mut bench = Bench::new();
        let mut watchdog = WindowWatchdog::fed(0);
        for before in 0..100 {
            run(&mut bench, &mut watchdog, per_interrupt);
            for _ in 0..before {
                bench.timer_task.interrupt();
                assert!(bench.run_tick());
                watchdog.tick(bench.timer_task.interrupts);
            }
            hold_up(&mut bench, held_up);
        }
        assert!(watchdog.feeds >= 400, "{}", watchdog.feeds);
    }
}

/// The flash works for 50 ms, and the watchdog is fed at its end, when the oldest ticks of that time wait.
#[test]
fn law_after_the_store_the_watchdog_is_fed_in_its_window() {
    let mut flash: EmulatedFlash = EmulatedFlash::new();
    let mut store = Store::new(&mut flash);
    for per_interrupt in [2, 30] {
        let mut bench = Bench::new();
        bench.loop_task.restore(&mut store);
        bench.run(150);
        assert!(bench.exchange(&HostMessage::Hello).is_empty() && bench.loop_task.wants_store());
        bench.loop_task.use_store(&mut store, &mut |_| {});
        hold_up(&mut bench, 5000);
        let mut watchdog = WindowWatchdog::fed(bench.timer_task.interrupts);
        run(&mut bench, &mut watchdog, per_interrupt);
        assert!(watchdog.feeds >= 3, "{}", watchdog.feeds);
    }
}
