//! What moves have learnt of one motor, as plain data: to be kept with its map, and to begin the next move with.

use estimator::ResonanceOffset;
use motor_model::{DriveMode, math};

use super::MapCorrection;
use crate::response_map::{Family, MapError, PerFamily};

/// A factor of a motor: its turn, or its rate, per that of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearntFactor {
    /// Mean, 0.1 to 4.
    pub value: f32,
    /// Variance, at least 0.
    pub variance: f32,
}

/// The factors of a motor, as [`MapCorrection`] has learnt them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearntFactors {
    /// Of the bursts, in the order of [`Family::ALL`].
    pub bursts: [LearntFactor; Family::ALL.len()],
    /// Covariance of the factors of steps and walks: at most the root of the product of their variances in magnitude.
    pub step_walk_covariance: f32,
    /// Of the rates in modes B and C.
    pub rates: [LearntFactor; 2],
    /// Where the resonances of modes B and C are: the offsets of the drive from the design's, at most
    /// [`Self::OFFSET_MAX_HZ`] in magnitude.
    pub resonances: [ResonanceOffset<f32>; 2],
}

/// Part by which a covariance may exceed the root of the product of the variances: rounding in `f32`.
const ROUNDING: f32 = 1e-5;

/// A number of [`LearntFactors`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LearntField {
    /// The factor of a family of bursts, or its variance.
    Burst(Family),
    /// The factor of the rates in a mode, or its variance.
    Rate(DriveMode),
    /// [`LearntFactors::step_walk_covariance`].
    Covariance,
    /// The offset of a mode's resonance, or its variance.
    Resonance(DriveMode),
}

impl LearntField {
    /// Its name in a map's file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Burst(family) => family.name(),
            Self::Rate(DriveMode::B) => "rate_b",
            Self::Rate(DriveMode::C) => "rate_c",
            Self::Covariance => "step_walk_covariance",
            Self::Resonance(DriveMode::B) => "resonance_b",
            Self::Resonance(DriveMode::C) => "resonance_c",
        }
    }

    fn within(self, value: f32, min: f32, max: f32) -> Result<(), MapError> {
        if value >= min && value <= max {
            Ok(())
        } else {
            Err(MapError::Learnt { field: self, value, min, max })
        }
    }
}

impl LearntFactors {
    fn check(&self) -> Result<(), MapError> {
        let bursts = Family::ALL.into_iter().map(LearntField::Burst).zip(&self.bursts);
        let rates = [DriveMode::B, DriveMode::C].into_iter().map(LearntField::Rate).zip(&self.rates);
        let (min, max) = MapCorrection::RANGE;
        for (field, factor) in bursts.chain(rates) {
            field.within(factor.value, min, max)?;
            field.within(factor.variance, 0.0, f32::MAX)?;
        }
        let [step, walk, ..] = &self.bursts;
        let most = (1.0 + ROUNDING) * math::sqrt_f32(step.variance) * math::sqrt_f32(walk.variance);
        LearntField::Covariance.within(self.step_walk_covariance, -most, most)?;
        let modes = [DriveMode::B, DriveMode::C].into_iter().map(LearntField::Resonance);
        for (field, offset) in modes.zip(&self.resonances) {
            field.within(offset.hz, -Self::OFFSET_MAX_HZ, Self::OFFSET_MAX_HZ)?;
            field.within(offset.hz2, 0.0, f32::MAX)?;
        }
        Ok(())
    }

    /// Largest magnitude of the offset of a resonance in Hz: 4 % of that of mode B. Tracking and commissioning stay
    /// within 2.5 %.
    pub const OFFSET_MAX_HZ: f32 = 250.0;

    /// The factors of `correction`, beside `resonances`.
    pub fn new(correction: &MapCorrection, resonances: [ResonanceOffset<f32>; 2]) -> Self {
        Self {
            bursts: Family::ALL.map(|family| correction.factor(family)),
            step_walk_covariance: correction.step_walk,
            rates: correction.rates,
            resonances,
        }
    }
}

/// With the resonances of the design.
impl From<&MapCorrection> for LearntFactors {
    fn from(correction: &MapCorrection) -> Self {
        Self::new(correction, [ResonanceOffset::NONE; 2])
    }
}

impl TryFrom<LearntFactors> for MapCorrection {
    type Error = MapError;

    /// # Errors
    /// When a factor is outside of its bounds, or not finite.
    fn try_from(factors: LearntFactors) -> Result<Self, MapError> {
        factors.check()?;
        let LearntFactors { bursts, step_walk_covariance, rates, resonances: _ } = factors;
        Ok(Self { families: PerFamily::of(bursts), step_walk: step_walk_covariance, rates })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response_map::ResponseMap;

    fn learnt() -> LearntFactors {
        let mut correction = MapCorrection::of(ResponseMap::table_1());
        for family in Family::ALL {
            let burst = *ResponseMap::table_1().middle(family).unwrap();
            correction.learn(family, &burst, 1.1 * burst.turn_rad, 1e-4 * burst.turn_rad * burst.turn_rad);
        }
        let resonances = [31.0, -12.5].map(|hz| ResonanceOffset { hz, hz2: 40.0 });
        LearntFactors::new(&correction, resonances)
    }

    /// A move begins with what was learnt, to the last bit, and without it with the spread of the map's motors.
    #[test]
    fn exact_what_was_learnt_comes_back() {
        let map = ResponseMap::table_1();
        let kept = map.with_learnt(learnt()).unwrap();
        assert_eq!(LearntFactors::new(&MapCorrection::of(&kept), *kept.resonances()), learnt());
        assert_eq!(kept.learnt(), Some(learnt()));
        assert_ne!(MapCorrection::of(&kept), MapCorrection::of(map));
        assert!(map.learnt().is_none() && kept != *map);
    }

    /// Each number beyond its bounds, and one that is none, is refused by its name.
    #[test]
    fn law_what_no_motor_has_is_refused_by_its_name() {
        let refused = |change: &dyn Fn(&mut LearntFactors), of: LearntField| {
            let mut factors = learnt();
            change(&mut factors);
            match ResponseMap::table_1().with_learnt(factors) {
                Err(MapError::Learnt { field, .. }) => assert_eq!(field, of),
                other => panic!("{of:?}: {other:?}"),
            }
        };
        for (index, family) in Family::ALL.into_iter().enumerate() {
            for wrong in [0.099, 4.01, -1.0, f32::NAN, f32::INFINITY] {
                refused(&|factors| factors.bursts[index].value = wrong, LearntField::Burst(family));
            }
            for wrong in [-1e-9, f32::NAN, f32::INFINITY] {
                refused(&|factors| factors.bursts[index].variance = wrong, LearntField::Burst(family));
            }
        }
        for (index, mode) in [DriveMode::B, DriveMode::C].into_iter().enumerate() {
            refused(&|factors| factors.rates[index].value = 4.01, LearntField::Rate(mode));
            refused(&|factors| factors.rates[index].variance = f32::NAN, LearntField::Rate(mode));
        }
        for wrong in [0.1, -0.1, f32::NAN] {
            refused(&|factors| factors.step_walk_covariance = wrong, LearntField::Covariance);
        }
        for (index, mode) in [DriveMode::B, DriveMode::C].into_iter().enumerate() {
            for wrong in [-250.1, 250.1, f32::NAN] {
                refused(&|factors| factors.resonances[index].hz = wrong, LearntField::Resonance(mode));
            }
            for wrong in [-1e-9, f32::NAN, f32::INFINITY] {
                refused(&|factors| factors.resonances[index].hz2 = wrong, LearntField::Resonance(mode));
            }
        }
    }
}
