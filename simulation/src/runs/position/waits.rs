//! What the controller waited for during a move, and the health of the estimate meanwhile.

use std::collections::BTreeMap;

use controller::{PositionLoop, PositioningPhase, Wait};
use estimator::Health;

/// Ticks of a move by what the controller waited for, and by health.
#[derive(Default)]
pub(super) struct Waits {
    waits: BTreeMap<&'static str, u64>,
    /// In the order in which they came first: a handful.
    healths: Vec<(Health, u64)>,
}

impl Waits {
    /// Adds a tick.
    pub(super) fn add(&mut self, phase: PositioningPhase, health: Health) {
        if let Some(what) = waited_for(phase) {
            *self.waits.entry(what).or_insert(0) += 1;
        }
        match self.healths.iter_mut().find(|(known, _)| *known == health) {
            Some((_, ticks)) => *ticks += 1,
            None => self.healths.push((health, 1)),
        }
    }

    /// Time by what was waited for, in s.
    pub(super) fn waited_s(&self) -> BTreeMap<&'static str, f64> {
        self.waits.iter().map(|(what, ticks)| (*what, seconds(*ticks))).collect()
    }

    /// Share of the time per health, 0 to 1.
    pub(super) fn health_shares(&self) -> BTreeMap<String, f64> {
        let all: u64 = self.healths.iter().map(|(_, ticks)| ticks).sum();
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let share = |ticks: u64| ticks as f64 / all as f64;
        self.healths.iter().map(|(health, ticks)| (format!("{health:?}"), share(*ticks))).collect()
    }
}

/// What a controller in this phase waits for, as in JSON and in words; `None` if it does not wait.
fn waited_for(phase: PositioningPhase) -> Option<&'static str> {
    match phase {
        PositioningPhase::Waiting(_) => Some("estimate"),
        PositioningPhase::Settling(Wait::Rest) => Some("rest"),
        PositioningPhase::Settling(Wait::Turning) => Some("turning"),
        PositioningPhase::Settling(Wait::Measuring { .. }) => Some("measuring"),
        PositioningPhase::Settling(Wait::MeasuringUnrested { .. }) => Some("measuring_without_rest"),
        PositioningPhase::Cruise { .. }
        | PositioningPhase::Burst { .. }
        | PositioningPhase::Brake { .. }
        | PositioningPhase::Holding
        | PositioningPhase::Stopped(_) => None,
    }
}

fn seconds(ticks: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let nanos = (ticks * PositionLoop::TICK_NANOS) as f64;
    1e-9 * nanos
}
