//! The filters, from the simplest to the motor's twin. All implement [`crate::AngleFilter`].
//!
//! | module | what drives the rate between frames |
//! |---|---|
//! | [`constant_rate`] | white noise that stands for all kicks |
//! | [`impact_aided`] | a kick of uncertain size at each impact that the vibrometer shows |
//! | [`twin`] | a kick computed by the motor's twin at each impact |

mod checkpoints;
pub(crate) mod constant_rate;
pub(crate) mod impact_aided;
mod kick;
mod kick_use;
pub(crate) mod kicks_kept;
mod mean_rate;
pub(crate) mod twin;
