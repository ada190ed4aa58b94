//! The tables of the page, and the figures of its prose.

use super::{ErrorBudget, MARKS, RotorBudget};
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::studies::filter_errors::FilterErrors;
use crate::studies::filter_errors::tables::{millidegrees, title};
use crate::studies::filter_errors::told_table::NOTHING;
use analysis::filter_errors::timeline::TimelinePhase;

/// The modes, as tables and rows name them.
pub(super) const MODES: [(&str, &str); 2] = [("B", "b"), ("C", "c")];

/// Errors in steady motion that a twin is to reach: marks, mode, milli-degrees.
const TARGETS: [(u64, &str, f64); 4] = [(1, "b", 3.5), (1, "c", 4.0), (2, "b", 3.0), (2, "c", 3.0)];

impl ErrorBudget {
    /// What fills the page.
    pub(crate) fn page_values(&self) -> Vec<PlacedValue> {
        let [height_only, tilting] = [0, 1].map(|place| self.rotors.get(place));
        let of = |rotor: Option<&RotorBudget>, text: fn(&RotorBudget) -> String| {
            rotor.map_or_else(String::new, text)
        };
        let steady = |rotor: &RotorBudget| rotor.steady().markdown();
        let motors = |rotor: &RotorBudget| rotor.motors.to_string();
        vec![
            ("motors", of(height_only, motors)),
            ("tilting_motors", of(tilting, motors)),
            ("table_height_only", of(height_only, steady)),
            ("table_tilting", of(tilting, steady)),
            ("table_shares", of(height_only, |rotor| rotor.shares().markdown())),
            ("table_targets", of(height_only, |rotor| rotor.targets().markdown())),
            ("table_phases", of(height_only, |rotor| rotor.phases().markdown())),
        ]
    }
}

impl RotorBudget {
    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    /// What the budget of so many marks found.
    pub(super) fn of_marks(&self, marks: u64) -> Option<&FilterErrors> {
        MARKS.iter().position(|&of| of == marks).and_then(|place| self.found.get(place))
    }

    /// What the rows are told.
    pub(super) fn told(&self) -> Vec<Told> {
        let names = self.found.first().map_or_else(Vec::new, FilterErrors::budget_names);
        let parts: Vec<&String> = names.iter().filter(|name| is_part(name)).collect();
        let shown = |name: &String| {
            let words: Vec<&str> = name.split('+').collect();
            match parts.iter().find(|part| !words.contains(&part.as_str())) {
                _ if words.len() == 1 => spaced(name),
                Some(left_out) => format!("all but {}", spaced(left_out)),
                None => "all of these".to_owned(),
            }
        };
        names.iter().map(|name| Told { name: name.clone(), shown: shown(name) }).collect()
    }

    /// Errors in steady motion, with the ANEES of the angle.
    fn steady(&self) -> Table {
        let mut header = vec!["told".to_owned()];
        header.extend(MODES.iter().flat_map(|(mode, _)| {
            MARKS.map(|marks| format!("{mode}, {marks} {}", if marks == 1 { "mark" } else { "marks" }))
        }));
        let mut table = Table::new(&header.iter().map(String::as_str).collect::<Vec<_>>());
        for Told { name, shown } in self.told() {
            let mut cells = vec![shown];
            for (_, mode) in MODES {
                cells.extend(self.found.iter().map(|found| {
                    let row = found.budget_row(&name, mode, TimelinePhase::Steady);
                    row.map_or_else(String::new, |row| {
                        format!("{} ({:.1})", millidegrees(row.rms_angle_mdeg), row.angle_anees)
                    })
                }));
            }
            table.push(cells);
        }
        table
    }

    /// Shares of the rate's noise that telling a part alone takes away.
    fn shares(&self) -> Table {
        let parts: Vec<Told> = self.told().into_iter().filter(|told| is_part(&told.name)).collect();
        let header = ["mode", "marks", "rad^2/s^3"].into_iter().chain(parts.iter().map(|part| &*part.shown));
        let mut table = Table::new(&header.collect::<Vec<_>>());
        for (mode, drive) in MODES {
            for (found, marks) in self.found.iter().zip(MARKS) {
                let Some(all) = found.intensity(NOTHING, drive) else { continue };
                let mut cells = vec![mode.to_owned(), marks.to_string(), format!("{all:.2e}")];
                cells.extend(parts.iter().map(|part| {
                    let left = found.intensity(&part.name, drive).map_or(f64::NAN, |left| left / all);
                    // Rounded first, so that no share is -0.
                    format!("{:.0} %", (100.0 * (1.0 - left)).round() + 0.0)
                }));
                table.push(cells);
            }
        }
        table
    }

    /// How much of the rate's noise a target leaves.
    fn targets(&self) -> Table {
        let mut table = Table::new(&[
            "mode",
            "marks",
            "target mdeg",
            "told nothing",
            "noise to take away",
            "one part that suffices",
            "every kick",
        ]);
        for (marks, drive, target_mdeg) in TARGETS {
            let Some(found) = self.of_marks(marks) else { continue };
            let rms = |name: &str| {
                found
                    .budget_row(name, drive, TimelinePhase::Steady)
                    .map_or(f64::NAN, |row| row.rms_angle_mdeg)
            };
            let intensity = found.intensity(NOTHING, drive).unwrap_or(f64::NAN);
            let allowed = found.walk.map_or(f64::NAN, |walk| walk.intensity_rad2_s3(target_mdeg));
            let told = self.told();
            let suffices: Vec<String> = told
                .iter()
                .filter(|told| is_part(&told.name) && rms(&told.name) <= target_mdeg)
                .map(|told| told.shown.clone())
                .collect();
            let taken = 1.0 - allowed / intensity;
            table.push(vec![
                drive.to_uppercase(),
                marks.to_string(),
                format!("{target_mdeg:.1}"),
                millidegrees(rms(NOTHING)),
                if taken > 0.0 { format!("{:.0} %", 100.0 * taken) } else { "none".to_owned() },
                if suffices.is_empty() { "none".to_owned() } else { suffices.join(", ") },
                millidegrees(rms("every kick")),
            ]);
        }
        table
    }

    /// Errors by phase, with two marks.
    fn phases(&self) -> Table {
        let header = ["mode", "told"].into_iter().chain(TimelinePhase::ALL.map(title));
        let mut table = Table::new(&header.collect::<Vec<_>>());
        let Some(found) = self.of_marks(2) else { return table };
        for (mode, drive) in MODES {
            for Told { name, shown } in self.told() {
                let mut cells = vec![mode.to_owned(), shown];
                cells.extend(TimelinePhase::ALL.map(|phase| {
                    let row = found.budget_row(&name, drive, phase);
                    row.map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg))
                }));
                table.push(cells);
            }
        }
        table
    }
}

/// What a row is told.
pub(super) struct Told {
    /// As the rows name it.
    pub(super) name: String,
    /// As tables show it.
    pub(super) shown: String,
}

/// Whether this names one part of the truth.
fn is_part(name: &str) -> bool {
    !name.contains('+') && !name.contains(' ') && name != NOTHING
}

/// A word of the command line as tables show it.
fn spaced(word: &str) -> String {
    word.replace('-', " ")
}
