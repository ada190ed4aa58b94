//! What each run gave to a key figure, so that two results of the same seeds can be compared run by run.

use serde::{Deserialize, Serialize};

/// How a figure follows from its runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Statistic {
    /// The mean of their values.
    Mean,
    /// The root of the mean of their squares.
    RootMeanSquare,
    /// What so many thousandths of them do not exceed.
    Quantile {
        /// Thousandths.
        per_mille: u16,
    },
    /// The share of those with value 1; the others have 0.
    Share,
}

/// The runs behind a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerRun {
    /// How the figure follows from them.
    pub statistic: Statistic,
    /// Their numbers: run k has the seed of the scene plus k, or a random stream of that number.
    pub numbers: Vec<u64>,
    /// The value of each; `null` of a run that has none.
    pub values: Vec<Option<f64>>,
}

impl PerRun {
    /// Runs that count from 0. A value that is not finite is none.
    pub(super) fn new(statistic: Statistic, values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
        let values: Vec<Option<f64>> = values.into_iter().map(finite).collect();
        Self { statistic, numbers: (0..values.len() as u64).collect(), values }
    }

    /// The values of the runs that have one here and in `other`; `None` if these are not the same runs.
    pub fn pairs(&self, other: &Self) -> Option<Vec<[f64; 2]>> {
        let same = self.statistic == other.statistic && self.numbers == other.numbers;
        let all = self.numbers.len();
        (same && self.values.len() == all && other.values.len() == all).then(|| {
            let pair = |(a, b): (&Option<f64>, &Option<f64>)| Some([(*a)?, (*b)?]);
            self.values.iter().zip(&other.values).filter_map(pair).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_pairs_are_of_the_same_runs() {
        let runs = |values: [Option<f64>; 3]| PerRun::new(Statistic::Mean, values);
        let a = runs([Some(1.0), Some(2.0), None]);
        let b = runs([Some(3.0), Some(f64::NAN), Some(5.0)]);
        assert_eq!(a.pairs(&b), Some(vec![[1.0, 3.0]]));
        let later = PerRun { numbers: vec![1, 2, 3], ..b.clone() };
        assert_eq!(a.pairs(&later), None);
        assert_eq!(a.pairs(&PerRun { statistic: Statistic::RootMeanSquare, ..b.clone() }), None);
        assert_eq!(a.pairs(&PerRun { values: vec![Some(1.0)], ..b }), None);
    }
}
