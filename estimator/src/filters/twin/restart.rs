//! What sets the stator filter back: rest, a lost motion, a full restart, a clock that ran back.
//!
//! | | modes and height | their variances | parameters and drive's phase | called when |
//! |---|---|---|---|---|
//! | [`StatorFilter::set_at_rest`] | zero | zero | kept | the rotor is quiet |
//! | [`StatorFilter::forget_motion`] | kept | as wide as any drive | kept | impacts were missed |
//! | [`StatorFilter::restart`] | zero | as wide as any drive | prior | the impacts contradict the model |
//! | [`super::retune`] | zero | as wide as any drive | prior, with other stiffnesses | a resonance has moved |
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
    /// Sets motion and parameters to their start, and the drive's phase to that of the commands; the time remains.
    #[inline(never)]
    pub(super) fn restart(&mut self) {
        self.shift_phase(Phase::from_units(self.phase_correction.units().wrapping_neg()));
        self.phase_correction = Phase::ZERO;
        (self.state.modes, self.height_m, self.jump_m_s) = (ModalState::default(), T::zero(), T::zero());
        self.parameters = self.prior_parameters;
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
        let back_nanos = periods.saturating_mul(PERIOD_NANOS);
        self.at = Some(Time::from_nanos(at.nanos().saturating_sub(back_nanos)));
    }

    /// Widens modes and height to those of any driven motor, after impacts that are not known; the parameters remain.
    #[inline(never)]
    pub(super) fn forget_motion(&mut self) {
        self.predict_covariance();
        self.at_rest = false;
        let square = |x: f64| T::from_f64(x * x);
        let motion = (MODES..).zip(DRIVEN_MOTION.map(square));
        for (state, variance) in motion.chain([(HEIGHT, square(DRIVEN_HEIGHT_M))]) {
            let unit = Errors::from_fn(|index, _| if index == state { T::one() } else { T::zero() });
            // One by one, though slower: it is rare, and together they would take 20 kB of code.
            self.covariance.add_rank_one(&unit, variance);
        }
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

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode};

    use super::*;
    use crate::filters::twin::states::{DRIVE_PHASE, MODE_PARAMETERS, STATES, TOOTH_ANGLE};
    use crate::filters::twin::tests::filter;

    /// The nominal stator, driven in mode B for `micros` in steps of 5 ms at most.
    fn driven(micros: u64) -> StatorFilter<f64> {
        let mut stator = filter::<f64>().stator;
        for at in (0..micros).step_by(5000).chain([micros]) {
            stator.advance(Time::from_micros(at), DriveCommand::full(DriveMode::B));
        }
        stator
    }

    /// Time that ran back by 5 ms, and a gap of 25 ms: the drive's phase is that of the time.
    #[test]
    fn exact_the_drive_keeps_its_phase_over_gaps_and_times_that_run_back() {
        let mut rewound = driven(20_000);
        rewound.rewind(Time::from_micros(15_000));
        let at_once = {
            let mut stator = driven(5);
            stator.advance(Time::from_micros(25_005), DriveCommand::full(DriveMode::B));
            stator
        };
        for (stator, micros) in [(rewound, 15_000), (at_once, 25_005)] {
            let expected = driven(micros);
            assert_eq!((stator.at, stator.state.phase), (expected.at, expected.state.phase));
            assert_eq!(stator.phasor.map(f64::to_bits), expected.phasor.map(f64::to_bits));
        }
    }

    /// A sample that is stamped as late as a time can be, and one of the start: whole periods back would be before it.
    #[test]
    fn exact_a_time_that_runs_back_by_all_there_is_is_the_start() {
        let mut stator = driven(5);
        stator.at = Some(Time::from_nanos(u64::MAX));
        stator.rewind(Time::ZERO);
        assert_eq!(stator.at, Some(Time::ZERO));
    }

    /// What is forgotten has the variance of a driven motor beside its own; parameters are as well known as before.
    #[test]
    fn exact_forgetting_widens_the_motion_alone() {
        let mut stator = driven(1000);
        stator.predict_covariance();
        let before = stator.covariance.variances();
        stator.forget_motion();
        let after = stator.covariance.variances();
        let [g_a, v_a, g_b, v_b, g_c, v_c] = DRIVEN_MOTION;
        for (state, deviation) in (HEIGHT..).zip([DRIVEN_HEIGHT_M, g_a, v_a, g_b, v_b, g_c, v_c]) {
            let expected = before[state] + deviation * deviation;
            assert!((after[state] / expected - 1.0).abs() < 1e-9, "{state}: {} {expected}", after[state]);
        }
        assert!((MODE_PARAMETERS..STATES).all(|state| (after[state] / before[state] - 1.0).abs() < 1e-9));
    }

    /// At rest height and modes are zero, known and of no parameter's effect.
    #[test]
    fn exact_at_rest_the_motion_is_known() {
        let mut stator = driven(1000);
        stator.height_m = 1e-5;
        stator.forget_motion();
        stator.set_at_rest();
        assert!(stator.state.modes == ModalState::default() && stator.height_m.to_bits() == 0);
        for state in HEIGHT..INSTANT {
            let column = stator.covariance.column(state);
            assert!((column[state] / (AT_REST * AT_REST) - 1.0).abs() < 1e-9, "{state}: {:e}", column[state]);
            assert!((MODE_PARAMETERS..STATES).all(|other| column[other].to_bits() << 1 == 0), "{state}");
        }
    }

    /// A phase that went astray is forgotten: after a restart it is that of the commands.
    #[test]
    fn exact_a_restart_forgets_what_corrected_the_phase() {
        let (mut stator, commanded) = (driven(1010), driven(1010).state.phase);
        let mut errors = Errors::zeros();
        for lead_rad in [0.8, -0.3, 3.0] {
            errors[DRIVE_PHASE] = lead_rad;
            stator.correct(&errors);
        }
        assert_ne!(stator.state.phase, commanded);
        for _ in 0..2 {
            stator.restart();
            assert_eq!(stator.state.phase, commanded);
        }
    }

    /// A stator that is restarted in the middle of its swing goes on as one from its start at the same phase, whose
    /// motion is not known.
    #[test]
    fn dual_a_restarted_stator_is_a_new_one_of_unknown_motion() {
        let mut restarted = driven(1010);
        assert!(restarted.pending_periods > 0 && restarted.unpredicted_s > 0.0);
        restarted.parameters[TOOTH_ANGLE] = 1e-3;
        restarted.restart();
        let mut new = filter::<f64>().stator;
        (new.at, new.state.forcing) = (restarted.at, restarted.state.forcing);
        new.shift_phase(restarted.state.phase);
        new.forget_motion();
        for stator in [&mut restarted, &mut new] {
            stator.advance(Time::from_micros(1500), DriveCommand::full(DriveMode::B));
            stator.predict_covariance();
        }
        assert!(restarted.state.modes == new.state.modes && restarted.parameters == new.parameters);
        let (own, expected) = (restarted.covariance.covariance(), new.covariance.covariance());
        assert!((own - expected).abs().max() <= 1e-12 * expected.abs().max());
        assert!((own - expected).component_div(&expected.map(|x| x.abs().max(1e-30))).abs().max() < 1e-6);
    }
}
