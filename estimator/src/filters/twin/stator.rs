//! The stator filter: an extended Kalman filter of the stator's modes, the rotor's height and the motor's parameters.
//!
//! The states are errors ([`super::states`] has their table). The estimates themselves are the fields of
//! [`StatorFilter`]: modes and height in `state` and `height_m`, parameters as parts in `parameters`, the drive's
//! phase in `state.phase`. A mode whose stiffness, damping and drive are off by the parts `kappa`, `c`, `f` moves as
//!
//! ```text
//! dg'' + 2 zeta w dg' + w^2 dg  =  -w^2 g kappa + (a - 2 zeta w g') c + a f          a: acceleration by the drive
//! ```
//!
//! The damping acts on the drive too: its force is `2 zeta w^2 A`, since damping and amplitude are what is measured
//! (Table 1 of the paper).
//!
//! The phase is that of the drive's current at the motor. A command that is reported one tick of 10 us late is 0.4 rad
//! behind, a fifth of a tooth's swing. Its correction turns the phase of the model, at most half a turn at once. A
//! restart takes the corrections back: the phase is then that of the commands, known to its prior. Commands that act
//! late shift it: [`super::late_drive`].
//!
//! The height is the integral of the vibrometer's samples: its variance grows by `sigma^2 h^2` a sample, 28 nm in 4 ms.
//!
//! [`super::motion_prediction`] steps the motion and [`super::covariance_prediction`] the covariance; an impact is the
//! measurement ([`super::impact_update`]); [`super::restart`] sets motion or parameters back.

use motor_model::{DriveMode, Mode, Phase, Real, Stator, StatorState, Time};
use nalgebra::{Matrix2, Vector3};
use ud_filter::UdCovariance;

use super::checked_motor::{CheckedMotor, PERIOD_S};
use super::oscillator::Oscillator;
use super::sensitivity::{InputSums, ModeSensitivities, SENSITIVITY_PERIODS};
use super::states::{
    DRIVE_PHASE, Errors, MODE_PARAMETERS, MotionErrors, Row, STATES, STIFFNESSES, entry, prior_variances,
};
use super::tuning::TwinTuning;
use crate::innovation::ContactInnovation;

/// Amplitude from which a mode's process noise follows if its driven amplitude is smaller, in m. Assumed: mode A has no
/// drive, but impacts in modes B and C leave some micrometres in it.
const LEAST_AMPLITUDE_M: f64 = 2e-6;

/// Process noise of each mode's velocity: as a part of a driven motion, the steady motion that it would sustain. Tuned.
const PROCESS_NOISE_PART: f64 = 3e-4;

/// Bounds of [`StatorFilter::is_sound_after`], far beyond what any drive does: square of a mode's amplitude (1 mm),
/// height, root of the sum of the squares of the parameters as parts, and in SI units the variances of gap and
/// approach, and of all states.
const AMPLITUDE_MAX_M2: f64 = 1e-6;
const HEIGHT_MAX_M: f64 = 1.0;
const PARAMETER_MAX: f64 = 0.9;
const VARIANCE_MAX: f64 = 1e6;
/// Largest error of a stiffness: beyond it the explicit step of the parameters' effect could add more amplitude than
/// the damping removes, see [`StatorFilter::has_sound_estimates`].
const STIFFNESS_MAX: f64 = 0.25;

