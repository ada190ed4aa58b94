//! Two results side by side, with what changed beyond noise: `host-sim compare`.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the comparison of the key figures |
//! | [`result_file`] | a result as `--format json` writes it |
//! | [`significance`] | the probability of a change of one figure by chance, and the test that gives it |
//! | [`values`] | every other value of two results |
//! | [`tables`], [`picture`] | what is shown of them |
//!
//! Results of the same seeds are compared run by run, others as independent. Holm's method keeps the chance of one
//! false alarm among all key figures at [`LEVEL`].

mod picture;
pub mod result_file;
mod significance;
mod tables;
mod values;

use serde::Serialize;

use super::key_figure::{Better, KeyFigure, Measured};
use crate::math::difference::holm;
use result_file::ResultFile;
use significance::{Significance, Test};
use values::ComparedValues;

/// Largest chance of one false alarm among all key figures.
pub const LEVEL: f64 = 0.05;

/// What is said of a key figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The same to the last bit.
    Equal,
    /// Not the same, by no more than chance allows.
    WithinNoise,
    /// Beyond noise, to the better side.
    Better,
    /// Beyond noise, to the worse side.
    Worse,
    /// Beyond noise; neither side is better.
    Changed,
    /// Not the same, and there is no measure of its chance.
    Differs,
    /// Not the same, and so few runs cannot tell.
    TooFewRuns,
}

/// A key figure of both results.
#[derive(Clone, Debug, Serialize)]
pub struct ComparedFigure {
    /// Of the first.
    pub a: KeyFigure,
    /// Of the second.
    pub b: KeyFigure,
    /// The second less the first; of counts, of their shares.
    pub change: f64,
    /// The same per the magnitude of the first; `null` where that is 0.
    pub relative_change: Option<f64>,
    /// How it was tested; `null` where it could not be.
    pub test: Option<Test>,
    /// Runs that were compared with each other one by one; `null` of a test of independent runs.
    pub pairs: Option<usize>,
    /// Probability of such a change by chance; `null` where it is not known.
    pub p: Option<f64>,
    /// The same after Holm's method.
    pub p_holm: Option<f64>,
    /// What is said of it.
    pub verdict: Verdict,
    /// Whether most runs changed to the other side than the figure did.
    #[serde(skip)]
    opposed: bool,
}

/// Two results side by side.
#[derive(Clone, Debug)]
pub struct Comparison {
    a: ResultFile,
    b: ResultFile,
    figures: Vec<ComparedFigure>,
    /// Key figures that only one of both has.
    lone_figures: Vec<String>,
    values: ComparedValues,
}

impl Comparison {
    /// Compares two results.
    pub fn of(a: ResultFile, b: ResultFile) -> Self {
        let same_seeds = a.has_seeds_of(&b);
        let mut figures: Vec<ComparedFigure> = (a.key_figures.iter())
            .filter_map(|of_a| {
                let of_b = b.key_figures.iter().find(|of_b| is_same(of_a, of_b))?;
                Some(ComparedFigure::new(of_a, of_b, same_seeds))
            })
            .collect();
        let tested: Vec<f64> = figures.iter().filter_map(|figure| figure.p).collect();
        let mut adjusted = holm(&tested).into_iter();
        for figure in &mut figures {
            figure.p_holm = figure.p.and_then(|_| adjusted.next());
            figure.verdict = figure.judged();
        }
        let missing = |of: &[KeyFigure], other: &[KeyFigure], file: &str| -> Vec<String> {
            let lone = of.iter().filter(|figure| !other.iter().any(|found| is_same(figure, found)));
            lone.map(|figure| format!("{} ({file})", full_name(figure))).collect()
        };
        let mut lone_figures = missing(&a.key_figures, &b.key_figures, "only in A");
        lone_figures.extend(missing(&b.key_figures, &a.key_figures, "only in B"));
        let values = ComparedValues::of(&a.rest, &b.rest);
        Self { a, b, figures, lone_figures, values }
    }

