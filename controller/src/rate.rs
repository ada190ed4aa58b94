//! The rate controller: the rotor follows a reference angle that turns at the commanded rate.
//!
//! ```text
//! reference' = rate,   e = reference - angle,   wanted = rate + e / T        T: [`RateTuning::catch_up_s`]
//! drive: the mode of the direction of the rate, at the amplitude whose mean rate in the map is the wanted one
//! ```
//!
//! Since the angle is controlled, the error of the mean rate is the error of the angle over the time of the mean,
//! whatever this motor's own rates are. Rates below that of the weakest cruise are made of pulses of it: the drive is
//! off until the rotor is behind by [`RateTuning::behind_rad`], and off again when it is ahead. A rotor that is ahead
//! is slowed by friction; it is driven back only when it is ahead by more than [`RateTuning::ahead_rad`]. A rate of
//! exactly 0 means rest: the drive is off, and the reference is where the rotor comes to rest.
//!
//! A rotor that tilts is fastest below full drive. No drive is stronger than the amplitude that turns it fastest: the
//! last cruise of a map of its own, or what is found by its rates ([`rate_search`]).
//!
//! A rotor that does not follow, the end of the travel, too long a drive and too long a time without an estimate end
//! the hold ([`limits`]): the drive is off until another rate is followed.

mod limits;
mod profile;
mod rate_search;
#[cfg(test)]
mod tests;

use estimator::{Estimate, Health, Instruments};
use motor_model::{Angle, AngleAccumulator, DriveCommand, DriveMode, Time};

pub use self::limits::{RateLimits, RateStop};
use self::limits::{RateState, RateWatch};
pub use self::profile::{Dwell, Profile, RATE_MAX_RAD_S, RateProfile};
use self::rate_search::{Driven, RateSearch};
use crate::positioning::PositioningTuning;
use crate::response_map::{ResponseMap, direction};

/// Least time constant of the correction, in times from a frame to the next: a loop of a pure delay has a phase margin
/// of 71 degrees then (`90 - 180 / (3 pi)` degrees). An assumption.
const WAITS_TO_CATCH_UP: f32 = 3.0;

/// Tuning of the rate controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateTuning {
    /// Time constant of the correction of an error of the angle, in s.
    pub catch_up_s: f32,
    /// Error in rad, rotor behind the reference, from which the drive is at least the weakest cruise.
    pub behind_rad: f32,
    /// Error in rad, rotor ahead of the reference, from which it is driven back.
    pub ahead_rad: f32,
    /// Strongest drive, 0 to 1.
    pub amplitude_max: f32,
    /// Least time between two changes of the drive, in ns: the modes respond within some milliseconds.
    pub hold_nanos: u64,
    /// What ends the hold.
    pub limits: RateLimits,
}

impl Default for RateTuning {
    /// 12 ms, 0.05 degrees, 3 degrees, full drive, 0.5 ms, the default limits: assumptions, checked by `host-sim rate`.
    fn default() -> Self {
        Self {
            catch_up_s: 0.012,
            behind_rad: 8.7e-4,
            ahead_rad: 0.052,
            amplitude_max: 1.0,
            hold_nanos: 500_000,
            limits: RateLimits::default(),
        }
    }
}

impl RateTuning {
    /// The default for `instruments`. A slow or late camera needs a longer window to see that the rotor follows, and a
    /// slower correction: a loop that corrects an error before the next frame shows what became of it overshoots.
    pub fn new(instruments: &Instruments) -> Self {
        let positioning = PositioningTuning::new(instruments);
        let limits = RateLimits::new(&positioning);
        let default = Self::default();
        let catch_up_s = default.catch_up_s.max(WAITS_TO_CATCH_UP * positioning.frame_wait_s());
        let ahead_rad = default.ahead_rad * (catch_up_s / default.catch_up_s);
        Self { catch_up_s, ahead_rad, limits, ..default }
    }

    /// For a smooth rate: an error is corrected in a tenth of a second and the rotor is never driven back, so that the
    /// amplitude hardly changes. At 160 deg/s the ripple is a third of the rate, as with a constant amplitude; with
    /// the default, which follows the reference closely, it is more than a half.
    pub fn steady() -> Self {
        Self { catch_up_s: 0.1, ahead_rad: f32::INFINITY, ..Self::default() }
    }
}

/// The rate controller, which follows a [`Profile`] or another [`RateProfile`].
#[derive(Clone, Copy, Debug)]
pub struct RateHold<P = Profile> {
    tuning: RateTuning,
    profile: P,
    started_at: Time,
    decided_at: Time,
    reference: Option<AngleAccumulator<f32>>,
    command: DriveCommand,
    since: Time,
    changed_at: Time,
    watch: RateWatch,
    search: RateSearch,
    stopped: Option<RateStop>,
}

impl<P: RateProfile> RateHold<P> {
    /// Follows `profile` from `now` on.
    pub fn new(profile: P, tuning: RateTuning, now: Time) -> Self {
        Self {
            tuning,
            profile,
            started_at: now,
            decided_at: now,
            reference: None,
            command: DriveCommand::OFF,
            since: now,
            changed_at: now,
            watch: RateWatch::default(),
            search: RateSearch::default(),
            stopped: None,
        }
    }

    /// Why the rate is held no more; `None` while it is.
    pub fn stopped(&self) -> Option<RateStop> {
        self.stopped
    }

    /// The commanded rate at `now`, in rad/s.
    pub fn wanted_rad_s(&self, now: Time) -> f32 {
        self.profile.rate_rad_s(now.seconds_since(self.started_at))
    }

    /// Since when the present command is given.
    pub fn since(&self) -> Time {
        self.since
    }

