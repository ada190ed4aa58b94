//! The calibration in words: a document for the terminal, the values of its page, CSV and JSON for programs.

use serde_json::json;

use super::{CalibrationOutcome, CalibrationSummary, Calibrations, budget, pilot};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::studies::beside::FIRST;
use simulation::math::statistics::NORMAL_95;

const ABOUT: &str = "Errors are those found less the gyroscope's true ones at the middle of the plan, simulated. \
    sigma: the standard deviation that the fit states without the truth; 95 %: 1.96 of it to either side. Parts of the \
    error: coning (the gyroscope turns about the rotor's own axis, the reference is the angle seen from above), the \
    error of the reference, and the gyroscope's noise; the budget has the others. The strength of coning is found from \
    the residuals.";

impl CalibrationOutcome {
    fn table(&self) -> Table {
        let mut table = Table::new(&[
            "",
            "found",
            "95 %",
            "truth",
            "error",
            "sigma",
            "by coning",
            "by the reference",
            "by the gyroscope",
        ]);
        for (name, unit, found, error, sigma, parts) in [
            (
                "scale factor",
                "ppm",
                self.scale_factor_ppm,
                self.scale_factor_error_ppm,
                self.scale_factor_sigma_ppm,
                [self.scale_factor_coning_ppm, self.scale_factor_reference_ppm, self.scale_factor_noise_ppm],
            ),
            (
                "bias",
                "deg/h",
                self.bias_deg_h,
                self.bias_error_deg_h,
                self.bias_sigma_deg_h,
                [self.bias_coning_deg_h, self.bias_reference_deg_h, self.bias_noise_deg_h],
            ),
        ] {
            let mut cells = vec![
                format!("{name}, {unit}"),
                format!("{found:+.2}"),
                format!("+-{:.2}", NORMAL_95 * sigma),
                format!("{:+.2}", found - error),
                format!("{error:+.2}"),
                format!("{sigma:.2}"),
            ];
            cells.extend(parts.map(|part| format!("{part:+.2}")));
            table.push(cells);
        }
        self.push_others(&mut table);
        table
    }

    /// Non-linearity and misalignment, whose parts are not told apart.
    fn push_others(&self, table: &mut Table) {
        let misalignment = |name, error| (name, 0.0, error, self.misalignment_sigma_mrad);
        let others = [
            (
                "non-linearity, ppm",
                self.nonlinearity_ppm,
                self.nonlinearity_error_ppm,
                self.nonlinearity_sigma_ppm,
            ),
            misalignment("misalignment, mrad", self.misalignment_first_error_mrad),
            misalignment("misalignment across, mrad", self.misalignment_second_error_mrad),
        ];
        for (name, found, error, sigma) in others {
            let mut cells = vec![
                name.to_owned(),
                format!("{found:+.2}"),
                format!("+-{:.2}", NORMAL_95 * sigma),
                format!("{:+.2}", found - error),
                format!("{error:+.2}"),
                format!("{sigma:.2}"),
            ];
            cells.extend([const { String::new() }; 3]);
            table.push(cells);
        }
    }

    fn remarks(&self) -> String {
        format!(
            "{:.0} s of motor time, seed {}, gyroscope {}: {} intervals, and {} left out because the gyroscope was \
             saturated in them. The residuals tell {:.2} of the filter's variances of the reference clockwise and \
             {:.2} the other way; correlation of scale factor and bias {:+.2}. The gyroscope's random walk alone \
             allows, one sigma, {:.2} ppm of any scale factor at these rates and {:.2} deg/h of any bias in this time. \
             The reference was off by {:.1} milli-degrees rms; of the camera's errors that turn with the angle the fit \
             found {:.2} milli-degrees once and {:.2} twice a turn, each +-{:.2}. The misalignment is told by no turn \
             of this rotor: its interval is that of the data sheet.",
            self.motor_time_s,
            self.seed,
            self.serial,
            self.intervals,
            self.saturated_intervals,
            self.reference_factor_clockwise,
            self.reference_factor_counter_clockwise,
            self.correlation,
            self.walk_scale_factor_sigma_ppm,
            self.walk_bias_sigma_deg_h,
            self.reference_rms_mdeg,
            self.camera_once_mdeg,
            self.camera_twice_mdeg,
            NORMAL_95 * self.camera_sigma_mdeg
        )
    }
}

