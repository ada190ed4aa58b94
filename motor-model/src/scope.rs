//! How much of the motor a model keeps: chosen by type, so that what is left out costs nothing.
//!
//! | scope | keeps | leaves out | error of leaving it out |
//! |---|---|---|---|
//! | [`WholeMotor`] | all | | |
//! | [`WithoutModeA`] | modes B and C | the stator giving way as a whole under each blow | mode B turns half as fast, mode C the other way: mode A matters |
//! | [`HeightOnly`] | rotor and teeth going up and down | friction, rate and angle | none in what it keeps: nothing tangential acts on the heights |
//! | [`OnePair`] | one pair of teeth | the other | a third to a half of the rate; for a bench, not for this motor |
//! | [`Bouncer`] | a mass over a plate that mode C shakes | the rest | none, for a bouncing ball |
//!
//! The stator without a rotor is [`crate::Stator`]. What each costs and errs is measured by `host-sim accuracy`. A scope of one's own is a type with five constants:
//!
//! ```
//! use motor_model::{Motor, MotorParams, MotorSetup, OutOfBounds, Scope};
//!
//! #[derive(Clone, Copy, Debug, Default)]
//! struct ModeCOnly;
//! impl Scope for ModeCOnly {
//!     const MODES: [bool; 3] = [false, false, true];
//! }
//! let motor = Motor::<f32, ModeCOnly>::try_new(&MotorParams::nominal(), &MotorSetup::with_step(10e-6))?;
//! # Ok::<(), OutOfBounds>(())
//! ```

use core::fmt::Debug;

use crate::error::OutOfBounds;
use crate::math::Real;
use crate::modes::Mode;
use crate::params::MotorParams;
use crate::teeth::{AmplitudeVariation, ToothPair};

/// What a model keeps of the motor; all of it where nothing is said.
pub trait Scope: Copy + Debug + Default + 'static {
    /// Whether modes A, B and C move. One that does not is rigid: it takes no part in height, recoil or drive.
    const MODES: [bool; 3] = [true; 3];
    /// Whether there is a second pair of teeth.
    const SECOND_PAIR: bool = true;
    /// Whether the rotor turns: friction, drag, rate and angle.
    const ROTATION: bool = true;
}

/// The modes of `params`' motor, those that `S` leaves out without drive.
pub(crate) fn modes<S: Scope>(params: &MotorParams) -> Result<[Mode; 3], OutOfBounds> {
    let [a, b, c] = Mode::all(params)?;
    let [moves_a, moves_b, moves_c] = S::MODES;
    let kept = |mode: Mode, moves| if moves { mode } else { Mode { antinode_amplitude_m: 0.0, ..mode } };
    Ok([kept(a, moves_a), kept(b, moves_b), kept(c, moves_c)])
}

/// Its teeth, blind to the modes that `S` leaves out.
pub(crate) fn teeth<T: Real, S: Scope>(
    params: &MotorParams,
    variation: &AmplitudeVariation,
) -> [ToothPair<T>; 2] {
    ToothPair::both_in(params, variation, S::MODES)
}

/// All of the motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WholeMotor;

impl Scope for WholeMotor {}

/// Modes B and C only: a stator that does not give way as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WithoutModeA;

impl Scope for WithoutModeA {
    const MODES: [bool; 3] = [false, true, true];
}

/// No tangential part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeightOnly;

impl Scope for HeightOnly {
    const ROTATION: bool = false;
}

/// A single pair of teeth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnePair;

impl Scope for OnePair {
    const SECOND_PAIR: bool = false;
}

/// A bouncing mass over one vibrating plate: mode C, one pair of teeth, no rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bouncer;

impl Scope for Bouncer {
    const MODES: [bool; 3] = [false, false, true];
    const SECOND_PAIR: bool = false;
    const ROTATION: bool = false;
}
