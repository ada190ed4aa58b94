//! What every filter does: the contract of the harness and the controller.
//!
//! A filter is told three things, each with its own time: the drive that is really applied, vibrometer samples and camera frames. It is asked two:
//! where the rotor is, and whether that may be believed. Nothing blocks, fails or allocates.

use motor_model::{Angle, DriveCommand, Real, Time};

use crate::innovation::Innovation;
use crate::measurement::{CameraFrame, LdvSample};

/// Angle and rate of the rotor from camera and vibrometer.
pub trait AngleFilter<T: Real> {
    /// The drive that is really applied from `at` on: not the command, where an amplifier is absent or limits it. To be told at every tick, changed or
    /// not: this is the clock by which the filter judges the times of measurements.
    fn drive(&mut self, at: Time, command: DriveCommand);

    /// Takes a vibrometer sample in; what became of it, where it was used as a measurement of the filter's states.
    ///
    /// A sample that is no finite number, faster than any rotor or no newer than the last one changes nothing.
    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<T>>;

    /// Takes a camera frame in: at its time of exposure, however late it arrives.
    ///
    /// One that was overtaken is fused in its place among the last [`crate::FRAMES_KEPT`]; what is older, comes twice or is from the future is refused.
    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T>;

    /// Angle and rate at `now`; `None` before the first frame. Asked for a time before the last frame used, it answers for that frame's.
    fn estimate(&self, now: Time) -> Option<Estimate<T>>;

    /// Angle and rate at an earlier instant, from the frames before and after it; `None` before the oldest of the [`crate::FRAMES_KEPT`] that are kept, and
    /// from a filter that cannot: [`crate::TwinFilter`]. After the last frame used it is the estimate.
    fn smoothed(&self, at: Time) -> Option<Estimate<T>> {
        let _ = at;
        None
    }

    /// Whether the estimate at `now` may be used.
    fn health(&self, now: Time) -> Health;

    /// Both at once, [`Self::estimate`] and [`Self::health`], for the price of one: what a loop asks at every tick.
    fn assess(&self, now: Time) -> (Option<Estimate<T>>, Health) {
        (self.estimate(now), self.health(now))
    }
}

/// Angle and rate at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    /// The instant.
    pub at: Time,
    /// Angle; whole turns are counted from the turn of the first frame.
    pub angle: Angle,
    /// Rate in rad/s.
    pub rate_rad_s: T,
    /// Variance of the angle in rad^2.
    pub angle_rad2: T,
    /// Covariance of angle and rate in rad^2/s.
    pub angle_rate_rad2_s: T,
    /// Variance of the rate in rad^2/s^2.
    pub rate_rad2_s2: T,
    /// Whether the rotor lies still.
    pub resting: bool,
}

/// Whether an estimate may be used. It recovers by itself when what was wrong has passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Health {
    /// All that the filter needs is there.
    Good,
    /// No frame has come yet: there is no estimate.
    Waiting,
    /// The estimate may be used, but is worse than it should be, or its variances are less to be trusted.
    Degraded(Reason),
    /// The estimate is not to be used.
    Unusable(Reason),
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reason {
    /// No vibrometer sample that could be used has come for a millisecond.
    VibrometerSilent,
    /// The vibrometer shows a rotor that is pulled down and never pushed up: its sign is wrong, and no impact is taken from it.
    VibrometerInverted,
    /// The vibrometer shows a rotor in flight that does not fall as gravity makes it, by a quarter or more: its scale is wrong.
    VibrometerScale,
    /// The vibrometer has shown a rotor that was pulled down, which nothing does: some of its samples are wrong, and for a while no impact is taken from it.
    VibrometerErratic,
    /// The impacts that the vibrometer shows are not those of the motor's twin: its range, its bias or the times are wrong, or the rotor hardly leaves the teeth.
    ImpactsUnexplained,
    /// No frame has come for two and a half of the usual intervals.
    CameraSilent,
    /// The camera delivers the same picture for ever: its frames are not used.
    CameraStuck,
    /// The frames scatter twice as much as is assumed, or more: the variances are too small, and where more frames are refused than used the estimate may follow the wrong ones.
    NoiseMismatch,
    /// The last frames were refused, one after the other.
    FramesRefused,
    /// The angle's standard deviation exceeds half a degree: the camera is silent, or has only just begun.
    Uncertain,
}
