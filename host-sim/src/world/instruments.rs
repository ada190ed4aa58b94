//! The measuring instruments: camera and vibrometer, which measure the rotor's motion, and the gyroscope that is
//! calibrated on it.
//!
//! Every imperfection is a setting of its own, off by default, and has a stream of random numbers of its own
//! ([`crate::math::random_streams`]). So switching one on leaves the noise of the others as it is.

pub mod camera;
pub(crate) mod gyroscope;
pub(crate) mod ldv;

pub use camera::Camera;
pub use ldv::Ldv;

use estimator::{CameraDescription, Instruments, VibrometerDescription};
use motor_model::Time;

use crate::scene::Scene;

/// The instruments as the filters assume them: as the scene describes them.
pub fn assumed(scene: &Scene) -> Instruments {
    let period_nanos = |key| nanos_of(1.0 / scene.number(key));
    let frame_nanos = period_nanos("camera.frame_rate_hz");
    #[expect(clippy::cast_precision_loss, reason = "at most 1e8")]
    let exposure_nanos = nanos_of(1e-9 * frame_nanos as f64 * scene.number("camera.exposure_frames"));
    Instruments {
        camera: CameraDescription {
            period_nanos: frame_nanos,
            exposure_nanos,
            latency_nanos: scene.integer("camera.latency_frames") * frame_nanos,
            noise_m: scene.number("camera.noise_m"),
            resolution_m: scene.number("camera.resolution_m"),
            radius_m: scene.number("camera.tracking_radius_m"),
        },
        vibrometer: Some(VibrometerDescription {
            period_nanos: period_nanos("ldv.sample_rate_hz"),
            noise_m_s: scene.number("ldv.noise_m_s"),
            bias_max_m_s: scene.number("ldv.bias_m_s").abs(),
            range_m_s: scene.number("ldv.range_m_s"),
            resolution_m_s: 0.0,
        }),
    }
}

/// Seconds, not negative, as whole nanoseconds.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; a cast saturates")]
fn nanos_of(seconds: f64) -> u64 {
    (1e9 * seconds).round() as u64
}

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
