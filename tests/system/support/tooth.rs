//! A pair of teeth written down again from (4), (9a) and Table 1, in `f64` and with the platform's sine and cosine.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{ModalState, MotorParams, Parameter, Real};

/// Shape and lever of a pair in modes A, B, C, and the masses that it moves.
pub struct Tooth {
    shape: [f64; 3],
    lever: [f64; 3],
    modal_mass_kg: [f64; 3],
}

impl Tooth {
    /// Pair 0 or 1 with its amplitude off nominal by `variation`.
    pub fn of(params: &MotorParams, pair: u8, variation: f64) -> Self {
        let sum_deg = params.get(Parameter::ToothAngle) + params.get(Parameter::ModeShift);
        let twice = |extra_deg: f64| 2.0 * (90.0 - sum_deg - extra_deg + 90.0 * f64::from(pair)).to_radians();
        let (sin_b, cos_b) = twice(params.get(Parameter::ModeBExtraShift)).sin_cos();
        let (sin_c, cos_c) = twice(0.0).sin_cos();
        let scale = 1.0 + variation;
        let lever = (params.get(Parameter::StatorThickness) + 2.0 * params.get(Parameter::ToothHeight))
            / params.get(Parameter::ToothRadius);
        let stator = params.get(Parameter::StatorMass);
        Self {
            shape: [1.0, scale * sin_b, scale * cos_c],
            lever: [0.0, scale * lever * cos_b, -scale * lever * sin_c],
            modal_mass_kg: [
                Parameter::ModeAMassFraction,
                Parameter::ModeBMassFraction,
                Parameter::ModeCMassFraction,
            ]
            .map(|fraction| stator * params.get(fraction)),
        }
    }

    /// Modal masses of A, B, C.
    pub fn modal_mass_kg(&self) -> [f64; 3] {
        self.modal_mass_kg
    }

    /// Change of the tangential velocity by the recoil of a normal impulse, `-sum psi_n phi_n / M_n` per N s.
    pub fn sway_per_n_s(&self) -> f64 {
        let per_mode = self.shape.iter().zip(self.modal_mass_kg).map(|(phi, mass)| phi / mass);
        -self.lever.iter().zip(per_mode).map(|(psi, recoil)| psi * recoil).sum::<f64>()
    }

    /// `phi` of A, B, C.
    pub fn shape(&self) -> [f64; 3] {
        self.shape
    }

    /// `sum phi_n g_n`.
    pub fn height_m<T: Real>(&self, modes: &ModalState<T>) -> f64 {
        weighted(self.shape, displacements(modes))
    }

    /// `sum phi_n g_n'`.
    pub fn vertical_velocity_m_s<T: Real>(&self, modes: &ModalState<T>) -> f64 {
        weighted(self.shape, velocities(modes))
    }

    /// `sum psi_n g_n`.
    pub fn tangential_displacement_m<T: Real>(&self, modes: &ModalState<T>) -> f64 {
        weighted(self.lever, displacements(modes))
    }

    /// `sum psi_n g_n'`.
    pub fn tangential_velocity_m_s<T: Real>(&self, modes: &ModalState<T>) -> f64 {
        weighted(self.lever, velocities(modes))
    }
}

/// Modal displacements A, B, C in `f64`.
pub fn displacements<T: Real>(modes: &ModalState<T>) -> [f64; 3] {
    let g = modes.displacement_m;
    [g.x.to_f64(), g.y.to_f64(), g.z.to_f64()]
}

/// Modal velocities A, B, C in `f64`.
pub fn velocities<T: Real>(modes: &ModalState<T>) -> [f64; 3] {
    let v = modes.velocity_m_s;
    [v.x.to_f64(), v.y.to_f64(), v.z.to_f64()]
}

fn weighted(weights: [f64; 3], values: [f64; 3]) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}
