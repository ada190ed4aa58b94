//! The twin's filter: the vibrometer's impacts drive a model of the stator, which gives the rate's kicks; the camera
//! corrects angle, rate, friction and tooth factor.
//!
//! The bouncing rotor is chaotic: an error grows some hundred times an impact (the gain of its saltation matrix), so a
//! model that predicts its own impacts is useless after two. The vibrometer measures the jump of each impact, so none
//! is predicted:
//!
//! ```text
//! stator   driven by the coil and by the recoil of the measured jumps: stable, its errors decay with the modes
//! impact   of the pair of teeth that fits the gap and the approach at the jump, within the sample's period of 5 us
//! rate     kick = clamp(a S - rate, -f L, f L),   S = s' / R_t of that pair,   L = mu m_r R_t dv / J
//! ```
//!
//! There are two filters in a row, since the camera tells nothing of the stator:
//!
//! | filter | states | measurements | prediction and update |
//! |---|---|---|---|
//! | stator | 24, motion and parameters: [`states`] | gap and approach at each impact | [`stator`] and what it names |
//! | rotor | 4, angle, rate, friction `f`, tooth factor `a`: [`rotor`] | camera frames | [`process`], [`kick_record`] |
//!
//! The output of the first is a [`kick_record::KickRecord`] for each impact: an input of the second, with its variance.
//!
//! # One vibrometer sample
//!
//! 1. [`MotionWatch`] sets the clock and detects rest. It drops a sample that is not finite, too fast or no newer.
//! 2. If sample times ran back: new detector, kicks after that time dropped, stator rewound, its motion forgotten.
//! 3. [`ImpactDetector`] classifies the sample: flight, impact, fall, gap or rejected. A rejected one ends here.
//! 4. The stator's motion is predicted to the sample ([`motion_prediction`]); in flight only every fourth sample.
//! 5. If a fault of the vibrometer has ended: stator restarted with what was learnt before ([`learnt_parameters`]); one
//!    unknown kick for all impacts since the last frame.
//! 6. If an impact ends a flight of two samples or more: the jump of the impact before is refined ([`refinement`]).
//! 7. The event acts ([`vibrometer_sample`]):
//!    - rotor quiet: stator at rest, monitors reset;
//!    - flight: height integrated; after 0.1 ms the jump is refined;
//!    - impact: height integrated, then [`impact`]: regime; association of a pair; update, transition; kick kept;
//!    - fall, gap: an unknown kick is kept.
//! 8. If the newest kick was refined, the propagated track is renewed ([`kick_history`]).
//!
//! # One camera frame
//!
//! 1. The tracker predicts the track from the last frame to the exposure, through the kicks ([`process`]).
//! 2. Gate, then update of angle, rate, friction and tooth factor. A late frame is fused in its place.
//! 3. Kicks before the oldest frame kept are dropped.
//! 4. If the track moved, it is propagated again through the kicks since ([`process`]). An estimate starts there.
//!
//! # One impact
//!
//! ```text
//! vibrometer at fault?  ------------- yes -->  ignored
//! riding? (regime)  ----------------- yes -->  riding kick
//! stator_follows?  ------------------- no -->  unexplained kick
//! more than 31 us since a sample?  -- yes -->  unexplained kick, motion forgotten
//! a pair, or larger than noise?  ---- no -->  unassociated kick, of unknown sign
//! mean misfit > 15, or not sound?  -- yes -->  unexplained kick, stator restarted, on probation
//! associated with a pair?  ----------- no -->  unexplained kick
//! trusted, and its misfit < 40?  ----- no -->  unexplained kick, stator updated
//!                                     yes -->  explained kick, stator updated; refined by later samples
//! ```
//!
//! A kick is kept if kicks are taken ([`kick_use`]): without drive, or where impacts and frames agree with the model.
//! Else, and before the first frame has come, the rate wanders as by the camera alone.
//!
//! # Flags
//!
//! ```text
//!               falls instead of jumps:     VibrometerInverted      (until jumps prevail)
//!               a fall of 5 mm/s or more:   VibrometerErratic       (for 50 ms; 300 ms if again)
//!               fall in flight off by 25 %: VibrometerScale         (until the corrected one is within 15 %)
//!            .---------------------------------------------------------.
//! vibrometer sound                                                   fault: impacts ignored, the rate wanders
//!            '---------------------------------------------------------'
//!               no fault left: stator restarted; one unknown kick; trusted, but on probation after VibrometerErratic
//!
//!               mean misfit > 15, stator not sound, or innovations coloured: stator restarted
//!            .---------------------------------------------------------.
//! misfit     trusted                                                 on probation: ImpactsUnexplained
//!            '---------------------------------------------------------'
//!               16 impacts more and mean misfit < 6; or the rotor is quiet
//! ```
//!
//! | flag | becomes | when |
//! |---|---|---|
//! | regime | riding | the mean jump less drift is below 1.3 detector thresholds |
//! | | bouncing | it is above 1.5 (motion forgotten); the drive is off; the rotor is quiet |
//! | `stator_follows` | false | the drive is off, and a jump is below 10 mm/s: the weight of the rotor makes it |
//! | | true | the drive goes on (motion forgotten); the rotor is quiet |
//! | `kick_use` | not taken | the drive is on, and the misfit is on probation or the frames contradicted lately |
//! | | taken | the drive is off; trusted, and 50 ms or more since the frames contradicted |
//! | `newest_refined` | true | the newest kick was refined |
//! | | false | the track was propagated again |
//!
//! Health is the first of these that holds: `VibrometerSilent` (no sample for 1 ms), `VibrometerInverted`,
//! `VibrometerErratic`, `VibrometerScale`, `ImpactsUnexplained`; then those of the camera.
//!
//! Without samples for [`crate::ImpactDetectorTuning::gap_nanos`] the rate wanders as in [`crate::ConstantRate`], and
//! modes and height become unknown. Gate, restart, rest and the loss of either sensor are those of all filters.

