//! The averaged motor: mean rate of a driven rotor and the random deviations from it, without teeth or impacts.
//!
//! Thousands of impacts a second make the rate an Ornstein-Uhlenbeck process about its mean `w`, with time constant
//! `tau`. The angle diffuses with `D`: the variance of a long move grows by `2 D` per second.
//!
//! ```text
//! d(rate) = (w - rate) dt / tau + sqrt(2 D) / tau dW,      d(angle) = rate dt
//! ```
//!
//! Over a step, with `E = exp(-h / tau)`, the solution is exact for any `h` (Gillespie, Phys. Rev. E 54 (1996) 2084):
//!
//! ```text
//! rate  <- w + (rate - w) E + n_r                 var n_r     = D (1 - E^2) / tau
//! angle <- angle + w h + (rate - w) tau (1 - E) + n_a     var n_a     = D (2 h - tau (3 - 4 E + E^2))
//!                                                 cov(n_r, n_a) = D (1 - E)^2
//! ```
//!
//! For long moves and plans: one step may be a second. Single impacts, bursts of a few cycles and rest are not
//! modelled.
//!
//! The state:
//!
//! | index | symbol | unit | meaning | at the start |
//! |---|---|---|---|---|
//! | 0 | `rate` | rad/s | angular rate, clockwise | 0 |
//! | 1 | `angle` | 2^-32 turn | angle turned, clockwise | 0 |

use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::angle::{Angle, AngleAccumulator};
use crate::error::OutOfBounds;
use crate::math;

/// Mean motion under one drive mode and amplitude, identified from the full model or from a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanMotion {
    /// Mean rate `w` in rad/s, clockwise positive.
    pub rate_rad_s: f64,
    /// Time constant `tau` in s of the approach of the rate to its mean, within 1e-6 to 1e3.
    pub time_constant_s: f64,
    /// Diffusion `D` of the angle in rad^2/s, within 0 to 1e6: half the growth of the variance of a long move.
    pub diffusion_rad2_s: f64,
}

/// Rate and angle of the averaged rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AveragedState {
    /// Angle turned.
    pub angle: AngleAccumulator<f64>,
    /// Angular rate in rad/s.
    pub rate_rad_s: f64,
}

/// An averaged motor under one drive, ready to step.
///
/// ```
/// use motor_model::{AveragedMotor, AveragedState, MeanMotion};
/// # let mut rng = rand_pcg::Pcg64Mcg::new(1);
///
/// let mode_c = MeanMotion { rate_rad_s: -1.5, time_constant_s: 8e-3, diffusion_rad2_s: 2e-4 };
/// let motor = AveragedMotor::try_new(&mode_c, 0.1)?;
/// let mut state = AveragedState::default();
/// for _ in 0..100 {
///     motor.step(&mut state, &mut rng);
/// }
/// let expected_deg = (-1.5_f64 * (10.0 - 8e-3)).to_degrees();
/// assert!((state.angle.angle().degrees() - expected_deg).abs() < 4.0 * (2.0 * 2e-4 * 10.0_f64).sqrt().to_degrees());
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct AveragedMotor {
    rate_rad_s: f64,
    /// `E`.
    decay: f64,
    /// `w h`, of any number of turns, and its remainder below the unit of an angle.
    turn: Angle,
    turn_rest_rad: f64,
    /// `tau (1 - E)`.
    coast_s: f64,
    /// Lower triangular root of the covariance of `(n_r, n_a)`: `[n_r; n_a] = [[a, 0], [b, c]] normals`.
    root: [f64; 3],
}

impl AveragedMotor {
    /// The averaged motor under the drive that `motion` describes, stepped by `step_s`, within 1e-9 to 1e3 s.
    ///
    /// # Errors
    /// When the step, the time constant or the diffusion is out of its bounds.
    pub fn try_new(motion: &MeanMotion, step_s: f64) -> Result<Self, OutOfBounds> {
        let h = OutOfBounds::check("step_s", step_s, 1e-9, 1e3, "s")?;
        let tau = OutOfBounds::check("time_constant_s", motion.time_constant_s, 1e-6, 1e3, "s")?;
        let d = OutOfBounds::check("diffusion_rad2_s", motion.diffusion_rad2_s, 0.0, 1e6, "rad^2/s")?;
        let loss = -math::exp_m1(-h / tau);
        let decay = 1.0 - loss;
        // Of 2 x - 3 + 4 E - E^2, with x = h / tau and E = 1 - L: 2 (x - L) - L^2; its leading term is 2 x^3 / 3.
        let x = h / tau;
        let variance_per_d_tau = if x < 1e-2 { series(x) } else { 2.0 * (x - loss) - loss * loss };
        let (rate_variance, angle_variance) = (d / tau * loss * (2.0 - loss), d * tau * variance_per_d_tau);
        let covariance = d * loss * loss;
        let a = math::sqrt(rate_variance);
        let b = if a > 0.0 { covariance / a } else { 0.0 };
        let turn_deg = (motion.rate_rad_s * h).to_degrees();
        let turn = Angle::from_degrees(turn_deg);
        Ok(Self {
            rate_rad_s: motion.rate_rad_s,
            decay,
            turn,
            turn_rest_rad: (turn_deg - turn.degrees()).to_radians(),
            coast_s: tau * loss,
            root: [a, b, math::sqrt((angle_variance - b * b).max(0.0))],
        })
    }

