//! The sub-pixel bias of a tracker: an error that depends on where in a pixel a mark lies.
//!
//! Trackers interpolate between pixels. What they are off by is the same at the same place of every pixel, whatever the
//! number of frames, and close to a sine (Schreier, Braasch and Sutton, Optical Engineering 39 (2000) 2915-2921; Su et
//! al., Optics Express 23 (2015) 19242-19256). Particle image velocimetry calls it pixel locking (Westerweel,
//! Measurement Science and Technology 8 (1997) 1379-1392). Each coordinate of each mark is tracked at
//!
//! ```text
//! x + A sin(2 pi x / P + phase)
//! ```
//!
//! The phase is drawn for each coordinate of each mark: a tracker compares a mark with a picture of its own, which lies
//! at a place of its own in its pixels. So as the rotor turns the errors change, and those of two marks are
//! independent. Their mean square over the phases is `A^2 / 2`.
//!
//! # What it does to the angle
//!
//! ```text
//! one mark      e = t . (b_x, b_y) / r                 t: the direction of the arc
//! n marks       e = sum over j of t_j . b_j / (n r)    the rigid motion that fits them best, to first order in b
//! variance      A^2 / (2 n r^2)                        at every angle, over the phases
//! ```

use motor_model::math;
use rand_distr::{Distribution, Uniform};

use super::rigid_motion::Place;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;

/// The bias of all marks.
#[derive(Clone, Debug)]
pub(super) struct SubpixelBias {
    amplitude_m: f64,
    radians_per_m: f64,
    /// Of each mark, by x and y.
    phases: Vec<[f64; 2]>,
}

impl SubpixelBias {
    /// That of a scene; `None` without.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let [amplitude_m, pixel_m] =
            ["camera.subpixel_bias_m", "camera.pixel_m"].map(|key| scene.number(key));
        let mut draw = random_streams::stream(scene.seed(), RandomSource::CameraSubpixelBias);
        let mut phase = || Uniform::new(0.0, std::f64::consts::TAU).map_or(0.0, |law| law.sample(&mut draw));
        (amplitude_m > 0.0).then_some(Self {
            amplitude_m,
            radians_per_m: std::f64::consts::TAU / pixel_m,
            phases: (0..scene.integer("camera.marks")).map(|_| [phase(), phase()]).collect(),
        })
    }

    /// By how much the mark numbered `mark`, from 0, is tracked beside its place in the picture.
    pub(super) fn at(&self, mark: usize, place: Place) -> Place {
        let phases = self.phases.get(mark).copied().unwrap_or_default();
        [0, 1].map(|axis| self.amplitude_m * math::sin_cos(self.radians_per_m * place[axis] + phases[axis]).0)
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, Time};

    use super::*;
    use crate::math::count::real;
    use crate::world::instruments::camera::{Camera, Shown};
    use crate::world::pose::Pose;

    const RADIUS_M: f64 = 3.9e-3;
    const BIAS_M: f64 = 0.5e-6;

    fn scene(marks: usize, bias_m: f64, seed: u64, more: &[&str]) -> Scene {
        let sets = [
            format!("camera.marks={marks}"),
            format!("camera.subpixel_bias_m={bias_m}"),
            format!("seed={seed}"),
        ];
        let more = more.iter().map(|&set| set.to_owned());
        Scene::of_sets(&sets.into_iter().chain(more).collect::<Vec<_>>()).unwrap()
    }

    /// The frame of a level rotor at `degrees`.
    fn seen(camera: &mut Camera, degrees: f64) -> Angle {
        camera.expose(Time::ZERO, Shown { angle: Angle::from_degrees(degrees), pose: Pose::LEVEL });
        camera.arrived(Time::from_micros(100)).unwrap().angle
    }

    /// `sum over j of t_j . b_j / (n r)`, clockwise, by the direction of the arc at each mark.
    fn closed_form_rad(bias: &SubpixelBias, marks: usize, degrees: f64) -> f64 {
        let each = (0..marks).map(|mark| {
            let direction = std::f64::consts::TAU * real(mark) / real(marks) - degrees.to_radians();
            let (sine, cosine) = math::sin_cos(direction);
            let [x, y] = bias.at(mark, [RADIUS_M * cosine, RADIUS_M * sine]);
            sine * x - cosine * y
        });
        each.sum::<f64>() / (real(marks) * RADIUS_M)
    }

    /// The bias is added to frames that are the same else, noise included. To first order: the second is `b^2 / r^2`,
    /// 1.6e-8 rad, and an angle is rounded to 1.5e-9 rad.
    #[test]
    fn exact_the_angle_is_off_by_the_bias_along_the_arc() {
        for marks in [1, 2, 3, 8] {
            let biased = scene(marks, BIAS_M, 7, &["camera.resolution_m=0"]);
            let bias = SubpixelBias::of(&biased).unwrap();
            let mut cameras =
                [Camera::new(&biased), Camera::new(&scene(marks, 0.0, 7, &["camera.resolution_m=0"]))];
            for n in 0..500 {
                let degrees = 0.731 * f64::from(n);
                let [with, without] = cameras.each_mut().map(|camera| seen(camera, degrees));
                let off_rad: f64 = with.minus(without).wrapped().radians_since(Angle::ZERO);
                let expected_rad = closed_form_rad(&bias, marks, degrees);
                assert!(
                    (off_rad - expected_rad).abs() < 1e-7,
                    "{marks} {degrees}: {off_rad:e} {expected_rad:e}"
                );
            }
        }
    }

    /// `A^2 / (2 n r^2)` in the mean over seeds, at any angle. A square of a sum of sines varies by less than 1.4 times
    /// itself, as one of a normal number does, so that the mean of 2,000 is known to 3.2 %; three of those.
    #[test]
    fn law_its_variance_falls_with_the_marks() {
        for (marks, degrees) in [(1, 0.0), (1, 33.0), (2, 10.0), (8, -70.0)] {
            let square = |seed| {
                let bias = SubpixelBias::of(&scene(marks, BIAS_M, seed, &[])).unwrap();
                let off_rad = closed_form_rad(&bias, marks, degrees);
                off_rad * off_rad / 2000.0
            };
            let expected = BIAS_M * BIAS_M / (2.0 * real(marks) * RADIUS_M * RADIUS_M);
            let ratio = (0..2000).map(square).sum::<f64>() / expected;
            assert!((ratio - 1.0).abs() < 0.096, "{marks} {degrees}: {ratio}");
        }
    }

    /// A pixel further it is the same, half a pixel further the opposite.
    #[test]
    fn exact_it_repeats_from_pixel_to_pixel() {
        let bias = SubpixelBias::of(&scene(2, BIAS_M, 3, &["camera.pixel_m=4e-6"])).unwrap();
        let at = |x_m| bias.at(1, [x_m, 0.0])[0];
        assert!((at(1.3e-3) - at(1.3e-3 + 4e-6)).abs() < 1e-15);
        assert!((at(1.3e-3) + at(1.3e-3 + 2e-6)).abs() < 1e-15);
        assert!(SubpixelBias::of(&scene(2, 0.0, 3, &[])).is_none());
    }
}