mod association;
mod checked_motor;
mod contact_measurement;
mod covariance_prediction;
mod impact;
mod impact_update;
#[cfg(test)]
mod jacobians;
mod kick_history;
mod kick_record;
mod kick_use;
mod late_drive;
mod learnt_parameters;
mod measured_impact;
mod misfit_monitor;
mod modes_at;
mod motion_prediction;
mod oscillator;
mod process;
mod refinement;
mod regime;
mod restart;
mod retune;
mod rotor;
mod sensitivity;
mod states;
mod stator;
#[cfg_attr(not(feature = "tell"), path = "twin/untold.rs")]
mod told;
mod tooth;
mod tuning;
mod unexplained_kick;
mod vibrometer_sample;
mod walk_strength;

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::camera::tracker::{FrameContext, Tracker};
use crate::filter::{AngleFilter, Estimate, Health, Reason, ResonanceOffset};
use crate::filters::checkpoints::Checkpoints;
use crate::filters::kick_use::KickUse;
use crate::filters::mean_rate::MeanRates;
use crate::innovation::{ImpactInnovation, Innovation};
use crate::measurement::{CameraFrame, LdvSample};
use crate::vibrometer::impact_detector::{ImpactDetector, VibrometerEvent};
use crate::vibrometer::motion::{Motion, MotionWatch};
pub use checked_motor::CheckedMotor;
use kick_record::{KickRecord, KickRecords, RotorState};
use learnt_parameters::LearntCopies;
use measured_impact::{MeasuredImpact, Uncertain};
use misfit_monitor::MisfitMonitor;
use process::{PropagatedTrack, twin_process};
use regime::RegimeDetector;
use rotor::RotorCovariance;
use stator::StatorFilter;
use told::ToldPeriod;
#[cfg(feature = "tell")]
pub use told::{LEARNT, LEARNT_NAMES, Learnt, LearntPhase, ToldParts, TrueContact, TrueTooth, true_parts};
pub use tuning::TwinTuning;
use walk_strength::WalkStrength;

