//! The two states, angle and rate, and what every filter of them does with a frame.
//!
//! ```text
//! camera = angle + noise of variance R = sigma^2 + Delta^2 / 12      sigma: tracking noise, Delta: step of the quantisation
//! ```
//!
//! A filter brings its own [`Process`]: how angle, rate and covariance go on between frames. Everything else is here, once: frames no newer than the last
//! one used, the gate, the new start after sustained refusal or when the turn is lost, rest.
//!
//! # Rest and quantisation
//!
//! A rotor at rest shows the camera one point of one cell. Averaging frames is then right only as far as the tracking noise dithers the
//! quantisation: with noise sigma the mean code is off by up to `(Delta / pi) exp(-2 pi^2 sigma^2 / Delta^2)`, 0.07 milli-degrees at the default
//! camera's `sigma = Delta / 2`, and by up to `Delta / 2`, 15 milli-degrees, without noise. Whether there is dither shows: with `sigma = Delta / 2` the code changes
//! from frame to frame with probability 0.46 to 0.53, wherever in its cell the rotor lies. So at rest the share of changes is followed (over 64
//! frames, from 0). While it is below 0.2 a code that only repeats itself is refused ([`Rejection::Repeated`]) as soon as the angle is known to
//! `Delta^2 / 12`, the variance of a uniform error within the cell. With the default camera the share passes 0.2 within some 35 frames, and then stays
//! six standard deviations above.
//!
//! What this leaves open: noise of `Delta / 5` passes for dither in some places of a cell, where it biases by a tenth of Delta.

use motor_model::{Angle, AngleAccumulator, Real, Time};

use crate::covariance::AngleRateCovariance;
use crate::filter::{Estimate, Health, Reason};
use crate::innovation::{Innovation, Rejection, Source, Verdict};
use crate::measurement::CameraFrame;

/// The camera, the gate and rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackTuning<T> {
    /// Variance of a frame's angle in rad^2, quantisation included.
    pub camera_rad2: T,
    /// The quantisation's part of it, in rad^2: step squared over 12.
    pub quantisation_rad2: T,
    /// Variance of the zero-rate update in rad^2/s^2, one a frame.
    pub zero_rate_rad2_s2: T,
    /// A quiet rotor is at rest once its rate has stayed within this of zero, in rad/s, for [`Self::resting_frames`]: twice the standard error of
    /// the rate.
    pub resting_rate_rad_s: T,
    /// How many frames that takes: with the least friction of Table 1, 0.2, a rotor slows down by 600 rad/s^2, and so has stopped by then.
    pub resting_frames: u8,
    /// A frame is refused when its innovation squared exceeds this many times its variance.
    pub gate: T,
    /// Variance added to the rate, once, when a struck rotor's frame is refused, in rad^2/s^2: as a rule it was no bad frame, but a burst of impacts
    /// as the rotor lands, which changes the rate by more than ten rad/s in a fraction of a millisecond.
    pub kick_rad2_s2: T,
    /// After this many refusals in a row the estimate begins anew.
    pub refusals_max: u8,
}

impl<T: Real> Default for TrackTuning<T> {
    /// For the default camera: 1 um of tracking noise and 2 um of quantisation at 3.9 mm are 2.96e-4 rad.
    fn default() -> Self {
        Self {
            camera_rad2: T::from_f64(8.8e-8),
            quantisation_rad2: T::from_f64(2.2e-8),
            zero_rate_rad2_s2: T::from_f64(1e-8),
            resting_rate_rad_s: T::from_f64(2.0),
            resting_frames: 34,
            gate: T::from_f64(36.0),
            kick_rad2_s2: T::from_f64(200.0),
            refusals_max: 20,
        }
    }
}

/// What is known of angle and rate beside their values: their covariance, and in a richer filter the states that it estimates with them.
pub(crate) trait Belief<T>: Copy {
    /// Independent angle and rate; what a belief from `before` knows beside them is kept.
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self;
    fn angle_rad2(&self) -> T;
    fn angle_rate_rad2_s(&self) -> T;
    fn rate_rad2_s2(&self) -> T;
    /// Time passes, the rate wanders.
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T);
    /// The rate becomes less certain.
    fn widen_rate(&mut self, variance_rad2_s2: T);
    /// Takes in an angle; the corrections of angle and rate.
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2];
    /// Takes in a rate; the corrections of angle and rate.
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2];
}

