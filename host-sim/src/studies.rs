//! Many runs, then rows. A study is one folder: its plan, one function that runs one case, its conclusions, its
//! picture.

pub mod beside;
pub mod commissioning;
pub(crate) mod error_budget;
pub mod fault_campaign;
pub(crate) mod filter_costs;
pub mod filter_errors;
pub mod gyroscope_calibration;
pub mod held_rates;
pub mod identification;
pub mod instrument_grid;
pub(crate) mod latency;
pub mod open_loop;
pub(crate) mod paper;
pub mod positioning_trials;
pub mod response_map;
pub(crate) mod rotor_models;
pub mod shard;
pub mod stator;
pub(crate) mod step_accuracy;
pub(crate) mod study_report;
pub mod sweep;
