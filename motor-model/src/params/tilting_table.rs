//! What the tilting motor needs beside Table 1, one entry per parameter.

use super::Origin::{Assumed, Calculated, FiniteElement, Literature};
use super::Tolerance::{Exact, Normal, Uniform};
use super::table::parameters;

const DISTANCE: (f64, f64) = (0.0, 1.0);
const RADIUS: (f64, f64) = (1e-5, 1.0);
const FRICTION: (f64, f64) = (0.0, 1e6);
const FAR_M: f64 = 1.0;

parameters! {
    /// A parameter of the tilting motor beside those of [`super::Parameter`].
    TiltingParameter;
    /// Radial clearance between the hole of the rotor and the pin (`c`).
    // Hub bearings assembled from silicon parts have 3.5 to 9.2 um (Demiri, Boedo, Holsen, Wear 312 (2014) 58).
    HubClearance: "motor.hub.clearance_m", "m", 20e-6, Uniform(14e-6, 26e-6), DISTANCE, Assumed,
        "radial clearance between hole and pin, c";
    /// Coefficient of friction between hole and pin (`mu_h`).
    HubFriction: "motor.hub.friction", "", 0.4, Uniform(0.3, 0.5), FRICTION, Assumed,
        "coefficient of friction between hole and pin, mu_h";
    /// Coefficient of restitution between hole and pin (`e_h`).
    HubRestitution: "motor.hub.restitution", "", 0.5, Uniform(0.3, 0.8), (0.0, 1.0), Assumed,
        "coefficient of restitution between hole and pin, e_h";
    /// Radius of the pin (`r_h`).
    HubPinRadius: "motor.hub.pin_radius_m", "m", 1e-3, Normal(5e-6), RADIUS, Literature,
        "radius of the pin, r_h";
    /// Length of the hole along its axis (`l_h`).
    HubLength: "motor.hub.length_m", "m", 350e-6, Normal(10e-6), (0.0, 0.1), Literature,
        "length of the hole along its axis, l_h";
    /// Thickness of the rotor (`h_r`).
    RotorThickness: "motor.rotor_thickness_m", "m", 350e-6, Normal(10e-6), (0.0, 0.1), Literature,
        "thickness of the rotor, h_r";
    /// Outer radius of the rotor (`R_r`).
    RotorOuterRadius: "motor.rotor_outer_radius_m", "m", 4.35e-3, Normal(20e-6), RADIUS, Assumed,
        "outer radius of the rotor, R_r: follows from its mass";
    /// Natural frequency of the tilting modes of the stator (`f_T`).
    StatorTiltFrequency: "motor.stator_tilt.frequency_hz", "Hz", 3050.0, Uniform(2750.0, 3300.0), (1.0, 1e6),
        FiniteElement, "natural frequency of the stator's tilting modes, f_T";
    /// Damping ratio of the tilting modes of the stator (`zeta_T`).
    StatorTiltDampingRatio: "motor.stator_tilt.damping_ratio", "", 0.02, Uniform(0.01, 0.05), (0.0, 0.99), Assumed,
        "damping ratio of the stator's tilting modes, zeta_T";
    /// Exponent of the deflection of modes B and C along the radius at the teeth (`k_r`).
    ToothRockingExponent: "motor.tooth_rocking_exponent", "", 1.6, Normal(0.1), (-10.0, 10.0), FiniteElement,
        "exponent of modes B and C along the radius, k_r: by it a tooth rocks radially";
    /// What mode C's exponent has beside that of mode B.
    ModeCExtraRockingExponent: "motor.mode_c.extra_rocking_exponent", "", 0.0, Normal(0.05), (-10.0, 10.0),
        FiniteElement, "exponent of mode C along the radius less that of mode B";
    /// What mode C's shift has beside `motor.mode_shift_deg`.
    ModeCExtraShift: "motor.mode_c.extra_shift_deg", "deg", 0.0, Normal(0.5), (-90.0, 90.0), FiniteElement,
        "shift angle of mode C less that of mode B";
    /// Standard deviation of the height of each tooth, drawn per motor.
    ToothHeightScatter: "motor.tooth_height_scatter_m", "m", 0.0, Exact, (0.0, 1e-3), Assumed,
        "standard deviation of the height of a tooth";
    /// Slope of the pin against the axis of the stator.
    PinSlope: "motor.pin_slope_rad", "rad", 0.0, Uniform(0.0, 2e-3), (0.0, 0.5), Assumed,
        "slope of the pin";
    /// Damping of tilt by the film, relative to an evenly spread pressure.
    TiltDampingFactor: "motor.tilt_damping_factor", "", 1.0, Uniform(0.5, 1.5), (0.0, 1e3), Assumed,
        "damping of tilt relative to that of an evenly spread pressure: 1 if tilt decays as fast as height";
    /// Depth of the floor under the rotor's rim, below the tops of the teeth.
    RimDepth: "motor.rim.depth_m", "m", FAR_M, Exact, DISTANCE, Assumed,
        "depth of a floor under the rim below the tops of the teeth; 1 m is none";
    /// Height of a ceiling above the rotor at rest.
    CeilingHeight: "motor.ceiling.height_m", "m", FAR_M, Exact, DISTANCE, Assumed,
        "height of a ceiling above the rotor at rest; 1 m is none";
    /// Radius at which the rotor meets the ceiling.
    CeilingRadius: "motor.ceiling.radius_m", "m", 1.5e-3, Exact, RADIUS, Assumed,
        "radius at which the rotor meets the ceiling";
    /// Friction between the rotor and rim floor or ceiling.
    CeilingFriction: "motor.ceiling.friction", "", 0.3, Exact, FRICTION, Assumed,
        "coefficient of friction at floor and ceiling";
    /// Difference of the frequencies of the two tilting modes of the stator, over `f_T`, their mean.
    StatorTiltSplit: "motor.stator_tilt.split", "", 0.0, Exact, (0.0, 1.0), Assumed,
        "frequency of the tilting mode along y less that along x, over f_T, the mean of both";
    /// Modal mass of each tilting mode over the stator's mass (`M_T / m_s`).
    StatorTiltMassFraction: "motor.stator_tilt.mass_fraction", "", 0.5, Exact, (0.01, 100.0), Calculated,
        "modal mass of a tilting mode over the stator's mass, M_T / m_s: half for a rigid ring";
    /// Exponent of the deflection of the tilting modes along the radius at the teeth (`k_T`).
    StatorTiltRockingExponent: "motor.stator_tilt.rocking_exponent", "", 1.0, Exact, (-10.0, 10.0), Assumed,
        "exponent of the stator's tilting modes along the radius, k_T: 1 for a rigid ring";
    /// Exponent of the deflection of mode A along the radius at the teeth (`k_A`).
    ModeARockingExponent: "motor.mode_a.rocking_exponent", "", 0.0, Exact, (-10.0, 10.0), Assumed,
        "exponent of mode A along the radius, k_A: 0 for a rigid ring";
}
