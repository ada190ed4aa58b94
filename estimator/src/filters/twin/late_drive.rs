//! A drive whose commands act later than the filter is told: what that does to the drive's phase.
//!
//! The phase is continuous, and does not change while the drive is off. A command that acts later by `l` leaves the
//! drive at the frequency before it for as long:
//!
//! ```text
//! phase off by (w_before - w) l,   0 <= l <= L, any as likely:    mean (w_before - w) L / 2
//!                                                                 variance += (w - w_before)^2 L^2 / 12      (F11)
//! ```
//!
//! Each change of mode and each begin or end of the drive adds its own. With the 4 us of an interrupt that others hold
//! off its standard deviation is 0.008 rad from mode to mode and 0.05 rad from off to mode B. The phase is known to
//! 0.002 rad after a second, so a filter that takes it for constant would put the error on the motor's parameters, and
//! then on each kick. A change of the amplitude alone leaves the phase as it is.

use core::f64::consts::{PI, TAU};

use motor_model::{Phase, Real};

use super::states::{DRIVE_PHASE, Errors};
use super::stator::StatorFilter;

/// Variance of a phase of which nothing is known, any angle as likely, in rad^2.
const UNKNOWN_RAD2: f64 = PI * PI / 3.0;

/// Parts of 2^-30 turn to rad.
const RAD: f64 = TAU / 1_073_741_824.0;

impl<T: Real> StatorFilter<T> {
    /// The drive gains another phase a period than `before`, from an instant that is told too early.
    pub(super) fn change_frequency_late(&mut self, before: Phase) {
        let after = self.state.forcing.increment();
        if self.late_periods > T::zero() && after != before {
            self.doubt_phase(before.units().wrapping_sub(after.units()).cast_signed());
        }
    }

    /// Shifts the phase by the mean of a change by which a period gains `less`, in units of 2^-64 turn. Adds the
    /// variance to the phase's, and to that of a restart, which takes the phase for that of the commands.
    #[cold]
    #[inline(never)]
    fn doubt_phase(&mut self, less: i64) {
        let most = T::from_i32((less >> 34) as i32) * self.late_periods;
        let mean = i64::from((T::from_f64(0.5) * most).whole()) << 34;
        self.shift_phase(Phase::from_units(mean.cast_unsigned()));
        let most_rad = most * T::from_f64(RAD);
        let variance = most_rad * most_rad * T::from_f64(1.0 / 12.0);
        self.predict_covariance();
        let phase = Errors::from_fn(|index, _| if index == DRIVE_PHASE { T::one() } else { T::zero() });
        self.covariance.add_rank_one(&phase, variance);
        if let Some(prior) = self.prior_variances.as_mut_slice().get_mut(DRIVE_PHASE) {
            *prior = (*prior + variance).at_most(T::from_f64(UNKNOWN_RAD2));
        }
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode, DriveTuning, MotorParams, Stator, StatorState, Time};

    use super::*;
    use crate::filters::twin::checked_motor::{CheckedMotor, PERIOD_S};
    use crate::filters::twin::states::PRIOR;
    use crate::filters::twin::tuning::TwinTuning;
    use crate::filters::twin::{StatorFilter, TwinFilter};
    use crate::instruments::Instruments;

    /// The longest that an interrupt may be late.
    const LATE_S: f64 = 4e-6;

    const OFF: DriveCommand = DriveCommand::OFF;

    fn full(mode: DriveMode) -> DriveCommand {
        DriveCommand::full(mode)
    }

    /// The nominal motor's twin, told that its drive is late by `drive_late_s` at most.
    fn filter(drive_late_s: f64) -> TwinFilter<f64> {
        let params = MotorParams::nominal();
        let tuning = TwinTuning { drive_late_s, ..TwinTuning::new(&params, &Instruments::default()) };
        TwinFilter::new(&CheckedMotor::try_new(&params).unwrap(), &tuning)
    }

    /// Drives for a millisecond each; returns the variance of the phase after each.
    fn drive<const N: usize>(stator: &mut StatorFilter<f64>, commands: [DriveCommand; N]) -> [f64; N] {
        commands.map(|command| {
            let at = stator.at.unwrap_or(Time::ZERO);
            stator.advance(at, command);
            stator.advance(at.plus_nanos(1_000_000), command);
            stator.covariance.variance::<DRIVE_PHASE>()
        })
    }

    /// A drive that changes `nanos` late, by the motor's own step of 0.1 us: how far its phase is from that of a
    /// filter's stator that changes from the one command to the other.
    #[expect(clippy::cast_precision_loss, reason = "a small part of a turn")]
    fn phase_off_rad(before: DriveCommand, command: DriveCommand, nanos: u64, told: Phase) -> f64 {
        const STEP_NANOS: u64 = 100;
        const UNITS_PER_TURN: f64 = 18_446_744_073_709_551_616.0;
        let motor = Stator::<f64>::try_new(&MotorParams::nominal(), DriveTuning::Resonant, 1e-7).unwrap();
        let mut state = StatorState::default();
        for step in 0..20_000 {
            let is_late = step * STEP_NANOS < 1_000_000 + nanos;
            motor.step(&mut state, if is_late { before } else { command });
        }
        let units = state.phase.units().wrapping_sub(told.units()).cast_signed();
        TAU / UNITS_PER_TURN * units as f64
    }

