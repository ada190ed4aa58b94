//! The state machine on a motor that turns as the prior map says, but for a factor.

extern crate std;

mod coast;
mod lost;

use super::coasts::Coast;
use super::findings::FindingKind;
use super::*;
use crate::response_map::{Family, direction};
use estimator::{Estimate, Health};
use motor_model::{Angle, AngleAccumulator, Time};

/// A motor whose every drive turns it by `factor` of what the map says, with a ripple, and which stops at once.
struct IdealMotor {
    commissioning: Commissioning,
    experimenter: Experimenter,
    factor: f32,
    now: Time,
    angle: AngleAccumulator<f32>,
    off_since: Time,
    /// Shortest time with the drive off between two bursts or cruises, in ns.
    shortest_off_nanos: u64,
    /// Whether the filter has a fresh angle after each burst, and not that of before.
    independent: bool,
}

impl IdealMotor {
    fn new(factor: f32) -> Self {
        let instruments = Instruments { vibrometer: None, ..Instruments::default() };
        let commissioning = Commissioning::new(&instruments);
        let experimenter = Experimenter::new(ExperimentTuning::new(&instruments), Time::ZERO);
        let (now, angle, off_since) = (Time::ZERO, AngleAccumulator::at(Angle::ZERO), Time::ZERO);
        Self {
            commissioning,
            experimenter,
            factor,
            now,
            angle,
            off_since,
            shortest_off_nanos: u64::MAX,
            independent: true,
        }
    }

    /// What the filter says: sure once the drive has been off for 5 ms, and, as filters do, at rest until a driven
    /// rotor has been seen to move for 1 ms.
    fn estimate(&self, driven_nanos: u64) -> Estimate<f32> {
        let sure = self.now.nanos_since(self.off_since) > 5_000_000 && driven_nanos == 0;
        Estimate {
            at: self.now,
            angle: self.angle.angle(),
            rate_rad_s: 0.0,
            angle_rad2: if sure || !self.independent { 1e-12 } else { 1e-7 },
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 0.0,
            resting: sure || driven_nanos < 1_000_000,
        }
    }

    fn rate_rad_s(&self) -> f32 {
        let map = ResponseMap::table_1();
        let ripple = if (self.now.nanos() / 50_000_000).is_multiple_of(2) { 1.05 } else { 0.95 };
        match self.commissioning.row().filter(|_| self.is_driven()) {
            Some(MapRow::Cruise(index)) => map.cruises()[index].rate_rad_s * self.factor * ripple,
            Some(MapRow::Burst(family, index)) => {
                let burst = map.bursts(family)[index];
                direction(family.mode()) * burst.turn_rad / (1e-5 * burst.ticks as f32) * self.factor
            }
            None => 0.0,
        }
    }

    fn is_driven(&self) -> bool {
        matches!(self.experimenter.phase(), ExperimentPhase::Cruising | ExperimentPhase::Bursting)
    }

    /// Takes a response and orders the next experiment; how it ended, once it has.
    fn plan(&mut self) -> Option<CommissioningEnd> {
        match self.experimenter.phase() {
            ExperimentPhase::Ended(end) => return Some(end),
            ExperimentPhase::Ready => {}
            _ => return None,
        }
        if let Some(response) = self.experimenter.response() {
            self.commissioning.take(ResponseMap::table_1(), response);
        }
        match self.commissioning.next(ResponseMap::table_1()) {
            Some(experiment) => {
                assert!(self.experimenter.order(experiment));
                assert!(!self.experimenter.order(experiment), "one at a time");
                None
            }
            None => Some(CommissioningEnd::Enough),
        }
    }

    /// Runs until it ends.
    fn run(&mut self) -> Commissioned {
        let (mut driven_nanos, mut was_on) = (0, false);
        loop {
            let estimate = self.estimate(driven_nanos);
            let command = self.experimenter.decide(self.now, Some(&estimate), Health::Good);
            let is_on = command != DriveCommand::OFF;
            if is_on && !was_on {
                self.shortest_off_nanos = self.shortest_off_nanos.min(self.now.nanos_since(self.off_since));
            }
            was_on = is_on;
            if let Some(end) = self.plan() {
                let time_s = self.now.seconds_since(Time::ZERO);
                return self.commissioning.result(ResponseMap::table_1(), end, time_s);
            }
            driven_nanos = if is_on { driven_nanos + crate::TICK_NANOS } else { 0 };
            if is_on {
                self.off_since = self.now;
            }
            self.angle.turn_by_radians(1e-5 * self.rate_rad_s());
            self.now = self.now.plus_nanos(crate::TICK_NANOS);
        }
    }
}

