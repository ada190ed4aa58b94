//! The filter that knows when the rotor is struck: angle and rate from the camera, the instants and sizes of the rate's kicks from the vibrometer.
//!
//! ```text
//! angle' = rate,   rate' = 0,     at an impact of jump dv:   rate+ = rate + kick,   |kick| <= c dv,   c = mu m_r R_t / J        (13c)
//! ```
//!
//! Drag turns the rate back by a millionth of itself in a second and is left out. Between impacts the filter therefore knows the rate as well as the frames since
//! the last one tell; at each impact the rate is kicked by a mean and becomes less certain by a variance.
//!
//! # The kick
//!
//! Friction acts on the slip and at most stops it: `kick = clamp(s' / R_t - rate, -c dv, c dv)`, where `s'` is the tooth's tangential velocity. The vibrometer gives
//! the tooth's *vertical* velocity, since restitution is known: from `dv = (1 + e)(u' - v) / (1 + r)`,
//!
//! ```text
//! u' = v + dv (1 + r) / (1 + e),    r = 3 m_r / m_s
//! ```
//!
//! - Mode B swings by 20 um, far above what impacts leave in the other modes, and a tooth in mode B moves on a line: `s' = (psi_B / phi_B) u'`, the same for both
//!   pairs. The mean kick is the law with this `s'`. What remains are the tolerance of the friction (uniform in 0.2 to 0.6: a
//!   relative variance of 0.083) and the other modes' share in `u'`: together 0.126 of `(c dv)^2`, in 10 drawn motors under full drive, of the 0.655
//!   that the kicks have.
//! - Mode C swings by 2 um, no more than what impacts leave in A and B: the slip's sign is unknown, and 80 % of the kicks are at their
//!   bound. The mean is 0 and the variance `(c dv)^2` (0.98 of it in the same motors). So it is, too, for a rotor that lands with the drive off.
//!
//! The jumps that the detector misses, up to its threshold, ride with those that it finds: `dv^2` in the variance is `dv^2 + threshold^2`. Under mode
//! C those below 1.4 mm/s kick with an intensity of 4 rad^2/s^3 in all, against 860 of those above: [`ImpactAidedTuning::missed_rad2_s3`].
//!
//! # Late frames, lost samples
//!
//! The impacts since the oldest frame kept are kept, up to [`IMPACTS_KEPT_MAX`]. A frame is fused at its exposure, through the impacts before it, and the estimate
//! goes on from there through those after it. One impact more than fits gives up the frames before the oldest, and moves the track there if need be: what was
//! exposed before that comes too late.
//! Where no sample has come for [`crate::ImpactDetectorTuning::gap_nanos`], the rate wanders as in [`crate::ConstantRate`].

use heapless::Deque;
use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter, Real, Time, math};

use crate::constant_rate::ConstantRateTuning;
use crate::filter::{AngleFilter, Estimate, Health, Reason};
use crate::impact_detector::{Heard, ImpactDetector, ImpactDetectorTuning};
use crate::innovation::Innovation;
use crate::measurement::{CameraFrame, LdvSample};
use crate::motion::{Motion, MotionWatch};
use crate::track::{Process, State};
use crate::tracker::{Moment, Tracker};

/// Most impacts kept: 4.5 ms of the wildest motion, mode B at a fifth of its amplitude, with 28 impacts a ms.
pub const IMPACTS_KEPT_MAX: usize = 128;

/// What the filter assumes of motor and sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactAidedTuning<T> {
    /// Camera, rest, and the process noise without vibrometer.
    pub constant_rate: ConstantRateTuning<T>,
    /// The impact detector.
    pub detector: ImpactDetectorTuning<T>,
    /// Largest kick per jump, `c = mu m_r R_t / J`, in rad/s per m/s.
    pub kick_per_jump_rad_m: T,
    /// Tooth's velocity above the rotor's per jump, `(1 + r) / (1 + e)`.
    pub approach_per_jump: T,
    /// `s' / (R_t u')` of a tooth in pure mode B, in rad/m.
    pub turn_per_rise_rad_m: T,
    /// Variance of a kick under mode B about its mean, per `(c dv)^2`.
    pub unexplained_b: T,
    /// Variance of a kick of unknown sign, per `(c dv)^2`.
    pub unexplained: T,
    /// Process noise between impacts of a rotor that is struck, in rad^2/s^3: impacts below the detector's threshold.
    pub missed_rad2_s3: T,
}

