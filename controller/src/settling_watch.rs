//! What becomes of a rotor after the drive goes off: whether it turns on, lies still, or is measured better.
//!
//! The filter says when the rotor is at rest. Where it does not say so, the camera's frames decide, in windows from
//! [`RUN_OUT_NANOS`] after the drive went off, and not before two frames exposed since then have arrived: what is
//! predicted from frames of a driven rotor says nothing of it. With `d` the turn within a window and `s^2` the sum of
//! the variances of the angles at both of its ends:
//!
//! ```text
//! |d| > 5 s                                       the rotor turns
//! else                                            it lies still, as far as the camera can tell
//! any time: beyond the longest coast, rate > 5 s  the rotor turns, and does not stop as it should
//! ```
//!
//! A rotor that lies still is measured in windows of half a second or more. The information `1 / variance` grows
//! evenly with the frames, so that its growth in a window tells how long the rest takes:
//!
//! ```text
//! time to go = (1 / needed - 1 / variance) (window's length) / (growth of 1 / variance in the window)
//! ```

use estimator::Estimate;
use motor_model::{Angle, Time};

use crate::rest_filter::Resting;

/// Time in ns after the drive goes off in which a rotor may still turn, beside what frames take: twice what it takes to
/// stop from the highest rate at the smallest friction of Table 1.
const RUN_OUT_NANOS: u64 = 50_000_000;
/// Shortest window of measuring in ns: the time without progress after which a move says what it waits for.
const MEASURING_NANOS: u64 = 500_000_000;
/// Standard deviations beyond which a turn, or a rate, is significant. An assumption.
const SIGNIFICANT_SIGMAS: f32 = 5.0;

/// The longest way that a drive may turn the rotor on after it goes off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoastBound {
    /// Its direction, 1 clockwise or -1.
    pub direction: f32,
    /// Its length in rad.
    pub rad: f32,
}

/// The beginning of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WindowStart {
    pub(crate) at: Time,
    pub(crate) angle: Angle,
    pub(crate) angle_rad2: f32,
}

/// A rotor with the drive off.
#[derive(Clone, Copy, Debug)]
pub struct SettlingWatch {
    off: Option<(Time, Angle)>,
    coast: Option<CoastBound>,
    window: Option<WindowStart>,
    /// What the last window showed.
    shown: Shown,
    measuring: Option<WindowStart>,
    to_go_s: Option<f32>,
    /// Windows of measuring in a row that did not bring the end within reach.
    vain: u8,
}

/// What the camera has shown of a rotor that is not at rest by the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Nothing yet.
    Nothing,
    /// It turns, and longer than a coast takes; whether clockwise.
    Turns {
        /// Whether it turns clockwise.
        clockwise: bool,
    },
    /// It lies still.
    Still,
}

impl WindowStart {
    fn from(now: Time, estimate: &Estimate<f32>) -> Self {
        Self { at: now, angle: estimate.angle, angle_rad2: estimate.angle_rad2 }
    }
}

impl SettlingWatch {
    /// A drive that has just gone off, or none: the next estimate is the first.
    pub fn new(coast: Option<CoastBound>) -> Self {
        Self {
            off: None,
            coast,
            window: None,
            shown: Shown::Nothing,
            measuring: None,
            to_go_s: None,
            vain: 0,
        }
    }

