//! The truth and how it is measured: the plant, the instruments, what goes wrong with them. Nothing here sees an estimate.

pub mod faults;
pub mod instruments;
pub mod plant;
pub mod rig;
