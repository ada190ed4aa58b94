//! The comparison in words: Markdown that can be pasted in a pull request, JSON, and the report.

use serde_json::{Value, json};

use super::significance::Test;
use super::values::ChangedValue;
use super::{ComparedFigure, Comparison, LEVEL, Verdict, full_name};
use crate::report::document::{Block, Document, Table};
use crate::report::html::HtmlReport;
use crate::report::key_figure::{Measured, significant};

/// Values listed at most of those that differ.
const LISTED_MAX: usize = 30;

impl Comparison {
    /// Everything in words and tables.
    pub fn document(&self) -> Document {
        let mut blocks = vec![Block::Heading("Two results of host-sim side by side".to_owned())];
        blocks.extend(self.warnings().into_iter().map(Block::Paragraph));
        blocks.push(Block::Paragraph(self.verdict()));
        blocks.push(Block::Table(self.files()));
        blocks.extend(self.figure_blocks());
        blocks.extend(self.value_blocks());
        Document { blocks }
    }

    /// What must be known before anything is read off: other commands, other scenes, other versions.
    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.a.command != self.b.command {
            warnings.push(format!(
                "These are results of different commands, `{}` and `{}`: what they have in common may mean different \
                 things.",
                self.a.command, self.b.command
            ));
        }
        let differing = self.a.scene_differences(&self.b);
        if !differing.is_empty() {
            let keys = differing.iter().map(|[key, a, b]| format!("`{key}` ({a} in A, {b} in B)"));
            warnings.push(format!(
                "The scenes differ: {}. So a change may be theirs, and not the program's.",
                keys.collect::<Vec<_>>().join(", ")
            ));
        }
        warnings
    }

    /// What was found, in one paragraph.
    fn verdict(&self) -> String {
        if self.figures.is_empty() {
            let values = &self.values;
            return format!(
                "The results have no key figures with a measure of their chance. Of {} values {} are equal to the last \
                 bit and {} differ.",
                values.equal + values.changed.len(),
                values.equal,
                values.changed.len()
            );
        }
        let count = |verdict| self.figures.iter().filter(|figure| figure.verdict == verdict).count();
        let said = [
            (Verdict::Worse, "worse beyond noise"),
            (Verdict::Better, "better beyond noise"),
            (Verdict::Changed, "changed beyond noise"),
            (Verdict::Differs, "not the same, without a measure of their chance"),
            (Verdict::WithinNoise, "not the same, within noise"),
            (Verdict::TooFewRuns, "not the same, of too few runs to tell"),
            (Verdict::Equal, "equal to the last bit"),
        ];
        let parts: Vec<String> = said
            .into_iter()
            .filter(|(verdict, _)| count(*verdict) > 0)
            .map(|(verdict, words)| format!("{} {words}", count(verdict)))
            .collect();
        format!("Of {} key figures: {}.", self.figures.len(), parts.join(", "))
    }

    fn files(&self) -> Table {
        let mut table = Table::new(&["", "A", "B"]);
        let mut row = |what: &str, [a, b]: [String; 2]| table.push(vec![what.to_owned(), a, b]);
        let both = [&self.a, &self.b];
        row("file", both.map(|result| result.path.display().to_string()));
        row("command", both.map(|result| result.command.clone()));
        row("version", both.map(|result| result.version.clone()));
        for [key, a, b] in self.a.scene_differences(&self.b) {
            row(&key, [a, b]);
        }
        table
    }

    fn figure_blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut list = |heading: &str, chosen: &dyn Fn(Verdict) -> bool| {
            let rows: Vec<&ComparedFigure> =
                self.figures.iter().filter(|figure| chosen(figure.verdict)).collect();
            if !rows.is_empty() {
                blocks.push(Block::Heading(heading.to_owned()));
                blocks.push(Block::Table(table(&rows)));
            }
        };
        list("Changed", &|verdict| verdict.is_change());
        list("Not changed beyond noise", &|verdict| {
            matches!(verdict, Verdict::WithinNoise | Verdict::TooFewRuns)
        });
        if !self.lone_figures.is_empty() {
            blocks
                .push(Block::Paragraph(format!("Without a counterpart: {}.", self.lone_figures.join("; "))));
        }
        if self.tested() > 0 {
            blocks.push(Block::Paragraph(self.about_tests()));
        }
        blocks
    }

    /// How the verdicts come about.
    fn about_tests(&self) -> String {
        let of = |paired: bool| {
            let figures = self.figures.iter().filter(|figure| figure.pairs.is_some() == paired);
            let tests: Vec<Test> = figures.filter_map(|figure| figure.test).collect();
            let used = Test::ALL.iter().filter(|test| tests.contains(test)).map(|test| test.words());
            (tests.len(), used.collect::<Vec<_>>().join(", "))
        };
        let mut sentences = vec![format!("{} figures were tested.", self.tested())];
        let ((paired, by_pairs), (independent, by_sets)) = (of(true), of(false));
        if paired > 0 {
            sentences.push(format!("{paired} in pairs, since the runs have the same seeds: {by_pairs}."));
        }
        if independent > 0 {
            sentences.push(format!("{independent} as of independent runs: {by_sets}."));
        }
        sentences.push(format!(
            "With Holm's method the chance of one false alarm among them is at most {:.0} %; p is given after it.",
            100.0 * LEVEL
        ));
        sentences.join(" ")
    }

    fn value_blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let (values, shown) = (&self.values, self.values.changed.len().min(LISTED_MAX));
        if self.figures.is_empty() {
            if shown > 0 {
                blocks.push(Block::Heading("Values that differ".to_owned()));
                blocks.push(Block::Table(value_table(&values.changed[..shown])));
            }
            if values.changed.len() > shown {
                blocks.push(Block::Paragraph(format!("{} more differ less.", values.changed.len() - shown)));
            }
        } else {
            blocks.push(Block::Paragraph(format!(
                "Of the other values {} are equal to the last bit and {} differ; they carry no measure of their \
                 chance.",
                values.equal,
                values.changed.len()
            )));
        }
        if !values.lone.is_empty() {
            let shown: Vec<&str> = values.lone.iter().take(LISTED_MAX).map(String::as_str).collect();
            blocks.push(Block::Paragraph(format!(
                "{} values stand in one result only: {}{}.",
                values.lone.len(),
                shown.join("; "),
                if values.lone.len() > LISTED_MAX { "; and more" } else { "" }
            )));
        }
        if !values.times.is_empty() {
            blocks.push(Block::Paragraph(format!(
                "{} times of the machine differ. They do so from run to run, and are not judged.",
                values.times.len()
            )));
        }
        blocks
    }

    /// The comparison as one JSON object on one line.
    pub fn json(&self) -> String {
        let differences = self.a.scene_differences(&self.b);
        let scene: Vec<Value> =
            differences.into_iter().map(|[key, a, b]| json!({"key": key, "a": a, "b": b})).collect();
        let object = json!({
            "commands": [self.a.command, self.b.command],
            "versions": [self.a.version, self.b.version],
            "scene_differences": scene,
            "level": LEVEL,
            "tested": self.tested(),
            "changes": self.changes(),
            "figures": self.figures,
            "lone_figures": self.lone_figures,
            "values": self.values,
        });
        format!("{object}\n")
    }

    /// The report; `wall_s` is the time that the comparison took.
    pub(crate) fn report(&self, wall_s: f64) -> HtmlReport {
        let mut happened = Document { blocks: self.figure_blocks() };
        happened.blocks.extend(self.value_blocks());
        let warnings = self.warnings().join(" ");
        let gap = if warnings.is_empty() { "" } else { " " };
        HtmlReport {
            title: "Two results side by side".to_owned(),
            verdict: format!("{warnings}{gap}{}", self.verdict()),
            asked: Document { blocks: vec![Block::Table(self.files())] },
            figures: self.figure().into_iter().collect(),
            happened,
            sure: Document { blocks: Vec::new() }.paragraphs([self.about_tests()]),
            cost: Document::of_lines([(
                "time on this machine",
                format!("{wall_s:.3} s; nothing is simulated"),
            )]),
            not_modelled: vec![
                "A comparison adds nothing to its results: what they leave out stands in their own reports."
                    .to_owned(),
            ],
        }
    }
}

