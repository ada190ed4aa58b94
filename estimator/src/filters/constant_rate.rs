//! The simplest filter: angle and rate from the camera, the rate constant but for white noise.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | angle | rad | rotation of the rotor | first frame, its variance R |
//! | 1 | rate | rad/s | angular rate | 0, standard deviation 20 rad/s |
//!
//! ```text
//! angle' = rate,   rate' = white noise of intensity q,   camera = angle + noise of variance R
//! ```
//!
//! Each impact kicks the rate; `q` stands for all kicks. From the model (Coulomb friction, steady motion): the rate
//! varies with standard deviation s and correlation time T, so `q = 2 s^2 / T`, with 4.4 rad/s and 12 ms in mode B,
//! 0.54 rad/s and 2 ms in mode C. The values used make the normalised innovations squared 1 on average over drawn
//! motors, within a percent.
//!
//! # Jitter
//!
//! Impacts are not white noise: neighbouring kicks undo a part of each other. Over a time t the true rate changes by D
//! t in mean square, with D in rad^2/s^3
//!
//! ```text
//! t in ms      0.1     0.2     0.4     0.8     1.6     3.2
//! mode B      4260    4230    3780    3340    3130    3030     3000, and a part with a correlation time of 0.25 ms
//! mode C       920     970     820     500     340     210
//! ```
//!
//! The filter averages over some milliseconds, so `q` is D at those times. The part that comes and goes within them it
//! cannot estimate: that is the [`Jitter`]. Without it the squared error of angle and rate together would be 1.07 (B)
//! and 1.23 (C) times the variance, and 1.15 and 1.57 times that of the smoother.
//!
//! # Slow cameras
//!
//! Between the frames of a slow camera the rate returns to its mean: [`crate::filters::mean_rate`].

use motor_model::{DriveCommand, MotorParams, Real, Time};

use crate::camera::process::{Process, ReturnToMean, Wander, Wandering};
use crate::camera::track::State;
use crate::camera::track_covariance::TrackCovariance;
use crate::camera::tracker::{FrameContext, Tracker};
use crate::filters::mean_rate::MeanRates;
use crate::vibrometer::motion::MotionWatch;
use crate::vibrometer::motion_history::{MotionPiece, Motions};
use crate::{
    AngleFilter, CameraDescription, CameraFrame, Estimate, Health, ImpactInnovation, Innovation, Instruments,
    Jitter, LdvSample, Motion, RESTING_GROWTH_RAD2_S, Reason, RestTuning, TrackTuning,
};

/// Noise of process and camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantRateTuning<T> {
    /// The camera, the gate and rest.
    pub track: TrackTuning<T>,
    /// When the rotor counts as quiet.
    pub rest: RestTuning<T>,
    /// Process noise between frames.
    pub random_walk: RandomWalkTuning<T>,
}

/// Intensity of the white noise that drives the rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomWalkTuning<T> {
    /// Process noise under mode B in rad^2/s^3.
    pub impacted_b_rad2_s3: T,
    /// Process noise under mode C in rad^2/s^3.
    pub impacted_c_rad2_s3: T,
    /// Process noise of a rotor that slides to a stop in rad^2/s^3: friction changes the rate by 0.6 to 1.8 rad/s in a
    /// millisecond.
    pub sliding_rad2_s3: T,
    /// Process noise at rest in rad^2/s^3.
    pub resting_rad2_s3: T,
    /// Whether the rate returns to its mean between frames ([`crate::filters::mean_rate`]).
    pub returns_to_mean: bool,
    /// Jitter under mode B.
    pub jitter_b: Jitter<T>,
    /// Jitter under mode C.
    pub jitter_c: Jitter<T>,
}

impl<T: Real> Default for ConstantRateTuning<T> {
    /// For the default instruments.
    fn default() -> Self {
        Self::new(&Instruments::default())
    }
}

impl<T: Real> ConstantRateTuning<T> {
    /// For the nominal motor under `instruments`.
    pub fn new(instruments: &Instruments) -> Self {
        Self::for_motor(&MotorParams::nominal(), instruments)
    }

    /// For a motor of `params` under `instruments`.
    #[inline(never)]
    pub fn for_motor(params: &MotorParams, instruments: &Instruments) -> Self {
        Self {
            track: TrackTuning::new(&instruments.camera),
            rest: RestTuning::new(params, instruments),
            random_walk: RandomWalkTuning::new(&instruments.camera),
        }
    }
}

/// Process noise at rest in rad^2/s^3. With the zero-rate update it is forgotten within 10 ms; between slower frames it
/// turns the angle by no more than then: by [`RESTING_GROWTH_RAD2_S`] in variance, `q dt^3 / 3` at most.
fn resting_rad2_s3(period_s: f64) -> f64 {
    const FORGOTTEN_S: f64 = 0.01;
    let part = (FORGOTTEN_S / period_s).min(1.0);
    RESTING_GROWTH_RAD2_S / (FORGOTTEN_S * FORGOTTEN_S) * part * part
}

impl<T: Real> Default for RandomWalkTuning<T> {
    /// For the default camera.
    fn default() -> Self {
        Self::new(&CameraDescription::default())
    }
}

impl<T: Real> RandomWalkTuning<T> {
    /// Period of the frames from which on the rate returns to its mean between them, in ns: a sixth of its correlation
    /// time in mode B.
    const SLOW_NANOS: u64 = 2_000_000;

