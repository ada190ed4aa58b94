//! How this motor differs from the response map, learnt from what its bursts and cruises do.
//!
//! # Factors of the bursts
//!
//! Each family has a factor `s`, 1 in the map. A burst of mean turn `m` measures it:
//!
//! ```text
//! turned = s m + noise,    P: variance of s,   R: variance of the noise (burst to burst, and of both angles)
//! K = P m / (m^2 P + R),   s += K (turned - s m),   P -= K m P
//! ```
//!
//! A motor whose steps turn far has walks that turn far: the factors of [`Family::Step`] and [`Family::Walk`] begin
//! correlated, so that each is corrected by bursts of the other. An innovation beyond the gate (the drive has weakened,
//! say) widens `P` first, so that a wrong factor is corrected within a few bursts.
//!
//! The factors of steps and walks are two of the three states of one Kalman filter; the third, the angle at rest, is in
//! [`crate::rest_filter`]. This module holds their part of the covariance:
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | `a` | rad | angle at rest, in [`crate::rest_filter`] | none: measured |
//! | 1 | `s_step` | 1 | turn of this motor's steps per turn of the map's | 1, spread of the middle step |
//! | 2 | `s_walk` | 1 | the same for walks | 1, spread of the middle walk; correlation of the map |
//!
//! Spreads are standard deviations over the motors of the map. The other factors are filters of one state each,
//! independent of these and of one another:
//!
//! | symbol | unit | meaning | prior |
//! |---|---|---|---|
//! | `s_stride`, `s_throw` | 1 | turn of the bursts per turn of the map's | 1, spread of the middle burst |
//! | `s_nudge` | 1 | the same for nudges | 1, spread of the least nudge |
//! | `r_B`, `r_C` | 1 | rate of the cruises per rate of the map's | 1, spread of the strongest cruise |
//!
//! A move drives small nudges, to bring a rotor back that lies beyond its target. Of these the motors differ most. A
//! map of one motor may know the middle nudge to a few percent, and the least one to a half.
//!
//! # Factors of the rates
//!
//! Every window of [`crate::progress_window`] measures the rate of a cruise, in the same way. A slow motor coasts less
//! too, so its cruises are weakened later. One that sticks under a weak drive counts as so slow that it gets a
//! stronger one.
//!
//! # From move to move
//!
//! [`LearntFactors`] are the factors as plain data. A map that has them ([`ResponseMap::with_learnt`]) is that of one
//! motor: a move by it begins with them instead of the priors above.

mod learnt_factors;

use motor_model::{DriveMode, math};

use crate::amplitude_search::AmplitudeSearch;
use crate::response_map::{Burst, Cruise, Family, PerFamily, ResponseMap, direction};
pub use learnt_factors::{LearntFactor, LearntFactors, LearntField};

/// The factors of all families, with their variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapCorrection {
    families: PerFamily<LearntFactor>,
    /// Covariance of the factors of steps and walks.
    step_walk: f32,
    /// Of the rates in modes B and C.
    rates: [LearntFactor; 2],
}

/// The response of one motor: the map of its design, corrected.
#[derive(Clone, Copy, Debug)]
pub struct MotorResponse<'a> {
    /// The map.
    pub map: &'a ResponseMap,
    /// What was learnt of this motor.
    pub correction: &'a MapCorrection,
    /// The amplitudes that its cruises are driven at.
    pub(crate) amplitudes: &'a AmplitudeSearch,
}

/// What a burst is forecast to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Magnitude of the turn in rad.
    pub turn_rad: f32,
    /// Its variance in rad^2.
    pub turn_rad2: f32,
}

impl MapCorrection {
    /// What `map` has learnt; without that `map` as it stands.
    pub fn of(map: &ResponseMap) -> Self {
        map.correction().copied().unwrap_or_else(|| Self::prior(map))
    }

