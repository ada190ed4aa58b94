//! A rotor that never rests, turns on, or cannot be measured: every wait has a reason and an end.

use super::*;
use crate::target::Travel;

/// The camera shows a rotor that lies still, and the filter never says that it rests: the move goes on within half a
/// second, and ends.
#[test]
fn law_a_rotor_that_never_rests_by_the_filter_is_driven_by_the_camera() {
    let mut scenario = Scenario::new(90e3, 1.0);
    let mut waited_ticks = 0;
    while scenario.moving().mode().is_none() {
        assert!(matches!(scenario.phase(), PositioningPhase::Settling(Wait::Rest)));
        waited_ticks += 1;
    }
    assert!(waited_ticks * TICK < 500_000_000, "{waited_ticks}");
    assert!(matches!(scenario.phase(), PositioningPhase::Cruise { .. }));
    scenario.mdeg = 90e3;
    let end_at = scenario.now.plus_nanos(2_000_000_000);
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        assert!(scenario.now < end_at, "{:?}", scenario.phase());
        scenario.moving();
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::NotMeasurable));
}

/// A rotor that turns on after a cruise is braked by the other mode soon after its longest coast, and the move goes on
/// when it stands.
#[test]
fn law_a_rotor_that_turns_on_is_braked() {
    for sign in [1.0, -1.0] {
        let mut scenario = Scenario::new(sign * 90e3, 1.0);
        let driven = scenario.rest().mode();
        scenario.rate_rad_s = if sign > 0.0 { 15.0 } else { -1.5 };
        let per_tick_mdeg = 1e3 * f64::from((scenario.rate_rad_s * 1e-5).to_degrees());
        let mut brake = None;
        while brake.is_none() {
            scenario.mdeg += per_tick_mdeg;
            let mode = scenario.moving().mode();
            brake = mode.filter(|_| mode != driven);
        }
        assert!(matches!(scenario.phase(), PositioningPhase::Brake { .. }), "{:?}", scenario.phase());
        // The longest coast: 9.5 degrees and five times 3.5 in mode B.
        assert!(sign * scenario.mdeg < 90e3 + 28e3, "{sign} {}", scenario.mdeg);
        scenario.rate_rad_s = 0.0;
        assert_eq!(scenario.moving(), DriveCommand::OFF);
        assert_eq!(scenario.phase(), PositioningPhase::Settling(Wait::Turning));
        scenario.ring_down();
        assert!(scenario.rest().mode().is_some(), "on to the target");
    }
}

/// A rotor that lies still on a stator that still rings is measured, and not driven by a burst; a cruise may begin.
#[test]
fn law_a_burst_begins_on_a_quiet_stator() {
    // A nudge, then a step: 4 time constants of mode B of Table 1 are 16.04 ms, and a plan is made every 0.1 ms.
    let mut scenario = Scenario::new(2.0, 0.5);
    assert_eq!(scenario.rest().mode(), Some(DriveMode::B));
    while scenario.moving().mode().is_some() {}
    let off_at = scenario.now;
    scenario.mdeg = 4.0;
    scenario.moving();
    while scenario.rest().mode().is_none() {
        assert!(matches!(scenario.phase(), PositioningPhase::Settling(Wait::Measuring { .. })));
    }
    assert_eq!(scenario.positioning.command().mode(), Some(DriveMode::C));
    let waited_ms = 1e3 * scenario.now.seconds_since::<f64>(off_at);
    assert!((16.0..16.15).contains(&waited_ms), "{waited_ms}");
    // A far target meanwhile.
    while scenario.moving().mode().is_some() {}
    scenario.positioning.retarget(Target::try_new(90.0, 0.001).unwrap(), scenario.now);
    assert_eq!(scenario.rest().mode(), Some(DriveMode::B));
}

