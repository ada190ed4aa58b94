//! The whole motor: one step of stator, rotor and impacts.

pub(crate) mod clearance;
mod end_of_step;
mod located;
mod sustained;

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
use sustained::SustainedContact;

/// Most impacts that one step can hold.
pub const IMPACTS_PER_STEP_MAX: usize = 4;

/// The impacts of one step, in the order in which they happened.
pub type Impacts<T> = Vec<Impact<T>, IMPACTS_PER_STEP_MAX>;

/// How a step finds the impacts that happen in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImpactRule {
    /// At the end of the step, as in the paper's program: each impact is up to a step late. For comparison.
    EndOfStep,
    /// At the instant when the gap closes. Teeth that stay on the rotor are in sustained contact. A step longer than
    /// half a period of the fastest mode shows neither: there impacts are applied at its end.
    #[default]
    Located,
}

/// Settings of a motor model besides the motor's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorSetup {
    /// Length of a step in s, within 1e-9 to 1e-3.
    pub step_s: f64,
    /// When impacts are applied.
    pub impact_rule: ImpactRule,
    /// What limits the tangential impulse.
    pub friction_law: FrictionLaw,
    /// The generator's frequencies.
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

/// Everything that changes from step to step. A plain value: copy it to branch a run.
///
/// The mechanical state, all zero at the start:
///
/// | quantity | symbol | unit | meaning |
/// |---|---|---|---|
/// | `modes.displacement_m` | `g_A, g_B, g_C` | m | modal displacements |
/// | `modes.velocity_m_s` | `g_A', g_B', g_C'` | m/s | their rates |
/// | `rotor.height_m` | `z` | m | height of the rotor above the teeth at rest |
/// | `rotor.velocity_m_s` | `v_z` | m/s | its rate, upward |
/// | `rotor.angle` | `theta` | 2^-32 turn | angle of the rotor, clockwise |
/// | `rotor.rate_rad_s` | `omega` | rad/s | its rate |
/// | `in_contact` | | | which pairs are in sustained contact |
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
    /// Which pairs of teeth are in sustained contact with the rotor. Always false with [`ImpactRule::EndOfStep`].
    pub in_contact: [bool; 2],
}

/// The state without the drive in force, for the rarer paths of a step: the drive is as large as the rest and constant.
#[derive(Clone, Copy, Debug)]
struct Motion<T> {
    phase: Phase,
    modes: ModalState<T>,
    rotor: RotorState<T>,
    in_contact: [bool; 2],
}

impl<T: Real> Motion<T> {
    /// The whole state, for the ledger.
    fn under(&self, forcing: &Forcing<T>) -> MotorState<T> {
        let Self { phase, modes, rotor, in_contact } = *self;
        MotorState { steps: 0, phase, modes, rotor, forcing: *forcing, in_contact }
    }
}

impl<T: Real> MotorState<T> {
    fn motion(&self) -> Motion<T> {
        let Self { phase, modes, rotor, in_contact, .. } = *self;
        Motion { phase, modes, rotor, in_contact }
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
    sustained: SustainedContact<T>,
    step: T,
    /// Largest error of the cubic through both ends of a step, per change of the gap's rate.
    curve_margin_s: T,
    /// Amplitude of the wider pair per that of the first, at least 1.
    widest_ratio: T,
    step_s: f64,
}

/// Longest step within which contacts are resolved, in radians of the fastest mode. Up to half a period a constant push
/// moves every mode in its own direction, so that the response of the gaps to pushes is positive definite.
const RESOLVED_RAD: f64 = core::f64::consts::PI;

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
            sustained: SustainedContact::new(&bank, &flight, &teeth, fastest_rad, step_s),
            modes: bank,
            teeth,
            flight,
            impact_law: ImpactLaw::new(params, setup.friction_law),
            impact_rule: if fastest_rad > RESOLVED_RAD { ImpactRule::EndOfStep } else { setup.impact_rule },
            step: T::from_f64(step_s),
            curve_margin_s: T::from_f64(clearance::cubic_margin(fastest_rad) * step_s),
            widest_ratio: T::from_f64(setup.variation.widest_per_first()),
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
    /// Cannot fail, allocates nothing and calls nothing transcendental. A command other than the last one takes
    /// effect at the start of the step.
    #[inline]
    pub fn step(&self, state: &mut MotorState<T>, command: DriveCommand) -> Impacts<T> {
        self.step_with(state, command, &mut NoLedger)
    }

    /// [`Self::step`], with the flows of energy recorded in `ledger`.
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
        if state.in_contact != [false; 2] {
            let impacts = on_copies(state, |forcing, motion, impacts| {
                self.step_in_contact(forcing, motion, impacts, ledger);
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
                    return on_copies(state, |forcing, end, impacts| {
                        self.locate_impacts(forcing, &start, end, impacts, ledger);
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
                    return on_copies(state, |forcing, end, impacts| {
                        self.impacts_at_end(forcing, end, gaps_m, impacts, ledger);
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

/// Runs a rare path on copies of the state. No reference to the state then leaves the step, so a compiler can keep it
/// in registers from step to step.
#[inline]
fn on_copies<T: Real>(
    state: &mut MotorState<T>,
    path: impl FnOnce(&Forcing<T>, &mut Motion<T>, &mut Impacts<T>),
) -> Impacts<T> {
    let (forcing, mut motion, mut impacts) = (state.forcing, state.motion(), Impacts::new());
    path(&forcing, &mut motion, &mut impacts);
    let Motion { phase, modes, rotor, in_contact } = motion;
    (state.phase, state.modes, state.rotor, state.in_contact) = (phase, modes, rotor, in_contact);
    // Most steps in sustained contact have no impacts: an empty list is cheaper than a copy.
    if impacts.is_empty() { Impacts::new() } else { impacts }
}

#[cfg(test)]
mod tests;