    fn prior(map: &ResponseMap) -> Self {
        let families = PerFamily::of(Family::ALL.map(|family| {
            let row = match family {
                Family::Nudge => map.bursts(family).first(),
                Family::Step | Family::Walk | Family::Stride | Family::Throw => map.middle(family),
            };
            let relative = row.map_or(0.0, |row| row.motors_sd_rad / row.turn_rad);
            LearntFactor { value: 1.0, variance: relative * relative }
        }));
        let [step, walk] = [Family::Step, Family::Walk].map(|family| *families.get(family));
        let step_walk = map.step_walk_correlation() * math::sqrt_f32(step.variance * walk.variance);
        Self { families, step_walk, rates: Self::prior_rates(map) }
    }

    fn prior_rates(map: &ResponseMap) -> [LearntFactor; 2] {
        [DriveMode::B, DriveMode::C].map(|mode| {
            let relative = map
                .strongest_cruise(mode, 1.0)
                .map_or(0.0, |cruise| cruise.rate_sd_rad_s / (direction(mode) * cruise.rate_rad_s));
            LearntFactor { value: 1.0, variance: relative * relative }
        })
    }

    /// The factors of the rates in modes B and C that a task by `map` begins with.
    pub(crate) fn rates_of(map: &ResponseMap) -> [LearntFactor; 2] {
        map.correction().map_or_else(|| Self::prior_rates(map), |correction| correction.rates)
    }
}

impl MotorResponse<'_> {
    /// Standard deviation of the turn of the middle burst of `family`, relative to the turn: of the factor, and from
    /// burst to burst.
    pub fn spread(&self, family: Family) -> f32 {
        let repeat = self.map.middle(family).map_or(0.0, |middle| middle.repeat_sd_rad / middle.turn_rad);
        let variance = self.correction.factor(family).variance;
        math::sqrt_f32(variance + MapCorrection::shape(family) + repeat * repeat)
    }

    /// The burst of `family` up to `amplitude_max` that turns this motor by `turn_rad`, as nearly as the map allows.
    pub fn burst(&self, family: Family, turn_rad: f32, amplitude_max: f32) -> Option<Burst> {
        self.map.burst(family, turn_rad / self.correction.scale(family), amplitude_max)
    }

    /// The cruise of `mode` up to `amplitude_max` for the last `remaining_rad`, see [`ResponseMap::cruise_within`]. A
    /// motor of half the rate coasts half as far: it is driven as if twice as much remained.
    pub fn cruise_within(&self, mode: DriveMode, amplitude_max: f32, remaining_rad: f32) -> Option<Cruise> {
        let amplitude_max = self.amplitudes.strongest(self.map, mode, amplitude_max);
        self.map.cruise_within(mode, amplitude_max, remaining_rad / self.correction.rate_scale(mode))
    }
}

impl LearntFactor {
    /// The same, known from both independently.
    pub(crate) fn fused(self, other: Self) -> Self {
        let sum = self.variance + other.variance;
        let part = if sum > 0.0 { self.variance / sum } else { 0.0 };
        Self { value: self.value + part * (other.value - self.value), variance: part * other.variance }
    }

    /// Corrects the factor by a measurement of `mean` times it that is off by `innovation`, with noise of variance
    /// `noise`. Returns the gain.
    fn update(&mut self, mean: f32, innovation: f32, noise: f32) -> f32 {
        let gain = self.variance * mean / (mean * mean * self.variance + noise);
        self.value = MapCorrection::limited(self.value + gain * innovation);
        self.variance = (self.variance * (1.0 - gain * mean)).max(MapCorrection::VARIANCE_MIN);
        gain
    }

    /// Widens the variance if `innovation` is beyond the gate.
    fn widen(&mut self, mean: f32, innovation: f32, noise: f32) {
        let square = innovation * innovation;
        let variance = mean * mean * self.variance + noise;
        if square > MapCorrection::GATE * variance {
            let wider = self.variance + (square - variance) / (mean * mean);
            self.variance = self.variance.max(wider.min(MapCorrection::WIDENED_MAX));
        }
    }
}

