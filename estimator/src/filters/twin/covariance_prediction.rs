//! Prediction of the stator filter's covariance, `P <- F P F' + Q`, when a measurement or a change of states needs it.
//!
//! F is block diagonal in the modes, plus a column a parameter: the sensitivities of [`super::sensitivity`]. The
//! columns are added to the factors by [`ud_filter::UdCovariance::add_effects`]. Q is white noise of each mode's
//! velocity and of the height.
//!
//! A measurement of a state that is constant, with noise of its own, needs no prediction: the order of the two changes
//! nothing. It updates the covariance of the earlier instant, and [`StatorFilter::carry_errors`] gives the present
//! errors by the same F.

use motor_model::Real;
use nalgebra::{Matrix2, SVector, Vector2};
use ud_filter::{Blocks2, NoiseSource, Transition as _};

use super::checked_motor::PERIOD_S;
use super::sensitivity::{ModeSensitivities, SENSITIVITY_PERIODS};
use super::states::{DRIVE_PHASE, Errors, HEIGHT, IMPACT_STATES, INSTANT, JUMP, MODES, STIFFNESSES};
use super::stator::StatorFilter;

impl<T: Real> StatorFilter<T> {
    /// Predicts the covariance to the present.
    pub(super) fn predict_covariance(&mut self) {
        self.predict_beside([NoiseSource { gain: SVector::zeros(), variance: T::zero() }; IMPACT_STATES]);
    }

    /// The same, and instant and jump become those of another impact: with these variances, independent of all else.
    pub(super) fn predict_to_impact(&mut self, instant_s2: T, jump_m2_s2: T) {
        let states = [(JUMP, jump_m2_s2), (INSTANT, instant_s2)];
        let left = states.map(|(state, variance)| self.covariance.take_state(state, variance));
        self.predict_beside(left);
    }

    /// Predicts the covariance, and adds to the motion what is `left` of the last impact: noise at the last prediction.
    #[inline(never)]
    fn predict_beside(&mut self, left: [NoiseSource<T, INSTANT>; IMPACT_STATES]) {
        self.step_sensitivities();
        let [a, b, c] = self.sensitivities.map(|mode| mode.transition);
        let blocks = Blocks2([Matrix2::identity(), a, b, c]);
        let [jump, instant] = left.map(|left| NoiseSource { gain: blocks.carry(&left.gain), ..left });
        let of_state = |state: usize, per_s: T| {
            let gain = SVector::from_fn(|index, _| if index == state { T::one() } else { T::zero() });
            NoiseSource { gain, variance: per_s * self.unpredicted_s }
        };
        let [a, b, c] = self.velocity_noise_m2_s3;
        let noise = [
            of_state(HEIGHT, self.height_noise_m2_s),
            of_state(MODES + 1, a),
            of_state(MODES + 3, b),
            of_state(MODES + 5, c),
            instant,
            jump,
        ];
        self.covariance.carry_first(&blocks, &noise);
        let (of_a, [of_b, of_c]) = self.parameter_columns();
        self.covariance.add_effects(MODES, &of_a);
        self.covariance.add_effects(MODES + 2, &of_b);
        self.covariance.add_effects(MODES + 4, &of_c);
        self.reset_sensitivities();
    }

    /// `F e`: the present errors of states whose errors were `errors` when the covariance was last predicted.
    pub(super) fn carry_errors(&mut self, errors: &mut Errors<T>) {
        self.step_sensitivities();
        let [a, b, c] = self.sensitivities.map(|mode| mode.transition);
        let (of_a, [of_b, of_c]) = self.parameter_columns();
        carry_mode(errors, MODES, &a, &of_a);
        carry_mode(errors, MODES + 2, &b, &of_b);
        carry_mode(errors, MODES + 4, &c, &of_c);
    }

