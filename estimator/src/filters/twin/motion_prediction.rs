//! Prediction of the stator's motion: the modes are stepped with the estimated parameters from sample to sample.
//!
//! The exact step of the nominal modes is followed by an explicit one of the parameters' effect, the acceleration
//! `-w^2 kappa g - 2 zeta w c g' + (c + f) a sin`, at the middle of the period. Up to [`SENSITIVITY_PERIODS`] periods
//! are stepped at once, with the motion in registers; then the sensitivities make one step.

use motor_model::{DriveCommand, Phase, Real, Time};
use nalgebra::Vector3;

use super::checked_motor::{PERIOD_NANOS, PERIOD_S};
use super::sensitivity::SENSITIVITY_PERIODS;
use super::states::MODE_PARAMETERS;
use super::stator::StatorFilter;

/// A time without samples longer than this is not stepped through, in ns: the motion is forgotten. It bounds the work
/// for one sample to 2,000 periods.
const LONGEST_STEPPED_NANOS: u64 = 10_000_000;

impl<T: Real> StatorFilter<T> {
    /// Moves the stator towards `to` under `command`, when a whole sensitivity step is due.
    #[inline]
    pub(super) fn advance_by_sensitivity_steps(&mut self, to: Time, command: DriveCommand) {
        let step_nanos = u64::from(SENSITIVITY_PERIODS) * PERIOD_NANOS;
        if self.at.is_none_or(|at| to.nanos_since(at) >= step_nanos) {
            self.advance(to, command);
        }
    }

    /// Moves the stator to `to` under `command`, in whole periods.
    #[inline(never)]
    pub(super) fn advance(&mut self, to: Time, command: DriveCommand) {
        let mut at = *self.at.get_or_insert(to);
        let behind = to.nanos_since(at);
        if behind > LONGEST_STEPPED_NANOS {
            let periods = behind / PERIOD_NANOS;
            let turned = self.state.forcing.increment().units().wrapping_mul(periods);
            self.shift_phase(Phase::from_units(turned));
            at = at.plus_nanos(periods * PERIOD_NANOS);
            self.forget_motion();
        }
        self.at_rest &= command.mode().is_none();
        if self.at_rest {
            at = at.plus_nanos(to.nanos_since(at) / PERIOD_NANOS * PERIOD_NANOS);
        }
        if self.state.forcing.command() != command {
            self.step_sensitivities();
            let before = self.state.forcing.increment();
            self.state.forcing = self.model.modes().forcing(command);
            self.change_frequency_late(before);
        }
        while to.nanos_since(at) >= PERIOD_NANOS {
            let mut periods = 0;
            while self.pending_periods + periods < SENSITIVITY_PERIODS && to.nanos_since(at) >= PERIOD_NANOS {
                at = at.plus_nanos(PERIOD_NANOS);
                periods += 1;
            }
            self.step_periods(periods);
        }
        self.at = Some(at);
    }

    /// Steps the modes over `periods`, at most to the end of a sensitivity step.
    #[inline(never)]
    fn step_periods(&mut self, periods: u8) {
        let (half, h) = (T::from_f64(0.5), T::from_f64(PERIOD_S));
        let [a, b, c] = &self.oscillators;
        let parameters = self.parameters.as_slice().get(MODE_PARAMETERS..).and_then(|all| all.first_chunk());
        let [k_a, c_a, k_b, c_b, f_b, k_c, c_c, f_c] = parameters.copied().unwrap_or_default();
        let stiffness =
            Vector3::new(k_a * a.stiffness_per_s2, k_b * b.stiffness_per_s2, k_c * c.stiffness_per_s2);
        let damping = Vector3::new(c_a * a.damping_per_s, c_b * b.damping_per_s, c_c * c.damping_per_s);
        let drive = self.drive_amplitude_m_s2().component_mul(&Vector3::new(T::zero(), c_b + f_b, c_c + f_c));
        let (bank, forcing) = (self.model.modes(), &self.state.forcing);
        let (mut modes, mut phase, mut phasor) = (self.state.modes, self.state.phase, self.phasor);
        let mut sums = self.input_sums;
        if self.pending_periods == 0 {
            sums.add(&modes, phasor, half);
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
            sums.add(&modes, phasor, T::one());
        }
        (self.state.modes, self.state.phase, self.phasor, self.input_sums) = (modes, phase, phasor, sums);
        self.pending_periods += periods;
        if self.pending_periods == SENSITIVITY_PERIODS {
            self.step_sensitivities();
        }
    }
}
