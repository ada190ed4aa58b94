//! The twin's filter: the vibrometer drives the twin through each impact, and the camera corrects what the twin cannot know.
//!
//! The bouncing rotor is chaotic: an error grows some hundred times an impact ([`motor_model::Saltation`]), so a twin that runs on its
//! own through impacts knows nothing after two. The vibrometer sees each impact's normal impulse, and so the twin is never asked for one:
//!
//! ```text
//! stator   driven by the coil, struck back by the measured impulses: stable, its errors die out with the modes
//! impact   the pair whose tooth is where the rotor is (gap) and approaches as the jump tells; its instant within the 5 us of a sample's period
//! rate     kicked by clamp(a S - rate, -f L, f L),   S = s' / R_t of that pair,   L = mu m_r R_t dv / J
//! ```
//!
//! Two filters in a row, since the camera tells nothing of the stator. The first has the stator's 24 errors: six of the modes, the height, three of the impact at
//! hand, 13 of the motor's parameters and the drive's phase, which gap and approach of hundreds of impacts a second soon tell. The second has angle, rate, and the scales `f`
//! of friction and `a` of the teeth's reach.
//!
//! A jump is better known ten samples later, and the tooth's velocity after the next impact: the strike, which waits for its frame, is amended.
//!
//! The strikes since the oldest frame kept are kept, up to [`crate::IMPACTS_KEPT_MAX`], as [`crate::ImpactAided`] keeps its kicks; so are gate, new start, rest and the
//! loss of either sensor that of all filters. Without samples for [`crate::ImpactDetectorTuning::gap_nanos`] the rate wanders as in [`crate::ConstantRate`], and
//! modes and height become unknown.

mod amendment;
mod belief;
mod conditions;
mod contact;
mod driven;
mod hearing;
mod oscillator;
mod passage;
mod ride;
mod shape;
mod stator;
mod trust;
mod tuning;
mod unexplained;

use motor_model::{DriveCommand, DriveMode, MotorParams, OutOfBounds, Parameter, Real, Time};

use crate::camera::tracker::{FrameContext, Tracker};
use crate::filter::{AngleFilter, Estimate, Health, Reason};
use crate::filters::impact_aided::ImpactAidedTuning;
use crate::innovation::Innovation;
use crate::measurement::{CameraFrame, LdvSample};
use crate::vibrometer::impact_detector::{Heard, ImpactDetector};
use crate::vibrometer::motion::{Motion, MotionWatch};
use belief::ScaledBelief;
use contact::{Blow, Known, Struck};
use driven::{Ahead, Driven, Strike, Strikes};
use ride::Ride;
use stator::StatorBelief;
use trust::Trust;
pub use tuning::{ContactTuning, Tolerance, TwinTuning};

/// A longer time without samples, in s, hides the pair that struck, and where: a quarter of mode A's period.
const LONGEST_BLOW_S: f64 = 31e-6;

/// What has been heard of the rotor since it lay quiet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Course {
    /// No impact yet.
    Launching,
    /// One at least.
    Launched,
}

/// The filter.
#[derive(Clone, Debug)]
pub struct TwinFilter<T: Real> {
    tuning: TwinTuning<T>,
    watch: MotionWatch<T>,
    detector: ImpactDetector<T>,
    tracker: Tracker<T, ScaledBelief<T>>,
    strikes: Strikes<T>,
    ahead: Option<Ahead<T>>,
    /// Whether the newest strike has become better known since it was last passed.
    stale: bool,
    stator: StatorBelief<T>,
    trust: Trust<T>,
    ride: Ride<T>,
    /// Whether the stator has been told of all impacts: not of those of a rotor that lands.
    followed: bool,
    course: Course,
    /// Whether the drive has ever been on: before that the rotor lies on a stator that rests.
    driven: bool,
    /// What is known of a kick without the stator.
    aided: ImpactAidedTuning<T>,
    drive: DriveCommand,
    /// The mode of the last strike kept.
    struck_in: Option<DriveMode>,
    /// The newest sample.
    seen_m_s: T,
    /// The last impact's jump as first seen, as long as it can be refined.
    raw_jump_m_s: Option<T>,
    /// `mu m_r R_t / J`, in rad/s per m/s.
    limit_per_jump_rad_m: T,
    per_radius_m: T,
}

