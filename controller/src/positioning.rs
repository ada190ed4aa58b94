//! From where the rotor is to where it should be.
//!
//! ```text
//!                 far from target, estimate good                remaining <= coast, or on long enough
//!   +---------+ -------------------------------> +----------+ -------------------------------------+
//!   | Holding |                                  | Approach |                                      v
//!   +---------+ <------------------------------- +----------+ <------------------------------ +----------+
//!                 still, measured, in tolerance               still, measured, out of it      | Settling |
//!                                                                                             +----------+
//! ```
//!
//! The drive is on in `Approach` only. An estimate that is missing or too uncertain ends an approach; the deadline ends everything
//! in `TimedOut`, drive off.

use estimator::Estimate;
use motor_model::{Angle, DriveCommand, OutOfBounds, Time};

use crate::gear::{self, Gear};

/// Where to go, and how close is close enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    angle: Angle,
    tolerance: Angle,
}

impl Target {
    /// Finest tolerance in degrees: what the weakest bursts can still resolve.
    pub const TOLERANCE_MIN_DEG: f64 = 0.01;

    /// A target angle with a tolerance to either side.
    ///
    /// # Errors
    /// When the angle is beyond +-360,000 degrees, or the tolerance outside 0.01 to 10 degrees.
    pub fn try_new(angle_deg: f64, tolerance_deg: f64) -> Result<Self, OutOfBounds> {
        OutOfBounds::check("position.to_deg", angle_deg, -360_000.0, 360_000.0, "deg")?;
        OutOfBounds::check("position.tolerance_deg", tolerance_deg, Self::TOLERANCE_MIN_DEG, 10.0, "deg")?;
        Ok(Self { angle: Angle::from_degrees(angle_deg), tolerance: Angle::from_degrees(tolerance_deg) })
    }

    /// The target angle.
    pub fn angle(&self) -> Angle {
        self.angle
    }

    /// Distance from the target that still counts as reached.
    pub fn tolerance(&self) -> Angle {
        self.tolerance
    }
}

/// Times and thresholds of the state machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositioningTuning {
    /// Angle variance at which a rotor at rest counts as measured, in rad^2.
    pub measured_rad2: f32,
    /// Angle variance above which no drive is given, in rad^2.
    pub driveable_rad2: f32,
    /// The target counts as reached this far inside the tolerance, in rad: three standard deviations of that measurement, so that the rotor
    /// is where it is believed to be.
    pub margin_rad: f32,
    /// Time after which positioning gives up, in ns.
    pub deadline_nanos: u64,
}

impl Default for PositioningTuning {
    /// 1.5 milli-degrees measured, 4.5 of margin, half a degree driveable, 60 s.
    fn default() -> Self {
        Self {
            measured_rad2: 6.9e-10,
            driveable_rad2: 7.6e-5,
            margin_rad: 7.9e-5,
            deadline_nanos: 60_000_000_000,
        }
    }
}

/// What positioning is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// Drive on, since the instant given.
    Approach {
        /// The drive in use.
        gear: Gear,
        /// When it was switched on.
        since: Time,
    },
    /// Drive off, waiting for rest and a good measurement.
    Settling,
    /// At the target.
    Holding,
    /// The deadline passed before the target was reached.
    TimedOut,
}

/// The state machine.
#[derive(Clone, Copy, Debug)]
pub struct Positioning {
    target: Target,
    tuning: PositioningTuning,
    started_at: Time,
    phase: Phase,
    boost: Boost,
}

/// How much stronger than its gear an approach drives: more each time an approach leaves most of the way undone, since motors differ.
///
/// Stronger, not longer: weak mode B pushes clockwise while it rings up, but under it some motors then walk back.
#[derive(Clone, Copy, Debug)]
struct Boost {
    factor: f32,
    /// What remained when the last approach began, in rad.
    remained_rad: f32,
}

impl Boost {
    const NONE: Self = Self { factor: 1.0, remained_rad: 0.0 };
    const INCREMENT: f32 = 0.25;
    const FACTOR_MAX: f32 = 3.0;
    /// An approach that leaves more than this part of the way was too weak.
    const UNDONE: f32 = 0.7;

