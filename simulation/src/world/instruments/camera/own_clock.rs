//! A camera whose frames are stamped by a clock of its own, and the program on its computer that turns the stamps into
//! the board's time.
//!
//! ```text
//! own clock = offset + time (1 + drift)
//! exchange  = a question to the board and its answer, by the own clock; the board's count of ticks in between
//! stamp     = what the exchanges until then make of the own clock's stamp     (crate::math::clock_sync)
//! ```
//!
//! The computer has asked ten times a second for 10 s before the run begins, and goes on so. A round trip is never
//! shorter than `camera.clock_round_trip_s`. How that is shared between the two ways is drawn for the run, any share as
//! likely: no exchange shows it, so half of the shortest round trip bounds the error of all stamps. Each exchange has a
//! delay beside it on one of its ways, either as likely, of exponential distribution and the mean
//! `camera.clock_round_trip_spread_s`.

use controller::TICK_NANOS;
use motor_model::{Time, math};
use rand_distr::{Bernoulli, Distribution, Exp, Uniform};
use rand_pcg::Pcg64;

use crate::math::clock_sync::{BoardClock, ClockSync, Exchange};
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;

/// Time between two questions in ns.
const EVERY_NANOS: i64 = 100_000_000;

/// Time for which the board has counted, and was asked, before the run begins, in ns.
const BEFORE_NANOS: i64 = 10_000_000_000;

/// A clock of the camera's own, and what its computer knows of the board's.
#[derive(Clone, Debug)]
pub(super) struct OwnClock {
    offset_nanos: f64,
    drift: f64,
    shortest_nanos: f64,
    /// Part of the shortest round trip that the way to the board takes.
    there_part: f64,
    further: Option<Exp<f64>>,
    delays: Pcg64,
    sync: ClockSync,
    /// When the next question is asked, in ns since the run began.
    next_nanos: i64,
    clock: Option<BoardClock>,
}

/// Settings of the clock.
#[derive(Clone, Copy, Debug)]
pub(in crate::world::instruments) struct ClockSettings {
    offset_s: f64,
    drift_ppm: f64,
    round_trip_s: f64,
    spread_s: f64,
}

impl ClockSettings {
    /// Those of a scene.
    pub(in crate::world::instruments) fn of(scene: &Scene) -> Self {
        Self {
            offset_s: scene.number("camera.clock_offset_s"),
            drift_ppm: scene.number("camera.clock_drift_ppm"),
            round_trip_s: scene.number("camera.clock_round_trip_s"),
            spread_s: scene.number("camera.clock_round_trip_spread_s"),
        }
    }

    /// Whether it is a clock of the camera's own.
    pub(in crate::world::instruments) fn is_own(&self) -> bool {
        self.offset_s.abs() > 0.0 || self.drift_ppm.abs() > 0.0
    }

    /// Root mean square error in s of the stamps of a clock that is estimated: of an error that is as likely to be any
    /// within the bound of a usual exchange, half of its round trip and half a tick.
    #[expect(clippy::cast_precision_loss, reason = "10,000 ns")]
    pub(in crate::world::instruments) fn error_s(&self) -> f64 {
        let bound_s = 0.5 * (self.round_trip_s + self.spread_s + 1e-9 * TICK_NANOS as f64);
        if self.is_own() { bound_s / math::sqrt(3.0) } else { 0.0 }
    }
}

impl OwnClock {
    /// The clock of a scene; `None` of a camera whose frames are stamped by the board's.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let settings = ClockSettings::of(scene);
        if !settings.is_own() {
            return None;
        }
        let mut delays = random_streams::stream(scene.noise_seed(), RandomSource::CameraOwnClock);
        let there_part = Uniform::new_inclusive(0.0, 1.0).map_or(0.5, |share| share.sample(&mut delays));
        let further = (settings.spread_s > 0.0).then(|| Exp::new(1e-9 / settings.spread_s).ok()).flatten();
        let mut clock = Self {
            offset_nanos: 1e9 * settings.offset_s,
            drift: 1e-6 * settings.drift_ppm,
            shortest_nanos: 1e9 * settings.round_trip_s,
            there_part,
            further,
            delays,
            sync: ClockSync::default(),
            next_nanos: -BEFORE_NANOS,
            clock: None,
        };
        clock.ask_until(0);
        Some(clock)
    }

    /// The stamp in the board's time, as the computer knows it at `now`, of a frame whose stamp is right at `stamped`.
    pub(super) fn by_the_board(&mut self, now: Time, stamped: Time) -> Time {
        self.ask_until(since_begin(now));
        let own_nanos = self.own_nanos(since_begin(stamped));
        let board_nanos = self.clock.map_or(0, |clock| clock.board_nanos(own_nanos));
        Time::from_nanos(board_nanos.saturating_sub(BEFORE_NANOS.unsigned_abs()))
    }

    /// Asks what is to be asked until `now`, in ns since the run began. An answer counts when the next question is due.
    fn ask_until(&mut self, now_nanos: i64) {
        while self.next_nanos + EVERY_NANOS <= now_nanos {
            let exchange = self.exchange(self.next_nanos);
            self.sync.add(exchange);
            self.next_nanos += EVERY_NANOS;
            self.clock = self.sync.at(self.own_nanos(self.next_nanos));
        }
    }

    /// A question asked at `sent_nanos` since the run began, and its answer.
    #[expect(clippy::cast_possible_truncation, reason = "below 1 s")]
    fn exchange(&mut self, sent_nanos: i64) -> Exchange {
        let further_nanos = self.further.map_or(0.0, |further| further.sample(&mut self.delays));
        let on_the_way_there = Bernoulli::new(0.5).is_ok_and(|way| way.sample(&mut self.delays));
        let [there, back] = if on_the_way_there { [further_nanos, 0.0] } else { [0.0, further_nanos] };
        let there_nanos = (self.there_part * self.shortest_nanos + there).round() as i64;
        let back_nanos = ((1.0 - self.there_part) * self.shortest_nanos + back).round() as i64;
        let counted_nanos = BEFORE_NANOS + sent_nanos + there_nanos;
        Exchange {
            sent_nanos: self.own_nanos(sent_nanos),
            received_nanos: self.own_nanos(sent_nanos + there_nanos + back_nanos),
            ticks: counted_nanos.unsigned_abs() / TICK_NANOS,
        }
    }

    /// The own clock at a time in ns since the run began.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "a month of ns is below 2^53"
    )]
    fn own_nanos(&self, nanos: i64) -> i64 {
        (self.offset_nanos + nanos as f64 * (1.0 + self.drift)).round() as i64
    }
}

