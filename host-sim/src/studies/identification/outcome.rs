//! What was identified, in numbers and in words, and as a scene.

use std::fmt::Write as _;

use motor_model::math;
use serde::Serialize;

use crate::report::document::{Block, Document, Table};
use analysis::identification::candidates::Advice;
use analysis::identification::emulator::TOLD;
use analysis::identification::parameters::{Prior, Unknown};
use simulation::math::plain_number::plain;
use simulation::math::statistics::{Spread, quantile, upper_quantile};

/// Thousandths of the sample that lie below the ends of the 90 % interval.
const EDGES: [usize; 2] = [50, 950];

/// A parameter, and what the recordings tell of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifiedParameter {
    /// Key of the design.
    pub key: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// What is known before the recordings.
    #[serde(skip)]
    pub prior: Prior,
    /// Mean before the recordings.
    pub prior_mean: f64,
    /// Standard deviation before the recordings.
    pub prior_sd: f64,
    /// Whether the recordings tell it.
    pub told: bool,
    /// Expected standard deviation after recordings like these per that before.
    pub expected_ratio: f64,
    /// Mean after the recordings; none of a parameter that is not told.
    pub mean: Option<f64>,
    /// Standard deviation after the recordings; none of a parameter that is not told.
    pub sd: Option<f64>,
    /// The 90 % interval; none of a parameter that is not told: then it is infinite.
    pub interval: Option<[f64; 2]>,
    /// The recording that would tell a parameter that is not told, if one of the list would.
    pub further_recording: Option<&'static str>,
    /// How it is made.
    pub further_command: Option<String>,
    /// Expected standard deviation with it beside these per that before.
    pub further_ratio: Option<f64>,
    /// The same as a sentence.
    pub advice: Option<String>,
}

impl IdentifiedParameter {
    /// Of a sample of its values, if the recordings tell it, and of what would tell it.
    pub(super) fn new(
        unknown: &Unknown,
        expected_ratio: f64,
        sample: Option<&[f64]>,
        advice: Option<Advice>,
    ) -> Self {
        let spread: Option<Spread> = sample.map(|sample| sample.iter().copied().collect());
        let advice = advice.filter(|_| sample.is_none());
        Self {
            key: unknown.key,
            unit: unknown.unit,
            meaning: unknown.meaning,
            prior: unknown.prior,
            prior_mean: unknown.prior.mean(),
            prior_sd: unknown.prior.sd(),
            told: sample.is_some(),
            expected_ratio,
            mean: spread.map(|spread| spread.mean),
            sd: spread.map(|spread| spread.sd),
            interval: sample.and_then(interval),
            further_recording: advice.as_ref().map(|advice| advice.recording),
            further_command: advice.as_ref().map(|advice| advice.command.clone()),
            further_ratio: advice.as_ref().map(|advice| advice.expected),
            advice: if sample.is_some() { None } else { Some(sentence(unknown.key, advice.as_ref())) },
        }
    }
}

/// The 90 % interval of a sample; `None` of an empty one.
pub(super) fn interval(sample: &[f64]) -> Option<[f64; 2]> {
    let [mut below, mut above] = [sample.to_vec(), sample.to_vec()];
    Some([quantile(&mut below, EDGES[0])?, upper_quantile(&mut above, EDGES[1])?])
}

/// What would tell the parameter `key`.
fn sentence(key: &str, advice: Option<&Advice>) -> String {
    match advice {
        Some(Advice { recording, command, expected }) => format!(
            "{key} is not told by these recordings. With {recording} beside them (`{command}`) {:.0} % of the standard \
             deviation before would be left.",
            100.0 * expected
        ),
        None => format!("{key} is not told by these recordings."),
    }
}

/// A statistic as it was measured, and as motors of the posterior show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredStatistic {
    /// Which part of the recordings, and what.
    pub name: String,
    /// As measured.
    pub measured: f64,
    /// Mean of motors of the posterior.
    pub predicted: f64,
    /// Their standard deviation.
    pub sd: f64,
}

impl MeasuredStatistic {
    /// Measured less predicted, in standard deviations.
    pub fn deviation(&self) -> f64 {
        if self.sd > 0.0 { (self.measured - self.predicted) / self.sd } else { 0.0 }
    }
}

