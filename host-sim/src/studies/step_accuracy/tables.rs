//! The result as a document for the terminal, as CSV and as JSON.

use motor_model::DriveMode;
use serde::Serialize;

use super::averaged_moves::AveragedRow;
use super::bursts::BURSTS;
use super::comparison::{MethodRow, StepAccuracy};
use super::method::MODEL;
use super::peers::PeerRow;
use super::steady_motion::{CONDITIONS, Deviation, DriveCondition};
use super::targets::{CostRatio, TargetResult};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::studies::averaged_motor::IdentifiedMotion;

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
    cheaper: Vec<CostRatio>,
    verdicts: Vec<TargetResult>,
}

/// A line of the CSV: one method in one mode.
#[derive(Serialize)]
struct CsvLine {
    model: &'static str,
    impacts: &'static str,
    precision: &'static str,
    step_us: f64,
    mode: &'static str,
    ns_per_step: f64,
    ns_per_ms: f64,
    times_real_time: f64,
    next_impact_rms_ns: f64,
    next_impact_max_ns: f64,
    velocity_rms_mm_s: f64,
    rate_rms_mrad_s: f64,
    flights_missed: u32,
    rate_error_percent: f64,
    rate_half_width_percent: f64,
    impacts_error_percent: Option<f64>,
    impacts_half_width_percent: Option<f64>,
    collision_error_percent: Option<f64>,
    collision_half_width_percent: Option<f64>,
    rate_at_0_3_error_percent: f64,
    rate_at_0_3_half_width_percent: f64,
    impacts_at_0_3_error_percent: Option<f64>,
    impacts_at_0_3_half_width_percent: Option<f64>,
    burst_worst_error_percent: f64,
}

impl CsvLine {
    fn new(row: &MethodRow, driven: DriveMode) -> Self {
        let mode = usize::from(driven == DriveMode::C);
        let (cost, impact_map) = (&row.cost[mode], &row.impact_map[mode]);
        let (full, small) = (&row.steady[mode], &row.steady[mode + 2]);
        let error = |deviation: &Deviation| 100.0 * deviation.relative;
        let half = |deviation: &Deviation| 100.0 * deviation.half_width;
        Self {
            model: MODEL,
            impacts: row.method.impacts(),
            precision: row.method.precision_word(),
            step_us: 1e6 * row.method.step_s,
            mode: ["B", "C"][mode],
            ns_per_step: cost.ns_per_step,
            ns_per_ms: cost.ns_per_ms,
            times_real_time: cost.times_real_time,
            next_impact_rms_ns: 1e9 * impact_map.first_impact_rms_s,
            next_impact_max_ns: 1e9 * impact_map.first_impact_max_s,
            velocity_rms_mm_s: 1e3 * impact_map.velocity_rms_m_s,
            rate_rms_mrad_s: 1e3 * impact_map.rate_rms_rad_s,
            flights_missed: impact_map.missed,
            rate_error_percent: error(&full.rate),
            rate_half_width_percent: half(&full.rate),
            impacts_error_percent: full.impacts.as_ref().map(error),
            impacts_half_width_percent: full.impacts.as_ref().map(half),
            collision_error_percent: full.collision.as_ref().map(error),
            collision_half_width_percent: full.collision.as_ref().map(half),
            rate_at_0_3_error_percent: error(&small.rate),
            rate_at_0_3_half_width_percent: half(&small.rate),
            impacts_at_0_3_error_percent: small.impacts.as_ref().map(error),
            impacts_at_0_3_half_width_percent: small.impacts.as_ref().map(half),
            burst_worst_error_percent: 100.0 * row.worst_burst_of(driven),
        }
    }

    fn cells(&self) -> Vec<String> {
        let percent = |error: Option<f64>, half: Option<f64>| match (error, half) {
            (Some(error), Some(half)) => format!("{error:+.2} +- {half:.2}"),
            _ => "none".to_owned(),
        };
        vec![
            self.impacts.replace('_', " "),
            self.precision.to_owned(),
            format!("{}", (1e3 * self.step_us).round() / 1e3),
            self.mode.to_owned(),
            format!("{:.1}", self.ns_per_step),
            format!("{:.0}", self.ns_per_ms),
            format!("{:.0}", self.times_real_time),
            format!("{:.1e}", self.next_impact_rms_ns),
            format!("{:.1e}", self.velocity_rms_mm_s),
            format!("{:.1e}", self.rate_rms_mrad_s),
            percent(Some(self.rate_error_percent), Some(self.rate_half_width_percent)),
            percent(self.impacts_error_percent, self.impacts_half_width_percent),
            percent(self.collision_error_percent, self.collision_half_width_percent),
            percent(Some(self.rate_at_0_3_error_percent), Some(self.rate_at_0_3_half_width_percent)),
            percent(self.impacts_at_0_3_error_percent, self.impacts_at_0_3_half_width_percent),
            format!("{:.2}", self.burst_worst_error_percent),
        ]
    }
}

/// Columns of the table for the terminal: the values of [`CsvLine::cells`].
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
    fn lines(&self) -> impl Iterator<Item = CsvLine> {
        self.rows.iter().flat_map(|row| [DriveMode::B, DriveMode::C].map(|mode| CsvLine::new(row, mode)))
    }

    /// The result as a document for the terminal.
    pub fn document(&self) -> Document {
        let mut rows = Table::new(&HEADER);
        self.lines().for_each(|line| rows.push(line.cells()));
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
        Document {
            blocks: vec![
                Block::Heading("Speed against error".to_owned()),
                Block::Paragraph(ABOUT.to_owned()),
                Block::Paragraph(self.reference_values()),
                Block::Table(rows),
                Block::Paragraph(ABOUT_AVERAGED.to_owned()),
                Block::Table(self.averaged_table()),
                Block::Paragraph(ABOUT_PLATE.to_owned()),
                Block::Table(self.plate_table()),
                Block::Table(ratios),
                Block::Table(targets),
            ],
        }
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
                table.push(vec![
                    format!("{}: {note}", row.name),
                    String::new(),
                    String::new(),
                    String::new(),
                    String::new(),
                    String::new(),
                ]);
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
        crate::report::files::csv(self.lines())
    }

    /// The result as one JSON object on one line.
    pub fn json(&self) -> String {
        let report = StepAccuracyJson {
            rows: &self.rows,
            conditions: CONDITIONS.into_iter().map(DriveCondition::name).collect(),
            bursts: BURSTS.iter().map(|burst| burst.name()).collect(),
            averaged: &self.averaged,
            peers: &self.peers,
            cheaper: self.cost_ratios(),
            verdicts: self.target_results(),
        };
        crate::report::files::json_line(&report)
    }
}