impl<T: Real> TwinFilter<T> {
    /// A filter that has seen nothing and believes the motor's parameters to be these, within its tuning's tolerances.
    ///
    /// # Errors
    /// When the model refuses the parameters.
    pub fn try_new(params: &MotorParams, tuning: &TwinTuning<T>) -> Result<Self, OutOfBounds> {
        let radius = params.get(Parameter::ToothRadius);
        let limit = params.get(Parameter::Friction) * params.get(Parameter::RotorMass) * radius
            / params.get(Parameter::RotorInertia);
        let stator = StatorBelief::try_new(params, tuning)?;
        Ok(Self {
            tuning: *tuning,
            watch: MotionWatch::new(&tuning.constant_rate.rest),
            detector: ImpactDetector::new(tuning.detector),
            tracker: Tracker::new(tuning.constant_rate.track),
            strikes: Strikes::new(),
            ahead: None,
            stale: false,
            stator,
            trust: Trust::new(),
            ride: Ride::new(),
            followed: true,
            driven: false,
            course: Course::Launching,
            aided: ImpactAidedTuning::new(params),
            drive: DriveCommand::OFF,
            struck_in: None,
            seen_m_s: T::zero(),
            raw_jump_m_s: None,
            limit_per_jump_rad_m: T::from_f64(limit),
            per_radius_m: T::from_f64(1.0 / radius),
        })
    }

    /// Friction, and the teeth's tangential velocity, per what the parameters say; `None` before the first frame.
    pub fn scales(&self) -> Option<[T; 2]> {
        self.tracker.track().map(|track| [track.state.covariance.friction, track.state.covariance.reach])
    }

