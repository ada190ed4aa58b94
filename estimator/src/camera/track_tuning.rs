//! What the track assumes of the camera, and the counts of frames that follow from its rate: gate, rest, restart,
//! floor.
//!
//! Every count of frames stands for a time in s, so that a camera of another rate is judged over the same time.

use motor_model::{Real, math};

use crate::instruments::CameraDescription;
use crate::measurement::CameraFrame;

/// Resolution per noise beyond which a resting rotor shows one code or two.
pub(crate) const COARSE: f64 = 2.5;
/// Period of the default camera, in s.
const DEFAULT_PERIOD_S: f64 = 1e-4;
/// Time in which the variance of the rate of a rotor that is called at rest falls by the factor e, in s: friction stops
/// what the slope leaves, up to 0.6 rad/s, within 1 ms, and within some where a rotor that tilts still bounces.
const STOPPING_S: f64 = 0.5e-3;
/// Time in which the ringing under a resting rotor falls by the factor e, in s.
const RINGING_S: f64 = 4e-3;
/// Growth of the variance of the angle of a resting rotor, in rad^2/s, whatever the rate of the frames: 0.01
/// milli-degrees after a second. An assumption: friction holds a rotor once its stator has rung down, and the simulated
/// rotor then does not turn at all. The angle is never known better than to `sqrt(growth * R / frame rate)` in
/// variance.
pub const RESTING_GROWTH_RAD2_S: f64 = 3e-14;
/// Times in s: of refusals until the estimate restarts; over which normalised innovations, and innovations at rest, are
/// averaged where that is frames enough for a mean.
const REFUSALS_S: f64 = 2e-3;
const NIS_S: f64 = 6.4e-3;
const MEAN_S: f64 = 12.8e-3;
/// Time over which innovations are averaged for their correlation, in s.
const NEIGHBOURS_S: f64 = 3.2e-3;
/// Time over which residuals of the marks are averaged, in s.
const RESIDUAL_S: f64 = 25.6e-3;

/// Twice the standard error of the rate of a sliding rotor, `sqrt(sqrt 2 q^(3/4) (R dt)^(1/4))` at q = 3000, in rad/s;
/// at least 2.
fn resting_rate_rad_s(variance_rad2: f64, period_s: f64) -> f64 {
    const SLIDING_RAD2_S3: f64 = 3000.0;
    let product = SLIDING_RAD2_S3 * SLIDING_RAD2_S3 * SLIDING_RAD2_S3 * variance_rad2 * period_s;
    let variance = core::f64::consts::SQRT_2 * math::sqrt(math::sqrt(product));
    (2.0 * math::sqrt(variance)).max(2.0)
}

/// Refusals until the estimate restarts: as many frames as come in 2 ms, at least as many as have to agree and two.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 6 and 200")]
fn refusals_max(frames: f64) -> u8 {
    (frames + 0.5).clamp(6.0, 200.0) as u8
}

/// Equal codes in a row of which the probability is 1e-5 for a rotor that does not turn, in the middle of a cell, where
/// equal codes are likeliest; 20 to 1,000. With `p_k` the probability of code k, two in a row are equal with the
/// probability `sum p_k^2`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 20 and 1,000")]
fn stuck_frames(camera: &CameraDescription) -> u16 {
    let steps = camera.noise_m / camera.resolution_m;
    // The normal distribution by the logistic one, within 0.01.
    let below = |x: f64| 1.0 / (1.0 + math::exp(-1.702 * x / steps));
    let equal: f64 = (-3..=3)
        .map(|code| {
            let probability = below(f64::from(code) + 0.5) - below(f64::from(code) - 0.5);
            probability * probability
        })
        .sum();
    let frames = math::ln(1e-5) / math::ln(equal);
    // NaN, of a camera without steps or noise, is the least: its codes never repeat, or show every motion.
    if frames > 20.0 { frames.min(1000.0) as u16 } else { 20 }
}

