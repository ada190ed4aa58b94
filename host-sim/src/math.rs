//! Numbers only; nothing here knows a motor. What a run needs of them is in [`simulation::math`].
//!
//! | module | what it is |
//! |---|---|
//! | [`difference`] | whether two independent results differ beyond chance |
//! | [`paired_difference`] | whether two results of the same runs do |

pub(crate) mod difference;
pub(crate) mod paired_difference;
