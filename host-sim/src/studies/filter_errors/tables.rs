//! The errors in words: a document for the terminal, the values of its page, CSV and JSON for programs.

use serde_json::json;

use super::consistency::ConsistencyTest;
use super::{DRIVES, FilterErrors, FilterErrorsRow};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::studies::beside::FIRST;
use analysis::filter_errors::comparison::names;
use analysis::filter_errors::timeline::TimelinePhase;
use simulation::runs::filter::SMOOTHER_LAG_MS;

const ABOUT: &str = "Motors drawn within Table 1's tolerances, Coulomb friction, located impacts; the filters know the \
    nominal motor at most. Errors of the angle at the present, every 70 us. ANEES: of angle and rate together, 1 in a \
    consistent filter; NIS: of the camera's innovations, likewise. An asterisk marks a value outside its two-sided 95 \
    % bounds, which account for how long errors are correlated. At rest the rate is exactly zero, so that the ANEES of \
    the angle is tested; the stop is mostly rest, and tested by the upper bound alone. False: the health is good, and \
    the angle wrong by more than six standard deviations and 50 milli-degrees. Whiteness: correlation of neighbouring \
    innovations. smoothed: of 2 ms ago, from the frames since as well. genie: a lower bound, the Kalman filter that is \
    given every kick of the rate exactly, or to 10 or 3 %.";

const ABOUT_IMPACTS: &str = "An impact is two measurements of the stator, the gap between rotor and tooth and the \
    approach given the gap, each with an innovation. NIS is 1 and whiteness 0 where the model predicts them as it \
    says. An asterisk marks a value outside its two-sided 95 % bounds around 1. Refused: the impact fits no pair of \
    teeth, or so badly that its kick is not used.";

/// Columns of the CSV: the fields of a row, of bounds the lower and the upper one.
const CSV_HEADER: &str = "filter,drive,phase,rms_angle_mdeg,p999_angle_mdeg,rms_rate_rad_s,times_genie,anees,anees_low,\
    anees_high,angle_anees,angle_anees_low,angle_anees_high,rate_anees,nis,nis_low,nis_high,whiteness,whiteness_bound,\
    gap_nis,gap_nis_low,gap_nis_high,gap_whiteness,approach_nis,approach_nis_low,approach_nis_high,approach_whiteness,\
    impacts_refused,rejected,restarts,missing,good,degraded,unusable,false_valid,beyond_3_sigma,good_beyond_5_sigma,\
    good_beyond_5_sigma_worst_mdeg,runs,beside,\
    told";

impl FilterErrors {
    /// The whole table.
    pub fn document(&self) -> Document {
        let mut table = Table::new(&[
            "drive",
            "phase",
            "filter",
            "rms mdeg",
            "99.9 %",
            "rad/s",
            "per genie",
            "ANEES",
            "of the angle",
            "NIS",
            "whiteness",
            "rejected",
            "restarts",
            "good",
            "false",
        ]);
        self.rows.iter().map(cells).for_each(|cells| table.push(cells));
        let runs = self.rows.first().map_or(0, |row| row.runs);
        let mut blocks = vec![
            Block::Heading("Angle and rate against the truth".to_owned()),
            Block::Paragraph(ABOUT.to_owned()),
            Block::Paragraph(format!("{runs} motors in each mode.")),
            Block::Table(table),
            Block::Heading("The twin's impacts".to_owned()),
            Block::Paragraph(ABOUT_IMPACTS.to_owned()),
            Block::Table(self.impacts()),
        ];
        if !self.told.is_empty() {
            blocks.extend(self.budget_blocks());
        }
        if !self.beside.is_empty() {
            blocks.extend(self.side_by_side(FIRST).blocks());
        }
        Document { blocks }
    }