fn table(rows: &[&ComparedFigure]) -> Table {
    let mut table = Table::new(&["figure", "A", "B", "change", "test", "p", ""]);
    for row in rows {
        let relative = match row.relative_change {
            Some(relative) => format!("{:+.1} %", 100.0 * relative),
            None => format!("from 0 to {}", row.b.text_of(row.b.measured.value())),
        };
        table.push(vec![
            if row.a.unit.is_empty() {
                full_name(&row.a)
            } else {
                format!("{} ({})", full_name(&row.a), row.a.unit)
            },
            cell(row, true),
            cell(row, false),
            relative,
            row.test.map_or("-", Test::name).to_owned(),
            row.p_holm.map_or_else(|| "-".to_owned(), probability),
            row.verdict.words().to_owned(),
        ]);
    }
    table
}

/// A value with its interval, without the unit, which stands beside the name.
fn cell(row: &ComparedFigure, of_a: bool) -> String {
    let figure = if of_a { &row.a } else { &row.b };
    let is_count = matches!(figure.measured, Measured::Count { .. });
    let value = if is_count { figure.value_text() } else { figure.number_text(figure.measured.value()) };
    let percent = if is_count { " %" } else { "" };
    figure
        .bare_interval_text()
        .map_or_else(|| value.clone(), |interval| format!("{value} ({interval}{percent})"))
}