/// Estimates of the stator and of the rotor's height, with the covariance of their errors.
#[derive(Clone, Debug)]
pub(super) struct StatorFilter<T: Real> {
    pub(super) model: Stator<T>,
    pub(super) state: StatorState<T>,
    /// Time of `state`; `None` before the first sample.
    pub(super) at: Option<Time>,
    /// Whether the stator has been at rest since [`Self::set_at_rest`].
    pub(super) at_rest: bool,
    pub(super) oscillators: [Oscillator<T>; 3],
    /// Sine and cosine of the drive's phase.
    pub(super) phasor: [T; 2],
    /// By how much the phase has been corrected since the last restart.
    pub(super) phase_correction: Phase,
    /// Transition matrix of each mode over one period.
    pub(super) period_steps: [Matrix2<T>; 3],
    /// The same over [`SENSITIVITY_PERIODS`] periods.
    pub(super) sensitivity_steps: [Matrix2<T>; 3],
    pub(super) height_m: T,
    /// Estimates of the parameters, as parts by which they differ from nominal; only the parameters' entries are used.
    pub(super) parameters: Errors<T>,
    /// Sensitivities of each mode since the covariance was last predicted.
    pub(super) sensitivities: [ModeSensitivities<T>; 3],
    /// Time for which the covariance has not been predicted, up to the last sensitivity step, in s.
    pub(super) unpredicted_s: T,
    /// Periods since the last sensitivity step, and the sums of their inputs.
    pub(super) pending_periods: u8,
    pub(super) input_sums: InputSums<T>,
    pub(super) covariance: UdCovariance<T, STATES>,
    /// Estimates of the parameters at a restart: zero but for the stiffnesses of modes that were retuned.
    pub(super) prior_parameters: Errors<T>,
    /// Kept, since a microcontroller computes them in double precision by software.
    pub(super) prior_variances: Errors<T>,
    /// Most that the drive acts later than it is told, in periods; see [`super::late_drive`].
    pub(super) late_periods: T,
    /// Those of the stiffnesses of motors of the design, whatever was retuned.
    pub(super) stiffness_variances: [T; 3],
    /// Estimate of the last impact's jump.
    pub(super) jump_m_s: T,
    /// `(1 + r) / (1 + e)`, r the mass ratio at a tooth.
    pub(super) approach_per_jump: T,
    /// `r / (1 + r)`.
    pub(super) recoil_share: T,
    /// Process noise of each mode's velocity, in m^2/s^3.
    pub(super) velocity_noise_m2_s3: [T; 3],
    /// Process noise of the height, in m^2/s.
    pub(super) height_noise_m2_s: T,
}

impl<T: Real> StatorFilter<T> {
    /// The stator of `motor` at rest.
    #[inline]
    pub(super) fn at_rest(motor: &CheckedMotor<T>, tuning: &TwinTuning<T>) -> Self {
        let (modes, r) = (&motor.modes, motor.tooth_mass_ratio);
        let velocity_noise = |mode: &Mode| {
            let speed = mode.natural_rad_s * mode.antinode_amplitude_m.max(LEAST_AMPLITUDE_M);
            let part = T::from_f64(PROCESS_NOISE_PART);
            part * part * T::from_f64(4.0 * mode.damping_ratio * mode.natural_rad_s * speed * speed)
        };
        let prior_variances: Errors<T> = prior_variances();
        let steps = |n: u8| modes.each_ref().map(|mode| transition(mode, PERIOD_S * f64::from(n)));
        Self {
            model: motor.stator.clone(),
            state: StatorState::default(),
            at: None,
            at_rest: false,
            oscillators: modes.each_ref().map(Oscillator::new),
            phasor: [T::zero(), T::one()],
            phase_correction: Phase::ZERO,
            period_steps: steps(1),
            sensitivity_steps: steps(SENSITIVITY_PERIODS),
            height_m: T::zero(),
            parameters: Errors::zeros(),
            sensitivities: [ModeSensitivities::none(); 3],
            unpredicted_s: T::zero(),
            pending_periods: 0,
            input_sums: InputSums::default(),
            covariance: UdCovariance::from_diagonal(&prior_variances),
            prior_parameters: Errors::zeros(),
            stiffness_variances: STIFFNESSES
                .map(|state| prior_variances.as_slice().get(state).copied().unwrap_or_default()),
            prior_variances,
            late_periods: tuning.drive_late_s * T::from_f64(1.0 / PERIOD_S),
            jump_m_s: T::zero(),
            approach_per_jump: tuning.without_stator.approach_per_jump,
            recoil_share: T::from_f64(r / (1.0 + r)),
            velocity_noise_m2_s3: modes.each_ref().map(velocity_noise),
            height_noise_m2_s: height_noise_m2_s(tuning),
        }
    }

