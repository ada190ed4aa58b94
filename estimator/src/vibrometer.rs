//! Samples of the rotor's vertical velocity.
//!
//! | module | what it finds |
//! |---|---|
//! | [`calibration`] | bias and noise of the vibrometer, learnt at rest |
//! | [`impact_detector`] | impacts: jumps of the velocity in flight; faults of the vibrometer |
//! | [`next_impact`] | whether an impact can come before an instant ahead of the newest sample |
//! | [`rest`] | whether the rotor is quiet: the mean square of the velocity |
//! | [`motion`] | from both the drive and the vibrometer: driven in which mode, or quiet; the filter's clock |
//! | [`motion_history`] | the same piece by piece, over the time of a prediction |

pub(crate) mod calibration;
pub(crate) mod impact_detector;
pub(crate) mod motion;
pub(crate) mod motion_history;
pub(crate) mod next_impact;
pub(crate) mod rest;
