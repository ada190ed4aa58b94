//! Key figures: the numbers by which a result is judged, each with what is known of its chance.
//!
//! A study lists its key figures once. Its report shows them with their intervals, its JSON has them under
//! `key_figures`, and `host-sim compare` sets those of two results side by side.
//!
//! Intervals are two-sided, 95 %:
//!
//! ```text
//! mean of n runs          m +- t s / sqrt n                 t: Student's of n - 1
//! root mean square        sqrt(q +- t s_q / sqrt n)         q, s_q: mean and deviation of the runs' squares
//! quantile p of n runs    the values between whose ranks binomial(n, p) lies (Conover 1999, section 3.2)
//! k of n runs             Wilson's score interval (Wilson 1927)
//! ```
//!
//! A figure of runs also has the value of each run ([`PerRun`]): two results of the same seeds are compared run by run.

mod per_run;

pub use per_run::{PerRun, Statistic};

use motor_model::math;
use serde::{Deserialize, Serialize};

use super::table::Table;
use simulation::math::count::real;
use simulation::math::statistics::{Spread, binomial_bounds, quantile, student_95, wilson_95};

/// A figure by which a result is judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyFigure {
    /// What it is of: a filter, a mode, a scene; empty for the whole.
    pub of: String,
    /// What it says.
    pub name: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// Which way is better.
    pub better: Better,
    /// Its value with its chance.
    #[serde(flatten)]
    pub measured: Measured,
    /// What each run gave; left out of a figure that is not of runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_run: Option<PerRun>,
}

/// Which way a figure is better.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    /// Errors, times.
    Lower,
    /// Successes.
    Higher,
    /// Neither: a property.
    #[default]
    Neither,
}

/// A value, and what is known of its chance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Measured {
    /// A mean over runs.
    Mean {
        /// The mean.
        value: f64,
        /// Sample standard deviation of the runs.
        sd: f64,
        /// Runs.
        runs: u64,
    },
    /// A value between the ends of its 95 % interval; an end is `null` where so few runs do not bound it.
    Interval {
        /// The value.
        value: f64,
        /// Lower end.
        low: Option<f64>,
        /// Upper end.
        high: Option<f64>,
        /// Runs.
        runs: u64,
    },
    /// So many of so many runs.
    Count {
        /// Those counted.
        value: u64,
        /// All.
        runs: u64,
    },
    /// One value: the same scene, seed and version give it again.
    Single {
        /// The value.
        value: f64,
    },
}

impl Measured {
    /// The value, of a count the share.
    pub fn value(self) -> f64 {
        match self {
            Self::Mean { value, .. } | Self::Interval { value, .. } | Self::Single { value } => value,
            Self::Count { value, runs } => real(value) / real(runs.max(1)),
        }
    }

    /// Number of runs behind it.
    pub fn runs(self) -> u64 {
        match self {
            Self::Mean { runs, .. } | Self::Interval { runs, .. } | Self::Count { runs, .. } => runs,
            Self::Single { .. } => 1,
        }
    }

    /// Both ends of its 95 % interval, as far as the runs bound it.
    pub fn interval_95(self) -> (Option<f64>, Option<f64>) {
        match self {
            Self::Mean { value, sd, runs } if runs > 1 => {
                let half = student_95(real(runs) - 1.0) * sd / math::sqrt(real(runs));
                (Some(value - half), Some(value + half))
            }
            Self::Interval { low, high, .. } => (low, high),
            Self::Count { value, runs } if runs > 0 => {
                let (low, high) = wilson_95(value, runs);
                (Some(low), Some(high))
            }
            _ => (None, None),
        }
    }

    fn is_finite(self) -> bool {
        let spread = if let Self::Mean { sd, .. } = self { sd } else { 0.0 };
        self.value().is_finite() && spread.is_finite()
    }
}

impl KeyFigure {
    fn new(name: &str, unit: &str, measured: Measured) -> Self {
        let (of, better) = (String::new(), Better::Neither);
        Self { of, name: name.to_owned(), unit: unit.to_owned(), better, measured, per_run: None }
    }

    fn with_runs(self, statistic: Statistic, runs: impl IntoIterator<Item = Option<f64>>) -> Self {
        Self { per_run: Some(PerRun::new(statistic, runs)), ..self }
    }

    /// The mean of a value of each run.
    pub fn mean(name: &str, unit: &str, runs: impl IntoIterator<Item = f64>) -> Self {
        let runs: Vec<f64> = runs.into_iter().collect();
        let Spread { mean, sd } = runs.iter().copied().collect();
        let measured = Measured::Mean { value: mean, sd, runs: runs.len() as u64 };
        Self::new(name, unit, measured).with_runs(Statistic::Mean, runs.into_iter().map(Some))
    }

