//! The update with a gate, and its record.

use nalgebra::SVector;

use super::Refusal;
use crate::real::Real;
use crate::ud_covariance::UdCovariance;

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Outcome {
    /// State and covariance have been updated.
    Used,
    /// The normalised innovation squared exceeds the gate. State and covariance are as they were.
    OutsideGate,
    /// The measurement cannot be used at all. State and covariance are as they were.
    Refused(Refusal),
}

/// The record of a measurement, used or not: enough to judge a filter by its innovations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct InnovationRecord<T> {
    /// The measurement less its prediction.
    pub innovation: T,
    /// Its variance, `h'P h + R`.
    pub variance: T,
    /// Innovation squared over its variance (NIS): 1 on average in a consistent filter, before the gate.
    pub normalised_squared: T,
    /// What became of the measurement.
    pub outcome: Outcome,
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// [`Self::update`], unless the innovation squared exceeds `gate` times its variance. A gate of 9 is three standard
    /// deviations.
    pub fn update_gated(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        gate: T,
        state: &mut SVector<T, N>,
    ) -> InnovationRecord<T> {
        let projection = self.project(row, noise);
        let variance = projection.variance();
        let (normalised_squared, outcome) = match projection.judge(innovation) {
            Err(refusal) => (innovation / variance * innovation, Outcome::Refused(refusal)),
            Ok(judged) if judged.normalised_squared <= gate => {
                let b = self.sweep(&projection, None);
                (judged.correct(b, innovation, state).normalised_squared, Outcome::Used)
            }
            Ok(judged) => (judged.normalised_squared, Outcome::OutsideGate),
        };
        InnovationRecord { innovation, variance, normalised_squared, outcome }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To the bit what the update without a gate does, on either side of the gate, and for a measurement without noise.
    #[test]
    fn dual_a_gate_only_decides() {
        let start = UdCovariance::<f64, 4>::from_diagonal(&SVector::from([1.0, 2.0, 0.5, 3.0]));
        let row = SVector::from([1.0, -0.5, 0.0, 2.0]);
        for noise in [0.25, 0.0] {
            let (mut free, mut gated) = (start, start);
            let (mut x, mut y) = (SVector::zeros(), SVector::zeros());
            let correction = free.update(&row, noise, 3.0, &mut x).unwrap();
            let record = gated.update_gated(&row, noise, 3.0, correction.normalised_squared, &mut y);
            assert_eq!((free, x), (gated, y));
            assert_eq!(record.outcome, Outcome::Used);
            assert_eq!(record.variance.to_bits(), correction.variance.to_bits());
            assert_eq!(record.normalised_squared.to_bits(), correction.normalised_squared.to_bits());
            let (mut gated, mut y) = (start, SVector::zeros());
            let record = gated.update_gated(&row, noise, 3.0, 0.999 * correction.normalised_squared, &mut y);
            assert_eq!((gated, y), (start, SVector::zeros()));
            assert_eq!(record.outcome, Outcome::OutsideGate);
        }
        let (mut gated, mut y) = (start, SVector::zeros());
        for (innovation, gate, outcome) in
            [(f64::NAN, 9.0, Outcome::Refused(Refusal::Innovation)), (1.0, f64::NAN, Outcome::OutsideGate)]
        {
            let record = gated.update_gated(&row, 0.25, innovation, gate, &mut y);
            assert_eq!(record.outcome, outcome);
            assert_eq!((gated, y), (start, SVector::zeros()));
        }
    }
}
