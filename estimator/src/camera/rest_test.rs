//! Whether a quiet and slow rotor has stopped: the hypothesis of a rate of zero, against the frames.
//!
//! A quiet rotor whose estimated rate has been small for a while may lie still, or turn on without friction. The
//! frames of the second half of that time decide: their least-squares slope and its variance are
//!
//! ```text
//! slope = sum (t - mean t) y / S,    variance = R / S,    S = sum t^2 - (sum t)^2 / n
//! ```
//!
//! The rotor is at rest if the slope is within four standard deviations of zero. The time is such that the standard
//! deviation is 0.15 rad/s, a tenth of the rate at which friction stops a rotor in that time:
//!
//! ```text
//! half time T:   12 R dt / T^3 = (0.15 rad/s)^2
//! ```
//!
//! A slope that is not zero, or a rotor at rest that the frames show to have moved, withdraws the hypothesis. After
//! four slopes, or one withdrawal, the next test takes twice the time, up to 32 times: the standard deviation falls by
//! 2.8 each time. Where the vibrometer still shows a flight it takes at least eight times: a rotor that tilts goes on
//! bouncing when one of this design has long come to lie. So a rotor that coasts without friction is not called at rest
//! for more than a small part of the time, and a slower one is found out as well. The next drive ends this.

use motor_model::{Angle, Real, Time};

/// Standard deviation of the slope, in rad/s.
pub(crate) const SLOPE_RAD_S: f64 = 0.15;
/// Least time at rest in s: in it the least friction of Table 1 stops a rotor of 2 rad/s.
const LEAST_S: f64 = 3.4e-3;
/// Least number of frames: two of them give a slope.
const FRAMES_MIN: f64 = 4.0;
/// Square of the standard deviations within which the slope is zero.
const GATE: f64 = 16.0;
/// Variance of a slope that the ringing of the stator causes, in rad^2/s^2: twice 0.6 mrad/s.
const RINGING_RAD2_S2: f64 = 1.4e-6;
/// What each contradiction counts, and how many double the time.
const WITHDRAWN: u8 = 4;
const CONTRADICTIONS_MAX: u8 = 23;
/// Doublings of the time where the vibrometer shows a motion.
const DISPUTED_DOUBLINGS: u8 = 3;

/// Frames that conclude rest, of a camera of this variance in rad^2 and period in s.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 4 and 1,000")]
#[inline(never)]
pub(crate) fn resting_frames(variance_rad2: f64, period_s: f64) -> u16 {
    let half_s3 = 12.0 * variance_rad2 * period_s / (SLOPE_RAD_S * SLOPE_RAD_S);
    let half_s = motor_model::math::exp(motor_model::math::ln(half_s3) / 3.0);
    // A hundredth of a frame for rounding; NaN, of a variance of zero, is the least.
    let frames = (LEAST_S / period_s).max(2.0 * half_s / period_s) + 0.99;
    frames.clamp(FRAMES_MIN, 1000.0) as u16
}

/// The frames of a rotor that may have stopped.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestTest<T> {
    first: Option<(Time, Angle)>,
    newest: Time,
    n: T,
    t: T,
    tt: T,
    y: T,
    ty: T,
    contradictions: u8,
    /// Whether the vibrometer shows a flight.
    disputed: bool,
}

impl<T: Real> RestTest<T> {
    /// Without frames.
    pub(crate) fn new() -> Self {
        let zero = T::zero();
        Self {
            first: None,
            newest: Time::ZERO,
            n: zero,
            t: zero,
            tt: zero,
            y: zero,
            ty: zero,
            contradictions: 0,
            disputed: false,
        }
    }

    /// Frames of which the second half is tested.
    #[inline]
    pub(crate) fn frames(&self, resting_frames: u16) -> u16 {
        let doublings =
            (self.contradictions / WITHDRAWN).max(if self.disputed { DISPUTED_DOUBLINGS } else { 0 });
        resting_frames.saturating_mul(1 << doublings)
    }

    /// The vibrometer shows a motion.
    #[inline]
    pub(crate) fn dispute(&mut self, disputed: bool) {
        self.disputed = disputed;
    }

    /// The rotor is driven: it may stop anew.
    #[inline]
    pub(crate) fn forget(&mut self) {
        *self = Self::new();
    }

    /// Begins the second half anew.
    pub(crate) fn begin(&mut self) {
        *self = Self { contradictions: self.contradictions, disputed: self.disputed, ..Self::new() };
    }

