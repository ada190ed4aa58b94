//! The two tasks of a board, and the queues between them.
//!
//! ```text
//!  timer, every 10 us --> TimerTask: samples of the vibrometer, next sample of the drive
//!                          |  ^
//!                    Tick  |  | commands, ModeIncrements   each a queue of one producer and one consumer
//!                          v  |
//!  main loop ----------> LoopTask: frames of the host, estimate, decide, command, frames to the host
//! ```
//!
//! | task | runs | deadline | when it is missed |
//! |---|---|---|---|
//! | [`TimerTask`] | in the timer's interrupt, above everything | the next interrupt | the hardware drops it |
//! | [`LoopTask`] | in the main loop, for every [`Tick`] in the queue | when its command acts | counted as an overrun |
//!
//! Ten overruns in a row ([`crate::application::OVERRUNS_MAX`]) latch the drive off.
//!
//! # Latency
//!
//! The host tells how many ticks a command acts after the tick that decided it ([`controller::InFlight`]). Without a
//! latency it acts at the next interrupt, which is a tick after the loop has told its filter. With a latency of `n`
//! ticks the timer task applies the command of tick `k` in interrupt `k + n`, to which the loop has told it: the
//! deadline of tick `k` is that interrupt, and the loop task may be up to `n` ticks behind. A stop and a fault switch
//! the drive off at the next interrupt, and take back the commands that do not act yet.
//!
//! An amplifier that fails is off at the interrupt that finds it, and latches in the tick of that interrupt. It is
//! tried again when the host arms anew, or jogs: the timer task does it, before the first tick of the drive.
//!
//! # Priorities
//!
//! Two priorities need no framework: the interrupt never waits, and the tasks share only lock-free queues and a count.
//! When the queue of ticks is full, the new tick is lost, and counted as an overrun. When the loop task stops, the
//! watchdog is not fed, and it restarts the board with the drive off. The main loop serves the line: what a latency
//! lets it be busy for at once has to be less than the line holds, a kilobyte in 500 ticks on the STM32 boards.
//!
//! # Outside of the tasks
//!
//! The main loop keeps, restores and forgets the description of the bench ([`crate::store`]) when the host asks for it,
//! which it may while the loop is not armed. A flash holds the processor for up to a quarter of a second meanwhile, and
//! with it the timer: the board's time stands still. The watchdog waits longer for that time alone.
//!
//! Three counters count ticks of 10 us:
//!
//! | counter | counts | without |
//! |---|---|---|
//! | `TimerTask::interrupts` | interrupts of the timer | interrupts that the hardware dropped |
//! | `LoopTask::last_interrupt` | the value above that came with the last [`Tick`] | |
//! | `Application::elapsed_ticks` | the board's time, in the loop and on the link | |
//!
//! A gap in `last_interrupt` is ticks that the queue lost; the time advances by them too.

use core::mem;
use core::sync::atomic::{AtomicU32, Ordering};

use controller::{Drive, LATENCY_TICKS_MAX, PositionLoop};
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use embedded_storage_async::nor_flash::NorFlash;
use estimator::LdvSample;
use heapless::spsc::{Consumer, Producer, Queue};
use link::{BoardMessage, CommandRecord, ResetCause, SelfTestReport, TickRecord};
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Parameter, Time};

use crate::amplifier::{Amplifier, Cutoff};
use crate::application::{Application, MoveMemory};
use crate::design::DesignedDrive;
use crate::store::Store;
use crate::telemetry::Entry;
use crate::waveform::{ModeIncrements, Waveform};

/// Ticks of the loop in a second, and samples of the drive.
#[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
pub const TICKS_PER_S: f64 = 1e9 / PositionLoop::TICK_NANOS as f64;

/// Ticks from one report to the host to the next: a thousand reports a second. Between them are those of the ticks in
/// which a move or an experiment changes its drive, of which none is then unknown to the host. A rate changes it too
/// often for that.
const TICKS_PER_REPORT: u64 = 100;

