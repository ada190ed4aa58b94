//! The experiments that commission the motor at a board, ordered one by one.
//!
//! ```text
//!            Ready                 the response                       taken
//! Making ----------> Asking(k) ------------------> Ordering(k + 1) ----------> Making      or nothing pays: the end
//! ```
//!
//! The plan is the controller's ([`Commissioning`]), and is made here, where a search takes no tick of the loop. The
//! line may lose a message or its answer: it is sent again after [`ANSWER_WAIT`]. The board numbers experiments, so
//! that an order that comes twice is one.

use std::sync::Arc;
use std::time::Duration;

use controller::ResponseMap;
use controller::commissioning::experiment::Experiment;
use controller::commissioning::{Commissioning, CommissioningEnd, ExperimentPhase};
use link::{BoardMessage, ExperimentRecord, HostMessage, PhaseRecord, ResponseRecord};
use motor_model::Time;

use super::host_clock::nanos;
use super::outcome::CommissionFigures;
use super::report_record::Reported;
use crate::board::BoardError;
use simulation::runs::RunError;
use simulation::runs::commission::CommissionedMotor;
use simulation::scene::Scene;
use simulation::world::instruments;

/// The host's time after which a message without an answer is sent again. An emulated board is slower than the part.
pub(super) const ANSWER_WAIT: Duration = Duration::from_millis(300);

/// What the host waits for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Waiting {
    /// That the experiment is over.
    Making,
    /// What it has shown.
    Asking,
    /// That the next one is taken.
    Ordering(Experiment),
}

/// What has been seen of the experiments.
#[derive(Debug)]
pub(super) struct WatchedCommissioning {
    scene: Scene,
    prior: Arc<ResponseMap>,
    plan: Commissioning,
    /// Number of the last experiment that was ordered.
    number: u16,
    waiting: Waiting,
    /// When the message under way was sent.
    sent_at: Option<i64>,
    last_at: Time,
    end: Option<CommissioningEnd>,
}

impl WatchedCommissioning {
    /// Of the motor of `scene`, whose map is the prior.
    ///
    /// # Errors
    /// When the map is for another design, or the instruments are refused.
    pub(super) fn new(scene: &Scene) -> Result<Self, BoardError> {
        let instruments = instruments::checked(scene).map_err(RunError::from)?;
        Ok(Self {
            scene: scene.clone(),
            prior: scene.response_map()?,
            plan: Commissioning::new(&instruments),
            number: 0,
            waiting: Waiting::Making,
            sent_at: None,
            last_at: Time::ZERO,
            end: None,
        })
    }

    /// How many experiments were ordered.
    pub(super) fn experiments(&self) -> u16 {
        self.number
    }

    /// Takes a report at `at` since arming; whether it is over.
    pub(super) fn take(&mut self, at: Time, reported: &Reported) -> bool {
        self.last_at = at;
        match reported.phase {
            PhaseRecord::Experiment(ExperimentPhase::Ended(end)) => self.end = Some(end),
            // An order that is not taken yet is not what this report is of.
            PhaseRecord::Experiment(ExperimentPhase::Ready) if self.waiting == Waiting::Making => {
                if self.number == 0 {
                    self.order_next();
                } else {
                    (self.waiting, self.sent_at) = (Waiting::Asking, None);
                }
            }
            _ => {}
        }
        self.end.is_some()
    }

    /// Takes an answer of the board.
    pub(super) fn take_answer(&mut self, answer: &BoardMessage) {
        match (answer, self.waiting) {
            (BoardMessage::Response(ResponseRecord { number, shown }), Waiting::Asking)
                if *number == self.number =>
            {
                self.plan.take(&self.prior, &shown.into());
                self.order_next();
            }
            (BoardMessage::ExperimentTaken { number }, Waiting::Ordering(_)) if *number == self.number => {
                self.waiting = Waiting::Making;
            }
            _ => {}
        }
    }

    fn order_next(&mut self) {
        match self.plan.next(&self.prior) {
            Some(experiment) => {
                self.number = self.number.wrapping_add(1);
                (self.waiting, self.sent_at) = (Waiting::Ordering(experiment), None);
            }
            None => self.end = Some(CommissioningEnd::Enough),
        }
    }

