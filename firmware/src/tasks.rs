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
use link::{BoardMessage, Report};
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

    fn tell(&mut self, report: Option<Report>, send: &mut impl FnMut(&[u8])) {
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
mod tests {
    extern crate std;

    use core::cell::Cell;
    use core::convert::Infallible;
    use std::vec::Vec;

    use embedded_hal::{digital, pwm};
    use link::{
        CameraRecord, Configuration, FRAME_BYTES_MAX, Fault, FilterKind, Header, HostMessage, decode, encode,
    };

    use super::*;

    /// A bridge: whether it is on.
    struct Bridge<'a>(&'a Cell<bool>);

    impl pwm::ErrorType for Bridge<'_> {
        type Error = Infallible;
    }

    impl digital::ErrorType for Bridge<'_> {
        type Error = Infallible;
    }

    impl SetDutyCycle for Bridge<'_> {
        fn max_duty_cycle(&self) -> u16 {
            1000
        }

        fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> {
            Ok(())
        }
    }

    impl OutputPin for Bridge<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.set(false);
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.set(true);
            Ok(())
        }
    }

    /// A rotor at rest, as a vibrometer at the board hears it.
    /// A quiet vibrometer whose neighbouring samples differ, or it would count as dead.
    #[derive(Default)]
    struct Quiet(bool);

    impl Converter for Quiet {
        fn velocity_m_s(&mut self) -> Option<f32> {
            self.0 = !self.0;
            Some(if self.0 { 1e-5 } else { -1e-5 })
        }
    }

    fn says(slow: &mut Slow<'_>, sequence: &mut u32, message: &HostMessage) -> Vec<BoardMessage> {
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session: 1, sequence: *sequence, ticks: 0 };
        *sequence += 1;
        let length = encode(header, message, &mut frame).unwrap();
        let mut answers = Vec::new();
        slow.receive(&frame[..length], &mut |frame| answers.push(decode(&mut frame.to_vec()).unwrap().1));
        answers
    }

    /// Arms, and shows a rotor at rest until the bridge is on.
    fn drive(
        fast: &mut Fast<'_, Bridge<'_>, Bridge<'_>, Quiet>,
        slow: &mut Slow<'_>,
        on: &Cell<bool>,
    ) -> u32 {
        let configuration = Configuration {
            filter: FilterKind::ConstantRate,
            target_deg: 90.0,
            tolerance_deg: 0.02,
            deadline_nanos: 30_000_000_000,
        };
        let mut sequence = 0;
        for message in [HostMessage::Hello, HostMessage::Configure(configuration), HostMessage::Arm] {
            assert_eq!(says(slow, &mut sequence, &message).len(), 1);
        }
        for tick in 1..5000 {
            if tick % 10 == 0 {
                let exposed_nanos = tick * PositionLoop::TICK_NANOS;
                let frame = CameraRecord { exposed_nanos, angle_units: 350_546 * i32::from(tick % 20 == 0) };
                says(slow, &mut sequence, &HostMessage::Camera(frame));
            }
            fast.interrupt();
            assert!(slow.work(&mut |_| ()) && !slow.work(&mut |_| ()), "one tick for one interrupt");
            if on.get() {
                return sequence;
            }
        }
        panic!("the loop does not drive");
    }

    /// A command takes effect at the next interrupt, and the twin turns under it.
    #[test]
    fn law_commands_reach_bridge_and_twin() {
        let on = Cell::new(true);
        let mut shared = Shared::new();
        let (mut fast, mut slow) = shared.tasks(Bridge(&on), Bridge(&on), Quiet::default()).unwrap();
        assert!(!on.get(), "off from the start");
        drive(&mut fast, &mut slow, &on);
        for _ in 0..300 {
            fast.interrupt();
            slow.work(&mut |_| ());
        }
        assert!(on.get() && slow.twin_rate_rad_s() > 0.5, "{}", slow.twin_rate_rad_s());
    }

    /// Steps with pressed teeth are long, and at rest tell nothing.
    #[test]
    fn law_a_twin_at_rest_takes_no_steps() {
        let on = Cell::new(false);
        let mut shared = Shared::new();
        let (mut fast, mut slow) = shared.tasks(Bridge(&on), Bridge(&on), Quiet::default()).unwrap();
        fast.state.rotor.rate_rad_s = 5.0;
        let mut steps = 0;
        for _ in 0..1000 {
            steps = fast.state.steps;
            fast.interrupt();
            slow.work(&mut |_| ());
        }
        assert!((1..500).contains(&steps) && fast.state.steps == steps, "{steps}");
        assert!(slow.twin_rate_rad_s().abs() < f32::EPSILON, "{}", slow.twin_rate_rad_s());
    }

    /// The slow task hangs for eight ticks and for fifty: late ticks and lost ones are overruns, and ten in a row switch off.
    #[test]
    fn law_late_and_lost_ticks_are_overruns() {
        let on = Cell::new(true);
        let mut shared = Shared::new();
        let (mut fast, mut slow) = shared.tasks(Bridge(&on), Bridge(&on), Quiet::default()).unwrap();
        drive(&mut fast, &mut slow, &on);
        (0..7).for_each(|_| fast.interrupt());
        while slow.work(&mut |_| ()) {}
        assert_eq!(slow.application.counters().overruns, 6, "the last of seven is in time");
        fast.interrupt();
        assert!(on.get());
        (0..50).for_each(|_| fast.interrupt());
        let mut said = Vec::new();
        while slow.work(&mut |frame| said.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1)) {}
        fast.interrupt();
        slow.work(&mut |frame| said.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
        said.retain(|message| !matches!(message, BoardMessage::Report(_)));
        assert_eq!(said, [BoardMessage::Fault(Fault::Overrun)]);
        fast.interrupt();
        assert!(!on.get());
    }

    /// Building a filter takes hundreds of ticks on a slow processor, most of them not yet counted when the host arms: its silence begins then, not before.
    #[test]
    fn law_ticks_before_arming_are_no_silence() {
        let on = Cell::new(true);
        let mut shared = Shared::new();
        let (mut fast, mut slow) = shared.tasks(Bridge(&on), Bridge(&on), Quiet::default()).unwrap();
        let configuration = Configuration {
            filter: FilterKind::ConstantRate,
            target_deg: 90.0,
            tolerance_deg: 0.02,
            deadline_nanos: 30_000_000_000,
        };
        says(&mut slow, &mut 0, &HostMessage::Hello);
        says(&mut slow, &mut 1, &HostMessage::Configure(configuration));
        (0..500).for_each(|_| fast.interrupt());
        assert_eq!(says(&mut slow, &mut 2, &HostMessage::Arm), [BoardMessage::Armed]);
        let mut ticks = 0;
        let is_silent = |said: &BoardMessage| *said == BoardMessage::Fault(Fault::HostSilent);
        let mut said = Vec::new();
        while !said.iter().any(is_silent) {
            ticks += 1;
            assert!(ticks < 2000, "{said:?}");
            fast.interrupt();
            slow.work(&mut |frame| said.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
        }
        assert!((1000..=1002).contains(&ticks), "{ticks}");
    }

    #[test]
    fn law_a_silent_host_takes_the_bridge_off() {
        let on = Cell::new(true);
        let mut shared = Shared::new();
        let (mut fast, mut slow) = shared.tasks(Bridge(&on), Bridge(&on), Quiet::default()).unwrap();
        let mut sequence = drive(&mut fast, &mut slow, &on);
        let mut said = Vec::new();
        for _ in 0..1010 {
            fast.interrupt();
            slow.work(&mut |frame| said.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
        }
        assert!(!on.get());
        // A report every millisecond until then, and the fault once.
        let faults =
            said.iter().filter(|said| matches!(said, BoardMessage::Fault(Fault::HostSilent))).count();
        assert!(faults == 1 && (10..=11).contains(&(said.len() - 1)), "{said:?}");
        says(&mut slow, &mut sequence, &HostMessage::Stop);
        assert_eq!(says(&mut slow, &mut sequence, &HostMessage::Arm), [BoardMessage::Armed]);
    }
}
