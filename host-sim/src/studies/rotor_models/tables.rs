//! The comparison as text and Markdown, and the values of its page.

use motor_model::DriveMode;

use super::draws::{DRAWN, DrawnRotor, rank_correlation};
use super::measured::{MeasuredRun, QUANTITIES, agrees, cell, experiment, spread};
use super::{MODES, RotorModels, changes, draws};
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::studies::paper::published::Quantity;
use simulation::math::count::real;

/// Standard errors of a rank correlation of unrelated values, `1 / sqrt(n)`, from which it counts.
const SIGNIFICANT: f64 = 3.0;

/// What the experiment measured.
fn experiment_cell(mode: DriveMode, quantity: Quantity) -> String {
    match experiment(mode, quantity) {
        (mean, Some(sd)) => format!("{mean} +- {sd}"),
        (mean, None) => format!("about {mean}"),
    }
}

impl RotorModels {
    /// The whole comparison.
    pub fn document(&self) -> Document {
        let mut blocks = vec![Block::Heading("Rotors that tilt, beside the experiment".to_owned())];
        blocks.push(Block::Paragraph(format!(
            "Rates in the sense of the mode. Line: largest line below 5 kHz of the vertical velocity at the centre. \
             {} seeds each, {}. Each +- is one standard deviation over the runs.",
            self.seeds, self.time
        )));
        for mode in [0, 1] {
            blocks.push(Block::Heading(format!("Mode {:?}", MODES[mode])));
            blocks.push(Block::Table(self.side_by_side(mode)));
        }
        blocks.push(Block::Picture("Experiment and rotors".to_owned(), "rotors.svg".to_owned()));
        blocks.push(Block::Heading("What would test it".to_owned()));
        blocks.push(Block::Picture("Rate of mode B".to_owned(), "mode_b_predictions.svg".to_owned()));
        if !self.changed.is_empty() {
            blocks.push(Block::Heading("One change at a time".to_owned()));
            blocks.push(Block::Paragraph(format!("{} seeds each.", self.change_seeds)));
            blocks.extend(self.changed.iter().map(|rotors| Block::Table(changes::table(rotors))));
        }
        if !self.drawn.is_empty() {
            blocks.push(Block::Heading(format!("{} drawn rotors", self.drawn.len())));
            blocks.push(Block::Table(self.agreeing()));
            blocks.push(Block::Table(self.figures_met()));
            blocks.push(Block::Picture("Which rotors agree".to_owned(), "drawn_rates.svg".to_owned()));
            blocks.push(Block::Table(self.correlations()));
            blocks.push(Block::Picture("What decides".to_owned(), "drawn_rotors.svg".to_owned()));
        }
        Document { blocks }
    }

    /// Every rotor in one mode, the experiment first.
    fn side_by_side(&self, mode: usize) -> Table {
        let mut table = Table::new(&[
            "rotor",
            "rate rad/s",
            "collision Hz",
            "collision mm/s",
            "rim mm/s",
            "tilt mrad",
            "hub /s",
            "reversed %",
        ]);
        let mut first = vec!["experiment".to_owned()];
        first.extend(QUANTITIES.map(|quantity| experiment_cell(MODES[mode], quantity)));
        first.extend([const { String::new() }; 4]);
        table.push(first);
        for variant in &self.variants {
            let runs = &variant.runs[mode];
            let mean = |value: fn(&MeasuredRun) -> f64| spread(runs, value).mean;
            table.push(vec![
                variant.name.to_owned(),
                cell(runs, 2, |run| run.rate_rad_s),
                cell(runs, 0, |run| run.collision_frequency_hz),
                cell(runs, 2, |run| run.collision_amplitude_mm_s),
                cell(runs, 1, |run| run.rim_amplitude_mm_s),
                format!("{:.1}", mean(|run| run.tilt_rms_mrad)),
                format!("{:.0}", mean(|run| run.hub_contacts_per_s)),
                format!("{:.0}", 100.0 * mean(|run| run.reversed_share)),
            ]);
        }
        table
    }

    /// One of the tables of changed rotors, empty if it was not asked for.
    fn changed_table(&self, index: usize) -> String {
        self.changed.get(index).map_or_else(String::new, |rotors| changes::table(rotors).markdown())
    }

    /// Number of drawn rotors that `holds` of.
    fn count(&self, holds: impl Fn(&[[bool; 3]; 2]) -> bool) -> usize {
        self.drawn.iter().filter(|rotor| holds(&rotor.agreements())).count()
    }

