//! The result as a document for the terminal, as CSV and as JSON.

use motor_model::DriveMode;
use serde::Serialize;

use super::comparison::StepAccuracy;
use super::targets::{CostRatio, TargetResult};
use super::tilting_forms::TiltingFormRow;
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use analysis::averaged_motor::IdentifiedMotion;
use analysis::step_accuracy::averaged_moves::AveragedRow;
use analysis::step_accuracy::bursts::BURSTS;
use analysis::step_accuracy::method::MODEL;
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::peers::PeerRow;
use analysis::step_accuracy::steady_motion::{CONDITIONS, Deviation, DriveCondition};

const ABOUT: &str = "Method: motor_model::Motor, the nominal motor, Coulomb friction. Reference: an event-driven \
    integrator. Next impact: error of the time of the next impact, and of vertical velocity and rate just after the \
    impact that follows it, from equal states of steady motion, root mean square. Mean rate, impacts per second \
    (faster than 1 mm/s) and collision frequency (largest line below 5 kHz): error of steady motion in per cent, +- \
    two standard errors over independent runs. Burst: largest error of the net displacement of a mode's bursts of 2 \
    to 10 cycles at 0.3. Costs: least of several batches, at full drive.";
const ABOUT_AVERAGED: &str = "Averaged motor, identified from the full one at 10 us: mean rate, time constant, \
    diffusion of the angle, +- two standard errors. Cost of a step of 0.1 s. Error of the mean of moves of 1 s from \
    rest against runs with other seeds than the identification; standard deviation of such moves over that of these \
    runs. The averaged motor has no single impacts and no bursts.";
const ABOUT_PLATE: &str = "A ball on a vibrating plate (the rotor, and a tooth in mode C at full drive, \
    infinitely heavy), 0.1 s: a problem for any integrator with events. Error: time of the first impact against the \
    closed form, root mean square over 16 heights.";

/// The JSON object of the study.
#[derive(Serialize)]
struct StepAccuracyJson<'a> {
    rows: &'a [MethodRow],
    conditions: Vec<String>,
    bursts: Vec<String>,
    averaged: &'a [AveragedRow],
    peers: &'a [PeerRow],
    tilting: &'a [TiltingFormRow],
    cheaper: Vec<CostRatio>,
    verdicts: Vec<TargetResult>,
}

/// Columns of the CSV, a row for each method and mode: the values of [`columns`].
const CSV_HEADER: &str = "model,impacts,precision,step_us,mode,ns_per_step,ns_per_ms,times_real_time,\
    next_impact_rms_ns,next_impact_max_ns,velocity_rms_mm_s,rate_rms_mrad_s,flights_missed,rate_error_percent,\
    rate_half_width_percent,impacts_error_percent,impacts_half_width_percent,collision_error_percent,\
    collision_half_width_percent,rate_at_0_3_error_percent,rate_at_0_3_half_width_percent,\
    impacts_at_0_3_error_percent,impacts_at_0_3_half_width_percent,burst_worst_error_percent";

/// Names of the driven modes, in the order of the costs of a [`MethodRow`].
const MODES: [(DriveMode, &str); 2] = [(DriveMode::B, "B"), (DriveMode::C, "C")];

/// Errors of steady motion at full drive of a mode, then at 0.3 of it.
fn deviations(row: &MethodRow, mode: usize) -> [Option<Deviation>; 5] {
    let (full, small) = (&row.steady[mode], &row.steady[mode + 2]);
    [Some(full.rate), full.impacts, full.collision, Some(small.rate), small.impacts]
}

