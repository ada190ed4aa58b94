//! The amplifier of the loop task: a queue of commands to the timer task.

use core::sync::atomic::{AtomicU32, Ordering};

use controller::{Drive, LoopTiming};
use heapless::spsc::Producer;
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Parameter};

use super::TICKS_PER_S;
use crate::design::DesignedDrive;
use crate::waveform::ModeIncrements;

/// A command, and the interrupt that applies it, or the next one after that has passed. It never acts if the drive is
/// switched off before: `switched_off` is then another count than that of the memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedCommand {
    pub(super) command: DriveCommand,
    pub(super) interrupt: u64,
    pub(super) switched_off: u32,
}

/// The amplifier of the loop task: commands go into a queue, and take effect after the latency, at least at the next
/// interrupt.
pub struct CommandPort<'q> {
    pub(super) commands: Producer<'q, TimedCommand>,
    pub(super) designs: Producer<'q, ModeIncrements>,
    /// A design for which there was no room yet.
    pub(super) unsent: Option<ModeIncrements>,
    pub(super) last: DriveCommand,
    pub(super) works: bool,
    /// The interrupt of the tick that decides.
    pub(super) interrupt: u64,
    pub(super) timing: LoopTiming,
    /// Only this port writes it.
    pub(super) switched_off: &'q AtomicU32,
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
            let interrupt = self.interrupt + u64::from(self.timing.latency_ticks);
            let switched_off = self.switched_off.load(Ordering::Relaxed);
            if self.commands.enqueue(TimedCommand { command, interrupt, switched_off }).is_ok() {
                self.last = command;
            }
        }
        if self.works { self.last } else { DriveCommand::OFF }
    }

    fn timing(&self) -> LoopTiming {
        self.timing
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

    fn keep_time(&mut self, timing: LoopTiming) {
        self.timing = timing;
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