/// A rotor that is measured: the next drive is planned every ten ticks, and not in between.
#[test]
fn exact_a_plan_is_made_every_ten_ticks() {
    let mut scenario = Scenario::new(-2.0, 0.5);
    scenario.sigma_mdeg = 5.0;
    assert_eq!(scenario.rest(), DriveCommand::OFF, "the angle is not known well enough");
    for _ in 0..7 {
        let from = scenario.now;
        scenario.sigma_mdeg = 5.0;
        (0..5).for_each(|_| assert_eq!(scenario.rest(), DriveCommand::OFF));
        scenario.sigma_mdeg = 0.1;
        (5..9).for_each(|_| assert_eq!(scenario.rest(), DriveCommand::OFF));
        scenario.sigma_mdeg = 5.0;
        assert_eq!(scenario.rest(), DriveCommand::OFF);
        assert_eq!(scenario.now.nanos_since(from), 10 * TICK);
    }
    scenario.sigma_mdeg = 0.1;
    (0..9).for_each(|_| assert_eq!(scenario.rest(), DriveCommand::OFF));
    assert_eq!(scenario.rest().mode(), Some(DriveMode::C));
}

/// One that no brake stops ends the move, after a bounded time and a bounded number of brakes.
#[test]
fn law_a_rotor_that_no_brake_stops_ends_the_move() {
    let mut scenario = Scenario::new(90e3, 1.0);
    scenario.rate_rad_s = 1.0;
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        scenario.mdeg += 1e3 * f64::from((scenario.rate_rad_s * 1e-5).to_degrees());
        scenario.moving();
        assert!(scenario.now.nanos() < 4_000_000_000, "{:?}", scenario.phase());
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::KeepsTurning));
}

/// An estimate that is wide but right ends no burst and begins none.
#[test]
fn law_a_wide_estimate_cuts_no_burst() {
    let wide = Health::Unusable(Reason::Uncertain);
    let mut scenario = Scenario::new(900.0, 1.0);
    let uncertain = |scenario: &mut Scenario, resting| {
        scenario.now = scenario.now.plus_nanos(TICK);
        let estimate = scenario.estimate(resting, 800.0);
        scenario.positioning.decide(map(), scenario.now, Some(&estimate), wide)
    };
    for _ in 0..10 {
        assert_eq!(uncertain(&mut scenario, true), DriveCommand::OFF, "nothing begins");
    }
    assert!(matches!(scenario.phase(), PositioningPhase::Settling(Wait::Measuring { .. })));
    scenario.rest();
    let PositioningPhase::Burst { burst, .. } = scenario.phase() else { panic!("{:?}", scenario.phase()) };
    let mut ticks = 1;
    while uncertain(&mut scenario, false).mode().is_some() {
        ticks += 1;
    }
    assert_eq!(ticks, burst.ticks);
}

/// A variance that falls too slowly for the deadline is noticed within some windows, and so is a camera that is gone.
#[test]
fn law_what_cannot_end_in_time_ends_early() {
    let mut scenario = Scenario::new(0.4, 0.5);
    scenario.sigma_mdeg = 17.0;
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        // As 1 / sqrt(t) from 10 frames of 17 milli-degrees a second: 1,400 frames are needed.
        let seconds = scenario.now.seconds_since::<f32>(Time::ZERO);
        scenario.sigma_mdeg = 17.0 / (1.0 + 10.0 * seconds).sqrt();
        scenario.rest();
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::NotMeasurable));
    assert!(scenario.now.nanos() < 1_200_000_000, "{}", scenario.now.nanos());

    let mut scenario = Scenario::new(90e3, 1.0);
    while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
        scenario.now = scenario.now.plus_nanos(TICK);
        scenario.positioning.decide(map(), scenario.now, None, Health::Waiting);
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::NoEstimate));
    assert!(scenario.now.nanos() < 2_100_000_000, "{}", scenario.now.nanos());
}

