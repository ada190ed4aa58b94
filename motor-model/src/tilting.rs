//! The tilting motor: a rotor that tilts and shifts on its pin, over four separate teeth.
//!
//! It shares modes, drive, flight and laws of contact with the height-only [`crate::Motor`] and adds:
//!
//! | part | what it is |
//! |---|---|
//! | `rigid_body` | tilt, shift and spin in flight; how a point of the rotor moves |
//! | `stator_tilt` | the stator's two tilting modes, by which a single tooth recoils |
//! | `tooth` | four teeth with their own amplitudes and heights |
//! | `hub` | the hole's two edges at the pin |
//! | `stop` | optional floor under the rim and ceiling |
//! | `contact`, `contact_set` | directions of a contact; all closed contacts solved together |
//! | `all_pressing` | the normal impulses of contacts that all press: a rotor at rest |
//! | `friction_circle`, `edge_pair` | friction of one contact; both edges of the hole at once |
//! | `clearance` | a cheap test that nothing can be met in a step |
//! | `located`, `end_of_step` | when contacts are found, and what a step then does |
//! | `rubbing` | a step at the pin alone, which is most of them in mode B |
//! | `energy` | where the energy goes |
//!
//! Inside, x, y and angles are counter-clockwise; rates of rotation are clockwise, as everywhere.

mod all_pressing;
mod clearance;
mod contact;
mod contact_set;
mod edge_pair;
mod end_of_step;
mod energy;
mod friction_circle;
mod hub;
mod located;
mod rigid_body;
mod rubbing;
mod state;
mod stator_tilt;
mod stop;
mod tooth;

use heapless::Vec;
use nalgebra::Vector3;

use crate::drive::DriveCommand;
use crate::error::OutOfBounds;
use crate::impact::FrictionLaw;
use crate::math::Real;
use crate::modes::{DriveTuning, ModalBank, Mode};
use crate::motor::ImpactRule;
use crate::params::{MotorParams, TiltingParams};
use crate::rotor::Flight;
use clearance::{ClearTest, Place};
use contact::Mobility;
pub use contact::{ContactPlace, ContactPlaces};
pub use energy::{NoTiltingLedger, TiltingEnergyFlows, TiltingEnergyLedger, TiltingLedger};
use hub::Hub;
use located::Pressing;
use rigid_body::{LeanFlight, RotorMobility};
pub use rigid_body::{ShiftState, TiltState};
pub use state::TiltingState;
use state::{Follow, TiltingMotion};
pub use stator_tilt::StatorTiltState;
use stator_tilt::{StatorTiltFlight, stator_tilt_modes};
use stop::Stop;
pub use tooth::{TiltingVariation, Tooth};

/// Most contacts that one step reports; later ones of the same step are not reported.
pub const CONTACTS_PER_STEP_MAX: usize = 16;

/// The contacts of one step, in the order in which they happened.
pub type TiltingContacts<T> = Vec<TiltingContact<T>, CONTACTS_PER_STEP_MAX>;

/// What the rotor can do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Freedom {
    /// Height, tilt, shift and spin.
    #[default]
    Full,
    /// Height, tilt and spin; its mass centre stays on the axis. The tilt stop is kept, the rubbing of a shifted rotor
    /// is not.
    WithoutShift,
    /// Height and spin: the height-only motor, with four teeth in place of two pairs. For comparison.
    HeightOnly,
}

/// Settings of a tilting motor besides the motor's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltingSetup {
    /// Length of a step in s, within 1e-9 to 1e-3. Above 20 us contacts are found at the end of the step.
    pub step_s: f64,
    /// When contacts are applied.
    pub impact_rule: ImpactRule,
    /// What limits the tangential impulse at the teeth.
    pub friction_law: FrictionLaw,
    /// The generator's frequencies.
    pub tuning: DriveTuning,
    /// This motor's teeth and pin.
    pub variation: TiltingVariation,
    /// What the rotor can do.
    pub freedom: Freedom,
}

