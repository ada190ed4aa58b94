//! An array of any fixed length as it is written and read: a column of its elements.

use nalgebra::{SVector, Scalar};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(crate) fn serialize<E: Scalar + Copy + Serialize, S: Serializer, const N: usize>(
    array: &[E; N],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    SVector::from(*array).serialize(serializer)
}

pub(crate) fn deserialize<'de, E: Scalar + Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[E; N], D::Error> {
    let [array] = SVector::<E, N>::deserialize(deserializer)?.data.0;
    Ok(array)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::fmt::Debug;
    use std::string::ToString;

    use nalgebra::{Matrix1, Matrix2, Vector2};
    use serde::Serialize;
    use serde::de::DeserializeOwned;

    use crate::{
        Blocks, Blocks2, Dense, DiscreteModel, KalmanFilter, NoiseSource, SmootherStep, SparseRow,
        UdCovariance, UpperTriangular,
    };

    /// Writes and reads; returns the text.
    #[track_caller]
    fn again<V: Serialize + DeserializeOwned + PartialEq + Debug>(value: &V) -> std::string::String {
        let text = serde_json::to_string(value).unwrap();
        assert_eq!(serde_json::from_str::<V>(&text).unwrap(), *value);
        text
    }

    #[test]
    fn exact_models_and_steps_are_read_as_they_were_written() {
        let f = Matrix2::new(1.0, 0.1, 0.0, 1.0 / 3.0);
        again(&Dense(f));
        again(&UpperTriangular(f));
        again(&Blocks((f, Matrix1::new(0.1))));
        assert_eq!(
            again(&Blocks2([f, f.transpose()])),
            "[[1.0,0.0,0.1,0.3333333333333333],[1.0,0.1,0.0,0.3333333333333333]]"
        );
        let row = SparseRow::<f32, 1, 3, 2> { lead: [0.1, 0.2, 1.0 / 3.0], last: [4.0, -5.0] };
        assert_eq!(again(&row), r#"{"lead":[0.1,0.2,0.33333334],"last":[4.0,-5.0]}"#);
        let source = NoiseSource { gain: Vector2::new(0.1, 1.0), variance: 2.0 };
        let model = DiscreteModel::new(&f, &[source], 0.1).unwrap();
        again(&model);
        let filter = KalmanFilter::new(Vector2::new(0.1, 0.2), UdCovariance::from_diagonal(&source.gain));
        let step = SmootherStep { filter, transition: Dense(f), noise: [source; 3], predicted: filter.state };
        again(&step);
        again(&SmootherStep { filter, transition: Dense(f), noise: [], predicted: filter.state });
    }

    /// Too few elements, too many, and factors that are none within a step.
    #[test]
    fn law_what_has_another_length_is_not_read() {
        let read =
            |text| serde_json::from_str::<SparseRow<f64, 0, 2, 1>>(text).map_err(|error| error.to_string());
        assert!(read(r#"{"lead":[1.0,2.0],"last":[3.0]}"#).is_ok());
        assert!(read(r#"{"lead":[1.0],"last":[3.0]}"#).is_err());
        assert!(read(r#"{"lead":[1.0,2.0],"last":[3.0,4.0]}"#).is_err());
        let filter = KalmanFilter::new(Vector2::zeros(), UdCovariance::known());
        let f = Dense(Matrix2::<f64>::identity());
        let step = SmootherStep::<f64, _, 2, 0> { filter, transition: f, noise: [], predicted: filter.state };
        let bad = serde_json::to_string(&step)
            .unwrap()
            .replace(r#""weights":[0.0,0.0]"#, r#""weights":[0.0,-1.0]"#);
        let read = serde_json::from_str::<SmootherStep<f64, Dense<f64, 2>, 2, 0>>(&bad);
        assert!(read.unwrap_err().to_string().contains("variance of state 1"));
        assert!(serde_json::from_str::<Dense<f64, 3>>(&serde_json::to_string(&f).unwrap()).is_err());
    }
}