/// The camera, the gate and rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackTuning<T> {
    /// Variance of a frame's angle in rad^2, quantisation included, with no mark left out. If it is not positive and
    /// finite the default is used; below that of an angle's own resolution it is raised to that.
    pub camera_rad2: T,
    /// The quantisation's part of it, in rad^2: step squared over 12.
    pub(crate) quantisation_rad2: T,
    /// Least variance of the zero-rate update in rad^2/s^2, one a frame, and largest one while the stator rings down
    /// under the resting rotor: `v_0` and `v_1` of [`crate::camera::track`].
    pub(crate) zero_rate_rad2_s2: T,
    pub(crate) ringing_rad2_s2: T,
    /// Frames in which the variance of the rate falls by the factor e from that of the last motion to `v_1`, and in
    /// which `v_1` does.
    pub(crate) stopping_frames: T,
    pub(crate) ringing_frames: T,
    /// Rate below which a quiet rotor may be at rest ([`crate::camera::rest_test`]), in rad/s: twice its standard
    /// error.
    pub(crate) resting_rate_rad_s: T,
    /// A frame is refused when its innovation squared exceeds this many times its variance.
    pub(crate) gate: T,
    /// Variance of the kick that may explain frames in a row beyond the gate, in rad^2/s^2: as a rule the impacts of a
    /// landing, which change the rate by more than ten rad/s, two standard deviations, in a fraction of a millisecond.
    pub(crate) kick_rad2_s2: T,
    /// After this many refusals in a row the estimate restarts, once the newest frames agree.
    pub(crate) refusals_max: u8,
    /// Equal codes in a row at which a camera counts as stuck, of a driven rotor, or as one without dither, at rest:
    /// one chance in 10^5.
    pub(crate) stuck_frames: u16,
    /// Frames over which the normalised innovations and, at rest, the innovations are averaged.
    pub(crate) nis_frames: T,
    pub(crate) mean_frames: T,
    /// Whether the resolution is so coarse, more than 2.5 times the noise, that a rotor at rest shows one code or two.
    pub(crate) coarse: bool,
    /// Square of a step of [`CameraFrame::residual`] as the variance of an angle from all marks, in rad^2.
    pub(crate) residual_step_rad2: T,
    /// One over the frames over which residuals are averaged, and over which innovations are for their correlation.
    pub(crate) per_residual_frames: T,
    pub(crate) per_neighbours: T,
    /// Variance of a white innovation per that of their mean.
    pub(crate) independent_neighbours: T,
    /// Variance of the angle by what frames have in common, per that by which the residuals exceed the noise.
    pub(crate) persistent_part: T,
    /// Variances of an angle by what neighbouring frames share, as described, in rad^2: by the errors of all marks,
    /// which frames of a moving rotor have beside [`Self::camera_rad2`]; by all that they share, from all marks; and
    /// from one.
    pub(crate) mark_bias_rad2: T,
    pub(crate) persistent_rad2: T,
    pub(crate) single_mark_rad2: T,
    /// What averaging at rest cannot remove of the quantisation, in rad^2, as learnt and as described
    /// ([`CameraDescription::quantisation_floor_rad2`]). It is a part of every estimate's variance.
    pub(crate) floor_rad2: T,
    pub(crate) described_floor_rad2: T,
    /// Least mean square of second differences of a resting rotor's codes, per that of independent errors.
    pub(crate) least_dither: T,
    /// The camera that this was made for.
    pub(crate) camera: CameraDescription,
}

impl<T: Real> Default for TrackTuning<T> {
    /// For the default camera.
    fn default() -> Self {
        Self::new(&CameraDescription::default())
    }
}