/// Where the angle of a driven rotor is known to three degrees only, as with late frames, no cruise is begun that would
/// be cut at once: after the first one bursts lead to the target. Far from the target the same angle
/// ends no cruise, and a move that follows begins with one.
#[test]
fn law_an_uncertain_angle_ends_no_cruise_for_ever() {
    for (target_mdeg, cruises) in [(-400.0, 1), (-37e3, 1), (37e3, 1)] {
        let mut scenario = Scenario::new(target_mdeg, 1.0);
        let mut begun = 0;
        for _ in 0..60 {
            scenario.rest();
            if let PositioningPhase::Cruise { .. } = scenario.phase() {
                begun += 1;
                let from_mdeg = scenario.mdeg;
                while let PositioningPhase::Cruise { cruise, .. } = scenario.phase() {
                    scenario.rate_rad_s = cruise.rate_rad_s;
                    scenario.mdeg += 1e3 * f64::from((cruise.rate_rad_s * 1e-5).to_degrees());
                    scenario.now = scenario.now.plus_nanos(TICK);
                    let estimate = scenario.estimate(false, 3e3);
                    scenario.positioning.decide(map(), scenario.now, Some(&estimate), Health::Good);
                }
                scenario.rate_rad_s = 0.0;
                scenario.ring_down();
                let turned_mdeg = (scenario.mdeg - from_mdeg).abs();
                // Three standard deviations, the coast and its own spread of 3.5 degrees.
                assert!(turned_mdeg > target_mdeg.abs() - 24e3, "{target_mdeg} {turned_mdeg}");
            } else if matches!(scenario.phase(), PositioningPhase::Burst { .. }) {
                scenario.burst(1.0);
            }
        }
        assert_eq!(scenario.phase(), PositioningPhase::Holding, "{target_mdeg}");
        assert_eq!(begun, cruises, "{target_mdeg}");
        // A new target is a new move, which may cruise.
        let back_deg = 1e-3 * scenario.mdeg - (37.0_f64).copysign(target_mdeg);
        scenario.positioning.retarget(Target::try_new(back_deg, 0.001).unwrap(), scenario.now);
        scenario.rest();
        scenario.rest();
        assert!(matches!(scenario.phase(), PositioningPhase::Cruise { .. }), "{:?}", scenario.phase());
    }
}

/// A tenth of a milli-degree, asked of an estimate that never becomes better than 0.06: the move ends for that reason,
/// in three windows of measuring and a few drives.
#[test]
fn law_a_tolerance_that_cannot_be_measured_ends_the_move() {
    for target_mdeg in [0.0, -0.05, -0.3, -5.0, 3.0] {
        let mut scenario = Scenario::new(target_mdeg, 0.1);
        scenario.sigma_mdeg = 0.06;
        let mut drives = 0;
        while !matches!(scenario.phase(), PositioningPhase::Stopped(_)) {
            assert!(scenario.now.nanos() < 3_000_000_000, "{target_mdeg} {:?}", scenario.phase());
            scenario.drive(|_, _| 1.0);
            drives += u32::from(matches!(scenario.phase(), PositioningPhase::Burst { .. }));
        }
        assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::NotMeasurable), "{target_mdeg}");
        assert!(drives <= 10, "{target_mdeg} {drives}");
    }
}

/// A rotor nearer to the target than the shortest step turns it, and not near enough for the tolerance: it is brought
/// to the target, from clockwise of it, without waiting for the deadline.
#[test]
fn law_a_rotor_too_near_for_a_step_is_brought_to_the_target() {
    for target_mdeg in [-0.05, -0.06, -0.08, -0.12] {
        let mut scenario = Scenario::new(target_mdeg, 0.1);
        scenario.sigma_mdeg = 0.04;
        while scenario.phase() != PositioningPhase::Holding {
            assert!(scenario.now.nanos() < 1_000_000_000, "{target_mdeg} {:?}", scenario.phase());
            scenario.drive(|_, _| 1.0);
        }
        assert!((scenario.mdeg - target_mdeg).abs() <= 0.1, "{target_mdeg} {}", scenario.mdeg);
    }
}

/// The health of a camera from which nothing comes, while the angle is known well enough.
const SILENT: Health = Health::Degraded(Reason::CameraSilent);

impl Scenario {
    /// Ticks by an estimate of that health until `is_over`, or for ten seconds; how long they took, in ns.
    fn until(&mut self, health: Health, resting: bool, is_over: impl Fn(PositioningPhase) -> bool) -> u64 {
        let from = self.now;
        while !is_over(self.phase()) && self.now.nanos_since(from) < 10_000_000_000 {
            self.now = self.now.plus_nanos(TICK);
            let estimate = self.estimate(resting, 20.0);
            self.positioning.decide(map(), self.now, Some(&estimate), health);
        }
        self.now.nanos_since(from)
    }
}

