//! The two states, angle and rate, and what a frame does to them in every filter.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | angle | 2^-32 turn, errors in rad | rotation of the rotor, whole turns counted | first frame, its variance R |
//! | 1 | rate | rad/s | angular rate | 0, standard deviation 20 rad/s |
//!
//! ```text
//! camera = angle + noise of variance R = sigma^2 + Delta^2 / 12   sigma: tracking noise, Delta: quantisation step
//! ```
//!
//! A filter brings its own [`Process`](crate::camera::process::Process): how angle, rate and covariance change between
//! frames. Which frames are used, and in which order, is decided in [`crate::camera::tracker`].
//!
//! A frame shows the mean angle over its exposure T, and is fused at the middle. A rate that is a random walk of
//! intensity q makes both differ by the variance `q T^3 / 320`, a ten-thousandth of R at most. Nothing is added for it.
//!
//! # Rest and quantisation
//!
//! A rotor at rest shows the camera one point of one cell. An average of frames is right only as far as the tracking
//! noise dithers the quantisation. Equal codes in a row of which the chance is 1e-5 where there is dither
//! ([`TrackTuning::stuck_frames`]) show that there is none. At rest such a code is refused
//! ([`crate::Rejection::Repeated`]), and the variance of every estimate holds that of the quantisation. A coarse
//! camera shows a rotor at rest one code or two, whatever its noise.
//!
//! # Ringing at rest
//!
//! A rotor may still slide when it is called at rest: the slope that called it has a standard deviation of `u`
//! ([`crate::camera::rest_test`]). Friction stops it within a millisecond, or some where it tilts and bounces. Then the
//! stator still rings, and the teeth on which the rotor lies move it a little: 0.3 to 0.6 mrad/s rms. This motion
//! decays with the modes over 30 ms, beating. So the zero-rate update has the variance
//!
//! ```text
//! while P22 > v_1   variance = max(v_1, min(u^2, m P22))       u = 0.15 rad/s, v_1 = 5e-6 rad^2/s^2, m = 5 frames
//! then              variance = max(v_0, min(v_1, n P22))       v_0 = 3e-10 rad^2/s^2, n = 40 frames
//! ```
//!
//! Where the vibrometer shows a flight the variance stays `u^2`: a rotor that tilts goes on rocking on the teeth,
//! by some 0.05 rad/s and half a milli-degree, which the slope over many frames does not show.
//!
//! With it P22 falls below `u^2` at once and by the factor e every m frames to `v_1`, becomes `v_1 / k` after k frames
//! more, then falls by the factor e every n frames, to what the process noise of rest leaves. `v_0` and `v_1` are those
//! of the default camera. Another one's are as many times larger as its frames are more, so that the angle's variance
//! grows by `v_0 dt = 3e-14 rad^2` in a second at rest, whatever the rate of the frames
//! ([`crate::RESTING_GROWTH_RAD2_S`]).
//!
//! # Moved at rest
//!
//! A rotor that is moved by less than the gate, without an impact that the vibrometer detects, would be estimated where
//! it was for as long as it had been measured there. So at rest the mean of the innovations is followed. When it is off
//! by six of its standard deviations the estimate restarts.

use motor_model::{Angle, AngleAccumulator, Real, Time};

use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::rest_test::{RestTest, SLOPE_RAD_S};
use crate::camera::track_covariance::TrackCovariance;
use crate::camera::track_tuning::TrackTuning;
use crate::filter::Estimate;
use crate::measurement::CameraFrame;

/// Angle and rate at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State<T, B = AngleRateCovariance<T>> {
    pub(crate) at: Time,
    pub(crate) angle: AngleAccumulator<T>,
    pub(crate) rate_rad_s: T,
    pub(crate) covariance: B,
}

impl<T: Real, B: TrackCovariance<T>> State<T, B> {
    /// A copy, field by field: a copy as a whole is a call that costs as much as an update.
    pub(crate) fn copied(&self) -> Self {
        Self { covariance: self.covariance.copied(), ..*self }
    }

