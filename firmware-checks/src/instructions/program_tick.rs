//! A tick of the whole program of a board: the timer's interrupt, and passes of the main loop until it waits.
//!
//! ```text
//! the twin as the motor --> samples of a converter --> TimerTask::interrupt      --> drive
//!                       \-> frames on the line     --> MainLoop: passes, counted --> reports on the line
//! ```
//!
//! The instruments are those of [`crate::parity::LoopRun`]. The line carries two bytes in a tick either way, as at
//! 2,000,000 baud, and takes 128 bytes at once. Not counted: the hardware's entry to the interrupt and return from it,
//! the registers of the converter, the pulses and the line, and entries of a debugger's log.
//!
//! The loop has the longest latency: it keeps decisions that do not act yet, and estimates for an instant ahead of all
//! samples. The latency that it needs on a processor is how far it is behind there at most.

use core::cell::Cell;
use core::convert::Infallible;
use core::hint::black_box;

use controller::{LATENCY_TICKS_MAX, LoopTiming, PositionLoop, Sense};
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use estimator::CameraFrame;
use firmware::amplifier::Cutoff;
use firmware::main_loop::{MainLoop, SerialLine};
use firmware::tasks::{Converter, SAMPLES_PER_TICK, TaskMemory, TimerTask};
use heapless::Deque;
use link::{
    CameraRecord, Configuration, FRAME_BYTES_MAX, FilterKind, Header, HostMessage, MoveLimitsRecord, encode,
    encode_camera,
};
use motor_model::{Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionCounter, InstructionTimer};
use crate::parity::{SAMPLE_NANOS, TARGETS_DEG, TICKS_PER_TARGET, TOLERANCE_DEG, TwinInstruments};

/// Bytes that the line carries in a tick, either way.
const BYTES_PER_TICK: usize = 2;
/// Bytes that the line takes at once.
const SENT_BYTES: usize = 128;
/// Bytes that wait to be received: more than a frame of a message.
const RECEIVED_BYTES: usize = 2 * FRAME_BYTES_MAX;
/// Words of the emulated board's stack.
const STACK_WORDS: usize = 8960;
/// The session of the host.
const SESSION: u32 = 1;

/// Work that waits for a processor of a given speed.
struct Backlog {
    /// Instructions that the program has in a tick.
    per_tick: u32,
    instructions: u32,
}

impl Backlog {
    /// Ticks, begun ones included, after which the work of this tick is done, that of earlier ones before it.
    fn latency_ticks(&mut self, work: u32) -> u32 {
        let all = self.instructions.saturating_add(work);
        self.instructions = all.saturating_sub(self.per_tick);
        all.div_ceil(self.per_tick).max(1)
    }
}

/// Instructions that a program has in a tick: those of 150, 170 and 480 MHz at one a cycle; and more, for a processor
/// that does more than one a cycle.
const PER_TICK: [u32; 4] = [1500, 1700, 4800, 8000];

/// Names of a filter's operations.
struct Names {
    tick: &'static str,
    /// The latency for each of [`PER_TICK`].
    latencies: [&'static str; 4],
}

macro_rules! names {
    ($tick:literal) => {
        Names {
            tick: $tick,
            latencies: [
                concat!($tick, "_latency_at_1500"),
                concat!($tick, "_latency_at_1700"),
                concat!($tick, "_latency_at_4800"),
                concat!($tick, "_latency_at_8000"),
            ],
        }
    };
}

/// The filters, from how many ticks they decide in one, and the names of their counts.
const KINDS: [(FilterKind, u8, Names); 6] = [
    (FilterKind::ConstantRate, 1, names!("program_tick")),
    (FilterKind::ConstantRate, 8, names!("program_tick_every_8")),
    (FilterKind::ImpactAided, 1, names!("program_tick_impact_aided")),
    (FilterKind::ImpactAided, 8, names!("program_tick_impact_aided_every_8")),
    (FilterKind::Twin, 1, names!("program_tick_twin")),
    (FilterKind::Twin, 8, names!("program_tick_twin_every_8")),
];

/// The longest latency, and a decision in one of so many ticks.
fn timing(decision_ticks: u8) -> LoopTiming {
    LoopTiming { latency_ticks: u8::try_from(LATENCY_TICKS_MAX).unwrap_or(u8::MAX), decision_ticks }
}

/// A pin or a pulse width that nothing hangs on.
struct Unconnected;

impl digital::ErrorType for Unconnected {
    type Error = Infallible;
}

impl OutputPin for Unconnected {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl pwm::ErrorType for Unconnected {
    type Error = Infallible;
}

impl SetDutyCycle for Unconnected {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        black_box(duty);
        Ok(())
    }
}

impl Cutoff for Unconnected {
    fn is_cut(&self) -> bool {
        false
    }

