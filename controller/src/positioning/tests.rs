//! The state machine on a rotor that turns as a test prescribes.

use super::failures::FAILURES_MAX;
use super::*;
use crate::response_map::strongest_cruise;
use crate::target::{Limits, Travel};
use estimator::Reason;

const TICK: u64 = crate::TICK_NANOS;

/// A rotor, the estimate of it, and the loop's time.
struct Bench {
    positioning: Positioning,
    now: Time,
    mdeg: f64,
    sigma_mdeg: f32,
    rate_rad_s: f32,
}

impl Bench {
    fn new(target_mdeg: f64, tolerance_mdeg: f64) -> Self {
        Self::limited(target_mdeg, tolerance_mdeg, Limits::default())
    }

    fn limited(target_mdeg: f64, tolerance_mdeg: f64, limits: Limits) -> Self {
        let target = Target::try_new(1e-3 * target_mdeg, 1e-3 * tolerance_mdeg).unwrap();
        let tuning = PositioningTuning { limits, ..PositioningTuning::default() };
        let positioning = Positioning::new(target, tuning, Time::ZERO);
        Self { positioning, now: Time::ZERO, mdeg: 0.0, sigma_mdeg: 0.1, rate_rad_s: 0.0 }
    }

    fn estimate(&self, resting: bool, sigma_mdeg: f32) -> Estimate<f32> {
        let sigma_rad = (1e-3 * sigma_mdeg).to_radians();
        Estimate {
            at: self.now,
            angle: Angle::from_degrees(1e-3 * self.mdeg),
            rate_rad_s: self.rate_rad_s,
            angle_rad2: sigma_rad * sigma_rad,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 1e-4,
            resting,
        }
    }

    /// A tick at rest, measured well.
    fn rest(&mut self) -> DriveCommand {
        self.now = self.now.plus_nanos(TICK);
        let estimate = self.estimate(true, self.sigma_mdeg);
        self.positioning.decide(self.now, Some(&estimate), Health::Good)
    }

    /// A tick in motion, when the filter has forgotten what it knew.
    fn moving(&mut self) -> DriveCommand {
        self.now = self.now.plus_nanos(TICK);
        let estimate = self.estimate(false, 20.0);
        self.positioning.decide(self.now, Some(&estimate), Health::Good)
    }

    fn phase(&self) -> PositioningPhase {
        self.positioning.phase()
    }

    /// Lets a burst run out; the rotor turns by `part` of what the map says of it. Returns the ticks with the drive on.
    fn burst(&mut self, part: f32) -> u32 {
        let PositioningPhase::Burst { family, burst, .. } = self.phase() else {
            panic!("{:?}", self.phase())
        };
        let mut ticks = 1;
        while self.moving().mode().is_some() {
            ticks += 1;
        }
        let turn_rad = part * direction(family.mode()) * burst.turn_rad;
        self.mdeg += 1e3 * f64::from(turn_rad.to_degrees());
        ticks
    }

    /// Lets a cruise run until it is cut; the rotor turns at `part` of the rate that the map says, and coasts.
    fn cruise(&mut self, part: f32) {
        while let PositioningPhase::Cruise { cruise, .. } = self.phase() {
            self.rate_rad_s = part * cruise.rate_rad_s;
            self.mdeg += 1e3 * f64::from((self.rate_rad_s * 1e-5).to_degrees());
            if self.moving().mode().is_none() {
                self.mdeg += 1e3 * f64::from((self.rate_rad_s * cruise.coast_s).to_degrees());
            }
        }
        self.rate_rad_s = 0.0;
    }

    /// Drives as long as it is driven, every cruise and burst turning `part` of its map's turn; the reason for the end.
    fn end(&mut self, part: f32) -> PositioningPhase {
        self.end_by(|_, _| part)
    }

    /// A tick at rest, and what is driven then from beginning to end.
    fn drive(&mut self, part: impl Fn(DriveMode, bool) -> f32) {
        self.rest();
        match self.phase() {
            PositioningPhase::Burst { family, .. } => drop(self.burst(part(family.mode(), false))),
            PositioningPhase::Cruise { cruise, .. } => self.cruise(part(cruise.mode, true)),
            _ => (),
        }
    }

