//! The stator: three damped oscillators, advanced exactly over a step, drive included.
//!
//! ```text
//! g_n'' + 2 zeta_n w_n g_n' + w_n^2 g_n = a_n(t)                                          (7a-c)
//! ```
//!
//! With `x = (g, g')`, the free propagator `P = exp(A h)` and the drive `a(t) = k F sin(phase)` whose phase turns by
//! `w h` a step, the particular solution is `x_p = M (sin, cos)` with
//!
//! ```text
//! H = 1 / ((w_n - w)(w_n + w) + i 2 zeta w_n w)      alpha = k F Re H,  beta = k F Im H
//! M = [ alpha  beta ; -w beta  w alpha ]
//! ```
//!
//! and the step is exact for any `h`, `w` and starting phase:
//!
//! ```text
//! x(t + h) = x(t) + (P - I) x(t) + G (sin, cos),     G = M (R - I) - (P - I) M,   R the rotation by w h.
//! ```
//!
//! `P - I` and `R - I` are stored rather than `P` and `R`: at 1 us they are of order 1e-3, and `P` in `f32` would
//! lose three of the seven digits that the resonance needs. Steady motion (8a) and impulse response (8b) of the paper
//! are this equation after a long drive and after a jump of `g'`.

mod forcing;
mod part;

use core::f64::consts::TAU;

use nalgebra::Vector3;

use crate::error::OutOfBounds;
use crate::math::{self, Real};
use crate::params::{MotorParams, Parameter};
use crate::phase::Phase;
use forcing::DrivenMode;
pub(crate) use forcing::Phasor;
pub use forcing::{DriveTuning, Forcing};
pub(crate) use part::{FreeMode, ModalPush};

/// The constants of one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Natural angular frequency `w_n`.
    pub natural_rad_s: f64,
    /// Damping ratio `zeta_n`, in `0..=0.99`.
    pub damping_ratio: f64,
    /// Modal mass `M_n`: in the paper that of the stator in A, half of it in B and C (7a-c).
    pub mass_kg: f64,
    /// Antinode amplitude `A_n` at resonance and full drive; 0 in mode A, which the coil does not drive.
    pub antinode_amplitude_m: f64,
}

impl Mode {
    /// Modal force per mass at full drive, `F_n = 2 zeta_n w_n^2 A_n`.
    pub fn drive_acceleration_m_s2(&self) -> f64 {
        2.0 * self.damping_ratio * self.natural_rad_s * self.natural_rad_s * self.antinode_amplitude_m
    }

    /// Modes A, B and C of a motor.
    ///
    /// The amplitudes of Table 1 were measured at the tooth angle `theta_t`, without the mode shift, so the
    /// antinode's is `A_B = a_B / |sin 2 theta_t|` and `A_C = a_C / |cos 2 theta_t|`.
    ///
    /// # Errors
    /// When mode A's damping ratio `b_A / (2 M_A w_A)` exceeds 0.99.
    pub fn all(params: &MotorParams) -> Result<[Self; 3], OutOfBounds> {
        use Parameter::{
            ModeADamping, ModeAFrequency, ModeBDampingRatio, ModeBFrequency, ModeBToothAmplitude,
            ModeCDampingRatio, ModeCFrequency, ModeCToothAmplitude, StatorMass, ToothAngle,
        };
        let [mass_a_kg, mass_b_kg, mass_c_kg] =
            params.mass_fractions().map(|fraction| fraction * params.get(StatorMass));
        let natural_a_rad_s = TAU * params.get(ModeAFrequency);
        let critical = 2.0 * mass_a_kg * natural_a_rad_s;
        let spec = ModeADamping.spec();
        let damping =
            OutOfBounds::check(spec.key, params.get(ModeADamping), 0.0, 0.99 * critical, spec.unit)?;
        let (sin, cos) = math::sin_cos(2.0 * params.get(ToothAngle).to_radians());
        Ok([
            Self {
                natural_rad_s: natural_a_rad_s,
                damping_ratio: damping / critical,
                mass_kg: mass_a_kg,
                antinode_amplitude_m: 0.0,
            },
            Self {
                natural_rad_s: TAU * params.get(ModeBFrequency),
                damping_ratio: params.get(ModeBDampingRatio),
                mass_kg: mass_b_kg,
                antinode_amplitude_m: params.get(ModeBToothAmplitude) / sin.abs(),
            },
            Self {
                natural_rad_s: TAU * params.get(ModeCFrequency),
                damping_ratio: params.get(ModeCDampingRatio),
                mass_kg: mass_c_kg,
                antinode_amplitude_m: params.get(ModeCToothAmplitude) / cos.abs(),
            },
        ])
    }

    /// `exp(A h)` of this mode in `f64`, rows `(g, g')`: its free motion over `h` s. For construction.
    pub fn propagator(&self, h: f64) -> [[f64; 2]; 2] {
        let [[gg, gv], [vg, vv]] = self.propagator_minus_identity(h);
        [[1.0 + gg, gv], [vg, 1.0 + vv]]
    }

