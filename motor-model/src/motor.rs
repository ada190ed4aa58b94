//! The whole motor: one step of stator, rotor and impacts.

use heapless::Vec;

use crate::drive::DriveCommand;
use crate::energy::{Ledger, NoLedger};
use crate::error::OutOfBounds;
use crate::impact::{FrictionLaw, Impact, ImpactLaw};
use crate::math::Real;
use crate::modes::{DriveTuning, Forcing, ModalBank, ModalState, Mode};
use crate::params::MotorParams;
use crate::phase::Phase;
use crate::rotor::{Flight, RotorState};
use crate::teeth::{AmplitudeVariation, ToothPair};

/// Most impacts that one step can hold.
pub const IMPACTS_PER_STEP_MAX: usize = 4;

/// The impacts of one step, in the order in which they happened.
pub type Impacts<T> = Vec<Impact<T>, IMPACTS_PER_STEP_MAX>;

/// What a run chooses besides the motor's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorSetup {
    /// Length of a step in s, within 1e-9 to 1e-3.
    pub step_s: f64,
    /// What limits the tangential impulse.
    pub friction_law: FrictionLaw,
    /// Where the generator's frequencies stand.
    pub tuning: DriveTuning,
    /// This run's amplitudes of the tooth pairs.
    pub variation: AmplitudeVariation,
}

impl MotorSetup {
    /// Coulomb friction, driven at resonance, no variation between the pairs.
    pub fn with_step(step_s: f64) -> Self {
        Self {
            step_s,
            friction_law: FrictionLaw::default(),
            tuning: DriveTuning::default(),
            variation: AmplitudeVariation::default(),
        }
    }
}

/// Everything that changes from step to step: a plain value, copied to branch a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorState<T: Real> {
    /// Steps taken.
    pub steps: u64,
    /// Phase of the drive.
    pub phase: Phase,
    /// The stator.
    pub modes: ModalState<T>,
    /// The rotor.
    pub rotor: RotorState<T>,
    /// The drive now in force.
    pub forcing: Forcing<T>,
}

/// A motor ready to step: immutable, one for any number of states.
///
/// ```
/// use motor_model::{DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState};
///
/// let motor = Motor::<f64>::try_new(&MotorParams::nominal(), &MotorSetup::with_step(1e-6))?;
/// let mut state = MotorState::default();
/// for _ in 0..100_000 {
///     motor.step(&mut state, DriveCommand::full(DriveMode::C));
/// }
/// assert!(state.rotor.rate_rad_s < -0.5, "mode C turns counter-clockwise");
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct Motor<T> {
    modes: ModalBank<T>,
    teeth: [ToothPair<T>; 2],
    flight: Flight<T>,
    impact_law: ImpactLaw<T>,
    step_s: f64,
}

impl<T: Real> Motor<T> {
    /// A motor of these parameters and this step.
    ///
    /// # Errors
    /// When the step is outside 1e-9 to 1e-3 s, a fixed drive frequency is outside 1 Hz to 1 MHz, or mode A is damped
    /// beyond 0.99 of critical.
    pub fn try_new(params: &MotorParams, setup: &MotorSetup) -> Result<Self, OutOfBounds> {
        let step_s = OutOfBounds::check("step_s", setup.step_s, 1e-9, 1e-3, "s")?;
        if let DriveTuning::Fixed { b_hz, c_hz } = setup.tuning {
            OutOfBounds::check("drive.frequency_b_hz", b_hz, 1.0, 1e6, "Hz")?;
            OutOfBounds::check("drive.frequency_c_hz", c_hz, 1.0, 1e6, "Hz")?;
        }
        Ok(Self {
            modes: ModalBank::new(&Mode::all(params)?, setup.tuning, step_s),
            teeth: ToothPair::both(params, &setup.variation),
            flight: Flight::new(params, step_s),
            impact_law: ImpactLaw::new(params, setup.friction_law),
            step_s,
        })
    }

    /// Length of a step in s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The two pairs of teeth.
    pub fn teeth(&self) -> &[ToothPair<T>; 2] {
        &self.teeth
    }

    /// The stator's modes.
    pub fn modes(&self) -> &ModalBank<T> {
        &self.modes
    }

    /// Height of the rotor above the higher pair of teeth, in m.
    pub fn gap_m(&self, state: &MotorState<T>) -> T {
        let [first, second] = self.gaps_m(state);
        if second < first { second } else { first }
    }

    /// Advances `state` by one step under `command` and returns the impacts of that step.
    ///
    /// Cannot fail, allocates nothing and calls nothing transcendental. A command other than the last one takes effect at the
    /// start of the step.
    #[inline]
    pub fn step(&self, state: &mut MotorState<T>, command: DriveCommand) -> Impacts<T> {
        self.step_with(state, command, &mut NoLedger)
    }

    /// [`Self::step`], with an account kept of the energy that moves.
    #[inline]
    pub fn step_with<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        command: DriveCommand,
        ledger: &mut L,
    ) -> Impacts<T> {
        if state.forcing.command() != command {
            state.forcing = self.modes.forcing(command);
        }
        ledger.free_motion(state, self.step_s);
        self.modes.advance(&mut state.modes, &state.forcing, state.phase);
        self.flight.advance(&mut state.rotor);
        state.phase = state.phase.advanced(state.forcing.increment());
        state.steps += 1;

        let gaps_m = self.gaps_m(state);
        let [first, second] = gaps_m;
        if first > T::zero() && second > T::zero() {
            Impacts::new()
        } else {
            self.strike_at_end(state, gaps_m, ledger)
        }
    }

    /// Heights of the rotor above both pairs.
    #[inline]
    fn gaps_m(&self, state: &MotorState<T>) -> [T; 2] {
        let [first, second] = &self.teeth;
        [
            state.rotor.height_m - first.height(&state.modes),
            state.rotor.height_m - second.height(&state.modes),
        ]
    }

    /// The paper's rule: a contact is noticed at the end of the step, the deeper pair first.
    ///
    /// The rotor is then lifted out of the tooth: without that it would sink, step by step, into teeth that it rests on. The
    /// lift's energy has its own line in the ledger.
    fn strike_at_end<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        [first, second]: [T; 2],
        ledger: &mut L,
    ) -> Impacts<T> {
        let mut impacts = Impacts::new();
        let [tooth_0, tooth_1] = &self.teeth;
        let (zero, one) = ((0, tooth_0, first), (1, tooth_1, second));
        let order = if second < first { [one, zero] } else { [zero, one] };
        let deepest_m = order[0].2;
        for (pair, tooth, gap_m) in order {
            let approach_m_s = tooth.vertical_velocity(&state.modes) - state.rotor.velocity_m_s;
            if gap_m > T::zero() || approach_m_s <= T::zero() {
                continue;
            }
            let before = *state;
            let impulse = self.impact_law.strike(tooth, approach_m_s, &mut state.modes, &mut state.rotor);
            let impact = Impact {
                pair,
                before_end_s: T::zero(),
                approach_m_s,
                normal_impulse_n_s: impulse.normal_n_s,
                slip_m_s: impulse.slip_m_s,
                tangential_impulse_n_s: impulse.tangential_n_s,
                gap_m,
            };
            ledger.impact(&before, state, &impact);
            // Two pairs, each at most once: always fits.
            let _ = impacts.push(impact);
        }
        state.rotor.height_m -= deepest_m;
        ledger.lift(-deepest_m);
        impacts
    }
}
