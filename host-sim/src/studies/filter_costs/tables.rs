//! The costs in words: a document for the terminal, the values of its page, CSV and JSON for programs.

use serde::Serialize;

use super::replay::OperationCosts;
use super::{DRIVES, FilterCosts, FilterCostsRow, SAMPLE_RATES_HZ};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::runs::simulate::Precision;

const ABOUT: &str = "Motors drawn within Table 1's tolerances, driven at full strength; the filters know the nominal \
    motor at most. Error of the angle at the present in steady motion, the camera's latency included. Costs are means \
    of a camera frame, a vibrometer sample, a prediction, and of all operations in 10 us of motor time: in ns on this \
    machine, and in instructions of an emulated Cortex-M4F.";

const COSTS: [&str; 4] = ["frame", "sample", "prediction", "10 us"];

/// A line of the CSV: a row, its costs as columns.
#[derive(Serialize)]
struct CsvLine<'a> {
    filter: &'a str,
    precision: Precision,
    ldv_sample_rate_hz: f64,
    drive: &'a str,
    rms_angle_mdeg: f64,
    rms_rate_rad_s: f64,
    camera_frame_ns: f64,
    vibrometer_sample_ns: f64,
    prediction_ns: f64,
    tick_ns: f64,
    camera_frame_instructions: Option<f64>,
    vibrometer_sample_instructions: Option<f64>,
    prediction_instructions: Option<f64>,
    tick_instructions: Option<f64>,
    runs: u64,
}

impl FilterCosts {
    /// The whole table.
    pub fn document(&self) -> Document {
        let costs = |unit: &str| COSTS.map(|cost| format!("{cost} {unit}"));
        let header = ["drive", "filter", "precision", "LDV kHz", "rms mdeg", "rad/s"].map(str::to_owned);
        let header: Vec<String> = header.into_iter().chain(costs("ns")).chain(costs("M4F")).collect();
        let mut table = Table::new(&header.iter().map(String::as_str).collect::<Vec<_>>());
        self.rows.iter().map(cells).for_each(|cells| table.push(cells));
        let runs = self.rows.first().map_or(0, |row| row.runs);
        Document {
            blocks: vec![
                Block::Heading("What each filter costs, and how far it is off".to_owned()),
                Block::Paragraph(ABOUT.to_owned()),
                Block::Paragraph(format!("{runs} motors in each mode.")),
                Block::Table(table),
            ],
        }
    }

    /// The values of its page: each filter at the default sample rate, modes side by side.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let runs = self.rows.first().map_or(0, |row| row.runs);
        vec![
            ("cost_motors", runs.to_string()),
            ("twin_cost_factor", self.twin_cost_factor()),
            ("table_costs", Document { blocks: vec![Block::Table(self.costs_by_filter())] }.markdown()),
        ]
    }

    /// Instructions of a tick with `twin` over those with `impact_aided`, at the default sample rate, over both modes.
    fn twin_cost_factor(&self) -> String {
        let instructions = |filter: &str| -> Option<f64> {
            let of_filter = self.rows.iter().filter(|row| {
                row.filter == filter
                    && row.precision == Precision::F32
                    && row.ldv_sample_rate_hz >= SAMPLE_RATES_HZ[0]
            });
            of_filter.map(|row| row.instructions.map(|cost| cost.tick)).sum()
        };
        let factor = instructions("twin").zip(instructions("impact_aided"));
        factor.map_or_else(|| "-".to_owned(), |(twin, impact_aided)| format!("{:.1}", twin / impact_aided))
    }

    fn costs_by_filter(&self) -> Table {
        let errors = DRIVES.map(|(_, drive)| format!("{} mdeg", drive.to_uppercase()));
        let fixed =
            ["ns: frame", "sample", "prediction", "10 us", "M4F: frame", "sample", "prediction", "10 us"];
        let header: Vec<&str> =
            ["filter"].into_iter().chain(errors.iter().map(String::as_str)).chain(fixed).collect();
        let mut table = Table::new(&header);
        let [(_, first), ..] = DRIVES;
        let shown =
            |row: &&FilterCostsRow| row.drive == first && row.ldv_sample_rate_hz >= SAMPLE_RATES_HZ[0];
        for row in self.rows.iter().filter(shown) {
            let of_modes = DRIVES.map(|(_, drive)| self.rows.iter().find(|other| other.is_in(row, drive)));
            let mut cells = vec![format!("{}, {}", row.filter.replace('_', " "), name(row.precision))];
            cells.extend(of_modes.map(|row| row.map_or_else(String::new, |row| figure(row.rms_angle_mdeg))));
            cells.extend(mean(of_modes.map(|row| row.map(|row| row.ns))).map(|ns| format!("~{ns}")));
            cells.extend(mean(of_modes.map(|row| row.and_then(|row| row.instructions))));
            table.push(cells);
        }
        table
    }

    /// The table as CSV.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn csv(&self) -> Result<String, OutputError> {
        crate::report::files::csv(self.rows.iter().map(CsvLine::of))
    }

    /// The rows as one JSON array on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(&self.rows)
    }
}

