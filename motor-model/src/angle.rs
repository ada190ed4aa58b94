//! Rotor angle as an integer: nothing is lost over a million turns, in any precision.
//!
//! An [`Angle`] counts 2^-32 of a turn (8.4e-8 degree) over +-2^31 turns. An [`AngleAccumulator`] keeps the
//! remaining part of a unit as well, so that small increments are not rounded away.

use core::f64::consts::TAU;

use crate::math::Real;

/// Units in a turn.
const UNITS_PER_TURN: f64 = 4_294_967_296.0;

/// An unwrapped angle in units of 2^-32 turn; clockwise is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Angle(i64);

impl Angle {
    /// Angle zero.
    pub const ZERO: Self = Self(0);

    /// From units of 2^-32 turn.
    pub const fn from_units(units: i64) -> Self {
        Self(units)
    }

    /// In units of 2^-32 turn.
    pub const fn units(self) -> i64 {
        self.0
    }

    /// The nearest angle to `degrees`; saturates beyond +-2^31 turns, and NaN gives zero.
    #[expect(clippy::cast_possible_truncation, reason = "saturation is documented")]
    pub fn from_degrees(degrees: f64) -> Self {
        Self(libm::round(degrees * (UNITS_PER_TURN / 360.0)) as i64)
    }

    /// `radians` as an angle, rounded towards zero to a whole unit (and to the precision of `T`), for |radians| up to
    /// half a turn; saturates there, and NaN gives zero.
    #[inline]
    pub fn from_radians<T: Real>(radians: T) -> Self {
        Self(i64::from((radians * T::from_f64(UNITS_PER_TURN / TAU)).whole()))
    }

    /// In degrees.
    #[expect(clippy::cast_precision_loss, reason = "53 bits hold 2^20 turns to the last unit")]
    pub fn degrees(self) -> f64 {
        self.0 as f64 * (360.0 / UNITS_PER_TURN)
    }

    /// `self - origin` in radians: exact until the final rounding to `T`, however many turns both have made.
    #[inline]
    pub fn radians_since<T: Real>(self, origin: Self) -> T {
        T::from_i64(self.0.wrapping_sub(origin.0)) * T::from_f64(TAU / UNITS_PER_TURN)
    }

    /// `self + offset`, wrapping beyond +-2^31 turns.
    #[inline]
    #[must_use]
    pub const fn plus(self, offset: Self) -> Self {
        Self(self.0.wrapping_add(offset.0))
    }

    /// `self - offset`, wrapping beyond +-2^31 turns.
    #[inline]
    #[must_use]
    pub const fn minus(self, offset: Self) -> Self {
        Self(self.0.wrapping_sub(offset.0))
    }

    /// The angle within the turn, as a camera measures it: in `-1/2..1/2` turn.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "whole turns are dropped on purpose")]
    pub const fn wrapped(self) -> Self {
        Self(self.0 as i32 as i64)
    }
}

/// An angle as a sum of increments: whole units, and the remaining part of a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleAccumulator<T> {
    angle: Angle,
    /// In units of 2^-32 turn; magnitude at most 1 between steps.
    residual_units: T,
}

impl<T: Real> AngleAccumulator<T> {
    /// An accumulator at `angle`.
    pub fn at(angle: Angle) -> Self {
        Self { angle, residual_units: T::zero() }
    }

    /// The angle in whole units.
    #[inline]
    pub fn angle(&self) -> Angle {
        self.angle
    }

    /// The part of a unit of 2^-32 turn not yet in [`Self::angle`].
    #[inline]
    pub fn residual_units(&self) -> T {
        self.residual_units
    }

    /// Turns it by a whole number of units, however many turns.
    #[inline]
    pub fn turn(&mut self, by: Angle) {
        self.angle = self.angle.plus(by);
    }

    /// Turns it by `radians`, to the last bit of `T` however many turns it has made.
    #[inline]
    pub fn turn_by_radians(&mut self, radians: T) {
        self.advance(radians * T::from_f64(Self::UNITS_PER_RADIAN));
    }

    /// Units of 2^-32 turn in a radian.
    pub(crate) const UNITS_PER_RADIAN: f64 = UNITS_PER_TURN / TAU;

    /// Adds `increment` in units of 2^-32 turn.
    ///
    /// An increment beyond half a turn is not lost: what saturates stays in the residual and follows in later steps.
    #[inline]
    pub(crate) fn advance(&mut self, increment: T) {
        let (whole, rest) = (self.residual_units + increment).split();
        self.residual_units = rest;
        self.angle = self.angle.plus(Angle(i64::from(whole)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_degrees_round_trip_to_half_a_unit() {
        for degrees in [0.0, 90.0, -90.0, 0.001, 359.999, 1e6, -123_456.789] {
            assert!((Angle::from_degrees(degrees).degrees() - degrees).abs() <= 180.0 / UNITS_PER_TURN);
        }
    }

    #[test]
    fn exact_wrapping_keeps_the_place_within_the_turn() {
        assert_eq!(Angle::from_degrees(361.0).wrapped(), Angle::from_degrees(1.0));
        assert_eq!(Angle::from_degrees(-181.0).wrapped(), Angle::from_degrees(179.0));
    }

    /// Increments of a third of a unit in f32: a plain f32 angle would stop moving after 2^24 units.
    #[test]
    fn exact_small_increments_accumulate() {
        let mut accumulator = AngleAccumulator::<f32>::at(Angle::from_degrees(3.6e8));
        for _ in 0..3_000_000 {
            accumulator.advance(1.0 / 3.0);
        }
        let moved = accumulator.angle().minus(Angle::from_degrees(3.6e8)).units();
        assert!((moved - 1_000_000).abs() <= 1, "{moved}");
    }

    #[test]
    fn exact_saturated_increment_follows_later() {
        let mut accumulator = AngleAccumulator::<f64>::at(Angle::ZERO);
        accumulator.advance(6e9);
        accumulator.advance(0.0);
        accumulator.advance(0.0);
        assert_eq!(accumulator.angle().units(), 6_000_000_000);
    }
}
