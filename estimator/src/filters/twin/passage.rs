//! Time passes between impacts: the modes are stepped with the parameters as estimated, and what each parameter's error makes of them is kept beside them, two
//! numbers each, until the covariance is carried forward.
//!
//! Periods are stepped through four at a time where nothing happens, with the motion in registers, and the effect of the parameters follows a *stride* at a time:
//! it need not be exact, as the modes' own motion is, and within a stride a mode turns by less than a radian.

use motor_model::{DriveCommand, DriveMode, ModalState, Phase, Real, Time};
use nalgebra::{Matrix2, Vector2, Vector3};

use super::stator::{MODAL, PERIOD_NANOS, PERIOD_S, StatorBelief};

/// Periods of a stride.
pub(super) const STRIDE: u8 = 4;

/// A time without news longer than this is not stepped through: the modes are begun anew.
const LONGEST_NANOS: u64 = 10_000_000;

/// Sums over the periods since the last stride of what the parameters act by: of the values at their ends, and half of those at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed<T: Real> {
    modes: ModalState<T>,
    /// Sine and cosine of the drive's phase.
    phasor: Vector2<T>,
}

impl<T: Real> Default for Passed<T> {
    fn default() -> Self {
        Self { modes: ModalState::default(), phasor: Vector2::zeros() }
    }
}

impl<T: Real> Passed<T> {
    #[inline]
    fn add(&mut self, modes: &ModalState<T>, [sin, cos]: [T; 2], weight: T) {
        self.modes.displacement_m += modes.displacement_m * weight;
        self.modes.velocity_m_s += modes.velocity_m_s * weight;
        self.phasor += Vector2::new(sin, cos) * weight;
    }
}

/// What a mode has felt since the covariance was last carried: the effect of each parameter per its part, that of the drive's phase, and its own flow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Felt<T: Real> {
    pub(super) stiffness: Vector2<T>,
    pub(super) damping: Vector2<T>,
    pub(super) amplitude: Vector2<T>,
    pub(super) turn: Vector2<T>,
    pub(super) flow: Matrix2<T>,
}

impl<T: Real> Felt<T> {
    pub(super) fn nothing() -> Self {
        let zero = Vector2::zeros();
        Self { stiffness: zero, damping: zero, amplitude: zero, turn: zero, flow: Matrix2::identity() }
    }

    /// Moves all on by `step`.
    #[inline]
    fn carry(&mut self, step: &Matrix2<T>) {
        self.stiffness = step * self.stiffness;
        self.damping = step * self.damping;
        self.amplitude = step * self.amplitude;
        self.turn = step * self.turn;
        self.flow = step * self.flow;
    }
}

impl<T: Real> StatorBelief<T> {
    /// Moves the stator towards `to` under `command`, once it is a stride behind.
    #[inline]
    pub(super) fn follow(&mut self, to: Time, command: DriveCommand) {
        let stride_nanos = u64::from(STRIDE) * PERIOD_NANOS;
        if self.at.is_none_or(|at| to.nanos_since(at) >= stride_nanos) {
            self.advance(to, command);
        }
    }

    /// Moves the stator to `to` under `command`.
    #[inline(never)]
    pub(super) fn advance(&mut self, to: Time, command: DriveCommand) {
        let mut at = *self.at.get_or_insert(to);
        let behind = to.nanos_since(at);
        if behind > LONGEST_NANOS {
            let periods = behind / PERIOD_NANOS;
            let turned = self.state.forcing.increment().units().wrapping_mul(periods);
            self.turn(Phase::from_units(turned));
            at = at.plus_nanos(periods * PERIOD_NANOS);
            self.forget_motion();
        }
        self.settled &= command.mode().is_none();
        if self.settled {
            at = at.plus_nanos(to.nanos_since(at) / PERIOD_NANOS * PERIOD_NANOS);
        }
        if self.state.forcing.command() != command {
            if self.periods > 0 {
                self.stride();
            }
            self.state.forcing = self.model.modes().forcing(command);
        }
        while to.nanos_since(at) >= PERIOD_NANOS {
            let mut periods = 0;
            while self.periods + periods < STRIDE && to.nanos_since(at) >= PERIOD_NANOS {
                at = at.plus_nanos(PERIOD_NANOS);
                periods += 1;
            }
            self.wait(periods);
        }
        self.at = Some(at);
    }

    /// How far it is behind `to`.
    pub(super) fn behind_s(&self, to: Time) -> T {
        self.at.map_or(T::zero(), |at| to.seconds_since(at))
    }

