//! What the filters' tests share: frames on the camera's clock, and measures of consistency.

use motor_model::{Angle, Real, Time};

use crate::camera::track::State;
use crate::camera::track_covariance::TrackCovariance as _;
use crate::measurement::{CameraFrame, LdvSample};

/// 10,000 frames a second.
pub(crate) const FRAME_NANOS: u64 = 100_000;

/// 200,000 samples a second.
pub(crate) const LDV_NANOS: u64 = 5_000;

/// Frame number `n`, which shows `radians`.
pub(crate) fn frame(n: u64, radians: f64) -> CameraFrame {
    let angle = Angle::from_degrees(radians.to_degrees()).wrapped();
    CameraFrame::new(Time::from_nanos(n * FRAME_NANOS), angle)
}

/// A sample of a rotor at rest by a live vibrometer: far below its noise, and neighbours are never equal.
pub(crate) fn quiet_sample(taken_at: Time) -> LdvSample {
    let odd = (taken_at.nanos() / LDV_NANOS) % 2 == 1;
    LdvSample { taken_at, velocity_m_s: if odd { 1e-9 } else { -1e-9 } }
}

/// Normalised error squared of angle and rate: mean 2 in a consistent filter.
pub(crate) fn nees<T: Real>(state: &State<T>, angle_rad: f64, rate_rad_s: f64) -> f64 {
    let x: f64 = state.angle.angle().radians_since(Angle::from_degrees(angle_rad.to_degrees()));
    let y = state.rate_rad_s.to_f64() - rate_rad_s;
    let p = &state.covariance;
    let [p11, p12, p22] = [p.angle_rad2(), p.angle_rate_rad2_s(), p.rate_rad2_s2()].map(Real::to_f64);
    (p22 * x * x - 2.0 * p12 * x * y + p11 * y * y) / (p11 * p22 - p12 * p12)
}

/// Mean NEES and NIS of 50 runs of 400 frames are those of a filter whose model is the truth. The NIS of a right filter
/// is white: 20,000 chi-square(1), mean 1, standard error 0.01. The NEES is correlated over some 20 frames: 50 x 20
/// independent chi-square(2), mean 2, standard error 0.063. Bounds at 3.3 standard errors, both sides.
#[track_caller]
pub(crate) fn assert_consistent(run: impl Fn(u64) -> (f64, f64)) {
    let runs: [(f64, f64); 50] = core::array::from_fn(|seed| run(seed as u64));
    let nees = runs.iter().map(|run| run.0).sum::<f64>() / 50.0;
    let nis = runs.iter().map(|run| run.1).sum::<f64>() / 50.0;
    assert!((nees - 2.0).abs() < 0.21, "{nees}");
    assert!((nis - 1.0).abs() < 0.033, "{nis}");
}
