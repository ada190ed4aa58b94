//! A high-speed camera on a microscope, following a feature at a known radius.
//!
//! ```text
//! arc = radius * angle (within the turn) + tracking noise,   seen = resolution * round(arc / resolution)
//! ```
//!
//! Defaults: the paper's camera, 10,000 frames/s and 2 um of resolution, at a feature 3.9 mm from the axis; 1 um of Gaussian tracking
//! noise, and one frame of latency for reading out and tracking.
//!
//! Off unless a scene sets them:
//!
//! | what | model |
//! |---|---|
//! | exposure blur | a frame shows the mean angle over its exposure (trapezoidal over the plant's steps) and bears the time of its middle |
//! | dropped frame | it never arrives |
//! | duplicated frame | it arrives a second time, right after the first |
//! | outlier | Gaussian error of the tracked position, before quantisation |
//! | stamp jitter | Gaussian error of the time that the frame bears; what it shows is not touched |
//! | late frame | it arrives 1 to `camera.late_frames` frames later, each as likely, so that later ones overtake it |
//! | loss | frames exposed within the outage do not exist |
//! | fault, from one time to another | frames show the last picture again, angle zero, or every angle a constant further |

mod exposure;

use std::collections::VecDeque;

use estimator::CameraFrame;
use motor_model::{Angle, Time};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;

use super::Span;
use crate::math::random_streams::{self, RandomFault, RandomSource};
use crate::scene::Scene;
use exposure::Exposure;

/// What a faulty camera shows.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The last picture before the fault.
    Stuck,
    /// Nothing that tracking finds: angle zero.
    Zeros,
    /// Another feature, a constant further.
    Offset(Angle),
}

/// The camera, and the frames on their way from it.
#[derive(Clone, Debug)]
pub struct Camera {
    radius_m: f64,
    resolution_m: f64,
    noise_m: f64,
    latency_nanos: u64,
    period_nanos: u64,
    noise: Pcg64,
    exposure: Exposure,
    drop: RandomFault,
    duplicate: RandomFault,
    outlier: RandomFault,
    outlier_m: f64,
    stamp_jitter_nanos: f64,
    stamps: Pcg64,
    late: RandomFault,
    late_frames: u64,
    outage: Span,
    fault: Option<(Fault, Span)>,
    /// The last picture that no fault has spoilt.
    picture: Angle,
    /// In order of arrival.
    on_the_way: VecDeque<(Time, CameraFrame)>,
}

impl Camera {
    /// The camera of a scene, whose period is `period_nanos` and a whole number of times that it is shown the rotor, every
    /// `look_nanos`.
    pub fn new(scene: &Scene, period_nanos: u64, look_nanos: f64) -> Self {
        let seed = scene.seed();
        let fault = |source, probability| RandomFault::new(seed, source, scene.number(probability));
        Self {
            radius_m: scene.number("camera.tracking_radius_m"),
            resolution_m: scene.number("camera.resolution_m"),
            noise_m: scene.number("camera.noise_m"),
            latency_nanos: scene.integer("camera.latency_frames") * period_nanos,
            period_nanos,
            noise: random_streams::stream(seed, RandomSource::Camera),
            exposure: Exposure::new(scene.number("camera.exposure_frames"), period_nanos, look_nanos),
            drop: fault(RandomSource::CameraDrop, "camera.drop_probability"),
            duplicate: fault(RandomSource::CameraDuplicate, "camera.duplicate_probability"),
            outlier: RandomFault::in_bursts(
                seed,
                RandomSource::CameraOutlier,
                scene.number("camera.outlier_probability"),
                scene.number("camera.outlier_burst_frames"),
            ),
            outlier_m: scene.number("camera.outlier_m"),
            stamp_jitter_nanos: 1e9 * scene.number("camera.stamp_jitter_s"),
            stamps: random_streams::stream(seed, RandomSource::CameraStamp),
            late: fault(RandomSource::CameraLate, "camera.late_probability"),
            late_frames: scene.integer("camera.late_frames"),
            outage: Span::of(scene, "camera.lost_from_s", "camera.lost_until_s"),
            fault: Self::fault(scene),
            picture: Angle::ZERO,
            on_the_way: VecDeque::new(),
        }
    }