fn since_begin(time: Time) -> i64 {
    i64::try_from(time.nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::statistics::Spread;

    fn clock(sets: &[&str]) -> Option<OwnClock> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        OwnClock::of(&Scene::of_sets(&sets).unwrap())
    }

    const OFF: [&str; 2] = ["camera.clock_offset_s=0.1", "camera.clock_drift_ppm=50"];

    /// Error in ns of a stamp at `now`.
    fn error_nanos(clock: &mut OwnClock, now_nanos: i64) -> i64 {
        let now = Time::from_nanos(now_nanos.unsigned_abs());
        since_begin(clock.by_the_board(now, now)) - now_nanos
    }

    #[test]
    fn exact_a_camera_without_offset_and_drift_has_the_board_s_clock() {
        assert!(clock(&[]).is_none() && clock(&["camera.clock_round_trip_s=5e-3"]).is_none());
        assert!(clock(&OFF[..1]).is_some() && clock(&OFF[1..]).is_some());
    }

    /// Without delays the error is that of the count of whole ticks: half a tick, and a part of it for the time since
    /// the last exchange.
    #[test]
    fn law_without_delays_the_clock_is_known_to_half_a_tick() {
        let sets = ["camera.clock_round_trip_s=0", "camera.clock_round_trip_spread_s=0"];
        for own in [&OFF[..], &["camera.clock_offset_s=-3"], &["camera.clock_drift_ppm=-900"]] {
            let mut clock = clock(&[own, &sets].concat()).unwrap();
            for now_nanos in [1_000_000, 50_000_000, 1_000_000_000, 1_050_000_000, 60_000_000_000] {
                let error_nanos = error_nanos(&mut clock, now_nanos);
                assert!(error_nanos.abs() <= 6_500, "{own:?} {now_nanos}: {error_nanos}");
            }
        }
    }

    /// The error of a run lies within the bound of its shortest exchanges. Over many runs it has the root mean square
    /// that the filters are told, but for the spread, of which the best of eight exchanges has an eighth: at 1 ms the
    /// square is 0.68 of the told one. The mean of n squares of uniform errors has the standard error `0.9 / sqrt n`.
    #[test]
    fn law_errors_are_as_large_as_told() {
        let settings = |sets: &[&str]| {
            let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
            ClockSettings::of(&Scene::of_sets(&sets).unwrap())
        };
        for (round_trip, shortest_nanos) in [("1e-3", 1e6), ("1e-2", 1e7)] {
            let trip = format!("camera.clock_round_trip_s={round_trip}");
            let told_nanos = 1e9 * settings(&[OFF[0], OFF[1], &trip]).error_s();
            let of_seed = |seed: u64| {
                let seed = format!("seed={seed}");
                let mut clock = clock(&[OFF[0], OFF[1], &trip, &seed]).unwrap();
                #[expect(clippy::cast_precision_loss, reason = "below a second")]
                let error_nanos = error_nanos(&mut clock, 1_250_000_000) as f64;
                // Half of the round trip, and of the further delay of the best of eight, at most 0.2 ms of 400 runs.
                assert!(error_nanos.abs() <= 0.5 * shortest_nanos + 2e5 + 1e4, "{seed}: {error_nanos}");
                let per_told = error_nanos / told_nanos;
                per_told * per_told
            };
            let squares: Spread = (0..400).map(of_seed).collect();
            let errors = 3.0 * 0.9 / 20.0;
            let within = 0.68 * (1.0 - errors)..1.0 + errors;
            assert!(within.contains(&squares.mean), "{round_trip}: {}", squares.mean);
        }
    }
}