    /// The same, with a part for each mode, and for cruises (`true`) and bursts.
    fn end_by(&mut self, part: impl Fn(DriveMode, bool) -> f32) -> PositioningPhase {
        for _ in 0..10_000 {
            self.drive(&part);
            if matches!(self.phase(), PositioningPhase::Holding | PositioningPhase::Stopped(_)) {
                return self.phase();
            }
        }
        panic!("it goes on for ever: {:?}", self.phase());
    }
}

#[test]
fn law_no_drive_without_an_estimate_and_it_says_why() {
    let mut bench = Bench::new(90e3, 1.0);
    assert_eq!(bench.positioning.decide(Time::ZERO, None, Health::Waiting), DriveCommand::OFF);
    assert_eq!(bench.phase(), PositioningPhase::Waiting(Health::Waiting));
    bench.rest();
    assert_eq!(bench.rest().mode(), Some(DriveMode::B), "health has returned");
}

/// K2.
#[test]
fn law_an_estimate_lost_on_the_way_switches_the_drive_off_in_the_same_tick() {
    for target_mdeg in [90e3, -90e3, -30.0, 300.0] {
        let mut bench = Bench::new(target_mdeg, 1.0);
        assert!(bench.rest().mode().is_some(), "{target_mdeg}");
        bench.now = bench.now.plus_nanos(TICK);
        let estimate = bench.estimate(false, 20.0);
        let lost = Health::Unusable(Reason::FramesRefused);
        assert_eq!(bench.positioning.decide(bench.now, Some(&estimate), lost), DriveCommand::OFF);
        assert_eq!(bench.phase(), PositioningPhase::Waiting(lost));
    }
}

#[test]
fn exact_a_cruise_is_cut_where_the_coast_remains() {
    // Near enough for the gentlest, so that it is not eased on the way.
    let mut bench = Bench::new(2.2e3, 1.0);
    bench.rest();
    let PositioningPhase::Cruise { cruise, .. } = bench.phase() else { panic!("{:?}", bench.phase()) };
    assert_eq!(Some(cruise), cruise_within(DriveMode::B, 1.0, 0.0));
    bench.rate_rad_s = cruise.rate_rad_s;
    let cut_rad = cruise.rate_rad_s * cruise.coast_s - 0.5 * cruise.coast_sd_rad;
    bench.mdeg = 2.2e3 - 1e3 * f64::from(cut_rad.to_degrees()) - 10.0;
    assert_eq!(bench.moving().mode(), Some(DriveMode::B));
    bench.mdeg += 20.0;
    assert_eq!(bench.moving(), DriveCommand::OFF);
    assert_eq!(bench.phase(), PositioningPhase::Settling);
}

/// Weaker and weaker as the target comes near, never stronger again, and in no other mode.
#[test]
fn law_a_cruise_is_eased_on_the_way() {
    for sign in [1.0, -1.0] {
        let mut bench = Bench::new(sign * 90e3, 1.0);
        let mut last = bench.rest();
        let (mode, mut amplitudes) = (last.mode(), 1);
        assert!((last.amplitude() - 1.0).abs() < f32::EPSILON);
        while last.mode().is_some() {
            // A tenth of the rate that would carry it there without a coast.
            bench.mdeg += 2.0 * sign;
            let next = bench.moving();
            if next.mode().is_some() {
                assert!(next.amplitude() <= last.amplitude() && next.mode() == mode);
                amplitudes += u32::from(next.amplitude() < last.amplitude());
            }
            last = next;
        }
        assert!(amplitudes >= 3, "{sign} {amplitudes}");
    }
}

