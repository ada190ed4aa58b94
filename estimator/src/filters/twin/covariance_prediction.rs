//! Prediction of the stator filter's covariance, `P <- F P F' + Q`, when a measurement or a change of states needs it.
//!
//! F is block diagonal in the modes, plus a column a parameter: the sensitivities of [`super::sensitivity`]. Each
//! column is added to the factors by `UdCovariance::add_effect`. Q is white noise of each mode's velocity and of the
//! height.

use motor_model::Real;
use nalgebra::{Matrix2, Vector2};
use ud_filter::{Blocks2, NoiseSource};

use super::checked_motor::PERIOD_S;
use super::sensitivity::{ModeSensitivities, SENSITIVITY_PERIODS};
use super::states::{DRIVE_PHASE, HEIGHT, MODE_PARAMETER_RANGES, MODES, unit};
use super::stator::StatorFilter;

impl<T: Real> StatorFilter<T> {
    /// Predicts the covariance to the present.
    #[inline(never)]
    pub(super) fn predict_covariance(&mut self) {
        if self.pending_periods > 0 {
            self.step_sensitivities();
        }
        if self.unpredicted_s <= T::zero() {
            return;
        }
        let [a, b, c] = self.sensitivities.map(|mode| mode.transition);
        self.covariance.carry_first::<8, 4>(&Blocks2([Matrix2::identity(), a, b, c]));
        for (m, (mode, (first, count))) in self.sensitivities.iter().zip(MODE_PARAMETER_RANGES).enumerate() {
            let columns = [mode.stiffness, mode.damping, mode.amplitude];
            for (state, column) in
                (first..first + count).zip(columns).chain([(DRIVE_PHASE, mode.drive_phase)])
            {
                self.covariance.add_effect(state, MODES + 2 * m, &[column.x, column.y]);
            }
        }
        let [a, b, c] = self.velocity_noise_m2_s3.map(|noise| noise * self.unpredicted_s);
        let noise = |state: usize, variance: T| NoiseSource { gain: unit(state), variance };
        let sources = [
            noise(MODES + 1, a),
            noise(MODES + 3, b),
            noise(MODES + 5, c),
            noise(HEIGHT, self.height_noise_m2_s * self.unpredicted_s),
        ];
        self.covariance.add_noise(&sources);
        self.reset_sensitivities();
    }

    /// The covariance belongs to the present: nothing is left to be predicted.
    pub(super) fn reset_sensitivities(&mut self) {
        self.sensitivities = [ModeSensitivities::none(); 3];
        self.unpredicted_s = T::zero();
    }

    /// Steps the sensitivities over the periods that are pending, by the trapezoidal sums of their inputs.
    #[inline(never)]
    pub(super) fn step_sensitivities(&mut self) {
        let periods = core::mem::take(&mut self.pending_periods);
        let mut sums = core::mem::take(&mut self.input_sums);
        sums.add(&self.state.modes, self.phasor, T::from_f64(-0.5));
        let (h, count) = (T::from_f64(PERIOD_S), T::from_i32(i32::from(periods)));
        // Displacement and velocity by an acceleration that is constant over the step.
        let push = Vector2::new(T::from_f64(0.5) * h * count, T::one()) * h;
        let (steps, times) = if periods == SENSITIVITY_PERIODS {
            (&self.sensitivity_steps, 1)
        } else {
            (&self.period_steps, periods)
        };
        for (mode, step) in self.sensitivities.iter_mut().zip(steps) {
            for _ in 0..times {
                mode.step(step);
            }
        }
        let amplitude_m_s2 = self.drive_amplitude_m_s2();
        let (drive, quadrature) = (amplitude_m_s2 * sums.phasor.x, amplitude_m_s2 * sums.phasor.y);
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.sensitivities, &self.oscillators);
        let (g, v) = (sums.modes.displacement_m, sums.modes.velocity_m_s);
        a.stiffness -= push * (of_a.stiffness_per_s2 * g.x);
        a.damping -= push * (of_a.damping_per_s * v.x);
        for (mode, oscillator, g, v, drive, quadrature) in
            [(b, of_b, g.y, v.y, drive.y, quadrature.y), (c, of_c, g.z, v.z, drive.z, quadrature.z)]
        {
            mode.stiffness -= push * (oscillator.stiffness_per_s2 * g);
            mode.damping += push * (drive - oscillator.damping_per_s * v);
            mode.amplitude += push * drive;
            mode.drive_phase += push * quadrature;
        }
        self.unpredicted_s += h * count;
    }
}
