//! The values of the page on the cost and error of a step.

use motor_model::ImpactRule;

use super::comparison::StepAccuracy;
use super::targets::TargetResult;
use super::tilting_table::ABOUT as ABOUT_TILTING;
use crate::report::page::{ON_ONE_MACHINE, PlacedValue};
use crate::report::table::Table;
use analysis::step_accuracy::method::TARGET_STEP_S;
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::peers::PeerRow;
use simulation::runs::simulate::Precision;

/// The methods of the page's table.
const SHOWN: [(ImpactRule, Precision, f64); 7] = [
    (ImpactRule::EndOfStep, Precision::F64, 0.25e-6),
    (ImpactRule::EndOfStep, Precision::F64, 1e-6),
    (ImpactRule::EndOfStep, Precision::F64, 10e-6),
    (ImpactRule::Located, Precision::F64, 1e-6),
    (ImpactRule::Located, Precision::F64, 10e-6),
    (ImpactRule::Located, Precision::F32, 10e-6),
    (ImpactRule::Located, Precision::F64, 20e-6),
];

impl StepAccuracy {
    /// Some rows, the targets, the averaged motor, the other integrators.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let (timed, of_error): (Vec<_>, Vec<_>) =
            self.target_results().into_iter().partition(|result| result.timed);
        let target = self.row(ImpactRule::Located, Precision::F64, TARGET_STEP_S);
        let rate = |index: usize| target.map_or_else(String::new, |row| rate(row, index));
        let real_time = target.map_or_else(String::new, |row| format!("~{:.0}", row.cost[0].times_real_time));
        vec![
            ("rate_b_located_10us", rate(0)),
            ("rate_c_located_10us", rate(1)),
            ("real_time_b_located_10us", real_time),
            ("table_steps", self.shown().markdown()),
            ("targets_of_error", met(&of_error)),
            ("targets_of_time", format!("{ON_ONE_MACHINE} {}", met(&timed))),
            ("averaged", self.averaged_sentence()),
            ("averaged_time", self.averaged_time()),
            ("other_integrators", self.beside_others()),
            ("table_tilting", self.tilting_pages()),
            ("about_tilting", ABOUT_TILTING.to_owned()),
        ]
    }

    /// The forms of the rotor in tables that fit a page: motion, tilt and pin, times.
    fn tilting_pages(&self) -> String {
        let parts = self.tilting_table("~").cut(3, &["tilt rms mrad", "ns a step"]);
        parts.iter().map(Table::markdown).collect::<Vec<_>>().join("\n")
    }

    fn shown(&self) -> Table {
        let mut table = Table::new(&[
            "impacts",
            "step",
            "ns, B / C",
            "x real time",
            "next impact",
            "rate in B",
            "rate in C",
            "bursts",
        ]);
        for (rule, precision, step_s) in SHOWN {
            self.row(rule, precision, step_s).map(cells).into_iter().for_each(|cells| table.push(cells));
        }
        table
    }

    /// The errors of the averaged motor's moves.
    fn averaged_sentence(&self) -> String {
        let averaged = self.averaged.iter().map(|row| {
            format!(
                "{} {:+.1} +- {:.1} %",
                row.condition,
                100.0 * row.move_relative,
                100.0 * row.move_half_width
            )
        });
        averaged.collect::<Vec<_>>().join(", ")
    }

    /// The least speed of the averaged motor.
    fn averaged_time(&self) -> String {
        let slowest = self.averaged.iter().map(|row| row.cost.times_real_time).fold(f64::INFINITY, f64::min);
        format!("~{slowest:.0e}")
    }

    /// One sentence with the speeds on the ball on the plate.
    fn beside_others(&self) -> String {
        let named = |row: &PeerRow| {
            row.cost.map(|cost| {
                let times = cost.times_real_time;
                let times = if times < 10.0 { format!("{times:.1}") } else { format!("{times:.0}") };
                format!("{} {times}", row.name)
            })
        };
        let others: Vec<String> =
            self.peers.iter().filter(|row| row.method.is_none()).filter_map(named).collect();
        let ours = self.plate_times_real_time().unwrap_or(0.0);
        let others =
            if others.is_empty() { "no other integrator was measured".to_owned() } else { others.join(", ") };
        format!(
            "{ON_ONE_MACHINE} a ball on a vibrating plate, largest step 5 us, in times real time: located in f64 \
             {ours:.0}, {others}."
        )
    }
}

/// How many of `targets` are met, and which are not.
fn met(targets: &[TargetResult]) -> String {
    let missed: Vec<String> = targets
        .iter()
        .filter(|target| !target.met)
        .map(|result| format!("{} ({})", result.target, result.found))
        .collect();
    let met = targets.len() - missed.len();
    let missed = if missed.is_empty() { String::new() } else { format!(" Missed: {}.", missed.join("; ")) };
    format!("{met} of {} targets are met.{missed}", targets.len())
}

fn rate(row: &MethodRow, index: usize) -> String {
    let rate = &row.steady[index].rate;
    format!("{:+.1} +- {:.1} %", 100.0 * rate.relative, 100.0 * rate.half_width)
}

fn cells(row: &MethodRow) -> Vec<String> {
    let [b, c] = row.cost;
    let step = format!("{} us", (1e9 * row.method.step_s).round() / 1e3);
    vec![
        row.method.name(),
        step,
        format!("~{:.1} / ~{:.1}", b.ns_per_step, c.ns_per_step),
        format!("~{:.0} / ~{:.0}", b.times_real_time, c.times_real_time),
        duration(row.impact_map[0].first_impact_rms_s.max(row.impact_map[1].first_impact_rms_s)),
        rate(row, 0),
        rate(row, 1),
        format!("{:.1} %", 100.0 * row.worst_burst()),
    ]
}

/// A short time in the largest unit of which it has at least one.
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
