extern crate std;

use core::cell::Cell;
use core::convert::Infallible;
use std::vec::Vec;

use embedded_hal::{digital, pwm};
use link::{
    BoardFault, CameraRecord, Configuration, FRAME_BYTES_MAX, FilterKind, Header, HostMessage, decode, encode,
};

use super::*;

/// A bridge that shows whether it is on.
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

/// The vibrometer of a rotor at rest. Neighbouring samples differ: equal ones would mean a vibrometer without signal.
#[derive(Default)]
struct RotorAtRest(bool);

impl Converter for RotorAtRest {
    fn velocity_m_s(&mut self) -> Option<f32> {
        self.0 = !self.0;
        Some(if self.0 { 1e-5 } else { -1e-5 })
    }
}

fn exchange(loop_task: &mut LoopTask<'_>, sequence: &mut u32, message: &HostMessage) -> Vec<BoardMessage> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let header = Header { session: 1, sequence: *sequence, ticks: 0 };
    *sequence += 1;
    let length = encode(header, message, &mut frame).unwrap();
    let mut answers = Vec::new();
    loop_task.receive(&frame[..length], &mut |frame| answers.push(decode(&mut frame.to_vec()).unwrap().1));
    answers
}

/// Arms the loop, and measures a rotor at rest until the bridge is on; the next sequence number.
fn drive(
    timer_task: &mut TimerTask<'_, Bridge<'_>, Bridge<'_>, RotorAtRest>,
    loop_task: &mut LoopTask<'_>,
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
        assert_eq!(exchange(loop_task, &mut sequence, &message).len(), 1);
    }
    for tick in 1..5000 {
        if tick % 10 == 0 {
            let exposed_nanos = tick * PositionLoop::TICK_NANOS;
            let frame = CameraRecord { exposed_nanos, angle_units: 350_546 * i32::from(tick % 20 == 0) };
            exchange(loop_task, &mut sequence, &HostMessage::Camera(frame));
        }
        timer_task.interrupt();
        assert!(
            loop_task.run_tick(&mut |_| ()) && !loop_task.run_tick(&mut |_| ()),
            "one tick for one interrupt"
        );
        if on.get() {
            return sequence;
        }
    }
    panic!("the loop does not drive");
}

/// A command takes effect at the next interrupt, and the twin turns.
#[test]
fn law_commands_reach_bridge_and_twin() {
    let on = Cell::new(true);
    let mut memory = TaskMemory::new();
    let (mut timer_task, mut loop_task) =
        memory.tasks(Bridge(&on), Bridge(&on), RotorAtRest::default()).unwrap();
    assert!(!on.get(), "off from the start");
    drive(&mut timer_task, &mut loop_task, &on);
    for _ in 0..300 {
        timer_task.interrupt();
        loop_task.run_tick(&mut |_| ());
    }
    assert!(on.get() && loop_task.twin_rate_rad_s() > 0.5, "{}", loop_task.twin_rate_rad_s());
}

/// Steps with sustained contact take long, and are not needed at rest.
#[test]
fn law_a_twin_at_rest_takes_no_steps() {
    let on = Cell::new(false);
    let mut memory = TaskMemory::new();
    let (mut timer_task, mut loop_task) =
        memory.tasks(Bridge(&on), Bridge(&on), RotorAtRest::default()).unwrap();
    timer_task.state.rotor.rate_rad_s = 5.0;
    let mut steps = 0;
    for _ in 0..1000 {
        steps = timer_task.state.steps;
        timer_task.interrupt();
        loop_task.run_tick(&mut |_| ());
    }
    assert!((1..500).contains(&steps) && timer_task.state.steps == steps, "{steps}");
    assert!(loop_task.twin_rate_rad_s().abs() < f32::EPSILON, "{}", loop_task.twin_rate_rad_s());
}

/// The loop task hangs for eight ticks and for fifty. Late ticks and lost ticks are overruns, and ten in a row switch
/// off.
#[test]
fn law_late_and_lost_ticks_are_overruns() {
    let on = Cell::new(true);
    let mut memory = TaskMemory::new();
    let (mut timer_task, mut loop_task) =
        memory.tasks(Bridge(&on), Bridge(&on), RotorAtRest::default()).unwrap();
    drive(&mut timer_task, &mut loop_task, &on);
    (0..7).for_each(|_| timer_task.interrupt());
    while loop_task.run_tick(&mut |_| ()) {}
    assert_eq!(loop_task.application.counters().overruns, 6, "the last of seven is in time");
    timer_task.interrupt();
    assert!(on.get());
    (0..50).for_each(|_| timer_task.interrupt());
    let mut received = Vec::new();
    while loop_task
        .run_tick(&mut |frame| received.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1))
    {}
    timer_task.interrupt();
    loop_task.run_tick(&mut |frame| received.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
    received.retain(|message| !matches!(message, BoardMessage::Report(_)));
    assert_eq!(received, [BoardMessage::Fault(BoardFault::Overrun)]);
    timer_task.interrupt();
    assert!(!on.get());
}

/// Construction of a filter takes hundreds of ticks on a slow processor, and most are not yet counted when the host
/// arms. The time of the host's silence begins at arming.
#[test]
fn law_ticks_before_arming_are_no_silence() {
    let on = Cell::new(true);
    let mut memory = TaskMemory::new();
    let (mut timer_task, mut loop_task) =
        memory.tasks(Bridge(&on), Bridge(&on), RotorAtRest::default()).unwrap();
    let configuration = Configuration {
        filter: FilterKind::ConstantRate,
        target_deg: 90.0,
        tolerance_deg: 0.02,
        deadline_nanos: 30_000_000_000,
    };
    exchange(&mut loop_task, &mut 0, &HostMessage::Hello);
    exchange(&mut loop_task, &mut 1, &HostMessage::Configure(configuration));
    (0..500).for_each(|_| timer_task.interrupt());
    assert_eq!(exchange(&mut loop_task, &mut 2, &HostMessage::Arm), [BoardMessage::Armed]);
    let mut ticks = 0;
    let is_silent = |received: &BoardMessage| *received == BoardMessage::Fault(BoardFault::HostSilent);
    let mut received = Vec::new();
    while !received.iter().any(is_silent) {
        ticks += 1;
        assert!(ticks < 2000, "{received:?}");
        timer_task.interrupt();
        loop_task
            .run_tick(&mut |frame| received.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
    }
    assert!((1000..=1002).contains(&ticks), "{ticks}");
}

#[test]
fn law_a_silent_host_takes_the_bridge_off() {
    let on = Cell::new(true);
    let mut memory = TaskMemory::new();
    let (mut timer_task, mut loop_task) =
        memory.tasks(Bridge(&on), Bridge(&on), RotorAtRest::default()).unwrap();
    let mut sequence = drive(&mut timer_task, &mut loop_task, &on);
    let mut received = Vec::new();
    for _ in 0..1010 {
        timer_task.interrupt();
        loop_task
            .run_tick(&mut |frame| received.push(decode::<BoardMessage>(&mut frame.to_vec()).unwrap().1));
    }
    assert!(!on.get());
    // A report every millisecond until then, and the fault once.
    let faults = received
        .iter()
        .filter(|received| matches!(received, BoardMessage::Fault(BoardFault::HostSilent)))
        .count();
    assert!(faults == 1 && (10..=11).contains(&(received.len() - 1)), "{received:?}");
    exchange(&mut loop_task, &mut sequence, &HostMessage::Stop);
    assert_eq!(exchange(&mut loop_task, &mut sequence, &HostMessage::Arm), [BoardMessage::Armed]);
}