fn probability(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { format!("{p:.4}") }
}

fn value_table(values: &[ChangedValue]) -> Table {
    let text = |value: &Value| value.as_f64().map_or_else(|| value.to_string(), significant);
    let mut table = Table::new(&["value", "A", "B", "change"]);
    for value in values {
        let change =
            value.relative_change.map_or_else(|| "-".to_owned(), |part| format!("{:+.2} %", 100.0 * part));
        table.push(vec![value.name.clone(), text(&value.a), text(&value.b), change]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::compare::tests::result;
    use crate::report::key_figure::KeyFigure;

    #[test]
    fn exact_other_commands_and_scenes_are_said_first() {
        let (a, mut b) = (result(&[], ",\"x\":1.0"), result(&[], ",\"x\":1.5"));
        b.command = "rate".to_owned();
        b.scene.clear();
        let text = Comparison::of(a, b).document().markdown();
        let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("{words} in {text}"));
        let places =
            [place("different commands"), place("`seed` (7 in A, default in B)"), place("1 differ.")];
        assert!(places.is_sorted(), "{text}");
        assert!(text.contains("| x     | 1.000 | 1.500 | +50.00 % |"), "{text}");
    }

    #[test]
    fn exact_the_table_says_what_became_of_each_figure() {
        let figures = |failed| {
            [KeyFigure::count("failed", (0..50).map(|run| run < failed)).of("twin").lower_is_better()]
        };
        let comparison = Comparison::of(result(&figures(0), ""), result(&figures(12), ""));
        let text = comparison.document().markdown();
        for words in [
            "Of 1 key figures: 1 worse beyond noise",
            "## Changed",
            "| twin: failed | 0 of 50 (0 to 7.135 %)",
        ] {
            assert!(text.contains(words), "{words} in {text}");
        }
        // Twelve runs failed alone: 2 / 2^12.
        assert!(text.contains("from 0 to 24.00 % | McNemar | 0.0005 | worse |"), "{text}");
        assert!(text.contains("1 in pairs, since the runs have the same seeds: counts and"), "{text}");
        let json: Value = serde_json::from_str(&comparison.json()).unwrap();
        assert_eq!((&json["changes"], &json["figures"][0]["verdict"]), (&json!(1), &json!("worse")));
    }
}
