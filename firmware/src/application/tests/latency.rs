//! Commands that act some ticks after they were decided, and decisions in one of some ticks.

use controller::{
    DECISION_TICKS_MAX, LATENCY_TICKS_MAX, Limits, LoopTiming, PositionLoop, PositioningTuning, ResponseMap,
    Target, tick,
};
use estimator::{ConstantRate, ConstantRateTuning, Instruments};
use motor_model::Angle;

use super::rate::{Measured, Measurements};
use super::*;

/// Latencies without and with decisions in every tick, in whole decisions and not.
const TIMINGS: [(u8, u8); 8] = [(0, 1), (1, 1), (13, 1), (16, 1), (0, 4), (12, 4), (13, 4), (16, 8)];

/// Every report of 3000 ticks is that of the controller's own loop with this timing, to the last bit, and the first
/// command acts so many ticks later than without.
#[test]
fn dual_a_board_with_a_timing_is_the_controllers_loop_with_it() {
    let mut first_drive = Vec::new();
    for (latency_ticks, decision_ticks) in TIMINGS {
        let timing = LoopTiming { latency_ticks, decision_ticks };
        let mut bench = Bench::new();
        bench.exchange(&HostMessage::Hello);
        let told = HostMessage::Timing { latency_ticks, decision_ticks };
        assert_eq!(bench.exchange(&told), [BoardMessage::Described]);
        assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
        assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
        let instruments = Instruments::default();
        let filter =
            ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&MotorParams::nominal(), &instruments));
        let limits = Limits { deadline_nanos: MOVE.deadline_nanos, ..Limits::default() };
        let tuning = PositioningTuning { limits, ..PositioningTuning::new(&instruments) };
        let target = Target::try_new(MOVE.target_deg, MOVE.tolerance_deg).unwrap();
        let mut own = PositionLoop::new(filter, ResponseMap::table_1(), target, tuning, Time::ZERO);
        let mut waiting = Measurements { timing, ..Measurements::default() };
        let mut first = None;
        for n in 1..=3000_u64 {
            let dither_deg = if n.is_multiple_of(20) { 0.03 } else { 0.0 };
            let measured = Measured::at(time(n - 1), n, Angle::from_degrees(dither_deg));
            waiting.add(&measured);
            bench.exchange(&HostMessage::Ldv(measured.sample.map(Into::into).into_iter().collect()));
            if let Some(frame) = measured.frame {
                bench.exchange(&HostMessage::Camera(frame.into()));
            }
            let theirs = bench.step().unwrap();
            let report = tick(&mut own, time(n), &mut waiting);
            assert_eq!(TickRecord::from(&report).difference(&theirs), None, "tick {n}, {timing:?}");
            // Estimate and command are of the tick that they are for.
            assert!(report.estimate.is_none_or(|estimate| estimate.at == time(n)), "{report:?}");
            first = first.or_else(|| report.applied.mode().map(|_| n));
        }
        first_drive.push(first.expect("it drives"));
    }
    // The rotor rests: the decision comes as soon as it lies still for long enough, at the time for which it is made,
    // and in the next tick that decides.
    let earliest = first_drive[0];
    for (&first, (latency, decision)) in first_drive.iter().zip(TIMINGS) {
        let latest = earliest + u64::from(latency) + u64::from(decision) - 1;
        assert!((earliest..=latest).contains(&first), "{first_drive:?}");
    }
}

/// A run that begins anew after a stop acts on none of the decisions that were made before it.
#[test]
fn law_no_decision_outlives_a_stop() {
    const LATENCY: u8 = 13;
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(
        bench.exchange(&HostMessage::Timing { latency_ticks: LATENCY, decision_ticks: 1 }),
        [BoardMessage::Described]
    );
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    for _ in 0..2 * LATENCY {
        bench.measure();
        let report = bench.step().unwrap();
        assert_eq!(report.applied.mode.value(), Some(None), "{report:?}");
    }
}

/// A timing out of its bounds is refused by name, and so is any while armed.
#[test]
fn law_a_timing_out_of_bounds_or_while_armed_is_refused() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    for (latency_ticks, decision_ticks, key) in [
        (LATENCY_TICKS_MAX as u8 + 1, 1, "board.latency_ticks"),
        (0, 0, "board.decision_ticks"),
        (0, DECISION_TICKS_MAX as u8 + 1, "board.decision_ticks"),
    ] {
        let key = key.try_into().unwrap();
        let wrong = HostMessage::Timing { latency_ticks, decision_ticks };
        assert_eq!(bench.exchange(&wrong), [BoardMessage::Fault(BoardFault::OutOfBounds { key })]);
    }
    bench.exchange(&HostMessage::Configure(MOVE));
    bench.exchange(&HostMessage::Arm);
    let timing = HostMessage::Timing { latency_ticks: 1, decision_ticks: 1 };
    assert_eq!(bench.exchange(&timing), [BoardMessage::Fault(BoardFault::Armed)]);
}