/// Angle and rate from the camera and from the kicks of a stator that the vibrometer's impacts drive: the filter
/// `twin`.
///
/// An extended Kalman filter of 24 states follows the stator. At each impact the gap between rotor and tooth and the
/// speed of approach, which follows from the jump and the restitution, correct its modes, the rotor's height and 13
/// parameters of the motor. It gives the tooth's tangential velocity and so the kick of the rate, with its variance. A
/// second filter of four states, angle, rate, friction and a factor of the tooth's velocity, takes the kicks as inputs
/// and the camera's frames as measurements. Both keep their covariances factorised ([`ud_filter::UdCovariance`]).
///
/// When impacts or frames contradict the model, its health says so ([`Reason::ImpactsUnexplained`]) and no kicks are
/// taken: it goes on with the camera alone, as [`crate::ConstantRate`] but with the strength of the walk that the
/// frames show, until sixteen impacts have been explained again. The head of the module has the states, the order of
/// work and the flags.
#[derive(Clone, Debug)]
pub struct TwinFilter<T: Real> {
    tuning: TwinTuning<T>,
    watch: MotionWatch<T>,
    detector: ImpactDetector<T>,
    /// Track of angle and rate at the last frame.
    tracker: Tracker<T, RotorCovariance<T>>,
    kicks: KickRecords<T>,
    kick_use: KickUse,
    mean_rates: MeanRates<T>,
    /// Strength of the walk while no kicks are taken.
    walk: WalkStrength<T>,
    /// The track after all kicks; `None` if there are none after the last frame.
    propagated: Option<PropagatedTrack<T>>,
    /// The track after the last frame, on its way through the kicks since; `propagated` is then that before the frame.
    renewed: Option<RotorState<T>>,
    checkpoints: Checkpoints<T, RotorCovariance<T>>,
    /// Whether the newest kick has been refined since it was last applied.
    newest_refined: bool,
    stator: StatorFilter<T>,
    misfit: MisfitMonitor<T>,
    learnt: LearntCopies<T>,
    regime: RegimeDetector<T>,
    /// Whether impacts update the stator: not those that the weight of a rotor without drive makes.
    stator_follows: bool,
    told: ToldPeriod<T>,
    drive: DriveCommand,
    /// Mode of the drive at the last kick kept.
    last_kick_mode: Option<DriveMode>,
    last_sample_m_s: T,
    /// The last impact's jump as first measured, in m/s, until it is refined.
    unrefined_jump: Option<Uncertain<T>>,
    /// `1 / R_t`.
    per_radius_m: T,
}

impl<T: Real> TwinFilter<T> {
    /// A filter without a measurement, for `motor`; the tuning is that of the same parameters.
    #[inline]
    pub fn new(motor: &CheckedMotor<T>, tuning: &TwinTuning<T>) -> Self {
        Self {
            tuning: *tuning,
            watch: MotionWatch::new(&tuning.without_stator.constant_rate.rest),
            detector: ImpactDetector::new(tuning.detector),
            tracker: Tracker::new(tuning.without_stator.constant_rate.track),
            kicks: KickRecords::new(),
            kick_use: KickUse::new(),
            mean_rates: MeanRates::new(),
            walk: WalkStrength::expected(),
            propagated: None,
            renewed: None,
            checkpoints: Checkpoints::none(),
            newest_refined: false,
            stator: StatorFilter::at_rest(motor, tuning),
            misfit: MisfitMonitor::trusted(),
            learnt: LearntCopies::default(),
            regime: RegimeDetector::new(),
            stator_follows: true,
            told: ToldPeriod::default(),
            drive: DriveCommand::OFF,
            last_kick_mode: None,
            last_sample_m_s: T::zero(),
            unrefined_jump: None,
            per_radius_m: T::from_f64(1.0 / motor.tooth_radius_m),
        }
    }

    /// Uses the noise of the vibrometer that was learnt at rest.
    #[cold]
    fn use_learnt_noise(&mut self) {
        self.tuning.without_stator = self.tuning.without_stator.with_noise(self.watch.noise_m_s());
        self.tuning.detector.noise_m_s = self.watch.noise_m_s();
        self.detector.set_noise(self.tuning.detector.noise_m_s);
        self.stator.height_noise_m2_s = stator::height_noise_m2_s(&self.tuning);
    }

    /// Starts again at a sample whose time is not after the newest: the times before were wrong.
    fn resume_at(&mut self, taken_at: Time) {
        self.detector.start_again();
        self.kick_use.rewind(taken_at);
        while self.kicks.pop_back_if(|kick| kick.at >= taken_at).is_some() {}
        self.propagate();
        self.stator.rewind(taken_at);
        self.stator.forget_motion();
        self.unrefined_jump = None;
    }
}

