//! What the twin's error is made of, for the terminal: the twins that were told parts of the truth.

use super::tables::{millidegrees, title};
use super::{DRIVES, FilterErrors, FilterErrorsRow};
use crate::report::document::{Block, Table};
use analysis::filter_errors::timeline::TimelinePhase;

const ABOUT: &str = "Twins that are told parts of the truth, on the same frames and samples: rms of the angle's \
    error in milli-degrees by phase. The noise that the filter assumes of what it is told is taken away; nothing else \
    is tuned. Of steady motion: ANEES of the angle, 1 where the filter knows its error, and the intensity of a random \
    walk of the rate that would cost the same error (sigma goes as its eighth root). Kick-sign: impact_aided, not a \
    twin, is told the sign of each kick. Every kick: the genie, a lower bound.";

impl FilterErrors {
    /// Heading, explanation and table.
    pub(super) fn budget_blocks(&self) -> [Block; 3] {
        let header = ["drive", "told"].into_iter().chain(TimelinePhase::ALL.map(title));
        let mut table = Table::new(&header.chain(["ANEES", "rad^2/s^3"]).collect::<Vec<_>>());
        for (_, drive) in DRIVES {
            for told in self.budget_names() {
                let row = |phase| self.budget_row(&told, drive, phase);
                let mut cells = vec![drive.to_uppercase(), told.clone()];
                cells.extend(TimelinePhase::ALL.map(|phase| {
                    row(phase).map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg))
                }));
                let steady = row(TimelinePhase::Steady);
                cells.push(steady.map_or_else(String::new, |row| format!("{:.2}", row.angle_anees)));
                cells.push(self.intensity(&told, drive).map_or_else(String::new, |q| format!("{q:.1e}")));
                table.push(cells);
            }
        }
        [
            Block::Heading("What the twin's error is made of".to_owned()),
            Block::Paragraph(ABOUT.to_owned()),
            Block::Table(table),
        ]
    }

    /// What the rows of a budget are told: nothing, then parts, then every kick.
    pub(crate) fn budget_names(&self) -> Vec<String> {
        let (drive, phase) = (DRIVES[0].1, TimelinePhase::Steady.name());
        let first = self.told.iter().filter(|row| (row.drive, row.phase) == (drive, phase));
        let told = first.filter_map(|row| row.told.clone());
        std::iter::once(NOTHING.to_owned()).chain(told).chain([EVERY_KICK.to_owned()]).collect()
    }

    /// The row of what is `told`.
    pub(crate) fn budget_row(
        &self,
        told: &str,
        drive: &str,
        phase: TimelinePhase,
    ) -> Option<&FilterErrorsRow> {
        match told {
            NOTHING => self.row("twin", drive, phase),
            EVERY_KICK => self.row("genie", drive, phase),
            _ => self
                .told
                .iter()
                .find(|row| (row.told.as_deref(), row.drive, row.phase) == (Some(told), drive, phase.name())),
        }
    }

    /// Intensity of a random walk of the rate that costs the error of steady motion, in rad^2/s^3.
    pub(crate) fn intensity(&self, told: &str, drive: &str) -> Option<f64> {
        let row = self.budget_row(told, drive, TimelinePhase::Steady)?;
        Some(self.walk?.intensity_rad2_s3(row.rms_angle_mdeg))
    }
}

/// What the twin is told.
pub(crate) const NOTHING: &str = "nothing";
/// What the genie is told.
pub(crate) const EVERY_KICK: &str = "every kick";