/// Bytes that are received between two ticks at most, a megabyte a second, so that a flood cannot stop the loop.
pub const BYTES_PER_TICK_MAX: usize = 10;

/// Samples of the vibrometer in a tick, at even distances, as the simulated vibrometer has them unless a scene says
/// otherwise.
pub const SAMPLES_PER_TICK: usize = SelfTestReport::SAMPLES_PER_TICK as usize;

const NANOS_PER_SAMPLE: u64 = PositionLoop::TICK_NANOS / SAMPLES_PER_TICK as u64;

/// The analogue-to-digital converter of the vibrometer.
pub trait Converter {
    /// Whether there is one.
    const IS_INSTALLED: bool = true;

    /// The vertical velocities in the tick that ends now, in m/s: the first half a tick ago, the last now. Each is
    /// `None` without a converter, without a new sample, or out of its range.
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK];
}

/// A board without vibrometer: the samples come from the host.
#[derive(Clone, Copy, Debug)]
pub struct NoConverter;

impl Converter for NoConverter {
    const IS_INSTALLED: bool = false;

    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        [None; SAMPLES_PER_TICK]
    }
}

/// What the timer task passes to the loop task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Interrupts so far, this one included.
    interrupt: u64,
    velocities_m_s: [Option<f32>; SAMPLES_PER_TICK],
    amplifier_works: bool,
}

impl Tick {
    /// The samples that there are, oldest first. The last of a tick is taken at its interrupt.
    fn samples(&self) -> impl Iterator<Item = LdvSample> {
        let begin_nanos = (self.interrupt - 1) * PositionLoop::TICK_NANOS;
        (1..).zip(self.velocities_m_s).filter_map(move |(number, velocity_m_s)| {
            let taken_at = Time::from_nanos(begin_nanos + number * NANOS_PER_SAMPLE);
            Some(LdvSample { taken_at, velocity_m_s: velocity_m_s? })
        })
    }
}

/// A command, and the interrupt that applies it, or the next one after that has passed. It never acts if the drive is
/// switched off before: `switched_off` is then another count than that of the memory.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimedCommand {
    command: DriveCommand,
    interrupt: u64,
    switched_off: u32,
}

/// Length of the queues of ticks and commands: one place stays empty, and seven ticks more than the longest latency do
/// not get lost.
const QUEUE_LENGTH: usize = LATENCY_TICKS_MAX + 8;

/// Memory that outlives the tasks: the queues between them, and the configured move.
#[derive(Debug, Default)]
pub struct TaskMemory {
    ticks: Queue<Tick, QUEUE_LENGTH>,
    commands: Queue<TimedCommand, QUEUE_LENGTH>,
    /// Room for one.
    designs: Queue<ModeIncrements, 2>,
    /// How often the drive was switched off at once.
    switched_off: AtomicU32,
    /// How often the host has armed the loop, or begun to jog.
    begun: AtomicU32,
    configured: MoveMemory,
}

impl TaskMemory {
    /// Empty queues, and no move.
    pub const fn new() -> Self {
        Self {
            ticks: Queue::new(),
            commands: Queue::new(),
            designs: Queue::new(),
            switched_off: AtomicU32::new(0),
            begun: AtomicU32::new(0),
            configured: MoveMemory::new(),
        }
    }

