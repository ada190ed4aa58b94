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
//! `P - I` and `R - I` are stored rather than `P` and `R`: at 1 us they are of order 1e-3, and `f32` would lose three
//! of its seven digits, which is to say the resonance. Steady motion (8a) and impulse response (8b) of the paper are this
//! equation after a long drive and after a jump of `g'`.

use core::f64::consts::TAU;

use nalgebra::Vector3;

use crate::drive::{DriveCommand, DriveMode};
use crate::error::OutOfBounds;
use crate::math::{self, Real};
use crate::params::{MotorParams, Parameter};
use crate::phase::Phase;

/// The constants of one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Natural angular frequency `w_n`.
    pub natural_rad_s: f64,
    /// Damping ratio `zeta_n`, in `0..=0.99`.
    pub damping_ratio: f64,
    /// Modal mass: that of the stator in A, half of it in B and C (7a-c).
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
    /// The amplitudes of Table 1 were measured at the tooth angle `theta_t`, without the mode shift, so the antinode's is
    /// `A_B = a_B / |sin 2 theta_t|` and `A_C = a_C / |cos 2 theta_t|`.
    ///
    /// # Errors
    /// When mode A's damping ratio `b_A / (2 m_s w_A)` exceeds 0.99.
    pub fn all(params: &MotorParams) -> Result<[Self; 3], OutOfBounds> {
        use Parameter::{
            ModeADamping, ModeAFrequency, ModeBDampingRatio, ModeBFrequency, ModeBToothAmplitude,
            ModeCDampingRatio, ModeCFrequency, ModeCToothAmplitude, StatorMass, ToothAngle,
        };
        let stator_mass_kg = params.get(StatorMass);
        let natural_a_rad_s = TAU * params.get(ModeAFrequency);
        let critical = 2.0 * stator_mass_kg * natural_a_rad_s;
        let spec = ModeADamping.spec();
        let damping =
            OutOfBounds::check(spec.key, params.get(ModeADamping), 0.0, 0.99 * critical, spec.unit)?;
        let (sin, cos) = math::sin_cos(2.0 * params.get(ToothAngle).to_radians());
        Ok([
            Self {
                natural_rad_s: natural_a_rad_s,
                damping_ratio: damping / critical,
                mass_kg: stator_mass_kg,
                antinode_amplitude_m: 0.0,
            },
            Self {
                natural_rad_s: TAU * params.get(ModeBFrequency),
                damping_ratio: params.get(ModeBDampingRatio),
                mass_kg: stator_mass_kg / 2.0,
                antinode_amplitude_m: params.get(ModeBToothAmplitude) / sin.abs(),
            },
            Self {
                natural_rad_s: TAU * params.get(ModeCFrequency),
                damping_ratio: params.get(ModeCDampingRatio),
                mass_kg: stator_mass_kg / 2.0,
                antinode_amplitude_m: params.get(ModeCToothAmplitude) / cos.abs(),
            },
        ])
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

/// Total modal coordinates and their rates, in the order A, B, C.
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

/// The frequency at which the generator drives each mode when the command's offset is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum DriveTuning {
    /// At the motor's own resonances, as in the paper.
    #[default]
    Resonant,
    /// At fixed frequencies, wherever the motor's resonances are: a generator that does not know its motor.
    Fixed {
        /// Frequency for mode B.
        b_hz: f64,
        /// Frequency for mode C.
        c_hz: f64,
    },
}

/// A driven mode as the generator sees it.
#[derive(Clone, Copy, Debug)]
struct DrivenMode<T> {
    natural_rad_s: T,
    twice_damping_ratio: T,
    acceleration_m_s2: T,
    drive_rad_s: T,
    /// `w_n - w` at zero offset, from `f64`.
    detuning_rad_s: T,
    increment: Phase,
    /// `P - I` of this mode.
    propagator: [[T; 2]; 2],
}

/// The drive as a step uses it: what a command means for one motor and step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forcing<T> {
    command: DriveCommand,
    increment: Phase,
    /// `G`: what sine and cosine of the phase add to `g` and `g'`.
    gain: [[T; 2]; 2],
}

impl<T: Real> Default for Forcing<T> {
    fn default() -> Self {
        Self { command: DriveCommand::OFF, increment: Phase::ZERO, gain: [[T::zero(); 2]; 2] }
    }
}

impl<T> Forcing<T> {
    /// The command that this forcing realises.
    #[inline]
    pub fn command(&self) -> DriveCommand {
        self.command
    }

    /// Phase gained in a step; zero when off.
    #[inline]
    pub fn increment(&self) -> Phase {
        self.increment
    }
}

/// Exact propagation of modes A, B and C over one step.
#[derive(Clone, Debug)]
pub struct ModalBank<T> {
    // P - I of the three modes, entry by entry.
    gg: Vector3<T>,
    gv: Vector3<T>,
    vg: Vector3<T>,
    vv: Vector3<T>,
    b: DrivenMode<T>,
    c: DrivenMode<T>,
    step_s: T,
}

