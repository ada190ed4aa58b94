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
//! which it may while the loop is not armed. A flash may hold the processor for up to a tenth of a second meanwhile,
//! and with it the timer: the board's time stands still. Otherwise the main loop waits for up to some seconds, and the
//! ticks of that time are lost. The watchdog waits longer for that time alone.
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

mod command_port;
mod feed_pace;
mod loop_task;
mod timer_task;

use core::sync::atomic::AtomicU32;

use controller::{LATENCY_TICKS_MAX, LoopTiming, PositionLoop};
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use heapless::spsc::Queue;
use link::SelfTestReport;
use motor_model::{DriveCommand, MotorParams, OutOfBounds};

use crate::amplifier::{Amplifier, Cutoff};
use crate::application::{Application, MoveMemory};
use crate::design::DesignedDrive;
use crate::waveform::{ModeIncrements, Waveform};
use command_port::{CommandPort, TimedCommand};
pub use feed_pace::FeedPace;
pub use loop_task::LoopTask;
pub use timer_task::{Converter, NoConverter, Tick, TimerTask};

/// Ticks of the loop in a second, and samples of the drive.
#[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
pub const TICKS_PER_S: f64 = 1e9 / PositionLoop::TICK_NANOS as f64;

/// Bytes that are received between two ticks at most, a megabyte a second, so that a flood cannot stop the loop.
pub const BYTES_PER_TICK_MAX: usize = 10;

/// Samples of the vibrometer in a tick, at even distances, as the simulated vibrometer has them unless a scene says
/// otherwise.
pub const SAMPLES_PER_TICK: usize = SelfTestReport::SAMPLES_PER_TICK as usize;

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
            timing: LoopTiming::default(),
            switched_off: &self.switched_off,
        };
        let mut application = Application::new(port, &mut self.configured).timed();
        application.record_converter(C::IS_INSTALLED);
        let loop_task = LoopTask {
            application,
            ticks: tick_consumer,
            last_interrupt: 0,
            begun: &self.begun,
            just_begun: false,
        };
        Ok((timer_task, loop_task))
    }
}

#[cfg(test)]
mod tests;