    /// For an approach that begins with `remaining_rad` to go.
    fn next(self, remaining_rad: f32) -> Self {
        let same_way = remaining_rad * self.remained_rad > 0.0;
        let undone = same_way && remaining_rad.abs() > Self::UNDONE * self.remained_rad.abs();
        let factor = if undone { (self.factor + Self::INCREMENT).min(Self::FACTOR_MAX) } else { 1.0 };
        Self { factor, remained_rad: remaining_rad }
    }
}

impl Positioning {
    /// Positioning to `target`, starting at `now` by measuring where the rotor is.
    pub fn new(target: Target, tuning: PositioningTuning, now: Time) -> Self {
        Self { target, tuning, started_at: now, phase: Phase::Settling, boost: Boost::NONE }
    }

    /// What it is doing.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The target.
    pub fn target(&self) -> Target {
        self.target
    }

    /// The command for the tick at `now`, on the present estimate.
    pub fn decide(&mut self, now: Time, estimate: Option<&Estimate<f32>>) -> DriveCommand {
        if self.phase != Phase::Holding && now.nanos_since(self.started_at) > self.tuning.deadline_nanos {
            self.phase = Phase::TimedOut;
        }
        self.phase = match (self.phase, estimate) {
            (Phase::TimedOut, _) => Phase::TimedOut,
            (Phase::Approach { .. }, None) => Phase::Settling,
            (phase, None) => phase,
            (Phase::Approach { gear, since }, Some(estimate)) => self.approach(gear, since, now, estimate),
            (Phase::Settling, Some(estimate)) => self.settle(now, estimate, self.tuning.margin_rad),
            (Phase::Holding, Some(estimate)) => self.settle(now, estimate, 0.0),
        };
        match self.phase {
            Phase::Approach { gear, .. } => {
                DriveCommand::saturating(gear.mode, gear.amplitude * self.boost.factor)
            }
            Phase::Settling | Phase::Holding | Phase::TimedOut => DriveCommand::OFF,
        }
    }

    /// Drive on: go on, or cut.
    fn approach(&self, gear: Gear, since: Time, now: Time, estimate: &Estimate<f32>) -> Phase {
        let clockwise = matches!(gear.mode, motor_model::DriveMode::B);
        let sense = if clockwise { 1.0 } else { -1.0 };
        let remaining_rad = sense * self.remaining_rad(estimate);
        let coast_rad = (sense * estimate.rate_rad_s).max(0.0) * gear.coast_s + gear.short_rad;
        let arrived = remaining_rad <= coast_rad;
        let too_long = now.nanos_since(since) >= gear.longest_nanos;
        let uncertain = estimate.angle_rad2 > self.tuning.driveable_rad2;
        if arrived || too_long || uncertain { Phase::Settling } else { Phase::Approach { gear, since } }
    }

    /// Drive off: wait, stay, or go.
    fn settle(&mut self, now: Time, estimate: &Estimate<f32>, margin_rad: f32) -> Phase {
        if !estimate.resting || estimate.angle_rad2 > self.tuning.measured_rad2 {
            return self.phase;
        }
        let remaining_rad = self.remaining_rad(estimate);
        let tolerance_rad: f32 = self.target.tolerance.radians_since(Angle::ZERO);
        if remaining_rad.abs() <= tolerance_rad - margin_rad {
            Phase::Holding
        } else {
            self.boost = self.boost.next(remaining_rad);
            Phase::Approach { gear: gear::select(remaining_rad), since: now }
        }
    }

