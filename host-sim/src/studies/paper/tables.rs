//! The reproduction as one document, for the terminal and as Markdown, and the values of its page.

use super::comparison::FigureComparison;
use super::finite_element::OtherStator;
use super::published::PaperSection;
use super::reproduction::{FigureRow, PaperReproduction, SimulatedTrend, StepRow};
use super::trend::LINEAR_CORRELATION;
use crate::report::document::{Block, Table};
use crate::report::page::PlacedValue;
use simulation::math::statistics::Spread;

pub use crate::report::document::Document;

impl PaperReproduction {
    /// The whole reproduction.
    pub fn document(&self) -> Document {
        let mut blocks = vec![Block::Heading("The published figures, simulated again".to_owned())];
        blocks.push(Block::Paragraph(format!(
            "Paper: Qu, Tang, Gianchandani, Oldham, Green, Sensors and Actuators A 223 (2015) 49-60. Ours: the paper's \
             law of friction, end-of-step impacts, a step of 1 us unless said otherwise, {}, {} \
             seeds each, f64. Collision frequency and amplitude: largest line below 5 kHz of the spectrum of the \
             vertical velocity, 20 kHz, last 16,384 samples. Rates are magnitudes, as printed. Each +- is one standard \
             deviation over the runs.",
            self.time, self.seeds
        )));
        blocks.push(Block::Paragraph(
            "Rule: a figure is within when |ours - paper| <= sd(paper) + sd(ours). A figure that fails this rule, but \
             passes it after ours is rounded to the digits that the paper prints, is judged as printed. A \
             stricter rule is z = |ours - paper| / sqrt(sd(paper)^2 + sd(ours)^2) <= 1. Where the paper \
             prints no spread (marked *), the relative spread of Table 2's first row is used: 22/448 for frequencies, \
             0.09/1.72 for rates."
                .to_owned(),
        ));
        blocks.push(Block::Paragraph(self.summary()));
        for place in [PaperSection::Table3, PaperSection::Table2, PaperSection::ToothAngle] {
            let of_place = self.rows.iter().filter(|row| row.place == place);
            blocks.push(Block::Heading(place.to_string()));
            blocks.push(Block::Table(figures(of_place)));
            blocks.extend(pictures_of(place));
        }
        blocks.push(Block::Heading("With the stator of finite elements".to_owned()));
        blocks.push(Block::Paragraph(self.finite_element_summary()));
        blocks.push(Block::Table(self.finite_element()));
        blocks.push(Block::Table(self.stator_parts()));
        blocks.push(Block::Table(self.shifted_stators()));
        blocks.extend(self.mode_b());
        for trend in &self.trends {
            blocks.extend(trend_blocks(trend));
        }
        Document { blocks }
    }

