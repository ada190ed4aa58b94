//! What positioning is doing, why it stops, and its tuning.

use estimator::Health;
use motor_model::Time;

use crate::progress_window::ProgressWindow;
use crate::response_map::{Burst, Cruise, Family};
use crate::situation::Confidence;
use crate::target::Limits;

/// Tuning of the state machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositioningTuning {
    /// Limits of the move.
    pub limits: Limits,
    /// The risk that is accepted when the target counts as reached.
    pub confidence: Confidence,
    /// Variance of the angle in rad^2 above which a cruise ends.
    pub cruise_variance_max_rad2: f32,
    /// Variance in rad^2 that averaging at rest does not remove: the camera's quantisation.
    pub floor_rad2: f32,
    /// Whether bursts and cruises correct the map.
    pub learning: bool,
}

impl Default for PositioningTuning {
    /// A risk of 3.6 %, a standard deviation of half a degree for cruises (an assumption), and 0.05 milli-degrees of
    /// quantisation (of the default camera with dither).
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            confidence: Confidence::default(),
            cruise_variance_max_rad2: 7.6e-5,
            floor_rad2: 7.6e-13,
            learning: true,
        }
    }
}

/// What positioning is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PositioningPhase {
    /// No usable estimate, with the health that says why. Drive off.
    Waiting(Health),
    /// Drive on until the coast remains.
    Cruise {
        /// The drive in use.
        cruise: Cruise,
        /// When it began.
        since: Time,
        /// The window under way.
        progress: ProgressWindow,
    },
    /// Drive on for the burst's ticks.
    Burst {
        /// Its family.
        family: Family,
        /// The burst.
        burst: Burst,
        /// When it began.
        since: Time,
    },
    /// Drive off, until the rotor is at rest and measured well enough.
    Settling,
    /// At the target: drive off, measuring on.
    Holding,
    /// Given up, and why. Drive off until there is another target.
    Stopped(StopReason),
}

/// Why a move was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopReason {
    /// The caller cancelled it.
    Cancelled,
    /// The deadline passed.
    TimedOut,
    /// Neither mode turns the rotor: it is stuck, or the drive has no effect.
    Stalled,
    /// The rotor turns against the direction of the mode that drives it.
    ModeInverted,
    /// The target, or the rotor, is outside the travel allowed.
    OutOfTravel,
    /// The target was not reached by as many drives as are allowed.
    TooManyDrives,
    /// Mode B, clockwise, does not turn the rotor; mode C does.
    ModeBLost,
    /// Mode C, counter-clockwise, does not turn the rotor; mode B does.
    ModeCLost,
}