/// While the camera is silent a cruise goes on for a window of 0.15 s at most, whatever is predicted of the rotor.
#[test]
fn law_a_cruise_ends_in_a_window_without_frames() {
    for health in [SILENT, Health::Unusable(Reason::Uncertain)] {
        for target_mdeg in [3600e3, -3600e3] {
            let mut scenario = Scenario::new(target_mdeg, 1.0);
            assert!(scenario.rest().mode().is_some());
            let nanos = scenario.until(health, false, |phase| matches!(phase, PositioningPhase::Settling(_)));
            assert!(nanos.abs_diff(150_000_000) <= 2 * TICK, "{health:?} {target_mdeg}: {nanos}");
        }
    }
}

/// A rotor at rest that is not seen is not called one that cannot be measured. After the time for which an estimate may
/// be lost, two seconds and twenty frames, the move ends for want of one.
#[test]
fn law_a_silent_camera_at_rest_is_waited_for() {
    let mut scenario = Scenario::new(0.2, 0.1);
    let nanos = scenario.until(SILENT, true, |phase| matches!(phase, PositioningPhase::Stopped(_)));
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::NoEstimate));
    let expected = scenario.positioning.tuning.blind_max_nanos;
    assert!(nanos.abs_diff(expected) <= 2 * TICK && expected > 2_000_000_000, "{nanos} {expected}");
    // Another target is waited for as long.
    scenario.positioning.retarget(Target::try_new(90.0, 0.001).unwrap(), scenario.now);
    scenario.now = scenario.now.plus_nanos(TICK);
    scenario.positioning.decide(map(), scenario.now, None, Health::Waiting);
    assert_eq!(scenario.phase(), PositioningPhase::Waiting(Health::Waiting));
}

/// A target that was reached is not due at the deadline any more: a loss of the estimate while it is held begins the
/// move anew.
#[test]
fn law_a_hold_outlives_the_deadline_and_a_short_loss() {
    let mut scenario =
        Scenario::limited(0.0, 1.0, Limits { deadline_nanos: 2_000_000_000, ..Limits::default() });
    while scenario.phase() != PositioningPhase::Holding {
        scenario.rest();
    }
    scenario.now = scenario.now.plus_nanos(3_000_000_000);
    scenario.rest();
    scenario.now = scenario.now.plus_nanos(TICK);
    let lost = Health::Unusable(Reason::FramesRefused);
    scenario.positioning.decide(map(), scenario.now, None, lost);
    assert_eq!(scenario.phase(), PositioningPhase::Waiting(lost));
    for _ in 0..100 {
        scenario.rest();
    }
    assert_eq!(scenario.phase(), PositioningPhase::Holding);
}

/// A burst that is cut, at the deadline, at the end of the travel or where the drive was on for as long as is allowed,
/// turns by less than was forecast: of the angle before it nothing is known after it. A whole one makes the angle
/// better known than by the frames alone.
#[test]
fn law_a_burst_that_is_cut_leaves_no_forecast() {
    let known = |cut: &dyn Fn(&mut Scenario), reason: Option<StopReason>| {
        let travel = Travel::try_new(-90.0, 90.0).unwrap();
        let limits = Limits { travel, deadline_nanos: 1_000_000_000, ..Limits::default() };
        let mut scenario = Scenario::limited(-4.0, 0.5, limits);
        scenario.rest();
        cut(&mut scenario);
        let stopped = match scenario.phase() {
            PositioningPhase::Stopped(reason) => Some(reason),
            _ => None,
        };
        assert_eq!(stopped, reason);
        scenario.mdeg = -3.9;
        let seen = scenario.estimate(true, 0.3);
        scenario.positioning.resting(&seen).angle_rad2 < 0.99 * seen.angle_rad2
    };
    let whole = |scenario: &mut Scenario| {
        scenario.burst(1.0);
    };
    assert!(known(&whole, None));
    let at_deadline = |scenario: &mut Scenario| {
        scenario.moving();
        scenario.positioning.deadline_at = scenario.now;
        scenario.moving();
    };
    assert!(!known(&at_deadline, Some(StopReason::TimedOut)));
    let outside = |scenario: &mut Scenario| {
        scenario.moving();
        scenario.mdeg = -91e3;
        scenario.moving();
    };
    assert!(!known(&outside, Some(StopReason::OutOfTravel)));
    let too_long = |scenario: &mut Scenario| {
        scenario.moving();
        scenario.positioning.tuning.limits.on_max_nanos = TICK;
        scenario.moving();
    };
    assert!(!known(&too_long, None));
}
