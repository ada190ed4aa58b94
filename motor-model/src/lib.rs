#![doc = include_str!("../README.md")]
//!
//! # Tour, in the order of the data
//!
//! - [`params`]: Table 1 of the paper as data. [`MotorParams`] is a checked set of values; [`MotorParams::draw`]
//!   gives another motor of the same make.
//! - [`DriveCommand`]: mode, amplitude and frequency offset of the coil's current. [`Phase`]: its phase as an integer.
//! - [`modes`]: the stator's three oscillators, advanced exactly over a step with the drive included (7a-c).
//! - [`ToothPair`]: height and tangential motion of two pairs of opposite teeth (4, 9a).
//! - [`Flight`]: the rotor between impacts, exact (14a, b). [`Angle`]: its angle as an integer.
//! - [`ImpactLaw`]: restitution, recoil of the modes, friction (7a-c, 10-13c).
//! - [`Motor`]: all of these together, one [`Motor::step`] at a time, on a plain [`MotorState`], whose table lists
//!   the states.
//! - [`Ledger`]: receives what happens in a step. [`EnergyLedger`] records every flow of energy.
//! - [`TiltingMotor`]: the rotor also tilts and shifts on its pin, over four separate teeth, on a [`TiltingState`].
//!   [`TiltingParams`] are its parameters, [`TiltingEnergyLedger`] its account. [`Freedom`] leaves parts of it out.
//! - [`Stator`]: the stator without a rotor. [`AveragedMotor`]: mean rate and its random deviations, without teeth.
//!
//! # What is exact
//!
//! The linear parts - stator with its sinusoidal drive, rotor in flight - are exact for any step, drive frequency and
//! instant of switching. The error of a step is in the instant of an impact, which one of two rules gives:
//!
//! - [`ImpactRule::Located`]: the instant when the gap closes, to 1e-10 m at 20 us. Teeth whose rebound would be too
//!   short to resolve stay in *sustained contact* with the rotor, with a normal force and friction. So a rotor comes
//!   to rest, and weakly driven teeth turn it without impacts.
//! - [`ImpactRule::EndOfStep`], for comparison: the end of the step, as in the paper's program. Rates of rotation and
//!   of impacts converge with the first order of the step; mode B needs steps below 1 us.
//!
//! # Guarantees
//!
//! `no_std`, no allocation, no unsafe code. A step cannot fail or panic, takes bounded time and calls no
//! transcendental function. The same `f32` run gives the same bits on the host and on a Cortex-M. Time, phase and
//! angle are integers. Random numbers and time are arguments ([`AmplitudeVariation::draw`], [`AveragedMotor::step`]);
//! there is no clock.
//!
//! # Glossary
//!
//! | term | meaning |
//! |---|---|
//! | mode A, B, C | piston-like mode of the stator (only impacts excite it), first and second driven mode |
//! | antinode amplitude | largest amplitude of a mode round the ring |
//! | tooth pair | two opposite teeth; the two pairs move in antiphase in B and C |
//! | gap | height of the rotor above a tooth, `z - u` |
//! | impact | a contact event of a pair of teeth with the rotor, of no duration |
//! | impulse | size of an impact in N s, normal or tangential |
//! | jump | sudden change of a velocity at an impact |
//! | approach | speed at which the gap closes before an impact, `u' - v_z` |
//! | slip | tooth's tangential velocity less the rotor's at the tooth radius |
//! | recoil | change of the modal velocities by an impact, downward |
//! | rebound | flight after an impact, up to the next one of the same teeth |
//! | in flight | without contact |
//! | sustained contact | teeth that stay on the rotor and push it with a force instead of impacts |
//! | graze | contact without an approach speed |
//! | forcing | effect of a drive command on the modes of one motor with one step |
//! | lift | putting a rotor found inside a tooth back on it |
//! | ledger | receiver of what happens in a step |
//! | spread of a motor | tolerances of Table 1, from which [`MotorParams::draw`] draws |

#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::disallowed_methods,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a test fails by panicking and takes expected values from another library"
    )
)]

mod angle;
mod averaged;
mod contact;
mod decay;
mod drive;
mod energy;
mod error;
mod friction;
mod impact;
pub mod math;
pub mod modes;
mod motor;
pub mod params;
mod phase;
mod rotor;
mod stator;
mod teeth;
mod tilting;
mod time;

pub use angle::{Angle, AngleAccumulator};
pub use averaged::{AveragedMotor, AveragedState, MeanMotion};
pub use drive::{DriveCommand, DriveMode};
pub use energy::{EnergyFlows, EnergyLedger, Ledger, NoLedger};
pub use error::OutOfBounds;
pub use friction::SustainedFriction;
pub use impact::{FrictionLaw, Impact, ImpactLaw, Impulse};
pub use math::Real;
pub use modes::{DriveTuning, Forcing, ModalBank, ModalState, Mode};
pub use motor::{IMPACTS_PER_STEP_MAX, ImpactRule, Impacts, Motor, MotorSetup, MotorState};
pub use params::{MotorParams, Parameter, TiltingParameter, TiltingParams};
pub use phase::{Phase, PhaseTable};
pub use rotor::{Flight, RotorJump, RotorState};
pub use stator::{Stator, StatorState};
pub use teeth::{AmplitudeVariation, ToothPair};
pub use tilting::{
    CONTACTS_PER_STEP_MAX, ContactPlace, ContactPlaces, Freedom, NoTiltingLedger, ShiftState,
    StatorTiltState, TiltState, TiltingContact, TiltingContacts, TiltingEnergyFlows, TiltingEnergyLedger,
    TiltingLedger, TiltingMotor, TiltingSetup, TiltingState, TiltingVariation, Tooth,
};
pub use time::Time;
