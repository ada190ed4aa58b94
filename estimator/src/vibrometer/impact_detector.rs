//! Impacts from the vibrometer: jumps of the rotor's vertical velocity.
//!
//! Between impacts the velocity falls as gravity and the squeeze film make it, and a tooth can only push:
//!
//! ```text
//! flight   v(t + h) = v(t) - (g + b_z v / m_r) h,   impact   v+ = v + dv,  dv > 0                     (13a, 14a)
//! ```
//!
//! The velocity in flight is estimated from the samples since the last impact: `v^ <- v^ + w (sample - v^)` with `w = 1/n` for the first
//! [`ImpactDetectorTuning::window_samples`] of them and constant from then on, so that an error of `b_z` is forgotten. Its variance is `p sigma^2`,
//! `p <- (1 - w)^2 p + w^2`. A sample above its prediction by more than `k sigma sqrt(1 + p)` is an impact:
//!
//! | | probability | at sigma = 0.2 mm/s, k = 5 |
//! |---|---|---|
//! | false alarm, a sample | Q(k) | 2.9e-7: one in 17 s at 200 kHz |
//! | detection of a jump dv | Q(k - dv / (sigma sqrt(1 + p))) | 0.5 at 1.0 mm/s, 0.999 at 1.6 mm/s in settled flight; 1.4 and 2.3 after one sample |
//!
//! Q is the upper tail of the standard normal. The jump is the mean before against the one sample after: `sigma sqrt(1 + p)`, 0.2 to 0.28 mm/s. A mean over
//! later samples would halve that variance and cost the delay; the kick that a jump bounds is uncertain by a third of itself, so nothing is won.
//! Several impacts between two samples are seen as one. A rotor that lies on the teeth does not fall as in flight; it is seen as an impact every 0.2 ms.
//!
//! A sample too far *below* its prediction is no impact, since nothing pulls the rotor down: it is left out, and flight is estimated anew from the second one
//! in a row. (Anew from the first, the sample after a low one would look like a jump, and add a sixth to the false alarms at k = 3.)
//!
//! A vibrometer whose sign is wrong shows every impact as a fall. The sum of the jumps' squares, falls counted negative, each at most 0.009 m^2/s^2 so that a single wrong sample is no proof, and kept within 0.01 of
//! zero, tells ([`ImpactDetector::inverted`]): a dozen impacts of mode B turn it, and the small jumps up by which gravity then seems reversed
//! weigh nothing.
//!
//! A vibrometer whose scale is wrong shows a rotor in flight that does not fall by g: [`ImpactDetector::mis_scaled`].
//!
//! # Wrong samples
//!
//! A speckle that drifts through the beam spoils a few samples in a row. Each that is too high looks like an impact, whose kick of up to 30 rad/s for 0.1 m/s is none; whether it is one shows when the
//! velocity comes down again, since nothing pulls a rotor down. So a velocity that lies by more than [`FALL_M_S`] below its prediction for two samples in a row is told ([`Heard::Fall`]), since the impacts just before were
//! perhaps none, and for [`ImpactDetector::ERRATIC_NANOS`] from the last such fall on none is taken from what is shown ([`ImpactDetector::erratic`]). Noise brings it about once in 10^9 years; the small falls that a wrong scale makes of
//! gravity do not count.

mod free_fall;

use free_fall::FreeFall;
use motor_model::{MotorParams, Parameter, Real, Time};

use crate::filter::Reason;
use crate::measurement::LdvSample;

/// Fall that tells wrong samples, in m/s: five thresholds.
const FALL_M_S: f64 = 0.005;

/// How the detector decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactDetectorTuning<T> {
    /// Standard deviation of a sample's noise in m/s.
    pub noise_m_s: T,
    /// Threshold in standard deviations, k.
    pub threshold: T,
    /// Most samples that the velocity in flight is averaged over.
    pub window_samples: T,
    /// Samples faster than this are no measurements, in m/s.
    pub limit_m_s: T,
    /// Gravity in m/s^2.
    pub gravity_m_s2: T,
    /// Damping by the squeeze film, `b_z / m_r`, per second.
    pub damping_per_s: T,
    /// A longer time between samples in ns is a gap: what happened in it is unknown.
    pub gap_nanos: u64,
}

impl<T: Real> ImpactDetectorTuning<T> {
    /// For a motor of `params` under the default vibrometer.
    pub fn new(params: &MotorParams) -> Self {
        let damping = params.get(Parameter::VerticalDamping) / params.get(Parameter::RotorMass);
        Self {
            noise_m_s: T::from_f64(2e-4),
            threshold: T::from_f64(5.0),
            window_samples: T::from_f64(40.0),
            limit_m_s: T::from_f64(2.0),
            gravity_m_s2: T::from_f64(params.get(Parameter::Gravity)),
            damping_per_s: T::from_f64(damping),
            gap_nanos: 50_000,
        }
    }
}

