//! What runs tell, in numbers: no files, no tables, no pictures. The command's studies ask, and show what is found.
//!
//! | module | what it finds |
//! |---|---|
//! | [`filter_errors`] | how far the filters are off the truth, beside genies that are told it |
//! | [`filter_costs`] | what the filters cost |
//! | [`step_accuracy`] | what a step of the fixed-step motor costs, and how far it is off an event-driven reference |
//! | [`averaged_motor`] | the averaged motor of a full one |
//! | [`identification`] | the parameters of a motor, from statistics of its recordings |
//! | [`response_map`] | what each drive does, of a sample of motors |
//! | [`gyroscope_fit`] | scale factor and bias of a gyroscope, with what else is unknown of it |
//! | [`least_squares`] | a curve through points, with the standard deviations of its parameters |
//!
//! All that takes long is here and in `simulation`, which are compiled with optimisation; the command is not.

pub mod averaged_motor;
pub mod filter_costs;
pub mod filter_errors;
pub mod gyroscope_fit;
pub mod identification;
pub mod least_squares;
pub mod response_map;
pub mod step_accuracy;