impl FilterCostsRow {
    /// Whether this is the variant of `other` in `drive`.
    fn is_in(&self, other: &Self, drive: &str) -> bool {
        let same_rate = self.ldv_sample_rate_hz.total_cmp(&other.ldv_sample_rate_hz).is_eq();
        (self.filter, self.precision, self.drive) == (other.filter, other.precision, drive) && same_rate
    }
}

impl<'a> CsvLine<'a> {
    fn of(row: &'a FilterCostsRow) -> Self {
        let instructions = |of: fn(&OperationCosts) -> f64| row.instructions.as_ref().map(of);
        Self {
            filter: row.filter,
            precision: row.precision,
            ldv_sample_rate_hz: row.ldv_sample_rate_hz,
            drive: row.drive,
            rms_angle_mdeg: row.rms_angle_mdeg,
            rms_rate_rad_s: row.rms_rate_rad_s,
            camera_frame_ns: row.ns.camera_frame,
            vibrometer_sample_ns: row.ns.vibrometer_sample,
            prediction_ns: row.ns.prediction,
            tick_ns: row.ns.tick,
            camera_frame_instructions: instructions(|cost| cost.camera_frame),
            vibrometer_sample_instructions: instructions(|cost| cost.vibrometer_sample),
            prediction_instructions: instructions(|cost| cost.prediction),
            tick_instructions: instructions(|cost| cost.tick),
            runs: row.runs,
        }
    }
}

/// `f32` or `f64`.
const fn name(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    }
}

fn cells(row: &FilterCostsRow) -> Vec<String> {
    let mut cells = vec![
        row.drive.to_owned(),
        row.filter.to_owned(),
        name(row.precision).to_owned(),
        format!("{:.0}", 1e-3 * row.ldv_sample_rate_hz),
        figure(row.rms_angle_mdeg),
        format!("{:.3}", row.rms_rate_rad_s),
    ];
    cells.extend(costs(Some(row.ns)));
    cells.extend(costs(row.instructions));
    cells
}

fn costs(cost: Option<OperationCosts>) -> [String; 4] {
    let Some(OperationCosts { camera_frame, vibrometer_sample, prediction, tick }) = cost else {
        return Default::default();
    };
    [camera_frame, vibrometer_sample, prediction, tick].map(figure)
}

/// The mean of both modes.
fn mean([b, c]: [Option<OperationCosts>; 2]) -> [String; 4] {
    let (Some(b), Some(c)) = (b, c) else { return Default::default() };
    let half = |b: f64, c: f64| 0.5 * (b + c);
    costs(Some(OperationCosts {
        camera_frame: half(b.camera_frame, c.camera_frame),
        vibrometer_sample: half(b.vibrometer_sample, c.vibrometer_sample),
        prediction: half(b.prediction, c.prediction),
        tick: half(b.tick, c.tick),
    }))
}

/// Two significant digits at least.
fn figure(value: f64) -> String {
    match value {
        value if value < 10.0 => format!("{value:.2}"),
        value if value < 100.0 => format!("{value:.1}"),
        value => format!("{value:.0}"),
    }
}
