//! The README's section on speed against error, written by the command and never by hand.

use std::fmt::Write as _;

use motor_model::ImpactRule;

use super::peers::PeerRow;
use super::verdict::Verdict;
use super::{Accuracy, Row};
use crate::report::document::{Block, Document, Table};
use crate::report::section::Section;
use crate::runs::simulate::Precision;

/// Where the section stands.
pub const SECTION: Section = Section { begin: "<!-- accuracy:begin -->", end: "<!-- accuracy:end -->" };

/// Rows shown.
const SHOWN: [(ImpactRule, Precision, f64); 7] = [
    (ImpactRule::EndOfStep, Precision::F64, 0.25e-6),
    (ImpactRule::EndOfStep, Precision::F64, 1e-6),
    (ImpactRule::EndOfStep, Precision::F64, 10e-6),
    (ImpactRule::Located, Precision::F64, 1e-6),
    (ImpactRule::Located, Precision::F64, 10e-6),
    (ImpactRule::Located, Precision::F32, 10e-6),
    (ImpactRule::Located, Precision::F64, 20e-6),
];

const ERRORS: &str = "Errors are those against the event-driven reference: of the time of the next impact, root mean square over flights from the same \
    states; of the mean rate, +- two standard errors; of the net displacement of bursts of 2 to 10 cycles, the worst.";

impl Accuracy {
    /// The section: a few rows, two sentences of verdict, the peers.
    pub fn readme_section(&self) -> String {
        let mut table = Table::new(&[
            "impacts",
            "step",
            "ns a step, B / C",
            "times real time, B / C",
            "next impact off by",
            "mean rate in B",
            "mean rate in C",
            "bursts",
        ]);
        for (rule, precision, step_s) in SHOWN {
            self.row(rule, precision, step_s).map(cells).into_iter().for_each(|cells| table.push(cells));
        }
        let document = Document { blocks: vec![Block::Table(table)] };
        let mut text = document.markdown();
        let _ = writeln!(text, "{ERRORS}\n");
        let _ = writeln!(text, "{}\n", self.averaged_sentence());
        let verdicts = self.verdicts();
        let met = verdicts.iter().filter(|verdict| verdict.met).count();
        let _ = writeln!(text, "Of {} targets {met} are met.{}", verdicts.len(), missed(&verdicts));
        let _ = writeln!(text, "{}", self.beside_others());
        text
    }

    /// One sentence on the averaged motor.
    fn averaged_sentence(&self) -> String {
        let averaged = self.averaged.iter().map(|row| {
            format!(
                "{} {:+.1} +- {:.1} %",
                row.condition,
                100.0 * row.move_relative,
                100.0 * row.move_half_width
            )
        });
        let averaged: Vec<String> = averaged.collect();
        let fastest = self.averaged.iter().map(|row| row.cost.times_real_time).fold(f64::INFINITY, f64::min);
        format!(
            "The averaged motor takes steps of 0.1 s at {fastest:.0e} times real time; moves of 1 s from rest are off by {} on \
             average.",
            averaged.join(", ")
        )
    }

    /// One sentence on the other integrators.
    fn beside_others(&self) -> String {
        let named = |row: &PeerRow| {
            row.cost.map(|cost| {
                let times = cost.times_real_time;
                let times = if times < 10.0 { format!("{times:.1}") } else { format!("{times:.0}") };
                format!("{} {times}", row.name)
            })
        };
        let others: Vec<String> =
            self.peers.iter().filter(|row| row.twin.is_none()).filter_map(named).collect();
        let ours = self.plate_times_real_time().unwrap_or(0.0);
        let others =
            if others.is_empty() { "no other integrator was measured".to_owned() } else { others.join(", ") };
        format!(
            "A ball on a vibrating plate, largest step 5 us, in times real time: located in f64 {ours:.0}, {others}."
        )
    }
}

/// What was missed, in a sentence.
fn missed(verdicts: &[Verdict]) -> String {
    let missed = verdicts.iter().filter(|verdict| !verdict.met);
    let missed: Vec<String> =
        missed.map(|verdict| format!("{} ({})", verdict.target, verdict.found)).collect();
    if missed.is_empty() { String::new() } else { format!(" Missed: {}.", missed.join("; ")) }
}

fn cells(row: &Row) -> Vec<String> {
    let [b, c] = row.cost;
    let percent = |index: usize| {
        let rate = &row.steady[index].rate;
        format!("{:+.1} +- {:.1} %", 100.0 * rate.relative, 100.0 * rate.half_width)
    };
    let step = format!("{} us", (1e9 * row.who.step_s).round() / 1e3);
    vec![
        row.who.name(),
        step,
        format!("{:.1} / {:.1}", b.ns_per_step, c.ns_per_step),
        format!("{:.0} / {:.0}", b.times_real_time, c.times_real_time),
        duration(row.flights[0].first_impact_rms_s.max(row.flights[1].first_impact_rms_s)),
        percent(0),
        percent(1),
        format!("{:.1} %", 100.0 * row.worst_burst()),
    ]
}

/// A short time with the unit that suits it.
fn duration(time_s: f64) -> String {
    let units = [(1e-6, "us"), (1e-9, "ns"), (1e-12, "ps")];
    let suitable = units.into_iter().find(|(unit_s, _)| time_s >= *unit_s);
    suitable.map_or_else(|| "< 1 ps".to_owned(), |(unit_s, unit)| format!("{:.1} {unit}", time_s / unit_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_durations() {
        let durations = [2.5e-6, 4e-12, 3e-17].map(duration);
        assert_eq!(durations, ["2.5 us", "4.0 ps", "< 1 ps"]);
    }
}
