//! What the instruments deliver.

use motor_model::{Angle, Time};

/// One camera frame, reduced to the angle of the tracked marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraFrame {
    /// The middle of the frame's exposure; it arrives later.
    pub exposed_at: Time,
    /// Angle within the turn; a camera does not show whole turns.
    pub angle: Angle,
    /// Marks that the angle is from; [`Self::ALL_MARKS`] where none of the camera's was left out. The variance of the
    /// angle follows from it: [`crate::CameraDescription::variance_factor`].
    pub marks_used: u8,
    /// How far the marks are from a rigid motion of the pattern: the root of the mean square of their residuals, in
    /// steps of [`Self::RESIDUAL_STEP_M`]. 0 where the camera does not tell, as with a single mark.
    pub residual: u8,
}

impl CameraFrame {
    /// Stands for all marks that the camera has.
    pub const ALL_MARKS: u8 = 0;

    /// Step of [`Self::residual`], in m: 0.1 um, a tenth of a good camera's noise. The largest is 25.5 um.
    pub const RESIDUAL_STEP_M: f64 = 1e-7;

    /// A frame of which no mark was left out, and whose residual is not told.
    pub const fn new(exposed_at: Time, angle: Angle) -> Self {
        Self { exposed_at, angle, marks_used: Self::ALL_MARKS, residual: 0 }
    }

    /// A residual in m as [`Self::residual`]: at least one step, since it is told.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 255")]
    pub fn residual_steps(residual_m: f64) -> u8 {
        (residual_m / Self::RESIDUAL_STEP_M + 0.5).clamp(1.0, 255.0) as u8
    }
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