    /// The values of the page on the paper.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let tables = self.count(&[PaperSection::Table2, PaperSection::Table3]);
        let angles = self.count(&[PaperSection::ToothAngle]);
        let fem = self.count_finite_element();
        let rate_at = |row: Option<&StepRow>| row.map_or_else(String::new, |row| spread(row.rate_rad_s, 1));
        let by_place = |place| {
            let of_place = self.rows.iter().filter(|row| row.place == place && row.coarse.is_none());
            figures(of_place).markdown()
        };
        vec![
            ("seeds", self.seeds.to_string()),
            ("c_figures", tables.figures.to_string()),
            ("c_within", tables.within.to_string()),
            ("c_printed", tables.within_as_printed.to_string()),
            ("angle_figures", angles.figures.to_string()),
            ("angle_within", angles.within.to_string()),
            ("b_rate_coarse", rate_at(self.mode_b_steps.first())),
            ("b_rate_converged", rate_at(self.mode_b_steps.last())),
            ("table_3", by_place(PaperSection::Table3)),
            ("table_2", by_place(PaperSection::Table2)),
            ("table_tooth_angle", by_place(PaperSection::ToothAngle)),
            ("table_mode_b", self.mode_b_by_step().markdown()),
            ("fem_within", fem.within.to_string()),
            ("fem_figures", fem.figures.to_string()),
            ("table_fem", self.finite_element().markdown()),
            ("table_fem_parts", self.stator_parts().markdown()),
            ("table_fem_shifts", self.shifted_stators().markdown()),
            ("fem_shifts", self.shifted_stators.len().to_string()),
            ("fem_shifts_all", self.shifted_stators.iter().filter(|of| of.within() == 3).count().to_string()),
        ]
    }

    /// Both readings of the stator beside each figure of Tables 2 and 3.
    fn finite_element(&self) -> Table {
        let mut table = Table::new(&["motor", "figure", "paper", "published", "computed", "verdict"]);
        for (row, other) in self.rows.iter().filter_map(|row| Some((row, row.finite_element.as_ref()?))) {
            let (decimals, comparison) = (row.decimals, &other.comparison);
            table.push(vec![
                row.case.to_owned(),
                format!("{} {}", row.quantity, row.unit),
                paper(row),
                spread(row.comparison.ours, decimals),
                spread(comparison.ours, decimals),
                verdict_of(other).to_owned(),
            ]);
        }
        table
    }

    /// What each group of the stator's values changes.
    fn stator_parts(&self) -> Table {
        let mut table = Table::new(&["changed", "B rad/s", "B collision Hz", "C rad/s", "C collision Hz"]);
        for part in &self.stator_parts {
            let cells = part.modes.iter().flat_map(|[rate, line]| [spread(*rate, 2), spread(*line, 0)]);
            table.push(std::iter::once(part.changed.to_owned()).chain(cells).collect());
        }
        table
    }

    /// Mode C of Table 3 against the mode shift.
    fn shifted_stators(&self) -> Table {
        let mut table = Table::new(&[
            "mode shift of C deg",
            "collision Hz",
            "collision mm/s",
            "rate rad/s",
            "within, of 3",
        ]);
        for shifted in &self.shifted_stators {
            let mut line = vec![format!("{:.1}", shifted.mode_shift_deg)];
            line.extend(
                shifted.figures.iter().zip([0, 2, 2]).map(|(figure, decimals)| spread(figure.ours, decimals)),
            );
            line.push(shifted.within().to_string());
            table.push(line);
        }
        table
    }

    /// The figures of mode C in Tables 2 and 3 with the stator of finite elements, and how many are within.
    fn count_finite_element(&self) -> FigureCount {
        let of_mode_c = self.rows.iter().filter(|row| row.coarse.is_none());
        let found: Vec<FigureComparison> =
            of_mode_c.filter_map(|row| row.finite_element.as_ref()).map(|other| other.comparison).collect();
        FigureCount::of(&found)
    }

    /// One sentence: how many figures of mode C are within with the stator of finite elements.
    fn finite_element_summary(&self) -> String {
        let FigureCount { figures, within, within_as_printed, strict } = self.count_finite_element();
        format!(
            "Mode C, Tables 2 and 3, stator of finite elements: {within} of {figures} figures within, \
             {within_as_printed} more at the printed precision ({strict} with z <= 1)."
        )
    }

    /// The number of figures of mode C in `places`, and how many of them are within by each rule.
    fn count(&self, places: &[PaperSection]) -> FigureCount {
        let rows = self.rows.iter().filter(|row| row.coarse.is_none() && places.contains(&row.place));
        FigureCount::of(&rows.map(|row| row.comparison).collect::<Vec<_>>())
    }

    /// One paragraph: how many figures are within by each rule.
    pub fn summary(&self) -> String {
        let tables = self.count(&[PaperSection::Table2, PaperSection::Table3]);
        let angles = self.count(&[PaperSection::ToothAngle]);
        let sense = if self.rows.iter().all(|row| row.right_sense) {
            "In every run mode B turned clockwise and mode C counter-clockwise."
        } else {
            "NOT every run turned in the sense of its mode."
        };
        format!(
            "Mode C, Tables 2 and 3: {} of {} figures within, {} more at the printed precision ({} with z <= 1). Mode \
             C, tooth angle: {} of {} within, {} more at the printed precision ({} with z <= 1). Mode B: the paper's \
             rates are those of a coarse step. The converged model turns faster, see below. {sense}",
            tables.within,
            tables.figures,
            tables.within_as_printed,
            tables.strict,
            angles.within,
            angles.figures,
            angles.within_as_printed,
            angles.strict,
        )
    }

    /// Mode B against the step.
    fn mode_b(&self) -> Vec<Block> {
        let table = self.mode_b_by_step();
        let figures = at_three_steps(self.rows.iter());
        let heading = Block::Heading("Mode B and the step".to_owned());
        let mut blocks = vec![heading, Block::Table(figures), Block::Table(table)];
        if let (Some(coarse), Some(fine)) = (self.mode_b_steps.first(), self.mode_b_steps.last()) {
            blocks.push(Block::Paragraph(format!(
                "The published 8.16 rad/s is the rate of a coarse step. An impact at the end of its step comes late, \
                 and a late impact has another friction impulse. At {} us the rate is {} rad/s. At {} us the model \
                 has converged: {} rad/s, faster than the paper's. The rotor of the experiment turns with 1 rad/s. \
                 It wobbles, tilts and touches the hub, which the paper's model leaves out. The collision amplitude \
                 is about twice the paper's at every step: the largest line of a broad spectrum falls with the \
                 length of the record, which the paper does not state.",
                round(1e6 * coarse.step_s),
                spread(coarse.rate_rad_s, 2),
                round(1e6 * fine.step_s),
                spread(fine.rate_rad_s, 2),
            )));
        }
        blocks
            .push(Block::Picture("Rate in mode B against the step".to_owned(), "mode_b_step.svg".to_owned()));
        blocks
    }

    /// Mode B at each step, paper and experiment.
    fn mode_b_by_step(&self) -> Table {
        let mut table =
            Table::new(&["step", "collision frequency Hz", "collision amplitude mm/s", "rate rad/s"]);
        for StepRow { step_s, collision_frequency_hz, collision_amplitude_mm_s, rate_rad_s } in
            &self.mode_b_steps
        {
            table.push(vec![
                format!("{} us", round(1e6 * step_s)),
                spread(*collision_frequency_hz, 0),
                spread(*collision_amplitude_mm_s, 2),
                spread(*rate_rad_s, 2),
            ]);
        }
        table.push(["paper", "88.8 +- 7.1", "4.08 +- 1.17", "8.16 +- 0.80"].map(str::to_owned).to_vec());
        table.push(["experiment", "76 +- 20", "3.94 +- 0.57", "about 1"].map(str::to_owned).to_vec());
        table
    }
}

