//! The instruments as the filters assume them.
//!
//! Each is what the instrument is, unless a key of `estimator.assumed` says otherwise: as on a bench, instruments may
//! differ from their description. The vibrometer's bias is the exception: a bench does not know it, so its bound is
//! always an assumption.

use estimator::{CameraDescription, Instruments, VibrometerDescription};

use motor_model::{OutOfBounds, math};

use super::camera::ClockSettings;
use super::ldv::resolution_m_s;
use crate::scene::{RotorModel, Scene, SceneError};
use crate::world::event_clock::EventRate;

/// Radial clearance of the hub, as the filters assume: that of the design, where the rotor has a hub.
const CLEARANCE: &str = "estimator.assumed.hub.clearance_m";

/// Error of the clock that stamps frames, as the filters assume.
const CLOCK_ERROR: &str = "estimator.assumed.camera.clock_error_s";

/// Largest clearance of a hub per its design's: 30 % more, the tolerance of `motor.hub.clearance_m`.
const CLEARANCE_TOLERANCE: f64 = 1.3;

/// The instruments of `scene` as the filters assume them.
pub fn assumed(scene: &Scene) -> Instruments {
    let installed = scene.choice("estimator.assumed.ldv.installed") == "yes";
    Instruments { camera: camera(scene), vibrometer: installed.then(|| vibrometer(scene)) }
}

/// The same, if all of it is within bounds.
///
/// # Errors
/// When something is not: named by its key, or with the keys from which it follows.
pub fn checked(scene: &Scene) -> Result<Instruments, SceneError> {
    let refusal = |refused: OutOfBounds| {
        let is_shift = refused.key == "camera.shift_m";
        let key = if is_shift { "the shift of all marks" } else { refused.key };
        let refused = SceneError::from(OutOfBounds { key, ..refused });
        let is_cause = |set: &str| {
            let of = set.strip_prefix("estimator.assumed.").unwrap_or(set);
            is_shift && ["hub.clearance_m", "motor.hub.clearance_m", "camera.vibration_m"].contains(&of)
        };
        refused.following(scene, "the filters assume this", is_cause)
    };
    assumed(scene).checked().map_err(refusal)
}

