//! A high-speed camera on a microscope, following a feature at a known radius.
//!
//! ```text
//! arc = radius * angle (within the turn) + tracking noise,   seen = resolution * round(arc / resolution)
//! ```
//!
//! Defaults: the paper's camera, 10,000 frames/s and 2 um of resolution, at a feature 3.9 mm from the axis; 1 um of
//! Gaussian tracking noise, and one frame of latency for reading out and tracking.
//!
//! Off unless a scene sets them:
//!
//! | what | model |
//! |---|---|
//! | exposure blur | a frame shows the mean angle over its exposure (trapezoidal rule) and has the time of its middle |
//! | dropped frame | it never arrives |
//! | duplicated frame | it arrives a second time, right after the first |
//! | outlier | Gaussian error of the tracked position, before quantisation |
//! | stamp jitter | Gaussian error of the time stamp alone |
//! | late frame | it arrives 1 to `camera.late_frames` frames later, all as likely, and later frames overtake it |
//! | loss | frames exposed within the outage do not exist |
//! | fault, from one time to another | frames show the last picture, angle zero, or a constant more than the angle |

mod delivery;
mod exposure;

use estimator::CameraFrame;
use motor_model::{Angle, Time};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::FaultWindow;
use crate::math::random_streams::{self, RandomFault, RandomSource};
use crate::scene::Scene;
use delivery::Delivery;
use exposure::Exposure;

/// What a faulty camera shows.
#[derive(Clone, Copy, Debug)]
enum CameraFault {
    /// The last picture before the fault.
    Stuck,
    /// Tracking finds nothing: angle zero.
    Zeros,
    /// Tracking follows another feature, a constant angle away.
    Offset(Angle),
}

/// The camera, with the frames that are on their way from it.
#[derive(Clone, Debug)]
pub struct Camera {
    radius_m: f64,
    resolution_m: f64,
    noise_m: f64,
    noise: Pcg64,
    exposure: Exposure,
    outlier: RandomFault,
    outlier_m: f64,
    stamp_jitter_nanos: f64,
    stamps: Pcg64,
    delivery: Delivery,
    fault: Option<(CameraFault, FaultWindow)>,
    /// The last picture without a fault.
    picture: Angle,
}

impl Camera {
    /// The camera of a scene, with a frame every `period_nanos`, which is a whole number of the steps of `look_nanos`
    /// at which [`Self::look`] is called.
    pub fn new(scene: &Scene, period_nanos: u64, look_nanos: f64) -> Self {
        let seed = scene.seed();
        Self {
            radius_m: scene.number("camera.tracking_radius_m"),
            resolution_m: scene.number("camera.resolution_m"),
            noise_m: scene.number("camera.noise_m"),
            noise: random_streams::stream(seed, RandomSource::Camera),
            exposure: Exposure::new(scene.number("camera.exposure_frames"), period_nanos, look_nanos),
            outlier: RandomFault::in_bursts(
                seed,
                RandomSource::CameraOutlier,
                scene.number("camera.outlier_probability"),
                scene.number("camera.outlier_burst_frames"),
            ),
            outlier_m: scene.number("camera.outlier_m"),
            stamp_jitter_nanos: 1e9 * scene.number("camera.stamp_jitter_s"),
            stamps: random_streams::stream(seed, RandomSource::CameraStamp),
            delivery: Delivery::new(scene, period_nanos),
            fault: Self::fault(scene),
            picture: Angle::ZERO,
        }
    }

    fn fault(scene: &Scene) -> Option<(CameraFault, FaultWindow)> {
        let fault = match scene.choice("camera.fault") {
            "stuck" => CameraFault::Stuck,
            "zeros" => CameraFault::Zeros,
            "offset" => CameraFault::Offset(Angle::from_degrees(scene.number("camera.fault_offset_deg"))),
            _ => return None,
        };
        Some((fault, FaultWindow::of(scene, "camera.fault_from_s", "camera.fault_until_s")))
    }

    /// Variance of a frame's angle in rad^2: tracking noise, and the quantisation's as if it were uniform and
    /// independent.
    pub fn variance_rad2(scene: &Scene) -> f64 {
        let [noise_m, resolution_m, radius_m] =
            ["camera.noise_m", "camera.resolution_m", "camera.tracking_radius_m"]
                .map(|key| scene.number(key));
        (noise_m * noise_m + resolution_m * resolution_m / 12.0) / (radius_m * radius_m)
    }

    /// Takes the rotor's angle at a step, for the mean over an exposure. To be called at every step.
    pub fn look(&mut self, angle: Angle) {
        self.exposure.look(angle);
    }

    /// Ends the exposure of a frame at `now`, when the rotor stands at `angle`.
    pub fn expose(&mut self, now: Time, angle: Angle) {
        let (shown, middle_nanos) = self.exposure.shown(angle);
        let exposed_at = self.stamped(now, middle_nanos);
        let seen = self.seen(shown);
        let seen = self.with_fault(now, seen);
        self.delivery.send(now, CameraFrame { exposed_at, angle: seen });
    }

    /// The angle that tracking gives for a true one.
    fn seen(&mut self, shown: Angle) -> Angle {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        let outlier = self.outlier.occurs().map_or(0.0, |rng| StandardNormal.sample(rng));
        let arc_m = self.radius_m * shown.wrapped().radians_since::<f64>(Angle::ZERO)
            + self.noise_m * noise
            + self.outlier_m * outlier;
        let seen_m = if self.resolution_m > 0.0 {
            self.resolution_m * (arc_m / self.resolution_m).round()
        } else {
            arc_m
        };
        Angle::from_degrees((seen_m / self.radius_m).to_degrees()).wrapped()
    }

    /// The angle that is delivered, with the fault at `now` if there is one.
    fn with_fault(&mut self, now: Time, seen: Angle) -> Angle {
        match self.fault.filter(|(_, span)| span.covers(now)) {
            Some((CameraFault::Stuck, _)) => self.picture,
            Some((CameraFault::Zeros, _)) => Angle::ZERO,
            Some((CameraFault::Offset(further), _)) => seen.plus(further).wrapped(),
            None => {
                self.picture = seen;
                seen
            }
        }
    }

    /// The time stamp of a frame whose middle of exposure was `middle_nanos` before `now`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "far within bounds, and it saturates"
    )]
    fn stamped(&mut self, now: Time, middle_nanos: u64) -> Time {
        let middle = Time::from_nanos(now.nanos_since(Time::from_nanos(middle_nanos)));
        let jitter: f64 = StandardNormal.sample(&mut self.stamps);
        let late_nanos = (self.stamp_jitter_nanos * jitter).round();
        if late_nanos < 0.0 {
            Time::from_nanos(middle.nanos_since(Time::from_nanos(-late_nanos as u64)))
        } else {
            middle.plus_nanos(late_nanos as u64)
        }
    }

    /// The oldest frame that has arrived by `now`.
    pub fn arrived(&mut self, now: Time) -> Option<CameraFrame> {
        self.delivery.arrived(now)
    }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
mod tests;