/// From one mode to the other only by way of a rotor at rest: the stator has rung down by then, and both are never
/// driven.
#[test]
fn law_between_the_modes_the_rotor_comes_to_rest() {
    for target_mdeg in [40.0, -40.0, 900.0, -5e3, 5e3] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        let (mut last_mode, mut rested) = (None, true);
        for _ in 0..3000 {
            let before = bench.phase();
            let command = bench.rest();
            rested |= before == PositioningPhase::Settling;
            if let Some(mode) = command.mode() {
                assert!(rested || last_mode == Some(mode), "{target_mdeg}");
                (last_mode, rested) = (Some(mode), false);
            }
            // Too far each time, so that it has to come back.
            match bench.phase() {
                PositioningPhase::Burst { .. } => drop(bench.burst(2.0)),
                PositioningPhase::Cruise { .. } => {
                    bench.mdeg += 1.3 * (target_mdeg - bench.mdeg);
                    assert_eq!(bench.moving(), DriveCommand::OFF);
                }
                _ => (),
            }
        }
        assert_eq!(bench.phase(), PositioningPhase::Holding, "{target_mdeg} {}", bench.mdeg);
    }
}

/// Whole turns count: ten of them and a step more end where they should, and so does the way back.
#[test]
fn law_many_turns_are_no_other_than_one() {
    let mut bench = Bench::new(3_600_020.0, 0.5);
    bench.mdeg = 3_600_000.0;
    assert_eq!(bench.end(1.0), PositioningPhase::Holding);
    assert!((bench.mdeg - 3_600_020.0).abs() <= 0.5, "{}", bench.mdeg);
    bench.positioning.retarget(Target::try_new(-720.0, 0.0005).unwrap(), bench.now);
    assert_eq!(bench.rest().mode(), Some(DriveMode::C), "eleven turns back, not none");
}

#[test]
fn exact_a_burst_is_on_for_its_ticks() {
    for target_mdeg in [-4.0, -40.0, 8.0, 300.0] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        bench.rest();
        let PositioningPhase::Burst { burst, .. } = bench.phase() else {
            panic!("{target_mdeg}: {:?}", bench.phase())
        };
        assert_eq!(bench.burst(1.0), burst.ticks);
        assert_eq!(bench.phase(), PositioningPhase::Settling);
    }
}

/// Motors that turn by half or by twice as much as the map says: all are brought to the target.
#[test]
fn law_bursts_end_at_the_target_whatever_the_motor() {
    for part in [0.5, 0.8, 1.0, 1.25, 2.0] {
        for target_mdeg in [-3.0, -30.0, -700.0, 2.0, 25.0, 900.0] {
            let mut bench = Bench::new(target_mdeg, 0.5);
            assert_eq!(bench.end(part), PositioningPhase::Holding, "{part} {target_mdeg} at {}", bench.mdeg);
            assert!((bench.mdeg - target_mdeg).abs() <= 0.5, "{part} {target_mdeg}");
        }
    }
}

/// What one move has learnt, the next one uses: its first step goes a tenth of the way wrong at most, in a motor of
/// half as much again.
#[test]
fn law_the_second_move_profits_from_the_first() {
    let left = |bench: &mut Bench, target_mdeg: f64| {
        let way = target_mdeg - bench.mdeg;
        bench.rest();
        bench.burst(1.5);
        (target_mdeg - bench.mdeg) / way
    };
    let mut bench = Bench::new(-4.0, 0.5);
    assert!(left(&mut bench, -4.0) < -0.4);
    assert_eq!(bench.end(1.5), PositioningPhase::Holding);
    bench.positioning.retarget(Target::try_new(-0.008, 0.0005).unwrap(), bench.now);
    let second = left(&mut bench, -8.0);
    assert!(second.abs() < 0.1, "{second}");
}

/// K1.
#[test]
fn law_a_target_changed_on_the_way_is_the_one_that_counts() {
    let mut bench = Bench::new(90e3, 1.0);
    bench.rest();
    bench.mdeg = 30e3;
    bench.rate_rad_s = 5.0;
    assert_eq!(bench.moving().mode(), Some(DriveMode::B));
    // Farther: on it goes. Behind: the drive is cut, and then reversed.
    bench.positioning.retarget(Target::try_new(120.0, 0.001).unwrap(), bench.now);
    assert_eq!(bench.moving().mode(), Some(DriveMode::B));
    bench.positioning.retarget(Target::try_new(-20.0, 0.001).unwrap(), bench.now);
    assert_eq!(bench.moving(), DriveCommand::OFF);
    bench.rate_rad_s = 0.0;
    assert_eq!(bench.rest().mode(), Some(DriveMode::C));
}

