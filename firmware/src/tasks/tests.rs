extern crate std;

use std::boxed::Box;
use std::vec::Vec;

use controller::ResponseMap;
use estimator::{Health, Source, Verdict};
use link::{
    BoardFault, BoardMessage, CHANGE_TICKS, CameraRecord, CommandRecord, EstimateRecord, FRAME_BYTES_MAX,
    Header, HostMessage, InnovationRecord, Jog, LINE_BAUD, MotorParameterRecord, PhaseRecord, REPORT_TICKS,
    REPORT_TICKS_MAX, RatePhase, RateRecord, SHORT_FRAME_BYTES, SelfTestReport, TickRecord, decode, encode,
    map_messages,
};
use motor_model::{DriveMode, Parameter};

use super::*;
use crate::store::Store;
use crate::store::emulated_flash::EmulatedFlash;
use crate::test_support::{MOVE, Pin, Pins, framed};

mod amplifier;
mod feeding;
mod line_budget;
mod lost_ticks;
#[cfg(feature = "commissioning")]
mod reports;
mod stuck_line;

/// The vibrometer of a rotor at rest. Neighbouring samples differ: equal ones would mean a vibrometer without signal.
#[derive(Default)]
struct RotorAtRest {
    samples: u32,
    /// Whether one sample in four is out of the converter's range.
    beyond_range: bool,
    /// Whether it is a rotor at rest no more.
    bounces: bool,
}

impl RotorAtRest {
    /// Sample `number` in m/s, from 1.
    fn velocity_m_s(number: u32, bounces: bool) -> f32 {
        let at_rest_m_s = if number.is_multiple_of(2) { -1e-5 } else { 1e-5 };
        if bounces { at_rest_m_s + lost_ticks::flight_m_s(number) } else { at_rest_m_s }
    }
}

impl Converter for RotorAtRest {
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        [(); SAMPLES_PER_TICK].map(|()| {
            self.samples += 1;
            let is_within = !(self.beyond_range && self.samples.is_multiple_of(4));
            is_within.then_some(Self::velocity_m_s(self.samples, self.bounces))
        })
    }
}

/// Both tasks, and the host.
struct Bench {
    pins: &'static Pins,
    timer_task: TimerTask<'static, Pin<'static>, Pin<'static>, RotorAtRest>,
    loop_task: LoopTask<'static>,
    sequence: u32,
    /// What the board has sent with its ticks.
    received: Vec<BoardMessage>,
}

impl Bench {
    /// A board that has just started with the bridge on.
    fn new() -> Self {
        let pins: &Pins = Box::leak(Box::default());
        pins.enabled.set(true);
        let memory = Box::leak(Box::new(TaskMemory::new()));
        let (timer_task, loop_task) = memory.tasks(Pin(pins), Pin(pins), RotorAtRest::default()).unwrap();
        assert!(!pins.enabled.get(), "off from the start");
        Self { pins, timer_task, loop_task, sequence: 0, received: Vec::new() }
    }

    /// Arms the loop, and measures a rotor at rest until the bridge is on.
    fn driving() -> Self {
        Self::driving_as_told(&[])
    }

    /// The same after a description of the bench.
    fn driving_as_told(description: &[HostMessage]) -> Self {
        let mut bench = Self::armed_as_told(description);
        for tick in 1..5000 {
            bench.rest(tick);
            if bench.is_on() {
                bench.received.clear();
                return bench;
            }
        }
        panic!("the loop does not drive");
    }

    /// Arms the loop after a description of the bench.
    fn armed_as_told(description: &[HostMessage]) -> Self {
        let mut bench = Self::new();
        let arm = [HostMessage::Configure(MOVE), HostMessage::Arm];
        for message in [HostMessage::Hello].iter().chain(description).chain(&arm) {
            let answers = bench.exchange(message);
            assert!(!matches!(answers[..], [BoardMessage::Fault(_)]) && answers.len() == 1, "{answers:?}");
        }
        bench
    }

    /// Interrupt and tick `tick` of a rotor at rest; every tenth has a frame of a dithered camera.
    fn rest(&mut self, tick: u64) {
        if tick.is_multiple_of(10) {
            let exposed_nanos = tick * PositionLoop::TICK_NANOS;
            let angle_units = 350_546 * i32::from(tick.is_multiple_of(20));
            let frame = CameraRecord { exposed_nanos, angle_units, marks_used: 0, residual: 0 };
            self.exchange(&HostMessage::Camera(frame));
        }
        self.timer_task.interrupt();
        assert!(self.run_tick() && !self.run_tick(), "one tick for one interrupt");
    }

    fn is_on(&self) -> bool {
        self.pins.enabled.get()
    }

    fn exchange(&mut self, message: &HostMessage) -> Vec<BoardMessage> {
        let header = Header { session: 1, sequence: self.sequence, ticks: 0 };
        self.sequence += 1;
        let mut answers = Vec::new();
        let frame = framed(header, message);
        self.loop_task.receive(&frame, &mut |frame| answers.push(decode(&mut frame.to_vec()).unwrap().1));
        answers
    }