    /// What the camera has shown by `now`, in windows `window_nanos` long, of a rotor that is not at rest by
    /// `estimate`. The next frame arrives at most `frame_wait_nanos` after the exposure of the last one.
    pub fn look(
        &mut self,
        window_nanos: u64,
        frame_wait_nanos: u64,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> Shown {
        let (off_at, from) = *self.off.get_or_insert((now, estimate.angle));
        let off_nanos = now.nanos_since(off_at);
        if off_nanos < 2 * frame_wait_nanos {
            return Shown::Nothing;
        }
        if off_nanos < RUN_OUT_NANOS + 2 * frame_wait_nanos {
            return self.coasts_on(from, estimate);
        }
        let start = *self.window.get_or_insert(WindowStart::from(now, estimate));
        if now.nanos_since(start.at) >= window_nanos {
            let turned_rad: f32 = estimate.angle.radians_since(start.angle);
            let limit_rad2 =
                SIGNIFICANT_SIGMAS * SIGNIFICANT_SIGMAS * (start.angle_rad2 + estimate.angle_rad2);
            self.shown = if turned_rad * turned_rad > limit_rad2 {
                Shown::Turns { clockwise: turned_rad > 0.0 }
            } else {
                Shown::Still
            };
            self.window = Some(WindowStart::from(now, estimate));
        }
        if self.shown == Shown::Nothing { self.coasts_on(from, estimate) } else { self.shown }
    }

    /// Whether the rotor is beyond its longest coast, and still turns that way.
    fn coasts_on(&self, from: Angle, estimate: &Estimate<f32>) -> Shown {
        let Some(CoastBound { direction, rad }) = self.coast else { return Shown::Nothing };
        let limit = SIGNIFICANT_SIGMAS * SIGNIFICANT_SIGMAS;
        let rate_rad_s = direction * estimate.rate_rad_s;
        if rate_rad_s <= 0.0 || rate_rad_s * rate_rad_s <= limit * estimate.rate_rad2_s2 {
            return Shown::Nothing;
        }
        let beyond_rad = direction * estimate.angle.radians_since::<f32>(from) - rad;
        let beyond = beyond_rad > 0.0 && beyond_rad * beyond_rad > limit * estimate.angle_rad2;
        if beyond { Shown::Turns { clockwise: direction > 0.0 } } else { Shown::Nothing }
    }

    /// The next call of [`Self::measure`] begins a window: no frame has come in the one under way.
    pub fn begin_measuring_anew(&mut self) {
        self.measuring = None;
    }

    /// Measures a rotor at rest until its variance is `needed_rad2`, in windows of at least `window_nanos`. Answers the
    /// time to go, and whether that exceeds `left_s` in two windows in a row; zero or less of `needed_rad2` cannot be
    /// reached.
    pub fn measure(
        &mut self,
        needed_rad2: f32,
        left_s: f32,
        window_nanos: u64,
        now: Time,
        resting: &Resting,
    ) -> (Option<f32>, bool) {
        let begun = WindowStart { at: now, angle: resting.angle, angle_rad2: resting.angle_rad2 };
        let start = *self.measuring.get_or_insert(begun);
        let length_nanos = now.nanos_since(start.at);
        if length_nanos >= window_nanos.max(MEASURING_NANOS) {
            let information = 1.0 / resting.angle_rad2;
            let growth = information - 1.0 / start.angle_rad2;
            let missing = 1.0 / needed_rad2 - information;
            let to_go_s = now.seconds_since::<f32>(start.at) * missing / growth;
            let vain = needed_rad2 <= 0.0 || growth <= 0.0 || to_go_s > left_s;
            self.vain = if vain { self.vain.saturating_add(1) } else { 0 };
            self.to_go_s = (needed_rad2 > 0.0 && growth > 0.0).then_some(to_go_s.max(0.0));
            self.measuring = Some(begun);
        }
        (self.to_go_s, self.vain >= 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest_filter::tests::estimate;

    const WINDOW: u64 = 100_000_000;

    fn moving(mdeg: f64, rate_rad_s: f32) -> Estimate<f32> {
        Estimate { rate_rad_s, rate_rad2_s2: 1e-2, resting: false, ..estimate(mdeg, 10.0) }
    }

    fn at(nanos: u64) -> Time {
        Time::from_nanos(nanos)
    }

    /// 10 milli-degrees at both ends: 71 are five standard deviations.
    #[test]
    fn exact_a_window_after_the_coast_tells_still_from_turning() {
        for (turned_mdeg, shown) in [
            (70.0, Shown::Still),
            (72.0, Shown::Turns { clockwise: true }),
            (-72.0, Shown::Turns { clockwise: false }),
        ] {
            let mut watch = SettlingWatch::new(None);
            for (nanos, mdeg) in [(0, -9e3), (RUN_OUT_NANOS - 1, 0.0), (RUN_OUT_NANOS, 0.0)] {
                assert_eq!(watch.look(WINDOW, 0, at(nanos), &moving(mdeg, 0.0)), Shown::Nothing);
            }
            assert_eq!(
                watch.look(WINDOW, 0, at(RUN_OUT_NANOS + WINDOW - 1), &moving(turned_mdeg, 0.0)),
                Shown::Nothing
            );
            assert_eq!(watch.look(WINDOW, 0, at(RUN_OUT_NANOS + WINDOW), &moving(turned_mdeg, 0.0)), shown);
        }
    }

    /// Until two frames exposed with the drive off are there, nothing is shown, however far the prediction goes.
    #[test]
    fn law_a_prediction_from_driven_frames_shows_nothing() {
        const FRAME: u64 = 40_000_000;
        let mut watch = SettlingWatch::new(Some(CoastBound { direction: 1.0, rad: 0.01 }));
        for (nanos, mdeg, shown) in [
            (0, 0.0, Shown::Nothing),
            (2 * FRAME - 1, 90e3, Shown::Nothing),
            (2 * FRAME, 90e3, Shown::Turns { clockwise: true }),
            (2 * FRAME + RUN_OUT_NANOS, 10.0, Shown::Nothing),
            (2 * FRAME + RUN_OUT_NANOS + WINDOW, 10.0, Shown::Still),
        ] {
            assert_eq!(watch.look(WINDOW, FRAME, at(nanos), &moving(mdeg, 15.0)), shown, "{nanos}");
        }
    }

    /// A rotor that passes its longest coast is noticed at once, if it is known to turn on.
    #[test]
    fn exact_beyond_the_longest_coast_a_rotor_turns_on() {
        let coast = CoastBound { direction: -1.0, rad: 1_f32.to_radians() };
        for (mdeg, rate_rad_s, turns) in
            [(-1049.0, -2.0, false), (-1051.0, -2.0, true), (-1051.0, -0.4, false), (3000.0, 2.0, false)]
        {
            let mut watch = SettlingWatch::new(Some(coast));
            watch.look(WINDOW, 0, at(0), &moving(0.0, -10.0));
            let shown = watch.look(WINDOW, 0, at(10_000), &moving(mdeg, rate_rad_s));
            let expected = if turns { Shown::Turns { clockwise: false } } else { Shown::Nothing };
            assert_eq!(shown, expected, "{mdeg} {rate_rad_s}");
        }
    }

    /// From 1 to 1/2 in a window: of the information 10 that is needed 8 are missing, 8 windows.
    #[test]
    fn exact_information_grows_evenly() {
        let of = |angle_rad2: f32| Resting { angle: Angle::ZERO, angle_rad2 };
        let mut watch = SettlingWatch::new(None);
        assert_eq!(watch.measure(0.1, 3.9, WINDOW, at(0), &of(1.0)), (None, false));
        let (to_go_s, given_up) = watch.measure(0.1, 3.9, WINDOW, at(500_000_000), &of(0.5));
        assert!((to_go_s.unwrap() - 4.0).abs() < 1e-5 && !given_up);
        // The next window needs 3.5 s more, of 3.4 s left.
        let (to_go_s, given_up) = watch.measure(0.1, 3.4, WINDOW, at(1_000_000_000), &of(1.0 / 3.0));
        assert!((to_go_s.unwrap() - 3.5).abs() < 1e-5 && given_up);
    }

    /// A window in which the variance falls begins the count of those in vain anew.
    #[test]
    fn exact_windows_in_vain_count_in_a_row() {
        let mut watch = SettlingWatch::new(None);
        let windows = [(1.0, false), (1.0, false), (0.5, false), (0.5, false), (0.5, true)];
        for ((angle_rad2, given_up), n) in windows.into_iter().zip(0_u64..) {
            let seen = Resting { angle: Angle::ZERO, angle_rad2 };
            assert_eq!(watch.measure(0.1, 1e9, WINDOW, at(500_000_000 * n), &seen).1, given_up, "{n}");
        }
    }

    /// A variance that does not fall, and one below zero that is asked for.
    #[test]
    fn law_what_cannot_be_measured_is_noticed_in_two_windows() {
        for (needed_rad2, fall) in [(1e-9, 1.0), (-1e-9, 0.5), (0.0, 0.5)] {
            let mut watch = SettlingWatch::new(None);
            let mut given_up = false;
            for n in 0..3 {
                assert!(!given_up, "{needed_rad2} {n}");
                let seen = Resting { angle: Angle::ZERO, angle_rad2: 1e-6 * f32::powi(fall, n) };
                let now = at(500_000_000 * u64::from(n.unsigned_abs()));
                given_up = watch.measure(needed_rad2, 1e9, WINDOW, now, &seen).1;
            }
            assert!(given_up, "{needed_rad2}");
        }
    }
}