    /// Propagates it to `until` while the rate is a random walk of intensity `noise_rad2_s3`. Does nothing if `until`
    /// is not later.
    pub(crate) fn propagate(&mut self, until: Time, noise_rad2_s3: T) {
        let dt_s: T = until.seconds_since(self.at);
        self.at = self.at.max(until);
        self.angle.turn_by_radians(self.rate_rad_s * dt_s);
        self.covariance.predict(dt_s, noise_rad2_s3);
    }

    /// What [`Self::propagate`] makes of it, without the factors of the covariance:
    ///
    /// ```text
    /// P <- F P F' + q [dt^3/3 dt^2/2; dt^2/2 dt],   F = [1 dt; 0 1]
    /// ```
    pub(crate) fn predicted(&self, until: Time, noise_rad2_s3: T, resting: bool) -> Estimate<T> {
        let dt_s: T = until.seconds_since(self.at);
        let [angle_rad2, angle_rate_rad2_s, rate_rad2_s2] = self.covariance.moments_after(dt_s);
        let by_rate = noise_rad2_s3 * dt_s;
        let by_both = by_rate * dt_s * T::from_f64(0.5);
        let by_angle = by_both * dt_s * T::from_f64(2.0 / 3.0);
        let mut angle = self.angle;
        angle.turn_by_radians(self.rate_rad_s * dt_s);
        Estimate {
            at: until,
            angle: angle.angle(),
            rate_rad_s: self.rate_rad_s,
            angle_rad2: angle_rad2 + by_angle,
            angle_rate_rad2_s: angle_rate_rad2_s + by_both,
            rate_rad2_s2: rate_rad2_s2 + by_rate,
            resting,
        }
    }

    /// Innovation of a frame that shows `angle`, in rad: within half a turn.
    pub(crate) fn innovation_rad(&self, angle: Angle) -> T {
        angle.minus(self.angle.angle()).wrapped().radians_since(Angle::ZERO)
    }

    /// Fuses an angle with this innovation, measured with variance `noise_rad2`.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call costs a quarter of it")]
    pub(crate) fn correct(&mut self, innovation_rad: T, noise_rad2: T) {
        let [turn_rad, faster_rad_s] = self.covariance.correct_by_angle(innovation_rad, noise_rad2);
        self.angle.turn_by_radians(turn_rad);
        self.rate_rad_s += faster_rad_s;
    }
}

/// Time, angle, rate and rest of a track: a frame that leaves these leaves all of its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place<T> {
    pub(crate) at: Time,
    angle: Angle,
    rate_rad_s: T,
    resting: bool,
}

impl<T: Real> Place<T> {
    pub(crate) fn new<B>(state: &State<T, B>, resting: bool) -> Self {
        Self { at: state.at, angle: state.angle.angle(), rate_rad_s: state.rate_rad_s, resting }
    }
}

/// The state after a frame, and the statistics of the frames that led to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track<T, B = AngleRateCovariance<T>> {
    pub(crate) state: State<T, B>,
    /// The angle of the last frame used.
    pub(crate) code: Angle,
    /// Mean innovation at rest, in rad: of the last [`TrackTuning::mean_frames`], the latest weighing most.
    mean_innovation_rad: T,
    /// Running mean of the normalised innovations squared, each at most the gate: 1 if the camera is as good as its
    /// variance says.
    pub(crate) nis: T,
    /// One bit for each of the last eight frames, the newest lowest: 1 if the frame was beyond [`Self::FAR`].
    pub(crate) far: u8,
    /// Frames refused since one was used.
    pub(crate) refusals: u8,
    /// Frames in a row that brought the code of the last frame used.
    pub(crate) same_codes: u16,
    /// Whether the rotor is at rest, or quiet and slow.
    pub(crate) still: bool,
    pub(crate) resting: bool,
    /// Whether a kick was assumed right before the last frame.
    pub(crate) kicked: bool,
}

impl<T: Real, B: TrackCovariance<T>> Track<T, B> {
    /// Standard deviation of the rate at the start, in rad/s.
    const START_RATE_RAD_S: f64 = 20.0;

