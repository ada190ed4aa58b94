//! Frames in the order of their exposures: gate, lag, rest, smoother.

pub(crate) mod smoother;
pub(crate) mod track;
pub(crate) mod track_covariance;
pub(crate) mod tracker;