    /// The tasks of a board with these pins. They drive the modes of Table 1 until the host describes others.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never, unless its bounds are changed.
    pub fn tasks<P: SetDutyCycle + Cutoff, E: OutputPin, C: Converter>(
        &mut self,
        width: P,
        enable: E,
        converter: C,
    ) -> Result<(TimerTask<'_, P, E, C>, LoopTask<'_>), OutOfBounds> {
        let params = MotorParams::nominal();
        let modes = CommandPort::design(&params)?;
        let (tick_producer, tick_consumer) = self.ticks.split();
        let (command_producer, command_consumer) = self.commands.split();
        let (design_producer, design_consumer) = self.designs.split();
        let timer_task = TimerTask {
            amplifier: Amplifier::new(Waveform::new(modes), width, enable),
            converter,
            interrupts: 0,
            ticks: tick_producer,
            commands: command_consumer,
            designs: design_consumer,
            switched_off: &self.switched_off,
            switched_off_seen: 0,
            begun: &self.begun,
            begun_seen: 0,
        };
        let port = CommandPort {
            commands: command_producer,
            designs: design_producer,
            unsent: None,
            last: DriveCommand::OFF,
            works: true,
            interrupt: 0,
            latency_ticks: 0,
            switched_off: &self.switched_off,
        };
        let mut application = Application::new(port, &mut self.configured).timed();
        application.record_converter(C::IS_INSTALLED);
        let loop_task = LoopTask {
            application,
            ticks: tick_consumer,
            last_interrupt: 0,
            reported_drive: DriveCommand::OFF.into(),
            begun: &self.begun,
            just_begun: false,
        };
        Ok((timer_task, loop_task))
    }
}

/// The work of the timer's interrupt.
pub struct TimerTask<'q, P, E, C> {
    amplifier: Amplifier<P, E>,
    converter: C,
    /// Interrupts so far.
    interrupts: u64,
    ticks: Producer<'q, Tick>,
    commands: Consumer<'q, TimedCommand>,
    designs: Consumer<'q, ModeIncrements>,
    switched_off: &'q AtomicU32,
    switched_off_seen: u32,
    begun: &'q AtomicU32,
    begun_seen: u32,
}

impl<P: SetDutyCycle + Cutoff, E: OutputPin, C: Converter> TimerTask<'_, P, E, C> {
    /// What has to happen every 10 us, on time. The samples come first: the instant of the last is that of the
    /// interrupt.
    #[inline]
    pub fn interrupt(&mut self) {
        let velocities_m_s = self.converter.velocities_m_s();
        while let Some(modes) = self.designs.dequeue() {
            self.amplifier.set_modes(modes);
        }
        self.interrupts += 1;
        let begun = self.begun.load(Ordering::Acquire);
        if begun != self.begun_seen {
            self.begun_seen = begun;
            self.amplifier.rearm();
        }
        self.take_commands();
        self.amplifier.sample();
        let tick =
            Tick { interrupt: self.interrupts, velocities_m_s, amplifier_works: self.amplifier.works() };
        // A full queue loses the tick: the loop task will find a gap in the numbers.
        let _ = self.ticks.enqueue(tick);
    }

    /// Applies the commands that act from now on, and drops those that never will.
    #[inline]
    fn take_commands(&mut self) {
        let switched_off = self.switched_off.load(Ordering::Acquire);
        if switched_off != self.switched_off_seen {
            self.switched_off_seen = switched_off;
            self.amplifier.command(DriveCommand::OFF);
        }
        let due =
            |next: &TimedCommand| next.interrupt <= self.interrupts || next.switched_off != switched_off;
        while self.commands.peek().is_some_and(due) {
            let next = self.commands.dequeue().filter(|next| next.switched_off == switched_off);
            if let Some(TimedCommand { command, .. }) = next {
                self.amplifier.command(command);
            }
        }
    }
}

/// The amplifier of the loop task: commands go into a queue, and take effect after the latency, at least at the next
/// interrupt.
struct CommandPort<'q> {
    commands: Producer<'q, TimedCommand>,
    designs: Producer<'q, ModeIncrements>,
    /// A design for which there was no room yet.
    unsent: Option<ModeIncrements>,
    last: DriveCommand,
    works: bool,
    /// The interrupt of the tick that decides.
    interrupt: u64,
    latency_ticks: usize,
    /// Only this port writes it.
    switched_off: &'q AtomicU32,
}

