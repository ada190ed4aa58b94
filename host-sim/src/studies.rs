//! Many runs, then rows. A study is one folder: what is asked, one function that runs one case, what is concluded, its picture.

pub(crate) mod averaged_motor;
mod error;
pub mod filter_costs;
pub mod filter_errors;
pub mod gyroscope_calibration;
pub(crate) mod paper;
pub mod positioning_trials;
pub mod rates;
pub mod response_map;
pub(crate) mod step_accuracy;

pub use error::StudyError;
