//! Table 1, one entry per parameter.

use super::Origin::{Assumed, Calculated, FiniteElement, Literature, Measured, Tuned};
use super::Tolerance::{Exact, Normal, Uniform};

const RADIUS: (f64, f64) = (1e-5, 1.0);
const LENGTH: (f64, f64) = (0.0, 0.1);
const FREQUENCY: (f64, f64) = (1.0, 1e6);
const AMPLITUDE: (f64, f64) = (0.0, 1e-2);
const DAMPING_RATIO: (f64, f64) = (0.0, 0.99);
const MASS: (f64, f64) = (1e-9, 1.0);
const MASS_FRACTION: (f64, f64) = (0.01, 100.0);

/// Defines an enumeration of parameters, the list of all its variants and the table of their specs from one list.
///
/// A row is `Variant: key, unit, nominal, tolerance, (min, max), origin, meaning;`. The order of the rows is the
/// order in which [`crate::MotorParams::draw`] and [`crate::TiltingParams::draw`] take random numbers: a row in a new
/// place changes the motor that a seed names.
macro_rules! parameters {
    ($(#[$enum_doc:meta])* $parameter:ident; $($(#[$doc:meta])* $name:ident:
        $key:literal, $unit:literal, $nominal:expr, $tolerance:expr, $bounds:expr, $origin:expr, $meaning:literal;
    )*) => {
        $(#[$enum_doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $parameter {
            $($(#[$doc])* $name,)*
        }

        /// Number of parameters.
        pub const COUNT: usize = [$($key),*].len();

        const SPECS: [$crate::params::ParameterSpec; COUNT] = [$($crate::params::ParameterSpec {
            key: $key,
            unit: $unit,
            nominal: $nominal,
            tolerance: $tolerance,
            min: $bounds.0,
            max: $bounds.1,
            origin: $origin,
            meaning: $meaning,
        }),*];

        /// Key, unit, least and largest value, apart from the rest: a microcontroller has no room for meanings.
        const LIMITS: [(&str, &str, f64, f64); COUNT] = [$(($key, $unit, $bounds.0, $bounds.1)),*];

        impl $parameter {
            /// `value`, if the parameter takes it.
            pub(crate) fn check(self, value: f64) -> Result<f64, $crate::error::OutOfBounds> {
                #[expect(clippy::indexing_slicing, reason = "there is one row per discriminant by construction")]
                let (key, unit, min, max) = LIMITS[self as usize];
                $crate::error::OutOfBounds::check(key, value, min, max, unit)
            }

            /// Every parameter, in the order of the table.
            pub const ALL: [Self; COUNT] = [$(Self::$name),*];

            /// The parameter with this key.
            pub fn from_key(key: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|parameter| parameter.spec().key == key)
            }

            /// Key, unit, nominal, tolerance, origin, bounds and meaning.
            ///
            /// The bounds are those of the model's arithmetic and of sense (a mass is positive), far wider than any
            /// real motor.
            pub const fn spec(self) -> $crate::params::ParameterSpec {
                #[expect(clippy::indexing_slicing, reason = "there is one row per discriminant by construction")]
                SPECS[self as usize]
            }
        }
    };
}
pub(super) use parameters;

parameters! {
    /// A parameter of the motor.
    ///
    /// The paper's symbol stands in brackets.
    Parameter;
    /// Inner radius of the stator ring (`R_i`). It is of Table 1; no motion depends on it.
    StatorInnerRadius: "motor.stator_inner_radius_m", "m", 2.125e-3, Normal(0.02e-3), RADIUS, Measured,
        "inner radius of the stator ring, R_i: no run depends on it; stator.inner_radius_m draws the ring";
    /// Outer radius of the stator ring (`R_o`). It is of Table 1; no motion depends on it.
    StatorOuterRadius: "motor.stator_outer_radius_m", "m", 3.89e-3, Normal(0.02e-3), RADIUS, Measured,
        "outer radius of the stator ring, R_o: no run depends on it; stator.outer_radius_m draws the ring";
    /// Radius at which the teeth meet the rotor (`R_t`).
    ToothRadius: "motor.tooth_radius_m", "m", 3.063e-3, Normal(0.02e-3), RADIUS, Measured,
        "radius at which the teeth strike, R_t";
    /// Stator thickness (`t_s`).
    StatorThickness: "motor.stator_thickness_m", "m", 70e-6, Normal(10e-6), LENGTH, Measured,
        "stator thickness, t_s";
    /// Tooth height (`h_t`).
    ToothHeight: "motor.tooth_height_m", "m", 260e-6, Normal(10e-6), LENGTH, Measured,
        "tooth height, h_t";
    /// Tooth angle (`theta_t`).
    // Away from 45 and 90 degrees: there the tooth sits on a node, and its amplitude does not give the antinode's.
    ToothAngle: "motor.tooth_angle_deg", "deg", 62.635, Normal(0.2), (46.0, 89.0), Measured,
        "tooth angle, theta_t";
    /// Shift of the mode shapes (`theta_m`).
    ModeShift: "motor.mode_shift_deg", "deg", -2.635, Normal(0.2), (-90.0, 90.0), Tuned,
        "mode shift angle of modes B and C, theta_m (-2.635 in Table 3, -2.5 in Tables 1 and 2)";
    /// Natural frequency of mode A (`f_A`).
    ModeAFrequency: "motor.mode_a.frequency_hz", "Hz", 2150.0, Normal(10.0), FREQUENCY, FiniteElement,
        "natural frequency of mode A, f_A";
    /// Damping coefficient of mode A (`b_A`), on its modal mass.
    ModeADamping: "motor.mode_a.damping_n_s_per_m", "N s/m", 22.5e-3, Normal(1.4e-3), (0.0, 1e4), FiniteElement,
        "damping of mode A, b_A; zeta_A = b_A / (2 M_A w_A)";
    /// Natural frequency of mode B (`f_B`).
    ModeBFrequency: "motor.mode_b.frequency_hz", "Hz", 6300.0, Normal(10.0), FREQUENCY, Measured,
        "natural frequency of mode B, f_B";
    /// Damping ratio of mode B (`zeta_B`).
    ModeBDampingRatio: "motor.mode_b.damping_ratio", "", 0.0063, Normal(0.002), DAMPING_RATIO, Measured,
        "damping ratio of mode B, zeta_B";
    /// Amplitude of mode B at the teeth, at resonance and full drive.
    ModeBToothAmplitude: "motor.mode_b.tooth_amplitude_m", "m", 20.72e-6, Normal(1.24e-6), AMPLITUDE, Measured,
        "amplitude of mode B at the teeth, at theta_t";
    /// Natural frequency of mode C (`f_C`).
    ModeCFrequency: "motor.mode_c.frequency_hz", "Hz", 7460.0, Normal(10.0), FREQUENCY, Measured,
        "natural frequency of mode C, f_C";
    /// Damping ratio of mode C (`zeta_C`).
    ModeCDampingRatio: "motor.mode_c.damping_ratio", "", 0.0075, Normal(0.002), DAMPING_RATIO, Measured,
        "damping ratio of mode C, zeta_C";
    /// Amplitude of mode C at the teeth, at resonance and full drive.
    ModeCToothAmplitude: "motor.mode_c.tooth_amplitude_m", "m", 1.81e-6, Normal(0.11e-6), AMPLITUDE, Measured,
        "amplitude of mode C at the teeth, at theta_t";
    /// Rotor mass (`m_r`).
    RotorMass: "motor.rotor_mass_kg", "kg", 46e-6, Normal(0.5e-6), MASS, Measured,
        "rotor mass, m_r";
    /// Rotor moment of inertia about its axis (`J`).
    RotorInertia: "motor.rotor_inertia_kg_m2", "kg m^2", 4.59e-10, Exact, (1e-18, 1.0), Assumed,
        "rotor inertia, J: 350 um silicon annulus of that mass with a 2 mm hole";
    /// Stator mass (`m_s`).
    StatorMass: "motor.stator_mass_kg", "kg", 10.7e-6, Normal(1.0e-6), MASS, Calculated,
        "stator mass, m_s";
    /// Coefficient of restitution (`e`).
    Restitution: "motor.restitution", "", 0.6, Uniform(0.57, 0.642), (0.0, 1.0), Literature,
        "coefficient of restitution, e";
    /// Coefficient of friction (`mu`).
    Friction: "motor.friction", "", 0.4, Uniform(0.2, 0.6), (0.0, 1e6), Literature,
        "coefficient of friction, mu";
    /// Squeeze-film damping of the rotor's vertical motion (`b_z`).
    VerticalDamping: "motor.vertical_damping_n_s_per_m", "N s/m", 3.6e-3, Uniform(0.6e-3, 3.6e-3), (0.0, 1e3),
        Calculated, "squeeze-film damping of the rotor, b_z";
    /// Drag on the rotor's rotation, as a force per speed at the tooth radius (`b_th`).
    TangentialDrag: "motor.tangential_drag_n_s_per_m", "N s/m", 4.3e-11, Exact, (0.0, 1e3), Calculated,
        "drag on the rotation, b_th";
    /// Relative scatter of the stator's amplitude between tooth pairs and runs.
    AmplitudeVariation: "motor.amplitude_variation", "", 0.005, Exact, (0.0, 0.1), Measured,
        "standard deviation of the amplitude, per tooth pair and run";
    /// Gravity.
    Gravity: "motor.gravity_m_s2", "m/s^2", 9.81, Exact, (-1e3, 1e3), Assumed,
        "gravity, downwards";
    /// Shift of the mode shape of mode B beside that of both modes (`theta_B`).
    ModeBExtraShift: "motor.mode_b.extra_shift_deg", "deg", 0.0, Exact, (-90.0, 90.0), Tuned,
        "shift angle of mode B less motor.mode_shift_deg, theta_B (none in the paper)";
    /// Modal mass of mode A over the stator's mass (`M_A / m_s`).
    ModeAMassFraction: "motor.mode_a.mass_fraction", "", 1.0, Exact, MASS_FRACTION, Calculated,
        "modal mass of mode A over the stator's mass, M_A / m_s";
    /// Modal mass of mode B over the stator's mass (`M_B / m_s`).
    ModeBMassFraction: "motor.mode_b.mass_fraction", "", 0.5, Exact, MASS_FRACTION, Calculated,
        "modal mass of mode B over the stator's mass, M_B / m_s";
    /// Modal mass of mode C over the stator's mass (`M_C / m_s`).
    ModeCMassFraction: "motor.mode_c.mass_fraction", "", 0.5, Exact, MASS_FRACTION, Calculated,
        "modal mass of mode C over the stator's mass, M_C / m_s";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_nominals_and_tolerances_lie_within_bounds_and_keys_are_unique() {
        for parameter in Parameter::ALL {
            let spec = parameter.spec();
            assert!(spec.min <= spec.nominal && spec.nominal <= spec.max, "{}", spec.key);
            let (low, high) = match spec.tolerance {
                Exact => (spec.nominal, spec.nominal),
                Normal(tolerance) => (spec.nominal - tolerance, spec.nominal + tolerance),
                Uniform(low, high) => (low, high),
            };
            assert!(
                spec.min <= low && low <= spec.nominal && spec.nominal <= high && high <= spec.max,
                "{}",
                spec.key
            );
            assert_eq!(Parameter::from_key(spec.key), Some(parameter));
        }
    }
}