impl MapCorrection {
    /// Smallest and largest factor. An assumption: the factors of motors drawn like those of the map lie inside; a
    /// motor of less than a tenth of the map's rate does not.
    const RANGE: (f32, f32) = (0.1, 4.0);
    /// Innovation squared, per its variance, beyond which the variance of a factor is widened: three standard
    /// deviations. An assumption.
    const GATE: f32 = 9.0;
    /// Largest variance to which a factor is widened: half of the drive may be lost. The bound keeps a small burst,
    /// badly measured, from setting the factor to anything. An assumption.
    const WIDENED_MAX: f32 = 0.25;
    /// Smallest variance of a factor: no better than to a thousandth. Guards against rounding.
    const VARIANCE_MIN: f32 = 1e-6;
    /// Variance of the mean rate over a window of a cruise, relative to the map's rate: the ripple. An
    /// assumption.
    const RATE_RIPPLE: f32 = 0.1 * 0.1;
    /// Smallest variance of a factor of the rates, per [`Self::RATE_RIPPLE`]: a motor's rate differs between amplitudes
    /// and drifts. An assumption.
    const RATE_VARIANCE_MIN: f32 = 0.1;
    /// Largest turn, per turn of the map, that a burst is taken to have made: keeps the arithmetic finite.
    const TURN_MAX: f32 = 10.0;
    /// Variance of the measured turn, relative to the turn, above which a burst does not widen its factor. An
    /// assumption.
    const MEASURED_PART: f32 = 0.1;

    /// Variance of the factor between bursts of one family and one motor, relative to the turn: the map's shape is a
    /// mean over motors. It is largest for walks, which begin and end with a step and creep in between, since motors
    /// differ in both. An assumption.
    pub(crate) const fn shape(family: Family) -> f32 {
        match family {
            Family::Walk => 0.15 * 0.15,
            Family::Step => 0.06 * 0.06,
            Family::Stride | Family::Nudge | Family::Throw => 0.03 * 0.03,
        }
    }

    fn factor(&self, family: Family) -> LearntFactor {
        *self.families.get(family)
    }

    /// Turn of this motor's bursts of `family` per turn of the map's, 0.1 to 4.
    pub fn scale(&self, family: Family) -> f32 {
        self.factor(family).value
    }

    /// Rate of this motor's cruises in `mode` per rate of the map's, 0.1 to 4.
    pub fn rate_scale(&self, mode: DriveMode) -> f32 {
        let [clockwise, counter_clockwise] = self.rates;
        match mode {
            DriveMode::B => clockwise.value,
            DriveMode::C => counter_clockwise.value,
        }
    }

    /// Learns from a window in which `cruise` turned the rotor at a mean rate of `rate_rad_s` in the direction of its
    /// mode, 0 if the rotor stuck.
    pub fn learn_rate(&mut self, cruise: &Cruise, rate_rad_s: f32) {
        self.learn_relative_rate(cruise.mode, rate_rad_s / (direction(cruise.mode) * cruise.rate_rad_s));
    }

