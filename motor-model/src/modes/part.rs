//! Propagation over part of a step, and the response to impulses and constant pushes: exact, without transcendental
//! calls.
//!
//! ```text
//! exp(A t) - I = [ E cos - 1 + zeta w S    S ; -w^2 S    E cos - 1 - zeta w S ]
//! S = E sin(wd t) / wd,   E = exp(-zeta w t),   cos = cos(wd t)
//! ```
//!
//! Sine and cosine come from the table of [`crate::phase`], `E` from its own short series.

use core::f64::consts::TAU;

use nalgebra::Vector3;

use super::forcing::Phasor;
use super::{Forcing, ModalBank, ModalState, Mode, Propagator};
use crate::decay::decay_loss;
use crate::math::{self, Real};
use crate::phase::sin_cos_of_turns;

/// Constants of one mode for part of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeMode<T> {
    /// Half the turns of the free oscillation in a step.
    half_turns: T,
    /// `zeta w h`: decay in a step.
    decay: T,
    /// `zeta w`.
    decay_per_s: T,
    per_damped_rad_s: T,
    /// `w^2`.
    stiffness_per_s2: T,
    /// `1 / w^2`.
    softness_s2: T,
}

impl<T: Real> FreeMode<T> {
    pub(crate) fn new(mode: &Mode, step_s: f64) -> Self {
        let (w, zeta) = (mode.natural_rad_s, mode.damping_ratio);
        let wd = w * math::sqrt((1.0 - zeta) * (1.0 + zeta));
        Self {
            half_turns: T::from_f64(0.5 * wd / TAU * step_s),
            decay: T::from_f64(zeta * w * step_s),
            decay_per_s: T::from_f64(zeta * w),
            per_damped_rad_s: T::from_f64(1.0 / wd),
            stiffness_per_s2: T::from_f64(w * w),
            softness_s2: T::from_f64(1.0 / (w * w)),
        }
    }

    /// `P - I` over the fraction `part` of a step.
    #[inline]
    pub(crate) fn propagator(&self, part: T) -> [[T; 2]; 2] {
        // From half the angle: sin = 2 sin cos, cos - 1 = -2 sin^2, the latter without cancellation.
        let (half_sin, half_cos) = sin_cos_of_turns(self.half_turns * part);
        let twice_half_sin = half_sin + half_sin;
        let (sin, cos_minus_1) = (twice_half_sin * half_cos, -twice_half_sin * half_sin);
        let loss = decay_loss(self.decay * part);
        let sin_part = (T::one() + loss) * sin * self.per_damped_rad_s;
        let cos_part = loss * (T::one() + cos_minus_1) + cos_minus_1;
        let slope = self.decay_per_s * sin_part;
        [[cos_part + slope, sin_part], [-self.stiffness_per_s2 * sin_part, cos_part - slope]]
    }
}

impl<T: Real> FreeMode<T> {
    /// Displacement and velocity per jump of the velocity, the fraction `part` of a step after it (8b).
    #[inline]
    fn impulse_response(&self, part: T) -> [T; 2] {
        let turns = self.half_turns + self.half_turns;
        let (sin, cos) = sin_cos_of_turns(turns * part);
        let left = T::one() + decay_loss(self.decay * part);
        let displacement_s = left * sin * self.per_damped_rad_s;
        [displacement_s, left * cos - self.decay_per_s * displacement_s]
    }
}

/// Response of displacement and velocity of each mode to a constant unit acceleration over some time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModalPush<T> {
    pub(crate) displacement_s2: Vector3<T>,
    pub(crate) velocity_s: Vector3<T>,
}

impl<T: Real> ModalPush<T> {
    /// The same for the accelerations `-recoil`.
    pub(crate) fn times(&self, recoil: &Vector3<T>) -> Self {
        Self {
            displacement_s2: -self.displacement_s2.component_mul(recoil),
            velocity_s: -self.velocity_s.component_mul(recoil),
        }
    }
}

impl<T: Real> ModalBank<T> {
    /// Propagation over the fraction `part` of a step.
    pub(crate) fn part(&self, part: T) -> Propagator<T> {
        Propagator::new(self.free.map(|mode| mode.propagator(part)))
    }

    /// Adds the response to a jump of the velocities, the fraction `part` of a step after it.
    pub(crate) fn add_jump(&self, state: &mut ModalState<T>, jump_m_s: &Vector3<T>, part: T) {
        let [[a_g, a_v], [b_g, b_v], [c_g, c_v]] =
            self.free.each_ref().map(|mode| mode.impulse_response(part));
        state.displacement_m += Vector3::new(a_g, b_g, c_g).component_mul(jump_m_s);
        state.velocity_m_s += Vector3::new(a_v, b_v, c_v).component_mul(jump_m_s);
    }