    /// The root of the mean square of a value of each run that has one, or of a root mean square of each run.
    pub fn root_mean_square<V: Into<Option<f64>>>(
        name: &str,
        unit: &str,
        runs: impl IntoIterator<Item = V>,
    ) -> Self {
        let runs: Vec<Option<f64>> = runs.into_iter().map(Into::into).collect();
        let count = runs.iter().flatten().count() as u64;
        let Spread { mean, sd } = runs.iter().flatten().map(|value| value * value).collect();
        let half = student_95(real(count) - 1.0) * sd / math::sqrt(real(count));
        let end = |square: f64| (count > 1).then(|| math::sqrt(square.max(0.0)));
        let (low, high) = (end(mean - half), end(mean + half));
        let measured = Measured::Interval { value: math::sqrt(mean), low, high, runs: count };
        Self::new(name, unit, measured).with_runs(Statistic::RootMeanSquare, runs)
    }

    /// What so many thousandths of the runs that have a value do not exceed. Where there is none it is not a number.
    pub fn quantile<V: Into<Option<f64>>>(
        name: &str,
        unit: &str,
        runs: impl IntoIterator<Item = V>,
        per_mille: u16,
    ) -> Self {
        let runs: Vec<Option<f64>> = runs.into_iter().map(Into::into).collect();
        let mut values: Vec<f64> = runs.iter().copied().flatten().collect();
        let count = u32::try_from(values.len()).unwrap_or(u32::MAX);
        let value = quantile(&mut values, per_mille.into()).unwrap_or(f64::NAN);
        values.sort_by(f64::total_cmp);
        let (below, above) = binomial_bounds(count, 1e-3 * f64::from(per_mille));
        // The quantile is at least the value of rank `below`, and less than that of rank `above + 1`, from 1.
        let low = (below as usize).checked_sub(1).and_then(|place| values.get(place));
        let high = values.get(above as usize);
        let measured =
            Measured::Interval { value, low: low.copied(), high: high.copied(), runs: count.into() };
        Self::new(name, unit, measured).with_runs(Statistic::Quantile { per_mille }, runs)
    }

    /// The runs of which something holds.
    pub fn count(name: &str, runs: impl IntoIterator<Item = bool>) -> Self {
        let runs: Vec<bool> = runs.into_iter().collect();
        let value = runs.iter().filter(|holds| **holds).count() as u64;
        let measured = Measured::Count { value, runs: runs.len() as u64 };
        let values = runs.into_iter().map(|holds| Some(f64::from(u8::from(holds))));
        Self::new(name, "", measured).with_runs(Statistic::Share, values)
    }

    /// One value without a measure of its chance.
    pub fn single(name: &str, unit: &str, value: f64) -> Self {
        Self::new(name, unit, Measured::Single { value })
    }

    /// The same of runs with these numbers, counted from the scene's seed; without them they count from 0.
    #[must_use]
    pub fn of_runs(self, numbers: impl IntoIterator<Item = u64>) -> Self {
        let per_run = self.per_run.map(|runs| PerRun { numbers: numbers.into_iter().collect(), ..runs });
        Self { per_run, ..self }
    }

    /// The same of something.
    #[must_use]
    pub fn of(self, of: impl Into<String>) -> Self {
        Self { of: of.into(), ..self }
    }

    /// The same of something on the scene of that name, which stands beside the first.
    #[must_use]
    pub fn beside(self, scene: &str) -> Self {
        let of = if self.of.is_empty() { scene.to_owned() } else { format!("{scene}: {}", self.of) };
        Self { of, ..self }
    }

    /// The same, better the lower it is.
    #[must_use]
    pub fn lower_is_better(self) -> Self {
        Self { better: Better::Lower, ..self }
    }

    /// The same, better the higher it is.
    #[must_use]
    pub fn higher_is_better(self) -> Self {
        Self { better: Better::Higher, ..self }
    }

    /// Whether it has a value: JSON knows no other.
    pub fn has_value(&self) -> bool {
        self.measured.is_finite()
    }

    /// Its value in words, of a count with its runs.
    pub fn value_text(&self) -> String {
        match self.measured {
            Measured::Count { value, runs } => format!("{value} of {runs}"),
            other => self.text_of(other.value()),
        }
    }

    /// The unit of its interval: of a count percent.
    pub fn shown_unit(&self) -> &str {
        if matches!(self.measured, Measured::Count { .. }) { "%" } else { &self.unit }
    }

    /// A value of it in words, with its unit.
    pub fn text_of(&self, value: f64) -> String {
        format!("{} {}", self.number_text(value), self.shown_unit()).trim_end().to_owned()
    }

    /// The same without unit.
    pub fn number_text(&self, value: f64) -> String {
        let is_count = matches!(self.measured, Measured::Count { .. });
        significant(if is_count { 100.0 * value } else { value })
    }

