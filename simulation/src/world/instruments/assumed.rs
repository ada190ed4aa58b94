//! The instruments as the filters assume them.
//!
//! Each is what the instrument is, unless a key of `estimator.assumed` says otherwise: as on a bench, instruments may
//! differ from their description. The vibrometer's bias is the exception: a bench does not know it, so its bound is
//! always an assumption.

use estimator::{CameraDescription, Instruments, VibrometerDescription};

use super::ldv::resolution_m_s;
use crate::scene::Scene;
use crate::world::event_clock::EventRate;

/// The instruments of `scene` as the filters assume them.
pub fn assumed(scene: &Scene) -> Instruments {
    let installed = scene.choice("estimator.assumed.ldv.installed") == "yes";
    Instruments { camera: camera(scene), vibrometer: installed.then(|| vibrometer(scene)) }
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
    }
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

    /// 60 Hz, exposed for half a period, two frames and 5 ms late; 12 bits over +-20 mm/s.
    #[test]
    fn exact_a_scene_s_instruments_are_assumed_as_they_are() {
        let camera = ["frame_rate_hz=60", "exposure_frames=0.5", "latency_frames=2", "latency_s=5e-3"];
        let sets = camera.map(|set| format!("camera.{set}"));
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let camera = of(&sets).camera;
        assert_eq!(camera.period_nanos, 16_666_667);
        assert_eq!(camera.exposure_nanos, 8_333_334);
        assert_eq!(camera.latency_nanos, 33_333_333 + 5_000_000 + 4_166_667);
        let vibrometer = of(&["ldv.range_m_s=0.02", "ldv.bits=12", "ldv.sample_rate_hz=3e4"]).vibrometer;
        let vibrometer = vibrometer.unwrap();
        assert_eq!(vibrometer.period_nanos, 33_333);
        assert!((vibrometer.resolution_m_s / (0.04 / 4096.0) - 1.0).abs() < 1e-12);
        assert_eq!(of(&["ldv.installed=no"]).vibrometer, None);
    }

    /// Each assumption is set by its own key, and the instrument does not matter then.
    #[test]
    fn exact_assumptions_may_differ_from_the_instruments() {
        let sets = [
            "camera.noise_m=5e-6",
            "estimator.assumed.camera.noise_m=2e-6",
            "camera.tracking_radius_m=1e-3",
            "estimator.assumed.ldv.noise_m_s=1e-3",
            "estimator.assumed.ldv.bias_max_m_s=0.05",
        ];
        let Instruments { camera, vibrometer } = of(&sets);
        assert!((camera.noise_m - 2e-6).abs() < 1e-18 && (camera.radius_m - 1e-3).abs() < 1e-12);
        let vibrometer = vibrometer.unwrap();
        assert!(
            (vibrometer.noise_m_s - 1e-3).abs() < 1e-12 && (vibrometer.bias_max_m_s - 0.05).abs() < 1e-12
        );
        assert_eq!(of(&["estimator.assumed.ldv.installed=no"]).vibrometer, None);
        assert!(of(&["ldv.installed=no", "estimator.assumed.ldv.installed=yes"]).vibrometer.is_some());
    }
}
