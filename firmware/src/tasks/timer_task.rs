//! The work of the timer's interrupt: samples of the vibrometer in, samples of the drive out.

use core::sync::atomic::{AtomicU32, Ordering};

use controller::PositionLoop;
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use estimator::LdvSample;
use heapless::spsc::{Consumer, Producer};
use motor_model::{DriveCommand, Time};

use super::SAMPLES_PER_TICK;
use super::command_port::TimedCommand;
use crate::amplifier::{Amplifier, Cutoff};
use crate::waveform::ModeIncrements;

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
    pub(super) interrupt: u64,
    pub(super) velocities_m_s: [Option<f32>; SAMPLES_PER_TICK],
    pub(super) amplifier_works: bool,
}

impl Tick {
    /// The samples that there are, oldest first. The last of a tick is taken at its interrupt.
    pub(super) fn samples(&self) -> impl Iterator<Item = LdvSample> {
        let begin_nanos = (self.interrupt - 1) * PositionLoop::TICK_NANOS;
        (1..).zip(self.velocities_m_s).filter_map(move |(number, velocity_m_s)| {
            let taken_at = Time::from_nanos(begin_nanos + number * NANOS_PER_SAMPLE);
            Some(LdvSample { taken_at, velocity_m_s: velocity_m_s? })
        })
    }
}

/// The work of the timer's interrupt.
pub struct TimerTask<'q, P, E, C> {
    pub(super) amplifier: Amplifier<P, E>,
    pub(super) converter: C,
    /// Interrupts so far.
    pub(super) interrupts: u64,
    pub(super) ticks: Producer<'q, Tick>,
    pub(super) commands: Consumer<'q, TimedCommand>,
    pub(super) designs: Consumer<'q, ModeIncrements>,
    pub(super) switched_off: &'q AtomicU32,
    pub(super) switched_off_seen: u32,
    pub(super) begun: &'q AtomicU32,
    pub(super) begun_seen: u32,
}

impl<P: SetDutyCycle + Cutoff, E: OutputPin, C: Converter> TimerTask<'_, P, E, C> {
    /// What has to happen every 10 us, on time. The samples come first: the instant of the last is that of the
    /// interrupt. The drive that is applied from now on.
    #[inline]
    pub fn interrupt(&mut self) -> DriveCommand {
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
        let applied = self.amplifier.sample();
        let tick =
            Tick { interrupt: self.interrupts, velocities_m_s, amplifier_works: self.amplifier.works() };
        // A full queue loses the tick: the loop task will find a gap in the numbers.
        let _ = self.ticks.enqueue(tick);
        applied
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