    fn process(&self, motion: Motion) -> Driven<'_, T> {
        Driven {
            tuning: &self.tuning,
            strikes: &self.strikes,
            motion,
            heard_until: self.heard_until(),
            between_rad2_s3: self.between_rad2_s3(),
            ahead: self.ahead.as_ref(),
        }
    }

    /// Goes through the strikes since the last frame: the track has moved.
    #[inline(never)]
    fn look_ahead(&mut self) {
        (self.ahead, self.stale) = (None, false);
        let process = self.process(self.watch.motion(self.watch.clock()));
        let ahead = self.tracker.track().and_then(|track| Ahead::of(&track.state, track.resting, &process));
        self.ahead = ahead;
    }

    /// Goes through the newest strike again, if it has become better known.
    fn pass_amended(&mut self) {
        if core::mem::take(&mut self.stale)
            && let Some(ahead) = self.ahead
        {
            let process = self.process(self.watch.motion(self.watch.clock()));
            self.ahead = Some(ahead.after_newest(&process));
        }
    }

    /// Until when impacts would have been heard: never, by a vibrometer whose sign or scale is wrong.
    fn heard_until(&self) -> Time {
        let newest = self.detector.newest().filter(|_| !self.detector.is_wrong());
        newest.map_or(Time::ZERO, |newest| newest.plus_nanos(self.tuning.detector.gap_nanos))
    }

    /// Process noise between impacts: none but of a rotor that the stator begins to move, whose first impacts are not heard.
    fn between_rad2_s3(&self) -> T {
        match self.course {
            Course::Launching => self.tuning.launching_rad2_s3,
            Course::Launched => T::zero(),
        }
    }

    /// Noise variance of a vibrometer sample.
    fn sample_m2_s2(&self) -> T {
        self.tuning.detector.noise_m_s * self.tuning.detector.noise_m_s
    }

    /// The rotor was struck within the period that ends at `at`.
    #[inline(never)]
    fn strike(&mut self, at: Time, blow: &Blow<T>) {
        self.raw_jump_m_s = None;
        if self.detector.is_wrong() {
            return;
        }
        let before = core::mem::replace(&mut self.course, Course::Launched);
        if self.rides(blow) {
            return self.keep(self.ridden(at, blow));
        }
        self.followed &=
            !self.driven || self.drive.mode().is_some() || blow.jump_m_s > self.tuning.contact.landing_m_s;
        if !self.followed {
            return self.keep(self.unexplained(at, blow));
        }
        if blow.within_s > T::from_f64(LONGEST_BLOW_S) {
            self.rise_midway(blow);
            self.stator.forget_motion();
            return self.keep(self.unexplained(at, blow));
        }
        let explained = self.stator.strike(blow, &self.tuning);
        let lost = explained.as_ref().is_ok_and(|struck| self.trust.note(struck.misfit));
        if lost || !self.stator.is_sound() {
            self.lose_stator();
            return self.keep(self.unexplained(at, blow));
        }
        let struck = match explained {
            Ok(struck) => struck,
            Err(unfit) => {
                self.rise_midway(blow);
                return self.keep(self.doubted(at, blow, unfit));
            }
        };
        self.amend(struck.earlier);
        self.raw_jump_m_s = Some(blow.jump_m_s);
        let clear = self.trust.explains(struck.misfit);
        let mut strike = if clear { self.strike_of(at, &struck) } else { self.unexplained(at, blow) };
        if before == Course::Launching {
            let threshold_rad_s = self.limit_per_jump_rad_m * self.detector.threshold_m_s();
            strike.unknown_rad2_s2 += threshold_rad_s * threshold_rad_s;
        }
        self.keep(strike);
    }

    /// An impact that is not explained: the rotor rises by half of the time since the last sample.
    fn rise_midway(&mut self, blow: &Blow<T>) {
        self.stator.height_m += T::from_f64(0.5) * blow.within_s * blow.jump_m_s;
    }

    /// The strike of an impact explained.
    fn strike_of(&self, at: Time, struck: &Struck<T>) -> Strike<T> {
        let (c, s) = (self.limit_per_jump_rad_m, self.per_radius_m);
        let Struck { back: back_s, jump: jump_m_s, tooth: tooth_m_s, .. } = *struck;
        let back_nanos = (back_s.value * T::from_f64(1e9)).whole();
        Strike {
            at: Time::from_nanos(at.nanos().saturating_add_signed(-i64::from(back_nanos))),
            at_s2: back_s.variance,
            limit_rad_s: Known { value: c * jump_m_s.value, variance: c * c * jump_m_s.variance },
            tooth_rad_s: Known {
                value: s * tooth_m_s.value,
                variance: s * s * tooth_m_s.variance * self.trust.scale(),
            },
            unknown_rad2_s2: self.unheard_rad2_s2(),
            amendable: true,
            in_other_mode: false,
        }
    }

    /// Variance of the kicks by impacts below the detector's threshold. Where those are many, as under a rotor that hops on a weakly driven stator, the ones
    /// heard fit the model badly: it is that misfit that tells.
    fn unheard_rad2_s2(&self) -> T {
        let threshold_rad_s = self.limit_per_jump_rad_m * self.detector.threshold_m_s();
        self.tuning.chatter_rad2_s2
            + self.tuning.unheard_part2 * (self.trust.scale() - T::one()) * threshold_rad_s * threshold_rad_s
    }

    /// Begins the stator anew: its numbers are none.
    fn lose_stator(&mut self) {
        self.stator.begin_anew();
        self.trust = Trust::lost();
        self.raw_jump_m_s = None;
    }

    /// Keeps a strike. One that becomes known only after its frame has been fused acts right after it.
    #[inline(never)]
    fn keep(&mut self, mut strike: Strike<T>) {
        self.pass_amended();
        let Some(track) = self.tracker.track() else { return };
        strike.at = strike.at.max(track.state.at.plus_nanos(1));
        if let Some(mode) = self.drive.mode() {
            strike.in_other_mode = self.struck_in.replace(mode).is_some_and(|before| before != mode);
        }
        if let Some(oldest) = self.strikes.front().map(|strike| strike.at)
            && self.strikes.is_full()
        {
            // Written out, since the process borrows the strikes and the tracker is changed.
            let process = Driven {
                tuning: &self.tuning,
                strikes: &self.strikes,
                motion: self.watch.motion(self.watch.clock()),
                heard_until: self.heard_until(),
                between_rad2_s3: self.between_rad2_s3(),
                ahead: None,
            };
            self.tracker.advance_to(oldest, &process);
            self.forget();
            if let (Some(ahead), Some(track)) = (&mut self.ahead, self.tracker.track()) {
                ahead.from = track.state.at;
            }
        }
        // Cannot be full any more.
        let _ = self.strikes.push_back(strike);
        let Some(ahead) = self.ahead else { return self.look_ahead() };
        let process = self.process(self.watch.motion(self.watch.clock()));
        self.ahead = Some(ahead.extended(&process));
    }

    /// Drops the strikes that no frame can go back to.
    fn forget(&mut self) {
        let Some(at) = self.tracker.horizon() else { return };
        while self.strikes.front().is_some_and(|strike| strike.at <= at) {
            self.strikes.pop_front();
        }
    }
}

