//! Whether the board's clock is known as well as its filter was told.
//!
//! Frames of a camera go to the board with their instants by its clock. That is known to a bound from round trips
//! ([`clock_sync`]), whose error is one of the frame's instant. The filter knows of it what the board was described.
//!
//! A clock is known less well for some answers after an exchange that took long, and at first, when its drift is not
//! known well. A doubt is a bound that is too large in as many answers in a row as begin a run.
//!
//! [`clock_sync`]: simulation::math::clock_sync

use std::fmt;

use controller::TICK_NANOS;
use estimator::CameraDescription;
use simulation::math::clock_sync::BoardClock;
use simulation::math::count::real;

use super::clock_bound::{WITHIN_BOUND, bound_nanos};
use super::serial_run::FIRST_QUESTIONS;

/// Standard deviations of a time stamp that a bound may be.
const SIGMAS: f64 = 3.0;

/// A clock that is known less well than the filters are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockDoubt {
    /// Bound of the error of the board's clock, in us of the board.
    pub bound_us: f64,
    /// What the filters are told, in us: three standard deviations of a stamp, the bound of the clock's error, and the
    /// tick by which the board counts.
    pub allowed_us: f64,
}

impl fmt::Display for ClockDoubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bound_us, allowed_us } = self;
        let error_s = (bound_us * WITHIN_BOUND).ceil() * 1e-6;
        write!(
            f,
            "the board's clock is known to {bound_us:.0} us, and the filters are told of {allowed_us:.0} us: a rotor \
             at 100 deg/s turns by {:.0} mdeg meanwhile; hint: a line with shorter round trips, or tell the filters by \
             --set estimator.assumed.camera.clock_error_s={error_s:.6}",
            0.1 * bound_us
        )
    }
}

/// Looks at the clock until there is a doubt, once.
#[derive(Clone, Copy, Debug)]
pub(super) struct StampWatch {
    allowed_nanos: Option<f64>,
    /// Answers in a row after which the bound was more.
    doubted: u32,
}

impl StampWatch {
    /// Of frames of `camera`, as the board was described it.
    pub(super) fn new(camera: &CameraDescription) -> Self {
        let stamps_nanos = 1e9 * SIGMAS * f64::from(camera.stamp_sd_s);
        let clock_nanos = 1e3 * f64::from(camera.clock_sd_micros) / WITHIN_BOUND;
        Self { allowed_nanos: Some(stamps_nanos + clock_nanos + real(TICK_NANOS)), doubted: 0 }
    }

    /// Of frames whose instants are by the board's clock.
    pub(super) fn none() -> Self {
        Self { allowed_nanos: None, doubted: 0 }
    }

    /// Looks at what is known of the board's clock after an answer at `now` of the host's: a doubt is told once.
    pub(super) fn look(&mut self, clock: Option<BoardClock>, now: i64) -> Option<ClockDoubt> {
        let bound_nanos = bound_nanos(&clock?, now);
        self.doubted = if bound_nanos > self.allowed_nanos? { self.doubted + 1 } else { 0 };
        let is_doubt = self.doubted == FIRST_QUESTIONS;
        let allowed_nanos = self.allowed_nanos.take_if(|_| is_doubt)?;
        Some(ClockDoubt { bound_us: 1e-3 * bound_nanos, allowed_us: 1e-3 * allowed_nanos })
    }
}

#[cfg(test)]
mod tests {
    use simulation::math::clock_sync::{ClockSync, Exchange};
    use simulation::scene::Scene;
    use simulation::world::instruments::assumed;

    use super::*;

    /// The clock of one exchange of so many us, which knows it to half of that and half a tick of 10 us.
    fn clock(round_trip_us: i64) -> Option<BoardClock> {
        let mut sync = ClockSync::default();
        sync.add(Exchange { sent_nanos: 0, received_nanos: 1000 * round_trip_us, ticks: 7 });
        sync.at(0)
    }

    fn watch_of(set: &str) -> StampWatch {
        StampWatch::new(&assumed(&Scene::of_sets(&[set.to_owned()]).unwrap()).camera)
    }

    fn watch(jitter: &str) -> StampWatch {
        watch_of(&format!("camera.stamp_jitter_s={jitter}"))
    }

    /// What is told after so many answers as make a doubt.
    fn told(watch: &mut StampWatch, clock: Option<BoardClock>) -> Option<ClockDoubt> {
        let early: Vec<_> = (1..FIRST_QUESTIONS).filter_map(|_| watch.look(clock, 0)).collect();
        assert_eq!(early, []);
        watch.look(clock, 0)
    }

    /// Up to three standard deviations and a tick nothing is told, beyond that once. A clock that is not known is not
    /// doubted.
    #[test]
    fn exact_a_clock_beyond_the_stamps_is_told_once() {
        let mut exact = watch("0");
        assert_eq!((told(&mut exact, None), told(&mut exact, clock(10))), (None, None));
        let doubt = told(&mut exact, clock(1000)).unwrap();
        assert!((doubt.bound_us - 505.0).abs() < 1e-9 && (doubt.allowed_us - 10.0).abs() < 1e-9, "{doubt:?}");
        assert_eq!(told(&mut exact, clock(1000)), None);
        let mut jittered = watch("1e-4");
        assert_eq!(told(&mut jittered, clock(609)), None);
        assert!(told(&mut jittered, clock(611)).is_some());
        assert_eq!(told(&mut StampWatch::none(), clock(1_000_000)), None);
    }

    /// One answer within what is allowed begins the count anew.
    #[test]
    fn exact_a_clock_that_recovers_is_not_doubted() {
        let mut watch = watch("0");
        for _ in 0..3 {
            assert!((1..FIRST_QUESTIONS).all(|_| watch.look(clock(1000), 0).is_none()));
            assert_eq!(watch.look(clock(10), 0), None);
        }
        assert!(told(&mut watch, clock(1000)).is_some());
    }

    /// In 505 us a rotor at 100 deg/s turns by 50.5 mdeg. The error of the hint is enough.
    #[test]
    fn exact_what_is_told_of_a_doubt() {
        let text = told(&mut watch("0"), clock(1000)).unwrap().to_string();
        let expected = "the board's clock is known to 505 us, and the filters are told of 10 us: a rotor at 100 deg/s \
                        turns by 50 mdeg meanwhile; hint: a line with shorter round trips, or tell the filters by \
                        --set estimator.assumed.camera.clock_error_s=0.000292";
        assert_eq!(text, expected);
        let told = |set: &str| told(&mut watch_of(set), clock(1000));
        assert_eq!(told("estimator.assumed.camera.clock_error_s=0.000292"), None);
        assert!(told("estimator.assumed.camera.clock_error_s=0.000285").is_some());
    }
}