    /// Its interval in words, without unit; `None` where the runs do not bound it.
    pub fn bare_interval_text(&self) -> Option<String> {
        match self.measured.interval_95() {
            (None, None) => None,
            (Some(low), Some(high)) => {
                Some(format!("{} to {}", self.number_text(low), self.number_text(high)))
            }
            (Some(low), None) => Some(format!("more than {}", self.number_text(low))),
            (None, Some(high)) => Some(format!("less than {}", self.number_text(high))),
        }
    }

    /// Its interval in words, with its unit; a dash where the runs do not bound it.
    pub fn interval_text(&self) -> String {
        let with_unit = |text: String| format!("{text} {}", self.shown_unit()).trim_end().to_owned();
        self.bare_interval_text().map_or_else(|| "-".to_owned(), with_unit)
    }
}

/// A number to four significant digits.
pub fn significant(value: f64) -> String {
    if value.abs() < f64::MIN_POSITIVE {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.3e}");
    }
    let mut size = value.abs();
    let mut decimals = 0;
    while decimals < 6 && size < 999.95 {
        (size, decimals) = (10.0 * size, decimals + 1);
    }
    format!("{value:.decimals$}")
}

/// The key figures as a table; `None` where there is none.
pub(crate) fn table(figures: &[KeyFigure]) -> Option<Table> {
    let shown: Vec<&KeyFigure> = figures.iter().filter(|figure| figure.has_value()).collect();
    if shown.is_empty() {
        return None;
    }
    let mut table = Table::new(&["figure", "of", "value", "95 % interval", "runs"]);
    for figure in &shown {
        let runs = figure.measured.runs().to_string();
        table.push(vec![
            figure.name.clone(),
            figure.of.clone(),
            figure.value_text(),
            figure.interval_text(),
            runs,
        ]);
    }
    Some(if shown.iter().all(|figure| figure.of.is_empty()) { table.without("of") } else { table })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four runs of 1, 2, 3, 4: mean 2.5, deviation 1.291, t = 3.182.
    #[test]
    fn exact_interval_of_a_mean() {
        let figure = KeyFigure::mean("rate", "rad/s", [1.0, 2.0, 3.0, 4.0]);
        let (low, high) = figure.measured.interval_95();
        let half = 3.182_446 * math::sqrt(5.0 / 3.0) / 2.0;
        assert!((low.unwrap() - 2.5 + half).abs() < 1e-5 && (high.unwrap() - 2.5 - half).abs() < 1e-5);
        assert_eq!(KeyFigure::mean("rate", "", [1.0]).measured.interval_95(), (None, None));
    }

    /// Of 3 and 4 the mean square is 12.5.
    #[test]
    fn exact_root_mean_square() {
        let figure = KeyFigure::root_mean_square("error", "mdeg", [3.0, -4.0]);
        assert!((figure.measured.value() - math::sqrt(12.5)).abs() < 1e-12);
        let (low, high) = figure.measured.interval_95();
        // t = 12.71 and a deviation of 4.95: the lower end is at 0.
        let half = 12.706_2 * math::sqrt(24.5) / math::sqrt(2.0);
        assert!(low.unwrap().abs() <= 0.0 && (high.unwrap() - math::sqrt(12.5 + half)).abs() < 1e-4);
    }

    /// The median of 20 lies between the 6th and the 15th value (Conover 1999, table A3); 20 do not bound 99.9 %.
    #[test]
    fn exact_interval_of_a_quantile() {
        let runs = || (1..=20).map(f64::from);
        let median = KeyFigure::quantile("error", "", runs(), 500).measured;
        assert_eq!((median.value(), median.interval_95()), (10.0, (Some(6.0), Some(15.0))));
        let extreme = KeyFigure::quantile("error", "", runs(), 999);
        assert_eq!(extreme.measured.interval_95(), (Some(20.0), None));
        assert_eq!(extreme.interval_text(), "more than 20.00");
        assert!(!KeyFigure::quantile("error", "", [None], 500).has_value());
    }

    #[test]
    fn exact_words_and_json() {
        let figure = KeyFigure::count("failed", [true, false, true]).of("controller").lower_is_better();
        assert_eq!(figure.value_text(), "2 of 3");
        let text = serde_json::to_string(&figure).unwrap();
        assert_eq!(
            text,
            "{\"of\":\"controller\",\"name\":\"failed\",\"unit\":\"\",\"better\":\"lower\",\"kind\":\"count\",\
             \"value\":2,\"runs\":3,\"per_run\":{\"statistic\":\"share\",\"numbers\":[0,1,2],\
             \"values\":[1.0,0.0,1.0]}}"
        );
        assert_eq!(serde_json::from_str::<KeyFigure>(&text).unwrap(), figure);
        let shown = [0.0, 0.4999, 12.3456, -1234.56, 999_949.0, 1.5e-5, 2e7].map(significant);
        assert_eq!(shown, ["0", "0.4999", "12.35", "-1235", "999949", "1.500e-5", "2.000e7"]);
    }
}