impl<T: Real> AngleFilter<T> for TwinFilter<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        if command != self.drive {
            self.stator.advance(at, self.drive);
        }
        if !self.followed && command.mode().is_some() {
            self.stator.forget_motion();
            self.followed = true;
        }
        self.driven |= command.mode().is_some();
        self.drive = command;
        self.watch.drive(at, command);
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<T>> {
        if !self.watch.observe(sample) {
            return None;
        }
        if self.detector.newest().is_some_and(|newest| sample.taken_at <= newest) {
            // The watch hears the vibrometer anew: what came before bore wrong times.
            self.detector = ImpactDetector::new(self.tuning.detector);
            while self.strikes.pop_back_if(|strike| strike.at >= sample.taken_at).is_some() {}
            self.look_ahead();
            self.stator.rewind(sample.taken_at);
            self.stator.forget_motion();
            self.raw_jump_m_s = None;
        }
        let newest = self.detector.newest();
        let since_s: T = newest.map_or(T::zero(), |newest| sample.taken_at.seconds_since(newest));
        let before = self.detector;
        let heard = self.detector.observe(sample);
        if heard == Heard::Nothing {
            return None;
        }
        // In flight nobody asks for the stator, unless to take the last jump in.
        if heard == Heard::Flight && self.raw_jump_m_s.is_none() {
            self.stator.follow(sample.taken_at, self.drive);
        } else {
            self.stator.advance(sample.taken_at, self.drive);
        }
        if before.is_wrong() && !self.detector.is_wrong() {
            // What the impacts taught before sign or scale were known to be wrong is wrong, and so is the height.
            self.lose_stator();
            if !before.erratic() {
                self.trust = Trust::new();
            }
            self.hear_again();
        }
        if let (Heard::Impact { .. }, Some(raw_m_s)) = (heard, self.raw_jump_m_s) {
            let (moved_m_s, samples) = before.since_impact();
            if samples > T::one() {
                self.refine(raw_m_s, moved_m_s, samples);
            }
        }
        self.hear(sample, heard, &before, since_s);
        self.pass_amended();
        None
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        let clock = self.watch.clock();
        let motion = self.watch.motion(clock.max(frame.exposed_at));
        let process = Driven {
            tuning: &self.tuning,
            strikes: &self.strikes,
            motion,
            heard_until: self.heard_until(),
            between_rad2_s3: self.between_rad2_s3(),
            ahead: None,
        };
        let moment = FrameContext { clock, quiet: motion == Motion::Quiet };
        let before = self.tracker.place();
        let innovation = self.tracker.update(frame, moment, &process);
        self.forget();
        if self.tracker.place() != before {
            self.look_ahead();
        }
        innovation
    }

    fn estimate(&self, now: Time) -> Option<Estimate<T>> {
        self.tracker.estimate(now, &self.process(self.watch.motion(now)))
    }

    fn health(&self, now: Time) -> Health {
        self.assess(now).1
    }

    fn assess(&self, now: Time) -> (Option<Estimate<T>>, Health) {
        let silent = self.watch.silent(now).then_some(Reason::VibrometerSilent);
        let unexplained = (!self.trust.is_given()).then_some(Reason::ImpactsUnexplained);
        let estimate = self.estimate(now);
        let vibrometer = silent.or_else(|| self.detector.fault()).or(unexplained);
        let health = self.tracker.judge(estimate.as_ref(), now, vibrometer);
        (estimate, health)
    }
}

#[cfg(test)]
mod tests;