    fn reconnect(&mut self) {}
}

/// A vibrometer whose next samples are known.
struct Samples<'a>(&'a Cell<[Option<f32>; SAMPLES_PER_TICK]>);

impl Converter for Samples<'_> {
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        self.0.get()
    }
}

/// A line of [`BYTES_PER_TICK`], and the host at its other end.
struct HostLine {
    /// What the host has sent, and how much of it has arrived.
    sent: Deque<u8, RECEIVED_BYTES>,
    arrived: usize,
    /// Bytes of the board that are on their way.
    busy: usize,
    sequence: u32,
}

impl HostLine {
    fn new() -> Self {
        Self { sent: Deque::new(), arrived: 0, busy: 0, sequence: 0 }
    }

    /// A tick passes.
    fn carry(&mut self) {
        self.arrived = (self.arrived + BYTES_PER_TICK).min(self.sent.len());
        self.busy = self.busy.saturating_sub(BYTES_PER_TICK);
    }

    fn header(&mut self, ticks: u64) -> Header {
        let header = Header { session: SESSION, sequence: self.sequence, ticks };
        self.sequence += 1;
        header
    }

    fn send_bytes(&mut self, frame: &[u8; FRAME_BYTES_MAX], length: usize) {
        frame.iter().take(length).for_each(|&byte| {
            // A line that is full loses it, and the board counts a damaged frame.
            let _ = self.sent.push_back(byte);
        });
    }

    /// Sends a message, which arrives at once.
    fn tell(&mut self, message: &HostMessage) {
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode(self.header(0), message, &mut frame).unwrap_or_default();
        self.send_bytes(&frame, length);
        self.arrived = self.sent.len();
    }

    /// Sends a camera frame.
    fn show(&mut self, frame: CameraFrame, ticks: u64) {
        let record = CameraRecord::from(frame);
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode_camera(self.header(ticks), record, &mut frame).unwrap_or_default();
        self.send_bytes(&frame, length);
    }
}

impl SerialLine for HostLine {
    fn read(&mut self) -> Option<u8> {
        self.arrived = self.arrived.checked_sub(1)?;
        self.sent.pop_front()
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        if self.busy > 0 {
            return 0;
        }
        self.busy = bytes.len().min(SENT_BYTES);
        self.busy
    }
}

/// Passes until nothing is left to do, as the program of a board does.
#[inline(never)]
fn pass_until_idle(main_loop: &mut MainLoop<'_>, line: &mut HostLine) {
    loop {
        let received = main_loop.receive(line);
        if main_loop.run_tick(|word| black_box(word) < STACK_WORDS) {
            black_box(main_loop.task.telemetry(0));
        }
        // What is on its way is sent by the passes of later ticks.
        let all_sent = main_loop.send(line);
        if !received && (all_sent || line.busy > 0) && !main_loop.task.is_due() {
            return;
        }
    }
}

/// The program on a board, and what surrounds it.
struct Bench<'m> {
    timer_task: TimerTask<'m, Unconnected, Unconnected, Samples<'m>>,
    main_loop: MainLoop<'m>,
    velocities: &'m Cell<[Option<f32>; SAMPLES_PER_TICK]>,
    line: HostLine,
    motor: Motor<f32>,
    state: MotorState<f32>,
    instruments: TwinInstruments,
    ticks: u64,
}

