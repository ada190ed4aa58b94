//! The rotor after a drive: it comes to rest, and its angle is measured.
//!
//! The filter says when the rotor lies still. Where it does not, the camera's frames decide
//! ([`crate::settling_watch`]). The angle is measured until it is known to [`KNOWN_PART`] of the turn, or for
//! [`MEASURING_NANOS`].
//!
//! The angle after a burst counts only if it is independent of that before it: once the filter's variance has been nine
//! times that before the burst, as in [`crate::rest_filter`].

use estimator::Estimate;
use motor_model::{Angle, DriveCommand, Time};

use super::experimenter::{BurstRun, Experimenter, Stage};
use super::result::CommissioningEnd;
use crate::settling_watch::{SettlingWatch, Shown};

/// Longest time in ns in which the rotor comes to rest. An assumption: twenty times what the slowest takes.
const REST_MAX_NANOS: u64 = 3_000_000_000;
/// Least time in ns from the end of a drive until the rotor counts as still: five ring-downs of mode B. A filter may
/// still say that the rotor rests when a short burst ends.
const RING_DOWN_NANOS: u64 = 20_000_000;
/// Longest time in ns of measuring a rotor at rest: with the default camera it leaves 0.2 milli-degrees.
const MEASURING_NANOS: u64 = 350_000_000;
/// Part of the turn to which it is measured. An assumption: a fifth of what is known of the best family.
const KNOWN_PART: f32 = 0.01;
/// As [`crate::rest_filter`] has it.
const INDEPENDENT_VARIANCES: f32 = 9.0;

/// Bursts that follow one another, each after rest, and the angle before the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Train {
    command: DriveCommand,
    ticks: u32,
    /// Direction of the mode.
    pub(super) along: f32,
    left: u8,
    pub(super) from: Angle,
    pub(super) from_rad2: f32,
    pub(super) independent: bool,
}

impl Train {
    /// Of `count` bursts of `ticks` ticks, from `estimate`.
    pub(super) fn new(
        command: DriveCommand,
        along: f32,
        ticks: u32,
        count: u8,
        estimate: &Estimate<f32>,
    ) -> Self {
        Self {
            command,
            ticks,
            along,
            left: count.saturating_sub(1),
            from: estimate.angle,
            from_rad2: estimate.angle_rad2,
            independent: false,
        }
    }

    /// The drive of each burst.
    pub(super) fn command(&self) -> DriveCommand {
        self.command
    }

    /// Length of each burst in ns.
    pub(super) fn burst_nanos(&self) -> u64 {
        u64::from(self.ticks) * crate::TICK_NANOS
    }
}

/// What is to be measured once the rotor lies still.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pending {
    Nothing,
    /// The coast of a cruise, from the cut.
    Coast {
        along: f32,
        cut: Estimate<f32>,
    },
    /// The turn of a train.
    Turn(Train),
    /// Whether the rotor has turned at all in a drive in which the estimate was lost.
    Lost {
        along: f32,
        from: Angle,
        from_rad2: f32,
        driven_s: f32,
    },
}

/// A rotor with the drive off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resting {
    pub(super) pending: Pending,
    since: Time,
    /// When the estimate last said that the rotor moves.
    moved_at: Time,
    still_since: Option<Time>,
    watch: SettlingWatch,
}

impl Resting {
    /// From `now` on.
    pub(super) fn new(pending: Pending, now: Time) -> Self {
        Self { pending, since: now, moved_at: now, still_since: None, watch: SettlingWatch::new(None) }
    }

    /// Time in s from the end of the drive until the estimate no longer said that the rotor moves.
    pub(super) fn rest_time_s(&self) -> f32 {
        self.moved_at.seconds_since(self.since)
    }

    /// The turn in rad so far.
    fn turned_rad(&self, estimate: &Estimate<f32>) -> f32 {
        match &self.pending {
            Pending::Nothing | Pending::Lost { .. } => f32::INFINITY,
            Pending::Coast { cut, .. } => estimate.angle.radians_since(cut.angle),
            Pending::Turn(train) => estimate.angle.radians_since(train.from),
        }
    }
}

impl Experimenter {
    /// Drive off: waits for rest, and measures, or begins the next burst of a train.
    pub(super) fn rest(&mut self, mut resting: Resting, now: Time, estimate: &Estimate<f32>, wide: bool) {
        if let Pending::Turn(train) = &mut resting.pending {
            let floor_rad2 = self.tuning.floor_rad2;
            let since_rad2 = estimate.angle_rad2 - floor_rad2;
            train.independent |= since_rad2 > INDEPENDENT_VARIANCES * (train.from_rad2 - floor_rad2);
        }
        let (window, wait) = (self.tuning.settling_window_nanos, self.tuning.frame_wait_nanos);
        if !estimate.resting {
            resting.moved_at = now;
        }
        let rung_down = now.nanos_since(resting.since) >= RING_DOWN_NANOS;
        let still = rung_down
            && !wide
            && (estimate.resting || resting.watch.look(window, wait, now, estimate) == Shown::Still);
        if !still {
            resting.still_since = None;
            let late = now.nanos_since(resting.since) > REST_MAX_NANOS;
            self.stage =
                if late { Stage::Ended(CommissioningEnd::NeverRests) } else { Stage::Resting(resting) };
            return;
        }
        let still_since = *resting.still_since.get_or_insert(now);
        if let Pending::Turn(train) = &mut resting.pending
            && train.left > 0
        {
            train.left -= 1;
            self.stage = Stage::Bursting(BurstRun { since: now, train: *train });
            return;
        }
        let known_rad = KNOWN_PART * resting.turned_rad(estimate).abs();
        let measured =
            estimate.angle_rad2 <= known_rad * known_rad || now.nanos_since(still_since) >= MEASURING_NANOS;
        if measured {
            self.finish(&resting, estimate);
        } else {
            self.stage = Stage::Resting(resting);
        }
    }
}
