//! Parametric modal model (PMM) of a magnetoelastic rotary micro-motor: the twin on the microcontroller in `f32`, the plant on the host
//! in `f64`.
//!
//! A ring-shaped silicon stator, driven by a coil at one of two resonances, vibrates out of plane and strikes a loose annular rotor from
//! below with four teeth, thousands of times a second. Each strike throws the rotor up and drags it round. Mode B (6.30 kHz) turns it
//! clockwise, mode C (7.46 kHz) counter-clockwise.
//!
//! Source of the equations and, unless said otherwise, of the numbers in brackets: Qu, Tang, Gianchandani, Oldham, Green, "Dynamic
//! modeling of a bidirectional magnetoelastic rotary micro-motor", Sensors and Actuators A 223 (2015) 49-60,
//! doi 10.1016/j.sna.2014.12.029.
//!
//! # In the order of the data
//!
//! - [`params`]: Table 1 as data; [`MotorParams`] is a checked set, [`MotorParams::draw`] another motor of the same make.
//! - [`DriveCommand`]: what the coil is told: mode, amplitude, frequency offset. [`Phase`]: its integer phase.
//! - [`modes`]: the stator's three oscillators, advanced exactly over a step with the drive included (7a-c).
//! - [`ToothPair`]: where two opposite pairs of teeth stand in the modes (4, 9a).
//! - [`ImpactLaw`]: restitution, recoil of the modes, friction (7a-c, 10-13c).
//! - [`Flight`]: the rotor between impacts, exact (14a, b). [`Angle`]: its angle as an integer.
//! - [`Motor`]: the whole, one [`Motor::step`] at a time, on a plain [`MotorState`].
//! - Less than the whole: [`Stator`], the stator without a rotor; [`AveragedMotor`], the mean rate and its wander.
//! - [`EnergyLedger`]: where every joule went, for those who ask.
//!
//! # Exact and not
//!
//! The linear parts - stator with its sinusoidal drive, rotor in flight - are exact for any step, drive frequency and
//! instant of switching. What a step gets wrong is *when an impact happens*, by one of two rules:
//!
//! - [`ImpactRule::Located`]: it happens where the gap closes, within 1e-10 m at 20 us; the state there is exact. Teeth that would strike again at
//!   once stay *pressed* on the rotor, with a normal force and friction, so a rotor comes to rest and walks on weakly driven teeth.
//! - [`ImpactRule::EndOfStep`], for comparison: it is noticed at the end of its step, as in the paper's program. Rates of rotation and of impacts
//!   converge with the first order of the step; mode B needs steps below 1 us.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. A step cannot fail or panic, takes bounded time and calls no transcendental function. The
//! same `f32` run gives the same bits on the host and on a Cortex-M. Time, phase and angle are integers. Chance is an argument
//! ([`AmplitudeVariation::draw`]); there is no clock.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | mode A, B, C | piston-like mode of the stator (only impacts excite it), first and second driven mode |
//! | antinode amplitude | largest amplitude of a mode round the ring |
//! | tooth pair | two opposite teeth; the two pairs move in antiphase in B and C |
//! | approach | speed at which a tooth gains on the rotor, `u' - v_z` |
//! | slip | tooth's tangential velocity less the rotor's at the tooth radius |
//! | recoil | drop of the modal velocities under an impact |
//! | forcing | what a drive command means for one motor and step |
//! | lift | putting a rotor found inside a tooth back on it |
//! | pressed | of a pair of teeth: in lasting contact with the rotor, pushing instead of striking |

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
        reason = "a test fails by panicking, and takes its yardsticks from another library"
    )
)]

mod angle;
mod averaged;
mod contact;
mod decay;
mod drag;
mod drive;
mod energy;
mod error;
mod impact;
pub mod math;
pub mod modes;
mod motor;
pub mod params;
mod phase;
mod rotor;
mod scatter;
mod stator;
mod teeth;
mod time;

pub use angle::{Angle, AngleAccumulator};
pub use averaged::{AveragedMotor, AveragedState, MeanMotion};
pub use drag::Dragged;
pub use drive::{DriveCommand, DriveMode};
pub use energy::{EnergyFlows, EnergyLedger, Ledger, NoLedger};
pub use error::OutOfBounds;
pub use impact::{FrictionLaw, Impact, ImpactLaw, Impulse};
pub use math::Real;
pub use modes::{DriveTuning, Forcing, ModalBank, ModalState, Mode};
pub use motor::{IMPACTS_PER_STEP_MAX, ImpactRule, Impacts, Motor, MotorSetup, MotorState};
pub use params::{MotorParams, Parameter};
pub use phase::{Phase, PhaseTable};
pub use rotor::{Flight, RotorJump, RotorState};
pub use stator::{Stator, StatorState};
pub use teeth::{AmplitudeVariation, ToothPair};
pub use time::Time;
