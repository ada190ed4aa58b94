//! What is known of the kick by one impact, and how angle and rate take it.
//!
//! ```text
//! kick = clamp(a S - rate, -f L, f L),     S = s' / R_t,     L = mu m_r R_t dv / J
//! ```
//!
//! S is the rate at which the tooth would carry the rotor, L the largest kick at nominal friction; `a` and `f`
//! are the tooth factor and the friction of [`super::rotor`]. The slip `a S - rate` is taken as uniform over an
//! interval, so that mean, Jacobian and noise of the kick are polynomials: [`crate::filters::kick`].

use heapless::Deque;
use motor_model::{Real, Time};

use super::measured_impact::Uncertain;
use super::rotor::{FactorKnowledge, KickJacobian, KickedCovariance, RotorCovariance};
use super::told::ToldKick;
use crate::camera::track::State;
use crate::filters::kick::KickMoments;
use crate::filters::kicks_kept::IMPACTS_KEPT_MAX;

/// What is known of the kick by one impact.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KickRecord<T> {
    pub(super) at: Time,
    /// Variance of the instant, in s^2.
    pub(super) at_s2: T,
    /// Largest kick at nominal friction, L, in rad/s.
    pub(super) kick_max_rad_s: Uncertain<T>,
    /// Rate at which the tooth would carry the rotor, S, in rad/s.
    pub(super) tooth_rate_rad_s: Uncertain<T>,
    /// Variance of what else may have kicked the rate about then, in rad^2/s^2.
    pub(super) unknown_rad2_s2: T,
    /// Whether later samples refine it.
    pub(super) refinable: bool,
    /// What is still known of friction and tooth factor.
    pub(super) factors: FactorKnowledge,
    /// What is told of it.
    pub(super) told: ToldKick<T>,
}

/// The kicks since the oldest frame kept, in the order of time.
pub(super) type KickRecords<T> = Deque<KickRecord<T>, IMPACTS_KEPT_MAX>;

/// Angle and rate with the covariance of all four states.
pub(super) type RotorState<T> = State<T, RotorCovariance<T>>;

impl<T: Real> KickRecord<T> {
    /// A kick of unknown sign with this variance.
    pub(super) fn of_unknown_sign(at: Time, unknown_rad2_s2: T) -> Self {
        Self { at, unknown_rad2_s2, ..Self::default() }
    }

    /// Applies the kick to the rate, and its Jacobian and noise to the covariance.
    pub(super) fn apply<B: KickedCovariance<T>>(&self, state: &mut State<T, B>) {
        #[cfg(feature = "tell")]
        if self.told.apply(state) {
            return;
        }
        state.covariance.doubt_factors(self.factors);
        let rotor = state.covariance.rotor();
        let ([friction, tooth_factor], [friction_part, tooth_part]) =
            self.told.factors([rotor.friction, rotor.tooth_factor]);
        let friction = if friction > T::zero() { friction } else { T::zero() };
        let (kick_max, tooth) = (self.kick_max_rad_s, self.tooth_rate_rad_s);
        let kick_max_rad_s = if kick_max.value > T::zero() { kick_max.value * friction } else { T::zero() };
        let slip = tooth_factor * tooth.value - state.rate_rad_s;
        let square = |x: T| x * x;
        // Whether the teeth stick depends on slip and largest kick alike: the uncertainty of both blurs the corner.
        let [friction2, tooth_factor2] = rotor.factor_variances();
        let slip_rad2_s2 = state.covariance.rate_rad2_s2()
            + tooth.variance
            + tooth_part * tooth_factor2 * square(tooth.value);
        let kick_max_rad2_s2 =
            friction_part * friction2 * square(kick_max.value) + square(friction) * kick_max.variance;
        let width = square_root(T::from_f64(3.0) * (slip_rad2_s2 + kick_max_rad2_s2));
        let kick = KickMoments::new(slip, width, kick_max_rad_s);
        state.covariance.kick(&KickJacobian {
            by_rate: -kick.per_slip,
            by_friction: friction_part * kick.per_limit * kick_max.value,
            by_tooth_factor: tooth_part * kick.per_slip * tooth.value,
            variance_rad2_s2: kick.scatter
                + square(kick.per_slip) * tooth.variance
                + square(kick.per_limit * friction) * kick_max.variance
                + self.unknown_rad2_s2,
            angle_rad2: self.at_s2 * square(kick.mean),
        });
        state.rate_rad_s += kick.mean;
    }
}