    fn run_tick(&mut self) -> bool {
        let Self { loop_task, received, .. } = self;
        loop_task.run_tick(&mut |frame| received.push(decode(&mut frame.to_vec()).unwrap().1))
    }

    /// Interrupts, each with its tick.
    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.timer_task.interrupt();
            self.run_tick();
        }
    }
}

/// Jogs for `ticks` in mode C.
fn jog(ticks: u64) -> HostMessage {
    let command = DriveCommand::full(DriveMode::C).into();
    HostMessage::Jog(Jog { command, duration_nanos: ticks * PositionLoop::TICK_NANOS })
}

/// The bridge is on for as many interrupts as were asked for, from the one after the next tick on. Then the host is
/// told what the vibrometer saw, two samples a tick.
#[test]
fn exact_a_jog_has_the_bridge_on_for_its_ticks() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.run(10);
    // The main loop was busy in the meantime.
    for _ in 0..5 {
        bench.timer_task.interrupt();
    }
    assert_eq!(bench.exchange(&jog(50)), [BoardMessage::Jogging]);
    let mut on = Vec::new();
    for interrupt in 1..=100 {
        bench.timer_task.interrupt();
        on.extend(bench.is_on().then_some(interrupt));
        bench.run_tick();
    }
    assert!(on.iter().copied().eq(2..=51), "{on:?}");
    let [BoardMessage::Jogged(report)] = &bench.received[..] else { panic!("{:?}", bench.received) };
    assert_eq!((report.ticks, report.velocity.samples), (50, 100));
    assert_eq!(report.applied, DriveCommand::full(DriveMode::C).into());
    assert_eq!(bench.loop_task.application.counters().overruns, 0);
}

/// The samples of a tick are taken half a tick before its interrupt, and at it, as those of a simulated vibrometer of
/// 200 kHz. One that is missing leaves the other's instant as it is.
#[test]
fn exact_instants_of_the_samples() {
    let mut bench = Bench::new();
    let mut sampled = || {
        bench.timer_task.interrupt();
        let samples: Vec<_> = bench.loop_task.ticks.dequeue().unwrap().samples().collect();
        samples.iter().map(|sample| (sample.taken_at.nanos(), sample.velocity_m_s)).collect::<Vec<_>>()
    };
    assert_eq!(sampled(), [(5_000, 1e-5), (10_000, -1e-5)]);
    assert_eq!(sampled(), [(15_000, 1e-5), (20_000, -1e-5)]);
    bench.timer_task.converter.beyond_range = true;
    let mut instants = || {
        bench.timer_task.interrupt();
        let samples = bench.loop_task.ticks.dequeue().unwrap();
        samples.samples().map(|sample| sample.taken_at.nanos()).collect::<Vec<_>>()
    };
    assert_eq!((instants(), instants()), ([25_000, 30_000].into(), [35_000].into()));
}

/// A step of the host would make the board's time and the timer's differ.
#[test]
fn law_a_timed_board_takes_no_steps() {
    let mut bench = Bench::driving();
    let timed = BoardMessage::Fault(BoardFault::Timed);
    assert_eq!(bench.exchange(&HostMessage::Step), [timed]);
    bench.run(1);
    assert!(bench.is_on());
    assert_eq!(bench.loop_task.application.counters().overruns, 0);
}

/// A design, as the host describes it, with rows of Table 1 as its map.
fn described(design: &[(Parameter, f64)]) -> Vec<HostMessage> {
    let parameters = design.iter().map(|&(parameter, value)| {
        HostMessage::MotorParameter(MotorParameterRecord { index: parameter as u8, value })
    });
    parameters.chain(map_messages(ResponseMap::table_1())).collect()
}

/// Mode B of 12 kHz has 30 cycles in 250 samples, that of Table 1 has 15.75. The first and the last may be cut.
#[test]
fn exact_the_bridge_has_the_frequencies_of_the_design() {
    let modes = [(Parameter::ModeBFrequency, 12_000.0), (Parameter::ModeCFrequency, 14_000.0)];
    for (design, cycles) in [(&[][..], 15..=16), (&modes[..], 29..=30)] {
        let mut bench = Bench::driving_as_told(&described(design));
        bench.pins.widths.borrow_mut().clear();
        bench.run(250);
        let widths = bench.pins.widths.borrow();
        let rises = widths.windows(2).filter(|pair| pair[0] < 500 && pair[1] >= 500).count();
        assert!(cycles.contains(&rises), "{design:?}: {rises}");
    }
}

/// A mode of 30 kHz is too fast for samples at 100 kHz, which show the drive up to a quarter of that.
#[test]
fn law_a_design_that_the_waveform_cannot_drive_is_refused() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    for message in described(&[(Parameter::ModeBFrequency, 30_000.0)]) {
        assert_eq!(bench.exchange(&message), [BoardMessage::Described]);
    }
    let key = "waveform.sample_rate_hz".try_into().unwrap();
    let refused = BoardMessage::Fault(BoardFault::OutOfBounds { key });
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [refused]);
}

