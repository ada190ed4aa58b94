//! Other crates' filters on the problem of the core, each used as its documentation says. They are a program of their
//! own, because their dependencies are needed for nothing else.

use core::hint::black_box;

use adskalman::{
    CovarianceUpdateMethod, ObservationModel, StateAndCovariance, TransitionModelLinearNoControl,
};
use minikalman::buffers::types::{
    DirectProcessNoiseCovarianceMatrixBuffer, EstimateCovarianceMatrixBuffer,
    InnovationCovarianceMatrixBuffer, InnovationVectorBuffer, KalmanGainMatrixBuffer,
    MeasurementNoiseCovarianceMatrixBuffer, MeasurementVectorBuffer, ObservationMatrixMutBuffer,
    PredictedStateEstimateVectorBuffer, StateTransitionMatrixMutBuffer, StateVectorBuffer,
    TemporaryHPMatrixBuffer, TemporaryKHPMatrixBuffer, TemporaryPHTMatrixBuffer,
    TemporaryResidualCovarianceInvertedMatrixBuffer, TemporaryStateMatrixBuffer,
};
use minikalman::prelude::*;
use minikalman::regular::{RegularKalmanBuilder, RegularObservationBuilder};
use nalgebra::{Matrix1, Matrix2, RowVector2, U1, U2, Vector1, Vector2};

use super::filter_core::{Problem, counted};
use super::{Count, InstructionCounter, InstructionTimer};

/// adskalman: the covariance is a matrix.
struct Adskalman {
    f: Matrix2<f32>,
    f_transposed: Matrix2<f32>,
    q: Matrix2<f32>,
    h: RowVector2<f32>,
    h_transposed: Vector2<f32>,
    r: Matrix1<f32>,
    form: CovarianceUpdateMethod,
}

impl TransitionModelLinearNoControl<f32, U2> for Adskalman {
    fn F(&self) -> &Matrix2<f32> {
        &self.f
    }
    fn FT(&self) -> &Matrix2<f32> {
        &self.f_transposed
    }
    fn Q(&self) -> &Matrix2<f32> {
        &self.q
    }
}

impl ObservationModel<f32, U2, U1> for Adskalman {
    fn H(&self) -> &RowVector2<f32> {
        &self.h
    }
    fn HT(&self) -> &Vector2<f32> {
        &self.h_transposed
    }
    fn R(&self) -> &Matrix1<f32> {
        &self.r
    }
}

#[inline(never)]
fn step_adskalman(
    filter: &Adskalman,
    estimate: StateAndCovariance<f32, U2>,
    measured: f32,
) -> StateAndCovariance<f32, U2> {
    let prior = filter.predict(&estimate);
    filter.update(&prior, &Vector1::new(measured), filter.form).unwrap_or(estimate)
}

fn adskalman(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    operation: &'static str,
    problem: &Problem,
    form: CovarianceUpdateMethod,
) -> Count {
    let f = problem.transition();
    let h = RowVector2::new(1.0, 0.0);
    let filter = black_box(Adskalman {
        f,
        f_transposed: f.transpose(),
        q: problem.noise(),
        h,
        h_transposed: h.transpose(),
        r: Matrix1::new(problem.measured_variance),
        form,
    });
    let start = Matrix2::from_diagonal_element(problem.start_variance);
    let mut estimate = black_box(StateAndCovariance::new(Vector2::zeros(), start));
    counted(counter, operation, |measured| {
        estimate = black_box(step_adskalman(&filter, estimate.clone(), measured));
    })
}

/// minikalman: the covariance is a matrix, with the conventional update.
#[inline(never)]
fn step_minikalman(
    filter: &mut (impl KalmanFilterPredict<2, f32> + KalmanFilterUpdate<2, f32>),
    measurement: &mut (
             impl KalmanFilterObservationVectorMut<1, f32> + KalmanFilterObservationCorrectFilter<2, f32>
         ),
    measured: f32,
) {
    filter.predict();
    measurement.measurement_vector_mut().as_matrix_mut().set_at(0, 0, measured);
    filter.correct(measurement);
}

fn minikalman(counter: &InstructionCounter<'_, impl InstructionTimer>, problem: &Problem) -> Count {
    let (transition, noise, start) = (problem.transition(), problem.noise(), problem.start_variance);
    let by_rows = |m: &Matrix2<f32>| [m.m11, m.m12, m.m21, m.m22];
    let mut filter = RegularKalmanBuilder::new::<2, f32>(
        StateTransitionMatrixMutBuffer::from(by_rows(&transition)),
        StateVectorBuffer::from([0.0; 2]),
        EstimateCovarianceMatrixBuffer::from([start, 0.0, 0.0, start]),
        DirectProcessNoiseCovarianceMatrixBuffer::from(by_rows(&noise)),
        PredictedStateEstimateVectorBuffer::from([0.0; 2]),
        TemporaryStateMatrixBuffer::from([0.0; 4]),
    );
    let mut measurement = RegularObservationBuilder::new::<2, 1, f32>(
        ObservationMatrixMutBuffer::from([1.0, 0.0]),
        MeasurementVectorBuffer::from([0.0]),
        MeasurementNoiseCovarianceMatrixBuffer::from([problem.measured_variance]),
        InnovationVectorBuffer::from([0.0]),
        InnovationCovarianceMatrixBuffer::from([0.0]),
        KalmanGainMatrixBuffer::from([0.0; 2]),
        TemporaryResidualCovarianceInvertedMatrixBuffer::from([0.0]),
        TemporaryHPMatrixBuffer::from([0.0; 2]),
        TemporaryPHTMatrixBuffer::from([0.0; 2]),
        TemporaryKHPMatrixBuffer::from([0.0; 4]),
    );
    let count = counted(counter, "minikalman_2_predict_and_update", |measured| {
        let (filter, measurement) = (black_box(&mut filter), black_box(&mut measurement));
        step_minikalman(filter, measurement, measured);
    });
    black_box(filter.state_vector().get_row(0));
    count
}

/// Counts a prediction and a measurement of each filter.
pub fn count_peers(timer: &impl InstructionTimer, mut report: impl FnMut(Count)) {
    let counter = InstructionCounter::new(timer);
    let problem = Problem::constant_rate();
    report(minikalman(&counter, &problem));
    report(adskalman(
        &counter,
        "adskalman_joseph_2_predict_and_update",
        &problem,
        CovarianceUpdateMethod::JosephForm,
    ));
    report(adskalman(
        &counter,
        "adskalman_2_predict_and_update",
        &problem,
        CovarianceUpdateMethod::OptimalKalman,
    ));
}