    /// The values of its page: root mean square errors, and whether the filters know them; the first scene under the
    /// name `first`.
    pub fn page_values(&self, first: &str) -> Vec<PlacedValue> {
        let rms = |filter: &str, drive: &str, phase| {
            self.row(filter, drive, phase).map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg))
        };
        let runs = self.rows.first().map_or(0, |row| row.runs);
        let mut values = vec![
            ("twin_steady_b_mdeg", rms("twin", "b", TimelinePhase::Steady)),
            ("twin_steady_c_mdeg", rms("twin", "c", TimelinePhase::Steady)),
            ("twin_smoothed_b_mdeg", rms("twin_smoothed", "b", TimelinePhase::Steady)),
            ("twin_smoothed_c_mdeg", rms("twin_smoothed", "c", TimelinePhase::Steady)),
            ("rest_1s_b_mdeg", rms("twin", "b", TimelinePhase::Rest1S)),
            ("rest_1s_c_mdeg", rms("twin", "c", TimelinePhase::Rest1S)),
            ("error_motors", runs.to_string()),
            ("smoother_lag_ms", SMOOTHER_LAG_MS.to_string()),
            ("table_errors", self.errors_by_phase().markdown()),
        ];
        values.extend(self.side_by_side(first).page_values());
        values
    }

    /// Errors of each filter in each phase.
    fn errors_by_phase(&self) -> Table {
        let header =
            ["drive", "filter"].into_iter().chain(TimelinePhase::ALL.map(title)).chain(["99.9 %", "ANEES"]);
        let mut table = Table::new(&header.collect::<Vec<_>>());
        for (_, drive) in DRIVES {
            for filter in names() {
                let of_phases = TimelinePhase::ALL.iter().map(|&phase| self.row(filter, drive, phase));
                let mut row = vec![drive.to_uppercase(), filter.replace('_', " ")];
                row.extend(
                    of_phases.map(|row| row.map_or_else(String::new, |row| millidegrees(row.rms_angle_mdeg))),
                );
                let steady = self.row(filter, drive, TimelinePhase::Steady);
                row.extend(steady.map(|row| millidegrees(row.p999_angle_mdeg)));
                row.extend(steady.map(|row| format!("{:.2}", row.anees)));
                table.push(row);
            }
        }
        table
    }

    /// The innovations at impacts, of the filter that predicts them, in the phases of motion.
    fn impacts(&self) -> Table {
        let mut table =
            Table::new(&["drive", "phase", "gap NIS", "whiteness", "approach NIS", "whiteness", "refused"]);
        for row in self.rows.iter().filter(|row| row.gap_nis.is_finite()) {
            let nis = |value: f64, (low, high): (f64, f64)| {
                format!("{value:.2}{}", if value >= low && value <= high { "" } else { "*" })
            };
            table.push(vec![
                row.drive.to_owned(),
                row.phase.to_owned(),
                nis(row.gap_nis, row.gap_nis_bounds),
                format!("{:+.2}", row.gap_whiteness),
                nis(row.approach_nis, row.approach_nis_bounds),
                format!("{:+.2}", row.approach_whiteness),
                format!("{:.1} %", 100.0 * row.impacts_refused),
            ]);
        }
        table
    }

    /// The table as CSV.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn csv(&self) -> Result<String, OutputError> {
        crate::report::files::csv(Some(CSV_HEADER), self.all_rows())
    }

    /// The rows as one JSON object on one line.
    pub fn json(&self) -> String {
        format!("{}\n", json!({"rows": self.all_rows().collect::<Vec<_>>()}))
    }
}

/// A phase as a heading.
pub(crate) const fn title(phase: TimelinePhase) -> &'static str {
    match phase {
        TimelinePhase::SpinUp => "spin-up",
        TimelinePhase::Steady => "steady",
        TimelinePhase::Reversal => "reversal",
        TimelinePhase::Stop => "stop",
        TimelinePhase::Rest100Ms => "rest, 100 ms",
        TimelinePhase::Rest1S => "rest, 1 s",
    }
}

fn cells(row: &FilterErrorsRow) -> Vec<String> {
    let phase = TimelinePhase::ALL.into_iter().find(|phase| phase.name() == row.phase);
    let errors_within = phase.is_none_or(|phase| row.errors_within(phase));
    let of_angle = phase.is_some_and(|phase| ConsistencyTest::of(phase) == ConsistencyTest::Angle);
    let marked = |text: String, fine: bool| if fine { text } else { text + "*" };
    vec![
        row.drive.to_owned(),
        row.phase.to_owned(),
        row.filter.to_owned(),
        millidegrees(row.rms_angle_mdeg),
        millidegrees(row.p999_angle_mdeg),
        format!("{:.3}", row.rms_rate_rad_s),
        format!("{:.1}", row.times_genie),
        marked(format!("{:.2}", row.anees), errors_within || of_angle),
        marked(format!("{:.2}", row.angle_anees), errors_within || !of_angle),
        marked(format!("{:.3}", row.nis), row.innovations_within()),
        marked(format!("{:+.3}", row.whiteness), row.innovations_white()),
        format!("{:.2} %", 100.0 * row.rejected),
        row.restarts.to_string(),
        format!("{:.1} %", 100.0 * row.good),
        format!("{:.2} %", 100.0 * row.false_valid),
    ]
}

/// Two significant digits at least.
pub(crate) fn millidegrees(angle_mdeg: f64) -> String {
    if angle_mdeg < 10.0 { format!("{angle_mdeg:.2}") } else { format!("{angle_mdeg:.1}") }
}
