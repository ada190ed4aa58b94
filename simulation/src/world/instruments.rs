//! The measuring instruments: camera and vibrometer, which measure the rotor's motion, and the gyroscope that is
//! calibrated on it.
//!
//! Every imperfection is a setting of its own, off by default, and has a stream of random numbers of its own
//! ([`crate::math::random_streams`]). So switching one on leaves the noise of the others as it is.

mod assumed;
pub mod camera;
mod conflicts;
#[cfg(feature = "gyroscope")]
pub mod gyroscope;
pub mod ldv;

pub use assumed::{assumed, checked};
pub use camera::Camera;
pub(crate) use conflicts::check;
pub use ldv::Ldv;

use motor_model::Time;
use rand_distr::{Bernoulli, Distribution};
use rand_pcg::Pcg64;

use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::scene::faults::{Fault, FaultKind};

/// The faults of one instrument, each with its time.
#[derive(Clone, Debug)]
struct FaultTimes<F>(Vec<(F, Fault)>);

impl<F: Copy> FaultTimes<F> {
    /// Those of `scene` in which `pick` finds one of this instrument.
    fn of(scene: &Scene, pick: impl Fn(FaultKind) -> Option<F>) -> Self {
        let all = scene.faults().into_iter();
        Self(all.filter_map(|fault| Some((pick(fault.kind)?, fault))).collect())
    }

    /// The first one at `now`.
    fn at(&self, now: Time) -> Option<F> {
        self.0.iter().find(|(_, fault)| fault.covers(now)).map(|(of, _)| *of)
    }

    /// Whether there is one at `now`.
    fn cover(&self, now: Time) -> bool {
        self.at(now).is_some()
    }

    /// All at `now`.
    fn all(&self, now: Time) -> impl Iterator<Item = F> {
        self.0.iter().filter(move |(_, fault)| fault.covers(now)).map(|(of, _)| *of)
    }

    /// Whether `wanted` is one of those at `now`.
    fn any(&self, now: Time, wanted: F) -> bool
    where
        F: PartialEq,
    {
        self.0.iter().any(|(of, fault)| *of == wanted && fault.covers(now))
    }
}

/// Faults that come by chance while they last: at each occasion with their probability, independently of each other.
#[derive(Clone, Debug)]
struct FaultChances {
    probabilities: FaultTimes<f64>,
    stream: Pcg64,
}

impl FaultChances {
    /// Those of `scene` of which `pick` gives the probability.
    fn of(scene: &Scene, source: RandomSource, pick: impl Fn(FaultKind) -> Option<f64>) -> Self {
        let stream = random_streams::stream(scene.noise_seed(), source);
        Self { probabilities: FaultTimes::of(scene, pick), stream }
    }

    /// The same chances with the times of `fresh`: the stream goes on.
    fn take_times(&mut self, fresh: Self) {
        self.probabilities = fresh.probabilities;
    }

    /// Whether one of them comes at `now`; if so, the stream from which to draw its size.
    fn occurs(&mut self, now: Time) -> Option<&mut Pcg64> {
        if !self.probabilities.cover(now) {
            return None;
        }
        let none: f64 = self.probabilities.all(now).map(|probability| 1.0 - probability).product();
        let any = Bernoulli::new(1.0 - none).is_ok_and(|any| any.sample(&mut self.stream));
        any.then_some(&mut self.stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.3 and 0.5 at once are 0.65, each alone is itself, and outside of their times there is none.
    #[test]
    fn law_chances_add_up_while_they_last() {
        let mut scene = Scene::default();
        scene.set("faults", "camera:intermittent:0.3@1..3 camera:intermittent:0.5@2..4").unwrap();
        let mut chances = FaultChances::of(&scene, RandomSource::CameraFaultLoss, |kind| match kind {
            FaultKind::Camera(crate::scene::faults::CameraFault::Intermittent(part)) => Some(part),
            _ => None,
        });
        for (millis, probability) in [(999, 0.0), (1500, 0.3), (2500, 0.65), (3500, 0.5), (4000, 0.0)] {
            let now = Time::from_nanos(millis * 1_000_000);
            let count = (0..20_000).filter(|_| chances.occurs(now).is_some()).count();
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let off = (count as f64 - 2e4 * probability).abs();
            // Four standard deviations of a count.
            assert!(
                off <= 4.0 * motor_model::math::sqrt(2e4 * probability * (1.0 - probability)),
                "{millis} {count}"
            );
        }
    }
}
