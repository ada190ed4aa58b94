//! Which key decides: Sobol's indices of variance.
//!
//! The first-order index of a key is the share of a figure's variance that the key makes alone, the total index the
//! share that it makes alone and together with the others. A base point `n` has two places, `a` and `b`, drawn
//! independently: the halves of one point of a Sobol sequence of twice as many dimensions. Besides these two the sweep
//! runs at `ab_i`, which is `a` with coordinate `i` of `b`: `d + 2` points for `d` keys (Saltelli and others, Computer
//! Physics Communications 181 (2010) 259-270, whose first-order estimator and Jansen's total one are used):
//!
//! ```text
//! S_i = mean( f(b) (f(ab_i) - f(a)) ) / V          T_i = mean( (f(a) - f(ab_i))^2 ) / (2 V)
//! ```
//!
//! `V` is the variance of all `f(a)` and `f(b)`, and the mean of these is taken off each `f` first. Intervals are of 95
//! %: quantiles over base points drawn again with replacement, [`DRAWN_AGAIN`] times. A base point with a run that
//! failed is left out whole.

use rand_distr::{Distribution as _, Uniform};
use serde::Serialize;
use serde_json::Value;

use simulation::math::count::real;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::quantile;

/// How often the base points are drawn again for the intervals.
pub const DRAWN_AGAIN: usize = 1000;

/// The figures at one base point: at `a`, at `b`, and at each `ab_i`.
#[derive(Clone, Debug, PartialEq)]
struct BasePoint {
    a: f64,
    b: f64,
    ab: Vec<f64>,
}

/// An index with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Index {
    /// The estimate.
    pub estimate: f64,
    /// The end of the interval below.
    pub low: f64,
    /// That above.
    pub high: f64,
}

/// The indices of a key for a figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KeyIndices {
    /// The figure, by its path.
    pub figure: String,
    /// The key.
    pub key: String,
    /// Share of the variance by the key alone.
    pub first: Index,
    /// Share by the key alone and together with the others.
    pub total: Index,
    /// Base points that were used.
    pub points: u64,
}

/// The figures of a sweep for indices, collected from its rows in their order.
pub(super) struct IndexSums {
    figures: Vec<String>,
    keys: Vec<String>,
    repeats: u64,
    seed: u64,
    /// The row that comes next, and how many there are.
    next: u64,
    rows: u64,
    /// Of each figure: the sums over repeats at the points of this base point, `None` where a run has failed.
    sums: Vec<Vec<Option<f64>>>,
    /// Of each figure: the base points that are whole.
    points: Vec<Vec<BasePoint>>,
}

impl IndexSums {
    /// Sums for the sweep that `described` is ([`super::SweepPlan::described`]); `None` if it is not for indices.
    pub(super) fn of(described: &Value) -> Option<Self> {
        described["sampling"]["indices"].as_u64()?;
        let texts = |list: &Value, of: fn(&Value) -> Option<&str>| -> Vec<String> {
            list.as_array().into_iter().flatten().filter_map(|value| of(value).map(str::to_owned)).collect()
        };
        let figures = texts(&described["figures"], Value::as_str);
        let keys = texts(&described["over"], |axis| axis["key"].as_str());
        let whole = |name: &str| described[name].as_u64();
        Some(Self {
            repeats: whole("repeats")?,
            seed: whole("seed")?,
            next: 0,
            rows: whole("rows")?,
            sums: vec![vec![Some(0.0); keys.len() + 2]; figures.len()],
            points: vec![Vec::new(); figures.len()],
            figures,
            keys,
        })
    }

    /// Adds the figures of the next row, whose number is `row`; of a part that does not begin with the first row,
    /// nothing is taken.
    pub(super) fn add(&mut self, row: u64, figures: &[Option<f64>]) {
        if row != self.next {
            return;
        }
        self.next += 1;
        let of_base = (self.keys.len() as u64 + 2) * self.repeats;
        let turn = usize::try_from(row % of_base / self.repeats).unwrap_or(0);
        let is_last = row % of_base == of_base - 1;
        for ((sums, points), figure) in self.sums.iter_mut().zip(&mut self.points).zip(figures) {
            sums[turn] = sums[turn].zip(*figure).map(|(sum, figure)| sum + figure);
            if is_last {
                if let Some(all) = sums.iter().copied().collect::<Option<Vec<f64>>>() {
                    let mean = |sum: f64| sum / real(self.repeats);
                    let (a, b) = (mean(all[0]), mean(all[1]));
                    points.push(BasePoint { a, b, ab: all[2..].iter().copied().map(mean).collect() });
                }
                sums.fill(Some(0.0));
            }
        }
    }

