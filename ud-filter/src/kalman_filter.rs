//! State and covariance together: a prediction moves both, a measurement corrects both.
//!
//! ```text
//! linear     x <- F x + B u,   P <- F P F' + Q       i = z - h'x
//! extended   x <- f(x),        P <- F P F' + Q       i = z - h(x),      F = df/dx, h' = dh/dx at the state before
//! ```
//!
//! The filter holds no model. F, B, Q, h and R are arguments, since in practice each may change from step to step.
//!
//! Sources: Kalman, "A new approach to linear filtering and prediction problems", Trans. ASME J. Basic Engineering 82
//! (1960) 35-45; Jazwinski, "Stochastic Processes and Filtering Theory" (1970), chapter 8, for the extended filter.

mod extended;

use nalgebra::{SMatrix, SVector};

use crate::prediction::PredictionRefusal;
use crate::real::{Real, is_finite, total};
use crate::transition::Transition;
use crate::ud_covariance::{
    Correction, InnovationRecord, NoiseSource, Refusal, UdCovariance, VectorInnovationRecord,
};

/// What a Kalman filter knows: the mean of the state, and its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: Real + serde::Serialize",
        deserialize = "T: Real + serde::Deserialize<'de>"
    ))
)]
pub struct KalmanFilter<T, const N: usize> {
    /// The mean of the state.
    pub state: SVector<T, N>,
    /// Its covariance.
    pub covariance: UdCovariance<T, N>,
}

impl<T: Real, const N: usize> KalmanFilter<T, N> {
    /// A prior: a state, and its covariance.
    #[inline]
    pub fn new(state: SVector<T, N>, covariance: UdCovariance<T, N>) -> Self {
        Self { state, covariance }
    }