    fn fault(scene: &Scene) -> Option<(Fault, Span)> {
        let fault = match scene.choice("camera.fault") {
            "stuck" => Fault::Stuck,
            "zeros" => Fault::Zeros,
            "offset" => Fault::Offset(Angle::from_degrees(scene.number("camera.fault_offset_deg"))),
            _ => return None,
        };
        Some((fault, Span::of(scene, "camera.fault_from_s", "camera.fault_until_s")))
    }

    /// Variance of a frame's angle in rad^2: tracking noise, and the quantisation's as if it were uniform and independent.
    pub fn variance_rad2(scene: &Scene) -> f64 {
        let [noise_m, resolution_m, radius_m] =
            ["camera.noise_m", "camera.resolution_m", "camera.tracking_radius_m"]
                .map(|key| scene.number(key));
        (noise_m * noise_m + resolution_m * resolution_m / 12.0) / (radius_m * radius_m)
    }

    /// Shows it the rotor: to be called at every step, so that a frame can be the mean over its exposure.
    pub fn look(&mut self, angle: Angle) {
        self.exposure.look(angle);
    }

    /// Ends the exposure of a frame at `now`, when the rotor stands at `angle`.
    pub fn expose(&mut self, now: Time, angle: Angle) {
        let (shown, middle_nanos) = self.exposure.shown(angle);
        let exposed_at = self.stamped(now, middle_nanos);
        let seen = self.seen(shown);
        let seen = self.spoilt(now, seen);
        // Every fault has its draw, also where the frame is dropped.
        let dropped = self.drop.occurs().is_some();
        let twice = self.duplicate.occurs().is_some();
        let most = self.late_frames;
        let late_frames = self.late.occurs().map_or(0, |rng| whole_up_to(most, rng));
        if dropped || self.outage.covers(now) {
            return;
        }
        let arrives_at = now.plus_nanos(self.latency_nanos + late_frames * self.period_nanos);
        let place = self.on_the_way.partition_point(|(earlier, _)| *earlier <= arrives_at);
        for _ in 0..=u8::from(twice) {
            self.on_the_way.insert(place, (arrives_at, CameraFrame { exposed_at, angle: seen }));
        }
    }

    /// What tracking makes of an angle.
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

    /// What a fault makes of a picture.
    fn spoilt(&mut self, now: Time, seen: Angle) -> Angle {
        match self.fault.filter(|(_, span)| span.covers(now)) {
            Some((Fault::Stuck, _)) => self.picture,
            Some((Fault::Zeros, _)) => Angle::ZERO,
            Some((Fault::Offset(further), _)) => seen.plus(further).wrapped(),
            None => {
                self.picture = seen;
                seen
            }
        }
    }

    /// The time that a frame bears, whose exposure was at its middle `middle_nanos` before `now`.
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
        let (arrives_at, frame) = *self.on_the_way.front()?;
        (arrives_at <= now).then(|| {
            self.on_the_way.pop_front();
            frame
        })
    }
}

