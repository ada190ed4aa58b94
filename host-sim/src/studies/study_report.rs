//! What a study says of itself, in the form in which every command publishes it: as text, as pictures, as key figures
//! in JSON, and as an HTML report.
//!
//! A study fills in a [`StudyReport`]. The command adds what its scene sets, what the study cost, what is not modelled,
//! and how to repeat it.

use crate::report::chart::Figure;
use crate::report::document::{Block, Document};
use crate::report::html::HtmlReport;
use crate::report::key_figure::{self, KeyFigure};
use crate::run_reports::parts::bench_lines;
use simulation::runs::not_modelled::{not_modelled, not_modelled_in_open_loop};
use simulation::scene::Scene;

/// The report on a study.
#[derive(Clone, Debug)]
pub(crate) struct StudyReport {
    /// What was done, in a few words.
    pub(crate) title: String,
    /// What was found, in a sentence or two.
    pub(crate) verdict: String,
    /// What was asked beside the scene: what is said of what.
    pub(crate) asked: Vec<(&'static str, String)>,
    /// Pictures, each with the name of its SVG file.
    pub(crate) pictures: Vec<(String, Figure)>,
    /// Everything in words and tables; the text for the terminal.
    pub(crate) document: Document,
    /// The figures by which the result is judged.
    pub(crate) key_figures: Vec<KeyFigure>,
    /// How sure the result is, beside the intervals of its key figures: a paragraph each.
    pub(crate) sure: Vec<String>,
    /// Motor time of all runs in s, where the study knows it.
    pub(crate) motor_s: Option<f64>,
}

/// What a study cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StudyCost {
    /// Time on this machine, from the first run to the last, in s.
    pub(crate) wall_s: f64,
    /// Threads that shared the runs.
    pub(crate) threads: usize,
}

impl StudyReport {
    /// The report as a page. Without a scene the study is of the open loop, at the values of the paper. `reads` says
    /// which keys of the scene the command reads.
    pub(crate) fn page(
        &self,
        scene: Option<&Scene>,
        reads: &dyn Fn(&str) -> bool,
        cost: StudyCost,
    ) -> HtmlReport {
        let mut asked: Vec<(&str, String)> = self.asked.clone();
        asked.extend(scene.into_iter().flat_map(|scene| bench_lines(scene, reads)));
        let mut sure = Document { blocks: Vec::new() };
        if let Some(table) = key_figure::table(&self.key_figures) {
            sure.blocks.push(Block::Heading("Key figures with their intervals".to_owned()));
            sure.blocks.push(Block::Table(table));
        }
        HtmlReport {
            title: self.title.clone(),
            verdict: self.verdict.clone(),
            asked: Document::of_lines(asked),
            figures: self.pictures.iter().map(|(_, figure)| figure.clone()).collect(),
            happened: self.document.clone().without_title(),
            sure: sure.paragraphs(self.sure.iter().cloned()),
            cost: Document::of_lines(self.cost_lines(cost)),
            not_modelled: scene.map_or_else(not_modelled_in_open_loop, not_modelled),
        }
    }

    fn cost_lines(&self, cost: StudyCost) -> Vec<(&'static str, String)> {
        let threads = if cost.threads == 1 { "thread" } else { "threads" };
        let wall = format!("{:.2} s on {} {threads}", cost.wall_s, cost.threads);
        let Some(motor_s) = self.motor_s else { return vec![("time on this machine", wall)] };
        vec![
            ("motor time of all runs", format!("{motor_s:.2} s")),
            ("time on this machine", wall),
            ("speed", format!("{:.2} times real time", motor_s / cost.wall_s.max(1e-9))),
        ]
    }
}