impl<T: Real> AngleFilter<T> for TwinFilter<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        if command != self.drive {
            self.stator.advance(at, self.drive);
        }
        if !self.stator_follows && command.mode().is_some() {
            self.stator.forget_motion();
            self.stator_follows = true;
        }
        self.drive = command;
        if self.tuning.without_stator.constant_rate.random_walk.returns_to_mean {
            self.mean_rates.note_drive(at, command);
        }
        self.watch.drive(at, command);
        self.review_kick_use(at);
        if command.mode().is_some() {
            self.tracker.end_rest();
        }
    }

    fn retune(&mut self, offsets: &[ResonanceOffset<T>; 2]) {
        self.retune_stator(offsets);
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<T>> {
        if !self.watch.observe(sample) {
            return None;
        }
        let sample = &self.detector.scaled(&self.watch.corrected(sample));
        if self.detector.newest.is_some_and(|newest| sample.taken_at <= newest) {
            self.resume_at(sample.taken_at);
        }
        let newest = self.detector.newest;
        let since_s: T = newest.map_or(T::zero(), |newest| sample.taken_at.seconds_since(newest));
        let (flight, had_fault, was_erratic) =
            (self.detector.flight, self.detector.has_fault(), self.detector.erratic_until.is_some());
        let event = self.detector.observe(sample);
        if event == VibrometerEvent::Rejected {
            return None;
        }
        // In flight the stator is needed only to refine the last jump.
        if event == VibrometerEvent::Flight && self.unrefined_jump.is_none() {
            self.stator.advance_by_sensitivity_steps(sample.taken_at, self.drive);
        } else {
            self.stator.advance(sample.taken_at, self.drive);
        }
        if had_fault && !self.detector.has_fault() {
            // Impacts before the fault was detected have led to wrong estimates, and so has the height.
            self.restart_stator_after_fault();
            if !was_erratic {
                self.misfit = MisfitMonitor::trusted();
            }
            self.kick_use.forgive();
            self.resume_detection();
        }
        if let (VibrometerEvent::Impact { .. }, Some(first)) = (event, self.unrefined_jump)
            && flight.samples > T::one()
        {
            self.refine_jump(first, &flight);
        }
        #[cfg(feature = "tell")]
        self.begin_told_period(sample.taken_at, event);
        let innovation = self.act_on(sample, event, &flight, since_s);
        #[cfg(feature = "tell")]
        self.end_told_period(sample.taken_at);
        self.reapply_newest_kick();
        if self.renewed.is_some() {
            self.go_on();
        }
        innovation
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        let clock = self.watch.clock();
        let process = twin_process!(self, clock.max(frame.exposed_at), None);
        let motion = process.motions.throughout(self.tracker.newest_at().min(frame.exposed_at));
        let context = FrameContext {
            clock,
            quiet: motion == Motion::Quiet,
            disputed: self.watch.disputes_quiet(clock),
        };
        let before = self.tracker.place();
        let innovation = self.tracker.update(frame, context, &process);
        if let Some((square, share)) = self.tracker.take_neighbours().filter(|_| !self.kick_use.taken) {
            self.walk.learn(motion, square, share);
        }
        self.watch.note_rest(self.tracker.is_resting(), self.tracker.newest_at(), clock);
        if self.tuning.without_stator.constant_rate.random_walk.returns_to_mean {
            let begun = self.watch.motions(clock).piece(clock).begun;
            let mode = self.drive.mode().filter(|_| !self.kick_use.taken);
            self.mean_rates.note_frame(&innovation, mode, begun);
        }
        if self.watch.noise_m_s() != self.tuning.detector.noise_m_s {
            self.use_learnt_noise();
        }
        self.drop_old_kicks();
        self.review_kick_use(clock);
        if self.tracker.place() != before {
            self.renew();
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
        let unexplained =
            (!self.kick_use.taken || !self.misfit.is_trusted()).then_some(Reason::ImpactsUnexplained);
        let estimate = self.estimate(instant);
        let vibrometer = silent.or(self.detector.fault).or(unexplained);
        let health = self.tracker.judge(estimate.as_ref(), now, vibrometer);
        (estimate, health)
    }
}

#[cfg(test)]
mod tests;
