//! How the rotor falls in flight: the scale of the vibrometer and the damping of the film.
//!
//! Gravity is the same in every laboratory, and the detector predicts each sample of a flight from those before it. Its
//! innovations show what it has wrong. A vibrometer whose scale is off by the part `e`, over a film whose damping
//! `b = b_z / m_r` is off by `d`, shows a velocity that falls too fast by
//!
//! ```text
//! s = e g + d v                                                        (14a) with what is assumed taken away
//! ```
//!
//! The velocity in flight is an average, and an average lags behind a slope by a time that depends on the weight `w`
//! of the newest sample alone. With samples every `h` an innovation is
//!
//! ```text
//! i = -tau s + noise,    tau = lag + h,    lag <- (1 - w) tau,    0 at the first sample of a flight
//! ```
//!
//! So e and d are the two states of a Kalman filter with the measurements `i = -tau (g e + v d)` and no noise of their
//! own. It is kept as its information matrix, to which a flight adds sums. At the end of a flight both estimates are
//! taken into use, and both states are zero again.
//!
//! | index | symbol | unit | meaning | prior standard deviation |
//! |---|---|---|---|---|
//! | 0 | `e` | 1 | scale of the vibrometer less that in use, per that in use | 0.1 |
//! | 1 | `d` | 1/s | damping of the film less that in use | half of its nominal value |
//!
//! The noise of an innovation counts as independent. Beyond the window the samples that follow take a part of it back,
//! so both states are known better than said.
//!
//! A flight of 4 ms at 0.2 mm/s of noise gives e to 0.004 and d to a few 1/s. What is older than some
//! [`FLIGHTS`] flights is forgotten, so that a scale that drifts is followed.
//!
//! A scale that jumps is another matter. The slope of the last [`RECENT_FLIGHTS`] flights alone, `sum -tau i g` per
//! `sum (tau g)^2`, shows it. Long flights count for no more than short ones, to which a wrong scale cuts them: it
//! makes impacts or falls of gravity itself. Beyond [`WRONG`] the slope is taken into use at once, and both states have
//! their prior again. A scale that was moved by more than [`RIGHT`] counts as wrong until the flights that follow are
//! within that: the impacts before have spoilt what a filter took from them.
//!
//! A rotor in sustained contact does not fall, and one that hops is pushed by impacts below the threshold. So a flight
//! counts only if a jump of [`LAUNCH_M_S`] began it, and only until the rotor falls with half of the speed at which it
//! rose: at three quarters of its height above the teeth it meets none.

use motor_model::Real;
use ud_filter::{is_finite, reciprocal};

/// Least jump that lifts the rotor off the teeth for a millisecond, in m/s: `2 v / g`. Sustained contact appears as
/// jumps of 2 mm/s every 0.2 ms.
const LAUNCH_M_S: f64 = 0.005;
/// Flights over which both states are averaged: a quarter of a second in mode B.
const FLIGHTS: f64 = 64.0;
/// Flights that tell of a jump of the scale.
const RECENT_FLIGHTS: f64 = 5.0;
/// Slope beyond which the scale is wrong: half of the error of a half that spoils a filter, and more than an undetected
/// impact brings about.
const WRONG: f64 = 0.25;
/// Slope within which a corrected scale is right: three standard errors.
const RIGHT: f64 = 0.15;
/// Standard error from which on the slope is used, a fifth of [`WRONG`], and that of one flight at least: four flights.
const STANDARD_ERROR: f64 = 0.05;
const STANDARD_ERROR_OF_ONE: f64 = 0.1;
/// Prior standard deviation of the scale error, and of the damping as a part of its nominal value, which Table 1 gives
/// as the upper end of a range of six to one.
const SCALE_PRIOR: f64 = 0.1;
const DAMPING_PRIOR: f64 = 0.5;
/// Least scale that a flight may teach: beyond it the rotor does not fall at all.
const LEAST_SCALE: f64 = 0.1;
/// Least prior of the damping in 1/s, of a motor that is said to have none.
const DAMPING_LEAST_PER_S: f64 = 1.0;

/// A symmetric matrix of two rows, and a vector.
#[derive(Clone, Copy, Debug, Default)]
struct Sums<T> {
    scale: T,
    both: T,
    damping: T,
    by_scale: T,
    by_damping: T,
}

/// What a flight has taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taught<T> {
    /// Scale of the vibrometer per that in use.
    pub(super) scale: T,
    /// Damping of the film less that in use, in 1/s.
    pub(super) damping_per_s: T,
}

/// The two states, and the sums of the flight that goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FreeFall<T> {
    gravity_m_s2: T,
    /// Information of the prior: of the scale, of both, of the damping.
    prior: [T; 3],
    /// Information of the flights before this one, with that of the prior.
    information: [T; 3],
    /// Sums over this flight, of `tau^2 (1, v, v^2)` and `-tau i (1, v)`.
    flight: Sums<T>,
    /// Time by which the average lags behind a slope.
    lag_s: T,
    /// Velocity below which this flight counts no more, in m/s; `None` if none of it does.
    counts_above_m_s: Option<T>,
    /// Sums over the last flights, `-tau i g` and `(tau g)^2`, in m^2/s^2.
    recent_product_m2_s2: T,
    recent_square_m2_s2: T,
    /// Sum of the corrections of the scale over the last flights.
    moved: T,
    /// Whether the scale in use has been wrong and is not proven since.
    pub(super) wrong: bool,
}