impl Bench<'_> {
    /// Tells the board what it needs for a move to `target_deg`, and arms it.
    #[inline(never)]
    fn arm(&mut self, filter: FilterKind, decision_ticks: u8, target_deg: f64) {
        let deadline_nanos = 2 * TICKS_PER_TARGET * PositionLoop::TICK_NANOS;
        let (tolerance_deg, limits) = (TOLERANCE_DEG, MoveLimitsRecord::default());
        let configuration = Configuration { filter, target_deg, tolerance_deg, deadline_nanos, limits };
        let LoopTiming { latency_ticks, decision_ticks } = timing(decision_ticks);
        for message in [
            HostMessage::Hello,
            HostMessage::Stop,
            HostMessage::Timing { latency_ticks, decision_ticks },
            HostMessage::Configure(configuration),
            HostMessage::Arm,
        ] {
            self.line.tell(&message);
            while self.line.arrived > 0 {
                self.main_loop.receive(&mut self.line);
                self.main_loop.send(&mut self.line);
            }
        }
    }

    /// The motor moves for a tick, and its instruments show it.
    fn simulate(&mut self, counter: &InstructionCounter<'_, impl InstructionTimer>) -> u32 {
        let (applied, of_interrupt) = counter.count(|| self.timer_task.interrupt());
        let mut at = Time::from_nanos(self.ticks * PositionLoop::TICK_NANOS);
        self.instruments.expose(&self.state, self.ticks, at);
        if let Some(frame) = self.instruments.camera_frame() {
            self.line.show(frame, self.ticks);
        }
        for _ in 0..SAMPLES_PER_TICK {
            self.motor.step(&mut self.state, applied);
            at = at.plus_nanos(SAMPLE_NANOS);
            self.instruments.sample_velocity(&self.state, at);
        }
        self.velocities
            .set([(); SAMPLES_PER_TICK].map(|()| self.instruments.ldv_sample().map(|s| s.velocity_m_s)));
        self.line.carry();
        self.ticks += 1;
        of_interrupt
    }

    /// A tick of the motor and of the program; the latter's instructions.
    fn tick(&mut self, counter: &InstructionCounter<'_, impl InstructionTimer>) -> u32 {
        let of_interrupt = self.simulate(counter);
        let Self { main_loop, line, .. } = self;
        let ((), of_passes) = counter.count(|| pass_until_idle(main_loop, line));
        of_interrupt + of_passes
    }

    /// Moves from where the rotor is; `took` gets the instructions of each tick.
    fn make_move(
        &mut self,
        counter: &InstructionCounter<'_, impl InstructionTimer>,
        (kind, decision_ticks): (FilterKind, u8),
        target_deg: f64,
        mut took: impl FnMut(u32),
    ) {
        self.arm(kind, decision_ticks, target_deg);
        for _ in 0..TICKS_PER_TARGET {
            took(self.tick(counter));
        }
    }

    /// Counts the moves from the motor's start, and how far the program is behind.
    fn count_moves(
        &mut self,
        counter: &InstructionCounter<'_, impl InstructionTimer>,
        kind: (FilterKind, u8),
        tick: &'static str,
        latencies: [&'static str; 4],
    ) -> (Count, [Count; 4]) {
        let (mut tick, mut latencies) = (Count::new(tick), latencies.map(Count::new));
        let mut backlogs = PER_TICK.map(|per_tick| Backlog { per_tick, instructions: 0 });
        self.replace_motor();
        for target_deg in TARGETS_DEG {
            self.make_move(counter, kind, target_deg, |of_tick| {
                tick.add(of_tick);
                for (backlog, latency) in backlogs.iter_mut().zip(&mut latencies) {
                    latency.add(backlog.latency_ticks(of_tick));
                }
            });
        }
        (tick, latencies)
    }

    /// The motor and its instruments are as at their start.
    fn replace_motor(&mut self) {
        self.state = MotorState::default();
        self.instruments = TwinInstruments::new(timing(1));
    }
}