impl<T: Real> ModalBank<T> {
    /// The propagators of `modes` (A, B, C) over `step_s`.
    pub fn new(modes: &[Mode; 3], tuning: DriveTuning, step_s: f64) -> Self {
        let entry = |row: usize, column: usize| {
            let at = |mode: &Mode| {
                let propagator = mode.propagator_minus_identity(step_s);
                #[expect(clippy::indexing_slicing, reason = "row and column are 0 or 1 just below")]
                T::from_f64(propagator[row][column])
            };
            let [a, b, c] = modes;
            Vector3::new(at(a), at(b), at(c))
        };
        let [_, b, c] = modes;
        let (drive_b_rad_s, drive_c_rad_s) = match tuning {
            DriveTuning::Resonant => (b.natural_rad_s, c.natural_rad_s),
            DriveTuning::Fixed { b_hz, c_hz } => (TAU * b_hz, TAU * c_hz),
        };
        Self {
            gg: entry(0, 0),
            gv: entry(0, 1),
            vg: entry(1, 0),
            vv: entry(1, 1),
            b: DrivenMode::new(b, drive_b_rad_s, step_s),
            c: DrivenMode::new(c, drive_c_rad_s, step_s),
            step_s: T::from_f64(step_s),
        }
    }

    /// What `command` means for this motor and step. No transcendental call: some 60 operations.
    pub fn forcing(&self, command: DriveCommand) -> Forcing<T> {
        let driven = match command.mode() {
            None => {
                return Forcing { command, ..Forcing::default() };
            }
            Some(DriveMode::B) => &self.b,
            Some(DriveMode::C) => &self.c,
        };
        let offset_hz = T::from_f32(command.frequency_offset_hz());
        let increment = driven.increment.advanced(turns_as_phase(offset_hz * self.step_s));
        let gain = driven.gain(T::from_f32(command.amplitude()), offset_hz, increment);
        Forcing { command, increment, gain }
    }

    /// Advances the modes by one step that starts at `phase` of the drive.
    #[inline]
    pub fn advance(&self, state: &mut ModalState<T>, forcing: &Forcing<T>, phase: Phase) {
        let (g, v) = (state.displacement_m, state.velocity_m_s);
        state.displacement_m += self.gg.component_mul(&g) + self.gv.component_mul(&v);
        state.velocity_m_s += self.vg.component_mul(&g) + self.vv.component_mul(&v);
        let Some(mode) = forcing.command.mode() else {
            return;
        };
        let (sin, cos) = phase.sin_cos::<T>();
        let [[g_sin, g_cos], [v_sin, v_cos]] = forcing.gain;
        let (dg, dv) = (g_sin * sin + g_cos * cos, v_sin * sin + v_cos * cos);
        match mode {
            DriveMode::B => {
                state.displacement_m.y += dg;
                state.velocity_m_s.y += dv;
            }
            DriveMode::C => {
                state.displacement_m.z += dg;
                state.velocity_m_s.z += dv;
            }
        }
    }
}

impl<T: Real> DrivenMode<T> {
    fn new(mode: &Mode, drive_rad_s: f64, step_s: f64) -> Self {
        Self {
            natural_rad_s: T::from_f64(mode.natural_rad_s),
            twice_damping_ratio: T::from_f64(2.0 * mode.damping_ratio),
            acceleration_m_s2: T::from_f64(mode.drive_acceleration_m_s2()),
            drive_rad_s: T::from_f64(drive_rad_s),
            detuning_rad_s: T::from_f64(mode.natural_rad_s - drive_rad_s),
            increment: Phase::from_turns(drive_rad_s / TAU * step_s),
            propagator: mode.propagator_minus_identity(step_s).map(|row| row.map(T::from_f64)),
        }
    }

    /// `G` for this amplitude, offset and phase increment.
    fn gain(&self, amplitude: T, offset_hz: T, increment: Phase) -> [[T; 2]; 2] {
        let force = amplitude * self.acceleration_m_s2;
        if force == T::zero() {
            return [[T::zero(); 2]; 2];
        }
        let offset_rad_s = offset_hz * T::from_f64(TAU);
        let w = self.drive_rad_s + offset_rad_s;
        let re = (self.detuning_rad_s - offset_rad_s) * (self.natural_rad_s + w);
        let im = self.twice_damping_ratio * self.natural_rad_s * w;
        let force_over_square = force / (re * re + im * im);
        let (alpha, beta) = (force_over_square * re, -force_over_square * im);
        let m = [[alpha, beta], [-w * beta, w * alpha]];

        let (sin, _) = increment.sin_cos::<T>();
        let (half_sin, _) = increment.halved().sin_cos::<T>();
        let cos_minus_1 = -(half_sin + half_sin) * half_sin;
        let [[gg, gv], [vg, vv]] = self.propagator;
        let row = |m_row: [T; 2], p: T, q: T| {
            let ([m_sin, m_cos], [[g_sin, g_cos], [v_sin, v_cos]]) = (m_row, m);
            [
                m_sin * cos_minus_1 - m_cos * sin - (p * g_sin + q * v_sin),
                m_sin * sin + m_cos * cos_minus_1 - (p * g_cos + q * v_cos),
            ]
        };
        let [m_g, m_v] = m;
        [row(m_g, gg, gv), row(m_v, vg, vv)]
    }
}

/// `turns` (at most 4 in magnitude) as a phase, to the last bit of `T`.
fn turns_as_phase<T: Real>(turns: T) -> Phase {
    const TWO_POW_28: f64 = 268_435_456.0;
    let scaled = turns * T::from_f64(TWO_POW_28);
    let upper = scaled.whole();
    let lower = ((scaled - T::from_i32(upper)) * T::from_f64(TWO_POW_28)).whole();
    Phase::from_units(((i64::from(upper) << 36) + (i64::from(lower) << 8)).cast_unsigned())
}