    fn remaining_rad(&self, estimate: &Estimate<f32>) -> f32 {
        self.target.angle.radians_since(estimate.angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::DriveMode;

    fn estimate(deg: f64, rate_rad_s: f32, resting: bool) -> Estimate<f32> {
        Estimate {
            at: Time::ZERO,
            angle: Angle::from_degrees(deg),
            rate_rad_s,
            angle_rad2: 1e-10,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 1e-4,
            resting,
        }
    }

    fn positioning(deg: f64) -> Positioning {
        Positioning::new(Target::try_new(deg, 0.02).unwrap(), PositioningTuning::default(), Time::ZERO)
    }

    #[test]
    fn law_no_drive_without_an_estimate() {
        let mut positioning = positioning(90.0);
        assert_eq!(positioning.decide(Time::ZERO, None), DriveCommand::OFF);
        assert_eq!(
            positioning.decide(Time::ZERO, Some(&estimate(0.0, 0.0, true))).mode(),
            Some(DriveMode::B)
        );
        assert_eq!(
            positioning.decide(Time::ZERO, None),
            DriveCommand::OFF,
            "the estimate was lost on the way"
        );
    }

    #[test]
    fn law_an_uncertain_estimate_ends_the_approach() {
        let mut positioning = positioning(90.0);
        positioning.decide(Time::ZERO, Some(&estimate(0.0, 0.0, true)));
        let lost = Estimate { angle_rad2: 1.0, ..estimate(1.0, 10.0, false) };
        assert_eq!(positioning.decide(Time::ZERO, Some(&lost)), DriveCommand::OFF);
        assert_eq!(positioning.phase(), Phase::Settling);
    }

    #[test]
    fn exact_cut_off_leaves_the_coast() {
        let mut positioning = positioning(90.0);
        positioning.decide(Time::ZERO, Some(&estimate(0.0, 0.0, true)));
        let (rate, gear) = (10.0_f32, gear::CLOCKWISE[0]);
        let coast_deg = f64::from((rate * gear.coast_s + gear.short_rad).to_degrees());
        let before = estimate(90.0 - coast_deg - 0.01, rate, false);
        assert_eq!(positioning.decide(Time::ZERO, Some(&before)).mode(), Some(DriveMode::B));
        let after = estimate(90.0 - coast_deg + 0.01, rate, false);
        assert_eq!(positioning.decide(Time::ZERO, Some(&after)), DriveCommand::OFF);
    }

    #[test]
    fn law_holding_is_entered_inside_the_margin_and_left_at_the_tolerance_and_the_deadline_stops_all() {
        let mut positioning = positioning(0.0);
        positioning.decide(Time::ZERO, Some(&estimate(0.015, 0.0, true)));
        assert_eq!(positioning.phase(), Phase::Holding);
        positioning.decide(Time::ZERO, Some(&estimate(0.019, 0.0, true)));
        assert_eq!(positioning.phase(), Phase::Holding);
        let command = positioning.decide(Time::ZERO, Some(&estimate(0.021, 0.0, true)));
        assert_eq!(command.mode(), Some(DriveMode::C));
        let late = Time::from_micros(61_000_000);
        assert_eq!(positioning.decide(late, Some(&estimate(0.035, 0.0, true))), DriveCommand::OFF);
        assert_eq!(positioning.phase(), Phase::TimedOut);
    }

    /// A motor that does not move is driven a quarter harder each time, up to three times; one that does, from the start again.
    #[test]
    fn exact_bursts_grow_until_they_move_the_rotor() {
        let mut positioning = positioning(0.1);
        let mut now = Time::ZERO;
        let mut burst = |degrees: f64| {
            let estimate = estimate(degrees, 0.0, true);
            let amplitude = positioning.decide(now, Some(&estimate)).amplitude();
            now = now.plus_nanos(3_000_000);
            assert_eq!(positioning.decide(now, Some(&estimate)), DriveCommand::OFF);
            amplitude
        };
        for quarters in [4.0_f32, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 12.0] {
            assert!((burst(0.0) - 0.2 * quarters / 4.0).abs() < 1e-6, "{quarters}");
        }
        assert!((burst(0.05) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn exact_target_bounds() {
        for bad in [f64::NAN, 4e5, -4e5] {
            assert_eq!(Target::try_new(bad, 0.02).unwrap_err().key, "position.to_deg");
        }
        assert_eq!(Target::try_new(0.0, 0.001).unwrap_err().key, "position.tolerance_deg");
    }
}
