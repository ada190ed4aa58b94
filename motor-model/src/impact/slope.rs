//! How the jumps of an impact change with the state that it meets.
//!
//! ```text
//! dv = c a,   c = (1 + e) / (1 + r),   a = u' - v_z
//! R_t d rate = s' - R_t rate                      where friction stops the slip (stick)
//!            = +-q k c a,   k = m_r R_t^2 / J     where it does not (slip), q the coefficient of friction
//! ```
//!
//! `q` is `mu`, or `|s / u|` where the paper's law has less: then it changes with the displacements,
//! `dq = sgn(s) ds / |u| - |s| sgn(u) du / u^2`.

use nalgebra::Vector3;

use super::{FrictionLaw, ImpactLaw};
use crate::math::Real;
use crate::modes::ModalState;
use crate::rotor::RotorState;
use crate::teeth::ToothPair;

/// Derivatives of the jumps of an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JumpSlope<T> {
    /// Of the rotor's vertical velocity, per speed of approach.
    pub(crate) velocity_per_approach: T,
    /// Of the rate, per speed of approach, in rad/s per m/s.
    pub(crate) rate_per_approach: T,
    /// Of the rate, per modal displacement.
    pub(crate) rate_per_displacement: Vector3<T>,
    /// Of the rate, per modal velocity, beyond what the approach does.
    pub(crate) rate_per_velocity: Vector3<T>,
    /// Of the rate, per rate.
    pub(crate) rate_per_rate: T,
}

impl<T: Real> ImpactLaw<T> {
    /// The slope of [`ImpactLaw::strike`] for an impact of `tooth` that approaches at `approach_m_s > 0`.
    pub(crate) fn slope(
        &self,
        tooth: &ToothPair<T>,
        approach_m_s: T,
        modes: &ModalState<T>,
        rotor: &RotorState<T>,
    ) -> JumpSlope<T> {
        let velocity_per_approach = self.one_plus_restitution * tooth.share;
        let (zero, still) = (T::zero(), Vector3::zeros());
        let mut slope = JumpSlope {
            velocity_per_approach,
            rate_per_approach: zero,
            rate_per_displacement: still,
            rate_per_velocity: still,
            rate_per_rate: zero,
        };
        let slip_m_s = tooth.tangential_velocity(modes) - self.radius_m * rotor.rate_rad_s;
        let per_friction = self.rotor_mass_kg * self.per_tangential_mass * velocity_per_approach;
        let friction = self.friction_coefficient(tooth, modes);
        if slip_m_s.abs() < friction * per_friction * approach_m_s {
            slope.rate_per_velocity = tooth.lever * self.per_radius;
            slope.rate_per_rate = -T::one();
            return slope;
        }
        let per_friction = per_friction * self.per_radius;
        let per_friction = if slip_m_s < zero { -per_friction } else { per_friction };
        slope.rate_per_approach = per_friction * friction;
        let (across, up) = (tooth.tangential_displacement(modes), tooth.height(modes));
        if self.friction_law == FrictionLaw::Paper && across.abs() < self.friction * up.abs() {
            let across_per_up = across / up;
            let steeper = (tooth.lever - tooth.shape * across_per_up) * (per_friction * approach_m_s / up);
            slope.rate_per_displacement = if across_per_up < zero { -steeper } else { steeper };
        }
        slope
    }
}