    /// How many of the drawn rotors agree with the experiment.
    fn agreeing(&self) -> Table {
        let mut table = Table::new(&["figures that agree", "mode B", "mode C", "both"]);
        let row = |name: &str, holds: fn(&[bool; 3]) -> bool| {
            let counts = [
                self.count(|[b, _]| holds(b)),
                self.count(|[_, c]| holds(c)),
                self.count(|[b, c]| holds(b) && holds(c)),
            ];
            std::iter::once(name.to_owned()).chain(counts.map(|count| count.to_string())).collect()
        };
        table.push(row("rate", |figures| figures[0]));
        table.push(row("frequency and amplitude", |figures| figures[1] && figures[2]));
        table.push(row("all", |figures| figures.iter().all(|agrees| *agrees)));
        table
    }

    /// How many drawn rotors agree in how many figures.
    fn figures_met(&self) -> Table {
        let mut table = Table::new(&["figures that agree, of six", "rotors"]);
        for met in (0..=6).rev() {
            let rotors = self.drawn.iter().filter(|rotor| rotor.figures_met() == met).count();
            table.push(vec![met.to_string(), rotors.to_string()]);
        }
        table
    }

    /// Number of stators with which some drawn rotor agrees in as many figures as any does.
    fn best_stators(&self) -> String {
        let most = self.drawn.iter().map(DrawnRotor::figures_met).max().unwrap_or(0);
        let best = self.drawn.iter().filter(|rotor| rotor.figures_met() == most);
        let mut stators: Vec<usize> = best.map(|rotor| rotor.stator).collect();
        stators.sort_unstable();
        stators.dedup();
        stators.len().to_string()
    }

    /// Least, middle and largest rate of a mode over the drawn rotors.
    fn rates_of_drawn(&self, mode: usize) -> [f64; 3] {
        let mut rates: Vec<f64> = self.drawn.iter().map(|rotor| rotor.runs[mode].rate_rad_s).collect();
        rates.sort_by(f64::total_cmp);
        let at = |index: usize| rates.get(index).copied().unwrap_or(f64::NAN);
        [at(0), at(rates.len() / 2), at(rates.len().saturating_sub(1))]
    }

    /// Rank correlation of a drawn value with the rate of a mode.
    pub fn correlation(&self, key: usize, mode: usize) -> f64 {
        let pairs: Vec<(f64, f64)> =
            self.drawn.iter().map(|rotor| (rotor.values[key], rotor.runs[mode].rate_rad_s)).collect();
        rank_correlation(&pairs)
    }

    /// Least rank correlation that is not chance.
    pub fn significant(&self) -> f64 {
        SIGNIFICANT / motor_model::math::sqrt(real(self.drawn.len()).max(1.0))
    }

    /// How far each drawn value decides the rates, and where it lies in the rotors that agree in all figures.
    fn correlations(&self) -> Table {
        let mut table =
            Table::new(&["value", "known by", "drawn from", "to", "where all agree", "rate B", "rate C"]);
        let all = |rotor: &&DrawnRotor| rotor.agreements().iter().flatten().all(|agrees| *agrees);
        let agreeing: Vec<&DrawnRotor> = self.drawn.iter().filter(all).collect();
        for (index, key) in DRAWN.iter().enumerate() {
            let values = || agreeing.iter().map(|rotor| rotor.values[index]);
            let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
            let range = if agreeing.is_empty() || key.range().0 < 0.0 {
                let most = values().fold(f64::NEG_INFINITY, f64::max);
                if agreeing.is_empty() { "none".to_owned() } else { format!("{least:.3} to {most:.3}") }
            } else {
                format!("{} to {}", figure(least), figure(most))
            };
            table.push(vec![
                key.name.to_owned(),
                key.known.words().to_owned(),
                figure(key.range().0),
                figure(key.range().1),
                range,
                format!("{:+.2}", self.correlation(index, 0)),
                format!("{:+.2}", self.correlation(index, 1)),
            ]);
        }
        table
    }

    /// The drawn values that decide the rate of a mode, the strongest first, in words.
    fn deciding(&self, mode: usize) -> String {
        let mut deciding: Vec<(f64, &str)> = DRAWN
            .iter()
            .enumerate()
            .map(|(index, key)| (self.correlation(index, mode), key.name))
            .filter(|(correlation, _)| correlation.abs() > self.significant())
            .collect();
        deciding.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let words: Vec<String> =
            deciding.iter().map(|(correlation, name)| format!("{name} ({correlation:+.2})")).collect();
        if words.is_empty() { "none".to_owned() } else { words.join(", ") }
    }