/// The number of printed figures, and how many of them are within.
struct FigureCount {
    figures: usize,
    within: usize,
    within_as_printed: usize,
    strict: usize,
}

impl FigureCount {
    fn of(comparisons: &[FigureComparison]) -> Self {
        let count = |is: fn(&FigureComparison) -> bool| comparisons.iter().filter(|of| is(of)).count();
        Self {
            figures: comparisons.len(),
            within: count(|comparison| comparison.within),
            within_as_printed: count(|comparison| !comparison.within && comparison.within_as_printed),
            strict: count(FigureComparison::within_root_sum_of_squares),
        }
    }
}

/// The pictures that belong to a table.
fn pictures_of(place: PaperSection) -> Vec<Block> {
    let pictures: &[(&str, &str)] = match place {
        PaperSection::Table3 => &[
            ("Motion in mode B (as Figs 5 and 6)", "motion_mode_b.svg"),
            ("Motion in mode C (as Figs 5 and 6)", "motion_mode_c.svg"),
            ("Spin-up of both modes (as Fig. 7)", "spin_up.svg"),
            ("Spectra of the vertical motion (as Fig. 9)", "spectra.svg"),
        ],
        PaperSection::Table2 | PaperSection::ToothAngle => &[],
    };
    pictures.iter().map(|(title, file)| Block::Picture((*title).to_owned(), (*file).to_owned())).collect()
}

