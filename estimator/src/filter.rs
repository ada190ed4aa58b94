//! What every filter does: the interface that the controller and the simulation use.
//!
//! A filter receives three things, each with its own time: the drive that is really applied, vibrometer samples and
//! camera frames. It answers two questions: where is the rotor, and may that be used? No call blocks, fails or
//! allocates.

use motor_model::{Angle, DriveCommand, Real, Time};

use crate::{CameraFrame, ImpactInnovation, Innovation, LdvSample};

/// Angle and rate of the rotor from camera and vibrometer.
pub trait AngleFilter<T: Real> {
    /// Sets the drive that is really applied from `at` on: not the command, where an amplifier is absent or limits it.
    /// Call it at every tick, changed or not: it is the clock by which the filter judges the times of measurements.
    fn drive(&mut self, at: Time, command: DriveCommand);

    /// Tells where the resonances of modes B and C are found: the motor has warmed, say. A filter without a model of
    /// the stator needs nothing of it.
    fn retune(&mut self, _offsets: &[ResonanceOffset<T>; 2]) {}

    /// Takes in a vibrometer sample. The answer is the record of an impact that the sample shows, if the filter has a
    /// model that predicts impacts.
    ///
    /// A sample that is no finite number, faster than any rotor or no newer than the last one changes nothing.
    fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<T>>;

    /// Takes in a camera frame, at its time of exposure, however late it arrives.
    ///
    /// A frame that arrives after newer ones is fused in its place among the last [`crate::FRAMES_KEPT`]. One that is
    /// older, comes twice or is from the future is refused.
    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T>;

    /// Angle and rate at `now`; `None` before the first frame. For a time before the last frame used, those at that
    /// frame.
    fn estimate(&self, now: Time) -> Option<Estimate<T>>;

    /// Angle and rate at an earlier instant, from the frames before and after it. After the last frame used it is
    /// [`Self::estimate`]. `None` before the oldest of the [`crate::FRAMES_KEPT`] frames kept, and from a filter
    /// without a smoother, as on a microcontroller that asks for the present alone.
    fn smoothed(&self, _at: Time) -> Option<Estimate<T>> {
        None
    }

    /// Whether the estimate at `now` may be used.
    fn health(&self, now: Time) -> Health {
        self.assess(now).1
    }

    /// [`Self::estimate`] and [`Self::health`] for the price of one: for a loop that needs both at every tick.
    fn assess(&self, now: Time) -> (Option<Estimate<T>>, Health) {
        self.assess_for(now, now)
    }

    /// The same with the estimate for `instant`, at or after `now`: for a loop whose commands act later. Whether the
    /// instruments are silent is judged at `now`, and the variance at `instant`.
    fn assess_for(&self, now: Time, instant: Time) -> (Option<Estimate<T>>, Health);
}

/// How far a resonance lies from that of the motor for which filter and map were made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResonanceOffset<T> {
    /// Offset in Hz, positive above.
    pub hz: T,
    /// Its variance in Hz^2.
    pub hz2: T,
}

impl ResonanceOffset<f32> {
    /// A resonance that is the design's.
    pub const NONE: Self = Self { hz: 0.0, hz2: 0.0 };
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

/// Whether an estimate may be used. It recovers by itself when the cause has passed. Only a lost turn, and a lost
/// reference to which the frames do not jump back, need a filter that begins anew.
///
/// If several causes hold, the first of this list is reported:
///
/// ```text
/// Waiting
/// Unusable    CameraStuck, FramesRefused, ReferenceLost, Uncertain, NoiseMismatch (more frames refused than used)
/// Degraded    Uncertain by half a degree (a slow camera, on time), CameraSilent, NoiseMismatch, TurnUnknown,
///             VibrometerSilent, then the faults of the vibrometer, Uncertain by a thirtieth of a degree
/// Good
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Health {
    /// Both instruments work as the filter assumes.
    Good,
    /// No frame has arrived yet: there is no estimate.
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
    /// No usable vibrometer sample has arrived for a millisecond.
    VibrometerSilent,
    /// The vibrometer's noise hides the impacts: none is taken from it, and the camera alone is used.
    VibrometerUnfit,
    /// The vibrometer shows a rotor that is pulled down and never pushed up: its sign is wrong, and no impact is taken
    /// from it.
    VibrometerInverted,
    /// The vibrometer shows a rotor in flight that does not fall as gravity makes it, by a quarter or more: its scale
    /// is wrong.
    VibrometerScale,
    /// The vibrometer has shown a rotor pulled down, which no impact does: some samples are wrong, and for a while no
    /// impact is taken from it.
    VibrometerErratic,
    /// The filter's model does not explain the impacts that the vibrometer shows, or the frames contradict the kicks
    /// that it finds there: range, bias or times are wrong, the rotor tilts, or it hardly leaves the teeth. The filter
    /// goes on with the camera alone.
    ImpactsUnexplained,
    /// No frame has arrived for two and a half of the usual intervals.
    CameraSilent,
    /// The camera repeats one picture: its frames are not used.
    CameraStuck,
    /// The frames scatter twice as much as the camera variance says, or more: the variances of the estimate are too
    /// small. Where more frames are refused than used the estimate may follow the wrong ones.
    NoiseMismatch,
    /// The last frames were refused, one after the other.
    FramesRefused,
    /// The frames have jumped as no rotor does: the camera was pushed, or follows another feature. The rate may be
    /// right; what the angle counts from is not known.
    ReferenceLost,
    /// A driven rotor was not seen for so long that the angle is known but for whole turns.
    TurnUnknown,
    /// The standard deviation of the angle exceeds a thirtieth of a degree: three of them are 0.1 degrees. Beyond half
    /// a degree the estimate is unusable where the camera is silent or has just started, and degraded where it is slow.
    Uncertain,
}