/// What a sample tells of impacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard<T> {
    /// Not used: not finite, absurdly fast, or no newer than the last one.
    Nothing,
    /// Flight goes on.
    Flight,
    /// The rotor was struck since the last sample.
    Impact {
        /// Vertical velocity before in m/s.
        before_m_s: T,
        /// Jump of the velocity, `dv`, in m/s.
        jump_m_s: T,
    },
    /// The rotor seems to have been pulled down, which nothing does: samples were wrong, these or those before.
    Fall {
        /// By how much its velocity fell, in m/s: as large may be a jump that was none.
        drop_m_s: T,
    },
    /// The first sample after a gap, whose length in s is given; 0 before the first sample of all.
    Gap(T),
}

/// Finds impacts in the vibrometer's samples.
#[derive(Clone, Copy, Debug)]
pub struct ImpactDetector<T> {
    tuning: ImpactDetectorTuning<T>,
    /// Square of [`Self::threshold_m_s`].
    limit_m2_s2: T,
    /// [`ImpactDetectorTuning::gap_nanos`], as far as it fits `i32`.
    gap_nanos: u32,
    newest: Option<Time>,
    velocity_m_s: T,
    /// Samples since the last impact, at most the window.
    samples: T,
    /// Variance of the velocity per that of a sample, `p`.
    spread: T,
    /// How far samples have moved the velocity since it was begun, `sum w (sample - v^)`.
    moved_m_s: T,
    /// Whether the last sample was too far below its prediction.
    below: bool,
    /// Sum of the jumps' squares in m^2/s^2, falls counted negative; within [`Self::SIGN_M2_S2`] of zero.
    upward_m2_s2: T,
    fall: FreeFall<T>,
    /// Until when nothing is taken from the samples, since some were wrong.
    erratic_until: Option<Time>,
    /// Whether any of these is wrong: asked at every sample, it changes at few.
    wrong: bool,
}

impl<T: Real> ImpactDetector<T> {
    /// Sum of squares that settles the sign in m^2/s^2: 16 jumps of 25 mm/s.
    const SIGN_M2_S2: f64 = 0.01;

    /// Square that a single jump counts at most: two turn a settled sign, a single wrong sample does not.
    const JUMP_M2_S2: f64 = 0.9 * Self::SIGN_M2_S2;

    /// For so long after a fall samples are not to be trusted: where bursts of wrong ones come more often than twenty times a second nothing is taken from the vibrometer, and one in a while costs little.
    pub const ERRATIC_NANOS: u64 = 50_000_000;

    /// A detector that has heard nothing.
    pub fn new(tuning: ImpactDetectorTuning<T>) -> Self {
        let limit_m_s = tuning.threshold * tuning.noise_m_s;
        Self {
            tuning,
            limit_m2_s2: limit_m_s * limit_m_s,
            gap_nanos: i32::try_from(tuning.gap_nanos).unwrap_or(i32::MAX).cast_unsigned(),
            newest: None,
            velocity_m_s: T::zero(),
            samples: T::one(),
            spread: T::one(),
            moved_m_s: T::zero(),
            below: false,
            upward_m2_s2: T::from_f64(Self::SIGN_M2_S2),
            fall: FreeFall::new(),
            erratic_until: None,
            wrong: false,
        }
    }

    /// Whether the rotor seems to fall faster or more slowly than gravity makes it, by a quarter or more: the vibrometer's scale is wrong.
    pub fn mis_scaled(&self) -> bool {
        self.fall.is_wrong()
    }

    /// Whether the rotor seems to be pulled down and never pushed up: the vibrometer's sign is wrong.
    pub fn inverted(&self) -> bool {
        self.upward_m2_s2 < T::zero()
    }

    /// Whether the rotor has seemed to be pulled down of late, in single blows: some samples are wrong.
    pub fn erratic(&self) -> bool {
        self.erratic_until.is_some()
    }

    /// Whether what it shows of impacts is not to be used: sign or scale are wrong, or single samples.
    #[inline]
    pub(crate) fn is_wrong(&self) -> bool {
        self.wrong
    }

    /// What is wrong with the vibrometer, if anything is.
    pub(crate) fn fault(&self) -> Option<Reason> {
        let reasons = [
            (self.inverted(), Reason::VibrometerInverted),
            (self.mis_scaled(), Reason::VibrometerScale),
            (self.erratic(), Reason::VibrometerErratic),
        ];
        reasons.into_iter().find_map(|(is_wrong, reason)| is_wrong.then_some(reason))
    }

    #[inline]
    fn note_jump(&mut self, square_m2_s2: T) {
        let sum_m2_s2 = self.upward_m2_s2 + square_m2_s2.clamp_magnitude(T::from_f64(Self::JUMP_M2_S2));
        self.upward_m2_s2 = sum_m2_s2.clamp_magnitude(T::from_f64(Self::SIGN_M2_S2));
    }

    /// When the newest sample was taken.
    pub fn newest(&self) -> Option<Time> {
        self.newest
    }

