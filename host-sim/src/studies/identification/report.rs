//! The report on an identification.

use super::outcome::{Identification, MeasuredStatistic};
use crate::report::chart::Figure;
use crate::report::document::{Block, Document, Table};
use crate::report::html::HtmlReport;
use analysis::identification::emulator::TOLD;

/// The report on what was identified in `wall_s` s.
pub(crate) fn report(found: &Identification, wall_s: f64) -> HtmlReport {
    let mut figures = Vec::new();
    if !found.sample.is_empty() {
        let posterior = Figure::new("What the recordings tell of each parameter")
            .caption("Grey: what was known before. Blue: after. Below: pairs that are told together.");
        figures.push(found.posterior_panels().into_iter().fold(posterior, Figure::panel));
        figures.push(Figure::new("The recordings beside motors of the posterior").panel(found.fit_panel()));
    }
    let told = found.told.len();
    HtmlReport {
        title: "A motor's parameters from recordings".to_owned(),
        verdict: format!("{told} of {} parameters are told by these recordings.", found.parameters.len()),
        asked: Document::of_lines([
            ("recordings", found.logs.join(", ")),
            ("rotor", found.rotor.replace('_', " ")),
            ("known before", format!("the tolerances of the design, {} times as wide", found.prior_width)),
        ]),
        figures,
        happened: Document { blocks: vec![Block::Heading("Parameters".to_owned()), Block::Table(found.table())] },
        sure: sure(found),
        cost: Document::of_lines([
            ("motors drawn", found.motors.to_string()),
            ("time", format!("{wall_s:.1} s on this machine")),
        ]),
        not_modelled: vec![
            "Everything that the model of the motor leaves out, and everything that the scene does not say of the \
             instruments."
                .to_owned(),
            "In the scene that is written the parameters are independent of each other; the pictures show which are \
             not."
                .to_owned(),
        ],
    }
}

fn sure(found: &Identification) -> Document {
    let mut statistics = Table::new(&["statistic", "measured", "predicted", "standard deviation"]);
    for MeasuredStatistic { name, measured, predicted, sd } in found.drawn_statistics() {
        let cells = [measured, predicted, sd].map(|value| format!("{value:.4}"));
        statistics.push([vec![name.clone()], cells.to_vec()].concat());
    }
    let promise = format!(
        "Intervals hold the truth in 90 % of motors that were drawn and forgotten: see docs/results/identification.md. \
         A parameter is told if its standard deviation is expected below {:.0} % of that before.",
        100.0 * TOLD
    );
    let damage = found.damage.iter().map(|damage| Block::Paragraph(format!("{damage}; read up to there.")));
    let mut blocks: Vec<Block> = damage.collect();
    blocks.push(Block::Paragraph(promise));
    if !found.fit.is_empty() {
        blocks.push(Block::Paragraph(found.fit_sentence()));
    }
    blocks.extend(found.advice().into_iter().map(Block::Paragraph));
    blocks.push(Block::Heading("Statistics that are furthest off".to_owned()));
    blocks.push(Block::Table(statistics));
    Document { blocks }
}
