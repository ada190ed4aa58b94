//! The limits of a move that the host tells.

use controller::resonance_tracker::ResonanceTracker;
use controller::{InFlight, Positioning, PositioningTuning, StopReason, Target, tick_by};
use estimator::{ConstantRate, ConstantRateTuning, Instruments};
use link::{MoveLimitsRecord, PhaseRecord, TargetRecord};
use motor_model::Angle;

use super::rate::Measured;
use super::*;

const NONE: MoveLimitsRecord = MoveLimitsRecord { travel_deg: None, on_max_nanos: None, amplitude_max: None };

/// Ticks of a move: the rotor is known after some hundred, and driven for at least the window of a cruise.
const TICKS: u64 = 20_000;

/// The tick before which the move gets another target.
const RETARGETED: u64 = 18_000;

/// The reports of a move within `limits`, of a rotor that nothing turns, whose last part is to another target. Each is
/// that of the controller's own loop within those limits, to the last bit.
fn reports(limits: MoveLimitsRecord) -> Vec<TickRecord> {
    let configuration = Configuration { limits, ..MOVE };
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&HostMessage::Configure(configuration)), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    let instruments = Instruments::default();
    let mut filter =
        ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&MotorParams::nominal(), &instruments));
    let (target, limits) = configuration.checked().unwrap();
    let tuning = PositioningTuning { limits, ..PositioningTuning::new(&instruments) };
    let map = ResponseMap::table_1();
    let mut own = Positioning::new(map, target, tuning, Time::ZERO);
    let (mut tracker, mut in_flight) = (ResonanceTracker::of(map), InFlight::new());
    let report = |tick: u64| {
        if tick == RETARGETED {
            let record = TargetRecord { target_deg: -30.0, tolerance_deg: MOVE.tolerance_deg };
            bench.exchange(&HostMessage::Retarget(record));
            own.retarget(Target::try_new(-30.0, MOVE.tolerance_deg).unwrap(), time(tick - 1));
        }
        let dither_deg = if tick.is_multiple_of(20) { 0.03 } else { 0.0 };
        let mut measured = Measured::at(time(tick - 1), tick, Angle::from_degrees(dither_deg));
        bench.exchange(&HostMessage::Ldv(measured.sample.map(Into::into).into_iter().collect()));
        if let Some(frame) = measured.frame {
            bench.exchange(&HostMessage::Camera(frame.into()));
        }
        let theirs = bench.step().unwrap();
        let now = time(tick);
        let ours = tick_by(map, &mut filter, &mut own, &mut tracker, &mut in_flight, now, &mut measured);
        assert_eq!(TickRecord::from(&*ours).difference(&theirs), None, "tick {tick}");
        theirs
    };
    (1..=TICKS).map(report).collect()
}

fn strongest(reports: &[TickRecord]) -> f32 {
    reports.iter().map(|report| report.applied.amplitude).fold(0.0, f32::max)
}

/// Ticks of the longest drive.
fn longest(reports: &[TickRecord]) -> usize {
    reports.split(|report| report.applied.mode == None.into()).map(<[_]>::len).max().unwrap()
}

fn is_out_of_travel(report: &TickRecord) -> bool {
    report.phase.value() == Some(PhaseRecord::Stopped(StopReason::OutOfTravel))
}

/// Each limit does at the board what it does in the controller's own loop, in every tick, and nothing of it without.
#[test]
fn dual_a_board_keeps_the_limits_of_a_move_as_the_controllers_loop_does() {
    let any = reports(NONE);
    assert!(strongest(&any) > 0.9 && longest(&any) > 10_000 && !any.iter().any(is_out_of_travel));

    let weak = reports(MoveLimitsRecord { amplitude_max: Some(0.5), ..NONE });
    assert!((0.1..=0.5).contains(&strongest(&weak)), "{}", strongest(&weak));

    // A drive of 50 ms is one of 5000 ticks.
    let short = reports(MoveLimitsRecord { on_max_nanos: Some(50_000_000), ..NONE });
    assert_eq!(longest(&short), 5000);

    let inside = reports(MoveLimitsRecord { travel_deg: Some((-30.0, 90.0)), ..NONE });
    assert!(!inside.iter().any(is_out_of_travel));
    let outside = reports(MoveLimitsRecord { travel_deg: Some((-29.0, 90.0)), ..NONE });
    let (before, after) = outside.split_at(RETARGETED as usize - 1);
    assert!(!before.iter().any(is_out_of_travel) && after.iter().all(is_out_of_travel));
    assert!(after.iter().all(|report| report.command == DriveCommand::OFF.into()));
}

/// The travel counts from the zero, as the target does.
#[test]
fn exact_the_travel_of_a_move_counts_from_the_zero() {
    let zero_deg = 1000.0;
    for (target_deg, out) in [(95.0, false), (-15.0, true), (105.0, true)] {
        let mut bench = Bench::new();
        bench.exchange(&HostMessage::Hello);
        let angle_units = Angle::from_degrees(zero_deg).units();
        bench.exchange(&HostMessage::Zero { angle_units: Some(angle_units) });
        let limits = MoveLimitsRecord { travel_deg: Some((-10.0, 100.0)), ..NONE };
        bench.exchange(&HostMessage::Configure(Configuration { limits, ..MOVE }));
        assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
        let record = TargetRecord { target_deg, tolerance_deg: MOVE.tolerance_deg };
        bench.exchange(&HostMessage::Retarget(record));
        assert_eq!(is_out_of_travel(&bench.step().unwrap()), out, "{target_deg}");
    }
}

/// Each limit is refused by its key, and the configuration before it stays.
#[test]
fn law_limits_of_a_move_out_of_bounds_are_refused_by_name() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::Configure(MOVE));
    for (limits, key) in [
        (MoveLimitsRecord { travel_deg: Some((f64::NAN, 1.0)), ..NONE }, "travel.least_deg"),
        (MoveLimitsRecord { travel_deg: Some((2.0, 1.0)), ..NONE }, "travel.greatest_deg"),
        (MoveLimitsRecord { travel_deg: Some((0.0, 89.0)), ..NONE }, "position.to_deg"),
        (MoveLimitsRecord { on_max_nanos: Some(u64::MAX), ..NONE }, "limits.drive_on_s"),
        (MoveLimitsRecord { amplitude_max: Some(f32::NAN), ..NONE }, "limits.amplitude_max"),
    ] {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        let asked = Configuration { limits, ..MOVE };
        assert_eq!(bench.exchange(&HostMessage::Configure(asked)), refused);
        assert_eq!(bench.exchange(&HostMessage::Forecast(asked)), refused);
    }
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
}