    /// Estimate of a parameter, were it corrected by `errors`.
    #[inline]
    pub(super) fn parameter(&self, state: usize, errors: &Row<T>) -> T {
        self.parameters.as_slice().get(state).copied().unwrap_or_default() + entry(errors, state)
    }

    /// How far the stator, which moves in whole periods, is behind `to`, in s.
    pub(super) fn behind_s(&self, to: Time) -> T {
        self.at.map_or(T::zero(), |at| to.seconds_since(at))
    }

    /// Shifts the drive's phase.
    pub(super) fn shift_phase(&mut self, by: Phase) {
        self.state.phase = self.state.phase.advanced(by);
        self.phasor = self.state.phase.sin_cos().into();
    }

    /// Amplitude of each mode's acceleration by the drive in force, in m/s^2.
    pub(super) fn drive_amplitude_m_s2(&self) -> Vector3<T> {
        let command = self.state.forcing.command();
        let [_, b, c] = &self.oscillators;
        let (amplitude, zero) = (T::from_f32(command.amplitude()), T::zero());
        match command.mode() {
            Some(DriveMode::B) => Vector3::new(zero, b.drive_m_s2 * amplitude, zero),
            Some(DriveMode::C) => Vector3::new(zero, zero, c.drive_m_s2 * amplitude),
            None => Vector3::zeros(),
        }
    }

    /// Adds `errors` to height and modes.
    pub(super) fn move_by(&mut self, [height, g_a, v_a, g_b, v_b, g_c, v_c]: MotionErrors<T>) {
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
    }

    /// Adds `errors` to all estimates.
    pub(super) fn correct(&mut self, errors: &Errors<T>) {
        let [[_, height, g_a, v_a, g_b, v_b, g_c, v_c, _, jump, ..]] = errors.data.0;
        self.move_by([height, g_a, v_a, g_b, v_b, g_c, v_c]);
        self.jump_m_s += jump;
        let parameters = self.parameters.iter_mut().zip(errors).take(DRIVE_PHASE).skip(MODE_PARAMETERS);
        parameters.for_each(|(parameter, &error)| *parameter += error);
        let lead = phase_of(errors.as_slice().get(DRIVE_PHASE).copied().unwrap_or_default());
        self.phase_correction = self.phase_correction.advanced(lead);
        self.shift_phase(lead);
    }

    /// Whether estimates and covariance are finite and within a hundred times what any drive does.
    #[cfg(test)]
    pub(super) fn is_sound(&self) -> bool {
        self.has_sound_estimates() && self.covariance.trace() < T::from_f64(VARIANCE_MAX)
    }

    /// The same after an impact. Its gap and approach depend on all states that vary in time, and an update makes no
    /// variance larger.
    pub(super) fn is_sound_after(&self, impact: &ContactInnovation<T>) -> bool {
        // Compared this way round, so that NaN is unsound.
        self.has_sound_estimates() && impact.gap_m2 + impact.approach_m2_s2 < T::from_f64(VARIANCE_MAX)
    }