impl<T: Real> Belief<T> for AngleRateCovariance<T> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, _before: Option<&Self>) -> Self {
        Self::diagonal(angle_rad2, rate_rad2_s2)
    }

    #[inline]
    fn angle_rad2(&self) -> T {
        self.angle_rad2()
    }

    #[inline]
    fn angle_rate_rad2_s(&self) -> T {
        self.angle_rate_rad2_s()
    }

    #[inline]
    fn rate_rad2_s2(&self) -> T {
        self.rate_rad2_s2()
    }

    #[inline]
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        self.predict(dt_s, noise_rad2_s3);
    }

    #[inline]
    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.widen_rate(variance_rad2_s2);
    }

    #[inline]
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2] {
        let gain = self.update_angle(noise_rad2);
        [gain.angle * innovation_rad, gain.rate * innovation_rad]
    }

    #[inline]
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2] {
        let gain = self.update_rate(noise_rad2_s2);
        [gain.angle * innovation_rad_s, gain.rate * innovation_rad_s]
    }
}

/// How a track goes on between frames.
pub(crate) trait Process<T, B = AngleRateCovariance<T>> {
    /// `track` carried forward to `until`; as it is if `until` is not later.
    fn carry(&self, track: &Track<T, B>, until: Time) -> Track<T, B>;
}

/// What is known of the rotor at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track<T, B = AngleRateCovariance<T>> {
    pub(crate) at: Time,
    pub(crate) angle: AngleAccumulator<T>,
    pub(crate) rate_rad_s: T,
    pub(crate) covariance: B,
    /// Frames for which the rotor has been quiet and slow, without a break.
    still_frames: u8,
    pub(crate) resting: bool,
    /// The last frame's angle.
    code: Angle,
    /// Share of frames at rest whose code differs from the one before.
    changing: T,
}

impl<T: Real, B: Belief<T>> Track<T, B> {
    /// The track carried forward to `until` while the rate wanders with intensity `noise_rad2_s3`; as it is if `until` is not later.
    #[inline]
    pub(crate) fn wandered(&self, until: Time, noise_rad2_s3: T) -> Self {
        let mut ahead = *self;
        let dt_s: T = until.seconds_since(self.at);
        ahead.at = if until > self.at { until } else { self.at };
        ahead.angle.turn_by_radians(self.rate_rad_s * dt_s);
        ahead.covariance.predict(dt_s, noise_rad2_s3);
        ahead
    }

    /// Whether a frame would only repeat, undithered, what is known as well as quantisation allows.
    fn repeats(&self, frame: &CameraFrame, tuning: &TrackTuning<T>) -> bool {
        self.resting
            && frame.angle == self.code
            && self.changing < T::from_f64(0.2)
            && self.covariance.angle_rad2() <= tuning.quantisation_rad2
    }

    /// Follows the share of frames at rest that bring a new code.
    fn watch_code(&mut self, frame: &CameraFrame) {
        let changed = if frame.angle == self.code { T::zero() } else { T::one() };
        self.code = frame.angle;
        self.changing = if self.resting {
            self.changing + (changed - self.changing) * T::from_f64(1.0 / 64.0)
        } else {
            T::zero()
        };
    }

    fn correct(&mut self, innovation_rad: T, quiet: bool, tuning: &TrackTuning<T>) {
        let [angle, rate] = self.covariance.correct_by_angle(innovation_rad, tuning.camera_rad2);
        self.angle.turn_by_radians(angle);
        self.rate_rad_s += rate;
        let still = quiet && self.rate_rad_s.abs() < tuning.resting_rate_rad_s;
        self.still_frames = if still { self.still_frames.saturating_add(1) } else { 0 };
        self.resting = self.still_frames >= tuning.resting_frames;
    }

    /// Tells the filter that a rotor at rest does not turn.
    fn stand_still(&mut self, tuning: &TrackTuning<T>) {
        if self.resting {
            let [angle, rate] = self.covariance.correct_by_rate(-self.rate_rad_s, tuning.zero_rate_rad2_s2);
            self.angle.turn_by_radians(angle);
            self.rate_rad_s += rate;
        }
    }
}

/// The track once a frame has come, and the frames refused since one was used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracker<T, B = AngleRateCovariance<T>> {
    tuning: TrackTuning<T>,
    track: Option<Track<T, B>>,
    refusals: u8,
}

impl<T: Real, B: Belief<T>> Tracker<T, B> {
    /// Largest rate that a start has to allow for, one standard deviation, in rad/s.
    const START_RATE_RAD_S: f64 = 20.0;

    /// Predicted angle variance in rad^2 beyond which the turn is lost: six standard deviations, the gate, then span it.
    const LOST_RAD2: f64 = 0.25;

    /// Angle variance in rad^2 beyond which an estimate is of no use: half a degree.
    const UNCERTAIN_RAD2: f64 = 7.6e-5;

    /// From so many refusals in a row on the estimate is of no use: a single outlier or a landing takes one or two.
    const REFUSALS_SUSTAINED: u8 = 3;

    /// A tracker that has seen nothing.
    pub(crate) fn new(tuning: TrackTuning<T>) -> Self {
        Self { tuning, track: None, refusals: 0 }
    }

    /// The track at the last frame used.
    pub(crate) fn track(&self) -> Option<&Track<T, B>> {
        self.track.as_ref()
    }