    /// Square of the mean innovation over n frames, per the variance of a frame and per `1 / (2 n - 1)`, beyond which
    /// the rotor has been moved: six standard deviations of a mean of white innovations. With the default camera a
    /// shift of 6 milli-degrees is found, and one of 50 within 2 ms.
    const MOVED_MAX: f64 = 0.14 * 255.0;

    /// Normalised innovation squared beyond which a frame counts as far off.
    const FAR: f64 = 16.0;

    /// A track that starts at `frame`, in the turn that brings it nearest to `near`. Of the track `before` it keeps the
    /// states other than angle and rate, and the statistics of the camera's noise.
    pub(crate) fn started(
        frame: &CameraFrame,
        near: Angle,
        before: Option<&Self>,
        tuning: &TrackTuning<T>,
    ) -> Self {
        let rate = T::from_f64(Self::START_RATE_RAD_S);
        let kept = before.map(|track| &track.state.covariance);
        Self {
            state: State {
                at: frame.exposed_at,
                angle: AngleAccumulator::at(near.plus(frame.angle.minus(near).wrapped())),
                rate_rad_s: T::zero(),
                covariance: B::begin(tuning.frame_rad2(frame, rate, false), rate * rate, kept),
            },
            code: frame.angle,
            mean_innovation_rad: T::zero(),
            nis: before.map_or(T::one(), |track| track.nis),
            far: before.map_or(0, |track| track.far),
            refusals: 0,
            same_codes: 0,
            still: false,
            resting: false,
            kicked: false,
        }
    }

    /// A copy, field by field: a copy as a whole is a call that costs as much as an update.
    pub(crate) fn copied(&self) -> Self {
        Self { state: self.state.copied(), ..*self }
    }

    /// Whether a frame brings the code of the last one used; counts how often in a row.
    pub(crate) fn same_code(&mut self, frame: &CameraFrame) -> bool {
        let same = frame.angle == self.code;
        self.same_codes = if same { self.same_codes.saturating_add(1) } else { 0 };
        same
    }

    pub(crate) fn note_innovation(&mut self, normalised: T, tuning: &TrackTuning<T>) {
        self.nis += (normalised - self.nis) / tuning.nis_frames;
        self.far = (self.far << 1) | u8::from(normalised > T::from_f64(Self::FAR));
    }

    /// Averages the innovations of a rotor at rest; whether they show that it has been moved.
    pub(crate) fn has_moved(&mut self, innovation_rad: T, frame_rad2: T, tuning: &TrackTuning<T>) -> bool {
        self.mean_innovation_rad += (innovation_rad - self.mean_innovation_rad) / tuning.mean_frames;
        let twice_frames = tuning.mean_frames + tuning.mean_frames - T::one();
        let mean_rad2 = self.mean_innovation_rad * self.mean_innovation_rad;
        mean_rad2 * twice_frames > T::from_f64(Self::MOVED_MAX) * frame_rad2
    }

    /// Whether equal codes have come so often in a row that the camera is stuck, or has no dither.
    pub(crate) fn repeats(&self, tuning: &TrackTuning<T>) -> bool {
        self.same_codes >= tuning.stuck_frames
    }

    /// Whether a rotor at rest shows the camera one code. A coarse camera may do so with dither.
    pub(crate) fn undithered(&self, tuning: &TrackTuning<T>) -> bool {
        self.resting && !tuning.coarse && self.repeats(tuning)
    }

    /// The rotor may move again: the next frames have to show rest anew.
    pub(crate) fn end_rest(&mut self) {
        (self.resting, self.still) = (false, false);
    }

    /// Lets `test` judge the frames of a quiet and slow rotor.
    pub(crate) fn look_for_rest(&mut self, quiet: bool, tuning: &TrackTuning<T>, test: &mut RestTest<T>) {
        self.still = quiet && self.state.rate_rad_s.abs() < tuning.resting_rate_rad_s;
        if !self.still {
            self.resting = false;
            test.restart();
        } else if !self.resting {
            self.mean_innovation_rad = T::zero();
            self.resting = test.confirms(self.state.at, self.code, tuning.camera_rad2);
        }
    }

