//! The forms of the rotor in a table: for the terminal, for the page.

use super::comparison::StepAccuracy;
use super::tilting_forms::{RunMean, TiltingFormRow, reference_of};
use crate::report::document::{Block, Table};

/// What the figures of the table mean.
pub(super) const ABOUT: &str = "Forms of the rotor at set F, full drive, f64, located impacts. Rates in the sense of \
    the mode. In brackets: how far off the full form at the finest step, in per cent; +- two standard errors over \
    independent runs. A form that leaves something out is off by what it leaves out, at any step. Impacts of the teeth \
    and contacts of the hub: those faster than 1 mm/s, per second.";

impl StepAccuracy {
    /// The paragraph and the table for the terminal.
    pub(super) fn tilting_blocks(&self) -> Vec<Block> {
        vec![Block::Paragraph(ABOUT.to_owned()), Block::Table(self.tilting_table(""))]
    }

    /// The table; `tilde` stands before what is a time on one machine.
    pub(super) fn tilting_table(&self, tilde: &str) -> Table {
        let mut table = Table::new(&[
            "drive",
            "rotor",
            "step us",
            "rate rad/s",
            "impacts /s",
            "tilt rms mrad",
            "hub /s",
            "ns a step",
            "times real time",
        ]);
        for row in &self.tilting {
            table.push(cells(row, reference_of(&self.tilting, row.drive), tilde));
        }
        table
    }
}

fn cells(row: &TiltingFormRow, reference: Option<&TiltingFormRow>, tilde: &str) -> Vec<String> {
    let reference = reference.filter(|reference| !std::ptr::eq(*reference, row));
    let cell = |decimals: usize, mean: RunMean, of: Option<RunMean>| {
        let RunMean { mean: value, half_width } = mean;
        let off = of.map_or_else(String::new, |reference| {
            let off = mean.off(&reference);
            format!(" ({:+.1} +- {:.1})", 100.0 * off.mean, 100.0 * off.half_width)
        });
        format!("{value:.decimals$} +- {half_width:.decimals$}{off}")
    };
    let optional = |decimals, mean: Option<RunMean>, of: Option<RunMean>| {
        mean.map_or_else(|| "-".to_owned(), |mean| cell(decimals, mean, of))
    };
    vec![
        row.drive.to_owned(),
        row.rotor.replace('_', " "),
        format!("{}", (1e9 * row.step_s).round() / 1e3),
        cell(3, row.rate_rad_s, reference.map(|reference| reference.rate_rad_s)),
        cell(0, row.impacts_per_s, reference.map(|reference| reference.impacts_per_s)),
        optional(2, row.tilt_rms_mrad, reference.and_then(|reference| reference.tilt_rms_mrad)),
        optional(0, row.hub_contacts_per_s, reference.and_then(|reference| reference.hub_contacts_per_s)),
        format!("{tilde}{:.0}", row.cost.ns_per_step),
        format!("{tilde}{:.1}", row.cost.times_real_time),
    ]
}
