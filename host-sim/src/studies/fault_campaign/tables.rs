//! The campaign in tables: text, JSON, and the values of its page.

use serde_json::json;
use textwrap::{Options, WordSplitter};

use super::run::OF_EVERY_MOVE;
use super::summary::{RUNAWAY_DEG, unmarked};
use super::{FaultCampaign, FaultRun, FaultSummary};
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::studies::beside::FIRST;
use simulation::runs::position::MoveEnding;
use simulation::scene::faults::WORDS;

/// Runs listed at most of each kind.
const LISTED_MAX: usize = 5;

pub(super) const ABOUT: &str = "Reached: held as on target, within three tolerances of it. Gave up: ended with a \
    reason. Timed out: ended by the deadline. Wrong: held as on target, and further off. Unaware: runs with an \
    estimate of good health whose angle was off by more than 100 milli-degrees for more than 10 ms in all, the \
    longest such time of a run, and the largest such error. Ran away: the rotor was ever so far from the way between \
    start and target. A run with two faults counts for both.";

const TO_BE_REPEATED: &str = "The worst runs. What this campaign was given by --scene and --set belongs to each of the \
    commands, too.";

const HEADER: [&str; 9] =
    ["runs", "reached", "gave up", "timed out", "wrong", "unaware", "max s", "mdeg", "ran away"];

fn cells(summary: &FaultSummary) -> Vec<String> {
    let of_unaware = |text: String| if summary.unaware == 0 { "-".to_owned() } else { text };
    let counts = [summary.runs, summary.reached, summary.gave_up, summary.timed_out, summary.wrong];
    // A key stands as it is typed.
    let is_key = summary.of.contains('=');
    let mut cells = vec![if is_key { summary.of.clone() } else { summary.of.replace('_', " ") }];
    cells.extend(counts.map(|count| count.to_string()));
    cells.push(summary.unaware.to_string());
    cells.push(of_unaware(format!("{:.4}", summary.unaware_s)));
    cells.push(of_unaware(format!("{:.0}", summary.unaware_mdeg)));
    cells.push(summary.runaways.to_string());
    cells
}

fn table(first: &str, rows: &[FaultSummary]) -> Table {
    let mut table = Table::new(&[&[first], &HEADER[..]].concat());
    rows.iter().map(cells).for_each(|cells| table.push(cells));
    table
}

impl FaultRun {
    /// The command that repeats it, but for what the campaign itself was given by `--scene` and `--set`.
    pub fn command(&self) -> String {
        let scene = flags_of(&self.scene);
        let faults: Vec<String> = self.faults.split(' ').map(|word| format!(" --fault {word}")).collect();
        let of_every: Vec<String> =
            OF_EVERY_MOVE.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
        format!(
            "host-sim position{scene} --seed {} --to {} --set estimator.filter={}{}{}",
            self.seed,
            self.target_deg,
            self.filter,
            of_every.concat(),
            faults.concat()
        )
    }
}

/// The flags of `position` for a scene by its name in tables: that of a scene file, `KEY=VALUE`, or several of them.
fn flags_of(name: &str) -> String {
    let parts = name.split(", ").filter(|part| *part != FIRST);
    let flag = |part: &str| match part.split_once('=') {
        Some((key, value)) => format!(" --set {}={}", key.trim(), value.trim()),
        None => format!(" --scene {}", part.replace(' ', "_")),
    };
    parts.map(flag).collect()
}

/// A command in lines that fit a page, as a shell takes it.
fn wrapped(command: &str) -> String {
    let options = Options::new(100).subsequent_indent("    ").word_splitter(WordSplitter::NoHyphenation);
    textwrap::wrap(command, options).join(" \\\n")
}

impl FaultCampaign {
    pub(super) fn by_word(&self) -> Vec<FaultSummary> {
        let words = WORDS.iter().map(|word| format!("{}:{}", word.thing, word.what));
        let of_word = |word: String| {
            let runs = self.runs.iter().filter(|run| run.has(&word));
            FaultSummary::of(&word, runs)
        };
        words.map(of_word).filter(|summary| summary.runs > 0).collect()
    }