    /// Fuses a rate of zero, with the variance that the ringing stator causes, or a rotor that rocks where the
    /// vibrometer disputes that it rests.
    pub(crate) fn fuse_rest(&mut self, tuning: &TrackTuning<T>, disputed: bool) {
        let State { angle, rate_rad_s, covariance, .. } = &mut self.state;
        let ringing_rad2_s2 = zero_rate_rad2_s2(covariance.rate_rad2_s2(), tuning);
        let variance = if disputed { T::from_f64(SLOPE_RAD_S * SLOPE_RAD_S) } else { ringing_rad2_s2 };
        let [turn_rad, faster_rad_s] = covariance.correct_by_rate(-*rate_rad_s, variance);
        angle.turn_by_radians(turn_rad);
        *rate_rad_s += faster_rad_s;
    }
}

/// Variance of the zero-rate update where that of the rate is `rate_rad2_s2`: see the module's head.
fn zero_rate_rad2_s2<T: Real>(rate_rad2_s2: T, tuning: &TrackTuning<T>) -> T {
    let [least, most, frames] = if rate_rad2_s2 > tuning.ringing_rad2_s2 {
        [tuning.ringing_rad2_s2, T::from_f64(SLOPE_RAD_S * SLOPE_RAD_S), tuning.stopping_frames]
    } else {
        [tuning.zero_rate_rad2_s2, tuning.ringing_rad2_s2, tuning.ringing_frames]
    };
    let falling = frames * rate_rad2_s2;
    let falling = if falling < most { falling } else { most };
    if falling > least { falling } else { least }
}

#[cfg(test)]
mod tests {
    use motor_model::math;

    use super::*;

    fn started(tuning: &TrackTuning<f64>, before: Option<&Track<f64>>) -> Track<f64> {
        Track::started(&CameraFrame::new(Time::ZERO, Angle::ZERO), Angle::ZERO, before, tuning)
    }

    /// The frames' scatter belongs to the camera: a restart keeps what is known of it.
    #[test]
    fn exact_a_restart_keeps_the_scatter_of_the_frames() {
        let tuning = TrackTuning::default();
        let mut track = started(&tuning, None);
        assert!(track.nis.to_bits() == 1.0_f64.to_bits() && track.far == 0);
        (0..3).for_each(|_| track.note_innovation(17.0, &tuning));
        let again = started(&tuning, Some(&track));
        assert!(again.nis.to_bits() == track.nis.to_bits() && track.nis > 1.5, "{}", again.nis);
        assert_eq!(again.far, 0b111);
    }

    /// A rotor that is called at rest while the vibrometer shows a flight: each frame tells that the rate is zero to
    /// 0.15 rad/s, so that k of them leave that over `sqrt(k + 1)`. Without the flight it is known better.
    #[test]
    fn exact_a_disputed_rest_leaves_the_rate_uncertain() {
        let tuning = TrackTuning::default();
        let slope_rad2_s2 = SLOPE_RAD_S * SLOPE_RAD_S;
        let after_99 = |disputed| {
            let mut track = started(&tuning, None);
            track.state.covariance = AngleRateCovariance::diagonal(1e-8, slope_rad2_s2);
            (0..99).for_each(|_| track.fuse_rest(&tuning, disputed));
            track.state.covariance.rate_rad2_s2()
        };
        assert!((100.0 * after_99(true) / slope_rad2_s2 - 1.0).abs() < 1e-9);
        assert!(100.0 * after_99(false) < 0.1 * slope_rad2_s2);
    }

    /// A rotor that was moved while it lay still, and lies still again: where it lies now it has not moved.
    #[test]
    fn exact_a_move_of_an_earlier_rest_is_forgotten() {
        let tuning = TrackTuning::default();
        let (mut track, mut test) = (started(&tuning, None), RestTest::default());
        track.resting = true;
        let far_rad = 3.0 * math::sqrt(tuning.camera_rad2);
        (0..200).for_each(|_| {
            track.has_moved(far_rad, tuning.camera_rad2, &tuning);
        });
        assert!(track.has_moved(0.0, tuning.camera_rad2, &tuning));
        track.end_rest();
        track.look_for_rest(true, &tuning, &mut test);
        assert!(!track.has_moved(0.0, tuning.camera_rad2, &tuning));
    }
}
