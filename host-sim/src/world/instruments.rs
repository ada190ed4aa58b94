//! The measuring instruments: camera and vibrometer, which measure the rotor's motion, and the gyroscope that is
//! calibrated on it.
//!
//! Every imperfection is a setting of its own, off by default, and has a stream of random numbers of its own
//! ([`crate::math::random_streams`]). So switching one on leaves the noise of the others as it is.

mod assumed;
pub mod camera;
mod conflicts;
pub(crate) mod gyroscope;
pub(crate) mod ldv;

pub use assumed::assumed;
pub use camera::Camera;
pub(crate) use conflicts::check;
pub use ldv::Ldv;

use motor_model::Time;

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

    /// Whether `wanted` is one of those at `now`.
    fn any(&self, now: Time, wanted: F) -> bool
    where
        F: PartialEq,
    {
        self.0.iter().any(|(of, fault)| *of == wanted && fault.covers(now))
    }
}