    /// Jump in m/s that is found in half of all cases, in settled flight.
    pub fn threshold_m_s(&self) -> T {
        self.tuning.threshold * self.tuning.noise_m_s
    }

    /// Variance of the velocity in flight per that of a sample, `p`.
    pub(crate) fn spread(&self) -> T {
        self.spread
    }

    /// The mean over the samples since the last impact less the first of them, and how many they are: exact up to the window.
    pub(crate) fn since_impact(&self) -> (T, T) {
        (self.moved_m_s, self.samples)
    }

    /// Takes a sample in.
    #[inline]
    pub fn observe(&mut self, sample: &LdvSample) -> Heard<T> {
        let velocity = T::from_f32(sample.velocity_m_s);
        // Written so that NaN is refused too.
        let believable = velocity.abs() < self.tuning.limit_m_s;
        if !believable {
            return Heard::Nothing;
        }
        let soon = self.newest.as_mut().and_then(|newest| {
            let since = sample.taken_at.nanos_soon_after(*newest, self.gap_nanos)?;
            *newest = sample.taken_at;
            Some(since)
        });
        let Some(since) = soon else { return self.out_of_step(sample.taken_at, velocity) };
        if self.wrong {
            self.recover(sample.taken_at);
        }
        let since_s = T::from_i32(since.cast_signed()) * T::from_f64(1e-9);
        let fallen_m_s = (self.tuning.gravity_m_s2 + self.tuning.damping_per_s * self.velocity_m_s) * since_s;
        self.velocity_m_s -= fallen_m_s;
        let surplus = velocity - self.velocity_m_s;
        let square_m2_s2 = surplus * surplus;
        if square_m2_s2 > self.limit_m2_s2 * (T::one() + self.spread) {
            let (before_m_s, again) = (self.velocity_m_s, self.below);
            if surplus > T::zero() {
                self.note_jump(square_m2_s2);
                self.fall_ends(sample.taken_at, since_s);
                self.judge();
                self.begin_at(velocity);
                self.fall.begin(sample.taken_at, surplus);
                return Heard::Impact { before_m_s, jump_m_s: surplus };
            }
            self.below = true;
            if again {
                self.note_jump(-square_m2_s2);
                self.fall_ends(sample.taken_at, since_s);
                self.begin_at(velocity);
                let heard = self.note_fall(sample.taken_at, -surplus);
                self.judge();
                return heard;
            }
            return Heard::Flight;
        }
        self.below = false;
        if self.samples < self.tuning.window_samples {
            self.samples += T::one();
        }
        let weight = T::one() / self.samples;
        let kept = T::one() - weight;
        let moved_m_s = weight * surplus;
        self.velocity_m_s += moved_m_s;
        self.moved_m_s += moved_m_s;
        self.spread = kept * kept * self.spread + weight * weight;
        Heard::Flight
    }

    /// Takes in a sample that is the first, no newer than the last, or the first after a gap.
    #[cold]
    fn out_of_step(&mut self, taken_at: Time, velocity_m_s: T) -> Heard<T> {
        if self.newest.is_some_and(|newest| taken_at <= newest) {
            return Heard::Nothing;
        }
        let before = self.newest.replace(taken_at);
        self.begin_at(velocity_m_s);
        self.fall.begin(taken_at, T::zero());
        Heard::Gap(before.map_or(T::zero(), |before| taken_at.seconds_since(before)))
    }

    /// Takes in that the velocity has fallen by `drop_m_s`, at two samples up to `at`; what that tells. One whose sign is wrong falls at every impact.
    #[cold]
    fn note_fall(&mut self, at: Time, drop_m_s: T) -> Heard<T> {
        if drop_m_s < T::from_f64(FALL_M_S) || self.inverted() {
            return Heard::Flight;
        }
        let before = self.erratic_until.replace(at.plus_nanos(Self::ERRATIC_NANOS));
        if before.is_none() { Heard::Fall { drop_m_s } } else { Heard::Flight }
    }

    /// Whether what it shows can be used from now on.
    fn judge(&mut self) {
        self.wrong = self.inverted() || self.mis_scaled() || self.erratic();
    }

    /// Single samples that were wrong are long ago, if they are.
    #[cold]
    fn recover(&mut self, at: Time) {
        self.erratic_until = self.erratic_until.filter(|until| at < *until);
        self.judge();
    }

    /// A flight has ended at the sample of `at`, whose neighbours are `period_s` apart.
    fn fall_ends(&mut self, at: Time, period_s: T) {
        let ImpactDetectorTuning { gravity_m_s2, window_samples, noise_m_s, .. } = self.tuning;
        self.fall.end(at, self.moved_m_s, gravity_m_s2, window_samples * period_s, noise_m_s);
    }

    /// Estimates the flight anew from one sample.
    fn begin_at(&mut self, velocity_m_s: T) {
        (self.velocity_m_s, self.samples, self.spread) = (velocity_m_s, T::one(), T::one());
        (self.moved_m_s, self.below) = (T::zero(), false);
    }
}

#[cfg(test)]
mod tests;