    /// The columns of F of the parameters that act on mode A, and on each of the driven modes B and C.
    #[inline]
    fn parameter_columns(&self) -> ([ParameterColumn<T>; 2], [[ParameterColumn<T>; 4]; 2]) {
        let ([a, b, c], [of_a, of_b, of_c]) = (&self.sensitivities, STIFFNESSES);
        let driven = |mode: &ModeSensitivities<T>, first: usize| {
            [
                (first, mode.stiffness.into()),
                (first + 1, mode.damping.into()),
                (first + 2, mode.amplitude.into()),
                (DRIVE_PHASE, mode.drive_phase.into()),
            ]
        };
        let [stiffness, damping, ..] = driven(a, of_a);
        ([stiffness, damping], [driven(b, of_b), driven(c, of_c)])
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
        if periods == 0 {
            return;
        }
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

/// A parameter's state, and its effect on displacement and velocity of a mode: a column of F.
type ParameterColumn<T> = (usize, [T; 2]);

/// The errors of the mode whose displacement is state `first`, carried by its transition and its parameters' columns.
fn carry_mode<T: Real>(
    errors: &mut Errors<T>,
    first: usize,
    transition: &Matrix2<T>,
    columns: &[ParameterColumn<T>],
) {
    let error = |state: usize| errors.as_slice().get(state).copied().unwrap_or_default();
    let own = transition * Vector2::new(error(first), error(first + 1));
    let moved = columns.iter().fold(own, |sum, &(state, column)| sum + Vector2::from(column) * error(state));
    for (to, &error) in errors.as_mut_slice().iter_mut().skip(first).zip(moved.iter()) {
        *to = error;
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode, MotorParams, Time};
    use proptest::prelude::*;

    use super::*;
    use crate::filters::twin::checked_motor::{CheckedMotor, PERIOD_NANOS};
    use crate::filters::twin::states::STATES;
    use crate::filters::twin::tuning::TwinTuning;
    use crate::instruments::Instruments;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The jump is measured after any number of periods, in either mode: the covariance of the impact, updated and
        /// then predicted, with the errors carried, is the covariance predicted and then updated, with its errors.
        #[test]
        fn dual_a_constant_state_is_measured_before_the_prediction_as_after_it(
            mode in prop_oneof![Just(DriveMode::B), Just(DriveMode::C)],
            periods in 1..60_u64,
            effect in proptest::array::uniform7(-1.0..1.0_f64),
            jump_m_s in 1e-4..1e-2_f64,
        ) {
            let params = MotorParams::nominal();
            let motor = CheckedMotor::<f64>::try_new(&params).unwrap();
            let mut stator = StatorFilter::at_rest(&motor, &TwinTuning::new(&params, &Instruments::default()));
            let command = DriveCommand::full(mode);
            stator.advance(Time::ZERO, command);
            stator.advance(Time::from_micros(1000), command);
            stator.predict_covariance();
            stator.covariance.replace_state(JUMP, 1e-6);
            stator.covariance.add_effects(HEIGHT, &[(JUMP, effect)]);
            stator.advance(Time::from_nanos(1_000_000 + periods * PERIOD_NANOS), command);

            let (mut before, mut after) = (stator.clone(), stator);
            let (mut carried, mut expected) = (Errors::zeros(), Errors::zeros());
            before.covariance.update_state::<JUMP>(4e-7, jump_m_s, &mut carried).unwrap();
            before.carry_errors(&mut carried);
            before.predict_covariance();
            after.predict_covariance();
            after.covariance.update_state::<JUMP>(4e-7, jump_m_s, &mut expected).unwrap();

            // Rounding: each state in units of its standard deviation.
            let deviations = after.covariance.variances().map(f64::sqrt);
            let (p, expected_p) = (before.covariance.covariance(), after.covariance.covariance());
            for i in 0..STATES {
                let (ours, theirs) = (carried[i], expected[i]);
                prop_assert!((ours - theirs).abs() < 1e-9 * deviations[i], "{i}: {ours} {theirs}");
                for j in 0..STATES {
                    let unit = deviations[i] * deviations[j];
                    prop_assert!((p[(i, j)] - expected_p[(i, j)]).abs() < 1e-9 * unit, "{i} {j}");
                }
            }
        }
    }
}