impl TiltingSetup {
    /// Located contacts, Coulomb friction, driven at resonance, equal teeth, all freedom.
    pub fn with_step(step_s: f64) -> Self {
        Self {
            step_s,
            impact_rule: ImpactRule::default(),
            friction_law: FrictionLaw::default(),
            tuning: DriveTuning::default(),
            variation: TiltingVariation::default(),
            freedom: Freedom::default(),
        }
    }
}

/// The record of one contact in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltingContact<T> {
    /// Where.
    pub place: ContactPlace,
    /// Whether it is a sustained contact, whose impulse acts throughout the span that ends here, and not an impact.
    pub sustained: bool,
    /// Time from the contact to the end of its step, in s.
    pub before_end_s: T,
    /// Speed at which the gap closed, in m/s. Negative where it opened while another contact pressed it shut.
    pub approach_m_s: T,
    /// Normal impulse on the rotor, positive, in N s.
    pub normal_impulse_n_s: T,
    /// Tangential impulses on the rotor, in N s: at a tooth, floor or ceiling clockwise and outward, at the pin
    /// counter-clockwise and up.
    pub tangential_impulse_n_s: [T; 2],
    /// Slip before friction, rotor less surface, in the same directions, in m/s.
    pub slip_m_s: [T; 2],
    /// Gap where the contact was applied, in m.
    pub gap_m: T,
}

/// A tilting motor ready to step: immutable, one for any number of states.
///
/// ```
/// use motor_model::{DriveCommand, DriveMode, MotorParams, TiltingMotor, TiltingParams, TiltingSetup, TiltingState};
///
/// let (params, tilting) = (MotorParams::nominal(), TiltingParams::nominal());
/// let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &TiltingSetup::with_step(1e-6))?;
/// let mut state = TiltingState::default();
/// for _ in 0..100_000 {
///     motor.step(&mut state, DriveCommand::full(DriveMode::C));
/// }
/// assert!(state.rotor.rate_rad_s < -0.5, "mode C turns counter-clockwise");
/// assert!(state.tilt.slope.norm_squared() > 0.0, "and the rotor tilts");
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct TiltingMotor<T> {
    modes: ModalBank<T>,
    stator_tilt: StatorTiltFlight<T>,
    flight: Flight<T>,
    lean: LeanFlight<T>,
    teeth: [Tooth<T>; 4],
    hub: Hub<T>,
    stops: [Option<Stop<T>>; 2],
    mobility: Mobility<T>,
    follow: Follow<T>,
    clear: ClearTest<T>,
    freedom: Freedom,
    impact_rule: ImpactRule,
    /// Whether there is nothing to meet but teeth and pin, and contacts are located.
    rubs: bool,
    /// Sustained contacts over a whole step.
    pressing: Pressing<T>,
    step: T,
    step_s: f64,
}

/// Longest step within which contacts are located, in radians of the fastest mode.
const RESOLVED_RAD: f64 = 1.0;

impl<T: Real> TiltingMotor<T> {
    /// A motor of these parameters and this step.
    ///
    /// # Errors
    /// When the step is outside 1e-9 to 1e-3 s, a fixed drive frequency is outside 1 Hz to 1 MHz, mode A is damped
    /// beyond 0.99 of critical, or a value of the variation is not finite.
    pub fn try_new(
        params: &MotorParams,
        tilting: &TiltingParams,
        setup: &TiltingSetup,
    ) -> Result<Self, OutOfBounds> {
        let step_s = OutOfBounds::check("step_s", setup.step_s, 1e-9, 1e-3, "s")?;
        setup.tuning.check()?;
        setup.variation.check()?;
        let modes = Mode::all(params)?;
        let pair = stator_tilt_modes(params, tilting);
        let [per_a, per_b, per_c] = modes.each_ref().map(|mode| T::from_f64(1.0 / mode.mass_kg));
        let fastest_rad =
            modes.iter().chain(&pair).map(|mode| mode.natural_rad_s).fold(0.0, f64::max) * step_s;
        let [along_x, _] = &pair;
        let tilts = setup.freedom != Freedom::HeightOnly;
        let teeth = Tooth::all(params, tilting, setup);
        let hub = Hub::new(tilting, setup.variation.pin_direction_deg);
        let stops = if tilts { Stop::both(params, tilting) } else { [None, None] };
        let impact_rule = if fastest_rad > RESOLVED_RAD { ImpactRule::EndOfStep } else { setup.impact_rule };
        Ok(Self {
            rubs: impact_rule == ImpactRule::Located && tilts && stops.iter().all(Option::is_none),
            modes: ModalBank::new(&modes, setup.tuning, step_s),
            stator_tilt: StatorTiltFlight::new(&pair, step_s),
            flight: Flight::new(params, step_s),
            lean: LeanFlight::new(params, tilting, step_s),
            clear: ClearTest::new(params, tilting, setup, &teeth, fastest_rad),
            teeth,
            hub,
            stops,
            mobility: Mobility {
                rotor: RotorMobility::new(params, tilting, setup.freedom),
                modes: Vector3::new(per_a, per_b, per_c),
                stator_tilt: if tilts { T::from_f64(1.0 / along_x.mass_kg) } else { T::zero() },
            },
            follow: Follow::new(&modes, &pair, step_s),
            freedom: setup.freedom,
            impact_rule,
            pressing: Pressing::new(T::from_f64(step_s), T::from_f64(step_s)),
            step: T::from_f64(step_s),
            step_s,
        })
    }

