//! The work of the main loop: ticks and bytes of the host in, commands and frames to the host out.

use core::mem;
use core::sync::atomic::{AtomicU32, Ordering};

use controller::Drive;
use embedded_storage_async::nor_flash::NorFlash;
use heapless::spsc::Consumer;
use link::{BoardMessage, Counters, ResetCause};

use super::command_port::CommandPort;
use super::timer_task::Tick;
use crate::application::Application;
use crate::store::Store;
use crate::telemetry::Entry;

/// The work of the main loop.
pub struct LoopTask<'q> {
    pub(super) application: Application<'q, CommandPort<'q>>,
    pub(super) ticks: Consumer<'q, Tick>,
    /// Number of the interrupt that made the last tick.
    pub(super) last_interrupt: u64,
    /// Only this task writes it.
    pub(super) begun: &'q AtomicU32,
    /// Whether the drive may be on since the last tick, and was off before: the loop was armed, or jogged.
    pub(super) just_begun: bool,
}

impl LoopTask<'_> {
    /// Keeps the most bytes that the stack has taken, for the host.
    pub fn record_stack(&mut self, bytes_max: u32) {
        self.application.record_stack(bytes_max);
    }

    /// Keeps how many bytes there are for the stack, for the host.
    pub fn record_stack_size(&mut self, bytes: u32) {
        self.application.record_stack_size(bytes);
    }

    /// Keeps why the board started, for the host.
    pub fn record_reset(&mut self, cause: ResetCause) {
        self.application.record_reset(cause);
    }

    /// [`Application::counters`].
    pub fn counters(&self) -> Counters {
        self.application.counters()
    }

    /// [`Application::restore`], before the timer starts.
    pub fn restore<F: NorFlash>(&mut self, store: &mut Store<F>) {
        self.application.restore(store);
    }

    /// Whether the host waits for something that the store does, which is not done within a tick.
    pub fn wants_store(&self) -> bool {
        self.application.wants_store()
    }

    /// [`Application::use_store`], outside of both tasks. The flash may hold the processor meanwhile.
    pub fn use_store<F: NorFlash>(&mut self, store: &mut Store<F>, send: &mut impl FnMut(&[u8])) {
        self.application.use_store(store, send);
    }

    /// Whether a tick waits.
    pub fn is_due(&self) -> bool {
        self.ticks.ready()
    }

    /// The number of the interrupt that made the last tick.
    pub fn last_interrupt(&self) -> u64 {
        self.last_interrupt
    }

    /// Takes bytes from the host, at most [`super::BYTES_PER_TICK_MAX`] a tick.
    pub fn receive(&mut self, bytes: &[u8], send: &mut impl FnMut(&[u8])) {
        let was_driving = self.application.is_driving();
        self.application.receive(bytes, send);
        if !was_driving && self.application.is_driving() {
            let count = self.begun.load(Ordering::Relaxed);
            self.begun.store(count.wrapping_add(1), Ordering::Release);
            // Ticks that were missed before, during construction of the filter, are no overruns of the move. Nor do
            // they tell of the amplifier that is tried again.
            while self.ticks.dequeue().is_some() {}
            self.just_begun = true;
        }
    }

    /// Runs one tick of the loop, if one is due; whether one was. The watchdog is fed only then.
    pub fn run_tick(&mut self, send: &mut impl FnMut(&[u8])) -> bool {
        let Some(tick) = self.ticks.dequeue() else { return false };
        let lost = tick.interrupt - self.last_interrupt - 1;
        self.last_interrupt = tick.interrupt;
        let amplifier = self.application.amplifier_mut();
        (amplifier.works, amplifier.interrupt) = (tick.amplifier_works, tick.interrupt);
        if !tick.amplifier_works {
            self.application.stop_for_amplifier();
        }
        if mem::take(&mut self.just_begun) {
            self.application.skip_ticks(lost);
        } else {
            self.application.record_lost_ticks(lost);
        }
        tick.samples().for_each(|sample| self.application.push_ldv_sample(sample));
        let report = self.application.tick_and_report(false);
        // The interrupt in which the command acts has not come.
        let latency_ticks = self.application.amplifier().timing().latency_ticks;
        self.application.record_deadline(self.ticks.len() < usize::from(latency_ticks.max(1)));
        if let Some(news) = self.application.take_news() {
            self.application.send(&news, send);
        }
        if let Some(report) = report {
            self.application.send(&BoardMessage::Report(report), send);
        }
        true
    }

    /// The log entry of the last tick, and its number. That tick took `clocks` of the timer.
    pub fn telemetry(&mut self, clocks: u32) -> Option<(u64, Entry)> {
        self.application.record_duration(clocks);
        self.application.telemetry()
    }
}