    /// The drawn values that decide neither rate.
    fn undeciding(&self) -> String {
        let names: Vec<&str> = DRAWN
            .iter()
            .enumerate()
            .filter(|(index, _)| {
                [0, 1].iter().all(|&mode| self.correlation(*index, mode).abs() <= self.significant())
            })
            .map(|(_, key)| key.name)
            .collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }

    /// The values of the page.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let rate = |variant: usize, mode: usize| {
            spread(&self.variants[variant].runs[mode], |run| run.rate_rad_s).mean
        };
        let fastest = |rotor: &str| -> String {
            let drive = self.predictions.iter().find(|of| of.rotor == rotor && of.title == "Drive");
            let rates = drive.into_iter().flat_map(|of| &of.points);
            rates
                .map(|(amplitude, runs)| (spread(runs, |run| run.rate_rad_s).mean, *amplitude))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .map_or_else(String::new, |(_, amplitude)| amplitude.to_string())
        };
        let all = |figures: &[bool; 3]| figures.iter().all(|agrees| *agrees);
        let [drawn_rates_b, drawn_rates_c] = [0, 1].map(|mode| self.rates_of_drawn(mode));
        let agreeing = |variant: usize| {
            let figures = MODES.into_iter().enumerate().flat_map(|(index, mode)| {
                let runs = &self.variants[variant].runs[index];
                QUANTITIES.map(|quantity| agrees(mode, quantity, spread(runs, |run| run.get(quantity)).mean))
            });
            figures.filter(|agrees| *agrees).count()
        };
        vec![
            ("seeds", self.seeds.to_string()),
            ("table_b", self.side_by_side(0).markdown()),
            ("table_c", self.side_by_side(1).markdown()),
            ("b_height_only", format!("{:.1}", rate(0, 0))),
            ("b_no_pin", format!("{:.1}", rate(1, 0))),
            ("b_set_f", format!("{:.1}", rate(3, 0))),
            ("b_set_g", format!("{:.1}", rate(4, 0))),
            ("c_set_f", format!("{:.2}", rate(3, 1))),
            ("c_set_g", format!("{:.2}", rate(4, 1))),
            ("c_set_h", format!("{:.2}", rate(5, 1))),
            ("b_fem", format!("{:.1}", rate(6, 0))),
            ("c_fem", format!("{:.2}", rate(6, 1))),
            ("agreeing_h", agreeing(5).to_string()),
            ("agreeing_fem", agreeing(6).to_string()),
            ("fastest_f", fastest("set F")),
            ("fastest_h", fastest("set H")),
            ("change_seeds", self.change_seeds.to_string()),
            ("table_changed_sets", self.changed_table(0)),
            ("table_changed_nominal", self.changed_table(1)),
            ("stators", draws::stators().0.to_string()),
            ("stators_flat", draws::stators().1.to_string()),
            ("stators_best", self.best_stators()),
            ("drawn_most", self.drawn.iter().map(DrawnRotor::figures_met).max().unwrap_or(0).to_string()),
            ("drawn", self.drawn.len().to_string()),
            ("drawn_b", self.count(|[b, _]| b[0]).to_string()),
            ("drawn_c", self.count(|[_, c]| c[0]).to_string()),
            ("drawn_all", self.count(|[b, c]| all(b) && all(c)).to_string()),
            ("drawn_b_all", self.count(|[b, _]| all(b)).to_string()),
            ("drawn_c_all", self.count(|[_, c]| all(c)).to_string()),
            ("drawn_b_middle", format!("{:.1}", drawn_rates_b[1])),
            ("drawn_c_least", format!("{:.2}", drawn_rates_c[0])),
            ("drawn_c_middle", format!("{:.2}", drawn_rates_c[1])),
            ("drawn_c_most", format!("{:.2}", drawn_rates_c[2])),
            ("table_met", self.figures_met().markdown()),
            ("table_agreeing", self.agreeing().markdown()),
            ("table_correlations", self.correlations().markdown()),
            ("deciding_b", self.deciding(0)),
            ("deciding_c", self.deciding(1)),
            ("undeciding", self.undeciding()),
        ]
    }
}

/// Three significant digits.
fn figure(value: f64) -> String {
    simulation::math::plain_number::plain(format!("{value:.2e}").parse().unwrap_or(value))
}
