//! The 24 states of the stator filter: their indices, units and priors, and sparse rows over them.
//!
//! Each state is an error, truth less estimate. The estimates are kept in [`super::stator::StatorFilter`].
//!
//! | index | symbol | unit | meaning | prior standard deviation |
//! |---|---|---|---|---|
//! | 0 | `s'` | m/s | tangential velocity of the tooth at the last impact | set by each impact |
//! | 1 | `z` | m | height of the rotor above the teeth of a stator at rest | 1e-8 |
//! | 2, 3 | `g_A`, `g_A'` | m, m/s | displacement and velocity of mode A | 1e-8 each |
//! | 4, 5 | `g_B`, `g_B'` | m, m/s | the same of mode B | 1e-8 each |
//! | 6, 7 | `g_C`, `g_C'` | m, m/s | the same of mode C | 1e-8 each |
//! | 8 | `t` | s | instant of the last impact after the middle of its sample period | period / sqrt 12 at each impact |
//! | 9 | `dv` | m/s | jump of the rotor's vertical velocity at the last impact | sigma sqrt(1 + p) at each impact |
//! | 10, 11 | `kappa_A`, `c_A` | 1 | stiffness and damping of mode A | 0.0041, 0.056 |
//! | 12, 13, 14 | `kappa_B`, `c_B`, `f_B` | 1 | stiffness, damping, driven amplitude of mode B | 0.0014, 0.14, 0.027 |
//! | 15, 16, 17 | `kappa_C`, `c_C`, `f_C` | 1 | the same of mode C | 0.0012, 0.117, 0.027 |
//! | 18 | `m` | 1 | mass ratio of rotor and stator | 0.042 |
//! | 19 | `q` | 1 | `1 / (1 + e)`, e the restitution | 0.013 |
//! | 20, 21 | `s_0`, `s_1` | 1 | amplitude of the first and second pair of teeth in modes B and C | 0.005 each |
//! | 22 | `d` | rad | angle of the teeth | 2.2e-3 |
//! | 23 | `alpha` | rad | phase of the drive, positive where the drive leads | 0.07 |
//!
//! A unit of 1 means a part of the nominal value. Index 10 to 22 are the 13 parameters of the motor; they and the phase
//! are constant in a run, so they have no process noise. Their priors are the tolerances of Table 1: half a tolerance
//! is a standard deviation, 0.88 of that where the ends are cut off. A command that is reported one tick of 10 us late
//! is 0.4 rad off. 1e-8 is a stator at rest, small beside every noise of the model and large enough for `f32`. `sigma`
//! and `p` are those of [`crate::vibrometer::impact_detector`].
//!
//! The order serves the factors `P = U D U'`: what changes at every impact stands first, the constants last.

use motor_model::Real;
use nalgebra::SVector;
use ud_filter::SparseRow;

/// Number of states.
pub(super) const STATES: usize = 24;
/// Tangential velocity of the tooth at the last impact.
pub(super) const TOOTH_VELOCITY: usize = 0;
/// Height of the rotor.
pub(super) const HEIGHT: usize = 1;
/// Displacement of mode A; its velocity and the other modes follow.
pub(super) const MODES: usize = 2;
/// Instant of the last impact.
pub(super) const INSTANT: usize = 8;
/// Jump of the rotor's vertical velocity at the last impact.
pub(super) const JUMP: usize = 9;
/// Instant and jump: those of another impact at each, and independent of all else until its update.
pub(super) const IMPACT_STATES: usize = JUMP + 1 - INSTANT;
/// Stiffness, damping and driven amplitude of the modes; mode A has no drive.
pub(super) const MODE_PARAMETERS: usize = 10;
/// Mass ratio.
pub(super) const MASS_RATIO: usize = 18;
/// `1 / (1 + e)`.
pub(super) const RESTITUTION: usize = 19;
/// Amplitude of the first pair of teeth; that of the second follows.
pub(super) const PAIR_AMPLITUDES: usize = 20;
/// Angle of the teeth.
pub(super) const TOOTH_ANGLE: usize = 22;
/// Phase of the drive.
pub(super) const DRIVE_PHASE: usize = 23;

/// Stiffness of each mode; its damping follows and, in modes B and C, its driven amplitude.
pub(super) const STIFFNESSES: [usize; 3] = [MODE_PARAMETERS, MODE_PARAMETERS + 2, MODE_PARAMETERS + 5];

/// Standard deviation of a motion that is known to be zero, in SI units of the state: assumed, see the module's head.
pub(super) const AT_REST: f64 = 1e-8;

/// Standard deviations at the start, in the unit of each state: a stator at rest, then the priors of the parameters.
pub(super) const PRIOR: [f64; STATES] = [
    // Motion, and instant and jump of an impact.
    AT_REST, AT_REST, AT_REST, AT_REST, AT_REST, AT_REST, AT_REST, AT_REST, AT_REST, AT_REST,
    // Modes A, B and C: stiffness, damping, driven amplitude.
    0.0041, 0.056, 0.0014, 0.14, 0.027, 0.0012, 0.117, 0.027,
    // Mass ratio, restitution, amplitudes of the pairs, angle of the teeth, phase of the drive.
    0.042, 0.013, 0.005, 0.005, 2.2e-3, 0.07,
];

/// One number for each state.
pub(super) type Errors<T> = SVector<T, STATES>;

/// A sparse row: a Jacobian of gap, approach or tooth velocity, or errors, whose support is height, modes, instant and
/// jump (`lead`), and mass ratio, restitution, teeth and phase (`last`).
pub(super) type Row<T> = SparseRow<T, HEIGHT, { JUMP + 1 - HEIGHT }, { STATES - MASS_RATIO }>;

/// Errors of the height and of the modes, the states 1 to 7.
pub(super) type MotionErrors<T> = [T; 7];

/// The entry of a state within the support of `row`.
#[inline]
pub(super) fn entry<T: Real>(row: &Row<T>, state: usize) -> T {
    let place =
        if state < MASS_RATIO { row.lead.get(state - HEIGHT) } else { row.last.get(state - MASS_RATIO) };
    place.copied().unwrap_or_default()
}

/// Variances of a stator at rest whose parameters are known to their prior.
pub(super) fn prior_variances<T: Real>() -> Errors<T> {
    let deviations = Errors::from(PRIOR).map(T::from_f64);
    deviations.component_mul(&deviations)
}
