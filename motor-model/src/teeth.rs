//! The teeth: the motion of two pairs of opposite teeth in the modes.
//!
//! The pairs are 90 degrees apart and move with opposite signs in modes B and C. With `th_p = th + 90 p`, `p` in {0,
//! 1}, and in mode B `th_p = th_B + 90 p`:
//!
//! ```text
//! shape   phi_A = 1,  phi_B = sin 2 th_p,    phi_C = cos 2 th_p                       (4)
//! lever   psi_A = 0,  psi_B = L cos 2 th_p,  psi_C = -L sin 2 th_p                    (9a)
//! height  u_p = sum phi_n g_n        tangential  s_p = sum psi_n g_n   (clockwise positive)
//! recoil  of g_n' per rise of the rotor's velocity: m_r phi_n / M_n    M_A = m_s, M_B = M_C = m_s / 2 in (7a-c, 8b)
//! sway    of s_p per rise of the rotor's velocity, by the recoil: -sum psi_n m_r phi_n / M_n, 0 in (9b)
//! ```
//!
//! With equal shifts and modal masses of B and C a normal impulse does not move the teeth sideways (9b). Otherwise it
//! does, by the sway.
//!
//! A pair's amplitude varies by half a percent from pair to pair and run to run. The variation scales `phi` and `psi`
//! of B and C alike, so height, recoil and lever of a pair belong to one shape: momentum and energy balance for any
//! variation.

use nalgebra::Vector3;
use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::math::{self, Real};
use crate::modes::ModalState;
use crate::params::{MotorParams, Parameter};

/// Relative deviation of each pair's amplitude in modes B and C.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AmplitudeVariation {
    /// One value per pair; 0 is nominal.
    pub pairs: [f64; 2],
}

impl AmplitudeVariation {
    /// Draws a run's variation: normal, with standard deviation [`Parameter::AmplitudeVariation`].
    pub fn draw<R: Rng + ?Sized>(params: &MotorParams, rng: &mut R) -> Self {
        let sigma = params.get(Parameter::AmplitudeVariation);
        let mut one = || {
            let standard: f64 = StandardNormal.sample(rng);
            // Six sigmas of the widest variation allowed keep the sign of a pair's motion.
            sigma * standard.clamp(-6.0, 6.0)
        };
        Self { pairs: [one(), one()] }
    }

    /// Amplitude of the wider pair per that of the first, with a margin for rounding.
    pub(crate) fn widest_per_first(&self) -> f64 {
        let [first, second] = self.pairs;
        (((1.0 + second) / (1.0 + first)).abs()).max(1.0) * (1.0 + 1e-6)
    }
}

/// One pair of opposite teeth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToothPair<T> {
    /// `phi`: height per modal displacement.
    pub shape: Vector3<T>,
    /// `psi`: tangential displacement per modal displacement.
    pub lever: Vector3<T>,
    /// Drop of each modal velocity per rise of the rotor's vertical velocity.
    pub recoil: Vector3<T>,
    /// `1 / (1 + r)`, where `r = shape . recoil` (`3 m_r / m_s` in the paper).
    pub(crate) share: T,
    /// `lever . recoil`: drop of the tangential velocity per rise of the rotor's vertical velocity.
    pub sway: T,
}

impl<T: Real> ToothPair<T> {
    /// Pairs 0 and 1 of a motor.
    pub fn both(params: &MotorParams, variation: &AmplitudeVariation) -> [Self; 2] {
        let [first, second] = variation.pairs;
        [Self::new(params, 0.0, 1.0 + first), Self::new(params, 90.0, 1.0 + second)]
    }

    fn new(params: &MotorParams, offset_deg: f64, scale: f64) -> Self {
        let [twice_b, twice_c] = [params.mode_b_tooth_angle_deg(), params.effective_tooth_angle_deg()]
            .map(|angle_deg| 2.0 * (angle_deg + offset_deg).to_radians());
        let ((sin_b, cos_b), (sin_c, cos_c)) = (math::sin_cos(twice_b), math::sin_cos(twice_c));
        let (phi_b, phi_c) = (scale * sin_b, scale * cos_c);
        let lever = params.lever();
        let ratio = params.mass_ratio();
        let [per_a, per_b, per_c] = params.mass_fractions().map(|fraction| 1.0 / fraction);
        let vector = |a: f64, b: f64, c: f64| Vector3::new(T::from_f64(a), T::from_f64(b), T::from_f64(c));
        let r = ratio * (per_a + (per_b * (phi_b * phi_b) + per_c * (phi_c * phi_c)));
        // Twice sine and cosine of an angle are the sine of twice the angle: no rounding is left where both cancel.
        let ((sin_2b, _), (sin_2c, _)) = (math::sin_cos(2.0 * twice_b), math::sin_cos(2.0 * twice_c));
        let sway = 0.5 * lever * scale * scale * ratio * (per_b * sin_2b - per_c * sin_2c);
        Self {
            shape: vector(1.0, phi_b, phi_c),
            lever: vector(0.0, lever * (scale * cos_b), -lever * (scale * sin_c)),
            recoil: vector(per_a * ratio, per_b * ratio * phi_b, per_c * ratio * phi_c),
            share: T::from_f64(1.0 / (1.0 + r)),
            sway: T::from_f64(sway),
        }
    }

    /// Height `u_p` in m.
    #[inline]
    pub fn height(&self, modes: &ModalState<T>) -> T {
        self.over(&modes.displacement_m)
    }

    /// Vertical velocity `u_p'` in m/s.
    #[inline]
    pub fn vertical_velocity(&self, modes: &ModalState<T>) -> T {
        self.over(&modes.velocity_m_s)
    }

