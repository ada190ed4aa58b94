//! The two tasks of a board, and the queues between them.
//!
//! ```text
//!  timer, every 10 us --> Fast: next sample of the drive, a step of the twin, a sample of the vibrometer
//!                          |  ^
//!                    Tick  |  | DriveCommand          each a queue of one producer and one consumer
//!                          v  |
//!  main loop ----------> Slow: frames of the host, estimate, decide, command, frames to the host
//! ```
//!
//! | task | runs | deadline | when it is missed |
//! |---|---|---|---|
//! | [`Fast`] | in the timer's interrupt, above everything | the next interrupt | the hardware drops it; the tick's number shows the gap, which counts as overruns |
//! | [`Slow`] | in the main loop, for every [`Tick`] in the queue | the next tick | counted as an overrun; [`crate::application::OVERRUNS_MAX`] in a row latch the drive off |
//!
//! Two priorities need no framework: the interrupt never waits, and what both share are two lock-free queues. When the queue of ticks is full, the slow task
//! has fallen behind by all of it: the tick is lost, and counted. When the slow task stops altogether, nobody feeds the watchdog, and the board starts anew with
//! the drive off.

use core::mem;

use controller::{Drive, PositionLoop};
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use estimator::LdvSample;
use heapless::spsc::{Consumer, Producer, Queue};
use link::{BoardMessage, TickRecord};
use motor_model::{DriveCommand, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Parameter, Time};

use crate::amplifier::Amplifier;
use crate::application::{Application, MoveMemory};
use crate::telemetry::Entry;
use crate::waveform::Waveform;

/// Ticks of the loop in a second; the drive has as many samples.
#[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
pub const TICKS_PER_S: f64 = 1e9 / PositionLoop::TICK_NANOS as f64;

/// Every so many ticks the host gets a report: a thousand a second.
const TICKS_PER_REPORT: u64 = 100;

/// Bytes taken in between two ticks, a megabyte a second: a flood cannot stop the loop.
pub const BYTES_PER_TICK_MAX: usize = 10;

/// The vibrometer's converter.
pub trait Converter {
    /// The vertical velocity now; `None` when there is none, or it is out of range.
    fn velocity_m_s(&mut self) -> Option<f32>;
}

/// No vibrometer at the board: its samples come from the host.
#[derive(Clone, Copy, Debug)]
pub struct NoConverter;

impl Converter for NoConverter {
    fn velocity_m_s(&mut self) -> Option<f32> {
        None
    }
}

/// What the fast task tells the slow one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Interrupts so far, this one included.
    number: u64,
    velocity_m_s: Option<f32>,
    amplifier_works: bool,
    /// The twin's rate in rad/s.
    twin_rate_rad_s: f32,
}

/// What must outlive the tasks: the queues between them, and the move.
#[derive(Debug, Default)]
pub struct Shared {
    ticks: Queue<Tick, 8>,
    commands: Queue<DriveCommand, 8>,
    configured: MoveMemory,
}

impl Shared {
    /// Empty.
    pub const fn new() -> Self {
        Self { ticks: Queue::new(), commands: Queue::new(), configured: MoveMemory::new() }
    }

    /// The tasks of a board with these pins.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never, unless its bounds are changed.
    pub fn tasks<P: SetDutyCycle, E: OutputPin, C: Converter>(
        &mut self,
        width: P,
        enable: E,
        converter: C,
    ) -> Result<(Fast<'_, P, E, C>, Slow<'_>), OutOfBounds> {
        let params = MotorParams::nominal();
        let (b_hz, c_hz) = (params.get(Parameter::ModeBFrequency), params.get(Parameter::ModeCFrequency));
        let waveform = Waveform::try_new(b_hz, c_hz, TICKS_PER_S)?;
        let twin = Motor::try_new(&params, &MotorSetup::with_step(1.0 / TICKS_PER_S))?;
        let (to_slow, from_fast) = self.ticks.split();
        let (to_fast, from_slow) = self.commands.split();
        let fast = Fast {
            amplifier: Amplifier::new(waveform, width, enable),
            converter,
            twin,
            state: MotorState::default(),
            number: 0,
            ticks: to_slow,
            commands: from_slow,
        };
        let port = Port { commands: to_fast, last: DriveCommand::OFF, works: true };
        let application = Application::new(port, &mut self.configured);
        let slow = Slow { application, ticks: from_fast, number: 0, twin_rate_rad_s: 0.0, just_armed: false };
        Ok((fast, slow))
    }
}

/// What the timer's interrupt does.
pub struct Fast<'q, P, E, C> {
    amplifier: Amplifier<P, E>,
    converter: C,
    twin: Motor<f32>,
    state: MotorState<f32>,
    number: u64,
    ticks: Producer<'q, Tick>,
    commands: Consumer<'q, DriveCommand>,
}

