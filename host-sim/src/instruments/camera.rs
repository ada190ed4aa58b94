//! A high-speed camera on a microscope, following a feature at a known radius.
//!
//! ```text
//! arc = radius * angle (within the turn) + tracking noise,   seen = resolution * round(arc / resolution)
//! ```
//!
//! Defaults: the paper's camera, 10,000 frames/s and 2 um of resolution, at a feature 3.9 mm from the axis; 1 um of Gaussian tracking
//! noise, and one frame of latency for reading out and tracking.

use std::collections::VecDeque;

use estimator::CameraFrame;
use motor_model::{Angle, Time};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::chance::{self, Source};
use crate::scene::{Kind, Scene, Setting};

/// The camera's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "camera.frame_rate_hz",
        unit: "Hz",
        kind: Kind::Number { default: 10_000.0, min: 10.0, max: 100_000.0 },
        meaning: "frames a second",
    },
    Setting {
        key: "camera.tracking_radius_m",
        unit: "m",
        kind: Kind::Number { default: 3.9e-3, min: 1e-4, max: 1e-1 },
        meaning: "distance of the tracked feature from the axis",
    },
    Setting {
        key: "camera.resolution_m",
        unit: "m",
        kind: Kind::Number { default: 2e-6, min: 0.0, max: 1e-3 },
        meaning: "step of the tracked position; 0 for none",
    },
    Setting {
        key: "camera.noise_m",
        unit: "m",
        kind: Kind::Number { default: 1e-6, min: 0.0, max: 1e-3 },
        meaning: "standard deviation of the tracking noise, before quantisation",
    },
    Setting {
        key: "camera.latency_frames",
        unit: "",
        kind: Kind::Integer { default: 1, min: 0, max: 1000 },
        meaning: "frames between exposure and arrival",
    },
];

/// The camera, and the frames on their way from it.
#[derive(Clone, Debug)]
pub struct Camera {
    radius_m: f64,
    resolution_m: f64,
    noise_m: f64,
    latency_nanos: u64,
    noise: Pcg64,
    on_the_way: VecDeque<(Time, CameraFrame)>,
}

impl Camera {
    /// The camera of a scene, whose period is `period_nanos`.
    pub fn new(scene: &Scene, period_nanos: u64) -> Self {
        Self {
            radius_m: scene.number("camera.tracking_radius_m"),
            resolution_m: scene.number("camera.resolution_m"),
            noise_m: scene.number("camera.noise_m"),
            latency_nanos: scene.integer("camera.latency_frames") * period_nanos,
            noise: chance::stream(scene.seed(), Source::Camera),
            on_the_way: VecDeque::new(),
        }
    }

    /// Exposes a frame.
    pub fn expose(&mut self, now: Time, angle: Angle) {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        let arc_m = self.radius_m * angle.wrapped().radians_since::<f64>(Angle::ZERO) + self.noise_m * noise;
        let seen_m = if self.resolution_m > 0.0 {
            self.resolution_m * (arc_m / self.resolution_m).round()
        } else {
            arc_m
        };
        let seen = Angle::from_degrees((seen_m / self.radius_m).to_degrees()).wrapped();
        let frame = CameraFrame { exposed_at: now, angle: seen };
        self.on_the_way.push_back((now.plus_nanos(self.latency_nanos), frame));
    }

    /// The oldest frame that has arrived by `now`.
    pub fn arrived(&mut self, now: Time) -> Option<CameraFrame> {
        let (arrives_at, frame) = *self.on_the_way.front()?;
        (arrives_at <= now).then(|| {
            self.on_the_way.pop_front();
            frame
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(sets: &[&str]) -> Camera {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Camera::new(&Scene::load(None, &sets).unwrap(), 100_000)
    }

    fn seen_deg(camera: &mut Camera, degrees: f64) -> f64 {
        camera.expose(Time::ZERO, Angle::from_degrees(degrees));
        camera.arrived(Time::from_micros(1000)).unwrap().angle.degrees()
    }

    #[test]
    fn exact_quantisation_without_noise() {
        let mut camera = camera(&["camera.noise_m=0"]);
        let cell_deg = (2e-6_f64 / 3.9e-3).to_degrees();
        for (given, cells) in
            [(0.0, 0.0), (0.4 * cell_deg, 0.0), (0.6 * cell_deg, 1.0), (-7.4 * cell_deg, -7.0)]
        {
            assert!((seen_deg(&mut camera, given) - cells * cell_deg).abs() < 1e-6, "{given}");
        }
        assert!(
            (seen_deg(&mut camera, 720.0 + 7.0 * cell_deg) - 7.0 * cell_deg).abs() < 1e-6,
            "whole turns are not seen"
        );
    }

    /// Gaussian noise of 1 um and uniform quantisation of 2 um add as variances: 1 + 4/12 um^2, 17 milli-degrees at 3.9 mm.
    #[test]
    fn law_noise_has_the_variance_of_tracking_and_quantisation() {
        let mut camera = camera(&[]);
        let n = 40_000;
        // Truth moves by an irrational part of a cell, so that quantisation errors are uniform.
        let errors = (0..n).map(|i| {
            let truth = f64::from(i) * 0.007_639_320_225;
            let error = seen_deg(&mut camera, truth) - Angle::from_degrees(truth).wrapped().degrees();
            Angle::from_degrees(error).wrapped().degrees()
        });
        let mean_square = errors.map(|e| e * e).sum::<f64>() / f64::from(n);
        let expected_deg2 =
            (1e-12_f64 + 4e-12 / 12.0) / (3.9e-3 * 3.9e-3) * 1_f64.to_degrees() * 1_f64.to_degrees();
        // The variance of 40,000 squares of a normal is known to 0.7 %.
        assert!((mean_square / expected_deg2 - 1.0).abs() < 0.03, "{mean_square} {expected_deg2}");
        assert!((motor_model::math::sqrt(mean_square) - 0.017).abs() < 0.0005);
    }

    #[test]
    fn exact_a_frame_arrives_one_frame_late_and_once() {
        let mut camera = camera(&[]);
        camera.expose(Time::from_micros(500), Angle::ZERO);
        assert!(camera.arrived(Time::from_micros(599)).is_none());
        assert_eq!(camera.arrived(Time::from_micros(600)).unwrap().exposed_at, Time::from_micros(500));
        assert!(camera.arrived(Time::from_micros(700)).is_none());
    }
}
