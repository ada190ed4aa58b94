//! Whether the vibrometer's scale is right: between impacts the rotor falls by g.
//!
//! The detector predicts the fall `g t` and averages the innovations of the samples. If the scale is off by the part
//! e, the innovations are `e g t`. Their average over the first n samples of period h, and over n from then on, is at
//! time t
//!
//! ```text
//! drift = e F,    F = g t / 2   for t < n h,    F = g (t - n h (1 - n h / 2 t))   from then on
//! ```
//!
//! (The lag rises from a half of the window to all of it; this is within 6 % of the exponential.) So e is the
//! least-squares slope of `drift` on `F` over the last flights, with the standard error
//! `sigma sqrt(1 + p) / sqrt(sum F^2)`. A scale that is off by a half makes impacts or falls of gravity itself, which
//! cut flights to little more than n samples, where F is 1 mm/s: sixteen of them give the slope to 0.05. Longer ones
//! are scaled to F = 2 mm/s, so that none outweighs the flights after it.
//!
//! A rotor in sustained contact does not fall either, and would look like a vibrometer that shows too little. So a
//! flight counts only if a jump of [`LAUNCH_M_S`] began it. At low drive in mode C there is none, and the scale is not
//! tested.

use motor_model::{Real, Time};

/// Least jump that lifts the rotor off the teeth for a millisecond, in m/s: `2 v / g`. Sustained contact appears as
/// jumps of 2 mm/s every 0.2 ms.
const LAUNCH_M_S: f64 = 0.005;
/// Expected drift beyond which a longer flight counts no more, in m/s: twice that of one window.
const DRIFT_MAX_M_S: f64 = 0.002;
/// Flights over which the slope is taken.
const FLIGHTS: f64 = 16.0;
/// Slope beyond which the scale is wrong: half of the error of a half that spoils a filter, and more than any motor's
/// damping or an undetected impact brings about.
const WRONG: f64 = 0.25;
/// Slope within which a wrong scale is right again: three standard errors.
const RIGHT: f64 = 0.15;
/// Standard error from which on the slope is used: a fifth of [`WRONG`].
const STANDARD_ERROR: f64 = 0.05;

/// Running least-squares sums of the slope.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FreeFall<T> {
    /// When the flight began, if a jump of [`LAUNCH_M_S`] began it.
    begun: Option<Time>,
    /// Running sums of `drift F` and `F^2`, in m^2/s^2.
    product_m2_s2: T,
    square_m2_s2: T,
    /// Whether their slope is beyond [`WRONG`].
    wrong: bool,
}

impl<T: Real> FreeFall<T> {
    /// A flight begins at `at`, after a jump of `jump_m_s`.
    pub(super) fn begin(&mut self, at: Time, jump_m_s: T) {
        self.begun = (jump_m_s > T::from_f64(LAUNCH_M_S)).then_some(at);
    }

    /// The flight has ended at `at` with a drift of `drift_m_s` beside a fall by `gravity_m_s2`, averaged over
    /// `window_s`, from samples of noise `noise_m_s`.
    pub(super) fn end(&mut self, at: Time, drift_m_s: T, gravity_m_s2: T, window_s: T, noise_m_s: T) {
        let Some(begun) = self.begun.take() else { return };
        let flight_s: T = at.seconds_since(begun);
        let half = T::from_f64(0.5);
        let averaged_s = if flight_s < window_s {
            half * flight_s
        } else {
            flight_s - window_s * (T::one() - half * window_s / flight_s)
        };
        let (averaged_m_s, most_m_s) = (gravity_m_s2 * averaged_s, T::from_f64(DRIFT_MAX_M_S));
        let (expected_m_s, drift_m_s) = if averaged_m_s < most_m_s {
            (averaged_m_s, drift_m_s)
        } else {
            (most_m_s, drift_m_s * (most_m_s / averaged_m_s))
        };
        let kept = T::from_f64(1.0 - 1.0 / FLIGHTS);
        self.product_m2_s2 = kept * self.product_m2_s2 + drift_m_s * expected_m_s;
        self.square_m2_s2 = kept * self.square_m2_s2 + expected_m_s * expected_m_s;
        let least_m_s = noise_m_s * T::from_f64(1.0 / STANDARD_ERROR);
        let limit = T::from_f64(if self.wrong { RIGHT } else { WRONG });
        self.wrong =
            self.square_m2_s2 > least_m_s * least_m_s && self.product_m2_s2.abs() > limit * self.square_m2_s2;
    }

    pub(super) fn is_wrong(&self) -> bool {
        self.wrong
    }
}