/// Memory of the program.
pub type ProgramMemory = TaskMemory;

impl<'m> Bench<'m> {
    /// A board that has just started. Its first interrupt comes a tick after that.
    fn new(
        memory: &'m mut ProgramMemory,
        velocities: &'m Cell<[Option<f32>; SAMPLES_PER_TICK]>,
    ) -> Result<Self, OutOfBounds> {
        let (timer_task, loop_task) = memory.tasks(Unconnected, Unconnected, Samples(velocities))?;
        #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
        let setup = MotorSetup::with_step(SAMPLE_NANOS as f64 * 1e-9);
        Ok(Self {
            timer_task,
            main_loop: MainLoop::new(loop_task, STACK_WORDS),
            velocities,
            line: HostLine::new(),
            motor: Motor::try_new(&MotorParams::nominal(), &setup)?,
            state: MotorState::default(),
            instruments: TwinInstruments::new(timing(1)),
            ticks: 1,
        })
    }
}

// Never inlined: the stack that it takes is then not part of other counts'.
#[inline(never)]
pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut ProgramMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let velocities = Cell::new([None; SAMPLES_PER_TICK]);
    let mut bench = Bench::new(memory, &velocities)?;
    for (kind, decision_ticks, Names { tick, latencies }) in KINDS {
        let (tick, latencies) = bench.count_moves(counter, (kind, decision_ticks), tick, latencies);
        [tick].into_iter().chain(latencies).for_each(&mut *report);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use link::Counters;
    use motor_model::Angle;

    use super::*;
    use crate::parity::{PIXEL_UNITS, TICKS_PER_FRAME};

    /// A timer that stands still.
    struct Stopped;

    impl InstructionTimer for Stopped {
        fn ticks(&self) -> u32 {
            0
        }

        fn delay_loop(&self, _: u32) {}
    }

    /// The counted program does what a board does: the camera's frames arrive whole and in order, no tick is late, and
    /// a move ends as near to its target as the camera sees, which is two pixels of either mark.
    #[test]
    fn law_the_counted_program_moves_the_rotor() {
        let (timer, velocities) = (Stopped, Cell::new([None; SAMPLES_PER_TICK]));
        let counter = InstructionCounter::new(&timer);
        let mut memory = ProgramMemory::new();
        let mut bench = Bench::new(&mut memory, &velocities).unwrap();
        let mut expected = 0;
        for (kind, decision_ticks, _) in KINDS {
            bench.replace_motor();
            for target_deg in TARGETS_DEG {
                bench.make_move(&counter, (kind, decision_ticks), target_deg, |_| ());
                let off = bench.state.rotor.angle.angle().minus(Angle::from_degrees(target_deg)).units();
                assert!(off.abs() <= 2 * PIXEL_UNITS, "{kind:?}, {decision_ticks}, to {target_deg}: {off}");
                // Without the frame before the move, and the one that is on its way at its end.
                expected += TICKS_PER_TARGET / TICKS_PER_FRAME - 2;
            }
        }
        let Counters { taken, damaged, oversize, lost, late, duplicates, dropped, overruns, .. } =
            bench.main_loop.task.counters();
        assert_eq!([damaged, oversize, lost, late, duplicates, dropped, overruns], [0; 7]);
        assert!(u64::from(taken) >= expected, "{taken} of {expected}");
    }

    /// At 100 instructions a tick: 250 take two ticks and a half, and what is left of them makes the next ticks late.
    #[test]
    fn exact_work_waits_for_the_work_before_it() {
        let mut backlog = Backlog { per_tick: 100, instructions: 0 };
        let latencies = [50, 250, 0, 0, 100, 101, 99, 0].map(|work| backlog.latency_ticks(work));
        assert_eq!(latencies, [1, 3, 2, 1, 1, 2, 1, 1]);
    }
}
