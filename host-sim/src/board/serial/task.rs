//! What is asked of a board, and what is seen of it: a move, a rate, or the experiments that commission its motor.
//!
//! The mean of a rate is the turn from the first to the last report in which the rotor follows, over the time between
//! them, without the first [`SETTLE_S`]:
//!
//! ```text
//! mean rate = (angle_last - angle_first) / (t_last - t_first)          mean error = (mean rate - asked) / |asked|
//! ```
//!
//! Its error is that of the two angles over the time between them.

use link::{BoardMessage, HostMessage, PhaseRecord, RatePhase};
use motor_model::{Angle, Time};

use super::commissioned::WatchedCommissioning;
use super::next_step::NextStep;
use super::outcome::{RateFigures, TaskFigures};
use super::progress::Goal;
use super::report_record::Reported;
use super::watched_move::WatchedMove;
use crate::board::BoardError;
use crate::board::pil::{commission_preparation, preparation, rate_preparation};
use simulation::runs::rate::{CANNOT_KEEP_UP, KeepingUp, PromisedRange, SETTLE_S, reason};
use simulation::runs::record::{Task, Truth};
use simulation::scene::{Scene, SceneError};

/// What is asked of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardTask {
    /// The move of a scene.
    Move,
    /// The rate of a scene, from the start to its end.
    Rate,
    /// The experiments that commission the motor, with the scene's map as the prior.
    Commission,
}

impl BoardTask {
    /// What the board is told before it is armed.
    ///
    /// # Errors
    /// When the scene's map is for another design.
    pub(super) fn preparation(self, scene: &Scene) -> Result<Vec<HostMessage>, BoardError> {
        match self {
            Self::Move => preparation(scene),
            Self::Rate => rate_preparation(scene),
            Self::Commission => commission_preparation(scene),
        }
    }

    /// The camera's angle from which the board is to count; `None` where it is not asked to, since experiments have no
    /// target.
    pub(crate) fn zero(self, scene: &Scene) -> Option<Angle> {
        match self {
            Self::Move | Self::Rate => Some(Angle::from_degrees(scene.number("run.zero_deg"))),
            Self::Commission => None,
        }
    }

    /// What is to be seen of it.
    ///
    /// # Errors
    /// When the scene's map is for another design.
    pub(super) fn watched(self, scene: &Scene) -> Result<WatchedTask, BoardError> {
        Ok(match self {
            Self::Move => WatchedTask::Move(WatchedMove::new(scene)),
            Self::Rate => WatchedTask::Rate(WatchedRate::new(scene)?),
            Self::Commission => WatchedTask::Commission(Box::new(WatchedCommissioning::new(scene)?)),
        })
    }
}

/// What has been seen of a task.
#[derive(Debug)]
pub(super) enum WatchedTask {
    Move(WatchedMove),
    Rate(WatchedRate),
    Commission(Box<WatchedCommissioning>),
}

impl WatchedTask {
    /// The same, of a move with `steps` after it.
    pub(super) fn followed_by(self, steps: &[NextStep]) -> Self {
        match self {
            Self::Move(watched) => Self::Move(watched.followed_by(steps)),
            other => other,
        }
    }

    /// Takes a report at `at` since arming, and the truth beside it; whether the task is over with it.
    pub(super) fn take(&mut self, at: Time, reported: &Reported, truth: Option<Truth>) -> bool {
        match self {
            Self::Move(watched) => watched.take(at, reported, truth),
            Self::Rate(watched) => watched.take(at, reported, truth),
            Self::Commission(watched) => watched.take(at, reported),
        }
    }

    /// Takes an answer of the board that is none to what the run itself asks.
    pub(super) fn take_answer(&mut self, answer: &BoardMessage) {
        match self {
            Self::Move(watched) => watched.take_answer(answer),
            Self::Rate(_) => {}
            Self::Commission(watched) => watched.take_answer(answer),
        }
    }

