//! A laser-Doppler vibrometer (LDV) on the rotor: the vertical velocity of its surface at one spot, with white noise.
//!
//! The spot stays where it is while the rotor turns below it. By default it is on the axis, where it shows the velocity
//! of the rotor's centre; at a radius it shows the tilt as well ([`crate::world::pose`]).
//!
//! Default noise: 0.2 mm/s a sample at 200,000 samples/s, that is 0.6 um/s per root hertz, the order of a vibrometer of
//! the paper's kind on a coarse range.
//!
//! ```text
//! sample = clamp(step round(((1 + gain error) velocity + bias + noise + outlier) / step), -range, range)
//! step   = 2 range / 2^bits, none without bits
//! ```
//!
//! A scene may have no vibrometer: then no sample ever comes. Off unless a scene sets them:
//!
//! | what | model |
//! |---|---|
//! | phase, jitter | when a sample is taken: [`crate::world::event_clock`] |
//! | gain error and bias | of the decoder |
//! | outlier, drop-out | of the speckle: a Gaussian error; a sample that does not exist |
//! | saturation | the range clamps the sample |
//! | loss | samples within the outage do not exist |
//! | fault, from one time to another | the last value again, zeros, the wrong sign, no number, or a constant more |
//! | fault by chance, from one time to another | samples are lost, or outliers |

use std::collections::VecDeque;

use estimator::LdvSample;
use motor_model::{Time, math};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::{FaultChances, FaultTimes};
use crate::math::random_streams::{self, RandomFault, RandomSource};
use crate::scene::Scene;
use crate::scene::faults::{FaultKind, VibrometerFault};
use crate::world::event_clock::{EventClock, EventRate};
use crate::world::rotor_path::RotorPath;

/// Step of samples of `bits` over the range to either side, in m/s; 0 for no bits.
#[expect(clippy::cast_precision_loss, reason = "at most 2^24")]
pub(super) fn resolution_m_s(range_m_s: f64, bits: u64) -> f64 {
    if bits == 0 { 0.0 } else { 2.0 * range_m_s / (1_u64 << bits.min(24)) as f64 }
}

/// The vibrometer, with the samples that are not yet read.
#[derive(Clone, Debug)]
pub struct Ldv {
    /// Instants of the samples; `None` in a scene without a vibrometer.
    clock: Option<EventClock>,
    /// Place of the spot in m from the axis.
    spot_m: [f64; 2],
    noise_m_s: f64,
    noise: Pcg64,
    drop: RandomFault,
    outlier: RandomFault,
    outlier_m_s: f64,
    range_m_s: f64,
    /// Step of the samples; 0 for none.
    resolution_m_s: f64,
    gain: f64,
    bias_m_s: f64,
    faults: FaultTimes<VibrometerFault>,
    intermittent: FaultChances,
    /// Outliers of faults.
    faulty: FaultChances,
    /// Offsets in m/s.
    offsets: FaultTimes<f64>,
    /// The last value without a fault.
    shown_m_s: f32,
    /// By how much samples are taken later than they are stamped.
    late_nanos: u64,
    unread: VecDeque<LdvSample>,
}

impl Ldv {
    /// The vibrometer of a scene.
    pub fn new(scene: &Scene) -> Self {
        let seed = scene.noise_seed();
        let fault = |source, probability| RandomFault::new(seed, source, scene.number(probability));
        let range_m_s = scene.number("ldv.range_m_s");
        let rate = EventRate::from_hz(scene.number("ldv.sample_rate_hz"));
        let clock = EventClock::new(rate, scene.number("ldv.phase_samples")).with_jitter(
            1e9 * scene.number("ldv.period_jitter_s"),
            random_streams::stream(seed, RandomSource::LdvClock),
        );
        let (radius_m, angle_rad) =
            (scene.number("ldv.radius_m"), scene.number("ldv.angle_deg").to_radians());
        let (sine, cosine) = math::sin_cos(angle_rad);
        Self {
            clock: (scene.choice("ldv.installed") == "yes").then_some(clock),
            spot_m: [radius_m * cosine, radius_m * sine],
            resolution_m_s: resolution_m_s(range_m_s, scene.integer("ldv.bits")),
            noise_m_s: scene.number("ldv.noise_m_s"),
            noise: random_streams::stream(seed, RandomSource::Ldv),
            drop: fault(RandomSource::LdvDrop, "ldv.drop_probability"),
            outlier: RandomFault::in_bursts(
                seed,
                RandomSource::LdvOutlier,
                scene.number("ldv.outlier_probability"),
                scene.number("ldv.outlier_burst_samples"),
            ),
            outlier_m_s: scene.number("ldv.outlier_m_s"),
            range_m_s: if range_m_s > 0.0 { range_m_s } else { f64::INFINITY },
            gain: 1.0 + scene.number("ldv.gain_error"),
            bias_m_s: scene.number("ldv.bias_m_s"),
            faults: FaultTimes::of(scene, |kind| match kind {
                FaultKind::Vibrometer(fault) => (!is_additional(fault)).then_some(fault),
                _ => None,
            }),
            intermittent: FaultChances::of(scene, RandomSource::LdvFaultLoss, |kind| match kind {
                FaultKind::Vibrometer(VibrometerFault::Intermittent(probability)) => Some(probability),
                _ => None,
            }),
            faulty: FaultChances::of(scene, RandomSource::LdvFaultOutlier, |kind| match kind {
                FaultKind::Vibrometer(VibrometerFault::Outliers(probability)) => Some(probability),
                _ => None,
            }),
            offsets: FaultTimes::of(scene, |kind| match kind {
                FaultKind::Vibrometer(VibrometerFault::Offset(by_m_s)) => Some(by_m_s),
                _ => None,
            }),
            shown_m_s: 0.0,
            late_nanos: 0,
            unread: VecDeque::new(),
        }
    }

