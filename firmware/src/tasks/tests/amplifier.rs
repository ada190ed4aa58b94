//! An amplifier that fails, or is cut off by an over-current.

use super::*;

/// The amplifier fails under a jog: the bridge is off at once, and stays off until another. The self-test tells of it,
/// and of the converter's samples, of which one in four is out of its range here.
#[test]
fn law_an_amplifier_that_fails_under_a_jog_latches_and_a_self_test_tells_of_it() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&jog(1000));
    bench.run(10);
    assert!(bench.is_on());
    bench.pins.broken.set(true);
    bench.run(1);
    assert!(!bench.is_on());
    assert_eq!(bench.received, [BoardMessage::Fault(BoardFault::AmplifierFailed)]);
    bench.exchange(&HostMessage::Stop);
    bench.run(10);
    assert!(!bench.is_on());
    bench.received.clear();
    bench.timer_task.converter.beyond_range = true;
    assert!(bench.exchange(&HostMessage::SelfTest).is_empty());
    let ticks = SelfTestReport::TICKS as u32;
    bench.run(ticks + 1);
    let [BoardMessage::SelfTest(report)] = &bench.received[..] else { panic!("{:?}", bench.received) };
    assert!(!report.amplifier_works && report.has_converter, "{report:?}");
    assert_eq!((report.ticks, report.late_ticks, report.velocity.samples), (ticks, 0, ticks / 2 * 3));
    bench.pins.broken.set(false);
    assert_eq!(bench.exchange(&jog(10)), [BoardMessage::Jogging]);
    bench.run(2);
    assert!(bench.is_on(), "it is tried again");
}

/// Arms again after a stop, and measures until the bridge is on or a fault is told; the faults.
fn arm_anew(bench: &mut Bench) -> Vec<BoardMessage> {
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    bench.received.clear();
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    let is_fault = |message: &BoardMessage| matches!(message, BoardMessage::Fault(_));
    for _ in 0..5000 {
        bench.rest(bench.loop_task.last_interrupt + 1);
        if bench.is_on() || bench.received.iter().any(is_fault) {
            break;
        }
    }
    bench.received.iter().filter(|message| is_fault(message)).cloned().collect()
}

/// The amplifier fails under way: the bridge is off at once, the loop latches, and the host is told. Arming anew tries
/// it again: what has not ended latches again.
#[test]
fn law_a_failed_amplifier_latches_and_is_told() {
    let mut bench = Bench::driving();
    bench.pins.broken.set(true);
    bench.timer_task.interrupt();
    assert!(!bench.is_on());
    bench.run_tick();
    let failed = BoardMessage::Fault(BoardFault::AmplifierFailed);
    assert_eq!(bench.received, std::slice::from_ref(&failed));
    assert_eq!(bench.exchange(&HostMessage::Arm), std::slice::from_ref(&failed));
    assert_eq!(arm_anew(&mut bench), [failed]);
    bench.pins.broken.set(false);
    assert_eq!(arm_anew(&mut bench), []);
    assert!(bench.is_on());
}

/// The bridge is cut off for a moment. The loop task is two ticks behind: their reports of a bridge that works hide
/// nothing, and after arming anew those of one that does not latch nothing.
#[test]
fn law_a_bridge_that_was_cut_off_is_off_until_the_host_arms_anew() {
    let mut bench = Bench::driving();
    bench.timer_task.interrupt();
    bench.timer_task.interrupt();
    bench.pins.set_over_current(true);
    assert!(!bench.is_on(), "by the hardware");
    bench.timer_task.interrupt();
    bench.pins.set_over_current(false);
    (0..3).for_each(|_| assert!(bench.run_tick()));
    let failed = BoardMessage::Fault(BoardFault::AmplifierFailed);
    assert_eq!(bench.received.iter().filter(|&told| *told == failed).count(), 1, "{:?}", bench.received);
    bench.run(100);
    assert!(!bench.is_on() && bench.pins.is_cut(), "nobody has tried it again");
    for _ in 0..3 {
        bench.timer_task.interrupt();
    }
    assert_eq!(arm_anew(&mut bench), []);
    assert!(bench.is_on());
}

/// An over-current that comes while the drive is off, and stays, is told by the self-test and by the first tick of a
/// jog, under which the bridge is never on.
#[test]
fn law_an_over_current_that_stays_keeps_the_bridge_off() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.run(1);
    bench.pins.set_over_current(true);
    bench.exchange(&HostMessage::SelfTest);
    bench.run(SelfTestReport::TICKS as u32 + 1);
    let [BoardMessage::SelfTest(report)] = &bench.received[..] else { panic!("{:?}", bench.received) };
    assert!(!report.amplifier_works);
    bench.received.clear();
    assert_eq!(bench.exchange(&jog(10)), [BoardMessage::Jogging]);
    for _ in 0..10 {
        bench.run(1);
        assert!(!bench.is_on());
    }
    assert_eq!(bench.received, [BoardMessage::Fault(BoardFault::AmplifierFailed)]);
}
