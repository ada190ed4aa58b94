//! Gap and approach: the two scalar measurements that an impact makes of the stator.
//!
//! The vibrometer gives the rotor's velocity before, `v`, and its jump, `dv`. The pair of teeth that touched the rotor
//! a time `t` before the end of the sample period satisfies
//!
//! ```text
//! gap        z - v t - phi . g(-t) = 0         z, g: at the end of the period, were there no impact
//! approach   phi . g'(-t) - v - a = 0          a = dv (1 + r) / (1 + e);  r: mass ratio at the tooth, e: restitution
//! ```
//!
//! Each is linearised about given errors `x0`: `h(x) = h(x0) + H (x - x0)`, so that the measurement reads
//! `H x = H x0 - h(x0)`, which is the innovation of an iterated Kalman update.

use motor_model::Real;

use super::measured_impact::MeasuredImpact;
use super::modes_at::entries;
use super::states::{HEIGHT, INSTANT, JUMP, MASS_RATIO, RESTITUTION, Row, entry};
use super::stator::StatorFilter;
use super::tooth::{by_amplitude, by_angle};

/// Standard deviation of the gap, in m, and as a part of the tooth's swing in modes B and C. Tuned.
const GAP_M: f64 = 1.2e-8;
const GAP_PER_SWING: f64 = 3e-4;
/// Standard deviation of the approach as a part of it. Tuned.
const APPROACH_PART: f64 = 0.001;
/// Least variance of the approach, in m^2/s^2: 0.1 mm/s, half of the vibrometer's noise. Assumed, so that an approach
/// near zero is not taken as exact.
const APPROACH_M2_S2: f64 = 1e-8;

/// A scalar measurement, linearised about some errors.
pub(super) struct ContactMeasurement<T> {
    /// Its Jacobian H.
    pub(super) row: Row<T>,
    /// What `row . errors` is measured to be.
    pub(super) innovation: T,
    /// Variance of its noise.
    pub(super) noise: T,
}

impl<T: Real> StatorFilter<T> {
    /// Gap and approach of `pair`, linearised about `errors`.
    #[inline(never)]
    pub(super) fn contact_measurements(
        &self,
        impact: &MeasuredImpact<T>,
        pair: usize,
        errors: &Row<T>,
    ) -> [ContactMeasurement<T>; 2] {
        let (zero, one) = (T::zero(), T::one());
        let back_s = impact.back_s(entry(errors, INSTANT));
        let modes = self.modes_at(back_s - impact.behind_s, errors);
        let tooth = self.tooth(pair, errors);
        let phi = &tooth.shape;
        let (phi_by_amplitude, phi_by_angle) = (by_amplitude(phi), by_angle(phi));
        let parameter = |state: usize| self.parameter(state, errors);
        let speed = phi.dot(&modes.velocity_m_s);
        let jump_m_s = impact.jump_m_s + entry(errors, JUMP);
        // `r` grows with the square of the shape, of which A is a third.
        let share_by_amplitude = self.recoil_share * T::from_f64(4.0 / 3.0);
        let per_jump = self.approach_per_jump
            * (one
                + self.recoil_share * parameter(MASS_RATIO)
                + share_by_amplitude * tooth.amplitude
                + parameter(RESTITUTION));
        let swing = (phi.y * modes.displacement_m.y).abs() + (phi.z * modes.displacement_m.z).abs();
        let square = |x: T| x * x;
        let measured = |row: Row<T>, value: T, noise: T| {
            let innovation = row.dot(errors) - value;
            ContactMeasurement { row, innovation, noise }
        };

        let gap_row = tooth.row(
            entries(&modes.responses, one, phi, |r| [-r.c, -r.s]),
            [impact.before_m_s - speed, zero],
            [zero; 2],
            [-phi_by_amplitude.dot(&modes.displacement_m), -phi_by_angle.dot(&modes.displacement_m)],
        );
        let gap_m = self.height_m + entry(errors, HEIGHT)
            - impact.before_m_s * back_s
            - phi.dot(&modes.displacement_m);
        let gap_m2 = square(T::from_f64(GAP_M)) + square(T::from_f64(GAP_PER_SWING) * swing);
        let by_parts = self.approach_per_jump * jump_m_s;
        let by_amplitude = phi_by_amplitude.dot(&modes.velocity_m_s) - share_by_amplitude * by_parts;
        let approach_row = tooth.row(
            entries(&modes.responses, zero, phi, |r| [r.c_rate, r.s_rate]),
            [phi.dot(&modes.acceleration_m_s2), -per_jump],
            [-self.recoil_share * by_parts, -by_parts],
            [by_amplitude, phi_by_angle.dot(&modes.velocity_m_s)],
        );
        let surplus_m_s = speed - impact.before_m_s - per_jump * jump_m_s;
        let approach_m2_s2 =
            T::from_f64(APPROACH_M2_S2) + square(T::from_f64(APPROACH_PART) * per_jump * jump_m_s);
        [measured(gap_row, gap_m, gap_m2), measured(approach_row, surplus_m_s, approach_m2_s2)]
    }
}
