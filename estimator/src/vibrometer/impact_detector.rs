//! Impacts from the vibrometer: jumps of the rotor's vertical velocity.
//!
//! Between impacts the velocity falls as gravity and the squeeze film make it, and a tooth can only push upwards:
//!
//! ```text
//! flight   v(t + h) = v(t) - (g + b_z v / m_r) h,   impact   v+ = v + dv,  dv > 0                     (13a, 14a)
//! ```
//!
//! The velocity in flight is estimated from the samples since the last impact: `v^ <- v^ + w (sample - v^)` with
//! `w = 1/n` for the first [`ImpactDetectorTuning::window_samples`] of them and constant from then on, so that an
//! error of `b_z` is forgotten. `b_z` itself and the vibrometer's scale are learnt from each flight ([`free_fall`]).
//! Its variance is `p sigma^2`, `p <- (1 - w)^2 p + w^2`. The filter has one state:
//!
//! | index | symbol | unit | meaning | prior, after each impact |
//! |---|---|---|---|---|
//! | 0 | `v^` | m/s | vertical velocity in flight | the first sample, with `p = 1` |
//!
//! A sample above its prediction by more than `k sigma sqrt(1 + p)` is an impact:
//!
//! | | probability | at sigma = 0.2 mm/s, k = 5 |
//! |---|---|---|
//! | false alarm, a sample | Q(k) | 2.9e-7: one in 17 s at 200 kHz |
//! | detection of a jump dv in settled flight | Q(k - dv / (sigma sqrt(1 + p))) | 0.5 at 1.0 mm/s, 0.999 at 1.6 mm/s |
//! | the same one sample after an impact | | 0.5 at 1.4 mm/s, 0.999 at 2.3 mm/s |
//!
//! Q is the upper tail of the standard normal. The jump is the one sample after the impact less the mean before, with
//! the standard deviation `sigma sqrt(1 + p)`, 0.2 to 0.28 mm/s. Several impacts between two samples count as one. A
//! rotor in sustained contact does not fall, and appears as an impact every 0.2 ms.
//!
//! A sample that far *below* its prediction is no impact, since nothing pulls the rotor down. It is left out, and the
//! flight is estimated anew from the second one in a row.
//!
//! # Faults of the vibrometer
//!
//! | fault | sign | [`crate::Reason`] | ends |
//! |---|---|---|---|
//! | too much noise | as described, or learnt at rest | `VibrometerUnfit` | never, or when less is learnt |
//! | wrong sign | every impact appears as a fall | `VibrometerInverted` | when jumps are upwards again |
//! | wrong samples | a fall of [`FALL_M_S`] or more | `VibrometerErratic` | 50 ms after a fall, 300 ms after more |
//! | wrong scale | a flight is no fall by g: [`free_fall`] | `VibrometerScale` | when corrected and proven |
//!
//! Wrong sign: the statistic is the sum of the squares of the jumps, falls counted negative, kept within 0.01 m^2/s^2
//! of zero. A single square counts at most 0.009, so that one wrong sample is no proof. A dozen impacts of mode B turn
//! it. The small jumps upwards by which gravity then seems reversed weigh nothing.
//!
//! Wrong samples: a speckle that drifts through the laser's beam spoils a few samples in a row. Each that is too high
//! looks like an impact, but then the velocity comes down again. So a velocity more than [`FALL_M_S`] below its
//! prediction for two samples in a row is reported ([`VibrometerEvent::Fall`]), since the impacts just before were
//! perhaps none. The small falls that a wrong scale makes of gravity are below the limit.

mod free_fall;

use free_fall::{FreeFall, Taught};
use motor_model::{MotorParams, Parameter, Real, Time};

use crate::{Instruments, LdvSample, Reason, VibrometerDescription};

/// Least fall that shows wrong samples, in m/s: five thresholds of 1 mm/s.
const FALL_M_S: f64 = 0.005;

/// Time over which the velocity in flight is averaged, in s.
const WINDOW_S: f64 = 2e-4;

/// Samples of a window of this length in s: at least two, at most 1,000.
pub(crate) fn window_samples<T: Real>(window_s: f64, vibrometer: &VibrometerDescription) -> T {
    T::from_f64((window_s / vibrometer.period_s()).clamp(2.0, 1000.0))
}