    /// Moves the track on without a frame.
    pub(crate) fn advance(&mut self, until: Time, process: &impl Process<T, B>) {
        self.track = self.track.as_ref().map(|track| process.carry(track, until));
    }

    /// Takes a frame in. `quiet` is whether the rotor lies on the teeth.
    pub(crate) fn update(
        &mut self,
        frame: &CameraFrame,
        quiet: bool,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        let Some(track) = &mut self.track else { return self.restart(frame, Angle::ZERO) };
        if frame.exposed_at <= track.at {
            return refused(frame, T::zero(), T::zero(), Rejection::NotNewer);
        }
        let predicted = process.carry(track, frame.exposed_at);
        // Asked this way round, so that a variance that has overflowed counts as lost too.
        let turn_known = predicted.covariance.angle_rad2() <= T::from_f64(Self::LOST_RAD2);
        if !turn_known {
            return self.restart(frame, predicted.angle.angle());
        }
        let innovation_rad: T =
            frame.angle.minus(predicted.angle.angle()).wrapped().radians_since(Angle::ZERO);
        let variance_rad2 = predicted.covariance.angle_rad2() + self.tuning.camera_rad2;
        if innovation_rad * innovation_rad > self.tuning.gate * variance_rad2 {
            self.refusals = self.refusals.saturating_add(1);
            if self.refusals == 1 && !quiet {
                track.covariance.widen_rate(self.tuning.kick_rad2_s2);
            }
            if self.refusals < self.tuning.refusals_max {
                return refused(frame, innovation_rad, variance_rad2, Rejection::Gate);
            }
            return self.restart(frame, predicted.angle.angle());
        }
        self.refusals = 0;
        *track = predicted;
        let repeats = quiet && track.repeats(frame, &self.tuning);
        track.watch_code(frame);
        if !repeats {
            track.correct(innovation_rad, quiet, &self.tuning);
        }
        track.stand_still(&self.tuning);
        if repeats {
            return refused(frame, innovation_rad, variance_rad2, Rejection::Repeated);
        }
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad,
            variance_rad2,
            verdict: Verdict::Used,
        }
    }

    /// Angle and rate carried forward to `now`; `None` before the first frame.
    #[inline]
    pub(crate) fn estimate(&self, now: Time, process: &impl Process<T, B>) -> Option<Estimate<T>> {
        let track = self.track.as_ref()?;
        let ahead = process.carry(track, now);
        Some(Estimate {
            at: now,
            angle: ahead.angle.angle(),
            rate_rad_s: ahead.rate_rad_s,
            angle_rad2: ahead.covariance.angle_rad2(),
            angle_rate_rad2_s: ahead.covariance.angle_rate_rad2_s(),
            rate_rad2_s2: ahead.covariance.rate_rad2_s2(),
            resting: track.resting,
        })
    }

    /// Whether the estimate at `now` may be used; `silent` is whether the vibrometer is.
    pub(crate) fn health(&self, now: Time, silent: bool, process: &impl Process<T, B>) -> Health {
        let Some(track) = &self.track else { return Health::Waiting };
        let variance_rad2 = process.carry(track, now).covariance.angle_rad2();
        // Asked this way round, so that a variance that has overflowed is refused too.
        let certain = variance_rad2 <= T::from_f64(Self::UNCERTAIN_RAD2);
        if self.refusals >= Self::REFUSALS_SUSTAINED {
            Health::Unusable(Reason::FramesRefused)
        } else if !certain {
            Health::Unusable(Reason::Uncertain)
        } else if silent {
            Health::Degraded(Reason::VibrometerSilent)
        } else {
            Health::Good
        }
    }

    /// Begins at `frame`, in the turn that brings it nearest to `near`.
    fn restart(&mut self, frame: &CameraFrame, near: Angle) -> Innovation<T> {
        let rate = T::from_f64(Self::START_RATE_RAD_S);
        let before = self.track.as_ref().map(|track| &track.covariance);
        let covariance = B::begin(self.tuning.camera_rad2, rate * rate, before);
        self.track = Some(Track {
            at: frame.exposed_at,
            angle: AngleAccumulator::at(near.plus(frame.angle.minus(near).wrapped())),
            rate_rad_s: T::zero(),
            covariance,
            still_frames: 0,
            resting: false,
            code: frame.angle,
            changing: T::zero(),
        });
        self.refusals = 0;
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad: T::zero(),
            variance_rad2: T::zero(),
            verdict: Verdict::Restarted,
        }
    }
}

fn refused<T: Real>(
    frame: &CameraFrame,
    innovation_rad: T,
    variance_rad2: T,
    why: Rejection,
) -> Innovation<T> {
    Innovation {
        source: Source::Camera,
        taken_at: frame.exposed_at,
        innovation_rad,
        variance_rad2,
        verdict: Verdict::Rejected(why),
    }
}