    /// Advances `state` by one step, with random numbers from `rng`.
    pub fn step<R: Rng + ?Sized>(&self, state: &mut AveragedState, rng: &mut R) {
        let (first, second): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
        let [a, b, c] = self.root;
        let excess_rad_s = state.rate_rad_s - self.rate_rad_s;
        state.angle.turn(self.turn);
        state
            .angle
            .turn_by_radians(self.turn_rest_rad + excess_rad_s * self.coast_s + b * first + c * second);
        state.rate_rad_s = self.rate_rad_s + excess_rad_s * self.decay + a * first;
    }
}

/// `2 (x - L) - L^2` for small `x`, free of cancellation: `2 x^3/3 - x^4/2 + 7 x^5/30 - x^6/12 + ...`
fn series(x: f64) -> f64 {
    x * x * x * (2.0 / 3.0 - x * (0.5 - x * (7.0 / 30.0 - x / 12.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;

    const MOTION: MeanMotion = MeanMotion { rate_rad_s: 2.0, time_constant_s: 0.05, diffusion_rad2_s: 3e-3 };

    /// Both forms of the angle's variance where they meet, and the leading terms.
    #[test]
    fn exact_series() {
        for x in [1e-3_f64, 5e-3, 1e-2] {
            let loss = -math::exp_m1(-x);
            let direct = 2.0 * (x - loss) - loss * loss;
            assert!((series(x) / direct - 1.0).abs() < 1e-15 / (x * x) + x.powi(4), "{x}");
        }
    }

    /// Without chance: the closed form of a first-order lag, in one step or many.
    #[test]
    fn exact_spin_up() {
        let motion = MeanMotion { diffusion_rad2_s: 0.0, ..MOTION };
        for steps in [1, 7, 1000] {
            let motor = AveragedMotor::try_new(&motion, 0.2 / f64::from(steps)).unwrap();
            let mut state = AveragedState::default();
            for _ in 0..steps {
                motor.step(&mut state, &mut Pcg64Mcg::new(3));
            }
            let approach = -math::exp_m1(-0.2 / 0.05);
            assert!((state.rate_rad_s - 2.0 * approach).abs() < 1e-12);
            let expected_deg = (2.0 * (0.2 - 0.05 * approach)).to_degrees();
            assert!((state.angle.angle().degrees() - expected_deg).abs() < 1e-5 * f64::from(steps));
        }
    }

    /// Mean and variance of rate and angle after 0.3 s do not depend on the step, and are the closed form's: 20,000
    /// runs, five standard errors.
    #[test]
    fn exact_moments_for_any_step() {
        let (h, tau, d) = (0.3, MOTION.time_constant_s, MOTION.diffusion_rad2_s);
        let e = math::exp(-h / tau);
        let rate_variance = d / tau * (1.0 - e * e);
        let angle_variance = d * (2.0 * h - tau * (3.0 - 4.0 * e + e * e));
        let covariance = d * (1.0 - e) * (1.0 - e);
        for steps in [1, 30] {
            let motor = AveragedMotor::try_new(&MOTION, h / f64::from(steps)).unwrap();
            let mut rng = Pcg64Mcg::new(11);
            let n = 20_000;
            let (mut of_rate, mut of_angle, mut of_both) = (0.0, 0.0, 0.0);
            for _ in 0..n {
                let mut state = AveragedState::default();
                for _ in 0..steps {
                    motor.step(&mut state, &mut rng);
                }
                let rate = state.rate_rad_s - 2.0 * (1.0 - e);
                let angle = state.angle.angle().degrees().to_radians() - 2.0 * (h - tau * (1.0 - e));
                of_rate += rate * rate;
                of_angle += angle * angle;
                of_both += rate * angle;
            }
            let n = f64::from(n);
            // The standard error of a variance is sqrt(2 / n) of it: 1 %.
            assert!((of_rate / n / rate_variance - 1.0).abs() < 0.05, "{steps}");
            assert!((of_angle / n / angle_variance - 1.0).abs() < 0.05, "{steps}");
            assert!((of_both / n / covariance - 1.0).abs() < 0.1, "{steps}");
        }
    }

    /// A hundred seconds in a step: 32 turns, none lost.
    #[test]
    fn exact_turns_of_a_long_step() {
        let motor = AveragedMotor::try_new(&MeanMotion { diffusion_rad2_s: 0.0, ..MOTION }, 100.0).unwrap();
        let mut state = AveragedState { rate_rad_s: 2.0, ..AveragedState::default() };
        motor.step(&mut state, &mut Pcg64Mcg::new(3));
        assert!((state.angle.angle().degrees() - 200.0_f64.to_degrees()).abs() < 1e-7);
    }

    #[test]
    fn exact_bounds() {
        let refused = |motion: MeanMotion, step_s| AveragedMotor::try_new(&motion, step_s).unwrap_err().key;
        assert_eq!(refused(MOTION, 0.0), "step_s");
        assert_eq!(refused(MeanMotion { time_constant_s: 0.0, ..MOTION }, 1.0), "time_constant_s");
        assert_eq!(refused(MeanMotion { diffusion_rad2_s: -1.0, ..MOTION }, 1.0), "diffusion_rad2_s");
        assert_eq!(refused(MeanMotion { diffusion_rad2_s: f64::NAN, ..MOTION }, 1.0), "diffusion_rad2_s");
    }
}