    /// Turns the drive's phase.
    pub(super) fn turn(&mut self, by: Phase) {
        self.state.phase = self.state.phase.advanced(by);
        self.phasor = self.state.phase.sin_cos().into();
    }

    /// Acceleration by the full drive in force, in m/s^2.
    pub(super) fn full_m_s2(&self) -> Vector3<T> {
        let command = self.state.forcing.command();
        let [_, b, c] = &self.oscillators;
        let (amplitude, zero) = (T::from_f32(command.amplitude()), T::zero());
        match command.mode() {
            Some(DriveMode::B) => Vector3::new(zero, b.drive_m_s2 * amplitude, zero),
            Some(DriveMode::C) => Vector3::new(zero, zero, c.drive_m_s2 * amplitude),
            None => Vector3::zeros(),
        }
    }

    /// Periods pass, at most to the end of a stride.
    #[inline(never)]
    fn wait(&mut self, periods: u8) {
        let (half, h) = (T::from_f64(0.5), T::from_f64(PERIOD_S));
        let [a, b, c] = &self.oscillators;
        let found = self.found.as_slice().get(MODAL..).and_then(|found| found.first_chunk()).copied();
        let [k_a, c_a, k_b, c_b, f_b, k_c, c_c, f_c] = found.unwrap_or_default();
        let stiffness =
            Vector3::new(k_a * a.stiffness_per_s2, k_b * b.stiffness_per_s2, k_c * c.stiffness_per_s2);
        let damping = Vector3::new(c_a * a.damping_per_s, c_b * b.damping_per_s, c_c * c.damping_per_s);
        let drive = self.full_m_s2().component_mul(&Vector3::new(T::zero(), c_b + f_b, c_c + f_c));
        let (bank, forcing) = (self.model.modes(), &self.state.forcing);
        let (mut modes, mut phase, mut phasor) = (self.state.modes, self.state.phase, self.phasor);
        let mut passed = self.passed;
        if self.periods == 0 {
            passed.add(&modes, phasor, half);
        }
        for _ in 0..periods {
            let ([sin_before, _], before) = (phasor, modes);
            bank.advance_from(&mut modes, forcing, phasor);
            phase = phase.advanced(forcing.increment());
            phasor = phase.sin_cos().into();
            let [sin, _] = phasor;
            let g = (before.displacement_m + modes.displacement_m) * half;
            let v = (before.velocity_m_s + modes.velocity_m_s) * half;
            let push = drive * ((sin_before + sin) * half)
                - (stiffness.component_mul(&g) + damping.component_mul(&v));
            modes.displacement_m += push * (half * h * h);
            modes.velocity_m_s += push * h;
            passed.add(&modes, phasor, T::one());
        }
        (self.state.modes, self.state.phase, self.phasor, self.passed) = (modes, phase, phasor, passed);
        self.periods += periods;
        if self.periods == STRIDE {
            self.stride();
        }
    }

    /// What has passed since the last stride is felt by the parameters.
    #[inline(never)]
    pub(super) fn stride(&mut self) {
        let periods = core::mem::take(&mut self.periods);
        let mut passed = core::mem::take(&mut self.passed);
        passed.add(&self.state.modes, self.phasor, T::from_f64(-0.5));
        let (h, waited) = (T::from_f64(PERIOD_S), T::from_i32(i32::from(periods)));
        // Of a response that is held over the stride.
        let push = Vector2::new(T::from_f64(0.5) * h * waited, T::one()) * h;
        let (steps, times) = if periods == STRIDE { (&self.strides, 1) } else { (&self.step, periods) };
        for (felt, step) in self.felt.iter_mut().zip(steps) {
            for _ in 0..times {
                felt.carry(step);
            }
        }
        let full_m_s2 = self.full_m_s2();
        let (drive, quarter) = (full_m_s2 * passed.phasor.x, full_m_s2 * passed.phasor.y);
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.felt, &self.oscillators);
        let (g, v) = (passed.modes.displacement_m, passed.modes.velocity_m_s);
        a.stiffness -= push * (of_a.stiffness_per_s2 * g.x);
        a.damping -= push * (of_a.damping_per_s * v.x);
        for (felt, oscillator, g, v, drive, quarter) in
            [(b, of_b, g.y, v.y, drive.y, quarter.y), (c, of_c, g.z, v.z, drive.z, quarter.z)]
        {
            felt.stiffness -= push * (oscillator.stiffness_per_s2 * g);
            felt.damping += push * (drive - oscillator.damping_per_s * v);
            felt.amplitude += push * drive;
            felt.turn += push * quarter;
        }
        self.waited_s += h * waited;
    }
}