/// A whole number from 1 to `most`.
fn whole_up_to(most: u64, rng: &mut Pcg64) -> u64 {
    Uniform::new_inclusive(1, most.max(1)).map_or(1, |uniform| uniform.sample(rng))
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
mod tests {
    use super::*;

    fn camera(sets: &[&str]) -> Camera {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Camera::new(&Scene::load(None, &sets).unwrap(), 100_000, 1000.0)
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

    /// Frames exposed every 100 us on a rotor at rest, in order of arrival, with the times of arrival in us.
    fn delivered(sets: &[&str], frames: u64) -> Vec<(u64, CameraFrame)> {
        let mut camera = camera(sets);
        let mut delivered = Vec::new();
        for n in 0..frames + 100 {
            let now = Time::from_micros(100 * n);
            if n < frames {
                camera.expose(now, Angle::ZERO);
            }
            delivered.extend(std::iter::from_fn(|| camera.arrived(now)).map(|frame| (100 * n, frame)));
        }
        delivered
    }

    fn stamps_us(delivered: &[(u64, CameraFrame)]) -> Vec<u64> {
        delivered.iter().map(|(_, frame)| frame.exposed_at.nanos() / 1000).collect()
    }

    /// Over an exposure T that ends at t, the mean of a + w t + c t^2 / 2 is its value at the middle and c T^2 / 24 more.
    #[test]
    fn exact_blur_is_the_mean_over_the_exposure() {
        let mut camera = camera(&["camera.exposure_frames=0.5", "camera.noise_m=0", "camera.resolution_m=0"]);
        let (rate_deg_s, curve_deg_s2) = (900.0, 4e7);
        let at = |t_s: f64| 100.0 + rate_deg_s * t_s + 0.5 * curve_deg_s2 * t_s * t_s;
        for n in 0..=100_u32 {
            camera.look(Angle::from_degrees(at(1e-6 * f64::from(n))));
        }
        camera.expose(Time::from_micros(100), Angle::from_degrees(at(1e-4)));
        let frame = camera.arrived(Time::from_micros(200)).unwrap();
        assert_eq!(frame.exposed_at, Time::from_micros(75));
        let blurred = at(75e-6) + curve_deg_s2 * 50e-6 * 50e-6 / 24.0;
        // Trapezia of 1 us add c h^2 / 12; units of 2^-32 turn are 8.4e-8 degrees.
        let trapezia = curve_deg_s2 * 1e-12 / 12.0;
        assert!((frame.angle.degrees() - blurred - trapezia).abs() < 2e-7, "{}", frame.angle.degrees());
    }

    /// A mean of probability p over n frames is known to sqrt(p (1 - p) / n).
    #[test]
    fn law_dropped_and_duplicated_frames_are_as_many_as_they_should() {
        let n = 20_000;
        let dropped = delivered(&["camera.drop_probability=0.3"], n);
        assert!(dropped.len().abs_diff(14_000) < 260, "{}", dropped.len());
        let twice = delivered(&["camera.duplicate_probability=0.3"], n);
        assert!(twice.len().abs_diff(26_000) < 260, "{}", twice.len());
        let repeats = twice.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert_eq!(repeats, twice.len() - 20_000, "the second is the first again");
        assert!(delivered(&["camera.drop_probability=1"], 10).is_empty());
    }

    /// Without noise, a part p of outliers of deviation s is a root mean square of s sqrt p.
    #[test]
    fn law_outliers_have_their_frequency_and_size() {
        let only = ["camera.noise_m=0", "camera.resolution_m=0", "camera.outlier_m=2e-4"];
        let sets = [only.as_slice(), &["camera.outlier_probability=0.1"]].concat();
        let frames = delivered(&sets, 40_000);
        let arcs_m: Vec<f64> = frames.iter().map(|(_, f)| 3.9e-3 * f.angle.degrees().to_radians()).collect();
        let outliers = arcs_m.iter().filter(|arc_m| arc_m.abs() > 0.0).count();
        assert!(outliers.abs_diff(4000) < 240, "{outliers}");
        let mean_square = arcs_m.iter().map(|arc_m| arc_m * arc_m).sum::<f64>() / 4e4;
        assert!((mean_square / (0.1 * 4e-8) - 1.0).abs() < 0.15, "{mean_square}");
    }

    #[test]
    fn law_stamps_are_off_by_their_jitter_and_the_angle_is_not() {
        let frames = delivered(&["camera.stamp_jitter_s=1e-5"], 20_000);
        let errors_us: Vec<f64> = (frames.iter().enumerate().skip(10))
            .map(|(n, (_, frame))| 1e-3 * frame.exposed_at.nanos() as f64 - 100.0 * n as f64)
            .collect();
        let mean = errors_us.iter().sum::<f64>() / 2e4;
        let mean_square = errors_us.iter().map(|e| e * e).sum::<f64>() / 2e4;
        assert!(mean.abs() < 0.3 && (mean_square / 100.0 - 1.0).abs() < 0.05, "{mean} {mean_square}");
        let undisturbed = delivered(&[], 20_000);
        assert!(frames.iter().zip(&undisturbed).all(|(a, b)| a.1.angle == b.1.angle && a.0 == b.0));
    }

    /// Half of the frames come 1, 2 or 3 periods later: 100 us of latency and 0.5 * 200 us on average, and some are overtaken.
    #[test]
    fn law_late_frames_are_overtaken_and_none_is_lost() {
        let frames = delivered(&["camera.late_probability=0.5"], 20_000);
        let mut stamps = stamps_us(&frames);
        assert!(stamps.windows(2).any(|pair| pair[0] > pair[1]), "out of order");
        let mean_us =
            frames.iter().zip(&stamps).map(|((arrived, _), stamp)| arrived - stamp).sum::<u64>() as f64 / 2e4;
        assert!((mean_us - 200.0).abs() < 4.0, "{mean_us}");
        let latest = frames.iter().zip(&stamps).map(|((arrived, _), stamp)| arrived - stamp).max();
        assert_eq!(latest, Some(400));
        stamps.sort_unstable();
        assert_eq!(stamps, (0..20_000).map(|n| 100 * n).collect::<Vec<_>>());
    }

    #[test]
    fn exact_a_lost_camera_delivers_nothing_of_the_loss() {
        let frames = delivered(&["camera.lost_from_s=0.001", "camera.lost_until_s=0.002"], 30);
        let expected: Vec<u64> = (0..30).filter(|n| !(10..20).contains(n)).map(|n| 100 * n).collect();
        assert_eq!(stamps_us(&frames), expected);
    }

    /// Pictures 1 ms long from 1 ms on: the last one, zero, or ten degrees further; before and after as without a fault.
    #[test]
    fn exact_faulty_pictures() {
        let good = delivered(&[], 30);
        let ten = Angle::from_degrees(10.0);
        for (fault, expected) in [
            (
                "camera.fault=stuck",
                (|frames, _| frames[9].1.angle) as fn(&[(u64, CameraFrame)], Angle) -> Angle,
            ),
            ("camera.fault=zeros", |_, _| Angle::ZERO),
            ("camera.fault=offset", |_, further| further),
        ] {
            let span = ["camera.fault_from_s=0.001", "camera.fault_until_s=0.002"];
            let sets = [fault, span[0], span[1], "camera.fault_offset_deg=10"];
            for (n, (spoilt, good_one)) in delivered(&sets, 30).iter().zip(&good).enumerate() {
                let angle = if (10..20).contains(&n) {
                    expected(&good, good_one.1.angle.plus(ten).wrapped())
                } else {
                    good_one.1.angle
                };
                assert_eq!((spoilt.1.angle, spoilt.0), (angle, good_one.0), "{fault} {n}");
            }
        }
    }

    /// A fault does not change the draws of the others and of the noise.
    #[test]
    fn law_faults_do_not_shift_the_noise() {
        let undisturbed = delivered(&[], 1000);
        for set in
            ["camera.drop_probability=0.5", "camera.late_probability=0.5", "camera.outlier_probability=0.01"]
        {
            let disturbed = delivered(&[set], 1000);
            let same =
                disturbed.iter().filter(|(_, frame)| undisturbed.iter().any(|(_, other)| other == frame));
            assert!(same.count() * 100 >= 95 * disturbed.len(), "{set}");
        }
    }
}
