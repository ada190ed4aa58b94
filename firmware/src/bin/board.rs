//! The whole program on a board: timer, serial line, vibrometer, watchdog, log. `tests/qemu` speaks to it over the emulator's serial line; with a real board's
//! feature it is that board's: `firmware/BRINGUP.md`.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this runs on the microcontroller: firmware/qemu.sh ELF, or firmware/BRINGUP.md");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod board {
    use core::cell::Cell;

    use cortex_m::interrupt::{Mutex, free};
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m::{Peripherals, singleton};
    use cortex_m_rt::{entry, exception};
    use firmware::board::hardware::{CLOCK_HZ, Enable, Parts, Vibrometer, Width};
    use firmware::board::{end, stack_bytes_max};
    use firmware::tasks::{BYTES_PER_TICK_MAX, Fast, Shared};
    use firmware::telemetry::{self, log};
    use heapless::Deque;
    use link::FRAME_BYTES_MAX;

    type FastTask = Fast<'static, Width, Enable, Vibrometer>;

    /// Where the fast task waits for the first interrupt, which takes it.
    static HANDOVER: Mutex<Cell<Option<FastTask>>> = Mutex::new(Cell::new(None));

    /// 10 us.
    const CLOCKS_PER_TICK: u32 = CLOCK_HZ / 100_000;

    /// Bytes that wait for the line: two frames of any length. What does not fit is lost, and the host sees the gap in the sequence.
    const OUTBOX_BYTES: usize = 2 * FRAME_BYTES_MAX;

    fn start(mut timer: SYST) {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CLOCKS_PER_TICK - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
    }

    /// Clocks since the timer, which counts down, stood at `before`; right within a tick, and what takes longer is counted as an overrun.
    fn clocks_since(before: u32) -> u32 {
        (before + CLOCKS_PER_TICK).wrapping_sub(SYST::get_current()) % CLOCKS_PER_TICK
    }

    /// A whole frame or nothing of it.
    fn post(outbox: &mut Deque<u8, OUTBOX_BYTES>, frame: &[u8]) {
        if outbox.capacity() - outbox.len() >= frame.len() {
            for &byte in frame {
                let _ = outbox.push_back(byte);
            }
        }
    }

    #[entry]
    fn main() -> ! {
        let started = Peripherals::take().zip(Parts::take());
        let (Some((core, parts)), Some(shared)) = (started, singleton!(: Shared = Shared::new())) else {
            end(Err(()))
        };
        let Parts { width, enable, mut line, vibrometer, mut watchdog } = parts;
        let Ok((fast, slow)) = shared.tasks(width, enable, vibrometer) else { end(Err(())) };
        let mut slow = slow.with_stack_gauge(stack_bytes_max);
        free(|token| HANDOVER.borrow(token).set(Some(fast)));
        let mut outbox = Deque::<u8, OUTBOX_BYTES>::new();
        let logs = telemetry::open();
        watchdog.start();
        start(core.SYST);
        loop {
            let mut bytes = heapless::Vec::<u8, BYTES_PER_TICK_MAX>::new();
            while !bytes.is_full() {
                let Some(byte) = line.read() else { break };
                // There is room.
                let _ = bytes.push(byte);
            }
            slow.receive(&bytes, &mut |frame| post(&mut outbox, frame));
            let before = SYST::get_current();
            let worked = slow.work(&mut |frame| post(&mut outbox, frame));
            if worked {
                watchdog.feed();
                let entry = slow.telemetry(clocks_since(before));
                if let Some((tick, entry)) = entry.filter(|_| logs) {
                    log(tick, &entry);
                }
            }
            while let Some(&byte) = outbox.front() {
                if !line.write(byte) {
                    break;
                }
                outbox.pop_front();
            }
            if !worked && outbox.is_empty() {
                cortex_m::asm::wfi();
            }
        }
    }

    #[exception]
    fn SysTick() {
        static mut FAST: Option<FastTask> = None;
        match FAST {
            Some(fast) => fast.interrupt(),
            None => *FAST = free(|token| HANDOVER.borrow(token).take()),
        }
    }
}