    /// The frames contradict rest.
    pub(crate) fn withdraw(&mut self) {
        self.contradictions = self.contradictions.saturating_add(WITHDRAWN).min(CONTRADICTIONS_MAX);
        self.begin();
    }

    /// Takes in a frame. One that is not newer begins anew: the tracker has gone back for a late one.
    pub(crate) fn take(&mut self, at: Time, angle: Angle) {
        if self.first.is_some() && at <= self.newest {
            self.begin();
        }
        self.newest = at;
        let (first_at, first_angle) = *self.first.get_or_insert((at, angle));
        let t: T = at.seconds_since(first_at);
        let y: T = angle.minus(first_angle).wrapped().radians_since(Angle::ZERO);
        self.n += T::one();
        self.t += t;
        self.tt += t * t;
        self.y += y;
        self.ty += t * y;
    }

    /// Whether the slope is zero, at frames of this variance. If not, the next half begins.
    pub(crate) fn confirms(&mut self, camera_rad2: T) -> bool {
        let spread = self.tt * self.n - self.t * self.t;
        let product = self.ty * self.n - self.t * self.y;
        // slope = product / spread, its variance camera_rad2 n / spread. Written so that too few frames fail.
        let limit = T::from_f64(GATE)
            * (camera_rad2 * self.n * spread + T::from_f64(RINGING_RAD2_S2) * spread * spread);
        let confirms = self.n >= T::from_f64(2.0) && product * product <= limit;
        if !confirms {
            self.contradictions = self.contradictions.saturating_add(1).min(CONTRADICTIONS_MAX);
            self.begin();
        }
        confirms
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruments::CameraDescription;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// 34 frames of the default camera, as a sum by hand: 12 x 8.766e-8 x 1e-4 / 0.0225 = (1.672 ms)^3.
    #[test]
    fn exact_frames_of_the_default_and_of_extreme_cameras() {
        let default = CameraDescription::default();
        assert_eq!(resting_frames(default.variance_rad2(), default.period_s()), 34);
        assert_eq!(resting_frames(1e-7, 0.1), 4);
        assert_eq!(resting_frames(0.0, 0.1), 4);
        assert_eq!(resting_frames(1e-7, 1e-5), 340);
        assert_eq!(resting_frames(4e-4, 1e-5), 1000);
    }

    /// A rotor that the vibrometer sees fly is watched eight times as long, whatever was withdrawn before, and as
    /// long as that lasts.
    #[test]
    fn exact_a_disputed_rest_takes_longer() {
        let mut test = RestTest::<f64>::new();
        assert_eq!(test.frames(34), 34);
        test.dispute(true);
        assert_eq!(test.frames(34), 8 * 34);
        test.begin();
        assert_eq!(test.frames(34), 8 * 34);
        test.withdraw();
        assert_eq!(test.frames(34), 8 * 34);
        test.dispute(false);
        assert_eq!(test.frames(34), 2 * 34);
    }

    /// The share of tests that a rotor of this rate passes.
    fn passed(rate_rad_s: f64, resting_frames: u16) -> f64 {
        let (camera, runs) = (CameraDescription::default(), 400);
        let mut rng = Pcg64::seed_from_u64(7);
        let mut count = 0;
        for _ in 0..runs {
            let mut test = RestTest::<f32>::new();
            for n in 0..resting_frames / 2 {
                let at = Time::from_micros(100 * u64::from(n));
                let noise: f64 = StandardNormal.sample(&mut rng);
                let angle = rate_rad_s * 1e-4 * f64::from(n) + camera.variance_rad2().sqrt() * noise;
                test.take(at, Angle::from_degrees(angle.to_degrees()));
            }
            count += u32::from(test.confirms(camera.variance_rad2() as f32));
        }
        f64::from(count) / f64::from(runs)
    }

    /// Four standard deviations: a rotor at rest passes (6e-5 do not), one of 1.05 rad/s, seven of them, does not (1 in
    /// 700 does), and after five doublings of the time neither does one of 6 mrad/s.
    #[test]
    fn law_a_rotor_at_rest_passes_and_one_that_coasts_does_not() {
        assert!(passed(0.0, 34) > 0.99);
        assert!(passed(1.05, 34) < 0.02);
        assert!(passed(0.02, 34 * 32) < 0.02);
    }
}
