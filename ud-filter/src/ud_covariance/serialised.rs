//! A covariance as it is written and read: its factors, which are checked when they are read.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{NotFactors, UdCovariance};
use crate::real::Real;

/// The factors of a covariance, by columns.
#[derive(Serialize, Deserialize)]
#[serde(
    rename = "UdCovariance",
    bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>")
)]
pub(super) struct Factors<T, const N: usize> {
    unit: SMatrix<T, N, N>,
    weights: SVector<T, N>,
}

impl<T: Real, const N: usize> From<UdCovariance<T, N>> for Factors<T, N> {
    fn from(covariance: UdCovariance<T, N>) -> Self {
        Self { unit: covariance.unit_factor(), weights: covariance.weights() }
    }
}

impl<T: Real, const N: usize> TryFrom<Factors<T, N>> for UdCovariance<T, N> {
    type Error = NotFactors;

    fn try_from(factors: Factors<T, N>) -> Result<Self, NotFactors> {
        Self::from_factors(&factors.unit, &factors.weights)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;
    use std::string::ToString;

    use nalgebra::Vector2;

    use crate::{InnovationRecord, KalmanFilter, NoiseSource, Outcome, Refusal, UdCovariance};

    type Covariance = UdCovariance<f32, 2>;

    #[test]
    fn exact_what_is_written_is_read_to_the_bit() {
        let p = nalgebra::Matrix2::new(0.1, 0.02, 0.02, 1.0 / 3.0);
        let covariance = Covariance::from_covariance(&p).unwrap();
        let filter = KalmanFilter::new(Vector2::new(0.1_f32, -2.0 / 3.0), covariance);
        let text = serde_json::to_string(&filter).unwrap();
        assert_eq!(serde_json::from_str::<KalmanFilter<f32, 2>>(&text).unwrap(), filter);
        let record = InnovationRecord {
            innovation: 0.1_f64,
            variance: 1.0 / 3.0,
            normalised_squared: 0.03,
            outcome: Outcome::Refused(Refusal::Certain),
        };
        let text = serde_json::to_string(&record).unwrap();
        assert_eq!(serde_json::from_str::<InnovationRecord<f64>>(&text).unwrap(), record);
        let source = NoiseSource { gain: Vector2::new(0.1, 1.0), variance: 2.0 };
        let text = serde_json::to_string(&source).unwrap();
        assert_eq!(serde_json::from_str::<NoiseSource<f64, 2>>(&text).unwrap(), source);
    }

    /// Each entry of each factor; U is written by columns.
    #[test]
    fn law_what_is_no_covariance_is_not_read() {
        let read = |unit: &str, weights: &str| {
            let text = format!(r#"{{"unit":{unit},"weights":{weights}}}"#);
            serde_json::from_str::<Covariance>(&text).map_err(|error| error.to_string())
        };
        let read_unit = |unit| read(unit, "[1.0,2.0]").unwrap_err();
        assert!(read("[1.0,0.0,0.5,1.0]", "[1.0,0.0]").is_ok());
        assert!(read_unit("[1.0,0.1,0.5,1.0]").contains("row 1, column 0"));
        assert!(read_unit("[0.9,0.0,0.5,1.0]").contains("row 0, column 0"));
        assert!(read_unit("[1.0,0.0,0.5,-1.0]").contains("row 1, column 1"));
        assert!(read_unit("[1.0,0.0,1e30,1.0]").contains("variance of state 0"));
        assert!(read("[1.0,0.0,0.5,1.0]", "[1.0,-2.0]").unwrap_err().contains("variance of state 1"));
        assert!(read("[1.0,0.0,0.5,1.0]", "[1.0]").is_err());
    }
}
