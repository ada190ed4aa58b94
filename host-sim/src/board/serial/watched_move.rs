//! What is seen of a move at a board, and of the steps that follow it.
//!
//! ```text
//!           held for as long as is asked          answered
//! moving -------------------------------> asking ----------> moving      or no step is left: the end
//! ```
//!
//! A step counts from the board's answer: reports from before are of the target before. The line may lose a step or its
//! answer: it is sent again after [`ANSWER_WAIT`], which asks for no more than the first time.

use controller::{DECISION_TICKS_MAX, LATENCY_TICKS_MAX, TICK_NANOS};
use link::{BoardMessage, HostMessage, PhaseRecord};
use motor_model::{Angle, Time};

use super::commissioned::ANSWER_WAIT;
use super::host_clock::nanos;
use super::next_step::NextStep;
use super::outcome::{HeldFigures, MoveFigures};
use super::report_record::{Reported, sd_deg};
use simulation::runs::record::Truth;
use simulation::scene::Scene;

/// A report may be of a decision that is older by the latency: so long after an answer it may be of the target before.
const DECIDED_AFTER_NANOS: u64 = (LATENCY_TICKS_MAX as u64 + DECISION_TICKS_MAX as u64) * TICK_NANOS;

/// A step without its answer.
#[derive(Clone, Copy, Debug)]
struct Asked {
    step: NextStep,
    sent_at: Option<i64>,
}

/// What has been seen of a move.
#[derive(Clone, Debug)]
pub(super) struct WatchedMove {
    target_deg: f64,
    tolerance_deg: f64,
    hold_nanos: u64,
    holding_since: Option<Time>,
    /// When a report is of this target and of no other: `None` before the first report after its answer.
    counts_from: Option<Time>,
    /// The steps that are left, the next one last.
    steps: Vec<NextStep>,
    asked: Option<Asked>,
    held: Vec<HeldFigures>,
    /// Whether the last step was a zero: the place that is held has its figures already.
    is_zeroed: bool,
}

impl WatchedMove {
    /// Of the move of `scene`.
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            target_deg: scene.number("position.to_deg"),
            tolerance_deg: scene.number("position.tolerance_deg"),
            hold_nanos: scene.nanos("position.hold_s"),
            holding_since: None,
            counts_from: None,
            steps: Vec::new(),
            asked: None,
            held: Vec::new(),
            is_zeroed: false,
        }
    }

    /// The same with `steps` after it.
    pub(super) fn followed_by(self, steps: &[NextStep]) -> Self {
        Self { steps: steps.iter().rev().copied().collect(), ..self }
    }

    /// The target in degrees.
    pub(super) fn target_deg(&self) -> f64 {
        self.target_deg
    }

    /// Takes a report at `at` since arming; whether the last target was held, or the move was given up.
    pub(super) fn take(&mut self, at: Time, reported: &Reported, truth: Option<Truth>) -> bool {
        let is_given_up = matches!(reported.phase, PhaseRecord::Stopped(_));
        if self.asked.is_some() {
            return is_given_up;
        }
        let counts_from = *self.counts_from.get_or_insert(at.plus_nanos(DECIDED_AFTER_NANOS));
        let holds = reported.phase == PhaseRecord::Holding && (self.held.is_empty() || at >= counts_from);
        self.holding_since = if holds { self.holding_since.or(Some(at)) } else { None };
        let is_held = self.holding_since.is_some_and(|since| at.nanos_since(since) >= self.hold_nanos);
        let step = if is_held { self.steps.pop() } else { None };
        let Some(step) = step else { return is_held || is_given_up };
        if !std::mem::replace(&mut self.is_zeroed, step == NextStep::Zero) {
            self.held.push(self.held_at(at, reported, truth));
        }
        self.asked = Some(Asked { step, sent_at: None });
        false
    }

    /// What the board is to be told at `now` of the host's clock.
    pub(super) fn due(&mut self, now: i64) -> Option<HostMessage> {
        let asked = self.asked.as_mut()?;
        if asked.sent_at.is_some_and(|sent_at| now - sent_at < nanos(ANSWER_WAIT)) {
            return None;
        }
        asked.sent_at = Some(now);
        Some(asked.step.message(self.tolerance_deg))
    }

    /// Takes an answer of the board. A second one to the same step changes nothing.
    pub(super) fn take_answer(&mut self, answer: &BoardMessage) {
        let BoardMessage::Retargeted { target_units } = answer else { return };
        let target = Angle::from_units(*target_units);
        self.target_deg = target.degrees();
        match self.asked.map(|asked| asked.step) {
            Some(NextStep::To(deg)) if Angle::from_degrees(deg) == target => self.target_deg = deg,
            Some(NextStep::Hold) => {}
            _ => return,
        }
        (self.asked, self.holding_since, self.counts_from) = (None, None, None);
    }

    /// The board counts from a zero that is `by` farther. It goes on to the same place.
    pub(super) fn zeroed(&mut self, by: Angle) {
        self.target_deg -= by.degrees();
        self.asked = self.asked.filter(|asked| asked.step != NextStep::Zero);
    }

    fn error_deg(&self, angle: Angle) -> f64 {
        angle.degrees() - self.target_deg
    }

    /// Whether `angle` is within the tolerance; an angle that is not known is not.
    fn is_within(&self, angle: Option<Angle>) -> bool {
        angle.is_some_and(|angle| self.error_deg(angle).abs() <= self.tolerance_deg)
    }

    fn held_at(&self, at: Time, reported: &Reported, truth: Option<Truth>) -> HeldFigures {
        let estimated = reported.estimate.map(|estimate| estimate.angle);
        HeldFigures {
            target_deg: self.target_deg,
            held_s: at.seconds_since(Time::ZERO),
            angle_deg: estimated.map(Angle::degrees),
            error_true_mdeg: truth.map(|truth| 1e3 * self.error_deg(truth.angle)),
            ok: self.is_within(truth.map(|truth| truth.angle).or(estimated)),
        }
    }

    /// The figures, after the last report and the truth beside it.
    pub(super) fn figures(&self, last: Option<&Reported>, truth: Option<Truth>) -> MoveFigures {
        let estimate = last.and_then(|reported| reported.estimate);
        let final_angle = truth.map(|truth| truth.angle).or(estimate.map(|estimate| estimate.angle));
        let stopped = match last.map(|reported| reported.phase) {
            Some(PhaseRecord::Stopped(why)) => Some(format!("{why:?}")),
            _ => None,
        };
        let is_held = self.holding_since.is_some() && self.held.iter().all(|held| held.ok);
        MoveFigures {
            held_before: self.held.clone(),
            target_deg: self.target_deg,
            tolerance_deg: self.tolerance_deg,
            final_angle_deg: estimate.map(|estimate| estimate.angle.degrees()),
            final_sd_mdeg: estimate.map(|estimate| 1e3 * sd_deg(estimate.angle_rad2)),
            final_error_true_mdeg: truth.map(|truth| 1e3 * self.error_deg(truth.angle)),
            ok: stopped.is_none() && is_held && self.is_within(final_angle),
            stopped,
        }
    }
}

#[cfg(test)]
mod tests;
