//! What is asked of positioning, and the limits within which it may do it.

use motor_model::{Angle, DriveCommand, OutOfBounds};

/// A target angle and its tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    angle: Angle,
    tolerance: Angle,
}

impl Target {
    /// Smallest tolerance in degrees: 1,193 units of an angle, less than the shortest burst turns the rotor. Which
    /// tolerance a camera can show, and in what time, is said by [`crate::MoveForecast`].
    pub const TOLERANCE_MIN_DEG: f64 = 0.0001;
    /// Largest target in degrees to either side: a thousand turns. An assumption.
    const ANGLE_MAX_DEG: f64 = 360_000.0;

    /// A target angle with a tolerance to either side.
    ///
    /// # Errors
    /// When the angle is beyond +-360,000 degrees, or the tolerance outside 0.0001 to 10 degrees.
    pub fn try_new(angle_deg: f64, tolerance_deg: f64) -> Result<Self, OutOfBounds> {
        let max = Self::ANGLE_MAX_DEG;
        OutOfBounds::check("position.to_deg", angle_deg, -max, max, "deg")?;
        OutOfBounds::check("position.tolerance_deg", tolerance_deg, Self::TOLERANCE_MIN_DEG, 10.0, "deg")?;
        Ok(Self { angle: Angle::from_degrees(angle_deg), tolerance: Angle::from_degrees(tolerance_deg) })
    }

    /// The target `by_deg` farther, clockwise positive, with the same tolerance. The move is relative to this target
    /// and not to where the rotor came to rest, so that errors do not add up.
    ///
    /// # Errors
    /// As [`Self::try_new`].
    pub fn moved(self, by_deg: f64) -> Result<Self, OutOfBounds> {
        Self::try_new(self.angle.degrees() + by_deg, self.tolerance.degrees())
    }

    /// The target at `angle`, with the same tolerance.
    ///
    /// # Errors
    /// As [`Self::try_new`].
    pub fn at(self, angle: Angle) -> Result<Self, OutOfBounds> {
        Self::try_new(angle.degrees(), self.tolerance.degrees())
    }

    /// The target counted from `zero`, with the same tolerance.
    #[must_use]
    pub fn from_zero(self, zero: Angle) -> Self {
        Self { angle: self.angle.plus(zero), ..self }
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

/// Angles between which the rotor may be driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Travel {
    least: Angle,
    greatest: Angle,
}

impl Travel {
    /// No limit: a quarter of the range of [`Angle`] to either side.
    pub const FREE: Self =
        Self { least: Angle::from_units(i64::MIN / 4), greatest: Angle::from_units(i64::MAX / 4) };

    /// Between two angles in degrees, clockwise positive, within +-1e9.
    ///
    /// # Errors
    /// When either is no number or out of bounds, or the second is not greater than the first.
    pub fn try_new(least_deg: f64, greatest_deg: f64) -> Result<Self, OutOfBounds> {
        OutOfBounds::check("travel.least_deg", least_deg, -1e9, 1e9, "deg")?;
        OutOfBounds::check("travel.greatest_deg", greatest_deg, least_deg.next_up(), 1e9, "deg")?;
        Ok(Self { least: Angle::from_degrees(least_deg), greatest: Angle::from_degrees(greatest_deg) })
    }

    /// The travel counted from `zero`.
    #[must_use]
    pub fn from_zero(self, zero: Angle) -> Self {
        Self { least: self.least.plus(zero), greatest: self.greatest.plus(zero) }
    }

    /// Whether `angle` lies within.
    pub fn contains(&self, angle: Angle) -> bool {
        (self.least..=self.greatest).contains(&angle)
    }

    /// What is left of the travel from `angle` in `direction`, 1 clockwise or -1, in rad; negative outside.
    pub fn room_rad(&self, angle: Angle, direction: f32) -> f32 {
        let limit = if direction > 0.0 { self.greatest } else { self.least };
        direction * limit.radians_since::<f32>(angle)
    }

    /// Whether driving in `direction`, 1 clockwise or -1, from `angle` leads out of the travel, or farther out. The
    /// coast after the drive is cut is not part of it.
    pub fn forbids(&self, angle: Angle, direction: f32) -> bool {
        if direction > 0.0 { angle > self.greatest } else { angle < self.least }
    }
}

/// Limits of a move, whatever the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Strongest drive, 0 to 1.
    pub amplitude_max: f32,
    /// Longest time with the drive on in one cruise or burst, in ns.
    pub on_max_nanos: u64,
    /// Angles between which the rotor may be driven.
    pub travel: Travel,
    /// Time after which a move is given up, in ns.
    pub deadline_nanos: u64,
    /// Cruises and bursts in a row that bring the rotor no nearer to the target, after which a move is given up.
    pub drives_max: u32,
}