impl<T: Real> TrackTuning<T> {
    /// For `camera`.
    // Never inlined: every filter is built with it, and double precision is large on a microcontroller.
    #[inline(never)]
    pub fn new(camera: &CameraDescription) -> Self {
        let (period_s, variance_rad2) = (camera.period_s(), camera.variance_rad2());
        // One frame a period tells as much in a second at any rate: each of a fast camera's tells less.
        let frames_in = |seconds: f64| seconds / period_s;
        let neighbours = frames_in(NEIGHBOURS_S).clamp(4.0, 160.0);
        let shared = DEFAULT_PERIOD_S / period_s;
        Self {
            camera_rad2: T::from_f64(variance_rad2),
            quantisation_rad2: T::from_f64(camera.quantisation_rad2()),
            zero_rate_rad2_s2: T::from_f64(RESTING_GROWTH_RAD2_S / period_s),
            ringing_rad2_s2: T::from_f64(5e-6 * shared),
            stopping_frames: T::from_f64(frames_in(STOPPING_S)),
            ringing_frames: T::from_f64(frames_in(RINGING_S).max(1.0)),
            resting_rate_rad_s: T::from_f64(resting_rate_rad_s(variance_rad2, period_s)),
            gate: T::from_f64(36.0),
            kick_rad2_s2: T::from_f64(30.0),
            refusals_max: refusals_max(frames_in(REFUSALS_S)),
            stuck_frames: stuck_frames(camera),
            nis_frames: T::from_f64(frames_in(NIS_S).clamp(16.0, 64.0)),
            mean_frames: T::from_f64(frames_in(MEAN_S).clamp(16.0, 1280.0)),
            coarse: camera.resolution_m > COARSE * camera.noise_m,
            residual_step_rad2: T::from_f64(camera.residual_rad2(CameraFrame::RESIDUAL_STEP_M)),
            per_residual_frames: T::from_f64(1.0 / frames_in(RESIDUAL_S).clamp(64.0, 1280.0)),
            per_neighbours: T::from_f64(1.0 / neighbours),
            independent_neighbours: T::from_f64(2.0 * neighbours - 1.0),
            persistent_part: T::from_f64(if camera.marks > 2 { 1.0 } else { 1.0 / 3.0 }),
            mark_bias_rad2: T::from_f64(camera.mark_bias_rad2()),
            persistent_rad2: T::from_f64(camera.persistent_rad2()),
            single_mark_rad2: T::from_f64(camera.single_mark_rad2()),
            floor_rad2: T::from_f64(camera.quantisation_floor_rad2()),
            described_floor_rad2: T::from_f64(camera.quantisation_floor_rad2()),
            least_dither: T::from_f64(camera.dither_rad2() / variance_rad2),
            camera: *camera,
        }
    }

    /// Variance of the angle of `frame` in rad^2 by what differs from frame to frame: larger if marks were left out,
    /// and if the rotor is not `quiet`, so that marks cross pixels; and by what a rotor of the rate `rate_rad_s` turns
    /// in the error of the frame's stamp (F21).
    #[inline]
    pub(crate) fn frame_rad2(&self, frame: &CameraFrame, rate_rad_s: T, quiet: bool) -> T {
        let rad2 = if quiet { self.camera_rad2 } else { self.camera_rad2 + self.mark_bias_rad2 };
        let turned_rad = rate_rad_s * T::from_f32(self.camera.stamp_sd_s);
        let all_rad2 = if self.has_all_marks(frame) { rad2 } else { rad2 * self.factor_of(frame) };
        all_rad2 + turned_rad * turned_rad
    }

    /// Variance of the angle by what `frame` and its neighbours share, as described, in rad^2.
    #[inline]
    pub(crate) fn shared_rad2(&self, frame: &CameraFrame) -> T {
        if self.has_all_marks(frame) { self.persistent_rad2 } else { self.shared_of_some_rad2(frame) }
    }

    #[cold]
    #[inline(never)]
    fn shared_of_some_rad2(&self, frame: &CameraFrame) -> T {
        if frame.marks_used == 1 {
            self.single_mark_rad2
        } else {
            self.mark_bias_rad2 * self.factor_of(frame)
        }
    }

    /// Root mean square error of the clock by which frames are stamped, in s.
    #[inline]
    pub(crate) fn clock_sd_s(&self) -> T {
        T::from_i32(self.camera.clock_sd_micros.into()) * T::from_f64(1e-6)
    }

    /// Whether no mark was left out.
    #[inline]
    pub(crate) fn has_all_marks(&self, frame: &CameraFrame) -> bool {
        frame.marks_used == CameraFrame::ALL_MARKS || frame.marks_used >= self.camera.marks
    }

    #[cold]
    #[inline(never)]
    fn factor_of(&self, frame: &CameraFrame) -> T {
        self.camera.variance_factor(frame.marks_used)
    }

    /// Variance of an angle rounded to units of 2^-32 turn, in rad^2: no frame can be better.
    const FLOOR_RAD2: f64 = 1.8e-19;

    /// The same with a usable camera variance.
    #[must_use]
    pub(crate) fn validated(mut self) -> Self {
        let (given, floor) = (self.camera_rad2, T::from_f64(Self::FLOOR_RAD2));
        let usable = given > T::zero() && given <= T::MAX;
        let used = if usable { given } else { Self::default().camera_rad2 };
        self.camera_rad2 = if used < floor { floor } else { used };
        self
    }
}