#[test]
fn law_cancelled_stays_off_until_there_is_a_new_target() {
    let mut bench = Bench::new(90e3, 1.0);
    bench.rest();
    bench.positioning.cancel();
    for _ in 0..3 {
        assert_eq!(bench.rest(), DriveCommand::OFF);
    }
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::Cancelled));
    bench.positioning.retarget(Target::try_new(90.0, 0.001).unwrap(), bench.now);
    assert_eq!(bench.rest().mode(), Some(DriveMode::B));
}

/// K3: bursts that do nothing, and a cruise that does nothing: given up after a bounded number, each time.
#[test]
fn law_a_stuck_rotor_is_given_up() {
    for target_mdeg in [-30.0, 300.0, -700.0] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        assert_eq!(bench.end(0.0), PositioningPhase::Stopped(StopReason::Stalled), "{target_mdeg}");
        assert!(bench.positioning.drives <= 2 * u32::from(FAILURES_MAX), "{}", bench.positioning.drives);
    }
    let mut bench = Bench::new(90e3, 0.5);
    let mut on_nanos = 0;
    while !matches!(bench.phase(), PositioningPhase::Stopped(_)) {
        on_nanos += if bench.rest().mode().is_some() { TICK } else { 0 };
    }
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::Stalled));
    assert!(on_nanos < u64::from(FAILURES_MAX) * (crate::progress_window::WINDOW_NANOS + 10 * TICK));
}

/// A motor whose cruises are at a seventh of the map's rates, or a fiftieth, and its bursts at a seventh, is slow, not
/// stuck: it arrives, at full drive for nearly all of the way.
#[test]
fn law_a_slow_motor_arrives() {
    for part in [0.147, 0.02] {
        for target_mdeg in [-360e3, 360e3, -2e3] {
            let limits = Limits { deadline_nanos: 300_000_000_000, ..Limits::default() };
            let mut bench = Bench::limited(target_mdeg, 0.5, limits);
            let end = bench.end_by(|_, cruises| if cruises { part } else { 0.147 });
            assert_eq!(end, PositioningPhase::Holding, "{part} {target_mdeg} at {}", bench.mdeg);
            assert!((bench.mdeg - target_mdeg).abs() <= 0.5, "{part} {target_mdeg} {}", bench.mdeg);
            let mode = if target_mdeg > 0.0 { DriveMode::B } else { DriveMode::C };
            let rate_rad_s = part * direction(mode) * strongest_cruise(mode, 1.0).unwrap().rate_rad_s;
            let least_s = (1e-3 * target_mdeg.abs()).to_radians() / f64::from(rate_rad_s);
            let taken_s = 1e-9 * bench.now.nanos() as f64;
            assert!(taken_s < 1.25 * least_s + 1.0, "{part} {target_mdeg}: {taken_s} s for {least_s} s");
        }
    }
}

/// K3: a rotor that sticks on the way is noticed within two windows, whatever it did before, and one that sticks under
/// a weak drive only is driven more strongly.
#[test]
fn law_a_rotor_that_sticks_on_the_way_is_noticed_in_time() {
    for target_mdeg in [3600e3, -3600e3] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        let command = bench.rest();
        let along = f64::from(direction(command.mode().unwrap()));
        for _ in 0..123_456 {
            bench.mdeg += 1.0 * along;
            assert_eq!(bench.moving(), command);
        }
        let stuck_at = bench.now;
        while bench.moving().mode().is_some() {}
        assert!(bench.now.nanos_since(stuck_at) < 2 * crate::progress_window::WINDOW_NANOS, "{target_mdeg}");
        assert_eq!(bench.phase(), PositioningPhase::Settling);
    }
    let mut bench = Bench::new(-400.0, 0.5);
    for _ in 0..20 {
        bench.rest();
        match bench.phase() {
            // Static friction: below 0.85 of the drive nothing moves.
            PositioningPhase::Cruise { cruise, .. } => {
                bench.cruise(if cruise.amplitude < 0.85 { 0.0 } else { 1.0 })
            }
            PositioningPhase::Burst { .. } => drop(bench.burst(1.0)),
            PositioningPhase::Holding => break,
            phase => assert_eq!(phase, PositioningPhase::Settling),
        }
    }
    assert_eq!(bench.phase(), PositioningPhase::Holding, "{}", bench.mdeg);
}

