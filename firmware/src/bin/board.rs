//! The whole program on a board: timer, serial line, vibrometer, watchdog, log, and the kept description.
//!
//! By default the board is the emulated one, and `tests/qemu` talks to it over the emulator's serial line. The feature
//! of a real board builds the program for that board: `firmware/BRINGUP.md`.

#![cfg_attr(target_os = "none", no_std, no_main)]

firmware::only_on_the_board!(
    "this runs on the microcontroller: firmware/qemu.sh ELF, or firmware/BRINGUP.md"
);

#[cfg(target_os = "none")]
mod board {
    use core::cell::Cell;

    use cortex_m::interrupt::{Mutex, free};
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m::{Peripherals, singleton};
    use cortex_m_rt::{entry, exception};
    #[cfg(not(feature = "silicon"))]
    use firmware::board::hardware::clocks_per_tick;
    use firmware::board::hardware::{Enable, Pulses, Vibrometer, Width};
    use firmware::board::{Parts, Stopwatch, crash, stack_word_is_unused, stack_words};
    use firmware::main_loop::MainLoop;
    #[cfg(feature = "keep")]
    use firmware::store::Store;
    use firmware::tasks::{TaskMemory, TimerTask};
    use firmware::telemetry::{self, Entry, log, log_crash};

    type BoardTimerTask = TimerTask<'static, Width, Enable, Vibrometer>;

    /// Keeps the timer task until the first interrupt takes it.
    static FIRST_TIMER_TASK: Mutex<Cell<Option<BoardTimerTask>>> = Mutex::new(Cell::new(None));

    /// Clocks of the timer in a tick of 10 us.
    #[cfg(feature = "silicon")]
    const fn clocks_per_tick() -> u32 {
        firmware::board::hardware::CLOCK_HZ / 100_000
    }

    fn start(mut timer: SYST, pulses: Pulses) {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(clocks_per_tick() - 1);
        timer.clear_current();
        // Next to each other: pulses, samples and interrupts keep the distance that they have from here on.
        timer.enable_counter();
        pulses.start();
        timer.enable_interrupt();
    }

    /// Makes both tasks. The timer task waits for the first interrupt.
    // Never inlined: the places that the tasks are moved through are then not on the stack of the loop.
    #[inline(never)]
    fn make_tasks(width: Width, enable: Enable, vibrometer: Vibrometer) -> MainLoop<'static> {
        let memory = singleton!(: TaskMemory = TaskMemory::new()).expect("the only one");
        // Not `expect`, which would print the error, with 30 kB of code for its numbers.
        let Ok((timer_task, loop_task)) = memory.tasks(width, enable, vibrometer) else {
            panic!("the nominal motor is out of its bounds")
        };
        free(|token| FIRST_TIMER_TASK.borrow(token).set(Some(timer_task)));
        MainLoop::new(loop_task, stack_words())
    }

    #[entry]
    fn main() -> ! {
        let started = Peripherals::take().zip(Parts::take());
        // The text is kept over the restart, and the host asks why the board started.
        let (mut core, parts) = started.expect("a clock, the supply or the converter does not start");
        let Parts { width, enable, pulses, mut line, vibrometer, mut watchdog, reset_cause, .. } = parts;
        let mut main_loop = make_tasks(width, enable, vibrometer);
        let crash = crash::take();
        main_loop.task.record_reset(crash.as_ref().map_or(reset_cause, |crash| crash.kind.reset_cause()));
        #[cfg(feature = "keep")]
        let mut store = Store::new(parts.flash);
        #[cfg(feature = "keep")]
        main_loop.task.restore(&mut store);
        let logs = telemetry::open();
        let crash = crash.filter(|_| logs);
        if let Some(crash) = &crash {
            log_crash(crash);
        }
        Stopwatch::enable(&mut core.DCB, &mut core.DWT);
        watchdog.start();
        start(core.SYST, pulses);
        loop {
            #[cfg(feature = "scripted")]
            line.loop_is_at(main_loop.task.last_interrupt());
            let received = main_loop.receive(&mut line);
            #[cfg(feature = "keep")]
            if main_loop.task.wants_store() {
                watchdog.while_storing(|| main_loop.use_store(&mut store));
            }
            let stopwatch = Stopwatch::start();
            if main_loop.run_tick(stack_word_is_unused) {
                watchdog.feed();
                let entry = main_loop.task.telemetry(stopwatch.clocks());
                if let Some((tick, entry)) = entry.filter(|_| logs) {
                    log(tick, &entry);
                    // Again for a debugger that came later.
                    if let (Entry::Arming(_), Some(crash)) = (&entry, &crash) {
                        log_crash(crash);
                    }
                }
            }
            let all_sent = main_loop.send(&mut line);
            if !received && all_sent {
                // An interrupt between the look and the wait is held back and ends the wait.
                free(|_| {
                    if !main_loop.task.is_due() {
                        cortex_m::asm::wfi();
                    }
                });
            }
        }
    }

    #[exception]
    fn SysTick() {
        static mut TIMER_TASK: Option<BoardTimerTask> = None;
        match TIMER_TASK {
            Some(timer_task) => {
                timer_task.interrupt();
            }
            None => *TIMER_TASK = free(|token| FIRST_TIMER_TASK.borrow(token).take()),
        }
    }
}