/// What was identified.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identification {
    /// The logs.
    pub logs: Vec<String>,
    /// Where logs are damaged: they are read up to there.
    pub damage: Vec<String>,
    /// The rotor's model.
    pub rotor: &'static str,
    /// Every parameter of which anything is unknown.
    pub parameters: Vec<IdentifiedParameter>,
    /// Every statistic.
    pub fit: Vec<MeasuredStatistic>,
    /// Numbers of the parameters that are told.
    #[serde(skip)]
    pub told: Vec<usize>,
    /// A sample of the posterior of these.
    #[serde(skip)]
    pub sample: Vec<Vec<f64>>,
    /// Whether further recordings were looked at.
    pub looked_further: bool,
    /// Motors that were drawn.
    pub motors: u64,
    /// Width of the prior.
    pub prior_width: f64,
    /// Seed of the motors that were drawn.
    pub seed: u64,
}

impl Identification {
    /// The statistics that are furthest off what motors of the posterior show.
    pub(super) fn furthest(&self, count: usize) -> Vec<&MeasuredStatistic> {
        let mut all: Vec<&MeasuredStatistic> = self.fit.iter().collect();
        all.sort_by(|one, other| other.deviation().abs().total_cmp(&one.deviation().abs()));
        all.truncate(count);
        all
    }

    /// Share of the statistics within two standard deviations.
    pub(super) fn share_within_two(&self) -> f64 {
        self.fit
            .iter()
            .map(|statistic| f64::from(u8::from(statistic.deviation().abs() <= 2.0)))
            .collect::<Spread>()
            .mean
    }

    /// What the parameters are.
    pub(super) fn table(&self) -> Table {
        let mut table = Table::new(&["parameter", "unit", "before", "identified", "90 % interval"]);
        for parameter in &self.parameters {
            let IdentifiedParameter { key, unit, prior_mean, prior_sd, mean, sd, interval, .. } = parameter;
            let spread = |mean: f64, sd: f64| format!("{} +- {}", rounded(mean, sd), rounded(sd, sd));
            let to =
                |[low, high]: [f64; 2], sd: f64| format!("{} to {}", rounded(low, sd), rounded(high, sd));
            table.push(vec![
                (*key).to_owned(),
                (*unit).to_owned(),
                spread(*prior_mean, *prior_sd),
                mean.zip(*sd).map_or_else(|| "not told".to_owned(), |(mean, sd)| spread(mean, sd)),
                interval.zip(*sd).map_or_else(|| "-inf to inf".to_owned(), |(ends, sd)| to(ends, sd)),
            ]);
        }
        table
    }

    /// How well motors of the posterior show what was measured.
    pub(super) fn fit_sentence(&self) -> String {
        format!(
            "Of {} statistics of the recordings {:.0} % lie within two standard deviations of what motors of the \
             posterior show; 95 % do if the recordings are those of such a motor.",
            self.fit.len(),
            100.0 * self.share_within_two()
        )
    }

    /// Everything that is said.
    pub fn document(&self) -> Document {
        let told = self.told.len();
        let damage =
            self.damage.iter().map(|damage| Block::Paragraph(format!("{damage}; read up to there.")));
        let mut blocks: Vec<Block> = damage.collect();
        blocks.extend([
            Block::Paragraph(format!(
                "{} of {} parameters are told by {}: a standard deviation below {:.0} % of that before is expected.",
                told,
                self.parameters.len(),
                self.logs.join(", "),
                100.0 * TOLD
            )),
            Block::Table(self.table()),
        ]);
        if !self.fit.is_empty() {
            blocks.push(Block::Paragraph(self.fit_sentence()));
        }
        blocks.extend(self.advice().into_iter().map(Block::Paragraph));
        Document { blocks }
    }