    /// `exp(A h) - I` of this mode in `f64`, rows `(g, g')`, each entry free of cancellation.
    pub(crate) fn propagator_minus_identity(&self, h: f64) -> [[f64; 2]; 2] {
        let (w, zeta) = (self.natural_rad_s, self.damping_ratio);
        let wd = w * math::sqrt((1.0 - zeta) * (1.0 + zeta));
        let decay = math::exp(-zeta * w * h);
        let (half_sin, _) = math::sin_cos(0.5 * wd * h);
        let (sin, cos) = math::sin_cos(wd * h);
        // exp(-zeta w h) cos(wd h) - 1
        let cos_part = math::exp_m1(-zeta * w * h) * cos - 2.0 * half_sin * half_sin;
        let sin_part = decay * sin / wd;
        [[cos_part + zeta * w * sin_part, sin_part], [-w * w * sin_part, cos_part - zeta * w * sin_part]]
    }
}

/// Total modal coordinates and their rates, in the order A, B, C: the modal rows of [`crate::MotorState`]'s table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalState<T> {
    /// `g_n` in m.
    pub displacement_m: Vector3<T>,
    /// `g_n'` in m/s.
    pub velocity_m_s: Vector3<T>,
}

impl<T: Real> Default for ModalState<T> {
    fn default() -> Self {
        Self { displacement_m: Vector3::zeros(), velocity_m_s: Vector3::zeros() }
    }
}

impl<T: Real> ModalState<T> {
    /// Rounds to the spacing of floating-point numbers near `floor`.
    #[inline]
    pub(crate) fn drop_below(&mut self, floor: T) {
        self.displacement_m = self.displacement_m.add_scalar(floor).add_scalar(-floor);
        self.velocity_m_s = self.velocity_m_s.add_scalar(floor).add_scalar(-floor);
    }
}

/// `P - I` of the three modes over some time, entry by entry.
#[derive(Clone, Debug)]
pub(crate) struct Propagator<T> {
    gg: Vector3<T>,
    gv: Vector3<T>,
    vg: Vector3<T>,
    vv: Vector3<T>,
}

impl<T: Real> Propagator<T> {
    /// From the entries of each mode.
    fn new([a, b, c]: [[[T; 2]; 2]; 3]) -> Self {
        let [[[a_gg, a_gv], [a_vg, a_vv]], [[b_gg, b_gv], [b_vg, b_vv]], [[c_gg, c_gv], [c_vg, c_vv]]] =
            [a, b, c];
        Self {
            gg: Vector3::new(a_gg, b_gg, c_gg),
            gv: Vector3::new(a_gv, b_gv, c_gv),
            vg: Vector3::new(a_vg, b_vg, c_vg),
            vv: Vector3::new(a_vv, b_vv, c_vv),
        }
    }

    /// Adds to `state` the change by free motion from `(g, v)`.
    #[inline]
    fn add_to(&self, state: &mut ModalState<T>, g: &Vector3<T>, v: &Vector3<T>) {
        state.displacement_m += self.gg.component_mul(g) + self.gv.component_mul(v);
        state.velocity_m_s += self.vg.component_mul(g) + self.vv.component_mul(v);
    }
}

/// Exact propagation of modes A, B and C over one step.
#[derive(Clone, Debug)]
pub struct ModalBank<T> {
    step: Propagator<T>,
    b: DrivenMode<T>,
    c: DrivenMode<T>,
    free: [FreeMode<T>; 3],
    step_s: T,
}

impl<T: Real> ModalBank<T> {
    /// The propagators of `modes` (A, B, C) over `step_s`.
    pub fn new(modes: &[Mode; 3], tuning: DriveTuning, step_s: f64) -> Self {
        let [_, b, c] = modes;
        let (drive_b_rad_s, drive_c_rad_s) = match tuning {
            DriveTuning::Resonant => (b.natural_rad_s, c.natural_rad_s),
            DriveTuning::Fixed { b_hz, c_hz } => (TAU * b_hz, TAU * c_hz),
        };
        Self {
            step: Propagator::new(
                modes.map(|mode| mode.propagator_minus_identity(step_s).map(|row| row.map(T::from_f64))),
            ),
            b: DrivenMode::new(b, drive_b_rad_s, step_s),
            c: DrivenMode::new(c, drive_c_rad_s, step_s),
            free: modes.map(|mode| FreeMode::new(&mode, step_s)),
            step_s: T::from_f64(step_s),
        }
    }

    /// Advances the modes by one step that starts at `phase` of the drive.
    #[expect(
        clippy::inline_always,
        reason = "a call would move the state through memory, an eighth of a step on a microcontroller"
    )]
    #[inline(always)]
    pub fn advance(&self, state: &mut ModalState<T>, forcing: &Forcing<T>, phase: Phase) {
        let (g, v) = (state.displacement_m, state.velocity_m_s);
        self.step.add_to(state, &g, &v);
        forcing.add_to(state, phase);
    }

    /// The same with given sine and cosine of the drive's phase at the start of the step.
    #[inline]
    pub fn advance_from(&self, state: &mut ModalState<T>, forcing: &Forcing<T>, [sin, cos]: [T; 2]) {
        let (g, v) = (state.displacement_m, state.velocity_m_s);
        self.step.add_to(state, &g, &v);
        forcing.add_from(state, [sin, cos]);
    }
}