/// Noise, threshold and model of the impact detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactDetectorTuning<T> {
    /// Standard deviation of a sample's noise as the vibrometer gives it, in m/s.
    pub(crate) noise_m_s: T,
    /// Threshold in standard deviations, k.
    pub(crate) threshold: T,
    /// Most samples that the velocity in flight is averaged over.
    pub(crate) window_samples: T,
    pub(crate) gravity_m_s2: T,
    /// Damping by the squeeze film, `b_z / m_r`, in 1/s.
    pub(crate) damping_per_s: T,
    /// With more noise than this, in m/s, impacts are not told from noise, and none is taken from the samples: the
    /// threshold of 20 mm/s is as large as the largest jumps of mode C and a fifth of those of mode B.
    pub(crate) blind_m_s: T,
    /// A longer time between samples is a gap, in ns, at most `i32::MAX`: impacts in it are not known.
    pub(crate) gap_nanos: u32,
}

impl<T: Real> ImpactDetectorTuning<T> {
    /// For a motor of `params` under `vibrometer`.
    #[inline(never)]
    pub(crate) fn new(params: &MotorParams, vibrometer: &VibrometerDescription) -> Self {
        let damping = params.get(Parameter::VerticalDamping) / params.get(Parameter::RotorMass);
        Self {
            noise_m_s: T::from_f64(vibrometer.sample_sd_m_s()),
            threshold: T::from_f64(5.0),
            window_samples: window_samples(WINDOW_S, vibrometer),
            blind_m_s: T::from_f64(Instruments::IMPACTS_SD_M_S),
            gravity_m_s2: T::from_f64(params.get(Parameter::Gravity)),
            damping_per_s: T::from_f64(damping),
            gap_nanos: i32::try_from(10 * vibrometer.period_nanos).unwrap_or(i32::MAX).cast_unsigned(),
        }
    }
}

/// What a vibrometer sample shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VibrometerEvent<T> {
    /// Not used: no newer than the last one.
    Rejected,
    /// The rotor is in flight.
    Flight,
    /// An impact since the last sample.
    Impact {
        /// Vertical velocity before, in m/s.
        before_m_s: T,
        /// Jump of the velocity, `dv`, in m/s.
        jump_m_s: T,
        /// Height above the last impact, in m; 0 if the flight is not known from there on.
        height_m: T,
    },
    /// The velocity fell suddenly, which no contact does: samples were wrong, these or those before.
    Fall {
        /// By how much the velocity fell, in m/s. A jump of this size before may have been no impact.
        drop_m_s: T,
    },
    /// The first sample after a gap, with the gap's length in s; 0 at the first sample of all.
    Gap(T),
}

/// What the samples since the last impact show.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flight<T> {
    /// Vertical velocity, `v^`, in m/s.
    pub(crate) velocity_m_s: T,
    /// Height of the rotor above the last impact, in m; above the first sample, where that is not known.
    pub(crate) height_m: T,
    /// The mean velocity less the first sample, in m/s: exact up to the window. It is the sum of the corrections of the
    /// velocity, `sum w (sample - v^)`.
    pub(crate) drift_m_s: T,
    /// Their number, at most the window.
    pub(crate) samples: T,
    /// Variance of the velocity per that of a sample, `p`.
    pub(crate) velocity_variance: T,
    /// Whether the last sample was too far below its prediction.
    pub(crate) below: bool,
    /// Whether it began at an impact.
    pub(crate) from_impact: bool,
}

impl<T: Real> Flight<T> {
    /// A flight that begins at a sample of this velocity.
    fn begun(velocity_m_s: T) -> Self {
        Self { velocity_m_s, samples: T::one(), velocity_variance: T::one(), ..Self::default() }
    }
}

/// Finds impacts and faults in the vibrometer's samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImpactDetector<T> {
    tuning: ImpactDetectorTuning<T>,
    /// Square of [`Self::threshold_m_s`].
    limit_m2_s2: T,
    /// When the newest sample was taken.
    pub(crate) newest: Option<Time>,
    /// The flight since the last impact.
    pub(crate) flight: Flight<T>,
    /// Jump of the last impact, in m/s.
    pub(crate) jump_m_s: T,
    /// Sum of the jumps' squares, falls counted negative, in m^2/s^2; within [`Self::SIGN_M2_S2`] of zero.
    upward_m2_s2: T,
    free_fall: FreeFall<T>,
    /// What a true velocity of one is in the vibrometer's samples, as the flights have taught it.
    scale: T,
    /// Its inverse.
    per_scale: T,
    /// Until when impacts are ignored, since single samples were wrong in the last [`Self::ERRATIC_NANOS`].
    pub(crate) erratic_until: Option<Time>,
    /// The fault that holds, if any; the first of too much noise, wrong sign, wrong samples and wrong scale. Kept,
    /// since every sample needs it and few change it.
    pub(crate) fault: Option<Reason>,
}

impl<T: Real> ImpactDetector<T> {
    /// Bound of the sum of squares from which the sign follows, in m^2/s^2: 16 jumps of 25 mm/s.
    const SIGN_M2_S2: f64 = 0.01;