/// K4: a cruise that turns round on the way is noticed within a degree or a window.
#[test]
fn law_a_rotor_that_turns_back_on_the_way_is_noticed_in_time() {
    for back_mdeg in [10.0, 0.05] {
        let mut bench = Bench::new(3600e3, 0.5);
        bench.rest();
        for _ in 0..50_000 {
            bench.mdeg += 5.0;
            assert_eq!(bench.moving().mode(), Some(DriveMode::B));
        }
        let (turned_at, farthest_mdeg) = (bench.now, bench.mdeg);
        while bench.moving().mode().is_some() {
            bench.mdeg -= back_mdeg;
        }
        let within_a_degree = farthest_mdeg - bench.mdeg < 1e3 + 15.0 * 5e3;
        assert!(within_a_degree, "{back_mdeg}: {}", farthest_mdeg - bench.mdeg);
        assert!(bench.now.nanos_since(turned_at) < 2 * crate::progress_window::WINDOW_NANOS, "{back_mdeg}");
    }
}

/// K5: one mode is dead, the other is not. The move ends by saying which, and with the other the motor is still of use.
#[test]
fn law_a_lost_mode_is_told_from_a_stuck_rotor() {
    for (target_mdeg, parts, lost, usable_mdeg) in [
        (-700.0, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (-30.0, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (90e3, (1.0, 0.0), StopReason::ModeCLost, 300.0),
        (90e3, (0.0, 1.0), StopReason::ModeBLost, -700.0),
        (8.0, (0.0, 1.0), StopReason::ModeBLost, -30.0),
    ] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        let part = |mode, _| if mode == DriveMode::B { parts.0 } else { parts.1 };
        // As a rotor that has just come to rest: what is probed is measured first, and again after.
        let mut rests = 0;
        while !matches!(bench.phase(), PositioningPhase::Stopped(_)) && bench.positioning.probe.is_none() {
            bench.drive(part);
        }
        bench.sigma_mdeg = 9.0;
        while bench.phase() == PositioningPhase::Settling {
            rests += 1;
            bench.sigma_mdeg *= 0.99;
            bench.rest();
        }
        assert!(rests > 10 && bench.sigma_mdeg < 2.0, "{target_mdeg} {rests} {}", bench.sigma_mdeg);
        bench.sigma_mdeg = 0.1;
        let end = bench.end_by(part);
        assert_eq!(end, PositioningPhase::Stopped(lost), "{target_mdeg} at {}", bench.mdeg);
        let target_deg = 1e-3 * (bench.mdeg + usable_mdeg);
        bench.positioning.retarget(Target::try_new(target_deg, 0.001).unwrap(), bench.now);
        let driven = bench.rest().mode();
        assert_eq!(driven, Some(if lost == StopReason::ModeCLost { DriveMode::B } else { DriveMode::C }));
    }
}

/// K4.
#[test]
fn law_a_rotor_that_turns_the_wrong_way_is_given_up() {
    for target_mdeg in [-30.0, 300.0] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        assert_eq!(bench.end(-1.0), PositioningPhase::Stopped(StopReason::ModeInverted), "{target_mdeg}");
        assert!(bench.positioning.drives <= 4, "{}", bench.positioning.drives);
    }
    let mut bench = Bench::new(90e3, 0.5);
    let mut ticks = 0;
    while !matches!(bench.phase(), PositioningPhase::Stopped(_)) {
        let driven = bench.rest().mode().is_some();
        bench.mdeg -= if driven { 10.0 } else { 0.0 };
        ticks += 1;
    }
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::ModeInverted));
    assert!(ticks < 400 && bench.mdeg > -4e3, "{ticks} {}", bench.mdeg);
}