/// The factor comes back in every row that was measured by its own drive and, within the shape that the prior leaves
/// open, in the others. It takes less than half a minute.
#[test]
fn law_a_motor_of_another_factor_is_found() {
    for factor in [0.8, 1.2] {
        let mut motor = IdealMotor::new(factor);
        let found = motor.run();
        assert_eq!(found.end, CommissioningEnd::Enough);
        assert!(found.time_s < 30.0, "{}", found.time_s);
        assert_eq!(found.findings.iter().count(), 0);
        let map = found.map.unwrap();
        for family in [Family::Step, Family::Walk] {
            for (own, prior) in map.bursts(family).iter().zip(ResponseMap::table_1().bursts(family)) {
                // Each was measured to a hundredth, or follows the factor of its family.
                let off = own.turn_rad / prior.turn_rad - factor;
                assert!(off.abs() < 0.02, "{family:?} {own:?} {off}");
            }
        }
        let full = map.strongest_cruise(DriveMode::C, 1.0).unwrap();
        assert!((full.rate_rad_s / -1.539 - factor).abs() < 0.05, "{full:?}");
    }
}

/// A filter that keeps its angle through a burst would show too short a turn. Such a turn counts with the variance of
/// the whole turn beside its own, a prior of a fifth with a 25th of that: some ten trains weigh less than the prior,
/// and move the map by less than half of the way.
#[test]
fn law_turns_that_depend_on_the_angle_before_teach_little() {
    let mut motor = IdealMotor { independent: false, ..IdealMotor::new(1.2) };
    let map = motor.run().map.unwrap();
    for (own, prior) in map.bursts(Family::Step).iter().zip(ResponseMap::table_1().bursts(Family::Step)) {
        assert!(own.turn_rad / prior.turn_rad < 1.1, "{own:?}");
    }
}

/// Bursts that follow one another are driven from rest: the stator has rung down for five of its times of 4 ms.
#[test]
fn law_every_drive_begins_after_the_ring_down() {
    let mut motor = IdealMotor::new(1.0);
    motor.run();
    assert!(motor.shortest_off_nanos >= 20_000_000, "{}", motor.shortest_off_nanos);
}

/// A motor that nothing turns costs three runs of each mode, of a second each, and a second to begin; it is refused.
#[test]
fn law_a_dead_motor_is_refused() {
    let found = IdealMotor::new(0.0).run();
    assert_eq!(found.map, Err(Unfit::NothingTurns));
    assert!(found.time_s < 7.0, "{}", found.time_s);
}

#[test]
fn law_a_motor_that_turns_the_other_way_is_refused() {
    let found = IdealMotor::new(-0.7).run();
    assert!(matches!(found.map, Err(Unfit::OtherWay { .. })), "{:?}", found.map);
}

/// Without an estimate nothing is driven, and it ends once the camera has been blind for too long.
#[test]
fn law_without_an_estimate_nothing_is_driven() {
    let instruments = Instruments::default();
    let mut experimenter = Experimenter::new(ExperimentTuning::new(&instruments), Time::ZERO);
    let mut now = Time::ZERO;
    while experimenter.phase() != ExperimentPhase::Ended(CommissioningEnd::NoEstimate) {
        assert_eq!(experimenter.decide(now, None, Health::Waiting), DriveCommand::OFF);
        now = now.plus_nanos(1_000_000);
        assert!(now.nanos() < 10_000_000_000, "it ends");
    }
    let commissioning = Commissioning::new(&instruments);
    let found = commissioning.result(ResponseMap::table_1(), CommissioningEnd::NoEstimate, 1.0);
    assert_eq!(found.map, Err(Unfit::NoEstimate));
}

/// An experimenter that is ready, with the time and the estimate of a rotor at rest.
fn ready() -> (Experimenter, Time, Estimate<f32>) {
    let instruments = Instruments { vibrometer: None, ..Instruments::default() };
    let mut experimenter = Experimenter::new(ExperimentTuning::new(&instruments), Time::ZERO);
    let estimate = IdealMotor { now: Time::from_nanos(1_000_000_000), ..IdealMotor::new(1.0) }.estimate(0);
    let mut now = Time::ZERO;
    while experimenter.phase() != ExperimentPhase::Ready {
        experimenter.decide(now, Some(&estimate), Health::Good);
        now = now.plus_nanos(crate::TICK_NANOS);
        assert!(now.nanos() < 1_000_000_000, "it comes to rest");
    }
    (experimenter, now, estimate)
}