    /// Most that the square of a single jump counts: two jumps can turn the sign, a single wrong sample cannot.
    const JUMP_M2_S2: f64 = 0.9 * Self::SIGN_M2_S2;

    /// How long after a fall impacts are ignored, in ns: 50 ms. A rare burst of wrong samples costs little.
    const ERRATIC_NANOS: u64 = 50_000_000;

    /// How long they are ignored after a fall that comes while an earlier one counts, in ns: 300 ms. Such falls are
    /// those of a rotor that tilts, whose middle rises and falls as it rocks from tooth to tooth. Its kicks are not
    /// those of the model, and at its pin it is struck without a jump, between falls up to some 100 ms apart.
    const ERRATIC_AGAIN_NANOS: u64 = 300_000_000;

    pub(crate) fn new(tuning: ImpactDetectorTuning<T>) -> Self {
        let mut detector = Self {
            tuning,
            limit_m2_s2: T::zero(),
            newest: None,
            flight: Flight::begun(T::zero()),
            jump_m_s: T::zero(),
            upward_m2_s2: T::from_f64(Self::SIGN_M2_S2),
            free_fall: FreeFall::new(tuning.gravity_m_s2, tuning.damping_per_s),
            scale: T::one(),
            per_scale: T::one(),
            erratic_until: None,
            fault: None,
        };
        detector.set_noise(tuning.noise_m_s);
        detector
    }

    /// Sets the noise of the vibrometer's samples as it gives them.
    pub(crate) fn set_noise(&mut self, noise_m_s: T) {
        self.tuning.noise_m_s = noise_m_s;
        let limit_m_s = self.threshold_m_s();
        self.limit_m2_s2 = limit_m_s * limit_m_s;
        self.judge();
    }

    /// Standard deviation of a sample's noise at the scale that was learnt, in m/s.
    #[inline]
    pub(crate) fn noise_m_s(&self) -> T {
        self.tuning.noise_m_s * self.per_scale
    }

    /// The sample at the scale that was learnt: what [`Self::observe`] takes.
    #[inline]
    pub(crate) fn scaled(&self, sample: &LdvSample) -> LdvSample {
        LdvSample { velocity_m_s: sample.velocity_m_s * self.per_scale.to_f32(), ..*sample }
    }

    /// Whether any fault holds: impacts are to be ignored.
    pub(crate) fn has_fault(&self) -> bool {
        self.fault.is_some()
    }

    fn inverted(&self) -> bool {
        self.upward_m2_s2 < T::zero()
    }

    fn judge(&mut self) {
        let faults = [
            (self.noise_m_s() > self.tuning.blind_m_s, Reason::VibrometerUnfit),
            (self.inverted(), Reason::VibrometerInverted),
            (self.erratic_until.is_some(), Reason::VibrometerErratic),
            (self.free_fall.wrong, Reason::VibrometerScale),
        ];
        self.fault = faults.into_iter().find_map(|(holds, reason)| holds.then_some(reason));
    }

    fn note_jump(&mut self, square_m2_s2: T) {
        let sum_m2_s2 = self.upward_m2_s2 + square_m2_s2.clamp_magnitude(T::from_f64(Self::JUMP_M2_S2));
        self.upward_m2_s2 = sum_m2_s2.clamp_magnitude(T::from_f64(Self::SIGN_M2_S2));
    }

    /// Jump that is detected with probability 1/2 in settled flight, in m/s.
    pub(crate) fn threshold_m_s(&self) -> T {
        self.tuning.threshold * self.noise_m_s()
    }

