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
    use firmware::board::hardware::{CLOCK_HZ, Enable, Line, Pulses, Vibrometer, Width};
    use firmware::board::{Parts, Stopwatch, crash, stack_word_is_unused, stack_words};
    use firmware::stack_gauge::{StackGauge, WORDS_PER_TICK};
    #[cfg(feature = "keep")]
    use firmware::store::Store;
    use firmware::tasks::{BYTES_PER_TICK_MAX, TaskMemory, TimerTask};
    use firmware::telemetry::{self, Entry, log, log_crash};
    use heapless::Deque;
    use link::FRAME_BYTES_MAX;

    type BoardTimerTask = TimerTask<'static, Width, Enable, Vibrometer>;

    /// Keeps the timer task until the first interrupt takes it.
    static FIRST_TIMER_TASK: Mutex<Cell<Option<BoardTimerTask>>> = Mutex::new(Cell::new(None));

    /// Clocks of the timer in a tick of 10 us.
    const CLOCKS_PER_TICK: u32 = CLOCK_HZ / 100_000;

    /// Bytes that wait for the line: two frames of any length. A frame that does not fit is lost; the host finds the
    /// gap in the sequence.
    const OUTGOING_BYTES: usize = 2 * FRAME_BYTES_MAX;

    fn start(mut timer: SYST, pulses: Pulses) {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CLOCKS_PER_TICK - 1);
        timer.clear_current();
        // Next to each other: pulses, samples and interrupts keep the distance that they have from here on.
        timer.enable_counter();
        pulses.start();
        timer.enable_interrupt();
    }

    /// Puts a whole frame in the queue, or nothing of it.
    fn enqueue(outgoing: &mut Deque<u8, OUTGOING_BYTES>, frame: &[u8]) {
        if outgoing.capacity() - outgoing.len() >= frame.len() {
            for &byte in frame {
                let _ = outgoing.push_back(byte);
            }
        }
    }

    /// Sends what waits, as far as the line has room.
    fn send(outgoing: &mut Deque<u8, OUTGOING_BYTES>, line: &mut Line) {
        loop {
            let sent = line.write(outgoing.as_slices().0);
            if sent == 0 {
                return;
            }
            for _ in 0..sent {
                outgoing.pop_front();
            }
        }
    }

    #[entry]
    fn main() -> ! {
        let started = Peripherals::take().zip(Parts::take());
        // The text is kept over the restart, and the host asks why the board started.
        let (mut core, parts) = started.expect("a clock, the supply or the converter does not start");
        let memory = singleton!(: TaskMemory = TaskMemory::new()).expect("the only one");
        let Parts { width, enable, pulses, mut line, vibrometer, mut watchdog, reset_cause, .. } = parts;
        // Not `expect`, which would print the error, with 30 kB of code for its numbers.
        let Ok((timer_task, mut loop_task)) = memory.tasks(width, enable, vibrometer) else {
            panic!("the nominal motor is out of its bounds")
        };
        let crash = crash::take();
        loop_task.record_reset(crash.as_ref().map_or(reset_cause, |crash| crash.kind.reset_cause()));
        #[cfg(feature = "keep")]
        let mut store = Store::new(parts.flash);
        #[cfg(feature = "keep")]
        loop_task.restore(&mut store);
        let mut stack = StackGauge::new(stack_words());
        loop_task.record_stack_size(u32::try_from(4 * stack_words()).unwrap_or(u32::MAX));
        free(|token| FIRST_TIMER_TASK.borrow(token).set(Some(timer_task)));
        let mut outgoing = Deque::<u8, OUTGOING_BYTES>::new();
        let logs = telemetry::open();
        let crash = crash.filter(|_| logs);
        if let Some(crash) = &crash {
            log_crash(crash);
        }
        Stopwatch::enable(&mut core.DCB, &mut core.DWT);
        watchdog.start();
        start(core.SYST, pulses);
        loop {
            let mut bytes = heapless::Vec::<u8, BYTES_PER_TICK_MAX>::new();
            while !bytes.is_full() {
                let Some(byte) = line.read() else { break };
                // Never full here.
                let _ = bytes.push(byte);
            }
            loop_task.receive(&bytes, &mut |frame| enqueue(&mut outgoing, frame));
            #[cfg(feature = "keep")]
            if loop_task.wants_store() {
                let send = &mut |frame: &[u8]| enqueue(&mut outgoing, frame);
                watchdog.while_storing(|| loop_task.use_store(&mut store, send));
            }
            let stopwatch = Stopwatch::start();
            let ran = loop_task.run_tick(&mut |frame| enqueue(&mut outgoing, frame));
            if ran {
                watchdog.feed(loop_task.last_interrupt());
                stack.look(WORDS_PER_TICK, stack_word_is_unused);
                loop_task.record_stack(stack.bytes_max());
                let entry = loop_task.telemetry(stopwatch.clocks());
                if let Some((tick, entry)) = entry.filter(|_| logs) {
                    log(tick, &entry);
                    // Again for a debugger that came later.
                    if let (Entry::Arming(_), Some(crash)) = (&entry, &crash) {
                        log_crash(crash);
                    }
                }
            }
            send(&mut outgoing, &mut line);
            if !ran && outgoing.is_empty() {
                // An interrupt between the look and the wait is held back and ends the wait.
                free(|_| {
                    if !loop_task.is_due() {
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
            Some(timer_task) => timer_task.interrupt(),
            None => *TIMER_TASK = free(|token| FIRST_TIMER_TASK.borrow(token).take()),
        }
    }
}
