//! Samples of the vertical velocity: impacts, rest, and what moves the rotor.

pub(crate) mod impact_detector;
pub(crate) mod motion;
pub(crate) mod rest;
