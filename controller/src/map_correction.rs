//! How this motor differs from the map, learnt from what its bursts do.
//!
//! Each family has a factor `s`, 1 in the map, which a burst of mean turn `m` measures:
//!
//! ```text
//! turned = s m + noise,    P: variance of s,   R: variance of the noise (burst to burst, and of the angles before and after)
//! K = P m / (m^2 P + R),   s += K (turned - s m),   P -= K m P
//! ```
//!
//! A motor that steps far walks far: the factors of [`Family::Step`] and [`Family::Walk`] begin correlated, so that each learns from the other. A turn that is out
//! of all proportion (the drive has weakened, say) widens `P` first, so that a wrong factor is soon left.
//!
//! Each mode has a factor of its own for the rate of its cruises, which every window of [`crate::progress_window`] measures in the same way. A slow motor coasts less too, so
//! its cruises ease off later; one that sticks under a weak drive counts as so slow that it gets a stronger one.

use motor_model::{DriveMode, math};

use crate::response_map::{Burst, Cruise, Family, STEP_WALK_CORRELATION, direction, strongest_cruise};

/// The factors of all families, with their variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapCorrection {
    of: [Factor; Family::ALL.len()],
    /// Covariance of the factors of steps and walks.
    step_walk: f32,
    /// Of the rates in modes B and C.
    rates: [Factor; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Factor {
    value: f32,
    variance: f32,
}

/// What a burst is foreseen to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Magnitude of the turn in rad.
    pub turn_rad: f32,
    /// Its variance in rad^2.
    pub turn_rad2: f32,
}

impl Default for MapCorrection {
    /// The map as it stands.
    fn default() -> Self {
        let of = Family::ALL.map(|family| {
            let bursts = family.bursts();
            let relative =
                bursts.get(bursts.len() / 2).map_or(0.0, |middle| middle.motors_sd_rad / middle.turn_rad);
            Factor { value: 1.0, variance: relative * relative }
        });
        let [step, walk, ..] = of;
        let step_walk = STEP_WALK_CORRELATION * math::sqrt_f32(step.variance * walk.variance);
        let rates = [DriveMode::B, DriveMode::C].map(|mode| {
            let relative = strongest_cruise(mode, 1.0)
                .map_or(0.0, |cruise| cruise.rate_sd_rad_s / (direction(mode) * cruise.rate_rad_s));
            Factor { value: 1.0, variance: relative * relative }
        });
        Self { of, step_walk, rates }
    }
}

impl Factor {
    /// Takes in a measurement of `mean` times the factor that is off by `innovation`, with noise of variance `noise`; the gain.
    fn follow(&mut self, mean: f32, innovation: f32, noise: f32) -> f32 {
        let gain = self.variance * mean / (mean * mean * self.variance + noise);
        self.value = MapCorrection::limited(self.value + gain * innovation);
        self.variance = (self.variance * (1.0 - gain * mean)).max(MapCorrection::VARIANCE_MIN);
        gain
    }

    /// Widens the variance if `innovation` is out of all proportion to it.
    fn doubt(&mut self, mean: f32, innovation: f32, noise: f32) {
        let square = innovation * innovation;
        let variance = mean * mean * self.variance + noise;
        if square > MapCorrection::DOUBT * variance {
            let wider = self.variance + (square - variance) / (mean * mean);
            self.variance = self.variance.max(wider.min(MapCorrection::DOUBTED));
        }
    }
}

impl MapCorrection {
    /// Factors beyond these are no motor's.
    const RANGE: (f32, f32) = (0.1, 4.0);
    /// A factor is not quite the same for every burst of a family: variance that remains between bursts of one motor, relative to the turn. A walk begins and ends with a step and
    /// creeps in between, and motors differ in both.
    const fn shape(family: Family) -> f32 {
        match family {
            Family::Walk => 0.15 * 0.15,
            Family::Step => 0.06 * 0.06,
            Family::Stride | Family::Nudge | Family::Throw => 0.03 * 0.03,
        }
    }

    /// Innovation squared, per its variance, above which the factor is doubted.
    const DOUBT: f32 = 9.0;
    /// Variance of a factor that is doubted, at most: half of the drive may be lost. A small burst, badly measured, could else say anything.
    const DOUBTED: f32 = 0.25;
    /// No factor is known better than to a thousandth.
    const VARIANCE_MIN: f32 = 1e-6;
    /// Variance of the mean rate over a window of a cruise, relative to the map's rate: the ripple.
    const RIPPLE: f32 = 0.1 * 0.1;

    fn factor(&self, family: Family) -> Factor {
        let [step, walk, stride, nudge, throw] = self.of;
        match family {
            Family::Step => step,
            Family::Walk => walk,
            Family::Stride => stride,
            Family::Nudge => nudge,
            Family::Throw => throw,
        }
    }