    /// Changes that are late by 0 to 4 us in steps of 0.1 us, each as often: the phase of the filter is their mean, and
    /// their variance that of a uniform law but for the sum's error, 1 part in 20. The first command is on time.
    #[test]
    fn dual_the_phase_is_as_uncertain_as_late_commands_leave_it() {
        for (before, command) in [
            (OFF, full(DriveMode::B)),
            (full(DriveMode::B), full(DriveMode::C)),
            (full(DriveMode::C), full(DriveMode::B)),
            (full(DriveMode::C), OFF),
            (full(DriveMode::B), full(DriveMode::B).with_frequency_offset(200.0).unwrap()),
        ] {
            let mut late = filter(0.0).stator;
            let [first] = drive(&mut late, [before]);
            late.late_periods = LATE_S / PERIOD_S;
            let [second] = drive(&mut late, [command]);
            let (added, told) = (second - first, late.state.phase);
            let (mut mean, mut mean_square) = (0.0, 0.0);
            for step in 0..=40 {
                let off_rad = phase_off_rad(before, command, 100 * step, told);
                (mean, mean_square) = (mean + off_rad / 41.0, mean_square + off_rad * off_rad / 41.0);
            }
            assert!(mean.abs() < 1e-3 * added.sqrt(), "{command:?}: {mean:e} {added:e}");
            assert!((mean_square / added - 1.0).abs() < 1.0 / 16.0, "{command:?}: {mean_square:e} {added:e}");
        }
    }

    /// Another amplitude leaves the phase as it is, and so does a drive on time.
    #[test]
    fn exact_the_phase_of_the_same_frequency_or_on_time_is_not_doubted() {
        let weak = DriveCommand::try_new(DriveMode::B, 0.5).unwrap();
        let [first, second] = drive(&mut filter(LATE_S).stator, [full(DriveMode::B), weak]);
        assert!((second / first - 1.0).abs() < 1e-9, "{first} {second}");
        let commands = [full(DriveMode::B), full(DriveMode::C), OFF, full(DriveMode::B)];
        let prior = PRIOR[DRIVE_PHASE] * PRIOR[DRIVE_PHASE];
        let on_time = drive(&mut filter(0.0).stator, commands);
        assert!(on_time.iter().all(|own| (own / prior - 1.0).abs() < 1e-9), "{on_time:?}");
    }

    /// A change at the end of a millisecond of mode B: what the phase does to the motion until then is as uncertain as
    /// with a drive on time.
    #[test]
    fn exact_the_motion_before_a_change_is_not_doubted() {
        let [on_time, late] = [0.0, LATE_S].map(|late_s| {
            let mut stator = filter(0.0).stator;
            drive(&mut stator, [full(DriveMode::B)]);
            stator.late_periods = late_s / PERIOD_S;
            stator.advance(Time::from_micros(1000), full(DriveMode::C));
            stator.predict_covariance();
            stator.covariance.column(DRIVE_PHASE)
        });
        assert!(late[DRIVE_PHASE] > 1.01 * on_time[DRIVE_PHASE]);
        let largest = on_time.iter().take(DRIVE_PHASE).fold(0.0, |most: f64, shared| most.max(shared.abs()));
        let off = |state: usize| (late[state] - on_time[state]).abs();
        assert!(
            largest > 0.0 && (0..DRIVE_PHASE).all(|state| off(state) < 1e-9 * largest),
            "{late} {on_time}"
        );
    }

    /// Whatever was learnt of the phase, after a restart it is that of the commands, of which each was late: known to
    /// the prior and to all that they added, but never worse than not at all.
    #[test]
    fn exact_a_restart_doubts_the_phase_by_all_that_was_late() {
        let commands = [full(DriveMode::B), full(DriveMode::C), OFF];
        let [.., expected] = drive(&mut filter(LATE_S).stator, commands);
        for with_learnt in [false, true] {
            let mut late = filter(LATE_S);
            if with_learnt {
                late.keep_learnt(Time::ZERO);
                late.keep_learnt(Time::from_nanos(150_000_000));
            }
            drive(&mut late.stator, commands);
            late.stator.covariance.replace_state(DRIVE_PHASE, 1e-6);
            late.restart_stator_after_fault();
            let own = late.stator.covariance.variance::<DRIVE_PHASE>();
            assert!((own / expected - 1.0).abs() < 1e-9, "{with_learnt}: {own} {expected}");
        }
        let mut late = filter(LATE_S);
        for _ in 0..1000 {
            drive(&mut late.stator, [full(DriveMode::B), OFF]);
        }
        late.restart_stator();
        let own = late.stator.covariance.variance::<DRIVE_PHASE>();
        assert!((own / UNKNOWN_RAD2 - 1.0).abs() < 1e-9, "{own}");
    }
}