impl CommandPort<'_> {
    /// Sends a design that waits for room; whether none waits then.
    // Never inlined: every place that switches the drive would hold a copy.
    #[inline(never)]
    fn designs_are_sent(&mut self) -> bool {
        if let Some(modes) = self.unsent.take() {
            self.unsent = self.designs.enqueue(modes).err();
        }
        self.unsent.is_none()
    }
}

impl Drive for CommandPort<'_> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        // The drive stays off until the design that it is for has a place in the queue.
        let command = if self.designs_are_sent() { command } else { DriveCommand::OFF };
        // Only changes are sent. When the queue is full, the next tick tries again.
        if command != self.last {
            let interrupt = self.interrupt + self.latency_ticks as u64;
            let switched_off = self.switched_off.load(Ordering::Relaxed);
            if self.commands.enqueue(TimedCommand { command, interrupt, switched_off }).is_ok() {
                self.last = command;
            }
        }
        if self.works { self.last } else { DriveCommand::OFF }
    }

    fn latency_ticks(&self) -> usize {
        self.latency_ticks
    }
}

impl DesignedDrive for CommandPort<'_> {
    type Design = ModeIncrements;

    fn design(motor: &MotorParams) -> Result<ModeIncrements, OutOfBounds> {
        let (b_hz, c_hz) = (motor.get(Parameter::ModeBFrequency), motor.get(Parameter::ModeCFrequency));
        ModeIncrements::try_new(b_hz, c_hz, TICKS_PER_S)
    }

    fn follow(&mut self, modes: ModeIncrements) {
        self.unsent = self.designs.enqueue(modes).err();
    }

    fn act_after(&mut self, ticks: usize) {
        self.latency_ticks = ticks;
    }

    fn works(&self) -> bool {
        self.works
    }

    fn switch_off(&mut self) {
        self.designs_are_sent();
        let count = self.switched_off.load(Ordering::Relaxed);
        self.switched_off.store(count.wrapping_add(1), Ordering::Release);
        self.last = DriveCommand::OFF;
    }
}

/// The work of the main loop.
pub struct LoopTask<'q> {
    application: Application<'q, CommandPort<'q>>,
    ticks: Consumer<'q, Tick>,
    /// Number of the interrupt that made the last tick.
    last_interrupt: u64,
    /// The drive of the last report that was sent.
    reported_drive: CommandRecord,
    /// Only this task writes it.
    begun: &'q AtomicU32,
    /// Whether the drive may be on since the last tick, and was off before: the loop was armed, or jogged.
    just_begun: bool,
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

    /// Takes bytes from the host, at most [`BYTES_PER_TICK_MAX`] a tick.
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
        let report = self.application.tick();
        // The interrupt in which the command acts has not come.
        let latency_ticks = self.application.amplifier().latency_ticks();
        self.application.record_deadline(self.ticks.len() < latency_ticks.max(1));
        self.send_report(report, send);
        true
    }

    /// The log entry of the last tick, and its number. That tick took `clocks` of the timer.
    pub fn telemetry(&mut self, clocks: u32) -> Option<(u64, Entry)> {
        self.application.record_duration(clocks);
        self.application.telemetry()
    }

    /// Sends what the host does not know yet, and the reports that are due.
    fn send_report(&mut self, report: Option<TickRecord>, send: &mut impl FnMut(&[u8])) {
        if let Some(news) = self.application.take_news() {
            self.application.send(&news, send);
        }
        let is_due = |report: &TickRecord| {
            let changes = report.rate.is_none() && report.applied != self.reported_drive;
            changes || self.last_interrupt.is_multiple_of(TICKS_PER_REPORT)
        };
        if let Some(report) = report.filter(is_due) {
            self.reported_drive = report.applied;
            self.application.send(&BoardMessage::Report(report), send);
        }
    }
}

#[cfg(test)]
mod tests;