    /// Key figures that changed beyond noise, or that differ without a measure of their chance; where there are no key
    /// figures, the values that differ. Times of a machine are never counted.
    pub fn changes(&self) -> usize {
        if self.figures.is_empty() {
            return self.values.changed.len() + self.values.lone.len() + self.lone_figures.len();
        }
        self.figures.iter().filter(|figure| figure.verdict.is_change()).count()
    }

    /// Number of figures that were tested.
    fn tested(&self) -> usize {
        self.figures.iter().filter(|figure| figure.p.is_some()).count()
    }
}

fn is_same(a: &KeyFigure, b: &KeyFigure) -> bool {
    (&a.of, &a.name, &a.unit) == (&b.of, &b.name, &b.unit)
}

fn full_name(figure: &KeyFigure) -> String {
    if figure.of.is_empty() { figure.name.clone() } else { format!("{}: {}", figure.of, figure.name) }
}

impl Verdict {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Equal => "equal",
            Self::WithinNoise => "within noise",
            Self::Better => "better",
            Self::Worse => "worse",
            Self::Changed => "changed",
            Self::Differs => "differs",
            Self::TooFewRuns => "too few runs",
        }
    }

    /// Whether it is a change.
    pub const fn is_change(self) -> bool {
        matches!(self, Self::Better | Self::Worse | Self::Changed | Self::Differs)
    }
}

impl ComparedFigure {
    fn new(a: &KeyFigure, b: &KeyFigure, same_seeds: bool) -> Self {
        let [of_a, of_b] = [a, b].map(|figure| figure.measured.value());
        let change = of_b - of_a;
        let found = Significance::of(a, b, same_seeds);
        // The runs stand in the results.
        let [a, b] = [a, b].map(|figure| KeyFigure { per_run: None, ..figure.clone() });
        Self {
            a,
            b,
            change,
            relative_change: (of_a.abs() > 0.0).then(|| change / of_a.abs()),
            test: found.map(|found| found.test),
            pairs: found.and_then(|found| found.pairs),
            p: found.map(|found| found.p),
            p_holm: None,
            verdict: Verdict::Equal,
            opposed: found.and_then(|found| found.rise).is_some_and(|rise| rise * change < 0.0),
        }
    }