fn figures<'a>(rows: impl Iterator<Item = &'a FigureRow>) -> Table {
    let rows: Vec<&FigureRow> = rows.collect();
    let mut table = Table::new(&["motor", "figure", "paper", "experiment", "ours", "off by", "z", "verdict"]);
    for row in &rows {
        let decimals = row.decimals;
        let comparison = &row.comparison;
        table.push(vec![
            row.case.to_owned(),
            format!("{} {}", row.quantity, row.unit),
            paper(row),
            experiment(row),
            spread(comparison.ours, decimals),
            format!("{:+.decimals$}", comparison.ours.mean - comparison.paper.mean),
            format!("{:.2}", comparison.z),
            verdict(row).to_owned(),
        ]);
    }
    if rows.iter().any(|row| row.experiment.is_some()) { table } else { table.without("experiment") }
}

fn verdict(row: &FigureRow) -> &'static str {
    let within =
        |comparison: &Option<FigureComparison>| comparison.is_some_and(|comparison| comparison.within);
    match (row.right_sense, row.comparison.within) {
        (false, _) => "WRONG SENSE",
        (true, true) => "within",
        (true, false) if row.comparison.within_as_printed => "as printed",
        (true, false) if within(&row.coarse) => "outside; within at 10 us",
        (true, false) if row.coarse.is_some() => "OUTSIDE at either step",
        (true, false) => "OUTSIDE",
    }
}

/// The verdict on a figure with the stator of finite elements.
fn verdict_of(other: &OtherStator) -> &'static str {
    match (other.right_sense, other.comparison.within) {
        (false, _) => "WRONG SENSE",
        (true, true) => "within",
        (true, false) if other.comparison.within_as_printed => "as printed",
        (true, false) => "OUTSIDE",
    }
}

/// Every figure of mode B at three steps.
fn at_three_steps<'a>(rows: impl Iterator<Item = &'a FigureRow>) -> Table {
    let header = ["motor", "figure", "paper", "10 us", "z", "1 us", "z", "0.1 us", "z"];
    let mut table = Table::new(&header);
    for row in rows {
        let cells = |comparison: &FigureComparison| {
            [spread(comparison.ours, row.decimals), format!("{:.2}", comparison.z)]
        };
        let (Some(coarse), Some(converged)) = (&row.coarse, &row.converged) else { continue };
        let mut line = vec![row.case.to_owned(), format!("{} {}", row.quantity, row.unit), paper(row)];
        line.extend([coarse, &row.comparison, converged].into_iter().flat_map(cells));
        table.push(line);
    }
    table
}

/// What the paper's model gave.
fn paper(row: &FigureRow) -> String {
    let star = if row.comparison.spread_borrowed { "*" } else { "" };
    spread(row.comparison.paper, row.decimals) + star
}

/// What the paper's experiment gave.
fn experiment(row: &FigureRow) -> String {
    match row.experiment {
        Some((mean, Some(sd))) => spread(Spread { mean, sd }, row.decimals),
        Some((mean, None)) => format!("about {mean}"),
        None => String::new(),
    }
}

fn trend_blocks(trend: &SimulatedTrend) -> Vec<Block> {
    let header = ["figure", "paper", "ours: slope", "% per %", "correlation", "line from", "to", "verdict"];
    let mut table = Table::new(&header);
    let (unit, per_si) = trend.trend.unit;
    let (low, high) = (trend.trend.range.0 * per_si, trend.trend.range.1 * per_si);
    let middle = 0.5 * (low + high);
    for course in &trend.courses {
        let line = course.line;
        let at = |x: f64| line.intercept + line.slope * x;
        table.push(vec![
            format!("{} {}", course.quantity, course.unit),
            (if course.paper_rises { "rises" } else { "falls" }).to_owned(),
            format!("{:+.3} {} per {unit}", line.slope, course.unit),
            format!("{:+.2}", line.slope * middle / at(middle)),
            format!("{:+.3}", line.correlation),
            format!("{:.2}", at(low)),
            format!("{:.2}", at(high)),
            course.verdict().to_owned(),
        ]);
    }
    let file = format!("trend_{}.svg", trend.varied.replace(' ', "_"));
    vec![
        Block::Heading(format!("Fig. {}: {} (mode C, mode shift -2.5 deg)", trend.picture, trend.varied)),
        Block::Table(table),
        Block::Paragraph(format!(
            "Varied from {low:.2} to {high:.2} {unit} in nine values. The line is the least-squares line through the \
             means, % per % is its relative slope in the middle. A correlation of the means of {LINEAR_CORRELATION} \
             or more counts as roughly linear."
        )),
        Block::Picture(format!("Against {} (as Fig. {})", trend.varied, trend.picture), file),
    ]
}