    /// Takes the faults of `scene`, which describes this vibrometer and its faults until the present.
    pub fn change_faults(&mut self, scene: &Scene) {
        let Self { faults, intermittent, faulty, offsets, .. } = Self::new(scene);
        (self.faults, self.offsets) = (faults, offsets);
        self.intermittent.take_times(intermittent);
        self.faulty.take_times(faulty);
    }

    /// The value that is delivered, with the fault at `now` if there is one.
    fn with_fault(&mut self, now: Time, velocity_m_s: f32) -> f32 {
        match self.faults.at(now) {
            Some(VibrometerFault::Stuck) => self.shown_m_s,
            Some(VibrometerFault::Zeros) => 0.0,
            Some(VibrometerFault::Inverted) => -velocity_m_s,
            Some(VibrometerFault::NotANumber) => f32::NAN,
            // A lost sample is never asked for; the others are in the value.
            _ => {
                self.shown_m_s = velocity_m_s;
                velocity_m_s
            }
        }
    }

    /// When the next sample is due; never without a vibrometer.
    #[inline]
    pub fn due(&self) -> Time {
        self.stamp().map_or(Time::from_nanos(u64::MAX), |stamp| stamp.plus_nanos(self.late_nanos))
    }

    /// The time of the next sample, as it is stamped.
    #[inline]
    fn stamp(&self) -> Option<Time> {
        self.clock.as_ref().map(EventClock::due)
    }

    /// From now on the board takes each sample later by this than its stamp says.
    pub fn sample_late(&mut self, late_nanos: u64) {
        self.late_nanos = late_nanos;
    }

    /// Sees the rotor over a step: takes the samples that are due.
    pub fn follow(&mut self, path: &RotorPath) {
        while let (at, Some(stamp)) = (self.due(), self.stamp())
            && at <= path.until.at
        {
            self.sample(stamp, path.velocity_at(at, self.spot_m));
            self.clock.iter_mut().for_each(EventClock::advance);
        }
    }

    /// Takes a sample.
    pub fn sample(&mut self, now: Time, velocity_m_s: f64) {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        let outlier = self.outlier(now);
        let [dropped, missed] = [self.drop.occurs().is_some(), self.intermittent.occurs(now).is_some()];
        if dropped || missed || self.faults.any(now, VibrometerFault::Lost) {
            return;
        }
        let offset_m_s = self.bias_m_s + self.offsets.all(now).sum::<f64>();
        let shown_m_s =
            self.gain * velocity_m_s + offset_m_s + self.noise_m_s * noise + self.outlier_m_s * outlier;
        let shown_m_s = if self.resolution_m_s > 0.0 {
            self.resolution_m_s * (shown_m_s / self.resolution_m_s).round()
        } else {
            shown_m_s
        };
        #[expect(clippy::cast_possible_truncation, reason = "the instrument delivers f32")]
        let velocity_m_s = shown_m_s.clamp(-self.range_m_s, self.range_m_s) as f32;
        let velocity_m_s = self.with_fault(now, velocity_m_s);
        self.unread.push_back(LdvSample { taken_at: now, velocity_m_s });
    }

    /// Error of an outlier, in standard deviations; 0 of any other sample.
    fn outlier(&mut self, now: Time) -> f64 {
        let error = |rng: Option<&mut Pcg64>| rng.map_or(0.0, |rng| StandardNormal.sample(rng));
        let by_chance: f64 = error(self.outlier.occurs());
        by_chance + error(self.faulty.occurs(now))
    }

    /// The oldest sample not yet read.
    pub fn read(&mut self) -> Option<LdvSample> {
        self.unread.pop_front()
    }
}

/// Whether a sample with this fault is its own value, if it comes, and something more.
fn is_additional(fault: VibrometerFault) -> bool {
    use VibrometerFault::{Intermittent, Offset, Outliers};
    matches!(fault, Intermittent(_) | Outliers(_) | Offset(_))
}

#[cfg(test)]
mod tests;
