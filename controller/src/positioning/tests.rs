//! The state machine on a rotor that turns as a test prescribes.

use super::*;
use crate::response_map::Cruise;
use crate::target::{Limits, Travel};
use estimator::Reason;

mod amplitudes;
mod faults;
mod waits;

const TICK: u64 = crate::TICK_NANOS;
/// Longer than the stator of Table 1 rings, in ns.
const RING_DOWN: u64 = 17_000_000;

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

/// A rotor, its estimate, and the time of the loop.
struct Scenario {
    positioning: Positioning,
    now: Time,
    mdeg: f64,
    sigma_mdeg: f32,
    rate_rad_s: f32,
}

impl Scenario {
    fn new(target_mdeg: f64, tolerance_mdeg: f64) -> Self {
        Self::limited(target_mdeg, tolerance_mdeg, Limits::default())
    }

    fn limited(target_mdeg: f64, tolerance_mdeg: f64, limits: Limits) -> Self {
        let target = Target::try_new(1e-3 * target_mdeg, 1e-3 * tolerance_mdeg).unwrap();
        let tuning = PositioningTuning { limits, ..PositioningTuning::default() };
        let positioning = Positioning::new(map(), target, tuning, Time::ZERO);
        let mut scenario = Self { positioning, now: Time::ZERO, mdeg: 0.0, sigma_mdeg: 0.1, rate_rad_s: 0.0 };
        scenario.ring_down();
        scenario
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

    /// Passes the time in which the stator rings.
    fn ring_down(&mut self) {
        self.now = self.now.plus_nanos(RING_DOWN);
    }

    /// A tick at rest, measured well.
    fn rest(&mut self) -> DriveCommand {
        self.now = self.now.plus_nanos(TICK);
        let estimate = self.estimate(true, self.sigma_mdeg);
        self.positioning.decide(map(), self.now, Some(&estimate), Health::Good)
    }

    /// A tick in motion, when the variance of the filter is large.
    fn moving(&mut self) -> DriveCommand {
        self.now = self.now.plus_nanos(TICK);
        let estimate = self.estimate(false, 20.0);
        self.positioning.decide(map(), self.now, Some(&estimate), Health::Good)
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
        self.ring_down();
        ticks
    }

    /// Lets a cruise run until it is cut; the rotor turns at `part` of the rate that the map says, and coasts.
    fn cruise(&mut self, part: f32) {
        self.cruise_by(|cruise| part * cruise.rate_rad_s);
    }

    /// The same at a rate in rad/s, clockwise positive, of each cruise.
    fn cruise_by(&mut self, mut rate_rad_s: impl FnMut(&Cruise) -> f32) {
        while let PositioningPhase::Cruise { cruise, .. } = self.phase() {
            self.rate_rad_s = rate_rad_s(&cruise);
            self.mdeg += 1e3 * f64::from((self.rate_rad_s * 1e-5).to_degrees());
            if self.moving().mode().is_none() {
                self.mdeg += 1e3 * f64::from((self.rate_rad_s * cruise.coast_s).to_degrees());
            }
        }
        self.rate_rad_s = 0.0;
        self.ring_down();
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
    let mut scenario = Scenario::new(90e3, 1.0);
    assert_eq!(scenario.positioning.decide(map(), Time::ZERO, None, Health::Waiting), DriveCommand::OFF);
    assert_eq!(scenario.phase(), PositioningPhase::Waiting(Health::Waiting));
    scenario.rest();
    assert_eq!(scenario.rest().mode(), Some(DriveMode::B), "health has returned");
}

/// K2.
#[test]
fn law_an_estimate_lost_on_the_way_switches_the_drive_off_in_the_same_tick() {
    for target_mdeg in [90e3, -90e3, -30.0, 300.0] {
        let mut scenario = Scenario::new(target_mdeg, 1.0);
        assert!(scenario.rest().mode().is_some(), "{target_mdeg}");
        scenario.now = scenario.now.plus_nanos(TICK);
        let estimate = scenario.estimate(false, 20.0);
        let lost = Health::Unusable(Reason::FramesRefused);
        assert_eq!(
            scenario.positioning.decide(map(), scenario.now, Some(&estimate), lost),
            DriveCommand::OFF
        );
        assert_eq!(scenario.phase(), PositioningPhase::Waiting(lost));
    }
}

#[test]
fn exact_a_cruise_is_cut_where_the_coast_remains() {
    // Near enough for the gentlest, so that no weaker one follows.
    let mut scenario = Scenario::new(2.2e3, 1.0);
    scenario.rest();
    let PositioningPhase::Cruise { cruise, .. } = scenario.phase() else { panic!("{:?}", scenario.phase()) };
    assert_eq!(Some(cruise), map().cruise_within(DriveMode::B, 1.0, 0.0));
    scenario.rate_rad_s = cruise.rate_rad_s;
    let cut_rad = cruise.rate_rad_s * cruise.coast_s - 0.5 * cruise.coast_sd_rad;
    scenario.mdeg = 2.2e3 - 1e3 * f64::from(cut_rad.to_degrees()) - 10.0;
    assert_eq!(scenario.moving().mode(), Some(DriveMode::B));
    scenario.mdeg += 20.0;
    assert_eq!(scenario.moving(), DriveCommand::OFF);
    assert!(matches!(scenario.phase(), PositioningPhase::Settling(_)));
}

/// Weaker and weaker as the target comes near, never stronger again, and in no other mode.
#[test]
fn law_cruises_weaken_near_the_target() {
    for sign in [1.0, -1.0] {
        let mut scenario = Scenario::new(sign * 90e3, 1.0);
        let mut last = scenario.rest();
        let (mode, mut amplitudes) = (last.mode(), 1);
        assert!((last.amplitude() - 1.0).abs() < f32::EPSILON);
        while last.mode().is_some() {
            let PositioningPhase::Cruise { cruise, .. } = scenario.phase() else {
                panic!("{:?}", scenario.phase())
            };
            // Six tenths of the map's rate, in a tick of 10 us.
            scenario.mdeg += 6e-3 * f64::from(cruise.rate_rad_s.to_degrees());
            let next = scenario.moving();
            if next.mode().is_some() {
                assert!(next.amplitude() <= last.amplitude() && next.mode() == mode);
                amplitudes += u32::from(next.amplitude() < last.amplitude());
            }
            last = next;
        }
        assert!(amplitudes >= 3, "{sign} {amplitudes}");
    }
}

/// From one mode to the other only by way of a rotor at rest, so that both are never driven.
#[test]
fn law_between_the_modes_the_rotor_comes_to_rest() {
    for target_mdeg in [40.0, -40.0, 900.0, -5e3, 5e3] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        let (mut last_mode, mut rested) = (None, true);
        for _ in 0..3000 {
            let before = scenario.phase();
            let command = scenario.rest();
            rested |= matches!(before, PositioningPhase::Settling(_));
            if let Some(mode) = command.mode() {
                assert!(rested || last_mode == Some(mode), "{target_mdeg}");
                (last_mode, rested) = (Some(mode), false);
            }
            // Too far each time, so that it has to come back.
            match scenario.phase() {
                PositioningPhase::Burst { .. } => drop(scenario.burst(2.0)),
                PositioningPhase::Cruise { .. } => {
                    scenario.mdeg += 1.3 * (target_mdeg - scenario.mdeg);
                    assert_eq!(scenario.moving(), DriveCommand::OFF);
                    scenario.ring_down();
                }
                _ => (),
            }
        }
        assert_eq!(scenario.phase(), PositioningPhase::Holding, "{target_mdeg} {}", scenario.mdeg);
    }
}

/// Whole turns count: ten of them and a step more end where they should, and so does the way back.
#[test]
fn law_many_turns_are_no_other_than_one() {
    let mut scenario = Scenario::new(3_600_020.0, 0.5);
    scenario.mdeg = 3_600_000.0;
    assert_eq!(scenario.end(1.0), PositioningPhase::Holding);
    assert!((scenario.mdeg - 3_600_020.0).abs() <= 0.5, "{}", scenario.mdeg);
    scenario.positioning.retarget(Target::try_new(-720.0, 0.0005).unwrap(), scenario.now);
    assert_eq!(scenario.rest().mode(), Some(DriveMode::C), "eleven turns back, not none");
}

#[test]
fn exact_a_burst_is_on_for_its_ticks() {
    for target_mdeg in [-4.0, -40.0, 8.0, 300.0] {
        let mut scenario = Scenario::new(target_mdeg, 0.5);
        scenario.rest();
        let PositioningPhase::Burst { burst, .. } = scenario.phase() else {
            panic!("{target_mdeg}: {:?}", scenario.phase())
        };
        assert_eq!(scenario.burst(1.0), burst.ticks);
        assert!(matches!(scenario.phase(), PositioningPhase::Settling(_)));
    }
}

/// Motors that turn by half or by twice as much as the map says: all are brought to the target.
#[test]
fn law_bursts_end_at_the_target_whatever_the_motor() {
    for part in [0.5, 0.8, 1.0, 1.25, 2.0] {
        for target_mdeg in [-3.0, -30.0, -700.0, 2.0, 25.0, 900.0] {
            let mut scenario = Scenario::new(target_mdeg, 0.5);
            assert_eq!(
                scenario.end(part),
                PositioningPhase::Holding,
                "{part} {target_mdeg} at {}",
                scenario.mdeg
            );
            assert!((scenario.mdeg - target_mdeg).abs() <= 0.5, "{part} {target_mdeg}");
        }
    }
}

/// What one move has learnt, the next one uses: its first step goes a tenth of the way wrong at most, in a motor of
/// half as much again.
#[test]
fn law_the_second_move_profits_from_the_first() {
    let left = |scenario: &mut Scenario, target_mdeg: f64| {
        let way = target_mdeg - scenario.mdeg;
        scenario.rest();
        scenario.burst(1.5);
        (target_mdeg - scenario.mdeg) / way
    };
    let mut scenario = Scenario::new(-4.0, 0.5);
    assert!(left(&mut scenario, -4.0) < -0.4);
    assert_eq!(scenario.end(1.5), PositioningPhase::Holding);
    scenario.positioning.retarget(Target::try_new(-0.008, 0.0005).unwrap(), scenario.now);
    let second = left(&mut scenario, -8.0);
    assert!(second.abs() < 0.1, "{second}");
}

/// K1.
#[test]
fn law_a_target_changed_on_the_way_is_the_one_that_counts() {
    let mut scenario = Scenario::new(90e3, 1.0);
    scenario.rest();
    scenario.mdeg = 30e3;
    scenario.rate_rad_s = 5.0;
    assert_eq!(scenario.moving().mode(), Some(DriveMode::B));
    // Farther: on it goes. Behind: the drive is cut, and then reversed.
    scenario.positioning.retarget(Target::try_new(120.0, 0.001).unwrap(), scenario.now);
    assert_eq!(scenario.moving().mode(), Some(DriveMode::B));
    scenario.positioning.retarget(Target::try_new(-20.0, 0.001).unwrap(), scenario.now);
    assert_eq!(scenario.moving(), DriveCommand::OFF);
    scenario.rate_rad_s = 0.0;
    assert_eq!(scenario.rest().mode(), Some(DriveMode::C));
}

/// A cruise that is weak because its target is near grows strong again for a target far away, and is the same for one
/// that asks for the same.
#[test]
fn law_a_weak_cruise_is_as_strong_as_another_target_asks_for() {
    for mode in [DriveMode::B, DriveMode::C] {
        let near_mdeg = 1e3 * f64::from((1.01 * direction(mode) * map().cruise_from_rad(mode)).to_degrees());
        let mut scenario = Scenario::new(near_mdeg, 0.5);
        let weak = scenario.rest();
        assert!(matches!(scenario.phase(), PositioningPhase::Cruise { .. }), "{weak:?}");
        assert!(weak.amplitude() < 1.0, "{weak:?}");
        let to = |mdeg: f64| Target::try_new(1e-3 * mdeg, 5e-4).unwrap();
        scenario.positioning.retarget(to(near_mdeg), scenario.now);
        assert_eq!(scenario.moving(), weak);
        scenario.positioning.retarget(to(100.0 * near_mdeg), scenario.now);
        let strong = scenario.moving();
        assert_eq!((strong.mode(), strong.amplitude()), (weak.mode(), 1.0));
        assert_eq!(scenario.moving(), strong);
    }
}

#[test]
fn law_cancelled_stays_off_until_there_is_a_new_target() {
    let mut scenario = Scenario::new(90e3, 1.0);
    scenario.rest();
    scenario.positioning.cancel();
    for _ in 0..3 {
        assert_eq!(scenario.rest(), DriveCommand::OFF);
    }
    assert_eq!(scenario.phase(), PositioningPhase::Stopped(StopReason::Cancelled));
    scenario.positioning.retarget(Target::try_new(90.0, 0.001).unwrap(), scenario.now);
    assert_eq!(scenario.rest().mode(), Some(DriveMode::B));
}

/// Either side of the bound and of zero, for bounds of both signs; a variance of zero leaves the sign alone.
#[test]
fn dual_a_bound_by_squares_is_that_by_the_root() {
    for sd in [0.0_f32, 1e-6, 0.03] {
        for sigmas in [-3.0_f32, -0.5, 0.5, 3.0] {
            for part in [-4.0, -2.9, -0.6, -0.4, 0.4, 0.6, 2.9, 4.0] {
                for x in [part * sd, part] {
                    let expected = x <= sigmas * sd;
                    assert_eq!(is_at_most(x, sigmas, sd * sd), expected, "{x} {sigmas} {sd}");
                }
            }
        }
    }
}

/// A burst that is cut, since the next target lies out of the travel, turns by less than was forecast: nothing is
/// learnt of it.
#[test]
fn exact_a_burst_that_another_target_cuts_teaches_nothing() {
    let travel = Travel::try_new(-10.0, 10.0).unwrap();
    let mut scenario = Scenario::limited(-20.0, 1.0, Limits { travel, ..Limits::default() });
    let family = (0..100_000).find_map(|_| {
        scenario.rest();
        let phase = scenario.positioning.phase();
        if let PositioningPhase::Burst { family, .. } = phase { Some(family) } else { None }
    });
    let family = family.expect("a burst");
    // The drive has made the angle uncertain: what is seen then does not depend on the angle before.
    let driven = Estimate { angle_rad2: 1e-8, ..scenario.estimate(true, 0.1) };
    let seen = Estimate { angle_rad2: 1e-10, ..driven };
    let before = scenario.positioning.correction.scale(family);
    scenario.positioning.retarget(Target::try_new(50.0, 0.001).unwrap(), scenario.now);
    assert_eq!(scenario.positioning.phase(), PositioningPhase::Stopped(StopReason::OutOfTravel));
    scenario.positioning.rest.note_variance(&driven, 0.0);
    scenario.positioning.retarget(Target::try_new(0.0, 0.001).unwrap(), scenario.now);
    let after = scenario.positioning.corrected(&seen).scale(family);
    assert!((after - before).abs() < 1e-6, "{before} {after}");
}