    /// The same of the estimates alone.
    ///
    /// Amplitudes are bounded, not momentary values, so that what is sound stays so until the next impact. Stiffnesses
    /// are bounded, so that the explicit step of [`super::motion_prediction`] is stable: a stiffness off by `kappa`
    /// adds `(kappa w h)^2 / 4` of the amplitude a period, which the damping must outweigh.
    pub(super) fn has_sound_estimates(&self) -> bool {
        let bounded = |limit: f64| move |x: &T| x.abs() < T::from_f64(limit);
        let modes = &self.state.modes;
        let motions = modes.displacement_m.iter().zip(modes.velocity_m_s.iter());
        let swings = self.oscillators.iter().zip(motions).map(|(oscillator, (&g, &v))| {
            oscillator.stiffness_per_s2 * g * g + v * v
                - oscillator.stiffness_per_s2 * T::from_f64(AMPLITUDE_MAX_M2)
        });
        let parameters = self.parameters.as_slice().get(MODE_PARAMETERS..DRIVE_PHASE).unwrap_or_default();
        let squares = parameters.iter().fold(T::zero(), |sum, &part| sum + part * part);
        let [_, _, _, _, _, _, _, _, _, _, k_a, _, k_b, _, _, k_c, ..] = self.parameters.data.0[0];
        swings.into_iter().all(|beyond| beyond < T::zero())
            && bounded(HEIGHT_MAX_M)(&self.height_m)
            && squares < T::from_f64(PARAMETER_MAX * PARAMETER_MAX)
            && [k_a, k_b, k_c].iter().all(bounded(STIFFNESS_MAX))
    }
}

/// Process noise of the height, the integral of samples of this noise and period, in m^2/s.
pub(super) fn height_noise_m2_s<T: Real>(tuning: &TwinTuning<T>) -> T {
    let noise_m_s = tuning.detector.noise_m_s;
    noise_m_s * noise_m_s * tuning.sample_period_s
}

fn transition<T: Real>(mode: &Mode, time_s: f64) -> Matrix2<T> {
    let [[gg, gv], [vg, vv]] = mode.propagator(time_s);
    Matrix2::new(gg, gv, vg, vv).map(T::from_f64)
}

/// An angle in rad as a phase, to 2^-30 of a turn; clamped to half a turn.
fn phase_of<T: Real>(lead_rad: T) -> Phase {
    let turns = (lead_rad * T::from_f64(1.0 / core::f64::consts::TAU)).clamp_magnitude(T::from_f64(0.5));
    let units = i64::from((turns * T::from_f64(1_073_741_824.0)).whole()) << 34;
    Phase::from_units(units.cast_unsigned())
}

#[cfg(test)]
mod tests {
    use motor_model::MotorParams;

    use super::*;
    use crate::instruments::Instruments;

    fn stator() -> (StatorFilter<f64>, CheckedMotor<f64>, TwinTuning<f64>) {
        let params = MotorParams::nominal();
        let (motor, tuning) =
            (CheckedMotor::try_new(&params).unwrap(), TwinTuning::new(&params, &Instruments::default()));
        (StatorFilter::at_rest(&motor, &tuning), motor, tuning)
    }

    /// White noise of intensity q moves a mode of damping `2 zeta w` to a speed of variance `q / (4 zeta w)`: that of
    /// the tuned part of the driven swing, and of 2 um of mode A, which is not driven.
    #[test]
    fn exact_process_noise_leaves_its_part_of_the_swing() {
        let (stator, motor, _) = stator();
        for (mode, noise) in motor.modes.iter().zip(stator.velocity_noise_m2_s3) {
            let swing_m = mode.antinode_amplitude_m.max(2e-6);
            let own = noise / (4.0 * mode.damping_ratio * mode.natural_rad_s);
            let expected = (PROCESS_NOISE_PART * mode.natural_rad_s * swing_m).powi(2);
            assert!((own / expected - 1.0).abs() < 1e-9, "{own:e} {expected:e}");
        }
    }

    /// A stiffness may be off by a fourth, and other parameters by nine tenths, before the stator is given up.
    #[test]
    fn exact_a_stiffness_is_bounded_more_narrowly_than_other_parameters() {
        let stiffnesses = [0, 2, 5].map(|mode| MODE_PARAMETERS + mode);
        for state in MODE_PARAMETERS..DRIVE_PHASE {
            let most = if stiffnesses.contains(&state) { 0.25 } else { 0.9 };
            for (part, sound) in [(0.999 * most, true), (-1.001 * most, false), (f64::NAN, false)] {
                let (mut stator, ..) = stator();
                stator.parameters[state] = part;
                assert_eq!(stator.is_sound(), sound, "{state}: {part}");
            }
        }
    }
}