/// K6: a rotor that is thrown to and fro, never near the target: the number of drives is bounded, and so is the time.
#[test]
fn law_chatter_is_bounded_by_drives_and_by_the_deadline() {
    let mut bench = Bench::limited(0.0, 0.5, Limits { drives_max: 25, ..Limits::default() });
    for n in 0.. {
        assert!(n < 1000);
        bench.mdeg = if n % 2 == 0 { 30.0 } else { -40.0 };
        bench.rest();
        match bench.phase() {
            PositioningPhase::Stopped(why) => {
                assert_eq!(why, StopReason::TooManyDrives);
                break;
            }
            PositioningPhase::Burst { .. } => drop(bench.burst(1.0)),
            _ => (),
        }
    }
    assert_eq!(bench.positioning.drives, 26);
    let mut bench = Bench::limited(0.0, 0.5, Limits { deadline_nanos: 1_000_000, ..Limits::default() });
    bench.sigma_mdeg = 5.0;
    while bench.now.nanos() <= 1_000_000 {
        bench.rest();
    }
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::TimedOut));
}

/// K10: a target nearer than any burst: measuring alone decides.
#[test]
fn law_a_goal_closer_than_one_burst_ends() {
    for target_mdeg in [0.1, -0.1, 0.05, -0.05] {
        let mut bench = Bench::new(target_mdeg, 0.5);
        assert_eq!(bench.end(1.0), PositioningPhase::Holding, "{target_mdeg}");
        assert_eq!(bench.positioning.drives, 0);
    }
}

/// K7.
#[test]
fn law_travel_is_kept_to() {
    let limits = Limits { travel: Travel::try_new(-10.0, 50.0).unwrap(), ..Limits::default() };
    let mut bench = Bench::limited(90e3, 1.0, limits);
    assert_eq!(bench.rest(), DriveCommand::OFF);
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::OutOfTravel));
    let mut bench = Bench::limited(40e3, 1.0, limits);
    assert_eq!(bench.rest().mode(), Some(DriveMode::B));
    bench.mdeg = 51e3;
    assert_eq!(bench.moving(), DriveCommand::OFF);
    assert_eq!(bench.phase(), PositioningPhase::Stopped(StopReason::OutOfTravel));
}

/// K7: neither a cruise nor a burst keeps the coil warm for longer than is allowed.
#[test]
fn law_the_drive_is_never_on_for_longer_than_allowed() {
    for (target_mdeg, on_max_ticks) in [(90e3, 300), (-90e3, 300), (900.0, 20), (-700.0, 20)] {
        let on_max_nanos = on_max_ticks * TICK;
        let mut bench = Bench::limited(target_mdeg, 1.0, Limits { on_max_nanos, ..Limits::default() });
        assert!(bench.rest().mode().is_some(), "{target_mdeg}");
        let mut ticks = 1;
        while bench.moving().mode().is_some() {
            ticks += 1;
        }
        assert_eq!((ticks, bench.phase()), (on_max_ticks, PositioningPhase::Settling), "{target_mdeg}");
    }
}

/// K8: in hold the rotor is left alone until it is off for certain; a jolt is made good, even after the deadline.
#[test]
fn law_a_jolt_in_hold_is_made_good() {
    let mut bench = Bench::limited(0.0, 1.0, Limits { deadline_nanos: 1_000_000_000, ..Limits::default() });
    assert_eq!(bench.end(1.0), PositioningPhase::Holding);
    bench.now = bench.now.plus_nanos(5_000_000_000);
    bench.mdeg = 0.9;
    bench.rest();
    assert_eq!(bench.phase(), PositioningPhase::Holding);
    bench.mdeg = 50.0;
    bench.moving();
    assert_eq!(bench.phase(), PositioningPhase::Settling);
    assert_eq!(bench.end(1.0), PositioningPhase::Holding);
    assert!(bench.mdeg.abs() <= 1.0);
    bench.mdeg = -20.0;
    bench.rest();
    assert_eq!(bench.end(1.0), PositioningPhase::Holding, "moved without being noticed");
    assert!(bench.mdeg.abs() <= 1.0);
}