impl CalibrationSummary {
    fn table(&self) -> Table {
        let mut table = Table::new(&[
            "",
            "error rms",
            "sigma stated",
            "worst",
            "coning mean",
            "reference",
            "gyroscope",
            "in 95 %",
        ]);
        let of = |count: usize| format!("{count} of {}", self.runs);
        let mut row = |name: &str, [rms, stated, worst]: [f64; 3], parts: [f64; 3], covered| {
            let [coning, reference, gyroscope] = parts;
            table.push(vec![
                name.to_owned(),
                format!("{rms:.2}"),
                format!("{stated:.2}"),
                format!("{worst:.1}"),
                format!("{coning:+.2}"),
                format!("{reference:.2}"),
                format!("{gyroscope:.2}"),
                of(covered),
            ]);
        };
        let scale = [self.scale_factor_rms_ppm, self.scale_factor_stated_ppm, self.scale_factor_worst_ppm];
        let parts =
            [self.scale_factor_coning_ppm, self.scale_factor_reference_ppm, self.scale_factor_noise_ppm];
        row("scale factor, ppm", scale, parts, self.scale_factor_covered);
        let bias = [self.bias_rms_deg_h, self.bias_stated_deg_h, self.bias_worst_deg_h];
        let parts = [self.bias_coning_deg_h, self.bias_reference_deg_h, self.bias_noise_deg_h];
        row("bias, deg/h", bias, parts, self.bias_covered);
        let empty = [const { String::new() }; 6];
        table.push([vec!["both".to_owned()], empty.to_vec(), vec![of(self.pair_covered)]].concat());
        let mut other = |name: &str, errors: [String; 2], covered: String| {
            let empty = [const { String::new() }; 4];
            table.push([vec![name.to_owned()], errors.to_vec(), empty.to_vec(), vec![covered]].concat());
        };
        let errors = [self.nonlinearity_rms_ppm, self.nonlinearity_stated_ppm];
        other("non-linearity, ppm", errors.map(|error| format!("{error:.2}")), of(self.nonlinearity_covered));
        other(
            "misalignment",
            [const { String::new() }; 2],
            format!("{} of {}", self.misalignment_covered, 2 * self.runs),
        );
        table
    }

    fn remarks(&self, motor_times: &str) -> String {
        let (low, high) = self.covered_bounds;
        format!(
            "{} gyroscopes, drawn, on {} drawn motors; {motor_times} s of motor time each. {} scale factors are \
             within 10 ppm of the truth, and at the rates that were turned the gyroscope's random walk alone allows \
             {:.2} ppm, one sigma; the bias's error is {:.2} times what random walk alone allows in the time. Of {} \
             intervals at 95 % between {low} and {high} hold the truth in 95 % of such sets. The residuals tell {:.2} \
             of the filter's variances of the reference clockwise and {:.2} the other way, on average; {:.1} % of the \
             intervals were left out for saturation; the reference was off by {:.1} milli-degrees rms.",
            self.runs,
            self.motors,
            self.scale_factor_within_10_ppm,
            self.scale_factor_walk_ppm,
            self.bias_over_walk,
            self.runs,
            self.reference_factors[0],
            self.reference_factors[1],
            100.0 * self.saturated,
            self.reference_rms_mdeg
        )
    }
}