    /// The same of a cruise in `mode` at a mean rate of `relative` that of the map.
    pub fn learn_relative_rate(&mut self, mode: DriveMode, relative: f32) {
        let [clockwise, counter_clockwise] = &mut self.rates;
        let factor = match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        };
        let innovation = Self::limited(relative) - factor.value;
        factor.widen(1.0, innovation, Self::RATE_RIPPLE);
        factor.update(1.0, innovation, Self::RATE_RIPPLE);
        factor.variance = factor.variance.max(Self::RATE_VARIANCE_MIN * Self::RATE_RIPPLE);
    }

    /// What `burst` of `family` is forecast to do in this motor.
    pub fn forecast(&self, family: Family, burst: &Burst) -> Forecast {
        let LearntFactor { value, variance } = self.factor(family);
        let turn_rad2 = burst.turn_rad * burst.turn_rad * (variance + Self::shape(family) * value * value)
            + burst.repeat_sd_rad * burst.repeat_sd_rad * value * value;
        Forecast { turn_rad: value * burst.turn_rad, turn_rad2 }
    }

    /// Covariances of `family`'s factor with those of steps and walks; zero but for these two.
    pub(crate) fn covariances(&self, family: Family) -> [f32; 2] {
        let variance = self.factor(family).variance;
        match family {
            Family::Step => [variance, self.step_walk],
            Family::Walk => [self.step_walk, variance],
            Family::Stride | Family::Nudge | Family::Throw => [0.0; 2],
        }
    }

    /// The update of the joint filter: corrects the factors of steps and walks by an innovation of the angle,
    /// `innovation_rad` of variance `innovation_rad2`, where `angle_factors_rad` are the covariances of the angle with
    /// both factors.
    pub(crate) fn update_joint(
        &mut self,
        angle_factors_rad: [f32; 2],
        innovation_rad: f32,
        innovation_rad2: f32,
    ) {
        let [with_step, with_walk] = angle_factors_rad;
        let per_rad2 = 1.0 / innovation_rad2;
        for (family, with) in [(Family::Step, with_step), (Family::Walk, with_walk)] {
            let factor = self.families.get_mut(family);
            factor.value = Self::limited(factor.value + with * per_rad2 * innovation_rad);
            factor.variance = (factor.variance - with * with * per_rad2).max(Self::VARIANCE_MIN);
        }
        // A covariance is at most the geometric mean of the variances.
        let [step, walk] = [Family::Step, Family::Walk].map(|family| self.factor(family).variance);
        let most = math::sqrt_f32(step * walk);
        self.step_walk = (self.step_walk - with_step * with_walk * per_rad2).min(most).max(-most);
    }

    /// Whether this motor's bursts of `family` seem to have no effect: the factor is at its lower bound.
    pub fn is_without_effect(&self, family: Family) -> bool {
        self.scale(family) <= Self::RANGE.0
    }

    fn limited(value: f32) -> f32 {
        value.clamp(Self::RANGE.0, Self::RANGE.1)
    }

    /// Learns from a burst of `family` that turned the rotor by `turned_rad` in the direction of its mode, measured
    /// with variance `measured_rad2`.
    pub fn learn(&mut self, family: Family, burst: &Burst, turned_rad: f32, measured_rad2: f32) {
        let mean_rad = burst.turn_rad;
        // `clamp` would panic at bounds in the wrong order.
        let turned_rad = turned_rad.max(-Self::TURN_MAX * mean_rad).min(Self::TURN_MAX * mean_rad);
        let related = match family {
            Family::Step => Some(Family::Walk),
            Family::Walk => Some(Family::Step),
            Family::Stride | Family::Nudge | Family::Throw => None,
        };
        let own = self.families.get_mut(family);
        let shape = Self::shape(family) * mean_rad * mean_rad;
        let noise_rad2 = burst.repeat_sd_rad * burst.repeat_sd_rad + shape + measured_rad2;
        let innovation_rad = turned_rad - own.value * mean_rad;
        if measured_rad2 < Self::MEASURED_PART * mean_rad * mean_rad {
            own.widen(mean_rad, innovation_rad, noise_rad2);
        }
        let before = own.variance;
        let gain = own.update(mean_rad, innovation_rad, noise_rad2);
        // A factor that is known for certain teaches nothing of the other.
        if let Some(related) = related.filter(|_| before > 0.0) {
            let other = self.families.get_mut(related);
            let across = self.step_walk / before;
            other.value = Self::limited(other.value + across * gain * innovation_rad);
            other.variance =
                (other.variance - across * gain * mean_rad * self.step_walk).max(Self::VARIANCE_MIN);
            self.step_walk *= 1.0 - gain * mean_rad;
        }
    }
}

#[cfg(test)]
mod tests;
