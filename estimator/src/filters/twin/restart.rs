//! What sets the stator filter back: rest, a lost motion, a full restart, a clock that ran back.
//!
//! | | modes and height | their variances | parameters | called when |
//! |---|---|---|---|---|
//! | [`StatorFilter::set_at_rest`] | zero | zero | kept | the rotor is quiet |
//! | [`StatorFilter::forget_motion`] | kept | as wide as any drive | kept | impacts were missed |
//! | [`StatorFilter::restart`] | zero | as wide as any drive | prior | the impacts contradict the model |
//! | [`super::learnt_parameters`] | zero | as wide as any drive | as before | a fault of the vibrometer has ended |
//! | [`StatorFilter::rewind`] | kept | kept | kept | sample times ran back |

use motor_model::{ModalState, Phase, Real, Time};

use super::checked_motor::PERIOD_NANOS;
use super::sensitivity::InputSums;
use super::states::{AT_REST, Errors, HEIGHT, INSTANT, MODES};
use super::stator::StatorFilter;

/// Standard deviations of a driven motion: each mode's displacement in m and velocity in m/s. Some 30 um and 1 m/s are
/// the most that a drive does, from simulation.
const DRIVEN_MOTION: [f64; 6] = [3e-5, 0.4, 2e-5, 0.8, 3e-6, 0.2];
/// Standard deviation of the height after an unknown flight, in m: 1 ms at 0.05 m/s.
const DRIVEN_HEIGHT_M: f64 = 5e-5;

impl<T: Real> StatorFilter<T> {
    /// Sets motion and parameters to their start; the drive's phase and the time remain.
    #[inline(never)]
    pub(super) fn restart(&mut self) {
        (self.state.modes, self.height_m, self.jump_m_s) = (ModalState::default(), T::zero(), T::zero());
        self.parameters = Errors::zeros();
        self.covariance.set_diagonal(&self.prior_variances);
        (self.pending_periods, self.input_sums) = (0, InputSums::default());
        self.reset_sensitivities();
        self.forget_motion();
    }

    /// Sets the time back to `to` if it is later, and the drive's phase with it; modes and height remain.
    pub(super) fn rewind(&mut self, to: Time) {
        let Some(at) = self.at.filter(|at| *at > to) else { return };
        let periods = at.nanos_since(to).div_ceil(PERIOD_NANOS);
        let turned = self.state.forcing.increment().units().wrapping_mul(periods);
        self.shift_phase(Phase::from_units(turned.wrapping_neg()));
        self.at = Some(Time::from_nanos(at.nanos().saturating_sub(periods * PERIOD_NANOS)));
    }

    /// Widens modes and height to those of any driven motor, after impacts that are not known; the parameters remain.
    #[inline(never)]
    pub(super) fn forget_motion(&mut self) {
        self.predict_covariance();
        self.at_rest = false;
        let square = |x: f64| T::from_f64(x * x);
        let [g_a, v_a, g_b, v_b, g_c, v_c] = DRIVEN_MOTION.map(square);
        self.covariance.add_state_noise(&[
            (MODES, g_a),
            (MODES + 1, v_a),
            (MODES + 2, g_b),
            (MODES + 3, v_b),
            (MODES + 4, g_c),
            (MODES + 5, v_c),
            (HEIGHT, square(DRIVEN_HEIGHT_M)),
        ]);
    }

    /// The rotor lies on the teeth of a stator at rest: motion and height are known to be zero; the parameters remain.
    pub(super) fn set_at_rest(&mut self) {
        if self.at_rest {
            return;
        }
        self.predict_covariance();
        self.at_rest = true;
        self.state.modes = ModalState::default();
        self.height_m = T::zero();
        let still = T::from_f64(AT_REST);
        for state in (HEIGHT..INSTANT).rev() {
            self.covariance.replace_state(state, still * still);
        }
    }
}
