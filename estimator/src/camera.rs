//! Frames in the order of their exposures.
//!
//! | module | what it does |
//! |---|---|
//! | [`tracker`] | which frames are used, and in which order: gate, lag of late frames, restart, stuck camera |
//! | [`rest_test`] | whether a quiet rotor has stopped |
//! | [`persistent_error`] | what neighbouring frames' errors have in common, by the residuals of the marks |
//! | [`innovation_correlation`] | whether neighbouring innovations have a common sign |
//! | [`noise`] | the noise of the frames, learnt |
//! | [`track_tuning`] | what is assumed of the camera, and the counts of frames that follow from its rate |
//! | [`process`] | how angle and rate change between frames |
//! | [`track`] | the two states, what a frame does to them, and rest |
//! | [`angle_rate_covariance`] | the factors of the covariance of angle and rate, written out |
//! | [`track_covariance`] | what tracker and track need of a filter's covariance |
//! | [`smoother`] | angle and rate at an earlier instant, from the frames after it as well |

pub(crate) mod angle_rate_covariance;
pub(crate) mod innovation_correlation;
pub(crate) mod noise;
pub(crate) mod persistent_error;
pub(crate) mod process;
pub(crate) mod rest_test;
pub(crate) mod smoother;
pub(crate) mod track;
pub(crate) mod track_covariance;
pub(crate) mod track_tuning;
pub(crate) mod tracker;
