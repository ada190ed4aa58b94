//! What positioning is doing, why it stops, and its tuning.

use estimator::{Health, Instruments};
use motor_model::{DriveMode, Time};

use crate::progress_window::{self, ProgressWindow};
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
    /// Variance of the angle in rad^2 above which a cruise ends, where the coast of the cruise is known better than
    /// that.
    pub cruise_variance_max_rad2: f32,
    /// Variance in rad^2 that averaging at rest does not remove: the camera's quantisation. It is a part of the
    /// variance of every estimate.
    pub floor_rad2: f32,
    /// Longest time in ns for which the angle is predicted: from the exposure of a frame until the next one arrives.
    pub frame_wait_nanos: u64,
    /// Length in ns of the windows in which a cruise is seen to turn the rotor.
    pub progress_window_nanos: u64,
    /// Length in ns of the windows in which a rotor is seen to lie still with the drive off, and to be measured better.
    pub settling_window_nanos: u64,
    /// Time in ns without a usable estimate after which a move is given up.
    pub blind_max_nanos: u64,
    /// Whether bursts and cruises correct the map.
    pub learning: bool,
}

impl Default for PositioningTuning {
    /// For the default instruments.
    fn default() -> Self {
        Self::new(&Instruments::default())
    }
}

impl PositioningTuning {
    /// Frames in a window at least: a line through so many has a slope as good as that through all, within a third.
    const WINDOW_FRAMES: u64 = 10;
    /// [`Self::frame_wait_nanos`] in s.
    #[expect(clippy::cast_precision_loss, reason = "a wait needs no more than single precision")]
    pub(crate) fn frame_wait_s(&self) -> f32 {
        1e-9 * self.frame_wait_nanos as f32
    }

    /// Least time without an estimate after which a move is given up, in ns. An assumption: a camera that is switched
    /// over is back by then.
    const BLIND_NANOS: u64 = 2_000_000_000;

    /// For `instruments`: a risk of 3.6 %, and a standard deviation of half a degree for cruises (an assumption).
    pub fn new(instruments: &Instruments) -> Self {
        let camera = &instruments.camera;
        let frame_wait_nanos = camera.period_nanos + camera.latency_nanos + camera.exposure_nanos / 2;
        let frames_nanos = Self::WINDOW_FRAMES * camera.period_nanos + camera.latency_nanos;
        #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
        let floor_rad2 = camera.floor_rad2() as f32;
        Self {
            limits: Limits::default(),
            confidence: Confidence::default(),
            cruise_variance_max_rad2: 7.6e-5,
            floor_rad2,
            frame_wait_nanos,
            progress_window_nanos: progress_window::WINDOW_NANOS.max(frames_nanos),
            settling_window_nanos: SETTLING_WINDOW_NANOS.max(frames_nanos),
            blind_max_nanos: Self::BLIND_NANOS + 2 * frames_nanos,
            learning: true,
        }
    }
}

/// Least length in ns of the windows of a settling rotor: four times what a rotor takes to stop from the highest rate
/// at the smallest friction of Table 1.
const SETTLING_WINDOW_NANOS: u64 = 100_000_000;

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
    /// Drive off, until the rotor is at rest and measured well enough, and what that waits for.
    Settling(Wait),
    /// This mode is on to stop a rotor that turns on in the direction of the other, with the drive off.
    Brake {
        /// The mode that is driven.
        mode: DriveMode,
        /// When it began.
        since: Time,
    },
    /// At the target: drive off, measuring on.
    Holding,
    /// Given up, and why. Drive off until there is another target.
    Stopped(StopReason),
}

/// What a rotor with the drive off waits for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wait {
    /// For rest: the estimate does not say yet that the rotor lies still.
    Rest,
    /// For rest: the camera shows that the rotor turns.
    Turning,
    /// For a better measurement of a rotor that lies still by the estimate.
    Measuring {
        /// Time to go in s, as far as it is known: from how much the last window has added.
        to_go_s: Option<f32>,
    },
    /// For a better measurement of a rotor that lies still by the camera's frames alone: the estimate never says so.
    MeasuringUnrested {
        /// As in [`Self::Measuring`].
        to_go_s: Option<f32>,
    },
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
    /// As many drives as are allowed have brought the rotor no nearer to the target.
    TooManyDrives,
    /// Mode B, clockwise, does not turn the rotor; mode C does.
    ModeBLost,
    /// Mode C, counter-clockwise, does not turn the rotor; mode B does.
    ModeCLost,
    /// The rotor turns on with the drive off, and the other mode does not stop it.
    KeepsTurning,
    /// Measuring on does not make the angle known well enough for the tolerance before the deadline.
    NotMeasurable,
    /// There was no usable estimate for too long: the health says why.
    NoEstimate,
}
