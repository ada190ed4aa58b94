//! The truth and how it is measured: the plant, the instruments, and the faults of both. Nothing here sees an estimate.

pub mod bare_stator;
pub mod body_turn;
pub mod coning;
pub mod event_clock;
pub mod faults;
pub mod instruments;
#[cfg(feature = "members")]
pub mod kept_stators;
pub mod plant;
pub mod pose;
pub mod rig;
pub mod rotor_path;