    /// `phi . x`, knowing that `phi_A` is 1.
    #[inline]
    pub(crate) fn over(&self, x: &Vector3<T>) -> T {
        x.x + (self.shape.y * x.y + self.shape.z * x.z)
    }

    /// Tangential displacement `s_p` in m.
    #[inline]
    pub fn tangential_displacement(&self, modes: &ModalState<T>) -> T {
        self.lever.dot(&modes.displacement_m)
    }

    /// Tangential velocity `s_p'` in m/s.
    #[inline]
    pub fn tangential_velocity(&self, modes: &ModalState<T>) -> T {
        self.lever.dot(&modes.velocity_m_s)
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    /// The stator that finite elements give: two shifts, three modal masses of its own.
    fn unequal() -> MotorParams {
        [
            (Parameter::ModeBExtraShift, 1.3),
            (Parameter::ModeAMassFraction, 0.95),
            (Parameter::ModeBMassFraction, 0.53),
            (Parameter::ModeCMassFraction, 0.59),
        ]
        .into_iter()
        .try_fold(MotorParams::nominal(), |params, (parameter, value)| params.with(parameter, value))
        .unwrap()
    }

    /// 1 + 2 sin^2 + 2 cos^2 = 3: the tooth's jump is `3 (m_r/m_s) dv` (8b, 12a).
    #[test]
    fn law_effective_mass_of_a_nominal_tooth_is_a_third_of_the_stator() {
        let params = MotorParams::nominal();
        for pair in ToothPair::<f64>::both(&params, &AmplitudeVariation::default()) {
            let r = pair.shape.dot(&pair.recoil);
            assert!((r - 3.0 * params.mass_ratio()).abs() < 1e-14, "{r}");
            assert!((pair.share - 1.0 / (1.0 + r)).abs() < 1e-15);
        }
        assert_eq!(params.tooth_mass_ratio().to_bits(), (3.0 * params.mass_ratio()).to_bits());
    }

    /// By hand, with `th = 30` and `th_B = 28.7` degrees: `sin^2 57.4 = 0.709725`, `cos^2 60 = 0.25`, so that the sum
    /// of `phi^2 / M` is `(1/0.95 + 0.709725/0.53 + 0.25/0.59) / m_s = 2.815466 / m_s`.
    #[test]
    fn exact_effective_mass_of_a_tooth_with_modal_masses_and_a_shift_of_its_own() {
        let params = unequal();
        for pair in ToothPair::<f64>::both(&params, &AmplitudeVariation::default()) {
            let r = pair.shape.dot(&pair.recoil);
            assert!((r / params.mass_ratio() - 2.815_466).abs() < 1e-5, "{r}");
            assert!((params.tooth_mass_ratio() / r - 1.0).abs() < 1e-14);
            assert!((pair.share - 1.0 / (1.0 + r)).abs() < 1e-15);
        }
    }

    /// Betti: what a normal force at a pair moves another pair by is what the same force there moves this one by,
    /// each per modal mass.
    #[test]
    fn law_recoil_is_reciprocal() {
        let [p, q] = ToothPair::<f64>::both(&unequal(), &AmplitudeVariation { pairs: [0.03, -0.02] });
        let (there, back) = (p.shape.dot(&q.recoil), q.shape.dot(&p.recoil));
        assert!((there - back).abs() < 1e-14 * there.abs(), "{there} {back}");
        assert!(there.abs() > 0.1, "a blow on one pair moves the other");
    }

    #[test]
    fn law_pairs_move_in_antiphase_in_b_and_c_and_together_in_a() {
        let [p, q] = ToothPair::<f64>::both(&MotorParams::nominal(), &AmplitudeVariation::default());
        assert!((p.shape.x - q.shape.x).abs() < 1e-15);
        assert!((p.shape.y + q.shape.y).abs() < 1e-15 && (p.shape.z + q.shape.z).abs() < 1e-15);
        assert!((p.lever.y + q.lever.y).abs() < 1e-15 && (p.lever.z + q.lever.z).abs() < 1e-15);
    }

    /// (9b) at the tooth's own angle: a vertical impulse does not move the tooth sideways.
    #[test]
    fn law_normal_impulse_leaves_the_tangential_velocity() {
        let variation = AmplitudeVariation { pairs: [0.03, -0.02] };
        for pair in ToothPair::<f64>::both(&MotorParams::nominal(), &variation) {
            assert!(pair.lever.dot(&pair.recoil).abs() < 1e-15);
            assert_eq!(pair.sway.to_bits(), 0.0_f64.to_bits());
        }
    }

    /// With unequal masses or shifts it does, by `lever . recoil`.
    #[test]
    fn law_normal_impulse_sways_a_tooth_of_unequal_modes() {
        let variation = AmplitudeVariation { pairs: [0.03, -0.02] };
        for pair in ToothPair::<f64>::both(&unequal(), &variation) {
            let sway = pair.lever.dot(&pair.recoil);
            assert!((pair.sway / sway - 1.0).abs() < 1e-12, "{} {sway}", pair.sway);
            assert!(sway.abs() > 1e-3);
        }
    }

    /// The variations of drawn pairs have the parameter as their standard deviation: over 20,000 of them within 2.5 %,
    /// five standard errors of `1 / sqrt(2 n)`.
    #[test]
    fn law_drawn_variations_have_their_deviation() {
        let params = MotorParams::nominal();
        let mut rng = Pcg64::seed_from_u64(5);
        let square = (0..10_000)
            .flat_map(|_| AmplitudeVariation::draw(&params, &mut rng).pairs)
            .map(|pair| pair * pair)
            .sum::<f64>();
        let deviation = (square / 20_000.0).sqrt() / params.get(Parameter::AmplitudeVariation);
        assert!((deviation - 1.0).abs() < 0.025, "{deviation}");
    }
}
