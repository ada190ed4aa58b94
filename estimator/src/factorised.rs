//! Covariances kept as their factors `P = U D U'`.

pub(crate) mod angle_rate;
pub(crate) mod transition;
pub(crate) mod ud_covariance;
