//! How many kicks a filter keeps: those since the exposure of a frame, until the next one arrives.
//!
//! ```text
//! needed = n (T + L)     n: impacts in a ms; T, L: period and latency of the frames
//! ```
//!
//! | n | motion |
//! |---|---|
//! | 28 | mode B held at a fifth of its amplitude |
//! | 10 | a rate that is held: 4.3 at most in any 0.1 s, and twice as many where a frame is lost |
//!
//! A frame whose exposure is before the oldest kick kept cannot be fused. A camera that never needs more than 128 gets
//! these. Another one gets all that there is room for. Room is a matter of the program: a kick of the twin takes 40
//! bytes of a microcontroller, one of [`crate::ImpactAided`] 24.

use crate::instruments::CameraDescription;

/// Most kicks kept. A program without the feature `slow_cameras` has room for 128.
pub const IMPACTS_KEPT_MAX: usize = if cfg!(feature = "slow_cameras") { 768 } else { FEW };

/// Kicks that are kept with every camera.
const FEW: usize = 128;

/// Longest time from one frame's exposure to the arrival of the next one with which all kicks are kept while a rate is
/// held, in ns.
pub(crate) const KEPT_NANOS: u64 = nanos_of(IMPACTS_KEPT_MAX, 10);

/// Time of so many impacts, in ns.
const fn nanos_of(impacts: usize, per_ms: u64) -> u64 {
    impacts as u64 * 1_000_000 / per_ms
}

/// Whether all kicks that there is room for are kept with this camera, and not 128.
pub(crate) fn is_slow(camera: &CameraDescription) -> bool {
    camera.arrival_nanos() > nanos_of(FEW, 28)
}

/// How many are kept with a slow camera, or another one.
pub(crate) const fn kicks_kept(slow_camera: bool) -> usize {
    if slow_camera { IMPACTS_KEPT_MAX } else { FEW }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4.57 ms of 28 impacts each: 300 frames a second come every 3.3 ms, so 1 ms of latency is within it and 1.5 ms
    /// are not.
    #[test]
    fn exact_a_camera_gets_the_kicks_that_it_needs() {
        let slow = |period_nanos, latency_nanos| {
            is_slow(&CameraDescription { period_nanos, latency_nanos, ..CameraDescription::default() })
        };
        assert!(!is_slow(&CameraDescription::default()));
        assert_eq!([1_000_000, 1_500_000].map(|latency_nanos| slow(3_333_333, latency_nanos)), [false, true]);
        assert_eq!([false, true].map(kicks_kept), [FEW, IMPACTS_KEPT_MAX]);
    }
}
