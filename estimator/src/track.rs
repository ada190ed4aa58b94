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
//! # Moved at rest
//!
//! A rotor that is nudged by less than the gate, and not heard, would be believed where it was for as long as it had been measured there. So at rest the mean of the innovations is followed:
//! when it is off by six of its standard deviations the estimate begins anew.
//!
//! What this leaves open: noise of `Delta / 5` passes for dither in some places of a cell, where it biases by a tenth of Delta.

use motor_model::{Angle, AngleAccumulator, Real, Time, math};

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

/// How a track goes on between frames.
pub(crate) trait Process<T> {
    /// `track` carried forward to `until`; as it is if `until` is not later.
    fn carry(&self, track: &Track<T>, until: Time) -> Track<T>;
}

/// What is known of the rotor at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track<T> {
    pub(crate) at: Time,
    pub(crate) angle: AngleAccumulator<T>,
    pub(crate) rate_rad_s: T,
    pub(crate) covariance: AngleRateCovariance<T>,
    /// Frames for which the rotor has been quiet and slow, without a break.
    still_frames: u8,
    pub(crate) resting: bool,
    /// The last frame's angle.
    code: Angle,
    /// Share of frames at rest whose code differs from the one before.
    changing: T,
    /// Mean innovation at rest, in standard deviations of a frame: of the last [`Self::AWAY_FRAMES`], the latest weighing most.
    away: T,
}

impl<T: Real> Track<T> {
    /// Frames over which [`Self::away`] is a mean.
    const AWAY_FRAMES: f64 = 128.0;

    /// Beyond this mean innovation the rotor no longer lies where it is believed to: six standard deviations of a mean of white innovations, `1 / sqrt(2 n - 1)`. A shift of 6 milli-degrees
    /// shows, with the default camera; one of 50 shows within 2 ms.
    const AWAY_MAX: f64 = 0.375;

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

    /// Follows the innovations at rest; whether they say that the rotor has been moved, too little for the gate.
    fn moved_away(&mut self, innovation_rad: T, sigma_rad: T) -> bool {
        let aside = if self.resting { innovation_rad / sigma_rad } else { T::zero() };
        self.away = if self.resting {
            self.away + (aside - self.away) * T::from_f64(1.0 / Self::AWAY_FRAMES)
        } else {
            T::zero()
        };
        self.away.abs() > T::from_f64(Self::AWAY_MAX)
    }

    fn correct(&mut self, innovation_rad: T, quiet: bool, tuning: &TrackTuning<T>) {
        let gain = self.covariance.update_angle(tuning.camera_rad2);
        self.angle.turn_by_radians(gain.angle * innovation_rad);
        self.rate_rad_s += gain.rate * innovation_rad;
        let still = quiet && self.rate_rad_s.abs() < tuning.resting_rate_rad_s;
        self.still_frames = if still { self.still_frames.saturating_add(1) } else { 0 };
        self.resting = self.still_frames >= tuning.resting_frames;
    }

    /// Tells the filter that a rotor at rest does not turn.
    fn stand_still(&mut self, tuning: &TrackTuning<T>) {
        if self.resting {
            let surplus = -self.rate_rad_s;
            let gain = self.covariance.update_rate(tuning.zero_rate_rad2_s2);
            self.angle.turn_by_radians(gain.angle * surplus);
            self.rate_rad_s += gain.rate * surplus;
        }
    }
}

/// The track once a frame has come, and the frames refused since one was used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracker<T> {
    tuning: TrackTuning<T>,
    /// Standard deviation of a frame's angle.
    sigma_rad: T,
    track: Option<Track<T>>,
    refusals: u8,
}

impl<T: Real> Tracker<T> {
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
        let sigma_rad = T::from_f64(math::sqrt(tuning.camera_rad2.to_f64()));
        Self { tuning, sigma_rad, track: None, refusals: 0 }
    }

    /// The track at the last frame used.
    pub(crate) fn track(&self) -> Option<&Track<T>> {
        self.track.as_ref()
    }

    /// Moves the track on without a frame.
    pub(crate) fn advance(&mut self, until: Time, process: &impl Process<T>) {
        self.track = self.track.as_ref().map(|track| process.carry(track, until));
    }

    /// Takes a frame in. `quiet` is whether the rotor lies on the teeth.
    pub(crate) fn update(
        &mut self,
        frame: &CameraFrame,
        quiet: bool,
        process: &impl Process<T>,
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
        let variance_rad2 = predicted.covariance.angle_innovation_rad2(self.tuning.camera_rad2);
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
        if !repeats && track.moved_away(innovation_rad, self.sigma_rad) {
            let near = track.angle.angle();
            return self.restart(frame, near);
        }
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
    pub(crate) fn estimate(&self, now: Time, process: &impl Process<T>) -> Option<Estimate<T>> {
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
    pub(crate) fn health(&self, now: Time, silent: bool, process: &impl Process<T>) -> Health {
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
        self.track = Some(Track {
            at: frame.exposed_at,
            angle: AngleAccumulator::at(near.plus(frame.angle.minus(near).wrapped())),
            rate_rad_s: T::zero(),
            covariance: AngleRateCovariance::diagonal(self.tuning.camera_rad2, rate * rate),
            still_frames: 0,
            resting: false,
            code: frame.angle,
            changing: T::zero(),
            away: T::zero(),
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
