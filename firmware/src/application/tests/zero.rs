//! The angle from which all angles of the link are counted.

use link::{PhaseRecord, RateConfiguration, RateLimitsRecord, RatePhase, TargetRecord};

use super::rate::RATE;
use super::*;

const ZERO_DEG: f64 = 30.0;

fn units(degrees: f64) -> i64 {
    Angle::from_degrees(degrees).units()
}

fn zero(degrees: f64) -> HostMessage {
    HostMessage::Zero { angle_units: Some(units(degrees)) }
}

/// A board with `message` configured, whose zero is at `zero_deg`.
fn armed(message: &HostMessage, zero_deg: f64) -> Bench {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let zeroed = BoardMessage::Zeroed { angle_units: units(zero_deg) };
    assert_eq!(bench.exchange(&zero(zero_deg)), [zeroed]);
    assert_eq!(bench.exchange(message), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench
}

fn step(bench: &mut Bench) -> TickRecord {
    bench.measure();
    bench.step().unwrap()
}

/// `report`, its angles counted from the camera's zero.
fn counted_from_camera(mut report: TickRecord, zero_units: i64) -> TickRecord {
    if let Some(estimate) = &mut report.estimate {
        estimate.angle_units += zero_units;
    }
    if let Some(reference) = report.rate.as_mut().and_then(|rate| rate.reference_units.as_mut()) {
        *reference += zero_units;
    }
    report
}

/// With another zero, a board does in every tick what one does whose target, or travel, is as far from the camera's
/// zero, to the last bit; what it tells is counted from its own. A stop keeps the zero, and a new session begins at
/// that of the camera.
#[test]
fn dual_another_zero_is_another_count_and_nothing_else() {
    // Counter-clockwise of the rotor by the camera's count, and clockwise by the board's own.
    let to = |target_deg| HostMessage::Configure(Configuration { target_deg, ..MOVE });
    let travel = |least: f64, greatest: f64| {
        let limits = RateLimitsRecord { travel_deg: Some((least, greatest)), ..RateLimitsRecord::default() };
        HostMessage::ConfigureRate(RateConfiguration { limits, ..RATE })
    };
    let cases = [
        (to(-10.0), to(ZERO_DEG - 10.0)),
        // The rotor rests at 0 degrees of the camera, from where it is to turn clockwise: within the first travel, and
        // beyond the end of the second.
        (travel(-60.0, -20.0), travel(ZERO_DEG - 60.0, ZERO_DEG - 20.0)),
        (travel(-80.0, -35.0), travel(ZERO_DEG - 80.0, ZERO_DEG - 35.0)),
    ];
    let mut drives = Vec::new();
    for (of_zero, of_camera) in cases {
        let (mut ours, mut theirs) = (armed(&of_zero, ZERO_DEG), armed(&of_camera, 0.0));
        for tick in 0..4000 {
            if tick == 2000 {
                for bench in [&mut ours, &mut theirs] {
                    bench.exchange(&HostMessage::Stop);
                    bench.exchange(&HostMessage::Arm);
                }
            }
            let (own, other) = (step(&mut ours), step(&mut theirs));
            assert_eq!(counted_from_camera(own, units(ZERO_DEG)).difference(&other), None, "tick {tick}");
            assert_eq!(ours.driven(), theirs.driven(), "tick {tick}");
            if tick == 3999 {
                let stopped = matches!(own.phase.value(), Some(PhaseRecord::Rate(RatePhase::Stopped(_))));
                drives.push((!ours.off(), stopped));
            }
        }
        ours.exchange(&HostMessage::Hello);
        ours.exchange(&of_camera);
        ours.exchange(&HostMessage::Arm);
        theirs.exchange(&HostMessage::Stop);
        theirs.exchange(&HostMessage::Arm);
        let estimates = [&mut ours, &mut theirs].map(|bench| {
            (0..3000).map(|_| step(bench)).last().unwrap().estimate.map(|estimate| estimate.angle_units)
        });
        assert!(estimates[0].is_some_and(|angle| angle.abs() < units(1.0)), "{estimates:?}");
        assert_eq!(estimates[0], estimates[1]);
    }
    assert_eq!(drives, [(true, false), (true, false), (false, true)], "on or off, stopped or not");
}

/// Where the rotor is now becomes the zero of a move that goes on to the same place; a target from then on counts from
/// there, and so does what a hold tells.
#[test]
fn law_the_zero_of_a_move_under_way_is_where_the_rotor_is() {
    let mut ours = Bench::driving();
    let mut theirs = Bench::driving();
    let now = BoardMessage::Zeroed { angle_units: 0 };
    assert_ne!(ours.exchange(&HostMessage::Zero { angle_units: None }), [now], "the camera is dithered");
    let zero = ours.board.zero;
    assert!(zero.degrees().abs() < 0.1, "{zero:?}");
    let both = |ours: &mut Bench, theirs: &mut Bench| {
        let (own, other) = (step(ours), step(theirs));
        assert_eq!(counted_from_camera(own, zero.units()).difference(&other), None);
    };
    (0..500).for_each(|_| both(&mut ours, &mut theirs));
    let to = |angle: Angle| {
        let target = TargetRecord { target_deg: angle.degrees(), tolerance_deg: MOVE.tolerance_deg };
        HostMessage::Retarget(target)
    };
    let target = Angle::from_degrees(-45.0);
    let told = |angle: Angle| [BoardMessage::Retargeted { target_units: angle.units() }];
    assert_eq!(ours.exchange(&to(target)), told(target));
    assert_eq!(theirs.exchange(&to(target.plus(zero))), told(target.plus(zero)));
    (0..500).for_each(|_| both(&mut ours, &mut theirs));
    let [BoardMessage::Retargeted { target_units }] = theirs.exchange(&HostMessage::Hold)[..] else {
        panic!("a target")
    };
    assert_eq!(ours.exchange(&HostMessage::Hold), told(Angle::from_units(target_units).minus(zero)));
    (0..500).for_each(|_| both(&mut ours, &mut theirs));
}

/// Where the rotor is must be known, and what the camera shows is said before arming. What is refused changes nothing.
#[test]
fn law_a_zero_that_cannot_be_is_refused() {
    let here = HostMessage::Zero { angle_units: None };
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&here), fault(BoardFault::NotReady));
    for degrees in [-360_001.0, 360_001.0] {
        let key = "position.zero_deg".try_into().unwrap();
        assert_eq!(bench.exchange(&zero(degrees)), fault(BoardFault::OutOfBounds { key }));
    }
    let greatest = BoardMessage::Zeroed { angle_units: units(360_000.0) };
    assert_eq!(bench.exchange(&zero(360_000.0)), [greatest]);
    assert_eq!(bench.exchange(&zero(5.0)), [BoardMessage::Zeroed { angle_units: units(5.0) }]);
    bench.exchange(&HostMessage::Configure(MOVE));
    bench.exchange(&HostMessage::Arm);
    assert_eq!(bench.exchange(&here), fault(BoardFault::NoEstimate));
    assert_eq!(bench.exchange(&zero(6.0)), fault(BoardFault::Armed));
    assert_eq!(bench.board.zero, Angle::from_degrees(5.0));
    bench.board.stop_for_amplifier();
    assert_eq!(bench.exchange(&here), fault(BoardFault::AmplifierFailed));
    assert_eq!(bench.board.zero, Angle::from_degrees(5.0));
}