    /// Accelerations `g_n''` in m/s^2 at an instant of the drive.
    #[inline]
    pub(crate) fn acceleration(
        &self,
        state: &ModalState<T>,
        forcing: &Forcing<T>,
        phasor: &Phasor<T>,
    ) -> Vector3<T> {
        let [a, b, c] = &self.free;
        let resistance = Vector3::new(a.decay_per_s, b.decay_per_s, c.decay_per_s);
        let stiffness = Vector3::new(a.stiffness_per_s2, b.stiffness_per_s2, c.stiffness_per_s2);
        let damped = resistance.component_mul(&state.velocity_m_s);
        let drive = forcing.acceleration_m_s2(phasor);
        Vector3::new(T::zero(), drive.x, drive.y)
            - (damped + damped + stiffness.component_mul(&state.displacement_m))
    }

    /// Response to constant unit accelerations over the time of `propagator`.
    pub(crate) fn push(&self, propagator: &Propagator<T>) -> ModalPush<T> {
        let [a, b, c] = &self.free;
        // About the displaced equilibrium a / w^2 the motion is free: x = (I - P) (a / w^2, 0).
        let softness = -Vector3::new(a.softness_s2, b.softness_s2, c.softness_s2);
        ModalPush {
            displacement_s2: propagator.gg.component_mul(&softness),
            velocity_s: propagator.vg.component_mul(&softness),
        }
    }
}

impl<T: Real> Propagator<T> {
    /// Advances `state` over this propagator's time, in which the drive goes from one phasor to another.
    #[inline]
    pub(crate) fn advance(
        &self,
        state: &mut ModalState<T>,
        forcing: &Forcing<T>,
        [from, to]: [&Phasor<T>; 2],
    ) {
        // The driven mode less its steady motion moves freely.
        let mut free = *state;
        forcing.add_steady(&mut free, &from.reversed());
        self.add_to(state, &free.displacement_m, &free.velocity_m_s);
        forcing.add_steady(state, &from.until(to));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::DriveTuning;
    use crate::phase::Phase;
    use crate::{DriveCommand, DriveMode, MotorParams};

    /// Two parts of a step make the whole step, for any cut and phase of the drive.
    #[test]
    fn dual_parts_make_the_step() {
        let modes = Mode::all(&MotorParams::nominal()).unwrap();
        for step_s in [1e-7, 1e-5, 5e-5, 3e-4] {
            let bank = ModalBank::<f64>::new(&modes, DriveTuning::Resonant, step_s);
            let command = DriveCommand::full(DriveMode::B).with_frequency_offset(-130.0).unwrap();
            let forcing = bank.forcing(command);
            let start = ModalState {
                displacement_m: Vector3::new(1e-6, -2e-5, 3e-6),
                velocity_m_s: Vector3::new(0.02, 0.7, -0.1),
            };
            let phase = Phase::from_turns(0.37);
            let end = phase.advanced(forcing.increment());
            let mut whole = start;
            bank.advance(&mut whole, &forcing, phase);
            for cut in [1e-6, 0.1, 0.5, 0.77, 0.999] {
                let middle = forcing.phase_at(phase, cut);
                let mut parts = start;
                bank.part(cut).advance(
                    &mut parts,
                    &forcing,
                    [&forcing.phasor(phase), &forcing.phasor(middle)],
                );
                bank.part(1.0 - cut).advance(
                    &mut parts,
                    &forcing,
                    [&forcing.phasor(middle), &forcing.phasor(end)],
                );
                let displacement_error = (parts.displacement_m - whole.displacement_m).amax();
                let velocity_error = (parts.velocity_m_s - whole.velocity_m_s).amax();
                assert!(displacement_error < 1e-18, "{step_s} {cut} {displacement_error:e}");
                assert!(velocity_error < 1e-13, "{step_s} {cut} {velocity_error:e}");
            }
        }
    }

    /// A mode at rest under a constant acceleration `a`: `g'' = a` at first, `g = a / w^2` in the end.
    #[test]
    fn exact_push_of_a_constant_acceleration() {
        let modes = Mode::all(&MotorParams::nominal()).unwrap();
        let step_s = 1e-3;
        let bank = ModalBank::<f64>::new(&modes, DriveTuning::Resonant, step_s);
        let part = 1e-6;
        let push = bank.push(&bank.part(part));
        let t = part * step_s;
        assert!((push.velocity_s - Vector3::repeat(t)).amax() < 1e-4 * t);
        assert!((push.displacement_s2 - Vector3::repeat(0.5 * t * t)).amax() < 1e-4 * t * t);
        // Forty decay times of mode A in one step of a heavily damped copy.
        let heavy = modes.map(|mode| Mode { damping_ratio: 0.9, ..mode });
        let bank = ModalBank::<f64>::new(&heavy, DriveTuning::Resonant, step_s * 10.0);
        let push = bank.push(&bank.part(1.0));
        for (mode, displacement) in heavy.iter().zip(&push.displacement_s2) {
            assert!((displacement * mode.natural_rad_s * mode.natural_rad_s - 1.0).abs() < 1e-12);
        }
    }
}
