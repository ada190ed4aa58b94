//! The filters on several scenes side by side: errors by phase, what is called good and is not, and what it costs.

use super::tables::{millidegrees, title};
use super::{DRIVES, FilterErrors, FilterTotal};
use crate::report::table::Table;
use crate::studies::beside::{SideBySide, side_by_side, worst_of};
use analysis::filter_errors::timeline::TimelinePhase;
use simulation::runs::stated_errors::StatedErrors;

/// What the figures of the table mean.
const ABOUT: &str = "Root mean square error of the angle by phase, in milli-degrees. Steady, later: of the same \
    instants, but known only 2 ms later, with the frames since. ANEES: in steady motion. Beyond 3 sigma: share of \
    the estimates of all phases whose angle is off by more than three of the standard deviations that the filter \
    states; 0.27 % of normal errors are. Good: share of the time in which the filter calls its estimate good. \
    Good, beyond 5 sigma: estimates that are called good and are off by more than five, one each 70 us, and the \
    largest error of these. A tick: time to take in what 10 us bring. Rig: time that plant and instruments take \
    for a second of motor time. Both are of one machine and of the motor that takes least.";

impl FilterErrors {
    /// Every filter in every mode on every scene, the first under the name `first`.
    pub(super) fn side_by_side(&self, first: &str) -> SideBySide {
        SideBySide {
            tables: self.table_of_scenes(first).cut(3, &["ANEES", "steady, later"]),
            about: self.about_scenes(first),
        }
    }

    /// What the table shows, and of how many motors.
    fn about_scenes(&self, first: &str) -> String {
        let motors = |errors: &Self| errors.rows.first().map_or(0, |row| row.runs);
        let counts: Vec<String> = side_by_side(first, self, &self.beside)
            .map(|(name, errors)| format!("{name}: {}", motors(errors)))
            .collect();
        format!("{ABOUT} Motors in each mode: {}.", counts.join("; "))
    }

    fn table_of_scenes(&self, first: &str) -> Table {
        let header = ["scene", "drive", "filter"].into_iter().chain(TimelinePhase::ALL.map(title)).chain([
            "ANEES",
            "beyond 3 sigma",
            "good",
            "good, beyond 5 sigma",
            "worst mdeg",
            "steady, later",
            "ns a tick",
            "rig s/s",
        ]);
        let mut table = Table::new(&header.collect::<Vec<_>>());
        for (name, errors) in side_by_side(first, self, &self.beside) {
            for total in &errors.totals {
                table.push(errors.cells(name, total));
            }
        }
        table
    }

    fn cells(&self, scene: &str, total: &FilterTotal) -> Vec<String> {
        let FilterTotal { filter, drive, stated, good, tick_ns } = total;
        let StatedErrors { beyond_3_sigma, good_beyond_5_sigma, good_beyond_5_sigma_worst_mdeg } = stated;
        let of_phase = |phase| self.row(filter, drive, phase);
        let mut cells = vec![scene.to_owned(), drive.to_uppercase(), filter.replace('_', " ")];
        cells.extend(
            TimelinePhase::ALL.map(|phase| {
                of_phase(phase).map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg))
            }),
        );
        let steady = of_phase(TimelinePhase::Steady);
        cells.push(steady.map_or_else(String::new, |row| format!("{:.2}", row.anees)));
        cells.push(format!("{:.2} %", 100.0 * beyond_3_sigma.unwrap_or(f64::NAN)));
        cells.push(format!("{:.1} %", 100.0 * good));
        cells.push(good_beyond_5_sigma.to_string());
        cells.push(worst_of(*good_beyond_5_sigma > 0, || millidegrees(*good_beyond_5_sigma_worst_mdeg)));
        let smoothed = self.row(&format!("{filter}_smoothed"), drive, TimelinePhase::Steady);
        cells.push(smoothed.map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg)));
        cells.push(format!("~{tick_ns:.0}"));
        let drive_place = DRIVES.iter().position(|(_, name)| name == drive).unwrap_or(0);
        cells.push(format!("~{:.2}", self.rig_s_per_s[drive_place]));
        cells
    }
}
