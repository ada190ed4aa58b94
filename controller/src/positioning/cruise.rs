//! A cruise on its way: it goes on, changes its amplitude, or is cut.
//!
//! With `r` the remaining distance in the direction of the mode, `v` the rate and `s` the standard deviation of the
//! coast and of the angle together, it is cut where
//!
//! ```text
//! r - coast(v) <= -d k s      d: +1 clockwise, -1 counter-clockwise;   k: CLOCKWISE_COAST_SIGMAS
//! ```

use estimator::Estimate;
use motor_model::{DriveMode, Time, math};

use super::{Positioning, PositioningPhase, StopReason, is_at_most};
use crate::amplitude_search::{Candidates, RowTrial, SLOW_PART, Stage};
use crate::drive_plan::frames_follow;
use crate::progress_window::{ProgressWindow, WindowOutcome};
use crate::response_map::{Cruise, ResponseMap, direction};
use crate::settling_watch::SettlingWatch;

/// Part of the standard deviation of the coast by which a cruise is cut early in mode C and late in mode B, so that the
/// rotor tends to come to rest clockwise of the target, from where the fine bursts lead back. Scored by
/// `host-sim positioning-trials`.
const CLOCKWISE_COAST_SIGMAS: f32 = 0.5;

/// Standard deviations of the angle within which a cruise is near where it is to be cut: farther away an uncertain
/// angle ends no cruise. An assumption: one normal error in 700 is larger.
const NEAR_SIGMAS: f32 = 3.0;

