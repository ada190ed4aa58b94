//! What a drive command means for one motor and step.

use core::f64::consts::TAU;

use super::{ModalBank, ModalState, Mode};
use crate::drive::{DriveCommand, DriveMode};
use crate::math::Real;
use crate::phase::Phase;

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

/// The drive as a step uses it: what a command means for one motor and step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forcing<T> {
    command: DriveCommand,
    increment: Phase,
    /// `G`: what sine and cosine of the phase add to `g` and `g'` over a step.
    gain: [[T; 2]; 2],
    /// `M`: steady `g` and `g'` per sine and cosine of the phase.
    steady: [[T; 2]; 2],
    /// Amplitude of the drive's acceleration, `k F`.
    acceleration_m_s2: T,
    /// Turns of the phase in a step.
    turns: T,
}

impl<T: Real> Default for Forcing<T> {
    fn default() -> Self {
        let zero = T::zero();
        Self {
            command: DriveCommand::OFF,
            increment: Phase::ZERO,
            gain: [[zero; 2]; 2],
            steady: [[zero; 2]; 2],
            acceleration_m_s2: zero,
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
    /// What the drive adds to `state` over a step that starts at `phase`.
    #[inline]
    pub(super) fn add_to(&self, state: &mut ModalState<T>, phase: Phase) {
        if self.command.mode().is_some() {
            let [g, v] = per_sine_and_cosine(&self.gain, phase);
            self.driven(state, |displacement_m, velocity_m_s| {
                *displacement_m += g;
                *velocity_m_s += v;
            });
        }
    }

    /// Steady displacement and velocity of the driven mode at `phase`; zero when off.
    #[inline]
    pub(super) fn steady(&self, phase: Phase) -> ModalState<T> {
        let mut state = ModalState::default();
        if self.command.mode().is_some() {
            let [g, v] = per_sine_and_cosine(&self.steady, phase);
            self.driven(&mut state, |displacement_m, velocity_m_s| (*displacement_m, *velocity_m_s) = (g, v));
        }
        state
    }

    /// Acceleration that the drive gives its mode at `phase`; zero when off.
    #[inline]
    pub(super) fn acceleration_m_s2(&self, phase: Phase) -> T {
        if self.command.mode().is_some() {
            self.acceleration_m_s2 * phase.sin_cos::<T>().0
        } else {
            T::zero()
        }
    }

    /// The drive's phase at the fraction `part` of a step that starts at `phase`.
    #[inline]
    pub(crate) fn phase_at(&self, phase: Phase, part: T) -> Phase {
        phase.advanced(turns_as_phase(self.turns * part))
    }

    /// Shows the driven mode's displacement and velocity to `change`.
    #[inline]
    fn driven(&self, state: &mut ModalState<T>, change: impl FnOnce(&mut T, &mut T)) {
        match self.command.mode() {
            None => {}
            Some(DriveMode::B) => change(&mut state.displacement_m.y, &mut state.velocity_m_s.y),
            Some(DriveMode::C) => change(&mut state.displacement_m.z, &mut state.velocity_m_s.z),
        }
    }
}

#[inline]
fn per_sine_and_cosine<T: Real>([[g_sin, g_cos], [v_sin, v_cos]]: &[[T; 2]; 2], phase: Phase) -> [T; 2] {
    let (sin, cos) = phase.sin_cos::<T>();
    [*g_sin * sin + *g_cos * cos, *v_sin * sin + *v_cos * cos]
}

impl<T: Real> ModalBank<T> {
    /// What `command` means for this motor and step. No transcendental call: some 60 operations.
    #[inline(never)]
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
        let acceleration_m_s2 = T::from_f32(command.amplitude()) * driven.acceleration_m_s2;
        let steady = driven.steady(acceleration_m_s2, offset_hz);
        let gain = driven.gain(steady, increment);
        Forcing {
            command,
            increment,
            gain,
            steady,
            acceleration_m_s2,
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
pub(super) fn turns_as_phase<T: Real>(turns: T) -> Phase {
    const TWO_POW_28: f64 = 268_435_456.0;
    let scaled = (turns - T::from_i32(turns.whole())) * T::from_f64(TWO_POW_28);
    let upper = scaled.whole();
    let lower = ((scaled - T::from_i32(upper)) * T::from_f64(TWO_POW_28)).whole();
    Phase::from_units(((i64::from(upper) << 36) + (i64::from(lower) << 8)).cast_unsigned())
}
