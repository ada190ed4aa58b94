//! Whether the vibrometer's scale is right: between impacts a rotor falls by g, which no camera has to tell.
//!
//! The detector expects the fall `g t` and averages what the samples show beside it. Of a scale that is off by the part e they show `e g t`, of which an average over the first n samples of
//! period h, and over n from then on, has followed until t
//!
//! ```text
//! moved = e F,    F = g t / 2   for t < n h,    F = g (t - n h (1 - n h / 2 t))   from then on
//! ```
//!
//! (the lag rises from a half of the window to all of it; this is within 6 % of the exponential). So e is the least-squares slope of `moved` on `F` over the last flights, good to
//! `sigma sqrt(1 + p) / sqrt(sum F^2)`. A scale that is wrong by a half lets gravity itself pass for impacts, or for falls, which cut flights to little more than n samples, where F is 1 mm/s: sixteen of them
//! tell the slope to 0.05. Longer ones count no more than that many, so that none outweighs what came since.
//!
//! A rotor pressed on the teeth does not fall, and would look like a vibrometer that shows too little. So a flight counts only if a blow of [`LAUNCH_M_S`] began it: at low drive in mode C there is none, and
//! the scale remains untold.

use motor_model::{Real, Time};

/// Jump that lifts a rotor off the teeth for a millisecond, in m/s; one that is pressed down is heard every 0.2 ms as a jump of 2 mm/s.
const LAUNCH_M_S: f64 = 0.005;
/// Expected fall beyond which a longer flight counts no more, in m/s.
const FALL_MOST_M_S: f64 = 0.002;
/// Flights over which the slope is taken.
const FLIGHTS: f64 = 16.0;
/// A slope beyond this is a wrong scale: half of the half that makes a filter wrong, and more than any motor's damping or an unheard impact brings about.
const WRONG: f64 = 0.25;
/// A scale found to be wrong is right again at a slope within this: three standard errors.
const RIGHT: f64 = 0.15;
/// Standard error of the slope from which on it is believed: a fifth of that.
const STANDARD_ERROR: f64 = 0.05;

/// Flights, and what the samples have shown in them beside the fall.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeFall<T> {
    /// When the flight began, if a blow began it.
    begun: Option<Time>,
    /// Running sums of `moved F` and `F^2`, in m^2/s^2.
    shown_m2_s2: T,
    expected_m2_s2: T,
    /// Whether the slope that they make is beyond [`WRONG`].
    wrong: bool,
}

impl<T: Real> FreeFall<T> {
    /// No flight yet.
    pub(super) fn new() -> Self {
        Self { begun: None, shown_m2_s2: T::zero(), expected_m2_s2: T::zero(), wrong: false }
    }

    /// A flight begins at `at`, after a jump of `jump_m_s`.
    pub(super) fn begin(&mut self, at: Time, jump_m_s: T) {
        self.begun = (jump_m_s > T::from_f64(LAUNCH_M_S)).then_some(at);
    }

    /// The flight has ended: by `at` the samples, of noise `noise_m_s`, have moved the velocity by `moved_m_s` beside a fall of `gravity_m_s2`, averaged over `window_s`.
    pub(super) fn end(&mut self, at: Time, moved_m_s: T, gravity_m_s2: T, window_s: T, noise_m_s: T) {
        let Some(begun) = self.begun.take() else { return };
        let flight_s: T = at.seconds_since(begun);
        let half = T::from_f64(0.5);
        let followed_s = if flight_s < window_s {
            half * flight_s
        } else {
            flight_s - window_s * (T::one() - half * window_s / flight_s)
        };
        let (followed_m_s, most_m_s) = (gravity_m_s2 * followed_s, T::from_f64(FALL_MOST_M_S));
        let (expected_m_s, moved_m_s) = if followed_m_s < most_m_s {
            (followed_m_s, moved_m_s)
        } else {
            (most_m_s, moved_m_s * (most_m_s / followed_m_s))
        };
        let kept = T::from_f64(1.0 - 1.0 / FLIGHTS);
        self.shown_m2_s2 = kept * self.shown_m2_s2 + moved_m_s * expected_m_s;
        self.expected_m2_s2 = kept * self.expected_m2_s2 + expected_m_s * expected_m_s;
        let least_m_s = noise_m_s * T::from_f64(1.0 / STANDARD_ERROR);
        let limit = T::from_f64(if self.wrong { RIGHT } else { WRONG });
        self.wrong = self.expected_m2_s2 > least_m_s * least_m_s
            && self.shown_m2_s2.abs() > limit * self.expected_m2_s2;
    }

    /// Whether the vibrometer's scale is wrong.
    #[inline]
    pub(super) fn is_wrong(&self) -> bool {
        self.wrong
    }
}
