//! The steady motion of a driven mode: the part of its motion that does not decay.
//!
//! ```text
//! g'' + 2 zeta w_n g' + w_n^2 g = a sin(phase),   phase = w t
//! g = a (k sin(phase) - r cos(phase)) / (k^2 + r^2),   k = w_n^2 - w^2,   r = 2 zeta w_n w
//! ```

use core::f64::consts::TAU;

use crate::drive::DriveMode;
use crate::math::Real;
use crate::modes::{DriveTuning, Mode};
use crate::motor::MotorState;
use crate::phase::Phase;

/// The steady motion under the drive in force, through a span.
pub(super) struct SteadyDrive {
    pub(super) mode_index: usize,
    phase: Phase,
    /// Turns of the drive over the span.
    turns: f64,
    acceleration_m_s2: f64,
    drive_rad_s: f64,
    /// Steady displacement per unit of sine and cosine of the phase.
    in_phase_m: f64,
    quadrature_m: f64,
}

impl SteadyDrive {
    pub(super) fn of<T: Real>(
        modes: &[Mode; 3],
        tuning: DriveTuning,
        state: &MotorState<T>,
        step_s: f64,
        part: f64,
    ) -> Option<Self> {
        let command = state.forcing.command();
        let [_, b, c] = modes;
        let (mode_index, mode, fixed_hz) = match (command.mode()?, tuning) {
            (DriveMode::B, DriveTuning::Resonant) => (1, b, None),
            (DriveMode::C, DriveTuning::Resonant) => (2, c, None),
            (DriveMode::B, DriveTuning::Fixed { b_hz, .. }) => (1, b, Some(b_hz)),
            (DriveMode::C, DriveTuning::Fixed { c_hz, .. }) => (2, c, Some(c_hz)),
        };
        let w = fixed_hz.map_or(mode.natural_rad_s, |hz| TAU * hz)
            + TAU * f64::from(command.frequency_offset_hz());
        let acceleration_m_s2 = f64::from(command.amplitude()) * mode.drive_acceleration_m_s2();
        let stiffness = (mode.natural_rad_s - w) * (mode.natural_rad_s + w);
        let resistance = 2.0 * mode.damping_ratio * mode.natural_rad_s * w;
        let square = stiffness * stiffness + resistance * resistance;
        // Undamped and on resonance there is no steady motion, but then the drive, which is proportional to zeta, is
        // 0 too.
        let per_square = if acceleration_m_s2 == 0.0 { 0.0 } else { acceleration_m_s2 / square };
        Some(Self {
            mode_index,
            phase: state.phase,
            turns: part * turns(state.forcing.increment(), w * step_s / TAU),
            acceleration_m_s2,
            drive_rad_s: w,
            in_phase_m: per_square * stiffness,
            quadrature_m: -per_square * resistance,
        })
    }

    /// Sine and cosine of the drive's phase at a fraction `x` of the span.
    fn sin_cos(&self, x: f64) -> (f64, f64) {
        self.phase.advanced(Phase::from_turns(self.turns * x)).sin_cos()
    }

    /// Steady displacement and velocity at a fraction `x` of the span.
    pub(super) fn motion(&self, x: f64) -> (f64, f64) {
        let (sin, cos) = self.sin_cos(x);
        (
            self.in_phase_m * sin + self.quadrature_m * cos,
            self.drive_rad_s * (self.in_phase_m * cos - self.quadrature_m * sin),
        )
    }

    /// Acceleration by the drive at a fraction `x` of the span.
    pub(super) fn acceleration(&self, x: f64) -> f64 {
        self.acceleration_m_s2 * self.sin_cos(x).0
    }
}

/// Turns of a phase that gains `increment` modulo a turn: the candidate nearest to `nominal`.
#[expect(clippy::cast_precision_loss, reason = "2^-53 of a turn is below the quadrature's error")]
fn turns(increment: Phase, nominal: f64) -> f64 {
    const UNITS_PER_TURN: f64 = 18_446_744_073_709_551_616.0;
    let fraction = increment.units() as f64 / UNITS_PER_TURN;
    fraction + libm::round(nominal - fraction)
}
