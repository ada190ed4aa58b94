//! Another target for the move under way.

use controller::resonance_tracker::ResonanceTracker;
use controller::{InFlight, Limits, Positioning, PositioningPhase, PositioningTuning, Target, tick_by};
use estimator::{AngleFilter as _, ConstantRate, ConstantRateTuning, Health, Instruments};
use link::{PhaseRecord, RateConfiguration, RateLimitsRecord, TargetRecord};
use motor_model::Angle;

use super::rate::Measured;
use super::*;

fn to(target_deg: f64) -> HostMessage {
    HostMessage::Retarget(TargetRecord { target_deg, tolerance_deg: MOVE.tolerance_deg })
}

fn retargeted(target_deg: f64) -> [BoardMessage; 1] {
    [BoardMessage::Retargeted { target_units: Angle::from_degrees(target_deg).units() }]
}

/// Every report of 6000 ticks, before a change of the target, after it, and after a hold, is that of the controller's
/// own loop that is retargeted in the same ticks.
#[test]
fn dual_a_board_moves_on_as_the_controllers_loop_does() {
    let mut bench = Bench::new();
    bench.begin();
    let instruments = Instruments::default();
    let mut filter =
        ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&MotorParams::nominal(), &instruments));
    let limits = Limits { deadline_nanos: MOVE.deadline_nanos, ..Limits::default() };
    let tuning = PositioningTuning { limits, ..PositioningTuning::new(&instruments) };
    let (map, target) =
        (ResponseMap::table_1(), Target::try_new(MOVE.target_deg, MOVE.tolerance_deg).unwrap());
    let mut own = Positioning::new(map, target, tuning, Time::ZERO);
    let mut tracker = ResonanceTracker::of(map);
    let mut in_flight = InFlight::new();
    let mut modes = Vec::new();
    for tick in 1..=6000_u64 {
        match tick {
            2500 => {
                assert_eq!(bench.exchange(&to(-30.0)), retargeted(-30.0));
                own.retarget(Target::try_new(-30.0, MOVE.tolerance_deg).unwrap(), time(tick - 1));
            }
            4500 => {
                let angle = filter.estimate(time(tick - 1)).unwrap().angle;
                let held = BoardMessage::Retargeted { target_units: angle.units() };
                assert_eq!(bench.exchange(&HostMessage::Hold), [held]);
                own.retarget(own.target().at(angle).unwrap(), time(tick - 1));
            }
            _ => (),
        }
        let dither_deg = if tick.is_multiple_of(20) { 0.03 } else { 0.0 };
        let mut measured = Measured::at(time(tick - 1), tick, Angle::from_degrees(dither_deg));
        bench.exchange(&HostMessage::Ldv(measured.sample.map(Into::into).into_iter().collect()));
        if let Some(frame) = measured.frame {
            bench.exchange(&HostMessage::Camera(frame.into()));
        }
        let theirs = bench.step().unwrap();
        let ours = TickRecord::from(&*tick_by(
            map,
            &mut filter,
            &mut own,
            &mut tracker,
            &mut in_flight,
            time(tick),
            &mut measured,
        ));
        assert_eq!(ours.difference(&theirs), None, "tick {tick}");
        modes.push(bench.driven().mode());
    }
    // Clockwise to 90 degrees, back to -30, and at the target where it is.
    assert!(modes[..2499].contains(&Some(DriveMode::B)) && !modes[..2499].contains(&Some(DriveMode::C)));
    assert!(modes[2499..4499].contains(&Some(DriveMode::C)));
    assert!(!matches!(own.phase(), PositioningPhase::Cruise { .. }), "{:?}", own.phase());
    assert_eq!(modes.last(), Some(&None));
}

/// A target out of bounds is refused by name, and the move goes on to the old one.
#[test]
fn law_a_target_out_of_bounds_is_refused_by_name() {
    let mut bench = Bench::driving();
    let target =
        |target_deg, tolerance_deg| HostMessage::Retarget(TargetRecord { target_deg, tolerance_deg });
    for (message, key) in [
        (target(f64::NAN, 0.02), "position.to_deg"),
        (target(-1e6, 0.02), "position.to_deg"),
        (target(1.0, 0.0), "position.tolerance_deg"),
        (target(1.0, f64::INFINITY), "position.tolerance_deg"),
    ] {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        assert_eq!(bench.exchange(&message), refused);
        bench.measure();
        assert_eq!(bench.step().unwrap().applied.mode, Some(DriveMode::B).into());
    }
    assert_eq!(bench.exchange(&to(-90.0)), retargeted(-90.0));
    let mut back = false;
    for _ in 0..1000 {
        bench.measure();
        back |= bench.step().unwrap().applied.mode == Some(DriveMode::C).into();
    }
    assert!(back, "it drives to the new target");
}

/// Without a move under way there is no target to change: not armed, latched, during a rate. Where the rotor is must be
/// known to hold it.
#[test]
fn law_a_target_needs_a_move_and_a_hold_an_estimate() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::Configure(MOVE));
    for message in [to(1.0), HostMessage::Hold] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::NotReady));
    }
    bench.exchange(&HostMessage::Arm);
    assert_eq!(bench.exchange(&HostMessage::Hold), fault(BoardFault::NoEstimate));
    assert_eq!(bench.exchange(&to(1.0)), retargeted(1.0));
    for _ in 0..1000 {
        bench.measure();
        bench.step();
    }
    assert!(matches!(bench.exchange(&HostMessage::Hold)[..], [BoardMessage::Retargeted { .. }]));
    // An estimate, but one that has had no frame for 30 ms.
    let last = (0..3000).filter_map(|_| bench.step()).last().unwrap();
    assert!(last.estimate.is_some() && matches!(last.health.value(), Some(Health::Unusable(_))), "{last:?}");
    assert_eq!(bench.exchange(&HostMessage::Hold), fault(BoardFault::NoEstimate));
    bench.board.stop_for_amplifier();
    for message in [to(1.0), HostMessage::Hold] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::AmplifierFailed));
    }
    bench.exchange(&HostMessage::Stop);
    let limits = RateLimitsRecord::default();
    let rate =
        RateConfiguration { filter: MOVE.filter, rate_deg_s: 100.0, duration_nanos: 1_000_000_000, limits };
    bench.exchange(&HostMessage::ConfigureRate(rate));
    bench.exchange(&HostMessage::Arm);
    bench.drive();
    for message in [to(1.0), HostMessage::Hold] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::NoMove));
    }
    assert!(!bench.off(), "the rate goes on");
}

/// The deadline begins anew with a target. Another arming makes the configured move.
#[test]
fn law_a_target_begins_the_deadline_anew_and_a_stop_ends_it() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let short = Configuration { deadline_nanos: 50_000_000, ..MOVE };
    bench.exchange(&HostMessage::Configure(short));
    bench.exchange(&HostMessage::Arm);
    let stopped = |report: TickRecord| matches!(report.phase.value(), Some(PhaseRecord::Stopped(_)));
    let ticks_to_stop = |bench: &mut Bench| {
        (1..20_000).find(|_| {
            bench.measure();
            bench.step().is_some_and(stopped)
        })
    };
    // Later than 50 ms, which are 5000 ticks.
    assert_eq!(ticks_to_stop(&mut bench), Some(5001));
    assert_eq!(bench.exchange(&to(-90.0)), retargeted(-90.0));
    assert_eq!(ticks_to_stop(&mut bench), Some(5001));
    bench.exchange(&HostMessage::Stop);
    bench.exchange(&HostMessage::Arm);
    bench.drive();
    assert_eq!(bench.driven().mode(), Some(DriveMode::B), "to 90 degrees");
}
