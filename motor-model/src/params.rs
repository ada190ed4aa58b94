//! Parameters of the motor: Table 1 of the paper as data.
//!
//! [`Parameter`] names each one, [`Parameter::spec`] gives its key, unit, nominal value, tolerance, origin and the
//! bounds within which the model is valid, and [`MotorParams`] holds a checked set of values.

mod draw;
mod table;
mod tilting;
mod tilting_table;

use crate::error::OutOfBounds;
use crate::math;
pub use table::{COUNT, Parameter};
pub use tilting::{TiltingParameter, TiltingParams};

/// Distribution of a parameter over motors of one make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// The same in every motor.
    Exact,
    /// Normal about the nominal with half of this as standard deviation, cut off at this.
    Normal(f64),
    /// Uniform between two values.
    Uniform(f64, f64),
}

/// Where a nominal value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Measured on the device (Table 1, "M").
    Measured,
    /// Finite-element model of the paper.
    FiniteElement,
    /// Calculated in the paper.
    Calculated,
    /// Range in the literature that the paper cites.
    Literature,
    /// Tuned in the paper within a physical range.
    Tuned,
    /// Not in the paper: derived or chosen here.
    Assumed,
}

/// Description of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Key in scene files and on the command line.
    pub key: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Value of Table 1.
    pub nominal: f64,
    /// Distribution over motors.
    pub tolerance: Tolerance,
    /// Smallest value the model accepts.
    pub min: f64,
    /// Largest value the model accepts.
    pub max: f64,
    /// Where the nominal comes from.
    pub origin: Origin,
    /// Meaning, in one line.
    pub meaning: &'static str,
}

/// A set of parameter values, each finite and within its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorParams {
    values: [f64; COUNT],
}

impl Default for MotorParams {
    fn default() -> Self {
        Self::nominal()
    }
}

impl MotorParams {
    /// Table 1's nominal values (with Table 3's mode shift).
    pub const fn nominal() -> Self {
        let mut values = [0.0; COUNT];
        let mut number = 0;
        while number < COUNT {
            #[expect(clippy::indexing_slicing, reason = "below the length of both")]
            {
                values[number] = Parameter::ALL[number].spec().nominal;
            }
            number += 1;
        }
        Self { values }
    }

    /// The value of `parameter`, in the unit of its spec.
    pub const fn get(&self, parameter: Parameter) -> f64 {
        #[expect(clippy::indexing_slicing, reason = "there is one value per discriminant")]
        self.values[parameter as usize]
    }

    /// The same set with `parameter` at `value`.
    ///
    /// # Errors
    /// When `value` is outside the parameter's bounds or NaN.
    pub fn with(mut self, parameter: Parameter, value: f64) -> Result<Self, OutOfBounds> {
        let value = parameter.check(value)?;
        #[expect(clippy::indexing_slicing, reason = "there is one value per discriminant")]
        {
            self.values[parameter as usize] = value;
        }
        Ok(self)
    }

    /// Effective tooth angle `th = 90 - (theta_t + theta_m)` in degrees.
    ///
    /// Where the teeth stand in the shape of both driven modes; mode B may have an extra
    /// ([`Self::mode_b_tooth_angle_deg`]). With the nominal values it is 30: the paper calls `theta_t + theta_m` "the
    /// sum ... 30 deg" although it is 60.
    /// With 60 the magnitudes are the same and the sense of rotation is reversed.
    pub fn effective_tooth_angle_deg(&self) -> f64 {
        90.0 - (self.get(Parameter::ToothAngle) + self.get(Parameter::ModeShift))
    }

    /// The same of mode B, whose shape has a shift of its own: `th_B = th - theta_B` in degrees. In mode C it is `th`.
    pub fn mode_b_tooth_angle_deg(&self) -> f64 {
        self.effective_tooth_angle_deg() - self.get(Parameter::ModeBExtraShift)
    }

    /// Modal masses of modes A, B and C over the stator's mass: 1, 1/2 and 1/2 in the paper (7a-c).
    pub fn mass_fractions(&self) -> [f64; 3] {
        [Parameter::ModeAMassFraction, Parameter::ModeBMassFraction, Parameter::ModeCMassFraction]
            .map(|parameter| self.get(parameter))
    }

    /// Lever from stator slope to tangential tooth displacement, `L = (t_s + 2 h_t) / R_t` (9a).
    pub fn lever(&self) -> f64 {
        (self.get(Parameter::StatorThickness) + 2.0 * self.get(Parameter::ToothHeight))
            / self.get(Parameter::ToothRadius)
    }

    /// Ratio of the rotor's mass to the stator's, `m_r / m_s`.
    pub fn mass_ratio(&self) -> f64 {
        self.get(Parameter::RotorMass) / self.get(Parameter::StatorMass)
    }

    /// Ratio of the rotor's mass to that of a pair of teeth, `r = m_r sum phi_n^2 / M_n`: jump of the teeth's velocity
    /// per jump of the rotor's. It is `3 m_r / m_s` in the paper (8b, 12a).
    ///
    /// ```text
    /// r = (m_r/m_s) (1/f_A + 1/f_B + (1/f_C - 1/f_B) cos^2 2 th + sin 2 (th_B - th) sin 2 (th_B + th) / f_B)
    /// ```
    ///
    /// with `f_n = M_n / m_s`: written so that the sum over equal masses and shifts is exact.
    pub fn tooth_mass_ratio(&self) -> f64 {
        let [per_a, per_b, per_c] = self.mass_fractions().map(|fraction| 1.0 / fraction);
        let (angle, of_b) =
            (self.effective_tooth_angle_deg().to_radians(), self.mode_b_tooth_angle_deg().to_radians());
        let (_, cos) = math::sin_cos(2.0 * angle);
        let (apart, _) = math::sin_cos(2.0 * (of_b - angle));
        let (together, _) = math::sin_cos(2.0 * (of_b + angle));
        (per_a + per_b + (per_c - per_b) * cos * cos + per_b * apart * together) * self.mass_ratio()
    }
}