impl<T: Real> ImpactAidedTuning<T> {
    /// For a motor of `params` under the default sensors.
    pub fn new(params: &MotorParams) -> Self {
        let get = |parameter| params.get(parameter);
        let kick = get(Parameter::Friction) * get(Parameter::RotorMass) * get(Parameter::ToothRadius)
            / get(Parameter::RotorInertia);
        let approach = (1.0 + 3.0 * params.mass_ratio()) / (1.0 + get(Parameter::Restitution));
        let (sin, cos) = math::sin_cos(2.0 * params.effective_tooth_angle_deg().to_radians());
        Self {
            constant_rate: ConstantRateTuning::default(),
            detector: ImpactDetectorTuning::new(params),
            kick_per_jump_rad_m: T::from_f64(kick),
            approach_per_jump: T::from_f64(approach),
            turn_per_rise_rad_m: T::from_f64(params.lever() * cos / (sin * get(Parameter::ToothRadius))),
            unexplained_b: T::from_f64(0.126),
            unexplained: T::from_f64(1.0),
            missed_rad2_s3: T::from_f64(4.0),
        }
    }
}

/// What an impact does to the rate.
#[derive(Clone, Copy, Debug)]
struct Kick<T> {
    at: Time,
    /// The rate towards which it drives the rotor, in rad/s.
    towards_rad_s: T,
    /// How far at most, in rad/s; 0 where the sign is unknown.
    reach_rad_s: T,
    variance_rad2_s2: T,
}

impl<T: Real> Kick<T> {
    fn apply(&self, state: &mut State<T>) {
        let surplus = self.towards_rad_s - state.rate_rad_s;
        state.rate_rad_s += surplus.clamp_magnitude(self.reach_rad_s);
        state.covariance.widen_rate(self.variance_rad2_s2);
    }
}

/// The kicks since the oldest frame kept, in the order of time.
type Kicks<T> = Deque<Kick<T>, IMPACTS_KEPT_MAX>;

/// The rate jumps when the rotor is struck.
struct Kicked<'a, T> {
    tuning: &'a ImpactAidedTuning<T>,
    kicks: &'a Kicks<T>,
    motion: Motion,
    /// Until when impacts would have been heard.
    heard_until: Time,
}

impl<T: Real> Kicked<'_, T> {
    /// From one impact to the next.
    #[inline]
    fn fly(&self, state: &mut State<T>, resting: bool, until: Time) {
        if self.motion != Motion::Quiet {
            state.wander(until.min(self.heard_until), self.tuning.missed_rad2_s3);
        }
        if until > state.at {
            state.wander(until, self.tuning.constant_rate.wander.intensity_rad2_s3(self.motion, resting));
        }
    }
}

impl<T: Real> Kicked<'_, T> {
    /// Through the kicks between `state` and `until`, up to the last of them.
    #[inline(never)]
    fn pass_kicks(&self, state: &mut State<T>, resting: bool, until: Time) {
        let from = state.at;
        // Most are older than the track: counted from the newest.
        let newer = self.kicks.iter().rev().take_while(|kick| kick.at > from).count();
        for index in self.kicks.len() - newer..self.kicks.len() {
            let Some(kick) = self.kicks.get(index).filter(|kick| kick.at <= until) else { break };
            self.fly(state, resting, kick.at);
            kick.apply(state);
        }
    }
}

impl<T: Real> Process<T> for Kicked<'_, T> {
    #[inline]
    fn carry(&self, state: &mut State<T>, resting: bool, until: Time) {
        let struck = self.kicks.back().is_some_and(|kick| kick.at > state.at);
        if struck && !(resting && self.motion == Motion::Quiet) {
            self.pass_kicks(state, resting, until);
        }
        self.fly(state, resting, until);
    }
}

/// The filter.
#[derive(Clone, Debug)]
pub struct ImpactAided<T> {
    tuning: ImpactAidedTuning<T>,
    watch: MotionWatch<T>,
    detector: ImpactDetector<T>,
    tracker: Tracker<T>,
    kicks: Kicks<T>,
    drive: DriveCommand,
}

impl<T: Real> ImpactAided<T> {
    /// A filter that has seen nothing.
    pub fn new(tuning: &ImpactAidedTuning<T>) -> Self {
        Self {
            tuning: *tuning,
            watch: MotionWatch::new(&tuning.constant_rate.rest),
            detector: ImpactDetector::new(tuning.detector),
            tracker: Tracker::new(tuning.constant_rate.track),
            kicks: Deque::new(),
            drive: DriveCommand::OFF,
        }
    }

