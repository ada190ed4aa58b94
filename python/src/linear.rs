//! The factorised core `P = U D U'` over an array of scalar measurements, for a linear problem of one to four states.
//!
//! ```text
//! x <- F x,   P <- F P F' + sum of g q g'        then, where there is a measurement z:  x, P by z = h'x + noise of R
//! ```

use nalgebra::{SMatrix, SVector};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ud_filter::{Dense, NoiseSource, Transition, UdCovariance, UpperTriangular};

use crate::errors::Error;
use crate::interruption::{Watch, interruptible};
use crate::tables::{Column, Table};

/// Measurements between two looks at the watch.
const MEASUREMENTS_PER_LOOK: usize = 4096;

/// A linear problem, matrices row by row.
#[derive(FromPyObject)]
pub struct Problem {
    transition: Vec<f64>,
    /// Gains of each noise source, one source after the other; at most as many sources as states.
    noise_gains: Vec<f64>,
    noise_variances: Vec<f64>,
    row: Vec<f64>,
    measured_variance: f64,
    state: Vec<f64>,
    covariance: Vec<f64>,
    /// A measurement is left out when its innovation squared exceeds this many times its variance.
    gate: f64,
}

/// What the filter gave, a row a measurement.
struct Filtered {
    states: Vec<f64>,
    covariances: Vec<f64>,
    innovations: Vec<f64>,
    variances: Vec<f64>,
    used: Vec<bool>,
}

fn filtered<const N: usize>(
    problem: &Problem,
    measurements: &[f64],
    watch: &Watch,
) -> Result<Filtered, Error> {
    let matrix = SMatrix::<f64, N, N>::from_row_slice(&problem.transition);
    let is_upper = (0..N).all(|row| (0..row).all(|column| matrix[(row, column)].abs() <= 0.0));
    if is_upper {
        filtered_by(&UpperTriangular(matrix), problem, measurements, watch)
    } else {
        filtered_by(&Dense(matrix), problem, measurements, watch)
    }
}

fn filtered_by<const N: usize>(
    transition: &impl Transition<f64, N>,
    problem: &Problem,
    measurements: &[f64],
    watch: &Watch,
) -> Result<Filtered, Error> {
    let refused = |error: &dyn std::fmt::Display| PyValueError::new_err(error.to_string());
    let row = SVector::<f64, N>::from_row_slice(&problem.row);
    let mut state = SVector::<f64, N>::from_row_slice(&problem.state);
    let prior = SMatrix::<f64, N, N>::from_row_slice(&problem.covariance);
    let mut covariance = UdCovariance::from_covariance(&prior).map_err(|error| refused(&error))?;
    let mut noise = [NoiseSource { gain: SVector::<f64, N>::zeros(), variance: 0.0 }; N];
    let sources = problem.noise_gains.chunks_exact(N).zip(&problem.noise_variances);
    for (place, (gain, variance)) in noise.iter_mut().zip(sources) {
        *place = NoiseSource { gain: SVector::from_row_slice(gain), variance: *variance };
    }
    let count = measurements.len();
    let mut found = Filtered {
        states: Vec::with_capacity(count * N),
        covariances: Vec::with_capacity(count * N * N),
        innovations: Vec::with_capacity(count),
        variances: Vec::with_capacity(count),
        used: Vec::with_capacity(count),
    };
    for some in measurements.chunks(MEASUREMENTS_PER_LOOK) {
        watch.check();
        for measured in some {
            state = transition.carry(&state);
            covariance.predict(transition, &noise).map_err(|error| refused(&error))?;
            let innovation = measured - row.dot(&state);
            let (mut variance, mut used) = (f64::NAN, false);
            if innovation.is_finite() {
                variance = covariance.innovation_variance(&row, problem.measured_variance);
                used = innovation * innovation <= problem.gate * variance;
            }
            if used {
                let updated = covariance.update(&row, problem.measured_variance, innovation, &mut state);
                updated.map_err(|error| refused(&error))?;
            }
            found.states.extend_from_slice(state.as_slice());
            found.covariances.extend_from_slice(covariance.covariance().as_slice());
            found.innovations.push(innovation);
            found.variances.push(variance);
            found.used.push(used);
        }
    }
    Ok(found)
}

#[pyfunction]
pub fn linear_filter<'py>(
    py: Python<'py>,
    problem: Problem,
    measurements: PyReadonlyArray1<'py, f64>,
) -> Result<Bound<'py, PyDict>, Error> {
    let measurements = measurements.as_slice().map_err(PyErr::from)?;
    let states = problem.state.len();
    let filter = match states {
        1 => filtered::<1>,
        2 => filtered::<2>,
        3 => filtered::<3>,
        4 => filtered::<4>,
        _ => return Err(PyValueError::new_err(format!("{states} states: 1 to 4 are possible")).into()),
    };
    let found = interruptible(py, None, |watch| filter(&problem, measurements, watch))?;
    let table = Table::default()
        .with("state", Column::Vectors(found.states, states))
        .with("covariance", Column::Matrices(found.covariances, states))
        .with("innovation", Column::Numbers(found.innovations))
        .with("innovation_variance", Column::Numbers(found.variances))
        .with("used", Column::Flags(found.used));
    Ok(table.into_dict(py)?)
}