impl<T: Real> FreeFall<T> {
    /// Nothing known beside the prior, of a rotor that falls by `gravity_m_s2` and has a nominal damping of
    /// `damping_per_s`.
    pub(super) fn new(gravity_m_s2: T, damping_per_s: T) -> Self {
        let damping = (damping_per_s * T::from_f64(DAMPING_PRIOR)).at_least(T::from_f64(DAMPING_LEAST_PER_S));
        let scale = T::from_f64(1.0 / (SCALE_PRIOR * SCALE_PRIOR));
        let prior = [scale, T::zero(), T::one() / (damping * damping)];
        Self { gravity_m_s2, prior, information: prior, ..Self::default() }
    }

    /// A flight begins at `velocity_m_s`, after a jump of `jump_m_s`.
    #[inline]
    pub(super) fn begin(&mut self, velocity_m_s: T, jump_m_s: T) {
        let launched = jump_m_s > T::from_f64(LAUNCH_M_S);
        self.counts_above_m_s = launched.then_some(T::from_f64(-0.5) * velocity_m_s);
        self.lag_s = T::zero();
    }

    /// A sample `since_s` after the one before was off its prediction of `velocity_m_s` by `innovation_m_s`, and taken
    /// into the average with `weight`.
    #[inline]
    pub(super) fn take(&mut self, since_s: T, velocity_m_s: T, innovation_m_s: T, weight: T) {
        let Some(least_m_s) = self.counts_above_m_s else { return };
        if velocity_m_s < least_m_s {
            self.counts_above_m_s = None;
            return;
        }
        let tau = self.lag_s + since_s;
        self.lag_s = tau - weight * tau;
        let (square, product) = (tau * tau, tau * innovation_m_s);
        let sums = &mut self.flight;
        sums.scale += square;
        sums.both += square * velocity_m_s;
        sums.damping += square * velocity_m_s * velocity_m_s;
        sums.by_scale -= product;
        sums.by_damping -= product * velocity_m_s;
    }

    /// The flight that goes on does not count.
    pub(super) fn leave_out_flight(&mut self) {
        (self.counts_above_m_s, self.flight, self.lag_s) = (None, Sums::default(), T::zero());
    }

    /// The flight has ended, of samples with the variance `sample_m2_s2`. What it has taught, if it counted.
    pub(super) fn end(&mut self, sample_m2_s2: T) -> Option<Taught<T>> {
        self.counts_above_m_s = None;
        let flight = core::mem::take(&mut self.flight);
        let finite = is_finite(flight.by_scale + flight.by_damping);
        let counted = finite && flight.scale > T::zero() && sample_m2_s2 > T::zero();
        if !counted {
            return None;
        }
        self.jump(&flight, sample_m2_s2)
            .or_else(|| self.update(&flight, T::one() / sample_m2_s2))
            .filter(|taught| taught.scale > T::from_f64(LEAST_SCALE) && taught.damping_per_s.abs() <= T::MAX)
    }

    /// Whether the last flights show a scale far from the one in use; if so, that scale.
    fn jump(&mut self, flight: &Sums<T>, sample_m2_s2: T) -> Option<Taught<T>> {
        let (g, kept) = (self.gravity_m_s2, T::from_f64(1.0 - 1.0 / RECENT_FLIGHTS));
        let variances =
            |standard_error: f64| sample_m2_s2 * T::from_f64(1.0 / (standard_error * standard_error));
        let (product, square, most) =
            (g * flight.by_scale, g * g * flight.scale, variances(STANDARD_ERROR_OF_ONE));
        let part = if square > most { most / square } else { T::one() };
        self.recent_product_m2_s2 = kept * self.recent_product_m2_s2 + part * product;
        self.recent_square_m2_s2 = kept * self.recent_square_m2_s2 + part * square;
        let known = self.recent_square_m2_s2 > variances(STANDARD_ERROR);
        let slope = self.recent_product_m2_s2 / self.recent_square_m2_s2;
        if !known {
            return None;
        }
        if self.wrong && slope.abs() < T::from_f64(RIGHT) {
            (self.wrong, self.moved) = (false, T::zero());
        }
        let jumped = slope.abs() > T::from_f64(WRONG);
        jumped.then(|| {
            self.information = self.prior;
            (self.recent_product_m2_s2, self.recent_square_m2_s2) = (T::zero(), T::zero());
            self.wrong = true;
            Taught { scale: T::one() + slope, damping_per_s: T::zero() }
        })
    }

    /// Update of both states by the sums of a flight.
    fn update(&mut self, flight: &Sums<T>, per_variance: T) -> Option<Taught<T>> {
        let (g, kept) = (self.gravity_m_s2, T::from_f64(1.0 - 1.0 / FLIGHTS));
        let forgotten = T::one() - kept;
        let ([p_scale, _, p_damping], [i_scale, i_both, i_damping]) = (self.prior, self.information);
        let scale = kept * i_scale + forgotten * p_scale + g * g * flight.scale * per_variance;
        let both = kept * i_both + g * flight.both * per_variance;
        let damping = kept * i_damping + forgotten * p_damping + flight.damping * per_variance;
        let (by_scale, by_damping) = (g * flight.by_scale * per_variance, flight.by_damping * per_variance);
        let per_determinant = reciprocal(scale * damping - both * both)?;
        self.information = [scale, both, damping];
        let error = (damping * by_scale - both * by_damping) * per_determinant;
        self.moved = kept * self.moved + error;
        self.wrong |= self.moved.abs() > T::from_f64(RIGHT);
        // What is corrected now, later flights do not show.
        self.recent_product_m2_s2 -= error * self.recent_square_m2_s2;
        let damping_per_s = (scale * by_damping - both * by_scale) * per_determinant;
        Some(Taught { scale: T::one() + error, damping_per_s })
    }

    /// Variance of the scale's error after the last flight, by the information.
    #[cfg(test)]
    pub(super) fn scale_variance(&self) -> T {
        let [scale, both, damping] = self.information;
        damping / (scale * damping - both * both)
    }
}