    fn process(&self, now: Time) -> Kicked<'_, T> {
        Kicked {
            tuning: &self.tuning,
            kicks: &self.kicks,
            motion: self.watch.motion(now),
            heard_until: self.heard_until(),
        }
    }

    /// Until when impacts would have been heard: never, by a vibrometer whose sign is wrong.
    fn heard_until(&self) -> Time {
        let newest = self.detector.newest().filter(|_| !self.detector.inverted());
        newest.map_or(Time::ZERO, |newest| newest.plus_nanos(self.tuning.detector.gap_nanos))
    }

    /// The kick of an impact heard at `at`.
    fn kick(&self, at: Time, before_m_s: T, jump_m_s: T) -> Kick<T> {
        let tuning = &self.tuning;
        let in_mode_b = self.drive.mode() == Some(DriveMode::B);
        let threshold_m_s = self.detector.threshold_m_s();
        let bound_rad2_s2 = tuning.kick_per_jump_rad_m
            * tuning.kick_per_jump_rad_m
            * (jump_m_s * jump_m_s + threshold_m_s * threshold_m_s);
        let rise_m_s = before_m_s + jump_m_s * tuning.approach_per_jump;
        let (reach, unexplained) = if in_mode_b {
            (tuning.kick_per_jump_rad_m * jump_m_s, tuning.unexplained_b)
        } else {
            (T::zero(), tuning.unexplained)
        };
        Kick {
            at,
            towards_rad_s: tuning.turn_per_rise_rad_m * rise_m_s,
            reach_rad_s: reach,
            variance_rad2_s2: unexplained * bound_rad2_s2,
        }
    }

    /// Takes in what a sample tells that is not of a flight that goes on.
    #[inline(never)]
    fn take(&mut self, sample: &LdvSample, heard: Heard<T>) {
        match heard {
            Heard::Flight => (),
            Heard::Nothing => {
                if self.detector.newest().is_some_and(|newest| sample.taken_at <= newest) {
                    // The watch hears the vibrometer anew: what came before bore wrong times.
                    self.detector = ImpactDetector::new(self.tuning.detector);
                    while self.kicks.pop_back_if(|kick| kick.at >= sample.taken_at).is_some() {}
                    let Heard::Gap(seconds) = self.detector.observe(sample) else { return };
                    self.wander_through(sample.taken_at, seconds);
                }
            }
            Heard::Impact { before_m_s, jump_m_s } => {
                if !self.detector.inverted() {
                    self.keep(self.kick(sample.taken_at, before_m_s, jump_m_s));
                }
            }
            Heard::Gap(seconds) => self.wander_through(sample.taken_at, seconds),
        }
    }

    /// After a gap of `seconds` up to `at` the rate is as uncertain as if it had wandered.
    fn wander_through(&mut self, at: Time, seconds: T) {
        let intensity = self.tuning.constant_rate.wander.intensity_rad2_s3(self.watch.motion(at), false);
        self.keep(Kick {
            at,
            towards_rad_s: T::zero(),
            reach_rad_s: T::zero(),
            variance_rad2_s2: intensity * seconds,
        });
    }

    /// Keeps a kick. One that becomes known only after its frame has been fused acts right after it.
    fn keep(&mut self, mut kick: Kick<T>) {
        let Some(track) = self.tracker.track() else { return };
        kick.at = kick.at.max(track.state.at.plus_nanos(1));
        if let Some(oldest) = self.kicks.front().map(|kick| kick.at)
            && self.kicks.is_full()
        {
            // Written out, since the process borrows the kicks and the tracker is changed.
            let process = Kicked {
                tuning: &self.tuning,
                kicks: &self.kicks,
                motion: self.watch.motion(self.watch.clock()),
                heard_until: self.heard_until(),
            };
            self.tracker.shorten(oldest, &process);
            self.forget();
        }
        // Cannot be full any more.
        let _ = self.kicks.push_back(kick);
    }

    /// Drops the kicks that no frame can go back to.
    fn forget(&mut self) {
        let Some(at) = self.tracker.horizon() else { return };
        while self.kicks.front().is_some_and(|kick| kick.at <= at) {
            self.kicks.pop_front();
        }
    }
}

impl<T: Real> AngleFilter<T> for ImpactAided<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        self.drive = command;
        self.watch.drive(at, command);
    }

    #[inline]
    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<T>> {
        if self.watch.observe(sample) {
            let heard = self.detector.observe(sample);
            if heard != Heard::Flight {
                self.take(sample, heard);
            }
        }
        None
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        let clock = self.watch.clock();
        let motion = self.watch.motion(clock.max(frame.exposed_at));
        let process =
            Kicked { tuning: &self.tuning, kicks: &self.kicks, motion, heard_until: self.heard_until() };
        let moment = Moment { clock, quiet: motion == Motion::Quiet };
        let innovation = self.tracker.update(frame, moment, &process);
        self.forget();
        innovation
    }

    fn estimate(&self, now: Time) -> Option<Estimate<T>> {
        self.tracker.estimate(now, &self.process(now))
    }

    fn smoothed(&self, at: Time) -> Option<Estimate<T>> {
        self.tracker.smoothed(at, &self.process(self.watch.clock().max(at)))
    }

    fn health(&self, now: Time) -> Health {
        self.assess(now).1
    }

    #[inline]
    fn assess(&self, now: Time) -> (Option<Estimate<T>>, Health) {
        let silent = self.watch.silent(now).then_some(Reason::VibrometerSilent);
        let inverted = self.detector.inverted().then_some(Reason::VibrometerInverted);
        let estimate = self.estimate(now);
        let health = self.tracker.judge(estimate.as_ref(), now, silent.or(inverted));
        (estimate, health)
    }
}

#[cfg(test)]
mod tests;
