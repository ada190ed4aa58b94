//! What the instruments deliver.

use motor_model::{Angle, Time};

/// One camera frame, reduced to the angle of the tracked feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraFrame {
    /// The middle of the frame's exposure; it arrives later.
    pub exposed_at: Time,
    /// Angle within the turn; a camera does not show whole turns.
    pub angle: Angle,
}

/// One sample of the laser-Doppler vibrometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LdvSample {
    /// When the sample was taken.
    pub taken_at: Time,
    /// The rotor's vertical velocity, upwards positive.
    pub velocity_m_s: f32,
}

/// Largest difference between the filter's clock and the time of a measurement, in ns.
pub(crate) const CLOCK_TOLERANCE_NANOS: u32 = 1_000_000;
