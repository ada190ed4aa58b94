//! What is said before a run of a camera whose clock is known less well than its frames are good.

use motor_model::math;

use crate::scene::Scene;
use crate::world::instruments::{Camera, assumed};

/// The rate in deg/s at which the clock of a move is judged, and that of a real board: some of a driven rotor.
pub const MOVE_DEG_S: f64 = 100.0;

/// The note; `None` where a rotor of `deg_s` turns by less in the error of the camera's clock than a frame is off by
/// noise.
pub fn clock_note(scene: &Scene, deg_s: f64) -> Option<String> {
    let error_s = Camera::clock_error_s(scene);
    let turned_mdeg = 1e3 * deg_s.abs() * error_s;
    let frame_mdeg = 1e3 * math::sqrt(Camera::variance_rad2(scene)).to_degrees();
    let told_us = assumed(scene).camera.clock_sd_micros;
    (turned_mdeg > frame_mdeg).then(|| {
        format!(
            "note: the camera's clock is known to {:.0} us, and the filters are told of {told_us} us: a rotor at {:.0} \
             deg/s turns by {turned_mdeg:.0} mdeg meanwhile, a frame is off by {frame_mdeg:.0}; hint: a shorter \
             camera.clock_round_trip_s",
            1e6 * error_s,
            deg_s.abs()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(sets: &[&str], deg_s: f64) -> Option<String> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        clock_note(&Scene::of_sets(&sets).unwrap(), deg_s)
    }

    /// 349 us at 300 deg/s are 105 mdeg; a frame of two marks is off by 12. At 30 deg/s it is more than the clock's 10.
    #[test]
    fn exact_a_clock_is_told_where_it_is_worse_than_a_frame() {
        let own = "camera.clock_drift_ppm=50";
        let expected = "note: the camera's clock is known to 349 us, and the filters are told of 349 us: a rotor at \
                        300 deg/s turns by 105 mdeg meanwhile, a frame is off by 12; hint: a shorter \
                        camera.clock_round_trip_s";
        assert_eq!(note(&[own], -300.0).unwrap(), expected);
        let not_told = note(&[own, "estimator.assumed.camera.clock_error_s=0"], 300.0).unwrap();
        assert!(not_told.contains("the filters are told of 0 us"), "{not_told}");
        assert_eq!((note(&[own], 30.0), note(&[], 900.0)), (None, None));
        assert_eq!(
            note(&[own, "camera.clock_round_trip_s=1e-5", "camera.clock_round_trip_spread_s=0"], 900.0),
            None
        );
    }
}