    /// What the board is to be told at `now` of the host's clock.
    pub(super) fn due(&mut self, now: i64) -> Option<HostMessage> {
        let message = match self.waiting {
            Waiting::Making => return None,
            Waiting::Asking => HostMessage::Response,
            Waiting::Ordering(experiment) => {
                HostMessage::Experiment(ExperimentRecord::new(self.number, &experiment))
            }
        };
        let is_due = self.sent_at.is_none_or(|sent_at| now - sent_at >= nanos(ANSWER_WAIT));
        is_due.then(|| {
            self.sent_at = Some(now);
            message
        })
    }

    /// What has come of it. A run that was ended before has measured no more than it has.
    pub(super) fn figures(&self) -> CommissionFigures {
        let end = self.end.unwrap_or(CommissioningEnd::TimeOver);
        let time_s = self.last_at.seconds_since(Time::ZERO);
        let motor = CommissionedMotor::new(&self.scene, self.prior.clone(), &self.plan, (end, time_s), None);
        CommissionFigures { experiments: self.number, motor }
    }
}

#[cfg(test)]
mod tests {
    use controller::commissioning::ExperimentReport;
    use estimator::Health;
    use link::{ShownRecord, TickRecord};
    use motor_model::DriveCommand;

    use super::*;

    fn reported(phase: ExperimentPhase) -> Reported {
        let report = ExperimentReport {
            estimate: None,
            health: Health::Waiting,
            camera: None,
            command: DriveCommand::OFF,
            applied: DriveCommand::OFF,
            phase,
        };
        Reported::of(&TickRecord::from(&report)).unwrap()
    }

    fn watched() -> WatchedCommissioning {
        WatchedCommissioning::new(&Scene::of_sets(&["ldv.installed=no".to_owned()]).unwrap()).unwrap()
    }

    fn number(message: Option<HostMessage>) -> u16 {
        match message {
            Some(HostMessage::Experiment(order)) => order.number,
            other => panic!("no order: {other:?}"),
        }
    }

    const WAIT: i64 = 300_000_000;

    /// An order, its experiment, its response and the next order; whatever is lost is sent again, and what belongs to
    /// another experiment is passed over.
    #[test]
    fn exact_what_is_lost_is_sent_again() {
        let mut watched = watched();
        let ready = reported(ExperimentPhase::Ready);
        assert!(!watched.take(Time::ZERO, &reported(ExperimentPhase::Resting)) && watched.due(0).is_none());
        watched.take(Time::ZERO, &ready);
        assert_eq!(number(watched.due(1)), 1);
        assert!(watched.due(WAIT).is_none(), "the answer is on its way");
        // It says what was before the order.
        watched.take(Time::ZERO, &ready);
        watched.take_answer(&BoardMessage::ExperimentTaken { number: 7 });
        assert_eq!(number(watched.due(WAIT + 1)), 1, "it is ordered again");
        watched.take_answer(&BoardMessage::ExperimentTaken { number: 1 });
        assert!(watched.due(10 * WAIT).is_none());
        watched.take(Time::ZERO, &reported(ExperimentPhase::Cruising));
        assert!(watched.due(10 * WAIT).is_none());
        watched.take(Time::ZERO, &ready);
        for at in [10, 11] {
            assert_eq!(watched.due(at * WAIT), Some(HostMessage::Response));
            watched
                .take_answer(&BoardMessage::Response(ResponseRecord { number: 2, shown: ShownRecord::Lost }));
        }
        watched.take_answer(&BoardMessage::Response(ResponseRecord { number: 1, shown: ShownRecord::Lost }));
        assert_eq!((number(watched.due(11 * WAIT)), watched.experiments()), (2, 2));
    }

    /// What ends the experiments at the board ends the run, with what was measured by then: nothing here.
    #[test]
    fn exact_the_board_s_end_is_the_end() {
        let mut watched = watched();
        let ended = reported(ExperimentPhase::Ended(CommissioningEnd::NeverRests));
        assert!(watched.take(Time::from_nanos(2_000_000_000), &ended));
        let found = watched.figures().motor;
        assert_eq!(found.commissioned.map.unwrap_err(), controller::commissioning::Unfit::NeverRests);
        assert!((found.commissioned.time_s - 2.0).abs() < 1e-6 && found.seed.is_none());
    }
}