    /// By how much this motor's bursts of `family` turn farther than the map's.
    pub fn scale(&self, family: Family) -> f32 {
        self.factor(family).value
    }

    /// By how much faster than the map's this motor's cruises in `mode` are.
    pub fn rate_scale(&self, mode: DriveMode) -> f32 {
        let [clockwise, counter_clockwise] = self.rates;
        match mode {
            DriveMode::B => clockwise.value,
            DriveMode::C => counter_clockwise.value,
        }
    }

    /// Learns from a window in which `cruise` turned the rotor at a mean of `rate_rad_s` along the direction of its mode, 0 if it stuck.
    pub fn learn_rate(&mut self, cruise: &Cruise, rate_rad_s: f32) {
        let [clockwise, counter_clockwise] = &mut self.rates;
        let factor = match cruise.mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        };
        let ratio = Self::limited(rate_rad_s / (direction(cruise.mode) * cruise.rate_rad_s));
        let innovation = ratio - factor.value;
        factor.doubt(1.0, innovation, Self::RIPPLE);
        factor.follow(1.0, innovation, Self::RIPPLE);
        // A motor's rate is not the same at every amplitude, and not for ever.
        factor.variance = factor.variance.max(0.1 * Self::RIPPLE);
    }

    /// Standard deviation of a burst of the middle of `family`, relative to its turn: of the factor, and from burst to burst.
    pub fn spread(&self, family: Family) -> f32 {
        let bursts = family.bursts();
        let repeat =
            bursts.get(bursts.len() / 2).map_or(0.0, |middle| middle.repeat_sd_rad / middle.turn_rad);
        math::sqrt_f32(self.factor(family).variance + Self::shape(family) + repeat * repeat)
    }

    /// What `burst` of `family` is foreseen to do in this motor.
    pub fn forecast(&self, family: Family, burst: &Burst) -> Forecast {
        let Factor { value, variance } = self.factor(family);
        let turn_rad2 = burst.turn_rad * burst.turn_rad * (variance + Self::shape(family) * value * value)
            + burst.repeat_sd_rad * burst.repeat_sd_rad * value * value;
        Forecast { turn_rad: value * burst.turn_rad, turn_rad2 }
    }

    /// Covariances of `family`'s factor with those of steps and walks; zero but for these two.
    pub(crate) fn covariances(&self, family: Family) -> [f32; 2] {
        let [step, walk, ..] = self.of;
        match family {
            Family::Step => [step.variance, self.step_walk],
            Family::Walk => [self.step_walk, walk.variance],
            Family::Stride | Family::Nudge | Family::Throw => [0.0; 2],
        }
    }

    /// Learns from an angle that was measured `apart_rad` off, variance `apart_rad2`, and whose error goes with those of the factors of steps and walks by the covariances
    /// `shared_rad`.
    pub(crate) fn follow(&mut self, shared_rad: [f32; 2], apart_rad: f32, apart_rad2: f32) {
        let [step, walk, ..] = &mut self.of;
        let [with_step, with_walk] = shared_rad;
        let per_rad2 = 1.0 / apart_rad2;
        for (factor, with) in [(&mut *step, with_step), (&mut *walk, with_walk)] {
            factor.value = Self::limited(factor.value + with * per_rad2 * apart_rad);
            factor.variance = (factor.variance - with * with * per_rad2).max(Self::VARIANCE_MIN);
        }
        // Between the two no more than they have.
        let most = math::sqrt_f32(step.variance * walk.variance);
        self.step_walk = (self.step_walk - with_step * with_walk * per_rad2).min(most).max(-most);
    }

    /// Whether this motor's bursts of `family` seem to do nothing: the factor is the least that is believed.
    pub fn is_dead(&self, family: Family) -> bool {
        self.scale(family) <= Self::RANGE.0
    }

    fn limited(value: f32) -> f32 {
        value.clamp(Self::RANGE.0, Self::RANGE.1)
    }

    /// Learns from a burst of `family` that turned the rotor by `turned_rad` in the direction of its mode, measured with variance `measured_rad2`.
    pub fn learn(&mut self, family: Family, burst: &Burst, turned_rad: f32, measured_rad2: f32) {
        let mean_rad = burst.turn_rad;
        // Not clamped, which panics at bounds in the wrong order.
        let turned_rad = turned_rad.max(-10.0 * mean_rad).min(10.0 * mean_rad);
        let [step, walk, stride, nudge, throw] = &mut self.of;
        let (own, other) = match family {
            Family::Step => (step, Some(walk)),
            Family::Walk => (walk, Some(step)),
            Family::Stride => (stride, None),
            Family::Nudge => (nudge, None),
            Family::Throw => (throw, None),
        };
        let shape = Self::shape(family) * mean_rad * mean_rad;
        let noise_rad2 = burst.repeat_sd_rad * burst.repeat_sd_rad + shape + measured_rad2;
        let innovation_rad = turned_rad - own.value * mean_rad;
        if measured_rad2 < 0.1 * mean_rad * mean_rad {
            own.doubt(mean_rad, innovation_rad, noise_rad2);
        }
        let before = own.variance;
        let gain = own.follow(mean_rad, innovation_rad, noise_rad2);
        if let Some(other) = other {
            let across = self.step_walk / before;
            other.value = Self::limited(other.value + across * gain * innovation_rad);
            other.variance =
                (other.variance - across * gain * mean_rad * self.step_walk).max(Self::VARIANCE_MIN);
            self.step_walk *= 1.0 - gain * mean_rad;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn middle(family: Family) -> Burst {
        family.bursts()[family.bursts().len() / 2]
    }

    /// One measurement without noise of its own: the factor is right but for what the map says of repetition and shape.
    #[test]
    fn law_one_burst_teaches_its_family_and_the_related_one() {
        let mut correction = MapCorrection::default();
        let burst = middle(Family::Step);
        correction.learn(Family::Step, &burst, 1.3 * burst.turn_rad, 0.0);
        assert!((correction.scale(Family::Step) - 1.3).abs() < 0.03, "{correction:?}");
        let walk = correction.scale(Family::Walk);
        assert!((1.15..1.3).contains(&walk), "{walk}");
        assert!((correction.scale(Family::Throw) - 1.0).abs() < f32::EPSILON);
        let left = correction.factor(Family::Walk).variance;
        assert!(left < 0.5 * MapCorrection::default().factor(Family::Walk).variance, "{correction:?}");
    }

    /// Bayes with two Gaussians of equal variance: half way, half the variance.
    #[test]
    fn exact_a_measurement_as_uncertain_as_the_factor_counts_half() {
        let mut correction = MapCorrection::default();
        let burst = Burst { repeat_sd_rad: 0.0, ..middle(Family::Nudge) };
        let mean = burst.turn_rad;
        let prior = correction.factor(Family::Nudge).variance;
        let noise = mean * mean * (prior - MapCorrection::shape(Family::Nudge));
        correction.learn(Family::Nudge, &burst, 1.2 * mean, noise);
        assert!((correction.scale(Family::Nudge) - 1.1).abs() < 1e-4);
        assert!((correction.factor(Family::Nudge).variance / prior - 0.5).abs() < 1e-4);
    }

    /// Windows of a motor that turns at 0.15 of the map's rate: half of it is believed after the first, nearly all after three; the other mode is another matter.
    #[test]
    fn law_a_slow_motor_is_believed() {
        let mut correction = MapCorrection::default();
        let cruise = strongest_cruise(DriveMode::C, 1.0).unwrap();
        let rate_rad_s = -0.15 * cruise.rate_rad_s;
        correction.learn_rate(&cruise, rate_rad_s);
        assert!(correction.rate_scale(DriveMode::C) < 0.5, "{correction:?}");
        correction.learn_rate(&cruise, rate_rad_s);
        correction.learn_rate(&cruise, rate_rad_s);
        assert!((correction.rate_scale(DriveMode::C) - 0.15).abs() < 0.05, "{correction:?}");
        assert!((correction.rate_scale(DriveMode::B) - 1.0).abs() < f32::EPSILON);
        for _ in 0..3 {
            correction.learn_rate(&cruise, -cruise.rate_rad_s);
        }
        assert!(correction.rate_scale(DriveMode::C) > 0.9, "it has recovered: {correction:?}");
    }

    /// A drive that halves is believed within three bursts, however sure the factor was.
    #[test]
    fn law_a_change_out_of_proportion_is_believed() {
        let mut correction = MapCorrection::default();
        let burst = middle(Family::Step);
        for _ in 0..50 {
            correction.learn(Family::Step, &burst, burst.turn_rad, 0.0);
        }
        for _ in 0..3 {
            correction.learn(Family::Step, &burst, 0.5 * burst.turn_rad, 0.0);
        }
        assert!((correction.scale(Family::Step) - 0.5).abs() < 0.05, "{correction:?}");
    }

    /// Whatever is learnt, factors stay in range and variances positive.
    #[test]
    fn law_nonsense_does_no_harm() {
        let mut correction = MapCorrection::default();
        for turned in [1e9, -1e9, 0.0, 1e-30, f32::MAX] {
            for family in Family::ALL {
                correction.learn(family, &middle(family), turned, 1e-20);
                let Factor { value, variance } = correction.factor(family);
                assert!((0.1..=4.0).contains(&value) && variance > 0.0, "{turned} {family:?} {correction:?}");
                assert!(correction.factor(Family::Step).variance > 0.0, "{correction:?}");
                assert!(correction.factor(Family::Walk).variance > 0.0, "{correction:?}");
            }
        }
    }
}
