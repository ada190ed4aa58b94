//! Whether the line carries the frames of a camera.

use link::SHORT_FRAME_BYTES;
use link::camera_frame::{LONG_FRAME_BYTES, SHORT_AGE_NANOS};

use super::SerialError;
use super::line_rate::bytes_per_s;
use simulation::math::count::real;
use simulation::scene::Scene;

/// Share of the line that camera frames may take.
const FRAMES_SHARE_MAX: f64 = 0.7;

/// Refuses a camera whose frames the line does not carry. Those of a late camera are longer.
pub(super) fn check_frames(scene: &Scene, baud: u32) -> Result<(), SerialError> {
    let frame_rate_hz = scene.number("camera.frame_rate_hz");
    let is_late = latency_nanos(scene) > SHORT_AGE_NANOS;
    let most_hz = most_frames_hz(if is_late { LONG_FRAME_BYTES } else { SHORT_FRAME_BYTES }, baud);
    let needed_baud = f64::from(baud) * frame_rate_hz / most_hz;
    if frame_rate_hz > most_hz {
        return Err(SerialError::LineTooSlow { frame_rate_hz, needed_baud, most_hz, baud });
    }
    Ok(())
}

/// Time in ns from the middle of an exposure until its frame is there.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and at most 20 s")]
pub(super) fn latency_nanos(scene: &Scene) -> u64 {
    let frames_s = real(scene.integer("camera.latency_frames")) / scene.number("camera.frame_rate_hz");
    (1e9 * (frames_s + scene.number("camera.latency_s"))).ceil() as u64
}

/// The most frames in a second of so many bytes.
fn most_frames_hz(bytes: usize, baud: u32) -> f64 {
    FRAMES_SHARE_MAX * bytes_per_s(baud) / real(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10,000 frames a second fit a line of 2,000,000 baud while they are short. Those of a camera that is 12 ms late
    /// are long: 3,500 a second are the most.
    #[test]
    fn exact_a_late_camera_needs_a_faster_line() {
        let checked = |latency: &str, baud| {
            let sets = ["camera.frame_rate_hz=10000".to_owned(), format!("camera.latency_s={latency}")];
            check_frames(&Scene::of_sets(&sets).unwrap(), baud)
        };
        assert!(checked("0", 2_000_000).is_ok() && checked("0.01", 2_000_000).is_ok());
        let Err(SerialError::LineTooSlow { most_hz, .. }) = checked("0.012", 2_000_000) else {
            panic!("a late camera fits the line");
        };
        // 70 % of 200,000 bytes a second, of 40 bytes each.
        assert!((most_hz - 3500.0).abs() < 1e-6 && checked("0.012", 5_714_286).is_ok());
    }
}