/// The columns of a method in a mode.
fn columns(row: &MethodRow, mode: usize) -> impl Serialize + use<> {
    let (method, map) = (&row.method, &row.impact_map[mode]);
    let name = (MODEL, method.impacts(), method.precision.name(), 1e6 * method.step_s, MODES[mode].1);
    let next_impact = [1e9 * map.first_impact_rms_s, 1e9 * map.first_impact_max_s];
    let after = (1e3 * map.velocity_rms_m_s, 1e3 * map.rate_rms_rad_s, map.missed);
    let percent = |deviation: Option<Deviation>| {
        let both = |of: fn(Deviation) -> f64| deviation.map(|deviation| 100.0 * of(deviation));
        [both(|deviation| deviation.relative), both(|deviation| deviation.half_width)]
    };
    let burst_percent = 100.0 * row.worst_burst_of(MODES[mode].0);
    (name, row.cost[mode], next_impact, after, deviations(row, mode).map(percent), burst_percent)
}

/// The cells of a method in a mode on the terminal.
fn cells(row: &MethodRow, mode: usize) -> Vec<String> {
    let (method, cost, map) = (&row.method, &row.cost[mode], &row.impact_map[mode]);
    let mut cells = vec![
        method.impacts().replace('_', " "),
        method.precision.name().to_owned(),
        format!("{}", (1e9 * method.step_s).round() / 1e3),
        MODES[mode].1.to_owned(),
        format!("{:.1}", cost.ns_per_step),
        format!("{:.0}", cost.ns_per_ms),
        format!("{:.0}", cost.times_real_time),
        format!("{:.1e}", 1e9 * map.first_impact_rms_s),
        format!("{:.1e}", 1e3 * map.velocity_rms_m_s),
        format!("{:.1e}", 1e3 * map.rate_rms_rad_s),
    ];
    let percent = |deviation: Deviation| {
        format!("{:+.2} +- {:.2}", 100.0 * deviation.relative, 100.0 * deviation.half_width)
    };
    cells.extend(deviations(row, mode).map(|found| found.map_or_else(|| "none".to_owned(), percent)));
    cells.push(format!("{:.2}", 100.0 * row.worst_burst_of(MODES[mode].0)));
    cells
}

/// Columns of the table for the terminal: the values of [`cells`].
const HEADER: [&str; 16] = [
    "impacts",
    "precision",
    "step us",
    "mode",
    "ns/step",
    "ns per ms",
    "x real time",
    "next impact ns",
    "then mm/s",
    "then mrad/s",
    "rate %",
    "impacts/s %",
    "collision Hz %",
    "rate % at 0.3",
    "impacts/s % at 0.3",
    "burst %",
];

impl StepAccuracy {
    /// `of` each method in each mode.
    fn by_mode<T>(&self, of: fn(&MethodRow, usize) -> T) -> impl Iterator<Item = T> {
        self.rows.iter().flat_map(move |row| [0, 1].map(|mode| of(row, mode)))
    }

    /// The result as a document for the terminal.
    pub fn document(&self) -> Document {
        let mut rows = Table::new(&HEADER);
        self.by_mode(cells).for_each(|cells| rows.push(cells));
        let mut ratios =
            Table::new(&["located at 10 us in f64, at equal error", "times cheaper than end of step"]);
        for one in self.cost_ratios() {
            let bound = if one.at_least { "more than " } else { "" };
            ratios.push(vec![one.error, format!("{bound}{:.1}", one.times)]);
        }
        let mut targets = Table::new(&["target", "found", ""]);
        for result in self.target_results() {
            let word = if result.met { "met" } else { "missed" };
            targets.push(vec![result.target, result.found, word.to_owned()]);
        }
        let mut blocks = vec![
            Block::Heading("Speed against error".to_owned()),
            Block::Paragraph(ABOUT.to_owned()),
            Block::Paragraph(self.reference_values()),
            Block::Table(rows),
        ];
        blocks.extend(self.tilting_blocks());
        blocks.extend([
            Block::Paragraph(ABOUT_AVERAGED.to_owned()),
            Block::Table(self.averaged_table()),
            Block::Paragraph(ABOUT_PLATE.to_owned()),
            Block::Table(self.plate_table()),
            Block::Table(ratios),
            Block::Table(targets),
        ]);
        Document { blocks }
    }