fn camera(scene: &Scene) -> CameraDescription {
    let rate = EventRate::from_hz(scene.number("estimator.assumed.camera.frame_rate_hz"));
    let exposure_nanos = rate.part_nanos(scene.number("estimator.assumed.camera.exposure_frames"));
    CameraDescription {
        period_nanos: rate.span_nanos(1),
        exposure_nanos,
        latency_nanos: exposure_nanos / 2 + latency_nanos(scene, rate),
        noise_m: scene.number("estimator.assumed.camera.noise_m"),
        resolution_m: scene.number("estimator.assumed.camera.resolution_m"),
        radius_m: scene.number("estimator.assumed.camera.tracking_radius_m"),
        marks: u8::try_from(scene.integer("estimator.assumed.camera.marks")).unwrap_or(1),
        mark_bias_m: math::sqrt(0.5) * scene.number("estimator.assumed.camera.subpixel_bias_m"),
        shift_m: shift_m(scene),
        stamp_sd_s: stamp_sd_s(scene),
        clock_sd_micros: clock_sd_micros(scene),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a standard deviation needs no more digits")]
fn stamp_sd_s(scene: &Scene) -> f32 {
    scene.number("estimator.assumed.camera.stamp_jitter_s") as f32
}

/// Root mean square error in us of the clock by which frames are stamped: what a key says, or what follows from the
/// exchanges of a camera that has a clock of its own.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 to 10,000")]
fn clock_sd_micros(scene: &Scene) -> u16 {
    let (told_s, follows_s) = (scene.number(CLOCK_ERROR), ClockSettings::of(scene).error_s());
    let is_told = scene.keys_set().any(|key| key == CLOCK_ERROR);
    (1e6 * if is_told { told_s } else { follows_s }).round() as u16
}

/// Root mean square shift of all marks in m, by the microscope's vibration of the amplitude V and the rotor's play of
/// the radial clearance c in its hub: `sqrt((V^2 + c^2) / 2)`.
///
/// The vibration is along a line. The rotor leans on the pin on any side, off by c, of which each direction has `c^2 /
/// 2`: the most that a shift within the clearance can have in the mean over all directions.
fn shift_m(scene: &Scene) -> f64 {
    let (play_m, vibration_m) = (play_m(scene), vibration_m(scene));
    math::sqrt(0.5 * (vibration_m * vibration_m + play_m * play_m))
}

/// Largest shift of all marks in m that vibration and play make: `V + c`, with what a hub's clearance may exceed its
/// design by.
pub(super) fn shift_max_m(scene: &Scene) -> f64 {
    CLEARANCE_TOLERANCE * play_m(scene) + vibration_m(scene)
}

fn play_m(scene: &Scene) -> f64 {
    let clearance_m = scene.number(CLEARANCE);
    let has_hub = RotorModel::of(scene).is_ok_and(RotorModel::has_hub);
    let has_play = has_hub || scene.keys_set().any(|key| key == CLEARANCE);
    if has_play { clearance_m } else { 0.0 }
}

fn vibration_m(scene: &Scene) -> f64 {
    scene.number("estimator.assumed.camera.vibration_m")
}

/// Time from the end of an exposure to the arrival of its frame.
fn latency_nanos(scene: &Scene, rate: EventRate) -> u64 {
    rate.span_nanos(scene.integer("estimator.assumed.camera.latency_frames"))
        + scene.nanos("estimator.assumed.camera.latency_s")
}

fn vibrometer(scene: &Scene) -> VibrometerDescription {
    let range_m_s = scene.number("estimator.assumed.ldv.range_m_s");
    let rate = EventRate::from_hz(scene.number("estimator.assumed.ldv.sample_rate_hz"));
    VibrometerDescription {
        period_nanos: rate.span_nanos(1),
        noise_m_s: scene.number("estimator.assumed.ldv.noise_m_s"),
        bias_max_m_s: scene.number("estimator.assumed.ldv.bias_max_m_s"),
        range_m_s,
        resolution_m_s: resolution_m_s(range_m_s, scene.integer("estimator.assumed.ldv.bits")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(sets: &[&str]) -> Instruments {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        assumed(&Scene::of_sets(&sets).unwrap())
    }

    #[test]
    fn dual_the_default_scene_has_the_default_instruments() {
        assert_eq!(of(&[]), Instruments::default());
    }

    /// A shift is no key: it is refused with the keys that make it.
    #[test]
    fn exact_a_shift_out_of_bounds_names_the_keys_that_make_it() {
        for (sets, shift, cause) in [
            (
                &["estimator.assumed.hub.clearance_m=0.002"][..],
                "0.00141421356237",
                "estimator.assumed.hub.clearance_m = 0.002",
            ),
            (
                &["plant.rotor=tilting", "motor.hub.clearance_m=1"],
                "0.70710678118",
                "motor.hub.clearance_m = 1.0",
            ),
        ] {
            let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
            let refused = checked(&Scene::of_sets(&sets).unwrap()).unwrap_err().one_line();
            assert!(refused.starts_with(&format!("error: the shift of all marks = {shift}")), "{refused}");
            let hint = format!("; hint: the filters assume this; it or its bounds follow from {cause}");
            assert!(refused.ends_with(&hint), "{refused}");
        }
    }

    /// 60 Hz, exposed for half a period, two frames and 5 ms late; 12 bits over +-20 mm/s.
    #[test]
    fn exact_a_scene_s_instruments_are_assumed_as_they_are() {
        let camera = [
            "frame_rate_hz=60",
            "exposure_frames=0.5",
            "latency_frames=2",
            "latency_s=5e-3",
            "stamp_jitter_s=1e-4",
        ];
        let sets = camera.map(|set| format!("camera.{set}"));
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let camera = of(&sets).camera;
        assert_eq!(camera.period_nanos, 16_666_667);
        assert_eq!(camera.exposure_nanos, 8_333_334);
        assert!((camera.stamp_sd_s - 1e-4).abs() < 1e-10);
        assert_eq!(camera.latency_nanos, 33_333_333 + 5_000_000 + 4_166_667);
        let vibrometer = of(&["ldv.range_m_s=0.02", "ldv.bits=12", "ldv.sample_rate_hz=3e4"]).vibrometer;
        let vibrometer = vibrometer.unwrap();
        assert_eq!(vibrometer.period_nanos, 33_333);
        assert!((vibrometer.resolution_m_s / (0.04 / 4096.0) - 1.0).abs() < 1e-12);
        assert_eq!(of(&["ldv.installed=no"]).vibrometer, None);
    }

    /// Amplitudes of sines over `sqrt 2`. A rotor that shifts adds the design's clearance, 20 um, not the true motor's,
    /// and one that only tilts nothing.
    #[test]
    fn exact_errors_that_frames_share_are_assumed_as_they_are() {
        let shared = |sets: &[&str]| {
            let CameraDescription { mark_bias_m, shift_m, .. } = of(sets).camera;
            [mark_bias_m, shift_m].map(|length_m| length_m * math::sqrt(2.0))
        };
        let both = ["camera.subpixel_bias_m=5e-7", "camera.vibration_m=3e-6"];
        let [bias, vibration] =
            ["subpixel_bias_m", "vibration_m"].map(|key| format!("estimator.assumed.camera.{key}=0"));
        let tilting = ["plant.rotor=tilting", "plant.motor.hub.clearance_m=7e-6"];
        let tight = [tilting[0], "motor.hub.clearance_m=4e-6"];
        for (sets, expected) in [
            (&[][..], [0.0, 0.0]),
            (&both, [5e-7, 3e-6]),
            (&[both[0], both[1], &bias, &vibration], [0.0, 0.0]),
            (&tilting, [0.0, 20e-6]),
            (&tight, [0.0, 4e-6]),
            (&[&tight[..], &both].concat(), [5e-7, 5e-6]),
            (&[tilting[0], "estimator.assumed.hub.clearance_m=0"], [0.0, 0.0]),
            (&["plant.rotor=tilting_without_shift"], [0.0, 0.0]),
            (&["estimator.assumed.hub.clearance_m=7e-6"], [0.0, 7e-6]),
        ] {
            let off_m =
                shared(sets).into_iter().zip(expected).map(|(told, expected)| (told - expected).abs());
            assert!(off_m.fold(0.0, f64::max) < 1e-15, "{sets:?}: {:?}", shared(sets));
        }
    }

    /// A round trip of 1 ms, 0.2 ms of spread and a tick of 10 us: half of them over `sqrt 3`, 349.3 us. Nothing of a
    /// camera whose frames are stamped by the board's clock.
    #[test]
    fn exact_the_error_of_a_camera_s_own_clock_is_assumed() {
        let told = "estimator.assumed.camera.clock_error_s=1e-4";
        for (sets, micros) in [
            (&["camera.clock_round_trip_s=1e-2"][..], 0),
            (&["camera.clock_offset_s=0.1"], 349),
            (&["camera.clock_drift_ppm=-50"], 349),
            (&["camera.clock_offset_s=0.1", "camera.clock_round_trip_s=1e-2"], 2_947),
            (&["camera.clock_offset_s=0.1", told], 100),
            (&[told], 100),
            (&["camera.clock_offset_s=0.1", "estimator.assumed.camera.clock_error_s=0"], 0),
        ] {
            assert_eq!(of(sets).camera.clock_sd_micros, micros, "{sets:?}");
        }
    }

    /// Each assumption is set by its own key, and the instrument does not matter then.
    #[test]
    fn exact_assumptions_may_differ_from_the_instruments() {
        let sets = [
            "camera.noise_m=5e-6",
            "estimator.assumed.camera.noise_m=2e-6",
            "camera.tracking_radius_m=1e-3",
            "camera.stamp_jitter_s=1e-4",
            "estimator.assumed.camera.stamp_jitter_s=2e-5",
            "estimator.assumed.ldv.noise_m_s=1e-3",
            "estimator.assumed.ldv.bias_max_m_s=0.05",
        ];
        let Instruments { camera, vibrometer } = of(&sets);
        assert!((camera.noise_m - 2e-6).abs() < 1e-18 && (camera.radius_m - 1e-3).abs() < 1e-12);
        assert!((camera.stamp_sd_s - 2e-5).abs() < 1e-11);
        let vibrometer = vibrometer.unwrap();
        assert!(
            (vibrometer.noise_m_s - 1e-3).abs() < 1e-12 && (vibrometer.bias_max_m_s - 0.05).abs() < 1e-12
        );
        assert_eq!(of(&["estimator.assumed.ldv.installed=no"]).vibrometer, None);
        assert!(of(&["ldv.installed=no", "estimator.assumed.ldv.installed=yes"]).vibrometer.is_some());
    }
}
