//! Whether impacts act on the rotor: the mean square of its vertical velocity, from the vibrometer, less the bias that
//! was learnt ([`crate::vibrometer::calibration`]).
//!
//! ```text
//! s+ = s + (min(v, v-)^2 - s) / n       quiet when s < limit, for as long as it stays so                        (F7)
//! limit = (0.6 mm/s)^2 + 0.75 (sigma^2 - (0.2 mm/s)^2)        0.6 mm/s at the default noise of 0.2 mm/s
//! ```
//!
//! Of a sample v and the one before it, v-, the slower one is used: a rotor in flight or on ringing teeth is as fast in
//! both, while a wrong sample stands alone. Of noise of variance sigma^2 the slower one has the mean square `(1 - 2 /
//! pi) sigma^2 = 0.36 sigma^2`. The limit lies at twice that, and a signal of 0.57 mm/s above it.
//!
//! A quiet rotor may still slide: friction stops it within `rate J / (mu m_r g R_t)`, 25 ms from the highest rates. So
//! the filter, which knows the rate, concludes rest; this module only finds whether the rotor is quiet.

use motor_model::{DriveMode, MotorParams, Parameter, Real, Time};

use crate::settling::settling_nanos;
use crate::{Instruments, LdvSample, VibrometerDescription};

/// Time over which the mean square is taken, in s.
const WINDOW_S: f64 = 1e-3;
/// Samples of the shortest window: their mean square is known to a fifth.
const WINDOW_SAMPLES_MIN: f64 = 20.0;
/// The limit at the default noise, the default noise, in m/s, and what noise adds.
const QUIET_M_S: f64 = 6e-4;
const DEFAULT_NOISE_M_S: f64 = 2e-4;
const NOISE_PART: f64 = 0.75;
/// Mean square of a rotor in flight, per the limit below which it is quiet: 3 mm/s at the default noise, the speed of a
/// fall of 0.3 ms.
const FLIGHT_PART2: f64 = 9.0;
/// Most equal samples in a row of a live vibrometer whose steps are wider than its noise, in s: in that time a rotor in
/// flight changes its velocity by 10 mm/s.
const EQUAL_S: f64 = 1e-3;
/// Speed beyond which a sample is wrong, in m/s: twice that of any real rotor.
const LIMIT_M_S: f64 = 2.0;
/// Time without a sample from which on the vibrometer is silent, in ns.
const SILENCE_NANOS: u64 = 1_000_000;

/// Speed from which on a sample is not used, in m/s: beyond any rotor's, or saturated.
fn limit_m_s(vibrometer: &VibrometerDescription) -> f64 {
    let saturated_m_s = 0.99 * vibrometer.range_m_s;
    if saturated_m_s > 0.0 { saturated_m_s.min(LIMIT_M_S) } else { LIMIT_M_S }
}

/// Mean square below which a rotor is quiet, in m^2/s^2, at noise of this variance.
pub(crate) fn quiet_m2_s2<T: Real>(noise_m2_s2: T) -> T {
    let n = T::from_f64;
    n(QUIET_M_S * QUIET_M_S) + n(NOISE_PART) * (noise_m2_s2 - n(DEFAULT_NOISE_M_S * DEFAULT_NOISE_M_S))
}

/// What is assumed of motor and vibrometer to tell whether the rotor is driven or quiet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestTuning<T> {
    /// Samples over which the mean square is taken.
    pub(crate) window_samples: T,
    /// Root mean square vertical velocity below which the rotor counts as quiet, in m/s: above the vibrometer's noise,
    /// below the ringing of the stator that still moves the rotor.
    pub(crate) quiet_m_s: T,
    /// Standard deviation of a sample, in m/s.
    pub(crate) noise_m_s: T,
    /// Gravity in m/s^2: it bounds how high a rotor flies, and so the mean velocity of one that runs.
    pub(crate) gravity_m_s2: T,
    /// Equal samples in a row from which on a vibrometer counts as lifeless.
    pub(crate) equal_samples: u16,
    /// Whether there is a vibrometer.
    pub(crate) fitted: bool,
    /// Time in ns after the drive, in mode B and in mode C, after which the rotor is quiet by its design, whatever the
    /// vibrometer shows.
    pub(crate) settling_nanos: [u64; 2],
    /// Samples faster than this are dropped, in m/s: no real rotor is half as fast.
    pub(crate) limit_m_s: T,
}

impl<T: Real> Default for RestTuning<T> {
    /// For the nominal motor under the default instruments.
    fn default() -> Self {
        Self::new(&MotorParams::nominal(), &Instruments::default())
    }
}

impl<T: Real> RestTuning<T> {
    /// For a motor of `params` under `instruments`.
    pub fn new(params: &MotorParams, instruments: &Instruments) -> Self {
        let vibrometer = instruments.vibrometer.unwrap_or_default();
        Self {
            window_samples: T::from_f64((WINDOW_S / vibrometer.period_s()).max(WINDOW_SAMPLES_MIN)),
            quiet_m_s: T::from_f64(vibrometer.quiet_m_s()),
            noise_m_s: T::from_f64(vibrometer.sample_sd_m_s()),
            gravity_m_s2: T::from_f64(params.get(Parameter::Gravity)),
            equal_samples: equal_samples(&vibrometer),
            fitted: instruments.vibrometer.is_some(),
            settling_nanos: [DriveMode::B, DriveMode::C].map(|mode| settling_nanos(params, mode)),
            limit_m_s: T::from_f64(limit_m_s(&vibrometer)),
        }
    }
}