    /// The board counts angles from a zero that is `by` farther.
    pub(super) fn zeroed(&mut self, by: Angle) {
        if let Self::Move(watched) = self {
            watched.zeroed(by);
        }
    }

    /// What the board is to be told now, at `now` of the host's clock, if anything is.
    pub(super) fn due(&mut self, now: i64) -> Option<HostMessage> {
        match self {
            Self::Move(watched) => watched.due(now),
            Self::Rate(_) => None,
            Self::Commission(watched) => watched.due(now),
        }
    }

    /// Whether the board learns of its motor meanwhile.
    pub(super) fn learns(&self) -> bool {
        matches!(self, Self::Move(_))
    }

    pub(super) fn goal(&self) -> Goal {
        match self {
            Self::Move(watched) => Goal::Angle { target_deg: watched.target_deg() },
            Self::Rate(watched) => Goal::Rate { rate_deg_s: watched.rate_deg_s },
            Self::Commission(watched) => Goal::Map { experiments: watched.experiments() },
        }
    }

    /// The figures, after the last report and the truth beside it.
    pub(super) fn figures(&self, last: Option<&Reported>, truth: Option<Truth>) -> TaskFigures {
        match self {
            Self::Move(watched) => TaskFigures::Move(watched.figures(last, truth)),
            Self::Rate(watched) => TaskFigures::Rate(watched.figures()),
            Self::Commission(watched) => TaskFigures::Commission(Box::new(watched.figures())),
        }
    }
}

/// A report in which the rotor follows.
#[derive(Clone, Copy, Debug)]
struct Followed {
    at: Time,
    estimated: Angle,
    truth: Option<Angle>,
}

/// What has been seen of a rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedRate {
    promised: PromisedRange,
    rate_deg_s: f64,
    asked_s: f64,
    first: Option<Followed>,
    last: Option<Followed>,
    is_following: bool,
    losses: u32,
    /// When the board said that it has held the rate to the end, in s.
    over_s: Option<f64>,
    stopped: Option<(controller::rate::RateStop, f64)>,
    keeping_up: KeepingUp,
}

impl WatchedRate {
    /// Nothing yet of the rate of `scene`.
    fn new(scene: &Scene) -> Result<Self, SceneError> {
        Ok(Self {
            promised: PromisedRange::of(scene)?,
            rate_deg_s: scene.number("rate.deg_s"),
            asked_s: scene.number("rate.duration_s"),
            first: None,
            last: None,
            is_following: false,
            losses: 0,
            over_s: None,
            stopped: None,
            keeping_up: KeepingUp::new(scene),
        })
    }

    fn take(&mut self, at: Time, reported: &Reported, truth: Option<Truth>) -> bool {
        let at_s = at.seconds_since(Time::ZERO);
        let follows = reported.phase == PhaseRecord::Rate(RatePhase::Following);
        if let (Task::Rate { wanted_rad_s, reference, .. }, Some(estimate)) =
            (reported.task, reported.estimate)
        {
            self.keeping_up.take(at, wanted_rad_s, reference, estimate.angle);
        }
        match (reported.phase, reported.estimate) {
            (PhaseRecord::Rate(RatePhase::Following), Some(estimate)) if at_s >= SETTLE_S => {
                let followed =
                    Followed { at, estimated: estimate.angle, truth: truth.map(|truth| truth.angle) };
                self.first.get_or_insert(followed);
                self.last = Some(followed);
            }
            (PhaseRecord::Rate(RatePhase::Waiting), _) => self.losses += u32::from(self.is_following),
            (PhaseRecord::Rate(RatePhase::Over), _) => {
                self.over_s.get_or_insert(at_s);
            }
            (PhaseRecord::Rate(RatePhase::Stopped(why)), _) => {
                self.stopped.get_or_insert((why, at_s));
            }
            _ => {}
        }
        self.is_following = follows;
        self.over_s.is_some() || self.stopped.is_some()
    }