/// Nothing is driven that is not ordered, however long nothing is.
#[test]
fn law_what_is_not_ordered_is_not_driven() {
    let (mut experimenter, mut now, estimate) = ready();
    assert_eq!((experimenter.number(), experimenter.response()), (0, None));
    for _ in 0..100_000 {
        assert_eq!(experimenter.decide(now, Some(&estimate), Health::Good), DriveCommand::OFF);
        now = now.plus_nanos(crate::TICK_NANOS);
    }
    assert_eq!(experimenter.phase(), ExperimentPhase::Ready);
}

/// Each burst of a train is as long as was ordered, to the tick, and there are as many, whatever is ordered meanwhile.
/// Then the response is there, and stays through a moment without an estimate.
#[test]
fn exact_a_train_is_driven_as_ordered() {
    let (mut experimenter, mut now, estimate) = ready();
    let train = Experiment::Train { mode: DriveMode::C, amplitude: 0.5, offset_hz: 0.0, ticks: 7, count: 3 };
    assert!(experimenter.order(train));
    let (mut bursts, mut driven) = (std::vec::Vec::new(), 0);
    while experimenter.phase() != ExperimentPhase::Ready {
        let command = experimenter.decide(now, Some(&estimate), Health::Good);
        if command == DriveCommand::OFF {
            bursts.extend((driven > 0).then_some(driven));
            driven = 0;
        } else {
            assert_eq!((command.mode(), command.amplitude()), (Some(DriveMode::C), 0.5));
            driven += 1;
            assert!(!experimenter.order(Experiment::Cruise {
                mode: DriveMode::B,
                amplitude: 1.0,
                offset_hz: 0.0
            }));
        }
        now = now.plus_nanos(crate::TICK_NANOS);
    }
    assert_eq!(bursts, [7, 7, 7]);
    let response = experimenter.response().cloned();
    assert!(matches!(response, Some(Response::Train { turned_rad, .. }) if turned_rad.abs() < 1e-9));
    experimenter.decide(now, None, Health::Waiting);
    assert_eq!(experimenter.response(), None);
    while experimenter.phase() != ExperimentPhase::Ready {
        now = now.plus_nanos(crate::TICK_NANOS);
        experimenter.decide(now, Some(&estimate), Health::Good);
    }
    assert_eq!((experimenter.response().cloned(), experimenter.number()), (response, 1));
}

const BURST: Experiment =
    Experiment::Train { mode: DriveMode::C, amplitude: 1.0, offset_hz: 0.0, ticks: 9, count: 1 };

/// A camera that is silent for two seconds and more ends it: a rotor that is not seen is not one that never rests.
#[test]
fn law_a_silent_camera_is_told_from_a_rotor_that_never_rests() {
    let (mut experimenter, mut now, estimate) = ready();
    assert!(experimenter.order(BURST));
    let wide = Health::Unusable(estimator::Reason::Uncertain);
    for tick in 0..500_000 {
        now = now.plus_nanos(crate::TICK_NANOS);
        let health = if tick < 5 { Health::Good } else { wide };
        experimenter.decide(now, Some(&Estimate { resting: false, ..estimate }), health);
    }
    assert_eq!(experimenter.phase(), ExperimentPhase::Ended(CommissioningEnd::NoEstimate));
}

/// An estimate that is only wide begins nothing: the order waits.
#[test]
fn law_an_order_waits_for_a_good_estimate() {
    let (mut experimenter, mut now, estimate) = ready();
    assert!(experimenter.order(Experiment::Cruise { mode: DriveMode::C, amplitude: 1.0, offset_hz: 0.0 }));
    let wide = Health::Unusable(estimator::Reason::Uncertain);
    for _ in 0..1000 {
        assert_eq!(experimenter.decide(now, Some(&estimate), wide), DriveCommand::OFF);
        assert_eq!(experimenter.phase(), ExperimentPhase::Resting, "not ready for another order");
        now = now.plus_nanos(crate::TICK_NANOS);
    }
    assert_ne!(experimenter.decide(now, Some(&estimate), Health::Good), DriveCommand::OFF);
}

/// The time ends whatever is under way, in its tick.
#[test]
fn law_the_time_ends_a_drive() {
    let (mut experimenter, mut now, estimate) = ready();
    assert!(experimenter.order(Experiment::Sweep { mode: DriveMode::B, amplitude: 1.0 }));
    experimenter.tuning.time_max_nanos = now.nanos() + 10_000_000;
    while experimenter.decide(now, Some(&estimate), Health::Good) != DriveCommand::OFF {
        now = now.plus_nanos(crate::TICK_NANOS);
    }
    assert_eq!(now.nanos(), experimenter.tuning.time_max_nanos);
    assert_eq!(experimenter.phase(), ExperimentPhase::Ended(CommissioningEnd::TimeOver));
}
