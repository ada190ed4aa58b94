//! The measuring instruments: what camera and vibrometer make of the rotor's motion, and the gyroscope that is calibrated on it.
//!
//! Every imperfection is a setting of its own, off by default, and draws from a stream of its own ([`crate::math::random_streams`]): switching one on
//! leaves the noise of the others as it was.

pub mod camera;
pub mod gyroscope;
pub mod ldv;

pub use camera::Camera;
pub use gyroscope::Gyroscope;
pub use ldv::Ldv;

use motor_model::Time;

use crate::scene::Scene;

/// A span of time in which an instrument sees nothing, or something wrong.
#[derive(Clone, Copy, Debug)]
struct Span {
    from: Time,
    until: Time,
}

impl Span {
    /// Between two settings of `scene`, in s; none where they are equal.
    fn of(scene: &Scene, from: &'static str, until: &'static str) -> Self {
        let at = |key| Time::from_nanos(scene.nanos(key));
        Self { from: at(from), until: at(until) }
    }

    /// Whether it lasts at `now`: the end is no longer part of it.
    fn covers(self, now: Time) -> bool {
        self.from <= now && now < self.until
    }
}