    /// Length of a step in s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The four teeth.
    pub fn teeth(&self) -> &[Tooth<T>; 4] {
        &self.teeth
    }

    /// Gap at `place`, in m; `None` where there is nothing to meet.
    pub fn gap_m(&self, state: &TiltingState<T>, place: ContactPlace) -> Option<T> {
        self.gap_at(&state.motion(), place).map(|(gap_m, _)| gap_m)
    }

    /// Vertical velocity of the rotor's underside at the fixed point `(x_m, y_m)`, as a vibrometer sees it, in m/s.
    pub fn underside_velocity_m_s(&self, state: &TiltingState<T>, [x_m, y_m]: [T; 2]) -> T {
        let (shift, tilt) = (&state.shift, &state.tilt);
        let (x, y) = (x_m - shift.displacement_m.x, y_m - shift.displacement_m.y);
        state.rotor.velocity_m_s + tilt.rate_rad_s.x * x + tilt.rate_rad_s.y * y
            - tilt.slope.dot(&shift.velocity_m_s)
    }

    /// Advances `state` by one step under `command` and returns the contacts of that step.
    ///
    /// Cannot fail, allocates nothing and calls nothing transcendental. A command other than the last one takes
    /// effect at the start of the step.
    #[inline]
    pub fn step(&self, state: &mut TiltingState<T>, command: DriveCommand) -> TiltingContacts<T> {
        self.step_with(state, command, &mut NoTiltingLedger)
    }

