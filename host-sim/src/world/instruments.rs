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

/// A span of time in which an instrument measures nothing, or something wrong.
#[derive(Clone, Copy, Debug)]
struct FaultWindow {
    from: Time,
    until: Time,
}

impl FaultWindow {
    /// Between two settings of `scene`, in s; none where they are equal.
    fn of(scene: &Scene, from: &'static str, until: &'static str) -> Self {
        let at = |key| Time::from_nanos(scene.nanos(key));
        Self { from: at(from), until: at(until) }
    }

    /// Whether `now` is in it; the end is not.
    fn covers(self, now: Time) -> bool {
        self.from <= now && now < self.until
    }
}