    /// One paragraph with the values of the reference.
    fn reference_values(&self) -> String {
        let Some(row) = self.rows.first() else { return String::new() };
        let steady = CONDITIONS.iter().zip(&row.steady).map(|(condition, errors)| {
            let impacts = errors
                .impacts
                .map_or("no impacts".to_owned(), |impacts| format!("{:.0} impacts/s", impacts.converged));
            let line = errors.collision.map_or(String::new(), |line| format!(", {:.0} Hz", line.converged));
            format!("{} {:+.4} rad/s, {impacts}{line}", condition.name(), errors.rate.converged)
        });
        let bursts = BURSTS.iter().zip(&row.bursts);
        let bursts =
            bursts.map(|(burst, error)| format!("{} {:+.4} mdeg", burst.name(), error.converged_mdeg));
        let all: Vec<String> = steady.chain(bursts).collect();
        format!("Reference: {}.", all.join("; "))
    }

    fn averaged_table(&self) -> Table {
        let mut table = Table::new(&[
            "averaged",
            "rad/s",
            "time constant ms",
            "diffusion mrad^2/s",
            "ns/step",
            "x real",
            "1 s move %",
            "its spread",
        ]);
        for row in &self.averaged {
            let IdentifiedMotion {
                rate_rad_s,
                rate_error_rad_s,
                time_constant_s,
                time_constant_error_s,
                diffusion_rad2_s,
                diffusion_error_rad2_s,
            } = row.identified;
            table.push(vec![
                row.condition.clone(),
                format!("{rate_rad_s:+.4} +- {:.4}", 2.0 * rate_error_rad_s),
                format!("{:.2} +- {:.2}", 1e3 * time_constant_s, 2e3 * time_constant_error_s),
                format!("{:.3} +- {:.3}", 1e6 * diffusion_rad2_s, 2e6 * diffusion_error_rad2_s),
                format!("{:.1}", row.cost.ns_per_step),
                format!("{:.1e}", row.cost.times_real_time),
                format!("{:+.2} +- {:.2}", 100.0 * row.move_relative, 100.0 * row.move_half_width),
                format!("{:.2}", row.spread_ratio),
            ]);
        }
        table
    }

    fn plate_table(&self) -> Table {
        let mut table =
            Table::new(&["ball on a plate", "us", "ns/step", "x real", "first impact ns", "impacts"]);
        for row in &self.peers {
            let (Some(cost), Some(error)) = (row.cost, row.first_impact_rms_s) else {
                let note = row.note.clone().unwrap_or_default();
                let mut cells = vec![String::new(); 6];
                cells[0] = format!("{}: {note}", row.name);
                table.push(cells);
                continue;
            };
            table.push(vec![
                row.name.clone(),
                format!("{}", (1e9 * row.step_s).round() / 1e3),
                format!("{:.1}", cost.ns_per_step),
                if cost.times_real_time < 10.0 {
                    format!("{:.2}", cost.times_real_time)
                } else {
                    format!("{:.0}", cost.times_real_time)
                },
                format!("{:.1e}", 1e9 * error),
                row.impacts.map_or(String::new(), |impacts| impacts.to_string()),
            ]);
        }
        table
    }

    /// The result as CSV, one line for each method and mode.
    ///
    /// # Errors
    /// When a line cannot be serialized.
    pub fn csv(&self) -> Result<String, OutputError> {
        crate::report::files::csv(Some(CSV_HEADER), self.by_mode(columns))
    }

    /// The result as one JSON object on one line.
    pub fn json(&self) -> String {
        let report = StepAccuracyJson {
            rows: &self.rows,
            conditions: CONDITIONS.into_iter().map(DriveCondition::name).collect(),
            bursts: BURSTS.iter().map(|burst| burst.name()).collect(),
            averaged: &self.averaged,
            peers: &self.peers,
            tilting: &self.tilting,
            cheaper: self.cost_ratios(),
            verdicts: self.target_results(),
        };
        crate::report::files::json_line(&report)
    }
}