    /// For `camera`.
    pub fn new(camera: &CameraDescription) -> Self {
        Self {
            returns_to_mean: camera.period_nanos > Self::SLOW_NANOS,
            impacted_b_rad2_s3: T::from_f64(3200.0),
            impacted_c_rad2_s3: T::from_f64(300.0),
            sliding_rad2_s3: T::from_f64(3000.0),
            resting_rad2_s3: T::from_f64(resting_rad2_s3(camera.period_s())),
            jitter_b: Jitter { angle_rad2: T::from_f64(5e-10), rate_rad2_s2: T::from_f64(0.1) },
            jitter_c: Jitter { angle_rad2: T::from_f64(1e-9), rate_rad2_s2: T::from_f64(0.05) },
        }
    }

    pub(crate) fn intensity_rad2_s3(&self, motion: Motion, resting: bool) -> T {
        let quiet = if resting { self.resting_rad2_s3 } else { self.sliding_rad2_s3 };
        motion.of(self.impacted_b_rad2_s3, self.impacted_c_rad2_s3, quiet)
    }

    /// Whether the rate returns to its mean; `resting` is whether the rotor lies still.
    #[inline]
    pub(crate) fn returns(&self, resting: bool) -> bool {
        self.returns_to_mean && !resting
    }

    /// The random walk right after `at` in `piece`.
    #[inline]
    pub(crate) fn wandering(&self, piece: &MotionPiece, at: Time, resting: bool) -> Wandering<T> {
        Wandering {
            intensity_rad2_s3: self.intensity_rad2_s3(piece.motion, resting || piece.rested),
            until: if self.returns(resting) { at } else { piece.until },
        }
    }

    pub(crate) fn jitter(&self, motion: Motion) -> Jitter<T> {
        motion.of(self.jitter_b, self.jitter_c, Jitter::none())
    }
}

/// The rate is a random walk.
struct RandomWalk<'a, T> {
    tuning: &'a RandomWalkTuning<T>,
    motions: Motions<'a>,
    mean_rates: &'a MeanRates<T>,
}

impl<T: Real> Wander<T> for RandomWalk<'_, T> {
    fn wandering(&self, at: Time, resting: bool) -> Wandering<T> {
        self.tuning.wandering(&self.motions.piece(at), at, resting)
    }

    fn returning(&self, at: Time, resting: bool) -> Option<ReturnToMean<T>> {
        let piece = Some(self.motions.piece(at)).filter(|_| self.tuning.returns(resting))?;
        Some(self.mean_rates.returning(&piece, at, self.tuning.wandering(&piece, at, resting)))
    }

    fn only_wanders(&self, _at: Time, _resting: bool) -> bool {
        true
    }
}

impl<T: Real, B: TrackCovariance<T>> Process<T, B> for RandomWalk<'_, T> {
    fn carry(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        self.wander(state, resting, until);
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        self.tuning.jitter(self.motions.piece(at).motion)
    }
}

/// The filter of constant rate.
#[derive(Clone, Debug)]
pub struct ConstantRate<T> {
    random_walk: RandomWalkTuning<T>,
    mean_rates: MeanRates<T>,
    watch: MotionWatch<T>,
    tracker: Tracker<T>,
}

impl<T: Real> ConstantRate<T> {
    /// A filter without measurements.
    pub fn new(tuning: &ConstantRateTuning<T>) -> Self {
        Self {
            random_walk: tuning.random_walk,
            mean_rates: MeanRates::new(),
            watch: MotionWatch::new(&tuning.rest),
            tracker: Tracker::new(tuning.track),
        }
    }

    fn process(&self, now: Time) -> RandomWalk<'_, T> {
        let motions = self.watch.motions(now);
        RandomWalk { tuning: &self.random_walk, motions, mean_rates: &self.mean_rates }
    }
}

impl<T: Real> AngleFilter<T> for ConstantRate<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        self.watch.drive(at, command);
        if self.random_walk.returns_to_mean {
            self.mean_rates.note_drive(at, command);
        }
        if command.mode().is_some() {
            self.tracker.end_rest();
        }
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<T>> {
        self.watch.observe(sample);
        None
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        let clock = self.watch.clock();
        let motions = self.watch.motions(clock.max(frame.exposed_at));
        // Written out, since the tracker changes meanwhile.
        let process = RandomWalk { tuning: &self.random_walk, motions, mean_rates: &self.mean_rates };
        let from = self.tracker.newest_at().min(frame.exposed_at);
        let (motion, disputed) = (motions.throughout(from), self.watch.disputes_quiet(clock));
        let context = FrameContext { clock, quiet: motion == Motion::Quiet, disputed };
        let innovation = self.tracker.update(frame, context, &process);
        self.watch.note_rest(self.tracker.is_resting(), self.tracker.newest_at(), clock);
        if self.random_walk.returns_to_mean {
            let begun = self.watch.motions(clock).piece(clock).begun;
            self.mean_rates.note_frame(&innovation, self.watch.applied.mode(), begun);
        }
        innovation
    }

    fn estimate(&self, now: Time) -> Option<Estimate<T>> {
        self.tracker.estimate(now, &self.process(now))
    }

    fn smoothed(&self, at: Time) -> Option<Estimate<T>> {
        self.tracker.smoothed(at, &self.process(self.watch.clock().max(at)))
    }

    fn assess_for(&self, now: Time, instant: Time) -> (Option<Estimate<T>>, Health) {
        let silent = self.watch.silent(now).then_some(Reason::VibrometerSilent);
        let estimate = self.estimate(instant);
        let health = self.tracker.judge(estimate.as_ref(), now, silent);
        (estimate, health)
    }
}

#[cfg(test)]
mod tests;
