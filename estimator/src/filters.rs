//! The filters, from the simplest to the motor's twin.

pub(crate) mod constant_rate;
pub(crate) mod impact_aided;
mod kick;
pub(crate) mod twin;
