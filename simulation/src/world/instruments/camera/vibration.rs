//! Vibration of the microscope: the whole picture moves against the motor.
//!
//! ```text
//! shift(t) = V sin(2 pi f t + phase) (cos b, sin b)         phase and direction b drawn by the seed
//! ```
//!
//! A frame shows the mean over its exposure T, `sin(pi f T) / (pi f T)` times the shift at its middle. Two marks or
//! more show it as a shift of the rotor. One mark shows its part along the arc as an angle, `t . shift / r`.

use std::f64::consts::TAU;

use motor_model::{Time, math};
use rand_distr::{Distribution, Uniform};

use crate::math::count::real;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;

/// A vibrating microscope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vibration {
    /// Along x and y.
    amplitude_m: [f64; 2],
    rad_s: f64,
    phase: f64,
}

impl Vibration {
    /// That of a scene; `None` without.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let [amplitude_m, hz] = ["camera.vibration_m", "camera.vibration_hz"].map(|key| scene.number(key));
        let mut draw = random_streams::stream(scene.noise_seed(), RandomSource::CameraVibration);
        let mut angle = || Uniform::new(0.0, TAU).map_or(0.0, |law| law.sample(&mut draw));
        let ((sine, cosine), phase) = (math::sin_cos(angle()), angle());
        (amplitude_m > 0.0).then_some(Self {
            amplitude_m: [amplitude_m * cosine, amplitude_m * sine],
            rad_s: TAU * hz,
            phase,
        })
    }

    /// By how much the picture is shifted in the mean over an exposure of `exposure_nanos` that ends at `ends`.
    pub(super) fn mean_shift_m(&self, ends: Time, exposure_nanos: u64) -> [f64; 2] {
        let (end_s, exposure_s) = (ends.seconds_since::<f64>(Time::ZERO), 1e-9 * real(exposure_nanos));
        let half = 0.5 * self.rad_s * exposure_s;
        let kept = if half > 0.0 { math::sin_cos(half).0 / half } else { 1.0 };
        let (sine, _) = math::sin_cos(self.rad_s * (end_s - 0.5 * exposure_s) + self.phase);
        self.amplitude_m.map(|amplitude_m| amplitude_m * kept * sine)
    }
}

#[cfg(test)]
mod tests {
    use motor_model::Angle;

    use super::*;
    use crate::world::instruments::camera::{Camera, DeliveredFrame, Shown};
    use crate::world::pose::Pose;

    const RADIUS_M: f64 = 3.9e-3;
    const AMPLITUDE_M: f64 = 1e-6;

    fn scene(sets: &[&str]) -> Scene {
        let exact = ["camera.resolution_m=0", "seed=5"];
        let sets = exact.iter().chain(sets).map(|&set| set.to_owned());
        Scene::of_sets(&sets.collect::<Vec<_>>()).unwrap()
    }

    /// Frames every 100 us on a rotor at 40 degrees.
    fn frames(sets: &[&str]) -> impl Iterator<Item = DeliveredFrame> + use<> {
        let mut camera = Camera::new(&scene(sets));
        (0..400_u64).map(move |n| {
            let shown = Shown { angle: Angle::from_degrees(40.0), pose: Pose::LEVEL };
            camera.expose(Time::from_micros(100 * n), shown);
            camera.delivered(Time::from_micros(100 * n + 100)).unwrap()
        })
    }

    /// One mark turns by `t . shift / r` beside a camera at rest, noise included, to second order 1e-7 rad; two turn by
    /// nothing and are shifted.
    #[test]
    fn exact_one_mark_shows_it_as_an_angle_and_two_as_a_shift() {
        let moving = ["camera.vibration_m=1e-6", "camera.vibration_hz=170"];
        let vibration = Vibration::of(&scene(&moving)).unwrap();
        let (sine, cosine) = math::sin_cos(-40_f64.to_radians());
        for marks in ["camera.marks=1", "camera.marks=2"] {
            let both = frames(&[&moving[..], &[marks]].concat()).zip(frames(&[marks]));
            for (n, (with, without)) in (0..).zip(both) {
                let [x, y] = vibration.mean_shift_m(Time::from_micros(100 * n), 0);
                let off_rad: f64 = with.frame.angle.minus(without.frame.angle).radians_since(Angle::ZERO);
                let of_one_rad = (sine * x - cosine * y) / RADIUS_M;
                let expected_rad = if marks == "camera.marks=1" { of_one_rad } else { 0.0 };
                assert!((off_rad - expected_rad).abs() < 1e-7, "{n}: {off_rad:e} {expected_rad:e}");
                if let (Some(with), Some(without)) = (with.marked, without.marked) {
                    let shift_m = [0, 1].map(|axis| with.shift_m[axis] - without.shift_m[axis]);
                    assert!((shift_m[0] - x).abs() < 1e-12 && (shift_m[1] - y).abs() < 1e-12, "{n}");
                }
            }
        }
    }

    /// A sine of its frequency and amplitude: the mean square over whole periods is half of that of the amplitude, and
    /// what is half a period later is the opposite.
    #[test]
    fn exact_it_is_a_sine_of_time() {
        let vibration =
            Vibration::of(&scene(&["camera.vibration_m=1e-6", "camera.vibration_hz=100"])).unwrap();
        let at = |micros| vibration.mean_shift_m(Time::from_micros(micros), 0);
        let square = |[x, y]: [f64; 2]| x * x + y * y;
        let mean = (0..1000).map(|n| square(at(20 * n)) / 1000.0).sum::<f64>();
        assert!((mean / (0.5 * AMPLITUDE_M * AMPLITUDE_M) - 1.0).abs() < 1e-9, "{mean:e}");
        let ([x, y], [later_x, later_y]) = (at(1234), at(6234));
        assert!((x + later_x).abs() < 1e-15 && (y + later_y).abs() < 1e-15 && x.abs() > 1e-9);
        assert!(Vibration::of(&scene(&[])).is_none());
    }

    /// The mean over an exposure is the mean of instants: by the midpoint rule of 1,000 to 1e-6. Over a whole period it
    /// is zero.
    #[test]
    fn exact_an_exposure_shows_the_mean() {
        let vibration =
            Vibration::of(&scene(&["camera.vibration_m=1e-6", "camera.vibration_hz=3e3"])).unwrap();
        let mean = vibration.mean_shift_m(Time::from_micros(500), 100_000);
        let instants = (0..1000).map(|n| vibration.mean_shift_m(Time::from_nanos(400_050 + 100 * n), 0)[0]);
        assert!((mean[0] - instants.sum::<f64>() / 1000.0).abs() < 1e-6 * AMPLITUDE_M);
        let period = vibration.mean_shift_m(Time::from_micros(500), 333_333);
        assert!(period.iter().all(|shift_m| shift_m.abs() < 1e-5 * AMPLITUDE_M));
    }
}