impl Positioning {
    /// Drive on: goes on, changes, or is cut.
    pub(super) fn cruise(
        &mut self,
        map: &ResponseMap,
        cruise: Cruise,
        since: Time,
        progress: ProgressWindow,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> Option<PositioningPhase> {
        if self.leaves(cruise.mode, estimate) {
            return Some(PositioningPhase::Stopped(StopReason::OutOfTravel));
        }
        let direction = direction(cruise.mode);
        let window_nanos = self.tuning.progress_window_nanos;
        let retargeted = core::mem::take(&mut self.retargeted);
        let mut tries_another = false;
        let next_window = match progress.outcome(cruise.rate_rad_s, window_nanos, now, estimate) {
            WindowOutcome::Open => None,
            WindowOutcome::Turns(rate_rad_s) => {
                (self.stalls, self.wrong_ways) = (0, 0);
                tries_another = self.tries_another(map, &cruise, rate_rad_s);
                if !tries_another {
                    self.learn_rate(&cruise, rate_rad_s);
                }
                Some(ProgressWindow::from(now, estimate))
            }
            WindowOutcome::Stuck => {
                self.learn_rate(&cruise, 0.0);
                self.watch = SettlingWatch::new(None);
                if *self.amplitudes.stage(cruise.mode) != Stage::Open {
                    self.tries_another(map, &cruise, 0.0);
                }
                return Some(self.stall(cruise.mode));
            }
            WindowOutcome::WrongWay(back_rad_s) => return Some(self.turns_back(map, &cruise, back_rad_s)),
        };
        let remaining_rad = direction * self.target.angle().radians_since::<f32>(estimate.angle);
        let rate_rad_s = direction * estimate.rate_rad_s;
        // Not `f32::max`, for which the microcontroller calls a function.
        let coast_rad = map.coast_rad(cruise.mode, if rate_rad_s > 0.0 { rate_rad_s } else { 0.0 });
        let before_cut_rad = remaining_rad - coast_rad;
        // The coast is not known better than the angle at the cut.
        let coast_rad2 = cruise.coast_sd_rad * cruise.coast_sd_rad;
        let spread_rad2 = coast_rad2 + estimate.angle_rad2;
        let arrived = is_at_most(before_cut_rad, -CLOCKWISE_COAST_SIGMAS * direction, spread_rad2);
        let too_long = now.nanos_since(since) >= self.tuning.limits.on_max_nanos;
        let uncertain = estimate.angle_rad2 > self.tuning.cruise_variance_max_rad2
            && estimate.angle_rad2 > coast_rad2
            && is_at_most(before_cut_rad, NEAR_SIGMAS, estimate.angle_rad2);
        if arrived || too_long || uncertain || tries_another {
            if tries_another {
                self.trial = None;
            }
            if uncertain {
                // The next cruise would end the same way, perhaps before it has turned the rotor.
                self.bursts_only = true;
            }
            return Some(self.coast(direction, coast_rad, math::sqrt_f32(spread_rad2)));
        }
        let another = self.another(map, &cruise, remaining_rad, retargeted);
        if another.is_none() && next_window.is_none() {
            return None;
        }
        let (cruise, progress) = (another.unwrap_or(cruise), next_window.unwrap_or(progress));
        Some(PositioningPhase::Cruise { cruise, since, progress })
    }

    fn learn_rate(&mut self, cruise: &Cruise, rate_rad_s: f32) {
        if self.tuning.learning {
            self.correction.learn_rate(cruise, rate_rad_s);
        }
    }

    /// A cruise that turns the rotor the wrong way. It may only have started so. After the second in a row another
    /// amplitude is tried, unless this one is the fastest.
    #[cold]
    #[inline(never)]
    fn turns_back(&mut self, map: &ResponseMap, cruise: &Cruise, back_rad_s: f32) -> PositioningPhase {
        self.watch = SettlingWatch::new(None);
        if self.wrong_ways > 0 && !matches!(self.amplitudes.stage(cruise.mode), Stage::Found(_)) {
            self.tries_another(map, cruise, -back_rad_s);
        }
        self.wrong_way()
    }

    /// Whether the rotor is driven at another amplitude from its next rest on, since `cruise` turns it at `rate_rad_s`
    /// in the direction of its mode. Less than [`SLOW_PART`] of the map's rate begins a search. Each amplitude begins
    /// at rest: a rotor whose drive weakens on the way may come to ride on the teeth, and goes on so under full drive.
    #[cold]
    #[inline(never)]
    fn tries_another(&mut self, map: &ResponseMap, cruise: &Cruise, rate_rad_s: f32) -> bool {
        let candidates = self.candidates(map, cruise.mode);
        let least_rad_s = SLOW_PART * direction(cruise.mode) * cruise.rate_rad_s;
        let next = match *self.amplitudes.stage(cruise.mode) {
            Stage::Open if rate_rad_s < least_rad_s => {
                RowTrial::below(cruise.amplitude, rate_rad_s, candidates).map(Stage::Trying)
            }
            Stage::Trying(trial) if candidates.row(trial.row) == Some(cruise) => {
                Some(trial.after(candidates, rate_rad_s))
            }
            Stage::Found(row) if candidates.row(row) == Some(cruise) => {
                self.amplitudes.again((cruise.mode, row), candidates, rate_rad_s, least_rad_s)
            }
            Stage::Open | Stage::Trying(_) | Stage::Found(_) => None,
        };
        let Some(next) = next.filter(|_| self.tuning.learning) else { return false };
        *self.amplitudes.stage_mut(cruise.mode) = next;
        true
    }

    /// The cruises of `mode` among which the fastest is searched.
    fn candidates<'m>(&self, map: &'m ResponseMap, mode: DriveMode) -> Candidates<'m> {
        Candidates {
            cruises: map.cruises_of(mode),
            amplitude_max: self.tuning.limits.amplitude_max,
            of_every_motor: true,
            enough_rad_s: f32::INFINITY,
        }
    }

    /// Another cruise for what remains: a weaker one where the coast of `cruise` is too uncertain, and one as strong as
    /// a changed target asks for.
    fn another(
        &self,
        map: &ResponseMap,
        cruise: &Cruise,
        remaining_rad: f32,
        retargeted: bool,
    ) -> Option<Cruise> {
        // A motor of half the rate coasts half as far: it is driven as if twice as much remained.
        let remaining_rad = remaining_rad / self.correction.rate_scale(cruise.mode);
        if remaining_rad >= cruise.room_rad() && !retargeted {
            return None;
        }
        let below = if retargeted { f32::INFINITY } else { cruise.amplitude };
        let strongest = self.amplitudes.strongest(map, cruise.mode, self.tuning.limits.amplitude_max);
        map.cruise_weaker_than(below, cruise.mode, strongest, remaining_rad)
            .filter(|another| frames_follow(another, self.tuning.frame_wait_s()))
    }
}