    /// What would tell what is not told: a sentence for each recording of the list that would tell some of it, and one
    /// for all others.
    pub(super) fn advice(&self) -> Vec<String> {
        let mut recordings: Vec<(&str, &str, Vec<String>)> = Vec::new();
        let mut others: Vec<&str> = Vec::new();
        for parameter in self.parameters.iter().filter(|parameter| !parameter.told) {
            let IdentifiedParameter { key, further_recording, further_command, further_ratio, .. } =
                parameter;
            let (Some(recording), Some(command), Some(ratio)) =
                (further_recording, further_command, further_ratio)
            else {
                others.push(key);
                continue;
            };
            let told = format!("{key} ({:.0} %)", 100.0 * ratio);
            match recordings.iter_mut().find(|(other, ..)| other == recording) {
                Some((.., keys)) => keys.push(told),
                None => recordings.push((recording, command, vec![told])),
            }
        }
        let sentence = |(recording, command, keys): (&str, &str, Vec<String>)| {
            format!(
                "With {recording} beside these (`{command}`) more would be told, in brackets what would be left of the \
                 standard deviation before: {}.",
                keys.join(", ")
            )
        };
        let mut sentences: Vec<String> = recordings.into_iter().map(sentence).collect();
        if !others.is_empty() {
            let by = if self.looked_further { "nor by any further one that was looked at " } else { "" };
            sentences.push(format!("Not told by these recordings {by}are {}.", others.join(", ")));
        }
        sentences
    }

    /// The scene of the motor: what was identified is its design, with twice the standard deviation as tolerance.
    pub fn scene(&self) -> String {
        let mut scene = format!(
            "# The motor that host-sim identified from {}. What is not here was not told.\n",
            self.logs.join(", ")
        );
        let mut line = |key: &str, value: f64| {
            // Writing to a string cannot fail.
            let _ = writeln!(scene, "{key} = {}", float(value));
        };
        for (parameter, mean, sd) in self.identified() {
            line(parameter.key, mean);
            line(&format!("plant.tolerance.{}", parameter.key), 2.0 * sd);
        }
        if self.rotor != "height_only" {
            let _ = writeln!(scene, "plant.rotor = \"{}\"", self.rotor);
        }
        scene
    }

    /// What is told, with mean and standard deviation.
    pub fn identified(&self) -> impl Iterator<Item = (&IdentifiedParameter, f64, f64)> {
        self.parameters.iter().filter_map(|parameter| Some((parameter, parameter.mean?, parameter.sd?)))
    }
}

/// A number to the second digit of its standard deviation.
fn rounded(number: f64, sd: f64) -> String {
    let decade = |number: f64| math::ln(number.abs()) / std::f64::consts::LN_10;
    let digits = decade(number).floor() - decade(sd).floor() + 1.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 12; a cast saturates"
    )]
    let digits = digits.clamp(0.0, 12.0) as usize;
    let rounded: f64 = format!("{number:.digits$e}").parse().unwrap_or(number);
    plain(rounded)
}

/// A number of seven digits in a scene file.
fn float(number: f64) -> String {
    let rounded: f64 = format!("{number:.7e}").parse().unwrap_or(number);
    plain(rounded)
}

#[cfg(test)]
mod tests {
    use super::{interval, rounded};
    use simulation::math::count::real;

    /// 49 of 1000 values lie below the interval, and 49 above it.
    #[test]
    fn exact_an_interval_has_nine_tenths_of_the_sample() {
        let sample: Vec<f64> = (0..1000_u32).map(|place| real(place * 7 % 1000)).collect();
        assert_eq!(interval(&sample), Some([49.0, 950.0]));
        assert_eq!(interval(&[]), None);
    }

    #[test]
    fn exact_numbers_have_two_digits_of_their_uncertainty() {
        for (number, sd, expected) in [
            (6_297.723_46, 7.3193e-4, "6297.72346"),
            (7464.05, 0.014_035, "7464.05"),
            (6300.0, 6.5972, "6300"),
            (6312.34, 66.0, "6312"),
            (0.005_443_1, 1.0581e-7, "0.0054431"),
            (-2.636, 0.131_94, "-2.64"),
            (0.01, 0.5, "0.01"),
            (0.131_94, 0.131_94, "0.13"),
            (0.0, 1.0, "0"),
        ] {
            assert_eq!(rounded(number, sd), expected, "{number} +- {sd}");
        }
    }
}