impl<P: SetDutyCycle, E: OutputPin, C: Converter> Fast<'_, P, E, C> {
    /// Everything that has to happen every 10 us.
    #[inline]
    pub fn interrupt(&mut self) {
        while let Some(command) = self.commands.dequeue() {
            self.amplifier.command(command);
        }
        let applied = self.amplifier.sample();
        self.step_twin(applied);
        self.number += 1;
        let tick = Tick {
            number: self.number,
            velocity_m_s: self.converter.velocity_m_s(),
            amplifier_works: self.amplifier.works(),
            twin_rate_rad_s: self.state.rotor.rate_rad_s,
        };
        // A full queue loses the tick: its number will be missed.
        let _ = self.ticks.enqueue(tick);
    }

    /// Takes the twin through a tick. A step with teeth pressed on the rotor takes as long as all else that a small processor does in one; without a drive it would tell only
    /// that the rotor lies still, so then there is none.
    #[inline]
    fn step_twin(&mut self, applied: DriveCommand) {
        if applied.mode().is_none() && self.state.pressed == [true; 2] {
            self.state.rotor.rate_rad_s = 0.0;
        } else {
            self.twin.step(&mut self.state, applied);
        }
    }
}

/// The amplifier as the slow task sees it: commands go into a queue, and take effect within 10 us.
struct Port<'q> {
    commands: Producer<'q, DriveCommand>,
    last: DriveCommand,
    works: bool,
}

impl Drive for Port<'_> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        // Only changes travel; one that finds no place is tried again next tick.
        if command != self.last && self.commands.enqueue(command).is_ok() {
            self.last = command;
        }
        if self.works { self.last } else { DriveCommand::OFF }
    }
}

/// What the main loop does.
pub struct Slow<'q> {
    application: Application<'q, Port<'q>>,
    ticks: Consumer<'q, Tick>,
    number: u64,
    twin_rate_rad_s: f32,
    /// Armed since the last tick.
    just_armed: bool,
}

impl Slow<'_> {
    /// The same, on a board that knows how many bytes its stack has taken at most.
    #[must_use]
    pub fn with_stack_gauge(self, stack_bytes_max: fn() -> u32) -> Self {
        Self { application: self.application.with_stack_gauge(stack_bytes_max), ..self }
    }

    /// Takes bytes from the host, at most [`BYTES_PER_TICK_MAX`] a tick.
    pub fn receive(&mut self, bytes: &[u8], send: &mut impl FnMut(&[u8])) {
        let was_armed = self.application.is_armed();
        self.application.receive(bytes, send);
        if !was_armed && self.application.is_armed() {
            // What was missed before, as while the filter was built, is no overrun of the move.
            while self.ticks.dequeue().is_some() {}
            self.just_armed = true;
        }
    }

    /// One tick of the loop, if one is due; whether it was, which feeds the watchdog.
    pub fn work(&mut self, send: &mut impl FnMut(&[u8])) -> bool {
        let Some(tick) = self.ticks.dequeue() else { return false };
        let lost = tick.number - self.number - 1;
        self.number = tick.number;
        self.twin_rate_rad_s = tick.twin_rate_rad_s;
        self.application.amplifier_mut().works = tick.amplifier_works;
        if mem::take(&mut self.just_armed) {
            self.application.idle_ticks(lost);
        } else {
            self.application.lost_ticks(lost);
        }
        if let Some(velocity_m_s) = tick.velocity_m_s {
            let taken_at = Time::from_nanos(tick.number * PositionLoop::TICK_NANOS);
            self.application.hear_vibrometer(LdvSample { taken_at, velocity_m_s });
        }
        let report = self.application.tick();
        self.application.ended(!self.ticks.ready());
        self.tell(report, send);
        true
    }

    /// What the last tick has to tell, and its number; it took `clocks` of the timer.
    pub fn telemetry(&mut self, clocks: u32) -> Option<(u64, Entry)> {
        self.application.worked(clocks);
        self.application.telemetry()
    }

    fn tell(&mut self, report: Option<TickRecord>, send: &mut impl FnMut(&[u8])) {
        if let Some(fault) = self.application.news() {
            self.application.say(&BoardMessage::Fault(fault), send);
        }
        if let Some(report) = report.filter(|_| self.number.is_multiple_of(TICKS_PER_REPORT)) {
            self.application.say(&BoardMessage::Report(report), send);
        }
    }

    /// The twin's rate in rad/s at the last tick.
    pub fn twin_rate_rad_s(&self) -> f32 {
        self.twin_rate_rad_s
    }
}

#[cfg(test)]
mod tests;
