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
        let twice_angle = 2.0 * (90.0 - sum_deg + 90.0 * f64::from(pair)).to_radians();
        let (sin, cos) = twice_angle.sin_cos();
        let scale = 1.0 + variation;
        let lever = (params.get(Parameter::StatorThickness) + 2.0 * params.get(Parameter::ToothHeight))
            / params.get(Parameter::ToothRadius);
        let stator = params.get(Parameter::StatorMass);
        Self {
            shape: [1.0, scale * sin, scale * cos],
            lever: [0.0, scale * lever * cos, -scale * lever * sin],
            modal_mass_kg: [stator, stator / 2.0, stator / 2.0],
        }
    }

    /// Modal masses of A, B, C.
    pub fn modal_mass_kg(&self) -> [f64; 3] {
        self.modal_mass_kg
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
