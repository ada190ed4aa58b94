//! The whole motor: one step of stator, rotor and impacts.

mod clearance;
mod located;
mod press;
mod strike;

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
use press::Press;

/// Most impacts that one step can hold.
pub const IMPACTS_PER_STEP_MAX: usize = 4;

/// The impacts of one step, in the order in which they happened.
pub type Impacts<T> = Vec<Impact<T>, IMPACTS_PER_STEP_MAX>;

/// How a step finds the impacts that happen in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImpactRule {
    /// At its end, as the paper's program did: each comes up to a step too late. For comparison.
    EndOfStep,
    /// Where they happen, and teeth that stay on the rotor are pressed contacts.
    #[default]
    Located,
}

/// What a run chooses besides the motor's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorSetup {
    /// Length of a step in s, within 1e-9 to 1e-3.
    pub step_s: f64,
    /// How impacts are found.
    pub impact_rule: ImpactRule,
    /// What limits the tangential impulse.
    pub friction_law: FrictionLaw,
    /// Where the generator's frequencies stand.
    pub tuning: DriveTuning,
    /// This run's amplitudes of the tooth pairs.
    pub variation: AmplitudeVariation,
}

impl MotorSetup {
    /// Located impacts, Coulomb friction, driven at resonance, no variation between the pairs.
    pub fn with_step(step_s: f64) -> Self {
        Self {
            step_s,
            impact_rule: ImpactRule::default(),
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
    /// Which pairs of teeth lie pressed on the rotor; only located impacts know of pressed contacts.
    pub pressed: [bool; 2],
}

/// What moves, as the rarer paths of a step pass it on: the state less the drive in force, which is as large and stays.
#[derive(Clone, Copy, Debug)]
struct Motion<T> {
    phase: Phase,
    modes: ModalState<T>,
    rotor: RotorState<T>,
    pressed: [bool; 2],
}

impl<T: Real> Motion<T> {
    /// The whole state, for the ledger.
    fn under(&self, forcing: &Forcing<T>) -> MotorState<T> {
        let Self { phase, modes, rotor, pressed } = *self;
        MotorState { steps: 0, phase, modes, rotor, forcing: *forcing, pressed }
    }
}

impl<T: Real> MotorState<T> {
    fn motion(&self) -> Motion<T> {
        let Self { phase, modes, rotor, pressed, .. } = *self;
        Motion { phase, modes, rotor, pressed }
    }

    /// The end of a step.
    #[inline]
    fn move_to(&mut self, phase: Phase, modes: ModalState<T>, rotor: RotorState<T>) {
        self.steps += 1;
        (self.phase, self.modes, self.rotor) = (phase, modes, rotor);
    }
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
    impact_rule: ImpactRule,
    press: Press<T>,
    step: T,
    /// How far the cubic through both ends of a step may miss a gap, per change of the gap's rate.
    curve_margin_s: T,
    /// The wider pair's swing per first pair's, at least 1.
    widest_swing: T,
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
        setup.tuning.check()?;
        let modes = Mode::all(params)?;
        let (bank, flight) = (ModalBank::new(&modes, setup.tuning, step_s), Flight::new(params, step_s));
        let teeth = ToothPair::both(params, &setup.variation);
        let fastest_rad = modes.iter().map(|mode| mode.natural_rad_s * step_s).fold(0.0, f64::max);
        Ok(Self {
            press: Press::new(&bank, &flight, &teeth, fastest_rad, step_s),
            modes: bank,
            teeth,
            flight,
            impact_law: ImpactLaw::new(params, setup.friction_law),
            impact_rule: setup.impact_rule,
            step: T::from_f64(step_s),
            curve_margin_s: T::from_f64(clearance::cubic_margin(fastest_rad) * step_s),
            widest_swing: T::from_f64(setup.variation.widest_per_first()),
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
        let [first, second] = self.gaps_m(&state.modes, &state.rotor);
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
        if state.pressed != [false; 2] {
            let impacts = aside(state, |forcing, motion, impacts| {
                self.press_through(forcing, motion, impacts, ledger);
            });
            state.steps += 1;
            return impacts;
        }
        let (mut modes, mut rotor) = (state.modes, state.rotor);
        self.modes.advance(&mut modes, &state.forcing, state.phase);
        self.flight.advance(&mut rotor);
        let phase = state.phase.advanced(state.forcing.increment());
        match self.impact_rule {
            ImpactRule::Located => {
                let start = self.clearance(&state.modes, &state.rotor);
                if !self.surely_clear(&start, &self.clearance(&modes, &rotor)) {
                    let start = state.motion();
                    state.move_to(phase, modes, rotor);
                    return aside(state, |forcing, end, impacts| {
                        self.strike_inside(forcing, &start, end, impacts, ledger);
                    });
                }
                ledger.motion(state, T::one(), [T::zero(); 2]);
            }
            ImpactRule::EndOfStep => {
                ledger.motion(state, T::one(), [T::zero(); 2]);
                let gaps_m = self.gaps_m(&modes, &rotor);
                let [first, second] = gaps_m;
                if first <= T::zero() || second <= T::zero() {
                    state.move_to(phase, modes, rotor);
                    return aside(state, |forcing, end, impacts| {
                        self.strike_at_end(forcing, end, gaps_m, impacts, ledger);
                    });
                }
            }
        }
        state.move_to(phase, modes, rotor);
        Impacts::new()
    }

    /// Heights of the rotor above both pairs.
    #[inline]
    fn gaps_m(&self, modes: &ModalState<T>, rotor: &RotorState<T>) -> [T; 2] {
        let [first, second] = &self.teeth;
        [rotor.height_m - first.height(modes), rotor.height_m - second.height(modes)]
    }
}

/// Runs a rare path on copies: a state whose address goes nowhere lives in registers from step to step.
#[inline]
fn aside<T: Real>(
    state: &mut MotorState<T>,
    path: impl FnOnce(&Forcing<T>, &mut Motion<T>, &mut Impacts<T>),
) -> Impacts<T> {
    let (forcing, mut motion, mut impacts) = (state.forcing, state.motion(), Impacts::new());
    path(&forcing, &mut motion, &mut impacts);
    let Motion { phase, modes, rotor, pressed } = motion;
    (state.phase, state.modes, state.rotor, state.pressed) = (phase, modes, rotor, pressed);
    // Most steps with pressed teeth have none, whose record need not be copied.
    if impacts.is_empty() { Impacts::new() } else { impacts }
}