    /// The indices; none of a part of the rows.
    pub(super) fn indices(&self) -> Vec<KeyIndices> {
        if self.next != self.rows {
            return Vec::new();
        }
        let each = self.figures.iter().zip(&self.points);
        each.flat_map(|(figure, points)| indices(figure, &self.keys, points, self.seed)).collect()
    }
}

/// First-order and total index of each key.
fn estimates(points: &[&BasePoint], keys: usize) -> Vec<(f64, f64)> {
    let count = real(points.len());
    let both = || points.iter().flat_map(|point| [point.a, point.b]);
    let mean = both().sum::<f64>() / (2.0 * count);
    let variance = both().map(|f| (f - mean) * (f - mean)).sum::<f64>() / (2.0 * count);
    let of_key = |key: usize| {
        let first = |point: &&BasePoint| (point.b - mean) * (point.ab[key] - point.a);
        let total = |point: &&BasePoint| (point.a - point.ab[key]) * (point.a - point.ab[key]);
        let sum = |of: &dyn Fn(&&BasePoint) -> f64| points.iter().map(of).sum::<f64>() / count;
        (sum(&first) / variance, sum(&total) / (2.0 * variance))
    };
    (0..keys).map(of_key).collect()
}

/// The indices of `keys` for `figure`, from its values at the base points; `seed` names those that are drawn again.
/// Nothing for fewer than two base points, or a figure that does not vary.
fn indices(figure: &str, keys: &[String], points: &[BasePoint], seed: u64) -> Vec<KeyIndices> {
    let all: Vec<&BasePoint> = points.iter().collect();
    let found = estimates(&all, keys.len());
    let varies = found.iter().all(|(first, total)| first.is_finite() && total.is_finite());
    let Some(place) = Uniform::new(0, points.len()).ok().filter(|_| points.len() > 1 && varies) else {
        return Vec::new();
    };
    let mut random = stream(seed, RandomSource::SweepBootstrap);
    let drawn_again: Vec<Vec<(f64, f64)>> = (0..DRAWN_AGAIN)
        .map(|_| {
            let drawn: Vec<&BasePoint> = points.iter().map(|_| &points[place.sample(&mut random)]).collect();
            estimates(&drawn, keys.len())
        })
        .collect();
    let with_interval = |key: usize, of: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = drawn_again.iter().map(|all| of(&all[key])).collect();
        values.retain(|value| value.is_finite());
        let mut end = |per_mille| quantile(&mut values, per_mille).unwrap_or(f64::NAN);
        Index { estimate: of(&found[key]), low: end(25), high: end(975) }
    };
    let of_key = |(place, key): (usize, &String)| KeyIndices {
        figure: figure.to_owned(),
        key: key.clone(),
        first: with_interval(place, |(first, _)| *first),
        total: with_interval(place, |(_, total)| *total),
        points: points.len() as u64,
    };
    keys.iter().enumerate().map(of_key).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{FailureCounts, Sampling, SweepPlan, SweepRequest, SweepSummary, SweptCommand};
    use core::f64::consts::PI;
    use motor_model::math;
    use serde_json::json;
    use simulation::runs::RunError;
    use simulation::scene::Scene;

    const BASE: u64 = 1024;

    /// A sweep over three keys of 0 to 1 whose figure `f` is that of `of`.
    fn summary(sampling: Sampling, of: impl Fn([f64; 3]) -> Result<f64, RunError>) -> SweepSummary {
        repeated(1, sampling, of)
    }

    /// The same with so many runs of each point.
    fn repeated(
        repeats: u64,
        sampling: Sampling,
        of: impl Fn([f64; 3]) -> Result<f64, RunError>,
    ) -> SweepSummary {
        let keys = ["motor.friction", "motor.restitution", "simulate.amplitude"];
        let request = SweepRequest {
            command: SweptCommand::Simulate,
            sample: 1,
            over: keys.iter().map(|key| format!("{key}=0..1")).collect(),
            sampling,
            repeats,
            figures: vec!["f".to_owned()],
        };
        let plan = SweepPlan::new(&Scene::default(), request, |_, _| false, &|_| Ok(())).unwrap();
        let run = |scene: &Scene| Ok(json!({"f": of(keys.map(|key| scene.number(key)))?}));
        let described = plan.described();
        let mut sums = super::super::summary::SummarySums::new(&plan.columns(), &described);
        for number in 0..plan.rows() {
            sums.add(&plan.cells(&plan.make_with(number, run)));
        }
        sums.summary(std::path::PathBuf::new())
    }

    /// The function of Ishigami and Homma (1990), of three angles of -pi to pi.
    fn ishigami(places: [f64; 3]) -> f64 {
        let [x, y, z] = places.map(|place| PI * (2.0 * place - 1.0));
        let (sin_x, sin_y) = (math::sin_cos(x).0, math::sin_cos(y).0);
        sin_x + 7.0 * sin_y * sin_y + 0.1 * z * z * z * z * sin_x
    }

    /// Its indices in closed form: with a = 7, b = 0.1 the variance has the parts `(1 + b pi^4 / 5)^2 / 2` of x, `a^2 /
    /// 8` of y and `b^2 pi^8 (1/18 - 1/50)` of x and z together. Each is met within four standard deviations, as the
    /// interval tells them; with a thousand base points the intervals are narrower than 0.4.
    #[test]
    fn law_indices_are_those_of_a_closed_form() {
        let (a, b) = (7.0, 0.1);
        let [pi_4, pi_8] = [PI * PI * PI * PI, PI * PI * PI * PI * PI * PI * PI * PI];
        let of_x = 0.5 * (1.0 + b * pi_4 / 5.0) * (1.0 + b * pi_4 / 5.0);
        let of_y = a * a / 8.0;
        let of_both = b * b * pi_8 * (1.0 / 18.0 - 1.0 / 50.0);
        let all = of_x + of_y + of_both;
        let expected = [(of_x, of_x + of_both), (of_y, of_y), (0.0, of_both)];
        let found = summary(Sampling::Indices(BASE), |places| Ok(ishigami(places)));
        assert_eq!(found.rows, 5 * BASE);
        assert_eq!(found.indices.len(), 3);
        for (indices, (first, total)) in found.indices.iter().zip(expected) {
            for (index, expected) in [(indices.first, first / all), (indices.total, total / all)] {
                let width = index.high - index.low;
                let deviation = width / (2.0 * 1.96);
                assert!((0.0..0.4).contains(&width), "{indices:?}");
                assert!(
                    (index.estimate - expected).abs() <= 4.0 * deviation + 1e-12,
                    "{expected}: {indices:?}"
                );
            }
        }
        // y has no part with another key: both its indices measure the same share.
        let y = &found.indices[1];
        assert!((y.first.low..y.first.high).contains(&y.total.estimate), "{y:?}");
    }

    /// Runs of a point that give the same count as one.
    #[test]
    fn exact_repeats_of_a_point_are_averaged() {
        let one = summary(Sampling::Indices(16), |places| Ok(ishigami(places)));
        let two = repeated(2, Sampling::Indices(16), |places| Ok(ishigami(places)));
        assert_eq!((one.rows, two.rows), (80, 160));
        assert_eq!(two.indices, one.indices);
    }

    /// A run that fails costs its base point and no other; a sweep of another kind, and a figure that does not vary,
    /// have no indices.
    #[test]
    fn exact_base_points_with_a_failed_run_are_left_out() {
        let slow = |places: [f64; 3]| {
            let diverged = || RunError::Diverged { quantity: "f", time_s: 0.0 };
            if places[2] < 0.1 { Err(diverged()) } else { Ok(ishigami(places)) }
        };
        let found = summary(Sampling::Indices(64), slow);
        let FailureCounts { diverged, .. } = found.failures;
        assert!(diverged > 0 && found.indices[0].points < 64, "{found:?}");
        // A base point has two third coordinates: it is lost if either is below a tenth, 19 % of them.
        assert!((35..=62).contains(&found.indices[0].points), "{found:?}");
        assert!(summary(Sampling::Sobol(64), |places| Ok(ishigami(places))).indices.is_empty());
        assert!(summary(Sampling::Indices(8), |_| Ok(3.0)).indices.is_empty());
    }
}
