//! The stator without a rotor: for frequency sweeps and for the tooth's motion between impacts.

use crate::drive::DriveCommand;
use crate::error::OutOfBounds;
use crate::math::Real;
use crate::modes::{DriveTuning, Forcing, ModalBank, ModalState, Mode};
use crate::params::MotorParams;
use crate::phase::Phase;
use crate::teeth::{AmplitudeVariation, ToothPair};

/// State of a stator without a rotor: the modal rows of [`crate::MotorState`]'s table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StatorState<T: Real> {
    /// Phase of the drive.
    pub phase: Phase,
    /// The three modes.
    pub modes: ModalState<T>,
    /// The drive now in force.
    pub forcing: Forcing<T>,
}

/// A stator ready to step. It has no impacts, so any step is exact.
///
/// ```
/// use motor_model::{DriveCommand, DriveMode, DriveTuning, MotorParams, Stator, StatorState};
///
/// // One point of a sweep: 30 Hz above mode C's resonance, until the start has died away.
/// let stator = Stator::<f64>::try_new(&MotorParams::nominal(), DriveTuning::Resonant, 10e-6)?;
/// let (mut state, mut highest_m) = (StatorState::default(), 0.0_f64);
/// let command = DriveCommand::full(DriveMode::C).with_frequency_offset(30.0)?;
/// for step in 0..40_000 {
///     stator.step(&mut state, command);
///     if step >= 30_000 {
///         highest_m = highest_m.max(stator.teeth()[0].height(&state.modes));
///     }
/// }
/// assert!(highest_m > 0.5e-6 && highest_m < 1.5e-6, "below the 1.57 um of the resonance");
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stator<T> {
    modes: ModalBank<T>,
    teeth: [ToothPair<T>; 2],
}

impl<T: Real> Stator<T> {
    /// The stator of `params`' motor with the step `step_s` and the generator's `tuning`.
    ///
    /// # Errors
    /// When the step is outside 1e-9 to 1e-3 s, a fixed drive frequency is outside 1 Hz to 1 MHz, or mode A is damped
    /// beyond 0.99 of critical.
    pub fn try_new(params: &MotorParams, tuning: DriveTuning, step_s: f64) -> Result<Self, OutOfBounds> {
        let step_s = OutOfBounds::check("step_s", step_s, 1e-9, 1e-3, "s")?;
        tuning.check()?;
        Ok(Self {
            modes: ModalBank::new(&Mode::all(params)?, tuning, step_s),
            teeth: ToothPair::both(params, &AmplitudeVariation::default()),
        })
    }

    /// The two pairs of teeth, which give height and tangential motion.
    pub fn teeth(&self) -> &[ToothPair<T>; 2] {
        &self.teeth
    }

    /// The three modes over a step.
    pub fn modes(&self) -> &ModalBank<T> {
        &self.modes
    }

    /// Advances `state` by one step under `command`.
    #[inline]
    pub fn step(&self, state: &mut StatorState<T>, command: DriveCommand) {
        if state.forcing.command() != command {
            state.forcing = self.modes.forcing(command);
        }
        let mut modes = state.modes;
        self.modes.advance(&mut modes, &state.forcing, state.phase);
        state.modes = modes;
        state.phase = state.phase.advanced(state.forcing.increment());
    }
}