impl Calibrations {
    /// For the terminal.
    pub fn document(&self) -> Document {
        let first = &self.first.outcome;
        let mut blocks = vec![
            Block::Heading("Calibration of a gyroscope".to_owned()),
            Block::Table(first.table()),
            Block::Paragraph(ABOUT.to_owned()),
            Block::Heading("Budget of the scale factor".to_owned()),
            Block::Table(self.budget_table()),
            Block::Paragraph(budget::ABOUT.to_owned()),
            Block::Paragraph(format!(
                "{} The reference is the angle of the filter {}.",
                first.remarks(),
                self.filter
            )),
        ];
        blocks.push(Block::Paragraph(pilot::remarks(self.pilot_s, self.turn_plan.as_ref())));
        if self.outcomes.len() > 1 {
            let summary = self.summary();
            blocks.push(Block::Heading(format!("All {} calibrations", summary.runs)));
            blocks.push(Block::Table(summary.table()));
            blocks.push(Block::Paragraph(summary.remarks(&self.motor_times())));
        }
        if !self.beside.is_empty() {
            blocks.extend(self.side_by_side(FIRST).blocks());
        }
        Document { blocks }
    }

    /// The values of its page: over all runs, the first scene under `name`.
    pub fn page_values(&self, name: &str) -> Vec<PlacedValue> {
        let summary = self.summary();
        let first = &self.first.outcome;
        let mut values = vec![
            ("motor_time_s", format!("{:.0}", first.motor_time_s)),
            ("runs", summary.runs.to_string()),
            ("scale_rms_ppm", format!("{:.2}", summary.scale_factor_rms_ppm)),
            ("bias_rms_deg_h", format!("{:.2}", summary.bias_rms_deg_h)),
            ("within_10_ppm", summary.scale_factor_within_10_ppm.to_string()),
            ("pair_covered", summary.pair_covered.to_string()),
            ("bias_over_walk", format!("{:.2}", summary.bias_over_walk)),
            ("bias_walk_deg_h", format!("{:.2}", first.walk_bias_sigma_deg_h)),
            ("clockwise_deg_s", format!("{:.0}", self.schedule.fastest_deg_s[0])),
            ("table_calibration", summary.table().markdown()),
            ("table_budget", self.budget_table().markdown()),
            ("about_budget", budget::ABOUT.to_owned()),
            ("remarks", summary.remarks(&self.motor_times())),
            ("tilting_rms_ppm", self.tilting_range_ppm()),
        ];
        values.extend(self.side_by_side(name).page_values());
        values
    }

    /// The motor time in s of all calibrations: plans that are as long as their pilot says differ.
    fn motor_times(&self) -> String {
        let times_s = || self.outcomes.iter().map(|outcome| outcome.motor_time_s);
        let [least, most] = [times_s().fold(f64::INFINITY, f64::min), times_s().fold(0.0, f64::max)]
            .map(|time_s| format!("{time_s:.0}"));
        if least == most { least } else { format!("{least} to {most}") }
    }

    /// Root mean square error of the scale factor on the scenes beside the first: the least and the largest.
    fn tilting_range_ppm(&self) -> String {
        let rms = self.beside.iter().map(|other| other.found.summary().scale_factor_rms_ppm);
        let (low, high) =
            rms.fold((f64::INFINITY, 0.0_f64), |(low, high), rms| (low.min(rms), high.max(rms)));
        format!("{low:.0} to {high:.0}")
    }

    /// The first run, and with `over_runs` the figures over all, as one JSON object on one line.
    pub fn json(&self) -> String {
        let mut object = serde_json::to_value(&self.first.outcome).unwrap_or_default();
        object["filter"] = json!(self.filter);
        object["turn_plan"] = json!(self.turn_plan);
        object["over_runs"] = json!(self.summary());
        let beside = self.beside.iter().map(|other| {
            let mut row = json!(other.found.summary());
            row["beside"] = json!(other.name);
            row
        });
        object["beside"] = beside.collect();
        format!("{object}\n")
    }

    /// A row a run.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn csv(&self) -> Result<String, OutputError> {
        crate::report::files::csv(None, self.outcomes.iter())
    }
}
