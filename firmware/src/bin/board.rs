//! The whole program on the emulated board: timer, serial line, watchdog. `tests/qemu` speaks to it over the emulator's serial line.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this runs on the microcontroller: firmware/qemu.sh ELF");
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
    use firmware::board::mps2::{CLOCK_HZ, Enable, Uart, Watchdog, Width};
    use firmware::board::{end, stack_bytes_max};
    use firmware::tasks::{BYTES_PER_TICK_MAX, Fast, NoConverter, Shared};

    type FastTask = Fast<'static, Width, Enable, NoConverter>;

    /// Where the fast task waits for the first interrupt, which takes it.
    static HANDOVER: Mutex<Cell<Option<FastTask>>> = Mutex::new(Cell::new(None));

    /// A hundred ticks, twice: a slow task that hangs that long is not coming back.
    const WATCHDOG_MICROS: u32 = 1000;

    /// 10 us.
    const CLOCKS_PER_TICK: u32 = CLOCK_HZ / 100_000;

    fn start(mut timer: SYST) {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CLOCKS_PER_TICK - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
    }

    #[entry]
    fn main() -> ! {
        let started = Peripherals::take().zip(singleton!(: Shared = Shared::new()));
        let Some((peripherals, shared)) = started else { end(Err(())) };
        let Ok((fast, slow)) = shared.tasks(Width, Enable, NoConverter) else { end(Err(())) };
        let mut slow = slow.with_stack_gauge(stack_bytes_max);
        free(|token| HANDOVER.borrow(token).set(Some(fast)));
        let mut line = Uart::start();
        let mut watchdog = Watchdog::start(WATCHDOG_MICROS);
        start(peripherals.SYST);
        loop {
            let mut bytes = heapless::Vec::<u8, BYTES_PER_TICK_MAX>::new();
            while !bytes.is_full() {
                let Some(byte) = line.read() else { break };
                // There is room.
                let _ = bytes.push(byte);
            }
            slow.receive(&bytes, &mut |frame| line.write(frame));
            if slow.work(&mut |frame| line.write(frame)) {
                watchdog.feed();
            } else {
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
