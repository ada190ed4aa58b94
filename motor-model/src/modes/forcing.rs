//! Forcing: the effect of a drive command on the modes of one motor over one step.

use core::f64::consts::TAU;

use nalgebra::Vector2;

use super::{ModalBank, ModalState, Mode};
use crate::drive::{DriveCommand, DriveMode};
use crate::error::OutOfBounds;
use crate::math::Real;
use crate::phase::Phase;

/// The frequency at which the generator drives each mode when the command's offset is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum DriveTuning {
    /// At the motor's own resonances, as in the paper.
    #[default]
    Resonant,
    /// At fixed frequencies, which may differ from the motor's resonances.
    Fixed {
        /// Frequency for mode B.
        b_hz: f64,
        /// Frequency for mode C.
        c_hz: f64,
    },
}

impl DriveTuning {
    /// Refuses fixed frequencies outside 1 Hz to 1 MHz.
    pub(crate) fn check(self) -> Result<(), OutOfBounds> {
        if let Self::Fixed { b_hz, c_hz } = self {
            OutOfBounds::check("drive.frequency_b_hz", b_hz, 1.0, 1e6, "Hz")?;
            OutOfBounds::check("drive.frequency_c_hz", c_hz, 1.0, 1e6, "Hz")?;
        }
        Ok(())
    }
}

/// Constants of a mode and of the generator that drives it.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrivenMode<T> {
    natural_rad_s: T,
    twice_damping_ratio: T,
    acceleration_m_s2: T,
    drive_rad_s: T,
    /// `w_n - w` at zero offset, from `f64`.
    detuning_rad_s: T,
    increment: Phase,
    /// Turns of the drive's phase in a step.
    turns: T,
    /// `P - I` of this mode.
    propagator: [[T; 2]; 2],
}

/// The effect of a drive command on the modes of one motor over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forcing<T> {
    command: DriveCommand,
    increment: Phase,
    /// `G`: change of `g` and `g'` over a step per sine and cosine of the phase.
    gain: PerPhasor<T>,
    /// `M`: steady `g` and `g'` per sine and cosine of the phase.
    steady: PerPhasor<T>,
    /// Amplitude of the drive's acceleration of modes B and C, `k F`.
    acceleration_m_s2: Vector2<T>,
    /// Turns of the phase in a step.
    turns: T,
}

impl<T: Real> Default for Forcing<T> {
    fn default() -> Self {
        let zero = T::zero();
        Self {
            command: DriveCommand::OFF,
            increment: Phase::ZERO,
            gain: PerPhasor::default(),
            steady: PerPhasor::default(),
            acceleration_m_s2: Vector2::zeros(),
            turns: zero,
        }
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

impl<T: Real> Forcing<T> {
    /// The drive at `phase`; zero when off.
    #[inline]
    pub(crate) fn phasor(&self, phase: Phase) -> Phasor<T> {
        if self.command.mode().is_some() {
            let (sin, cos) = phase.sin_cos();
            Phasor { sin, cos }
        } else {
            Phasor { sin: T::zero(), cos: T::zero() }
        }
    }

    /// Adds to `state` the effect of the drive over a step that starts at `phase`.
    #[inline]
    pub(super) fn add_to(&self, state: &mut ModalState<T>, phase: Phase) {
        if self.command.mode().is_some() {
            let (sin, cos) = phase.sin_cos();
            self.add(&self.gain, state, &Phasor { sin, cos });
        }
    }

    /// The same with given sine and cosine of the phase; nothing when off.
    #[inline]
    pub(super) fn add_from(&self, state: &mut ModalState<T>, [sin, cos]: [T; 2]) {
        self.add(&self.gain, state, &Phasor { sin, cos });
    }

    /// Adds `gain` times `phasor` to the driven mode.
    #[inline]
    fn add(&self, gain: &PerPhasor<T>, state: &mut ModalState<T>, phasor: &Phasor<T>) {
        let g = gain.g_sin * phasor.sin + gain.g_cos * phasor.cos;
        let v = gain.v_sin * phasor.sin + gain.v_cos * phasor.cos;
        match self.command.mode() {
            Some(DriveMode::B) => {
                state.displacement_m.y += g;
                state.velocity_m_s.y += v;
            }
            Some(DriveMode::C) => {
                state.displacement_m.z += g;
                state.velocity_m_s.z += v;
            }
            None => (),
        }
    }

    /// Adds the steady motion at `phasor`, or its change where `phasor` is a difference.
    #[inline]
    pub(super) fn add_steady(&self, state: &mut ModalState<T>, phasor: &Phasor<T>) {
        self.add(&self.steady, state, phasor);
    }

    /// Acceleration that the drive gives modes B and C.
    #[inline]
    pub(super) fn acceleration_m_s2(&self, phasor: &Phasor<T>) -> Vector2<T> {
        self.acceleration_m_s2 * phasor.sin
    }

    /// The drive's phase at the fraction `part` of a step that starts at `phase`.
    #[inline]
    pub(crate) fn phase_at(&self, phase: Phase, part: T) -> Phase {
        if self.command.mode().is_none() {
            return phase;
        }
        phase.advanced(turns_as_phase(self.turns * part))
    }
}

/// Sine and cosine of the drive's phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Phasor<T> {
    sin: T,
    cos: T,
}

impl<T: Real> Phasor<T> {
    /// The difference from this phasor to `later`.
    #[inline]
    pub(super) fn until(&self, later: &Self) -> Self {
        Self { sin: later.sin - self.sin, cos: later.cos - self.cos }
    }