impl Limits {
    /// Time after which a move is given up, in s.
    #[expect(clippy::cast_precision_loss, reason = "a deadline needs no more than single precision")]
    pub(crate) fn deadline_s(&self) -> f32 {
        1e-9 * self.deadline_nanos as f32
    }

    /// Longest time with the drive on in one cruise or burst, in s.
    #[expect(clippy::cast_precision_loss, reason = "a time needs no more than single precision")]
    pub(crate) fn on_max_s(&self) -> f32 {
        1e-9 * self.on_max_nanos as f32
    }
}

impl Default for Limits {
    /// Full drive, 20 s on at a time, any angle, 60 s a move, and 400 drives that bring the rotor no
    /// nearer.
    fn default() -> Self {
        Self {
            amplitude_max: DriveCommand::AMPLITUDE_MAX,
            on_max_nanos: 20_000_000_000,
            travel: Travel::FREE,
            deadline_nanos: 60_000_000_000,
            drives_max: 400,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// K1.
    #[test]
    fn exact_target_bounds() {
        for bad in [f64::NAN, f64::INFINITY, 4e5, -4e5] {
            assert_eq!(Target::try_new(bad, 0.02).unwrap_err().key, "position.to_deg");
        }
        for bad in [f64::NAN, 0.0, 0.000_099, -1.0, 11.0] {
            assert_eq!(Target::try_new(0.0, bad).unwrap_err().key, "position.tolerance_deg");
        }
        assert!(Target::try_new(359_000.0, 1.0).unwrap().moved(2000.0).is_err());
    }

    /// The smallest tolerance is 1,193 units, and a thousand turns away the distance to an angle that far off is still
    /// right to the rounding of single precision and half a unit of each angle.
    #[test]
    fn exact_the_smallest_tolerance_is_resolved_at_the_farthest_target() {
        for angle_deg in [0.0, 359.9, -360.0, 360_000.0, -360_000.0] {
            let target = Target::try_new(angle_deg, Target::TOLERANCE_MIN_DEG).unwrap();
            assert_eq!(target.tolerance().units(), 1193);
            let off_rad: f32 =
                target.angle().radians_since(Angle::from_degrees(angle_deg - Target::TOLERANCE_MIN_DEG));
            assert!(
                (f64::from(off_rad).to_degrees() / 1e-4 - 1.0).abs() < 1.0 / 1193.0,
                "{angle_deg} {off_rad}"
            );
        }
    }

    #[test]
    fn exact_relative_moves_do_not_add_errors_up() {
        let mut target = Target::try_new(0.0, 0.001).unwrap();
        for _ in 0..3600 {
            target = target.moved(0.1).unwrap();
        }
        // Rounded to 2^-32 turn each time.
        assert!((target.angle().degrees() - 360.0).abs() < 3600.0 * 4.2e-8);
    }

    /// The angle is that given, to the last unit, and the tolerance stays.
    #[test]
    fn exact_a_target_at_an_angle_keeps_the_tolerance() {
        let target = Target::try_new(5.0, 0.02).unwrap();
        for units in [0, 1, -1, (1 << 40) + 1, -(1 << 41) - 7, (1000 << 32) - 1] {
            let angle = Angle::from_units(units);
            let there = target.at(angle).unwrap();
            assert_eq!((there.angle(), there.tolerance()), (angle, target.tolerance()));
        }
        assert_eq!(target.at(Angle::from_degrees(4e5)).unwrap_err().key, "position.to_deg");
    }

    #[test]
    fn exact_travel() {
        let travel = Travel::try_new(-10.0, 20.0).unwrap();
        for (degrees, inside, clockwise, counter) in
            [(0.0, true, false, false), (20.1, false, true, false), (-10.1, false, false, true)]
        {
            let angle = Angle::from_degrees(degrees);
            assert_eq!(travel.contains(angle), inside);
            assert_eq!((travel.forbids(angle, 1.0), travel.forbids(angle, -1.0)), (clockwise, counter));
        }
        assert!(Travel::try_new(1.0, 0.0).is_err() && Travel::try_new(f64::NAN, 0.0).is_err());
        assert_eq!(Travel::try_new(5.0, 5.0).unwrap_err().key, "travel.greatest_deg");
        assert!(Travel::try_new(-1e9, -1e9).is_err() && Travel::try_new(1e9, 1e9).is_err());
        assert!(Travel::FREE.contains(Angle::from_degrees(3e9)));
    }
}