    /// Takes in a sample that [`crate::vibrometer::rest`] has found plausible, [`Self::scaled`]; returns what it shows.
    pub(crate) fn observe(&mut self, sample: &LdvSample) -> VibrometerEvent<T> {
        let (at, velocity) = (sample.taken_at, T::from_f32(sample.velocity_m_s));
        let soon = self.newest.and_then(|newest| at.nanos_soon_after(newest, self.tuning.gap_nanos));
        let Some(since) = soon else { return self.out_of_sequence(at, velocity) };
        self.newest = Some(at);
        if self.fault.is_some() {
            self.recover(at);
        }
        let since_s = T::from_i32(since.cast_signed()) * T::from_f64(1e-9);
        let (tuning, flight) = (&self.tuning, &mut self.flight);
        flight.velocity_m_s -= (tuning.gravity_m_s2 + tuning.damping_per_s * flight.velocity_m_s) * since_s;
        let innovation = velocity - flight.velocity_m_s;
        let square_m2_s2 = innovation * innovation;
        if square_m2_s2 > self.limit_m2_s2 * (T::one() + flight.velocity_variance) {
            let (before_m_s, upwards) = (flight.velocity_m_s, innovation > T::zero());
            let height_m = if flight.from_impact { flight.height_m } else { T::zero() };
            if !upwards && !core::mem::replace(&mut flight.below, true) {
                return VibrometerEvent::Flight;
            }
            self.note_jump(if upwards { square_m2_s2 } else { -square_m2_s2 });
            let velocity = velocity * self.end_flight();
            self.flight = Flight { from_impact: upwards, ..Flight::begun(velocity) };
            let event = if upwards {
                self.free_fall.begin(velocity, innovation);
                self.jump_m_s = innovation;
                VibrometerEvent::Impact { before_m_s, jump_m_s: innovation, height_m }
            } else {
                self.note_fall(at, -innovation)
            };
            self.judge();
            return event;
        }
        flight.below = false;
        if flight.samples < tuning.window_samples {
            flight.samples += T::one();
        }
        let weight = T::one() / flight.samples;
        let kept = T::one() - weight;
        self.free_fall.take(since_s, flight.velocity_m_s, innovation, weight);
        let correction_m_s = weight * innovation;
        flight.velocity_m_s += correction_m_s;
        flight.height_m += flight.velocity_m_s * since_s;
        flight.drift_m_s += correction_m_s;
        flight.velocity_variance = kept * kept * flight.velocity_variance + weight * weight;
        VibrometerEvent::Flight
    }

    /// Takes in a sample that is the first, no newer than the last, or the first after a gap.
    #[cold]
    fn out_of_sequence(&mut self, taken_at: Time, velocity_m_s: T) -> VibrometerEvent<T> {
        if self.newest.is_some_and(|newest| taken_at <= newest) {
            return VibrometerEvent::Rejected;
        }
        let before = self.newest.replace(taken_at);
        self.flight = Flight::begun(velocity_m_s);
        self.free_fall.begin(velocity_m_s, T::zero());
        VibrometerEvent::Gap(before.map_or(T::zero(), |before| taken_at.seconds_since(before)))
    }

    /// The samples' times were wrong, and start again: the flight that went on teaches nothing. What is known of the
    /// vibrometer and the film is kept: scale, damping, noise and sign.
    #[cold]
    pub(crate) fn start_again(&mut self) {
        self.newest = None;
        self.flight = Flight::begun(T::zero());
        self.jump_m_s = T::zero();
        self.free_fall.leave_out_flight();
        self.erratic_until = None;
        self.judge();
    }

    /// Takes in a fall by `drop_m_s` at two samples up to `at`. A vibrometer of wrong sign shows one at every impact:
    /// those are not reported.
    #[cold]
    fn note_fall(&mut self, at: Time, drop_m_s: T) -> VibrometerEvent<T> {
        if drop_m_s < T::from_f64(FALL_M_S) || self.inverted() {
            return VibrometerEvent::Flight;
        }
        let again = self.erratic_until.is_some();
        let nanos = if again { Self::ERRATIC_AGAIN_NANOS } else { Self::ERRATIC_NANOS };
        self.erratic_until = Some(at.plus_nanos(nanos));
        if again { VibrometerEvent::Flight } else { VibrometerEvent::Fall { drop_m_s } }
    }

    /// Ends the time after wrong samples, if it is over at `at`.
    #[cold]
    fn recover(&mut self, at: Time) {
        self.erratic_until = self.erratic_until.filter(|until| at < *until);
        self.judge();
    }

    /// A flight has ended: takes into use what it has taught. Returns the factor by which velocities shrink at the
    /// scale that is in use now.
    fn end_flight(&mut self) -> T {
        let noise_m_s = self.noise_m_s();
        let Some(Taught { scale, damping_per_s }) = self.free_fall.end(noise_m_s * noise_m_s) else {
            return T::one();
        };
        self.tuning.damping_per_s += damping_per_s;
        self.scale *= scale;
        let before = self.per_scale;
        self.per_scale = T::one() / self.scale;
        self.set_noise(self.tuning.noise_m_s);
        self.per_scale / before
    }

    /// The same at another height, with another velocity.
    #[cfg(test)]
    pub(crate) fn moved(self, height_m: T, velocity_m_s: T) -> Self {
        Self { flight: Flight { velocity_m_s, height_m, ..self.flight }, ..self }
    }

    /// The same after an impact of another jump.
    #[cfg(test)]
    pub(crate) fn struck(self, jump_m_s: T) -> Self {
        Self { jump_m_s, ..self }
    }
}

#[cfg(test)]
mod tests;