    fn figures(&self) -> RateFigures {
        let Self { rate_deg_s, asked_s, losses, .. } = *self;
        let over = self.first.zip(self.last).map(|(first, last)| {
            let measured_s: f64 = last.at.seconds_since(first.at);
            (first, last, measured_s)
        });
        let over = over.filter(|(_, _, measured_s)| *measured_s > 0.0);
        let mean = |from: Angle, to: Angle, measured_s: f64| to.minus(from).degrees() / measured_s;
        let mean_deg_s = over.map(|(first, last, s)| mean(first.estimated, last.estimated, s));
        let true_mean_deg_s =
            over.and_then(|(first, last, s)| first.truth.zip(last.truth).map(|(from, to)| mean(from, to, s)));
        let reached_deg_s = self.keeping_up.reached_deg_s().filter(|_| self.stopped.is_none());
        RateFigures {
            rate_deg_s,
            asked_s,
            measured_s: over.map(|(_, _, measured_s)| measured_s),
            mean_deg_s,
            true_mean_deg_s,
            mean_error_percent: true_mean_deg_s
                .filter(|_| rate_deg_s.abs() > 0.0)
                .map(|mean| 100.0 * (mean - rate_deg_s) / rate_deg_s),
            reference_losses: losses,
            stopped: self.stopped.map(|(why, _)| format!("{why:?}")),
            reason: self
                .stopped
                .map(|(why, _)| reason(why))
                .or_else(|| reached_deg_s.map(|_| CANNOT_KEEP_UP)),
            reached_deg_s,
            stopped_s: self.stopped.map(|(_, at_s)| at_s),
            promised_reach: self.promised,
            // Not by the board's word alone: it tells the end in a tick after it, so an end in time is not too early.
            ok: self.stopped.is_none() && self.over_s.is_some_and(|over_s| over_s >= asked_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use controller::RateReport;
    use controller::rate::RateStop;
    use estimator::{Estimate, Health};
    use link::TickRecord;
    use motor_model::DriveCommand;

    use super::*;

    /// The report of a board at `at` whose rotor has turned by `deg`, and is to turn unless `stopped`.
    fn reported(at: Time, deg: f64, follows: bool, stopped: Option<RateStop>) -> Reported {
        let angle = Angle::from_degrees(deg);
        let estimate = Estimate {
            at,
            angle,
            rate_rad_s: 1.0,
            angle_rad2: 1e-9,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 1.0,
            resting: false,
        };
        let report = RateReport {
            estimate: Some(estimate),
            health: Health::Good,
            camera: None,
            command: DriveCommand::OFF,
            applied: DriveCommand::OFF,
            wanted_rad_s: 1.0,
            reference: follows.then_some(angle),
            since: at,
            stopped,
        };
        Reported::of(&TickRecord::from(&report)).unwrap()
    }

    /// 100 deg/s by the estimate and 99 in truth, over what follows after settling. A loss in between is counted, and
    /// the stop ends it.
    #[test]
    fn exact_the_mean_is_over_what_follows_after_settling() {
        let sets = ["rate.deg_s=100".to_owned(), "rate.duration_s=2".to_owned()];
        let mut watched = BoardTask::Rate.watched(&Scene::of_sets(&sets).unwrap()).unwrap();
        let truth = |deg| Some(Truth { angle: Angle::from_degrees(deg), ..Truth::default() });
        for ms in 0..1000_u64 {
            let at = Time::from_nanos(ms * 1_000_000);
            let s: f64 = at.seconds_since(Time::ZERO);
            // Thrown to somewhere else before it has settled.
            let deg = if ms < 250 { 40.0 } else { 100.0 * s };
            let report = reported(at, deg, !(500..510).contains(&ms), None);
            assert!(!watched.take(at, &report, truth(0.99 * deg)));
        }
        let at = Time::from_nanos(1_000_000_000);
        assert!(watched.take(at, &reported(at, 0.0, true, Some(RateStop::WrongWay)), truth(0.0)));
        let TaskFigures::Rate(figures) = watched.figures(None, None) else { panic!("a rate") };
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-4;
        assert!(near(figures.measured_s, 0.749) && near(figures.mean_deg_s, 100.0), "{figures:?}");
        assert!(near(figures.true_mean_deg_s, 99.0) && near(figures.mean_error_percent, -1.0), "{figures:?}");
        assert_eq!(
            (figures.reference_losses, figures.stopped.as_deref(), figures.ok),
            (1, Some("WrongWay"), false)
        );
        assert!(near(figures.stopped_s, 1.0), "{figures:?}");
    }

    /// A board that says that it is over is believed when it has held for as long as was asked.
    #[test]
    fn exact_a_rate_that_ends_early_is_not_held() {
        let sets = ["rate.deg_s=100".to_owned(), "rate.duration_s=2".to_owned()];
        for (ms, ok) in [(1_000, false), (1_999, false), (2_000, true), (2_001, true)] {
            let mut watched = BoardTask::Rate.watched(&Scene::of_sets(&sets).unwrap()).unwrap();
            let at = Time::from_nanos(ms * 1_000_000);
            let following = reported(at, 1.0, true, None);
            assert!(!watched.take(at, &following, None));
            let over = Reported { phase: PhaseRecord::Rate(RatePhase::Over), ..following };
            assert!(watched.take(at, &over, None));
            let TaskFigures::Rate(figures) = watched.figures(None, None) else { panic!("a rate") };
            assert_eq!(figures.ok, ok, "{ms}");
        }
    }

    /// A rotor that is 5 degrees behind and turns at 90 deg/s for 100 is told with its rate; one at 100 is not.
    #[test]
    fn exact_a_board_whose_motor_cannot_keep_up_is_told() {
        for (turns_deg_s, told) in [(90.0, Some(90.0)), (100.0, None)] {
            let sets = ["rate.deg_s=100".to_owned(), "rate.duration_s=2".to_owned()];
            let mut watched = BoardTask::Rate.watched(&Scene::of_sets(&sets).unwrap()).unwrap();
            for ms in 0..1500_u32 {
                let (at, s) = (Time::from_nanos(u64::from(ms) * 1_000_000), 1e-3 * f64::from(ms));
                let reference = Some(Angle::from_degrees(5.0 + 100.0 * s));
                let task = Task::Rate { wanted_rad_s: 1.745, reference, stopped: None };
                watched.take(at, &Reported { task, ..reported(at, turns_deg_s * s, true, None) }, None);
            }
            let TaskFigures::Rate(figures) = watched.figures(None, None) else { panic!("a rate") };
            let found = figures.reached_deg_s.map(|deg_s| (deg_s * 1e3).round() / 1e3);
            assert_eq!((found, figures.reason), (told, told.map(|_| CANNOT_KEEP_UP)), "{figures}");
        }
    }

    /// Nothing is said of a rate that never followed, nor in percent of a rate of 0.
    #[test]
    fn exact_what_is_not_known_is_not_said() {
        let scene = |rate: &str| Scene::of_sets(&[format!("rate.deg_s={rate}")]).unwrap();
        let TaskFigures::Rate(figures) = BoardTask::Rate.watched(&scene("5")).unwrap().figures(None, None)
        else {
            panic!("a rate")
        };
        assert_eq!((figures.measured_s, figures.mean_deg_s, figures.ok), (None, None, false));
        let mut watched = BoardTask::Rate.watched(&scene("0")).unwrap();
        for ms in [300, 400] {
            let at = Time::from_nanos(ms * 1_000_000);
            watched.take(at, &reported(at, 1.0, true, None), Some(Truth::default()));
        }
        let TaskFigures::Rate(figures) = watched.figures(None, None) else { panic!("a rate") };
        assert_eq!((figures.mean_deg_s, figures.true_mean_deg_s), (Some(0.0), Some(0.0)));
        assert_eq!(figures.mean_error_percent, None);
    }
}
