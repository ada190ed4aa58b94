//! Resonances that have moved: the stiffnesses of modes B and C are other ones.
//!
//! ```text
//! kappa = (1 + d)^2 - 1,    d = offset / f,    of variance (2 / f)^2 times that of the offset
//! ```
//!
//! The drive follows a resonance, so without this the stator filter would take the drive for one beside it. Impacts
//! that contradicted the model have contradicted the old stiffness. So the stator filter begins anew and is trusted, as
//! after a fault of the vibrometer.

use core::f64::consts::TAU;

use motor_model::Real;
use nalgebra::Matrix2;

use super::checked_motor::PERIOD_S;
use super::learnt_parameters::LearntCopies;
use super::misfit_monitor::MisfitMonitor;
use super::oscillator::Response;
use super::sensitivity::SENSITIVITY_PERIODS;
use super::states::STIFFNESSES;
use super::{StatorFilter, TwinFilter};
use crate::filter::ResonanceOffset;

impl<T: Real> TwinFilter<T> {
    /// Begins anew with resonances at `offsets`, of modes B and C.
    #[cold]
    #[inline(never)]
    pub(super) fn retune_stator(&mut self, offsets: &[ResonanceOffset<T>; 2]) {
        self.stator.set_resonances(offsets);
        self.restart_stator();
        self.learnt = LearntCopies::default();
        self.misfit = MisfitMonitor::trusted();
        self.kick_use.forgive();
    }
}

impl<T: Real> StatorFilter<T> {
    /// Sets the stiffnesses with which the filter restarts, and their variances: those of the offsets beside the prior.
    /// The covariance is predicted by the modes of these stiffnesses.
    fn set_resonances(&mut self, offsets: &[ResonanceOffset<T>; 2]) {
        let motors = STIFFNESSES.into_iter().zip(self.stiffness_variances);
        for ((index, (state, of_motors)), offset) in motors.enumerate().skip(1).zip(offsets) {
            let Some(oscillator) = self.oscillators.get(index) else { continue };
            let per_hz = T::from_f64(TAU) / oscillator.stiffness_per_s2.sqrt();
            let detuning = per_hz * offset.hz;
            let stiffer = detuning * (T::from_f64(2.0) + detuning);
            let of_offset = T::from_f64(4.0) * per_hz * per_hz * offset.hz2;
            let Response { c, c_rate, s, s_rate, .. } =
                oscillator.stiffer(stiffer).after(T::from_f64(PERIOD_S));
            let period = Matrix2::new(c, s, c_rate, s_rate);
            let periods = (1..SENSITIVITY_PERIODS).fold(period, |step, _| period * step);
            let parameters = self.prior_parameters.as_mut_slice().get_mut(state);
            let variances = self.prior_variances.as_mut_slice().get_mut(state);
            let steps = self.period_steps.get_mut(index).zip(self.sensitivity_steps.get_mut(index));
            if let Some(((parameter, variance), (one, several))) = parameters.zip(variances).zip(steps) {
                (*parameter, *variance) = (stiffer, of_motors + of_offset);
                (*one, *several) = (period, periods);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter, Time};

    use crate::AngleFilter as _;
    use crate::Instruments;
    use crate::filters::twin::checked_motor::CheckedMotor;
    use crate::filters::twin::states::PRIOR;
    use crate::filters::twin::tests::filter;
    use crate::filters::twin::tuning::TwinTuning;

    use super::*;

    const OFFSETS_HZ: [f64; 2] = [-63.0, 74.6];

    fn retuned() -> TwinFilter<f64> {
        let mut filter = filter::<f64>();
        filter.retune(&OFFSETS_HZ.map(|hz| ResonanceOffset { hz, hz2: 49.0 }));
        filter
    }

    /// A motor of these resonances by its parameters.
    fn of_other_resonances() -> TwinFilter<f64> {
        let mut params = MotorParams::nominal();
        for (parameter, hz) in
            [Parameter::ModeBFrequency, Parameter::ModeCFrequency].into_iter().zip(OFFSETS_HZ)
        {
            params = params.with(parameter, params.get(parameter) + hz).unwrap();
        }
        let tuning = TwinTuning::new(&params, &Instruments::default());
        TwinFilter::new(&CheckedMotor::try_new(&params).unwrap(), &tuning)
    }

    /// The covariance is predicted by the modes of a motor of these resonances; its damping alone, 1 % off, differs,
    /// and the series of the fifth order.
    #[test]
    fn dual_the_modes_are_those_of_a_motor_of_these_resonances() {
        let (retuned, other) = (retuned().stator, of_other_resonances().stator);
        for index in 0..3 {
            for (own, expected) in [
                (&retuned.period_steps, &other.period_steps),
                (&retuned.sensitivity_steps, &other.sensitivity_steps),
            ] {
                let speed = 2.0 * core::f64::consts::PI * 7.5e3;
                // Rows displacement and velocity, in units of the amplitude and the speed.
                let difference = own[index] - expected[index];
                let scaled = [difference.m11, difference.m12 * speed, difference.m21 / speed, difference.m22];
                assert!(scaled.iter().all(|part| part.abs() < 2e-4), "{index}: {scaled:?}");
            }
        }
    }

    /// Driven at the new resonance both swing alike: a retuned twin is driven beside the old one by its command.
    #[test]
    fn dual_a_retuned_stator_swings_as_one_of_these_resonances() {
        for (mode, hz, axis) in [(DriveMode::B, OFFSETS_HZ[0], 1), (DriveMode::C, OFFSETS_HZ[1], 2)] {
            let (mut retuned, mut other) = (retuned().stator, of_other_resonances().stator);
            let beside = DriveCommand::full(mode).with_saturating_offset(hz as f32);
            let (mut own, mut expected) = (0.0_f64, 0.0_f64);
            for step in 1..=8000_u64 {
                let at = Time::from_micros(5 * step);
                retuned.advance(at, beside);
                other.advance(at, DriveCommand::full(mode));
                if step > 6000 {
                    own = own.max(retuned.state.modes.displacement_m[axis].abs());
                    expected = expected.max(other.state.modes.displacement_m[axis].abs());
                }
            }
            // The drive's acceleration is that of the design, 2 zeta w^2 A: 2 % off, and the damping 1 %.
            assert!((own / expected - 1.0).abs() < 0.03, "{mode:?}: {own:e} {expected:e}");
        }
    }

    /// The stiffnesses are as uncertain as motors and offset together, also after another offset; all else is the
    /// prior.
    #[test]
    fn exact_variances_are_those_of_motors_and_offset() {
        let mut filter = retuned();
        filter.retune(&[10.0, 0.0].map(|hz| ResonanceOffset { hz, hz2: 25.0 }));
        let (parameters, variances) = (&filter.stator.parameters, filter.stator.covariance.variances());
        for (state, frequency, hz) in [(STIFFNESSES[1], 6300.0, 10.0), (STIFFNESSES[2], 7460.0, 0.0)] {
            let part: f64 = hz / frequency;
            assert!((parameters[state] - part * (2.0 + part)).abs() < 1e-12, "{state}");
            let expected = PRIOR[state] * PRIOR[state] + 4.0 * 25.0 / (frequency * frequency);
            assert!(
                (variances[state] / expected - 1.0).abs() < 1e-9,
                "{state}: {} {expected}",
                variances[state]
            );
        }
        let stiffness_a = STIFFNESSES[0];
        assert!((variances[stiffness_a] / PRIOR[stiffness_a].powi(2) - 1.0).abs() < 1e-9);
        assert_eq!(parameters[stiffness_a].to_bits(), 0);
    }
}