fn spread(spread: Spread, decimals: usize) -> String {
    format!("{:.decimals$} +- {:.decimals$}", spread.mean, spread.sd)
}

/// Removes the rounding of a step in microseconds: it is a round number in decimal, but not in binary.
fn round(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::paper::published::{PaperSection, Printed, Quantity};
    use crate::studies::paper::runs::RunTime;

    /// A rate printed as 1.72 +- 0.09, with ours at three steps as given.
    fn row(ours: f64, coarse: Option<f64>) -> FigureRow {
        let printed = Printed { mean: 1.72, sd: Some(0.09) };
        let compared = |mean| FigureComparison::new(Quantity::Rate, printed, Spread { mean, sd: 0.02 });
        FigureRow {
            place: PaperSection::Table3,
            case: "mode",
            quantity: Quantity::Rate,
            unit: "rad/s",
            decimals: 2,
            experiment: Some((1.4, None)),
            comparison: compared(ours),
            right_sense: true,
            coarse: coarse.map(compared),
            converged: coarse.map(|_| compared(ours)),
            finite_element: None,
        }
    }

    #[test]
    fn exact_verdicts_in_words() {
        assert_eq!(verdict(&row(1.80, None)), "within");
        assert_eq!(verdict(&row(1.833, None)), "as printed");
        assert_eq!(verdict(&row(1.84, None)), "OUTSIDE");
        assert_eq!(verdict(&row(1.84, Some(1.70))), "outside; within at 10 us");
        assert_eq!(verdict(&row(1.84, Some(1.84))), "OUTSIDE at either step");
        assert_eq!(verdict(&FigureRow { right_sense: false, ..row(1.72, None) }), "WRONG SENSE");
    }

    /// A verdict on the stator of finite elements is its own: that of the published reading does not count.
    #[test]
    fn exact_verdicts_on_the_other_stator() {
        let other = |mean: f64, right_sense: bool| {
            verdict_of(&OtherStator { comparison: row(mean, None).comparison, right_sense })
        };
        assert_eq!(other(1.80, true), "within");
        assert_eq!(other(1.833, true), "as printed");
        assert_eq!(other(2.3, true), "OUTSIDE");
        assert_eq!(other(1.72, false), "WRONG SENSE");
        let comparison = row(2.3, None).comparison;
        let rows = vec![FigureRow {
            finite_element: Some(OtherStator { comparison, right_sense: true }),
            ..row(1.72, None)
        }];
        let paper = PaperReproduction {
            seeds: 5,
            time: RunTime::FULL,
            rows,
            mode_b_steps: vec![],
            trends: vec![],
            stator_parts: vec![],
            shifted_stators: vec![],
        };
        assert!(paper.finite_element_summary().contains(": 0 of 1 figures within"));
        assert!(paper.summary().contains("Tables 2 and 3: 1 of 1 figures within"));
        let text = paper.finite_element().text();
        assert!(text.contains("2.30 +- 0.02") && text.contains("OUTSIDE"), "{text}");
    }

    #[test]
    fn exact_a_figure_beside_the_printed_one() {
        let rows = [row(1.70, None)];
        let text = figures(rows.iter()).text();
        let line = text.lines().nth(2).unwrap();
        let words: Vec<&str> = line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect();
        let wanted =
            ["mode", "rate rad/s", "1.72 +- 0.09", "about 1.4", "1.70 +- 0.02", "-0.02", "0.22", "within"];
        assert_eq!(words, wanted);
    }
}