    #[inline]
    pub(super) fn reversed(&self) -> Self {
        Self { sin: -self.sin, cos: -self.cos }
    }
}

/// Displacement and velocity of the driven mode per sine and cosine of the drive's phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PerPhasor<T> {
    g_sin: T,
    g_cos: T,
    v_sin: T,
    v_cos: T,
}

impl<T> PerPhasor<T> {
    /// Rows `g` and `g'`, columns sine and cosine.
    fn new([[g_sin, g_cos], [v_sin, v_cos]]: [[T; 2]; 2]) -> Self {
        Self { g_sin, g_cos, v_sin, v_cos }
    }
}

impl<T: Real> ModalBank<T> {
    /// The forcing of `command` for this motor and step. No transcendental call: some 60 operations.
    #[inline(never)]
    pub fn forcing(&self, command: DriveCommand) -> Forcing<T> {
        let Some(mode) = command.mode() else {
            return Forcing { command, ..Forcing::default() };
        };
        let driven = match mode {
            DriveMode::B => &self.b,
            DriveMode::C => &self.c,
        };
        let select = |value| match mode {
            DriveMode::B => Vector2::new(value, T::zero()),
            DriveMode::C => Vector2::new(T::zero(), value),
        };
        let offset_hz = T::from_f32(command.frequency_offset_hz());
        let increment = driven.increment.advanced(turns_as_phase(offset_hz * self.step_s));
        let acceleration_m_s2 = T::from_f32(command.amplitude()) * driven.acceleration_m_s2;
        let steady = driven.steady(acceleration_m_s2, offset_hz);
        let gain = driven.gain(steady, increment);
        Forcing {
            command,
            increment,
            gain: PerPhasor::new(gain),
            steady: PerPhasor::new(steady),
            acceleration_m_s2: select(acceleration_m_s2),
            turns: driven.turns + offset_hz * self.step_s,
        }
    }
}

impl<T: Real> DrivenMode<T> {
    pub(super) fn new(mode: &Mode, drive_rad_s: f64, step_s: f64) -> Self {
        Self {
            natural_rad_s: T::from_f64(mode.natural_rad_s),
            twice_damping_ratio: T::from_f64(2.0 * mode.damping_ratio),
            acceleration_m_s2: T::from_f64(mode.drive_acceleration_m_s2()),
            drive_rad_s: T::from_f64(drive_rad_s),
            detuning_rad_s: T::from_f64(mode.natural_rad_s - drive_rad_s),
            increment: Phase::from_turns(drive_rad_s / TAU * step_s),
            turns: T::from_f64(drive_rad_s / TAU * step_s),
            propagator: mode.propagator_minus_identity(step_s).map(|row| row.map(T::from_f64)),
        }
    }

    /// `M` for this drive and offset.
    fn steady(&self, acceleration_m_s2: T, offset_hz: T) -> [[T; 2]; 2] {
        if acceleration_m_s2 == T::zero() {
            return [[T::zero(); 2]; 2];
        }
        let offset_rad_s = offset_hz * T::from_f64(TAU);
        let w = self.drive_rad_s + offset_rad_s;
        let re = (self.detuning_rad_s - offset_rad_s) * (self.natural_rad_s + w);
        let im = self.twice_damping_ratio * self.natural_rad_s * w;
        let force_over_square = acceleration_m_s2 / (re * re + im * im);
        let (alpha, beta) = (force_over_square * re, -force_over_square * im);
        [[alpha, beta], [-w * beta, w * alpha]]
    }

    /// `G` for this steady motion and phase increment.
    fn gain(&self, m: [[T; 2]; 2], increment: Phase) -> [[T; 2]; 2] {
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

/// `turns` as a phase, to the last bit of `T`; whole turns are dropped.
fn turns_as_phase<T: Real>(turns: T) -> Phase {
    const TWO_POW_28: f64 = 268_435_456.0;
    let scaled = (turns - T::from_i32(turns.whole())) * T::from_f64(TWO_POW_28);
    let upper = scaled.whole();
    let lower = ((scaled - T::from_i32(upper)) * T::from_f64(TWO_POW_28)).whole();
    Phase::from_units(((i64::from(upper) << 36) + (i64::from(lower) << 8)).cast_unsigned())
}