    /// What is said of it, after the probabilities are adjusted.
    fn judged(&self) -> Verdict {
        if self.a.measured == self.b.measured {
            return Verdict::Equal;
        }
        let single = |figure: &KeyFigure| matches!(figure.measured, Measured::Single { .. });
        match self.p_holm {
            None if single(&self.a) && single(&self.b) => Verdict::Differs,
            None => Verdict::TooFewRuns,
            Some(p) if p >= LEVEL => Verdict::WithinNoise,
            Some(_) if self.opposed => Verdict::Changed,
            Some(_) => match (self.b.better, self.change < 0.0) {
                (Better::Neither, _) => Verdict::Changed,
                (Better::Lower, true) | (Better::Higher, false) => Verdict::Better,
                (Better::Lower, false) | (Better::Higher, true) => Verdict::Worse,
            },
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::Verdict::{Better, Changed, Differs, Equal, TooFewRuns, WithinNoise, Worse};
    use super::*;

    pub(in super::super) fn result(key_figures: &[KeyFigure], rest: &str) -> ResultFile {
        let figures = serde_json::to_string(key_figures).unwrap();
        let text = format!(
            "{{\"command\":\"estimate\",\"version\":\"0.1.0\",\"scene\":{{\"seed\":7}},\
             \"key_figures\":{figures}{rest}}}"
        );
        ResultFile::parse(&text, std::path::Path::new("a.json")).unwrap()
    }

    fn verdicts_of(a: ResultFile, b: ResultFile) -> Vec<Verdict> {
        Comparison::of(a, b).figures.iter().map(|figure| figure.verdict).collect()
    }

    /// Of runs with other seeds.
    fn verdicts(a: &[KeyFigure], b: &[KeyFigure]) -> Vec<Verdict> {
        let mut other = result(b, "");
        other.scene.insert("seed".to_owned(), 8.into());
        verdicts_of(result(a, ""), other)
    }

    fn runs(offset: f64) -> Vec<f64> {
        (0..20).map(|run| offset + f64::from(run % 5)).collect()
    }

    /// Twenty runs with a standard error of 0.32: a change by 0.1 is noise, a change by 3 is none.
    #[test]
    fn exact_what_changed_and_to_which_side() {
        let mean = |name: &str, offset| KeyFigure::mean(name, "mdeg", runs(offset));
        let of = |offset| {
            [
                mean("lower", offset).lower_is_better(),
                mean("higher", offset).higher_is_better(),
                mean("neither", offset),
                KeyFigure::single("single", "", offset),
                KeyFigure::mean("few", "", [offset]),
            ]
        };
        assert_eq!(verdicts(&of(0.0), &of(0.0)), [Equal; 5]);
        let noise = [WithinNoise, WithinNoise, WithinNoise, Differs, TooFewRuns];
        assert_eq!(verdicts(&of(0.0), &of(0.1)), noise);
        assert_eq!(verdicts(&of(0.0), &of(3.0)), [Worse, Better, Changed, Differs, TooFewRuns]);
        assert_eq!(verdicts(&of(3.0), &of(0.0)), [Better, Worse, Changed, Differs, TooFewRuns]);
    }

    /// 10 failures of 100 after 1 have p = 0.0097 alone; beside nine others it takes ten times that.
    #[test]
    fn exact_many_comparisons_need_stronger_evidence() {
        let of_hundred =
            |count| KeyFigure::count("failed", (0..100).map(|run| run < count)).lower_is_better();
        assert_eq!(verdicts(&[of_hundred(1)], &[of_hundred(10)]), [Worse]);
        let many = |count| {
            let others = (0..9).map(|number| of_hundred(5).of(number.to_string()));
            std::iter::once(of_hundred(count)).chain(others).collect::<Vec<_>>()
        };
        assert_eq!(verdicts(&many(1), &many(10))[0], WithinNoise);
    }

    /// The same change of every run is noise where the runs have other seeds, and none where they have the same. A
    /// result beside itself has none.
    #[test]
    fn exact_runs_of_the_same_seeds_are_compared_in_pairs() {
        let of = |offset| [KeyFigure::quantile("error", "mdeg", runs(offset), 500).lower_is_better()];
        let paired = |a, b| verdicts_of(result(&of(a), ""), result(&of(b), ""));
        assert_eq!((paired(0.0, 0.1), verdicts(&of(0.0), &of(0.1))), (vec![Worse], vec![WithinNoise]));
        assert_eq!((paired(0.1, 0.0), paired(0.1, 0.1)), (vec![Better], vec![Equal]));
        let mut other = result(&of(0.1), "");
        other.command = "filters".to_owned();
        assert_eq!(verdicts_of(result(&of(0.0), ""), other), [WithinNoise]);
    }

    /// Of twenty runs four about the median fall, and with them the median; the others rise: neither side is better.
    #[test]
    fn exact_a_median_that_moves_against_most_runs_is_a_change_to_neither_side() {
        let of = |runs: Vec<f64>| [KeyFigure::quantile("error", "", runs, 500).lower_is_better()];
        let before: Vec<f64> = (1..=20).map(f64::from).collect();
        let rise = |run: usize| match run {
            1..=5 => 2.0,
            6..=7 => 0.5,
            8..=11 => -1.0,
            _ => 5.0,
        };
        let after: Vec<f64> = before.iter().zip(1..).map(|(error, run)| error + rise(run)).collect();
        let comparison = Comparison::of(result(&of(before), ""), result(&of(after), ""));
        assert!((comparison.figures[0].change + 1.0).abs() < 1e-12, "{:?}", comparison.figures[0]);
        assert_eq!(comparison.figures[0].verdict, Changed);
    }

    #[test]
    fn exact_changes_are_counted_of_key_figures_or_else_of_values() {
        let figure = [KeyFigure::mean("error", "", runs(0.0))];
        let compared = |a, b| Comparison::of(a, b).changes();
        assert_eq!(compared(result(&figure, ",\"x\":1"), result(&figure, ",\"x\":2")), 0);
        assert_eq!(compared(result(&[], ",\"x\":1"), result(&[], ",\"x\":2")), 1);
        assert_eq!(compared(result(&[], ",\"wall_s\":1"), result(&[], ",\"wall_s\":2")), 0);
    }
}