    /// The counts in one sentence.
    pub(super) fn verdict(&self) -> String {
        let all = self.summary();
        format!(
            "Of {} moves during which something went wrong {} reached the target, {} gave up with a reason, {} were \
             ended by the deadline, and {} were held as on target while off it. In {} runs an estimate was called good \
             and was more than 100 milli-degrees off for more than 10 ms in all. In {} runs the rotor was more than \
             {RUNAWAY_DEG:.0} degrees beside its way.",
            all.runs, all.reached, all.gave_up, all.timed_out, all.wrong, all.unaware, all.runaways
        )
    }

    /// The worst runs of each kind, as commands.
    fn worst(&self) -> Table {
        let mut table = Table::new(&["what", "how far", "command"]);
        let mut list =
            |what: &str, is: &dyn Fn(&FaultRun) -> bool, size: &dyn Fn(&FaultRun) -> f64, unit: &str| {
                let mut runs: Vec<&FaultRun> = self.runs.iter().filter(|run| is(run)).collect();
                runs.sort_by(|a, b| size(b).total_cmp(&size(a)));
                for run in runs.iter().take(LISTED_MAX) {
                    table.push(vec![what.to_owned(), format!("{:.1} {unit}", size(run)), run.command()]);
                }
            };
        list("wrong", &|run| run.ending == MoveEnding::Wrong, &|run| run.error_mdeg.abs(), "mdeg");
        list("unaware", &FaultRun::was_unaware, &|run| 1e3 * run.unaware_s, "ms");
        list("ran away", &FaultRun::ran_away, &|run| run.excursion_deg, "deg");
        table
    }

    /// Every run with an estimate that was called good and was wrong, by its faults' first word.
    fn exceptions(&self) -> Table {
        let mut table = Table::new(&["seed", "filter", "faults", "ms", "mdeg"]);
        let mut runs: Vec<&FaultRun> = self.runs.iter().filter(|run| run.was_unaware()).collect();
        runs.sort_by_key(|run| (unmarked(&run.faults), run.number));
        for run in runs {
            let sizes = [format!("{:.0}", 1e3 * run.unaware_s), format!("{:.0}", run.unaware_mdeg)];
            let of = [run.seed.to_string(), run.filter.replace('_', " "), run.faults.clone()];
            table.push(of.into_iter().chain(sizes).collect());
        }
        table
    }

    /// For the terminal.
    pub fn document(&self) -> Document {
        let mut blocks = vec![
            Block::Heading("Faults".to_owned()),
            Block::Paragraph(self.verdict()),
            Block::Table(table("fault", &self.by_word())),
            Block::Table(table("filter", &self.by(|run| &run.filter))),
        ];
        let scenes = self.by(|run| &run.scene);
        if scenes.len() > 1 {
            blocks.push(Block::Table(table("scene", &scenes)));
        }
        blocks.push(Block::Paragraph(ABOUT.to_owned()));
        blocks.push(Block::Heading("To be repeated".to_owned()));
        blocks.push(Block::Paragraph(TO_BE_REPEATED.to_owned()));
        blocks.push(Block::Table(self.worst()));
        Document { blocks }
    }

    /// The values of its page.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let all = self.summary();
        let worst = self.worst();
        let worst: Vec<String> =
            worst.rows().iter().filter_map(|row| row.last()).map(|line| wrapped(line)).collect();
        vec![
            ("verdict", self.verdict()),
            ("runs", all.runs.to_string()),
            ("about", ABOUT.to_owned()),
            ("table_words", table("fault", &self.by_word()).markdown()),
            ("table_filters", table("filter", &self.by(|run| &run.filter)).markdown()),
            ("table_scenes", table("scene", &self.by(|run| &run.scene)).markdown()),
            ("worst", worst.join("\n")),
            ("table_exceptions", self.exceptions().markdown()),
        ]
    }

    /// The counts as one JSON object on one line.
    pub fn json(&self) -> String {
        let counts = json!({
            "all": self.summary(),
            "faults": self.by_word(),
            "filters": self.by(|run| &run.filter),
            "scenes": self.by(|run| &run.scene),
        });
        format!("{counts}\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_scene_by_its_name_is_flags() {
        for (name, flags) in [
            (FIRST, ""),
            ("set f plant", " --scene set_f_plant"),
            ("camera.marks=3", " --set camera.marks=3"),
            (
                "set f plant, camera.marks=3, seed = 4",
                " --scene set_f_plant --set camera.marks=3 --set seed=4",
            ),
        ] {
            assert_eq!(flags_of(name), flags, "{name}");
        }
    }
}