    /// [`Self::step`], with what happens recorded in `ledger`.
    #[inline]
    pub fn step_with<L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        command: DriveCommand,
        ledger: &mut L,
    ) -> TiltingContacts<T> {
        if state.forcing.command() != command {
            state.forcing = self.modes.forcing(command);
        }
        if self.freedom == Freedom::Full {
            self.step_freely::<true, L>(state, ledger)
        } else {
            self.step_freely::<false, L>(state, ledger)
        }
    }

    /// A step with or without shifts.
    #[inline]
    fn step_freely<const SHIFTS: bool, L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        ledger: &mut L,
    ) -> TiltingContacts<T> {
        if state.in_contact.is_empty() {
            if self.step_far::<SHIFTS, L>(state, ledger) {
                return TiltingContacts::new();
            }
        } else if self.rubs
            && state.in_contact.is_at_pin()
            && let Some(at_pin) = &self.rub_at_pin::<SHIFTS, L>(state, ledger)
        {
            return at_pin.listed();
        }
        self.step_near::<SHIFTS, L>(state, ledger)
    }

    /// Takes a step in flight far from everything, if it is one. Most steps are.
    #[inline]
    fn step_far<const SHIFTS: bool, L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        ledger: &mut L,
    ) -> bool {
        let end = self.free_end::<SHIFTS>(state);
        let far = self.clear.is_far::<SHIFTS>(&end.place(), self.step);
        if far {
            ledger.motion(state, T::one());
            state.move_to(&end);
        }
        far
    }

    /// The end of a step without contact.
    #[expect(clippy::inline_always, reason = "a call would move the state through memory")]
    #[inline(always)]
    fn free_end<const SHIFTS: bool>(&self, state: &TiltingState<T>) -> TiltingMotion<T> {
        let mut end = state.motion();
        self.modes.advance(&mut end.modes, &state.forcing, state.phase);
        self.stator_tilt.step.advance(&mut end.stator_tilt);
        self.lean.step.advance::<SHIFTS>(&mut end.tilt, &mut end.shift, state.rotor.rate_rad_s);
        self.flight.advance(&mut end.rotor);
        end.phase = state.phase.advanced(state.forcing.increment());
        end
    }

    /// A step in which something may be met.
    #[inline(never)]
    fn step_near<const SHIFTS: bool, L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        ledger: &mut L,
    ) -> TiltingContacts<T> {
        let mut contacts = TiltingContacts::new();
        let mut end = self.free_end::<SHIFTS>(state);
        if state.in_contact.is_empty()
            && self.clear.is_sure::<SHIFTS>(&Place::of_state(state), &end.place(), self.step)
        {
            ledger.motion(state, T::one());
        } else if self.impact_rule == ImpactRule::Located {
            let start = state.motion();
            self.locate_contacts(&state.forcing, &start, &mut end, &mut contacts, ledger);
        } else {
            ledger.motion(state, T::one());
            self.contacts_at_end(&state.forcing, &mut end, &mut contacts, ledger);
        }
        state.move_to(&end);
        contacts
    }

    /// Gap and its rate at `place`; `None` where there is nothing to meet.
    #[inline]
    fn gap_at(&self, motion: &TiltingMotion<T>, place: ContactPlace) -> Option<(T, T)> {
        let [tooth_0, tooth_1, tooth_2, tooth_3] = &self.teeth;
        let at_tooth = |tooth: &Tooth<T>| Some((tooth.gap_m(motion), tooth.gap_rate_m_s(motion)));
        let at_stop = |stop: &Option<Stop<T>>| {
            stop.as_ref().map(|stop| (stop.gap_m(motion), stop.gap_rate_m_s(motion)))
        };
        let [rim, ceiling] = &self.stops;
        match place {
            ContactPlace::Tooth(0) => at_tooth(tooth_0),
            ContactPlace::Tooth(1) => at_tooth(tooth_1),
            ContactPlace::Tooth(2) => at_tooth(tooth_2),
            ContactPlace::Tooth(_) => at_tooth(tooth_3),
            ContactPlace::UpperEdge | ContactPlace::LowerEdge => {
                if self.freedom == Freedom::HeightOnly {
                    return None;
                }
                let edge = self.hub.edge(place, motion);
                Some((edge.gap_m, Hub::gap_rate_m_s(&edge, motion)))
            }
            ContactPlace::Rim => at_stop(rim),
            ContactPlace::Ceiling => at_stop(ceiling),
        }
    }

    /// The contact at `place`.
    fn contact_at(&self, motion: &TiltingMotion<T>, place: ContactPlace) -> Option<contact::Contact<T>> {
        let [tooth_0, tooth_1, tooth_2, tooth_3] = &self.teeth;
        let [rim, ceiling] = &self.stops;
        let at_stop = |stop: &Option<Stop<T>>| stop.as_ref().map(|stop| stop.contact(motion, &self.mobility));
        match place {
            ContactPlace::Tooth(0) => Some(tooth_0.contact(motion, &self.mobility)),
            ContactPlace::Tooth(1) => Some(tooth_1.contact(motion, &self.mobility)),
            ContactPlace::Tooth(2) => Some(tooth_2.contact(motion, &self.mobility)),
            ContactPlace::Tooth(_) => Some(tooth_3.contact(motion, &self.mobility)),
            ContactPlace::UpperEdge | ContactPlace::LowerEdge => {
                let edge = self.hub.edge(place, motion);
                Some(self.hub.contact(place, &edge, motion, &self.mobility))
            }
            ContactPlace::Rim => at_stop(rim),
            ContactPlace::Ceiling => at_stop(ceiling),
        }
    }
}