/// Equal samples in a row from which on a vibrometer counts as lifeless: the second, if its steps are a tenth of its
/// noise or less. Coarser steps repeat by themselves.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1,000")]
fn equal_samples(vibrometer: &VibrometerDescription) -> u16 {
    if vibrometer.resolution_m_s <= 0.1 * vibrometer.noise_m_s {
        1
    } else {
        (EQUAL_S / vibrometer.period_s()).clamp(20.0, 1000.0) as u16
    }
}

/// Finds whether the rotor is quiet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RestDetector<T> {
    weight: T,
    /// Mean square below which the rotor counts as quiet.
    pub(super) quiet_m2_s2: T,
    limit_m_s: T,
    mean_square_m2_s2: T,
    /// Square of the last sample.
    last_m2_s2: T,
    /// When the newest sample used was taken.
    pub(super) newest: Option<Time>,
    quiet_since: Option<Time>,
}

impl<T: Real> RestDetector<T> {
    /// A detector without samples: the rotor is not quiet.
    pub(crate) fn new(tuning: &RestTuning<T>) -> Self {
        let quiet_m2_s2 = tuning.quiet_m_s * tuning.quiet_m_s;
        Self {
            weight: T::one() / tuning.window_samples,
            quiet_m2_s2,
            limit_m_s: tuning.limit_m_s,
            // Starts well above the limit, so that the first quiet takes several windows.
            mean_square_m2_s2: T::from_f64(100.0) * quiet_m2_s2,
            ..Self::default()
        }
    }

    /// Takes in a sample that is newer than the last. One that is not finite or too fast is dropped. Returns whether it
    /// was used.
    pub(crate) fn take(&mut self, sample: &LdvSample) -> bool {
        let velocity = T::from_f32(sample.velocity_m_s);
        // Written so that NaN is refused too.
        let plausible = velocity.abs() < self.limit_m_s;
        if !plausible {
            return false;
        }
        self.newest = Some(sample.taken_at);
        let square_m2_s2 = velocity * velocity;
        let slower_m2_s2 = square_m2_s2.at_most(self.last_m2_s2);
        self.last_m2_s2 = square_m2_s2;
        self.mean_square_m2_s2 += self.weight * (slower_m2_s2 - self.mean_square_m2_s2);
        if self.mean_square_m2_s2 < self.quiet_m2_s2 {
            self.quiet_since = self.quiet_since.or(Some(sample.taken_at));
        } else {
            self.quiet_since = None;
        }
        true
    }

    /// Since when the rotor has been quiet; `None` while it is not, or while the vibrometer is silent.
    pub(crate) fn quiet_since(&self, now: Time) -> Option<Time> {
        self.quiet_since.filter(|_| !self.silent(now))
    }

    pub(crate) fn shows_flight(&self) -> bool {
        self.mean_square_m2_s2 > T::from_f64(FLIGHT_PART2) * self.quiet_m2_s2
    }

    /// Whether no sample has arrived for a while before `now`. A sample from more than that after `now` has a wrong
    /// time and does not count.
    pub(crate) fn silent(&self, now: Time) -> bool {
        !self.newest.is_some_and(|newest| newest.is_within(SILENCE_NANOS, now))
    }

    pub(crate) fn reset(&mut self) {
        (self.newest, self.quiet_since) = (None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(n: u64, velocity_m_s: f32) -> LdvSample {
        LdvSample { taken_at: Time::from_micros(5 * n), velocity_m_s }
    }

    /// A mean square that starts at s0 falls as s0 (1 - 1/n)^k, so the instant of quiet is known.
    #[test]
    fn exact_quiet_comes_when_the_exponential_has_fallen() {
        let mut detector = RestDetector::<f64>::new(&RestTuning::default());
        let mut quiet_at = None;
        for n in 1..3000 {
            detector.take(&sample(n, 0.0));
            if quiet_at.is_none() && detector.quiet_since(Time::from_micros(5 * n)).is_some() {
                quiet_at = Some(n);
            }
        }
        let expected = 100_f64.ln() / -(1.0 - 1.0 / 200.0_f64).ln();
        assert_eq!(quiet_at, Some(expected.ceil() as u64));
    }

    #[test]
    fn law_an_impact_ends_quiet_one_wrong_sample_does_not_and_silence_does() {
        let mut detector = RestDetector::<f32>::new(&RestTuning::default());
        for n in 1..3000 {
            detector.take(&sample(n, 1e-4));
        }
        let now = Time::from_micros(5 * 3000);
        assert!(detector.quiet_since(now).is_some());
        assert!(detector.quiet_since(now.plus_nanos(2_000_000)).is_none());
        for n in 3000..3100 {
            detector.take(&sample(n, if n.is_multiple_of(10) { 1.9 } else { 1e-4 }));
            assert!(detector.quiet_since(now).is_some());
        }
        detector.take(&sample(3100, 0.1));
        detector.take(&sample(3101, 0.1));
        assert!(detector.quiet_since(Time::from_micros(5 * 3101)).is_none());
    }

    #[test]
    fn law_bad_samples_change_nothing() {
        let mut detector = RestDetector::<f32>::new(&RestTuning::default());
        assert!(detector.take(&sample(10, 1e-4)));
        let before = detector.mean_square_m2_s2;
        for bad in [f32::NAN, f32::INFINITY, -f32::INFINITY, 3.0, -1e30] {
            assert!(!detector.take(&sample(11, bad)));
        }
        assert!((detector.mean_square_m2_s2 - before).abs() < f32::EPSILON * before);
    }
}