/// Square root of a number that is not negative, by three Newton steps: to a part in a thousand for results between
/// 1e-3 and 1e4, to which they are clamped.
fn square_root<T: Real>(square: T) -> T {
    let (least, most) = (T::from_f64(1e-6), T::from_f64(1e8));
    // Compared this way round, so that NaN counts as large.
    let bounded = if square < most { square } else { most };
    let bounded = if bounded > least { bounded } else { least };
    let mut root = T::one();
    while root * root > T::from_f64(4.0) * bounded {
        root *= T::from_f64(0.5);
    }
    while root * root < T::from_f64(0.25) * bounded {
        root *= T::from_f64(2.0);
    }
    for _ in 0..3 {
        root = T::from_f64(0.5) * (root + bounded / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, AngleAccumulator};

    use super::*;
    use crate::camera::track_covariance::TrackCovariance as _;

    /// A largest kick of 1 rad/s whose friction is known to 0.29 and a slip of 1 rad/s, exact: their difference is
    /// uniform within `w = 0.29 sqrt 3`, and the kick falls short of 1 by the mean of what it is above 0, `w / 4`. The
    /// kick follows half of an error of the friction.
    #[test]
    fn exact_an_uncertain_friction_blurs_the_corner_between_stick_and_slip() {
        let exactly = |value: f64| Uncertain { value, variance: 0.0 };
        let kick = KickRecord {
            kick_max_rad_s: exactly(1.0),
            tooth_rate_rad_s: exactly(1.0),
            ..KickRecord::of_unknown_sign(Time::from_nanos(1), 0.0)
        };
        let mut state = State {
            at: Time::ZERO,
            angle: AngleAccumulator::at(Angle::ZERO),
            rate_rad_s: 0.0,
            covariance: RotorCovariance::begin(0.0, 0.0, None),
        };
        let [friction2, tooth_factor2] = state.covariance.factor_variances();
        kick.apply(&mut state);
        let short = (3.0 * (friction2 + tooth_factor2)).sqrt() / 4.0;
        assert!((state.rate_rad_s - (1.0 - short)).abs() < 1e-3, "{}", state.rate_rad_s);
        let variance = state.covariance.rate_rad2_s2();
        let scatter = (friction2 + tooth_factor2) / 16.0;
        let expected = 0.25 * (friction2 + tooth_factor2) + scatter;
        assert!((variance - expected).abs() < 1e-3, "{variance}");
    }

    #[test]
    fn exact_square_root() {
        for square in [1e-6, 3e-4, 0.7, 1.0, 12.0, 4e4, 1e8_f64] {
            assert!((square_root(square) / square.sqrt() - 1.0).abs() < 1e-3, "{square}");
        }
        assert!((square_root(f64::NAN) - 1e4).abs() < 1.0 && (square_root(f64::INFINITY) - 1e4).abs() < 1.0);
        assert!((square_root(0.0_f64) - 1e-3).abs() < 1e-6);
    }

    /// A tooth far too fast to be followed gives the largest kick, with that kick's variance and the friction's; an
    /// instant that is known to 4 us moves the angle by that time's turn.
    #[test]
    fn exact_a_slip_gives_the_largest_kick_with_its_variance_and_that_of_its_instant() {
        let (kick_max_rad_s, variance, at_s2) = (0.3, 1e-3, 16e-12);
        let kick = KickRecord {
            at_s2,
            kick_max_rad_s: Uncertain { value: kick_max_rad_s, variance },
            tooth_rate_rad_s: Uncertain { value: 100.0, variance: 0.0 },
            ..KickRecord::of_unknown_sign(Time::from_nanos(1), 0.0)
        };
        let mut state = State {
            at: Time::ZERO,
            angle: AngleAccumulator::at(Angle::ZERO),
            rate_rad_s: 0.0,
            covariance: RotorCovariance::begin(0.0, 0.0, None),
        };
        let [friction2, _] = state.covariance.factor_variances();
        kick.apply(&mut state);
        assert!((state.rate_rad_s - kick_max_rad_s).abs() < 1e-12, "{}", state.rate_rad_s);
        let square = kick_max_rad_s * kick_max_rad_s;
        let own = state.covariance.rate_rad2_s2();
        assert!((own - (variance + friction2 * square)).abs() < 1e-12, "{own}");
        let angle_rad2 = state.covariance.angle_rad2();
        assert!((angle_rad2 / (at_s2 * square) - 1.0).abs() < 1e-9, "{angle_rad2:e}");
    }
}
