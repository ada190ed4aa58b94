//! The Python module `micromotor`: scenes, runs, filters, identification and logs of the micro-motor, from Rust.
//!
//! The module is thin: `micromotor._micromotor` has what computes, and `micromotor/` beside it the names, types and
//! documentation that a user sees. Arrays go in without a copy where they are contiguous `float64`, and go out without
//! one. Python's lock is released while anything computes.
//!
//! | module | what it is |
//! |---|---|
//! | [`scene`] | settings by their keys |
//! | [`runs`], [`course`], [`recorded`] | one motor, one run: the command's JSON, and its course |
//! | [`studies`] | many runs: trials, calibrations, identification |
//! | [`motor`] | the motor alone, for loops of one's own |
//! | [`own_loop`] | plant, instruments and filter around a controller in Python |
//! | [`own_measurements`] | arrays of one's own through a filter, or into a log |
//! | [`linear`] | the factorised Kalman filter core for linear problems |
//! | [`logs`] | logs as tables |
//! | [`tables`], [`drives`], [`errors`], [`interruption`] | arrays, drives as numbers, exceptions, long work |

#![allow(clippy::needless_pass_by_value, reason = "PyO3 gives arguments of a function by value")]

mod course;
mod drives;
mod errors;
mod interruption;
mod linear;
mod logs;
mod motor;
mod own_loop;
mod own_measurements;
mod recorded;
mod runs;
mod scene;
mod studies;
mod tables;

/// `micromotor._micromotor`.
#[pyo3::pymodule]
mod _micromotor {
    use pyo3::prelude::*;

    use crate::own_measurements::{REASONS, VERDICTS};

    #[pymodule_export]
    use crate::linear::linear_filter;
    #[pymodule_export]
    use crate::logs::read_log;
    #[pymodule_export]
    use crate::motor::{PyMotor, PyMotors};
    #[pymodule_export]
    use crate::own_loop::{PyEstimate, PyLoop, PyMoment};
    #[pymodule_export]
    use crate::own_measurements::{run_filter, write_recording};
    #[pymodule_export]
    use crate::runs::{plan, position, rate, record, simulate};
    #[pymodule_export]
    use crate::scene::PyScene;
    #[pymodule_export]
    use crate::studies::{calibrate, identify, trials};

    /// The names behind codes, which the enumerations of the front must have.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERDICTS", VERDICTS.map(|verdict| format!("{verdict:?}")).to_vec())?;
        let reason = |reason: Option<_>| reason.map_or_else(|| "None".to_owned(), |why| format!("{why:?}"));
        module.add("REASONS", REASONS.map(reason).to_vec())?;
        module.add("VERSION", env!("CARGO_PKG_VERSION"))
    }
}
