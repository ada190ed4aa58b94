//! The costs in words: a document for the terminal, the values of its page, CSV and JSON for programs.

use serde_json::json;

use super::{DRIVES, FilterCosts, FilterCostsRow, SAMPLE_RATES_HZ};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use analysis::filter_costs::replay::OperationCosts;
use simulation::runs::simulate::Precision;

const ABOUT: &str = "Motors drawn within Table 1's tolerances, driven at full strength; the filters know the nominal \
    motor at most. Error of the angle at the present in steady motion, the camera's latency included. Costs are means \
    of a camera frame, a vibrometer sample, a prediction, and of all operations in 10 us of motor time: in ns on this \
    machine, and in instructions of an emulated Cortex-M4F.";

const COSTS: [&str; 4] = ["frame", "sample", "prediction", "10 us"];

/// Columns of the CSV: the fields of a row, each cost one of its own.
const CSV_HEADER: &str = "filter,precision,ldv_sample_rate_hz,drive,rms_angle_mdeg,rms_rate_rad_s,camera_frame_ns,\
    vibrometer_sample_ns,prediction_ns,tick_ns,camera_frame_instructions,vibrometer_sample_instructions,\
    prediction_instructions,tick_instructions,runs";

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
            ("table_costs", self.costs_by_filter().markdown()),
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
        let fixed = ["ns: frame", "sample", "predict", "10 us", "M4F: frame", "sample", "predict", "10 us"];
        let header: Vec<&str> =
            ["filter"].into_iter().chain(errors.iter().map(String::as_str)).chain(fixed).collect();
        let mut table = Table::new(&header);
        let [(_, first), ..] = DRIVES;
        let shown =
            |row: &&FilterCostsRow| row.drive == first && row.ldv_sample_rate_hz >= SAMPLE_RATES_HZ[0];
        for row in self.rows.iter().filter(shown) {
            let of_modes = DRIVES.map(|(_, drive)| self.rows.iter().find(|other| other.is_in(row, drive)));
            let mut cells = vec![format!("{}, {}", row.filter.replace('_', " "), row.precision.name())];
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
        let columns = |row: &FilterCostsRow| {
            let variant = (row.filter, row.precision, row.ldv_sample_rate_hz, row.drive);
            let instructions = row.instructions.map_or([None; 4], |cost| cost.each().map(Some));
            (variant, row.rms_angle_mdeg, row.rms_rate_rad_s, row.ns, instructions, row.runs)
        };
        crate::report::files::csv(Some(CSV_HEADER), self.rows.iter().map(columns))
    }

    /// The rows as one JSON object on one line.
    pub fn json(&self) -> String {
        format!("{}\n", json!({"rows": self.rows}))
    }
}

impl FilterCostsRow {
    /// Whether this is the variant of `other` in `drive`.
    fn is_in(&self, other: &Self, drive: &str) -> bool {
        let same_rate = self.ldv_sample_rate_hz.total_cmp(&other.ldv_sample_rate_hz).is_eq();
        (self.filter, self.precision, self.drive) == (other.filter, other.precision, drive) && same_rate
    }
}

fn cells(row: &FilterCostsRow) -> Vec<String> {
    let mut cells = vec![
        row.drive.to_owned(),
        row.filter.to_owned(),
        row.precision.name().to_owned(),
        format!("{:.0}", 1e-3 * row.ldv_sample_rate_hz),
        figure(row.rms_angle_mdeg),
        format!("{:.3}", row.rms_rate_rad_s),
    ];
    cells.extend(costs(Some(row.ns)));
    cells.extend(costs(row.instructions));
    cells
}

fn costs(cost: Option<OperationCosts>) -> [String; 4] {
    cost.map_or_else(Default::default, |cost| cost.each().map(figure))
}

/// The mean of both modes.
fn mean([b, c]: [Option<OperationCosts>; 2]) -> [String; 4] {
    let (Some(b), Some(c)) = (b, c) else { return Default::default() };
    let (b, c) = (b.each(), c.each());
    std::array::from_fn(|cost| figure(0.5 * (b[cost] + c[cost])))
}

/// Two significant digits at least.
fn figure(value: f64) -> String {
    match value {
        value if value < 10.0 => format!("{value:.2}"),
        value if value < 100.0 => format!("{value:.1}"),
        value => format!("{value:.0}"),
    }
}