    /// A step passes: `x <- F x`, `P <- F P F' + sum c a a'` over the noise sources.
    ///
    /// # Errors
    /// When F, a noise source or the state that follows is no usable number; nothing has changed then.
    #[inline]
    pub fn predict<F: Transition<T, N>, const S: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; S],
    ) -> Result<(), PredictionRefusal> {
        self.move_to(transition.carry(&self.state), transition, noise)
    }

    /// [`Self::predict`] with a control input: `x <- F x + B u`, where `input` is B and `control` is u, known exactly.
    /// A u that is not known exactly is a noise source as well, with the columns of B.
    ///
    /// # Errors
    /// As of [`Self::predict`]; a B or u that is no usable number is [`PredictionRefusal::State`].
    #[inline]
    pub fn predict_with_input<F: Transition<T, N>, const U: usize, const S: usize>(
        &mut self,
        transition: &F,
        input: &SMatrix<T, N, U>,
        control: &SVector<T, U>,
        noise: &[NoiseSource<T, N>; S],
    ) -> Result<(), PredictionRefusal> {
        self.move_to(transition.carry(&self.state) + input * control, transition, noise)
    }

    /// The state that follows, and the covariance by F.
    #[inline]
    fn move_to<F: Transition<T, N>, const S: usize>(
        &mut self,
        next: SVector<T, N>,
        transition: &F,
        noise: &[NoiseSource<T, N>; S],
    ) -> Result<(), PredictionRefusal> {
        let [entries] = &next.data.0;
        if !is_finite(total(entries)) {
            // The reason is F itself if it has no usable entries.
            let reason = PredictionRefusal::Transition;
            return Err(if transition.is_finite() { PredictionRefusal::State } else { reason });
        }
        self.covariance.predict(transition, noise)?;
        self.state = next;
        Ok(())
    }

    /// Corrects by a measurement `measured = h'x + noise`, where `row` is h and `noise` the variance, zero or more.
    ///
    /// # Errors
    /// When the measurement cannot be used; nothing has changed then.
    #[inline]
    pub fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        measured: T,
    ) -> Result<Correction<T, N>, Refusal> {
        let innovation = measured - row.dot(&self.state);
        self.covariance.update(row, noise, innovation, &mut self.state)
    }

    /// [`Self::update`] by a measurement of state `I` itself, `measured = x_I + noise`, in less work.
    ///
    /// # Errors
    /// As of [`Self::update`].
    #[inline]
    pub fn update_state<const I: usize>(
        &mut self,
        noise: T,
        measured: T,
    ) -> Result<Correction<T, N>, Refusal> {
        const { assert!(I < N, "no such state") };
        let innovation = measured - self.state.as_slice().get(I).copied().unwrap_or_default();
        self.covariance.update_state::<I>(noise, innovation, &mut self.state)
    }

    /// [`Self::update`] without a correction of the states that are `considered` (Schmidt), as
    /// [`UdCovariance::update_considering`].
    ///
    /// # Errors
    /// As of [`Self::update`].
    pub fn update_considering(
        &mut self,
        considered: &[bool; N],
        row: &SVector<T, N>,
        noise: T,
        measured: T,
    ) -> Result<Correction<T, N>, Refusal> {
        let innovation = measured - row.dot(&self.state);
        self.covariance.update_considering(considered, row, noise, innovation, &mut self.state)
    }

    /// [`Self::update`], unless the innovation squared exceeds `gate` times its variance. A gate of 9 is three standard
    /// deviations.
    #[inline]
    pub fn update_gated(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        measured: T,
        gate: T,
    ) -> InnovationRecord<T> {
        let innovation = measured - row.dot(&self.state);
        self.covariance.update_gated(row, noise, innovation, gate, &mut self.state)
    }

    /// Corrects by M measurements at once, `measured = H x + noise` of the covariance `noise`, as
    /// [`UdCovariance::update_vector`]. Returns the normalised innovation squared of all: M on average in a consistent
    /// filter.
    ///
    /// # Errors
    /// When one of the measurements cannot be used; nothing has changed then.
    pub fn update_vector<const M: usize>(
        &mut self,
        rows: &[SVector<T, N>; M],
        noise: &SMatrix<T, M, M>,
        measured: &SVector<T, M>,
    ) -> Result<T, Refusal> {
        let innovation = self.innovation(rows, measured);
        self.covariance.update_vector(rows, noise, &innovation, &mut self.state)
    }

    /// [`Self::update_vector`], unless the normalised innovation squared of all exceeds `gate`, as
    /// [`UdCovariance::update_vector_gated`].
    pub fn update_vector_gated<const M: usize>(
        &mut self,
        rows: &[SVector<T, N>; M],
        noise: &SMatrix<T, M, M>,
        measured: &SVector<T, M>,
        gate: T,
    ) -> VectorInnovationRecord<T, M> {
        let innovation = self.innovation(rows, measured);
        self.covariance.update_vector_gated(rows, noise, &innovation, gate, &mut self.state)
    }

    /// `z - H x`.
    fn innovation<const M: usize>(
        &self,
        rows: &[SVector<T, N>; M],
        measured: &SVector<T, M>,
    ) -> SVector<T, M> {
        let mut innovation = *measured;
        for (innovation, row) in innovation.iter_mut().zip(rows) {
            *innovation -= row.dot(&self.state);
        }
        innovation
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::{Dense, Outcome, UpperTriangular};

    type Filter = KalmanFilter<f64, 3>;

    fn filter(p: &[f64; 9], x: &[f64; 3]) -> (Matrix3<f64>, Filter) {
        let a = Matrix3::from_column_slice(p);
        let p = a * a.transpose() + Matrix3::identity() * 0.1;
        (p, Filter::new(Vector3::from(*x), UdCovariance::from_covariance(&p).unwrap()))
    }

    fn close(a: &Matrix3<f64>, b: &Matrix3<f64>) -> bool {
        (a - b).abs().max() < 1e-10 * (1.0 + b.abs().max())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The textbook's matrices, with an input and two measurements.
        #[test]
        fn dual_steps_equal_the_matrix_equations(
            p in prop::array::uniform9(-2.0..2.0_f64), f in prop::array::uniform9(-1.0..1.0_f64),
            b in prop::array::uniform6(-1.0..1.0_f64), x in prop::array::uniform3(-1.0..1.0_f64),
            u in prop::array::uniform2(-1.0..1.0_f64), z in prop::array::uniform2(-1.0..1.0_f64),
        ) {
            let (p, start) = filter(&p, &x);
            let (f, b, u) = (Matrix3::from_column_slice(&f), Matrix3x2::from_column_slice(&b), Vector2::from(u));
            let noise = [NoiseSource { gain: Vector3::new(0.1, -1.0, 0.5), variance: 0.3 }];
            let q = noise[0].gain * noise[0].gain.transpose() * 0.3;

            for f in [f, f.upper_triangle()] {
                let mut moved = start;
                moved.predict_with_input(&Dense(f), &b, &u, &noise).unwrap();
                prop_assert!((moved.state - (f * start.state + b * u)).abs().max() < 1e-14);
                prop_assert!(close(&moved.covariance.covariance(), &(f * p * f.transpose() + q)));
                let mut free = start;
                free.predict(&Dense(f), &noise).unwrap();
                prop_assert!((free.state + b * u - moved.state).abs().max() < 1e-14);
                prop_assert_eq!(free.covariance, moved.covariance);
            }
            let mut triangular = start;
            triangular.predict_with_input(&UpperTriangular(f), &b, &u, &noise).unwrap();
            let expected = f.upper_triangle() * start.state + b * u;
            prop_assert!((triangular.state - expected).abs().max() < 1e-14);

            let rows = [Vector3::new(1.0, 0.5, 0.0), Vector3::new(0.0, -1.0, 2.0)];
            let noise = Matrix2::new(0.5, 0.2, 0.2, 0.4);
            let h = SMatrix::<f64, 2, 3>::from_rows(&rows.map(|row| row.transpose()));
            let s = h * p * h.transpose() + noise;
            let gain = p * h.transpose() * s.try_inverse().unwrap();
            let mut seen = start;
            seen.update_vector(&rows, &noise, &Vector2::from(z)).unwrap();
            let expected = start.state + gain * (Vector2::from(z) - h * start.state);
            prop_assert!((seen.state - expected).abs().max() < 1e-10);
            prop_assert!(close(&seen.covariance.covariance(), &(p - gain * h * p)));

            let mut gated = start;
            let record = gated.update_vector_gated(&rows, &noise, &Vector2::from(z), f64::INFINITY);
            prop_assert_eq!(gated, seen);
            prop_assert_eq!(record.innovation, Vector2::from(z) - h * start.state);
            let record = gated.update_vector_gated(&rows, &noise, &Vector2::from(z), -1.0);
            prop_assert!(record.outcome == Outcome::OutsideGate && gated == seen);

            let (mut single, mut unit) = (start, start);
            let correction = single.update_state::<1>(0.5, z[0]).unwrap();
            let by_row = unit.update(&Vector3::y(), 0.5, z[0]).unwrap();
            prop_assert!((correction.gain - by_row.gain).abs().max() < 1e-12);
            prop_assert!((single.state - unit.state).abs().max() < 1e-12);
            prop_assert!(close(&single.covariance.covariance(), &unit.covariance.covariance()));
            let mut considering = start;
            let correction = considering.update_considering(&[false, true, false], &rows[0], 0.5, z[0]).unwrap();
            let expected = start.state + correction.gain * (z[0] - rows[0].dot(&start.state));
            prop_assert!((considering.state - expected).abs().max() < 1e-12);
            prop_assert_eq!(considering.state.y.to_bits(), start.state.y.to_bits());
            prop_assert!((considering.covariance.variance::<1>() / p[(1, 1)] - 1.0).abs() < 1e-10);

            let (mut one, mut gated) = (start, start);
            let correction = one.update(&rows[0], 0.5, z[0]).unwrap();
            let expected = start.state + correction.gain * (z[0] - rows[0].dot(&start.state));
            prop_assert!((one.state - expected).abs().max() < 1e-12);
            let record = gated.update_gated(&rows[0], 0.5, z[0], correction.normalised_squared);
            prop_assert_eq!(gated, one);
            prop_assert_eq!(record.innovation.to_bits(), (z[0] - rows[0].dot(&start.state)).to_bits());
        }
    }

    /// Each way in; state and covariance are then as they were.
    #[test]
    fn law_a_step_that_is_no_number_is_refused() {
        let start = filter(&[1.0, 0.2, 0.0, -0.3, 2.0, 0.1, 0.5, 0.4, 1.5], &[1.0, -2.0, 3.0]).1;
        let (f, b) = (Dense(Matrix3::identity()), Vector3::new(0.0, 1.0, 0.0));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut filter = start;
            let control = |u: f64| SVector::<f64, 1>::new(u);
            let refused = filter.predict_with_input(&f, &b, &control(bad), &[]);
            assert_eq!(refused, Err(PredictionRefusal::State));
            let refused = filter.predict_with_input(&f, &(b * bad), &control(1.0), &[]);
            assert_eq!(refused, Err(PredictionRefusal::State));
            let refused = filter.predict(&Dense(Matrix3::identity() * bad), &[]);
            assert_eq!(refused, Err(PredictionRefusal::Transition));
            let noise = NoiseSource { gain: b, variance: bad };
            assert_eq!(filter.predict(&f, &[noise]), Err(PredictionRefusal::Noise));
            assert_eq!(filter.update(&b, 1.0, bad), Err(Refusal::Innovation));
            assert_eq!(filter, start);
        }
    }
}