/// The loop task hangs for eight ticks and for fifty. Late ticks and lost ticks are overruns, and ten in a row switch
/// off.
#[test]
fn law_late_and_lost_ticks_are_overruns() {
    let mut bench = Bench::driving();
    for _ in 0..7 {
        bench.timer_task.interrupt();
    }
    while bench.run_tick() {}
    assert_eq!(bench.loop_task.application.counters().overruns, 6, "the last of seven is in time");
    bench.timer_task.interrupt();
    assert!(bench.is_on());
    for _ in 0..50 {
        bench.timer_task.interrupt();
    }
    while bench.run_tick() {}
    bench.run(1);
    bench.received.retain(|message| !matches!(message, BoardMessage::Report(_)));
    assert_eq!(bench.received, [BoardMessage::Fault(BoardFault::Overrun)]);
    bench.timer_task.interrupt();
    assert!(!bench.is_on());
}

/// With a latency the bridge follows the commands by the timer alone: the loop task that hangs, for one tick less than
/// the latency, and then catches up, gives the same waveform as one that is on time, to the last width, and no overrun.
/// One tick more is an overrun for each tick that is late.
#[test]
fn law_with_a_latency_a_loop_that_is_behind_drives_as_one_on_time() {
    const LATENCY: u32 = 12;
    let drive = |behind: u32| {
        let mut bench = Bench::driving_as_told(&[HostMessage::Timing {
            latency_ticks: LATENCY as u8,
            decision_ticks: 1,
        }]);
        bench.pins.widths.borrow_mut().clear();
        for _ in 0..20 {
            for _ in 0..=behind {
                bench.timer_task.interrupt();
            }
            while bench.run_tick() {}
        }
        // To the same number of ticks in all.
        bench.run(20 * LATENCY - 20 * behind);
        let overruns = bench.loop_task.application.counters().overruns;
        (bench.pins.widths.borrow().clone(), overruns)
    };
    let (on_time, _) = drive(0);
    let (behind, overruns) = drive(LATENCY - 1);
    assert_eq!(overruns, 0);
    assert!(behind == on_time && on_time.len() > 100, "{} {}", behind.len(), on_time.len());
    // The first tick of each thirteen is done when thirteen interrupts have been: one too late for its command.
    let (_, overruns) = drive(LATENCY);
    assert_eq!(overruns, 20);
}

/// A command acts in the interrupt that is the latency after that of its tick, without one in the next. A stop acts in
/// the next, and what was commanded before does not come after it.
#[test]
fn exact_a_command_acts_after_its_latency_and_a_stop_at_once() {
    for latency in [0, 1, 12, LATENCY_TICKS_MAX as u8] {
        let mut bench =
            Bench::armed_as_told(&[HostMessage::Timing { latency_ticks: latency, decision_ticks: 1 }]);
        let is_commanded = |bench: &Bench| bench.loop_task.application.amplifier().last.mode().is_some();
        let (mut tick, mut commanded) = (0, None);
        while !bench.is_on() {
            tick += 1;
            bench.rest(tick);
            commanded = commanded.or_else(|| is_commanded(&bench).then_some(tick));
        }
        assert_eq!(tick - commanded.unwrap(), u64::from(latency.max(1)));
        let mut stopped =
            Bench::armed_as_told(&[HostMessage::Timing { latency_ticks: latency, decision_ticks: 1 }]);
        for tick in 1..=commanded.unwrap() {
            stopped.rest(tick);
        }
        for bench in [&mut bench, &mut stopped] {
            assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
            for _ in 0..40 {
                bench.timer_task.interrupt();
                assert!(!bench.is_on(), "{latency}");
            }
        }
    }
}

/// Construction of a filter takes hundreds of ticks on a slow processor, and most are not yet counted when the host
/// arms. The time of the host's silence begins at arming.
#[test]
fn law_ticks_before_arming_are_no_silence() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::Configure(MOVE));
    for _ in 0..500 {
        bench.timer_task.interrupt();
    }
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    let silent = BoardMessage::Fault(BoardFault::HostSilent);
    let mut ticks = 0;
    while !bench.received.contains(&silent) {
        ticks += 1;
        assert!(ticks < 2000, "{:?}", bench.received);
        bench.run(1);
    }
    assert!((1000..=1002).contains(&ticks), "{ticks}");
}

#[test]
fn law_a_silent_host_takes_the_bridge_off() {
    let mut bench = Bench::driving();
    bench.run(1010);
    assert!(!bench.is_on());
    // A report every millisecond until then, and the fault once. The last frame is at most nine ticks older than the
    // drive, so 991 to 1,000 ticks are left.
    let silent = BoardMessage::Fault(BoardFault::HostSilent);
    let faults = bench.received.iter().filter(|received| **received == silent).count();
    let millis = bench.received.iter().filter_map(|received| match received {
        BoardMessage::Report(report) => report.estimate.map(|estimate| estimate.at_nanos / 1_000_000),
        _ => None,
    });
    let millis: Vec<u64> = millis.collect();
    assert!(faults == 1 && millis.len() == bench.received.len() - 1, "{:?}", bench.received);
    assert!(
        (9..=10).contains(&millis.len()) && millis.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "{millis:?}"
    );
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
}