    /// The reference angle; `None` before the first usable estimate.
    pub fn reference(&self) -> Option<Angle> {
        self.reference.map(|reference| reference.angle())
    }

    /// The command for the tick at `now`, by the rates of `map`. Without a usable estimate the drive is off, and the
    /// reference starts again at the next usable estimate. Once a limit is reached the drive stays off, and the
    /// reference turns on.
    pub fn decide(
        &mut self,
        map: &ResponseMap,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
    ) -> DriveCommand {
        let command = self.choose(map, now, estimate, health);
        if command != self.command {
            (self.command, self.since) = (command, now);
        }
        command
    }

    fn choose(
        &mut self,
        map: &ResponseMap,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
    ) -> DriveCommand {
        let usable = estimate.filter(|_| !matches!(health, Health::Unusable(_)));
        let dt_s: f32 = now.seconds_since(self.decided_at);
        let last_nanos = now.nanos_since(self.decided_at);
        self.decided_at = now;
        let Some(estimate) = usable else {
            self.reference = None;
            self.search.pause();
            self.stopped = self.stopped.or_else(|| self.watch.wait(&self.tuning.limits, last_nanos));
            return DriveCommand::OFF;
        };
        self.watch.sees();
        let rate_rad_s = self.wanted_rad_s(now);
        if rate_rad_s.abs() <= 0.0 {
            self.reference = Some(AngleAccumulator::at(estimate.angle));
            self.search.pause();
            return DriveCommand::OFF;
        }
        let reference = self.reference.get_or_insert(AngleAccumulator::at(estimate.angle));
        reference.turn_by_radians(rate_rad_s * dt_s);
        let behind_rad: f32 = reference.angle().radians_since(estimate.angle);
        let driven = self.command.mode();
        let state = RateState { last_nanos, driven, estimate, rate_rad_s };
        if self.stopped.is_none() {
            let stop = self.watch.check(&self.tuning.limits, map, &state);
            self.stopped = stop.filter(|why| !self.tries_another(*why, map, rate_rad_s, now));
        }
        if self.stopped.is_some() {
            return DriveCommand::OFF;
        }
        if now.nanos_since(self.changed_at) < self.tuning.hold_nanos {
            return self.command;
        }
        self.changed_at = now;
        let driven = self.driven(map, rate_rad_s);
        if self.search.watch(&driven, now, estimate) {
            self.watch.begin_anew();
        }
        self.tuning.drive(map, rate_rad_s, behind_rad, &self.search)
    }

    fn driven<'m>(&self, map: &'m ResponseMap, rate_rad_s: f32) -> Driven<'m> {
        let RateTuning { amplitude_max, limits: RateLimits { progress_window_nanos, .. }, .. } = self.tuning;
        Driven { map, command: self.command, rate_rad_s, amplitude_max, window_nanos: progress_window_nanos }
    }

    /// Whether a rotor that does not follow, for the reason `why`, is driven on at another amplitude.
    #[cold]
    #[inline(never)]
    fn tries_another(&mut self, why: RateStop, map: &ResponseMap, rate_rad_s: f32, now: Time) -> bool {
        let driven = self.driven(map, rate_rad_s);
        let does_not_follow = matches!(why, RateStop::Stuck | RateStop::WrongWay);
        let tries_another = does_not_follow && self.search.tries_another(&driven, now);
        if tries_another {
            self.watch.begin_anew();
        }
        tries_another
    }
}

impl RateTuning {
    /// The drive for a rotor that should turn at `rate_rad_s` and is behind by `behind_rad`, clockwise positive.
    fn drive(
        &self,
        map: &ResponseMap,
        rate_rad_s: f32,
        behind_rad: f32,
        search: &RateSearch,
    ) -> DriveCommand {
        let strongest = |mode| search.strongest(map, mode, self.amplitude_max);
        let mode = if rate_rad_s > 0.0 { DriveMode::B } else { DriveMode::C };
        let along = direction(mode);
        let (rate, behind) = (along * rate_rad_s, along * behind_rad);
        if behind < -self.ahead_rad {
            let back = if mode == DriveMode::B { DriveMode::C } else { DriveMode::B };
            return amplitude_for(map, back, -behind / self.catch_up_s, strongest(back), true);
        }
        let wanted = rate + behind / self.catch_up_s;
        amplitude_for(map, mode, wanted, strongest(mode), behind > self.behind_rad)
    }
}

/// The drive of `mode` whose mean rate is `rate_rad_s` in its direction. Below the rate of the weakest cruise: that
/// cruise if a pulse is `due`, otherwise off.
fn amplitude_for(
    map: &ResponseMap,
    mode: DriveMode,
    rate_rad_s: f32,
    amplitude_max: f32,
    due: bool,
) -> DriveCommand {
    let along = direction(mode);
    let mut cruises = map.cruises_of(mode).iter();
    let Some(mut below) = cruises.next() else { return DriveCommand::OFF };
    if rate_rad_s < along * below.rate_rad_s {
        return if due {
            DriveCommand::saturating(mode, below.amplitude.min(amplitude_max))
        } else {
            DriveCommand::OFF
        };
    }
    for above in cruises {
        let (low, high) = (along * below.rate_rad_s, along * above.rate_rad_s);
        if rate_rad_s < high {
            let part = (rate_rad_s - low) / (high - low);
            let amplitude = below.amplitude + part * (above.amplitude - below.amplitude);
            return DriveCommand::saturating(mode, amplitude.min(amplitude_max));
        }
        below = above;
    }
    DriveCommand::saturating(mode, below.amplitude.min(amplitude_max))
}
